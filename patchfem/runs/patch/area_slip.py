"""Partial slip of a face, cell by cell: parallel elements, shear modes, stiffness in full stick, state at a reversal.

In: a solved `AreaPatch` and the coefficient of a law. Out: what a bench and a rig need of a plane patch.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...contact.bounded import BoundedProblem, solve_bounded
from ...contact.press_cells import compute_set_stiffness
from ...core import PatchfemError
from ...slip import first_loading, shear_modes
from .area import AreaPatch, FaceCompliance, soften

N_LOADING_LEVELS = (
    16  # displacements of the first loading, between which the force is a monotone cubic
)
NO_LIMIT_MESSAGE = "contact.shear: the friction limit is 0 at every point of the contact"
N_AREA_MODES = 12  # number of shear modes with which a face starts
MAX_AREA_MODES = 64  # largest number of modes that the tolerance asks for
# Ratio of the modes that are computed to those that are kept; the others show the error of leaving modes out.
COMPUTED_MODES_RATIO = 2


class LevelForces:
    """Forces of cells as a linear function of the stretches of parallel elements, like a matrix (a, t).

    By Masing's rule every state is a superposition of first loadings: between two displacements of the first loading, each
    cell gets its part of the force of the elements that yield between them. So the forces of the cells add up to that of
    the elements.

    Parameters
    ----------
    displacement : (n + 1,) array
        Displacements [m] of the first loading, from 0.
    force : (n + 1, a) array
        Forces [N] of the cells at them.
    stiffness, yields : (t,) array
        Stiffnesses [N/m] and yield displacements [m] of the elements, increasing.
    """

    def __init__(self, displacement, force, stiffness, yields):
        self.displacement = displacement
        self.limit = force[-1]
        self.change = np.diff(force, axis=0)
        # While elements stick up to their yield displacement, the slope of the curve is the stiffness that remains.
        self.slope = np.cumsum(stiffness[::-1])[::-1]
        steps = np.diff(yields, prepend=0.0)
        middle = yields - steps / 2
        self.level = np.clip(np.searchsorted(displacement, middle), 1, displacement.size - 1) - 1
        self.total = self._sum_by_level(steps)

    def _sum_by_level(self, steps: np.ndarray) -> np.ndarray:
        """Return the change (n,) [N] of the force between the displacements for steps (t,) [m] of the stretch."""
        return np.bincount(self.level, self.slope * steps, len(self.change))

    def __matmul__(self, stretch: np.ndarray) -> np.ndarray:
        """Return the forces (a,) [N] of the cells at stretches (t,) [m] of the elements."""
        carried = self._sum_by_level(np.diff(stretch, prepend=0.0))
        share = np.divide(carried, self.total, out=np.zeros(carried.size), where=self.total > 0)
        # Beside a corner the traction of a sticking cell may fall a little while its neighbours slip.
        return np.clip(share @ self.change, -self.limit, self.limit)


@dataclass(frozen=True, eq=False)
class AreaElements:
    """Parallel elements of a face, with the names of a `slip.shear_modes.JenkinsSet`.

    - stiffness, yield_displacement (t,): [N/m] and [m].
    - points (a,): cells in contact.
    - limit (a,): friction limits [N] of these cells.
    - compliance: compliance of the cells, with the bonds of the law.
    - pressure_limit (ny, nx): friction limits [Pa].
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray
    points: np.ndarray
    limit: np.ndarray
    compliance: FaceCompliance
    pressure_limit: np.ndarray

    @cached_property
    def force_matrix(self) -> LevelForces:
        """Forces of the cells per stretch of the elements; for rigid pieces on a spring they share it by their limits."""
        last = self.yield_displacement[-1]
        if self.compliance.cells is None:
            force = np.stack([np.zeros(self.limit.size), self.limit])
            ends = np.array([0.0, last])
            return LevelForces(ends, force, self.stiffness, self.yield_displacement)
        share = np.linspace(0.0, 1.0, N_LOADING_LEVELS + 1)
        displacement = last * share**2 * (3 - 2 * share)
        force = np.zeros((displacement.size, self.limit.size))
        traction = None
        for level in range(1, displacement.size):
            # The holder stretches by its part of the displacement.
            carried = np.minimum(displacement[level], self.yield_displacement) @ self.stiffness
            own = displacement[level] / self.compliance.factor - self.compliance.holder * carried
            traction = _slip_to(self.compliance.cells, self.pressure_limit, own, traction)
            force[level] = traction.ravel()[self.points] * self.compliance.weight
        return LevelForces(displacement, force, self.stiffness, self.yield_displacement)


def _slip_to(cells, limit: np.ndarray, displacement: float, start=None) -> np.ndarray:
    """Return the tractions (ny, nx) [Pa] of cells that are moved from rest to a displacement [m], within limits [Pa].

    `start` are the tractions at a smaller displacement, or None.
    """
    problem = BoundedProblem(np.full(limit.shape, -displacement), -limit, limit)
    return solve_bounded(cells, problem, start, 1e-7).traction


def add_bonds(compliance: FaceCompliance, limit: np.ndarray, length: float) -> FaceCompliance:
    """Return a shear compliance with the bonds of a law in series at each cell.

    Parameters
    ----------
    compliance : FaceCompliance
        Compliance of the face.
    limit : (ny, nx) array
        Friction limits [Pa].
    length : float
        Displacement [m] over which a cell reaches its limit; 0 for rigid friction.
    """
    if not length:
        return compliance
    local = np.divide(length / compliance.factor, limit, out=np.zeros(limit.shape), where=limit > 0)
    if compliance.cells is None:
        return compliance
    return replace(compliance, cells=soften(compliance.cells, local))


def make_area_elements(patch: AreaPatch, static: float, length: float) -> AreaElements:
    """Make the parallel elements of a face whose cells yield at their friction limits.

    Parameters
    ----------
    patch : AreaPatch
        Pressed face.
    static : float
        Coefficient of static friction.
    length : float
        Length [m] of the bonds in series with the pieces; 0 for Coulomb's law.

    Raises
    ------
    PatchfemError
        If no cell carries load.
    """
    limit = static * patch.pressed.pressure
    points = np.flatnonzero(limit.ravel() > 0)
    if not points.size:
        raise PatchfemError(NO_LIMIT_MESSAGE)
    compliance = add_bonds(patch.slip_compliance, limit, length)
    forces = limit.ravel()[points] * compliance.weight

    # Cells of rigid pieces on the spring of the holder yield together.
    if compliance.cells is None:
        stiffness = np.array([1 / (compliance.factor * compliance.holder + length / forces.sum())])
        yields = forces.sum() / stiffness
        return AreaElements(stiffness, yields, points, forces, compliance, limit)

    # The holder is in series with all cells: it adds its stretch to the displacement of the curve.
    loading = first_loading.find_first_loading(compliance.cells, limit, N_LOADING_LEVELS)
    pairs = patch.model.pieces.pairs
    force = loading.force * pairs
    displacement = compliance.factor * (loading.displacement + compliance.holder * force)
    curve = first_loading.FirstLoading(displacement, force)
    sliders = first_loading.make_spring_sliders(curve)
    return AreaElements(*sliders, points, forces, compliance, limit)


def list_band_elements(
    elements: AreaElements, numbers: np.ndarray, count: int
) -> "list[first_loading.SpringSliders]":
    """Return the elements of bands of a face, each with its part of the force while the whole face slides.

    Parameters
    ----------
    elements : AreaElements
        Elements of the whole face.
    numbers : (m,) array
        Number of the band of each cell.
    count : int
        Number of bands; one without load yields at once.
    """
    levels = elements.force_matrix
    out = []
    for band in range(count):
        is_own = numbers[elements.points] == band
        force = np.append(0.0, np.cumsum(levels.change[:, is_own].sum(axis=1)))
        if force[-1] > 0:
            curve = first_loading.FirstLoading(levels.displacement, force)
            out.append(first_loading.make_spring_sliders(curve))
        else:
            out.append(first_loading.SpringSliders(np.ones(1), np.zeros(1)))
    return out


def compute_stick_stiffness(patch: AreaPatch, factor: float, bond_length: float) -> float:
    """Return the tangential stiffness [N/m] of a face of which no cell slips.

    Parameters
    ----------
    patch : AreaPatch
        Pressed face.
    factor : float
        Factor of the shear compliance.
    bond_length : float
        Length of the bonds over the coefficient of friction [m]: a cell under the pressure p has p/bond_length.
    """
    pressure = patch.pressed.pressure
    compliance = patch.slip_compliance.scale(factor)
    compliance = add_bonds(compliance, pressure, bond_length)
    total = compliance.factor * compliance.holder
    if compliance.cells is not None:
        stiffness = compute_set_stiffness(compliance.cells, pressure > 0) * patch.model.pieces.pairs
        total += compliance.factor / stiffness
    elif bond_length:
        total += bond_length / patch.pressure.load
    return 1 / total


def choose_area_modes(
    patch: AreaPatch, limit: np.ndarray, length: float, count: int, tolerance: float | None
) -> "shear_modes.ShearModes":
    """Return the shear modes of a face, by default as many as the force on first loading needs.

    Twice as many modes are computed as are kept, and the others show the error of the force (`estimate_force_errors`).

    Parameters
    ----------
    patch : AreaPatch
        Pressed face.
    limit : (m,) array
        Friction limits [N] of the cells.
    length : float
        Displacement [m] over which a cell reaches its limit.
    count : int
        Number of modes; the first one that is tried with a tolerance.
    tolerance : float or None
        Largest error of the force over the friction limit; None for `count` modes.
    """
    compliance = patch.slip_compliance
    if compliance.cells is None:
        points = np.flatnonzero(limit > 0)
        total = limit.sum()
        shape = np.full((points.size, 1), total**-0.5)
        stiffness = 1 / (total * compliance.factor * np.array([compliance.holder]))
        return shear_modes.ShearModes(points, limit[points], shape, stiffness)

    cells = CellsWithHolder(compliance)
    traction = (limit / compliance.weight).reshape(patch.shape)
    n_points = int(np.count_nonzero(limit))
    while True:
        n_computed = count if tolerance is None else COMPUTED_MODES_RATIO * count
        n_computed = min(n_computed, n_points - 1)
        modes = first_loading.find_shear_modes(cells, traction, n_computed)
        if tolerance is None or n_computed < COMPUTED_MODES_RATIO * count:
            return modes.select(count)
        errors = shear_modes.estimate_force_errors(modes, length)
        if errors[count] <= tolerance or 2 * count > MAX_AREA_MODES:
            return modes.select(count)
        count *= 2


class CellsWithHolder:
    """Cells of all pairs whose holder is compliant, as an operator on tractions.

    Parameters
    ----------
    compliance : FaceCompliance
        Compliance of cells and holder.
    """

    def __init__(self, compliance: FaceCompliance):
        self._compliance = compliance
        self.shape = compliance.cells.shape
        self.cell_area = compliance.weight
        self.self_compliance = compliance.cells.self_compliance

    def product(self, traction: np.ndarray) -> np.ndarray:
        """Return the displacement (ny, nx) [m] under a traction (ny, nx) [Pa]."""
        force = traction.ravel() * self.cell_area
        return (self._compliance @ force).reshape(self.shape)


class FaceReversal(NamedTuple):
    """State of a face at a reversal of steady cycles.

    - status (m,): 0 for open cells, 1 for sticking, 2 for slipping ones.
    - slip_per_cycle (m,): path of the slip of each cell in a cycle [m].
    - stick_fraction: part of the cells in contact that stick.
    """

    status: np.ndarray
    slip_per_cycle: np.ndarray
    stick_fraction: float


def find_reversal(elements: AreaElements, amplitude: float) -> FaceReversal:
    """Find the state of a face with elements at the reversal of steady cycles with a displacement amplitude [m].

    In a steady cycle each stroke slips twice as far as the first loading to the amplitude (Masing).
    """
    compliance = elements.compliance
    limit = elements.pressure_limit
    shape = limit.shape
    if compliance.cells is None:
        slips = amplitude > elements.yield_displacement[0]
        slip = np.full(shape, max(amplitude - elements.yield_displacement[0], 0.0))
        state = np.where(limit > 0, 1 + int(slips), 0)
    else:
        carried = np.minimum(amplitude, elements.yield_displacement) @ elements.stiffness
        own = amplitude / compliance.factor - compliance.holder * carried
        found = first_loading.find_reversal_state(compliance.cells, limit, own)
        slip = compliance.factor * found.slip
        state = found.state
    active = limit > 0
    sticks = float((state[active] == 1).mean())
    path = np.where(active, 4 * slip, 0.0)
    return FaceReversal(state.ravel().astype(np.int8), path.ravel(), sticks)
