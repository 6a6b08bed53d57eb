"""Partial slip over the cells of a face: first loading, parallel elements, state at a reversal.

Cells yield at fixed tractions. Slip zones only grow within a stroke, so each displacement of the first loading is one
bounded problem from rest, and Masing's rule gives the other strokes.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contact.bounded import BoundedProblem, BoundedSolution, solve_bounded
from ..contact.cells import CellCompliance
from ..core import NotConverged, PatchfemError, frozen_array

OPEN = 0  # State of a cell without contact
STICK = 1  # State of a cell in contact below its friction limit
SLIP = 2  # State of a cell at its friction limit
# Number of cells along the face per displacement of the first loading, so that the changes between grids contain the error
# of its curve: with 16 displacements on every grid 43 of 60 loop areas held
CELLS_PER_LEVEL = 8
# Largest wrong displacement of a cell, relative to the largest one; the error of the force is about its square
SLIP_RESIDUAL_TOL = 1e-7


class FirstLoading(NamedTuple):
    """First loading of a face from rest to gross slip at n displacements of the holder.

    - displacement (n + 1,): Displacements [m] from 0 to gross slip.
    - force (n + 1, a): Friction forces [N] of the cells in contact.
    - work (n + 1,): Work [J] of the holder, from which the loop area follows.
    """

    displacement: np.ndarray
    force: np.ndarray
    work: np.ndarray


class SpringSliders(NamedTuple):
    """Parallel springs in series with sliders that have the curve of a first loading.

    - stiffness (t,): [N/m].
    - yield_displacement (t,): [m], increasing.
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray


class LevelForces:
    """Forces of cells as a linear function of the stretches of parallel elements, like a matrix (a, t).

    By Masing's rule every state is a superposition of first loadings: between two displacements of the first loading, each
    cell gets its part of the force of the elements that yield between them. So the forces of the cells add up to that of
    the elements.

    Parameters
    ----------
    loading : FirstLoading
        First loading of the a cells.
    sliders : SpringSliders
        The t elements that have its curve.
    """

    def __init__(self, loading: FirstLoading, sliders: SpringSliders):
        displacement, force, _ = loading
        stiffness, yields = sliders
        self.change = np.diff(force, axis=0)
        self.limit = force[-1]
        self.yield_steps = np.diff(yields, prepend=0.0)

        # Part of the force between two displacements that is carried between two yields
        def find_force(position: np.ndarray) -> np.ndarray:
            """Return the force [N] of the elements on first loading to displacements [m]."""
            return np.minimum.outer(position, yields) @ stiffness

        levels = find_force(displacement)[:, None]
        carried = np.diff(np.clip(find_force(yields), levels[:-1], levels[1:]), prepend=levels[:-1])
        self.fractions = carried / carried.sum(axis=1, keepdims=True)

    def __matmul__(self, stretch: np.ndarray) -> np.ndarray:
        """Return the forces (a,) [N] of the cells at stretches (t,) [m] of the elements."""
        factors = self.fractions @ (np.diff(stretch, prepend=0.0) / self.yield_steps)
        # Beside a corner the traction of a sticking cell may fall a little while its neighbours slip
        return np.clip(factors @ self.change, -self.limit, self.limit)


@dataclass(frozen=True, eq=False)
class CellElements:
    """Parallel elements of a face whose cells yield at their friction limits, with the names of a `JenkinsSet`.

    - points, limit (a,): Cells in contact, and their friction limits [N].
    - loading: First loading of these cells.
    - stiffness, yield_displacement (t,): [N/m] and [m].
    - force_matrix: Forces of the cells in contact per stretch of the elements.
    """

    points: np.ndarray
    limit: np.ndarray
    loading: FirstLoading
    stiffness: np.ndarray
    yield_displacement: np.ndarray
    force_matrix: LevelForces


class ReversalState(NamedTuple):
    """State of m cells at the reversal of steady cycles.

    - status (m,): OPEN, STICK or SLIP.
    - slip_per_cycle (m,): Path of the slip of each cell in a cycle [m].
    """

    status: np.ndarray
    slip_per_cycle: np.ndarray

    @property
    def stick_fraction(self) -> float:
        """Fraction of the cells in contact that stick."""
        return float((self.status[self.status != OPEN] == STICK).mean())


def find_first_loading(compliance: CellCompliance, limit: np.ndarray) -> FirstLoading:
    """Find the forces of the cells over the displacement of the holder, from rest to gross slip.

    Parameters
    ----------
    compliance : CellCompliance
        Shear compliance of the cells.
    limit : (ny, nx) ndarray
        Friction limit [Pa] of each cell; 0 without contact.

    Returns
    -------
    FirstLoading

    Raises
    ------
    PatchfemError
        If no cell carries load.
    NotConverged
        If the tractions are not found.
    """
    is_closed = limit > 0
    if not is_closed.any():
        raise PatchfemError(
            "contact.shear: the friction limit is 0 at every point of the contact; "
            "raise friction.static or the load, or leave out [contact.shear]"
        )
    gross_slip = float(compliance.product(limit)[is_closed].max())
    n_levels = max(limit.shape) // CELLS_PER_LEVEL
    # Those of a grid of 32 cells are the fewest
    displacements = gross_slip * _space_evenly_at_ends(max(n_levels, 4))
    force = np.zeros((displacements.size, np.count_nonzero(is_closed)))
    work = np.zeros(displacements.size)
    traction = np.zeros(limit.shape)
    for k, displacement in enumerate(displacements[1:], 1):
        solution = slip_from_rest(compliance, limit, displacement, traction)
        traction = solution.traction
        force[k] = traction[is_closed] * compliance.cell_area
        # The work is minus the least energy, which changes by minus the force per displacement
        work[k] = np.vdot(traction, displacement - solution.slope) / 2 * compliance.cell_area
    return FirstLoading(*map(frozen_array, (displacements, force, work)))


def _space_evenly_at_ends(count: int) -> np.ndarray:
    """Return numbers (count + 1,) from 0 to 1 that are denser at both ends, where the curve bends most."""
    s = np.arange(count + 1) / count
    return s * s * (3 - 2 * s)


def slip_from_rest(
    compliance: CellCompliance, limit: np.ndarray, displacement: float, start=None
) -> BoundedSolution:
    """Solve for the shear tractions after a first loading to a displacement of the holder.

    Slip zones only grow in it, so the way does not matter: the elastic energy minus the work of the holder is least.

    Parameters
    ----------
    compliance : CellCompliance
        Shear compliance of the cells.
    limit : (ny, nx) ndarray
        Friction limits [Pa].
    displacement : float
        Displacement of the holder [m].
    start : (ny, nx) ndarray, optional
        Traction [Pa] from which the solution starts.

    Returns
    -------
    BoundedSolution
        Its slope is minus the slip.

    Raises
    ------
    NotConverged
        If the tractions are not found.
    """
    # Rigid pieces on a spring share its force by their limits
    if compliance.is_rigid:
        gross_slip = compliance.product(limit).max()
        traction = min(displacement / gross_slip, 1.0) * limit
        slope = compliance.product(traction) - displacement
        return BoundedSolution(traction, np.zeros(0), slope, 0, 0.0)

    problem = BoundedProblem(np.full(limit.shape, -displacement), -limit, limit)
    solution = solve_bounded(compliance, problem, start, SLIP_RESIDUAL_TOL)
    if not solution.residual <= SLIP_RESIDUAL_TOL:
        raise NotConverged(
            f"contact: partial slip did not converge; after {solution.n_iterations} steps the displacement "
            f"is wrong by {solution.residual:.1e} of the largest one; change contact.element_size"
        )
    return solution


def make_spring_sliders(displacement, force) -> SpringSliders:
    """Make parallel elements whose first loading is a given curve.

    Where the slope of the curve rises, its mean replaces it.

    Parameters
    ----------
    displacement, force : (n + 1,) ndarray
        Displacements [m] from 0 to gross slip, and forces [N] at them.

    Returns
    -------
    SpringSliders
    """
    from scipy.optimize import isotonic_regression

    steps = np.diff(displacement)
    slopes = isotonic_regression(np.diff(force) / steps, weights=steps, increasing=False).x
    stiffness = -np.diff(slopes, append=0.0)
    # Smallest stiffness of an element relative to their sum; smaller ones are rounding errors of the slope of a curve
    is_kept = stiffness > 1e-12 * slopes[0]
    stiffness = stiffness[is_kept]
    yields = displacement[1:][is_kept]
    # The friction limit is that of the curve
    return SpringSliders(
        frozen_array(stiffness * force[-1] / (stiffness @ yields)), frozen_array(yields)
    )


def _interpolate_force(loading: FirstLoading) -> np.ndarray:
    """Return displacements (t + 1,) [m] and forces [N] of the curve of a first loading that has its forces and its work."""
    from scipy.interpolate import CubicHermiteSpline

    displacement, force, work = loading
    # One yield displacement of the parallel elements at each knot
    knots = displacement[-1] * _space_evenly_at_ends(256)
    curve = CubicHermiteSpline(displacement, work, force.sum(axis=1)).derivative()
    return np.array([knots, curve(knots)])


def make_cell_elements(compliance: CellCompliance, limit: np.ndarray) -> CellElements:
    """Make the parallel elements of a face whose cells yield at their friction limits.

    Parameters
    ----------
    compliance : CellCompliance
        Shear compliance of the cells.
    limit : (ny, nx) ndarray
        Friction limits [Pa].

    Raises
    ------
    PatchfemError
        If no cell carries load.
    NotConverged
        If the tractions are not found.
    """
    loading = find_first_loading(compliance, limit)
    sliders = make_spring_sliders(*_interpolate_force(loading))
    points = np.flatnonzero(limit > 0)
    force_limit = limit.ravel()[points] * compliance.cell_area
    forces = LevelForces(loading, sliders)
    return CellElements(points, force_limit, loading, *sliders, forces)


def find_reversal(compliance: CellCompliance, limit: np.ndarray, amplitude: float) -> ReversalState:
    """Find the state of a face at the reversal of steady cycles with a displacement amplitude [m].

    In a steady cycle each stroke slips twice as far as the first loading to the amplitude (Masing).

    Parameters
    ----------
    compliance : CellCompliance
        Displacement of the cells in shear per traction.
    limit : (ny, nx) array
        Friction limits [Pa].
    amplitude : float
        Displacement amplitude [m].
    """
    solution = slip_from_rest(compliance, limit, amplitude)
    is_closed = limit > 0
    slips = is_closed & (np.abs(solution.traction) >= limit)
    slip = slips * np.maximum(-solution.slope, 0.0)
    status = np.where(is_closed, STICK, OPEN) + slips
    return ReversalState(status.ravel().astype(np.int8), 4 * slip.ravel())
