"""Partial slip over the cells of a face: first loading, parallel elements, shear modes, states at a reversal.

Cells yield at fixed tractions. Slip zones only grow within a stroke, so each displacement of the first loading is one
bounded problem from rest, and Masing's rule gives the other strokes.
"""

from typing import NamedTuple

import numpy as np

from ..contact.bounded import BoundedProblem, BoundedSolution, solve_bounded
from ..core import NotConverged, PatchfemError, frozen_array
from .shear_modes import ShearModes

OPEN = 0  # State of a cell without contact
STICK = 1  # State of a cell in contact below its friction limit
SLIP = 2  # State of a cell at its friction limit
# Largest wrong displacement of a cell, relative to the largest one; the error of the force is about its square
SLIP_RESIDUAL_TOL = 1e-6
MAX_ITERATIONS = (
    2000  # Largest number of steps of the solver for one displacement; it takes about 15
)
# Smallest stiffness of an element relative to their sum; smaller ones are rounding errors of the slope of a curve
MIN_STIFFNESS_RATIO = 1e-12


class FirstLoading(NamedTuple):
    """First loading of a face from rest to gross slip at n displacements of the holder.

    - displacement (n + 1,): Displacements [m] from 0 to gross slip.
    - force (n + 1,): Friction force [N] at them.
    """

    displacement: np.ndarray
    force: np.ndarray


class SpringSliders(NamedTuple):
    """Parallel springs in series with sliders that have the curve of a first loading.

    - stiffness (k,): [N/m].
    - yield_displacement (k,): [m], increasing.
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray


class ReversalState(NamedTuple):
    """State of the cells at the reversal of steady cycles with a displacement amplitude.

    - traction (ny, nx): Shear traction [Pa] of the cells.
    - slip (ny, nx): Slip of the first loading up to the amplitude [m]; a steady cycle slips four times as far.
    - state (ny, nx): OPEN, STICK or SLIP.
    - force: Friction force [N].
    """

    traction: np.ndarray
    slip: np.ndarray
    state: np.ndarray
    force: float


def find_first_loading(shear, limit: np.ndarray, n_displacements: int = 16) -> FirstLoading:
    """Find the force over the displacement of the holder, from rest to gross slip.

    Parameters
    ----------
    shear : CellCompliance
        Shear compliance of the cells.
    limit : (ny, nx) ndarray
        Friction limit [Pa] of each cell; 0 without contact.
    n_displacements : int
        Number of displacements, 12 to 24.

    Returns
    -------
    FirstLoading

    Raises
    ------
    PatchfemError
        If no cell carries load.
    """
    levels = compute_gross_slip(shear, limit) * _space_evenly_at_ends(n_displacements)
    force = np.zeros(levels.size)
    traction = np.zeros(limit.shape)
    for k, displacement in enumerate(levels):
        if displacement > 0:
            traction = _hold(shear, limit, displacement, traction).traction
            force[k] = traction.sum() * shear.cell_area
    return FirstLoading(frozen_array(levels), frozen_array(force))


def _space_evenly_at_ends(count: int) -> np.ndarray:
    """Return numbers (count + 1,) from 0 to 1 that are denser at both ends, where the curve bends most."""
    s = np.arange(count + 1) / count
    return s * s * (3 - 2 * s)


def compute_gross_slip(shear, limit: np.ndarray) -> float:
    """Compute the displacement [m] of the holder at which the last cell slips.

    Parameters
    ----------
    shear : CellCompliance
        Shear compliance of the cells.
    limit : (ny, nx) ndarray
        Friction limit [Pa] of each cell; 0 without contact.

    Raises
    ------
    PatchfemError
        If no cell carries load.
    """
    if not (limit > 0).any():
        raise PatchfemError("contact.shear: the friction limit is 0 at every point of the contact")
    return float(shear.product(limit)[limit > 0].max())


def _hold(shear, limit: np.ndarray, displacement: float, start: np.ndarray) -> BoundedSolution:
    """Solve for the shear traction after a first loading to a displacement [m] of the holder.

    Slip zones only grow in it, so the way does not matter: the elastic energy minus the work of the holder is least. The
    slope of the solution is minus the slip.

    Parameters
    ----------
    shear : CellCompliance
        Shear compliance of the cells.
    limit, start : (ny, nx) ndarray
        Friction limit, and traction from which the solution starts [Pa].
    displacement : float
        Displacement of the holder [m].
    """
    problem = BoundedProblem(np.full(limit.shape, -displacement), -limit, limit)
    solution = solve_bounded(shear, problem, start, SLIP_RESIDUAL_TOL, MAX_ITERATIONS)
    if not solution.residual <= SLIP_RESIDUAL_TOL:
        raise NotConverged(
            f"contact: partial slip did not converge; after {MAX_ITERATIONS} steps the displacement "
            f"is wrong by {solution.residual:.1e} of the largest one"
        )
    return solution


def make_spring_sliders(first_loading: FirstLoading, count: int = 256) -> SpringSliders:
    """Make parallel elements whose first loading is a given curve.

    Parameters
    ----------
    first_loading : FirstLoading
        Curve, interpolated by monotone cubics.
    count : int
        Number of yield displacements.

    Returns
    -------
    SpringSliders
    """
    from scipy.interpolate import PchipInterpolator

    displacement, force = first_loading
    knots = displacement[-1] * _space_evenly_at_ends(count)
    slopes = np.diff(PchipInterpolator(displacement, force)(knots)) / np.diff(knots)
    # A slope that would rise again is the round-off of the interpolation
    slopes = np.minimum.accumulate(np.maximum(slopes, 0.0))
    stiffness = -np.diff(slopes, append=0.0)
    is_kept = stiffness > MIN_STIFFNESS_RATIO * slopes[0]
    stiffness = stiffness[is_kept]
    yields = knots[1:][is_kept]
    # The friction limit is that of the curve
    return SpringSliders(
        frozen_array(stiffness * force[-1] / (stiffness @ yields)), frozen_array(yields)
    )


def find_reversal_state(shear, limit: np.ndarray, amplitude: float) -> ReversalState:
    """Find traction, slip and state of the cells at the reversal of a steady cycle.

    Parameters
    ----------
    shear : CellCompliance
        Shear compliance of the cells.
    limit : (ny, nx) ndarray
        Friction limit [Pa] of each cell; 0 without contact.
    amplitude : float
        Amplitude of the displacement of the holder [m].

    Returns
    -------
    ReversalState
    """
    solution = _hold(shear, limit, amplitude, np.zeros(limit.shape))
    is_open = limit == 0
    is_sticking = np.abs(solution.traction) < limit
    state = np.where(is_sticking, STICK, SLIP)
    state[is_open] = OPEN
    slip = np.where(state == SLIP, np.maximum(-solution.slope, 0.0), 0.0)
    force = float(solution.traction.sum() * shear.cell_area)
    return ReversalState(solution.traction, slip, state, force)


def find_shear_modes(shear, limit: np.ndarray, n_modes: int) -> ShearModes:
    """Find the most compliant modes of D^1/2 C D^1/2, with D the friction limits [N] of the cells in contact.

    Parameters
    ----------
    shear : CellCompliance
        Shear compliance C of the cells.
    limit : (ny, nx) ndarray
        Friction limit [Pa] of each cell; 0 without contact.
    n_modes : int
        Number of modes, at most that of the cells in contact.

    Returns
    -------
    ShearModes
        Its points are indices into the flattened cells.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh

    points = np.flatnonzero(limit > 0)
    force = limit.ravel()[points] * shear.cell_area
    root = np.sqrt(force)

    def apply(vector: np.ndarray) -> np.ndarray:
        """Return D^1/2 C D^1/2 times a vector of the cells in contact."""
        traction = np.zeros(limit.size)
        traction[points] = root * vector.ravel() / shear.cell_area
        displacement = shear.product(traction.reshape(limit.shape))
        return root * displacement.ravel()[points]

    # The method of Lanczos needs more cells than modes; a few cells give the whole matrix
    if points.size <= 2 * n_modes + 1:
        matrix = np.array([apply(column) for column in np.eye(points.size)])
        eigenvalues, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    else:
        operator = LinearOperator((points.size, points.size), apply, dtype=float)
        eigenvalues, vectors = eigsh(operator, n_modes, which="LA", v0=root)
    order = np.argsort(eigenvalues)[::-1][:n_modes]
    return ShearModes(
        frozen_array(points, np.int64),
        frozen_array(force),
        frozen_array(vectors[:, order] / root[:, None]),
        frozen_array(1 / eigenvalues[order]),
    )
