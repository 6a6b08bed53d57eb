"""Pressing of two faces that are divided into cells, by a load or an approach, with free or fixed tilts."""

from typing import NamedTuple

import numpy as np

from ..core import NotConverged, PatchfemError
from .bounded import BoundedProblem, solve_bounded
from .cells import CellCompliance


class FaceLoading(NamedTuple):
    """Load and prescribed motions of the holder of a face.

    - load: Normal load [N]; None under a prescribed approach.
    - approach: Approach [m] in place of a load, at fixed tilts.
    - line_x, line_y: Position of the load [m]; the tilt along that axis is free. None: the tilt is fixed.
    - spring_x, spring_y: Stiffness [N m/rad] of the holder against a free tilt along each axis, unloaded at the tilt that
      the gap contains.
    - hardness: Largest pressure [Pa].
    """

    load: float | None = None
    approach: float = 0.0
    line_x: float | None = None
    line_y: float | None = None
    spring_x: float = 0.0
    spring_y: float = 0.0
    hardness: float = np.inf


class PressedCells(NamedTuple):
    """Pressed cells.

    - pressure, gap (ny, nx): Pressure [Pa] and gap under load [m].
    - approach: Approach of the holder [m].
    - tilt_x, tilt_y: Tilts [rad] that the holder adds to those in the gap: positive ones open the gap at +x and at +y. A
      tilt along x turns the holder about y.
    - n_iterations: Number of steps of the solver.
    """

    pressure: np.ndarray
    gap: np.ndarray
    approach: float
    tilt_x: float
    tilt_y: float
    n_iterations: int


def press_cells(
    compliance: CellCompliance,
    gap: np.ndarray,
    loading: FaceLoading,
    start: np.ndarray | None = None,
    tolerance: float = 1e-8,
) -> PressedCells:
    """Press two faces.

    Parameters
    ----------
    compliance : CellCompliance
        Normal compliance of the cells.
    gap : (ny, nx) ndarray
        Gap of the unloaded faces [m], with fixed tilts.
    loading : FaceLoading
        Load or approach, load line, springs and hardness.
    start : (ny, nx) ndarray, optional
        Pressure [Pa] of a similar problem.
    tolerance : float
        Largest wrong gap over the largest displacement.

    Returns
    -------
    PressedCells

    Raises
    ------
    PatchfemError
        If the hardness times the area of the face is below the load.
    NotConverged
        If the tolerance is not met, or if the load line lies beyond the centres of the cells.
    """
    largest_load = loading.hardness * compliance.cell_area * gap.size
    if loading.load is not None and loading.load >= largest_load:
        raise PatchfemError(
            "contact.area.hardness: a pressure of at most the hardness carries "
            f"{largest_load:.4g} N on the face, less than the load of {loading.load:.4g} N; raise the hardness"
        )
    # Closing and tilts along both axes, with load lines and springs; those without a line (nan) are fixed
    motions = np.stack(np.broadcast_arrays(np.ones(gap.shape), compliance.x, compliance.y[:, None]))
    lines = np.array([1.0, loading.line_x, loading.line_y], float)
    springs = np.array([0.0, loading.spring_x, loading.spring_y])
    is_loaded = loading.load is not None
    is_free = np.isfinite(lines) & is_loaded
    outermost = motions.max(axis=(1, 2))
    is_beyond = is_free & (springs == 0) & (np.abs(lines) > outermost)
    if is_beyond.any():
        axis = int(np.argmax(is_beyond))
        raise NotConverged(
            f"contact: the load line at {abs(lines[axis]):.5g} m lies beyond the centres of the outermost cells, at "
            f"{outermost[axis]:.5g} m, so that no pressure of these cells balances the load; raise contact.area.cells or "
            "move contact.load_line inwards"
        )

    # The gap counts from its lowest point, or from the approach
    first_approach = gap.min() if is_loaded else loading.approach
    problem = BoundedProblem(
        gap - first_approach,
        0.0,
        loading.hardness,
        motions[is_free],
        (loading.load or 0.0) / compliance.cell_area * lines[is_free],
        springs[is_free] / compliance.cell_area,
    )
    # A hard case takes about 200 steps
    solution = solve_bounded(compliance, problem, start, tolerance, max_iterations=4000)
    if not solution.residual <= tolerance:
        raise NotConverged(
            f"contact: the pressure did not converge; after {solution.n_iterations} steps the gap "
            f"is wrong by {solution.residual:.1e} of the displacement, more than {tolerance:.1e}"
        )
    motion = np.zeros(3)
    motion[is_free] = solution.motion
    closing, tilt_x, tilt_y = motion.tolist()
    return PressedCells(
        pressure=solution.traction,
        gap=np.where(solution.traction > 0, 0.0, np.maximum(solution.slope, 0.0)),
        approach=float(first_approach) + closing,
        tilt_x=-tilt_x,
        tilt_y=-tilt_y,
        n_iterations=solution.n_iterations,
    )


def solve_on_set(
    compliance: CellCompliance, active: np.ndarray, motion: np.ndarray | float = 1.0
) -> np.ndarray:
    """Solve for the tractions on a contact set that cause a motion of its cells.

    Parameters
    ----------
    compliance : CellCompliance
        Normal or shear compliance.
    active : (ny, nx) bool ndarray
        Cells in contact.
    motion : (ny, nx) ndarray or float
        Displacement of the cells [m].

    Returns
    -------
    (ny, nx) ndarray
        Traction [Pa], 0 outside the set.
    """
    motion = np.broadcast_to(motion, active.shape)
    bound = np.where(active, np.inf, 0.0)
    problem = BoundedProblem(-motion, -bound, bound)
    # Largest residual of the equations of a contact set; it enters a stiffness squared, and edges
    # of the set linearly
    return solve_bounded(compliance, problem, tolerance=1e-9).traction
