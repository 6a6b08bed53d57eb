"""Contact under a measured profile, solved on equally spaced points.

In: a `PatchModel` with a profile. Out: static measures with error estimates, and the pressure at
the points, which are one row of cells (`contact.cells`). The number of points is doubled from level to level. Errors
follow from the changes when the points are doubled and when the bricks of the free ends are refined.
"""

from typing import NamedTuple

import numpy as np

from ...contact import cell_edges
from ...contact.cells import make_block
from ...contact.edges import find_intervals
from ...contact.press_cells import press_cells, solve_on_set
from ...core import NotConverged
from ...elasticity.lapack import use_one_blas_thread
from ...elasticity.sides import BlockShape
from ...model import profile
from ...model.pieces import make_layer_stacks
from ..refine import NO_LIMIT, Verdict, refine
from ..results.patch_rows import HALF_SPACE_SOURCE, Measures, Values, make_measure
from .area import make_contact_state, make_loading
from .measures import (
    MIN_CONTACT_EDGE_ERROR_IN_CELLS,
    PRESSURE_PEAK_MEASURES,
    Resolution,
    compute_fraction_error,
    estimate_hidden_errors,
    extrapolate_static_values,
)
from .press import PointSolution, Surface
from .values import EdgeValues, assemble_static_values, estimate_peak_pressure

# Smallest number of refinement levels at which the order of convergence is known.
MIN_POINT_LEVELS = 3
# Largest number of points of a level; more would exceed the CPU time of a patch.
MAX_PROFILE_POINTS = 60_000
# Largest product of iterations and points of a level, to limit the CPU time.
MAX_POINT_ITERATIONS = 2.5e7
MIN_COARSEST_LEVEL_POINTS = 500  # Smallest number of points of the coarsest level.
# Refinements of the bricks of the free ends, from coarse to fine (`elasticity.sides`); the shortest brick of the
# last one is 1e-3 of half the length of the interface.
SIDE_LEVELS = (0, 1, 2)
# Largest relative residual at which the contact problem counts as solved.
CONTACT_RESIDUAL_TOL = 3e-8
# Ratio of the length of the corner region to the length of the interface.
CORNER_REGION_LENGTH_RATIO = 1e-3
# Smallest ratio of corner pressure to largest pressure at which the peak may be at the corner.
MIN_CORNER_PRESSURE_RATIO = 0.2


class PointLevel(NamedTuple):
    """Contact solution on the equally spaced points of one refinement level.

    - surface: pressure and gap at the points.
    - intervals (k, 2): contact intervals [m].
    - values: static measures by name.
    - resolution: Resolution of the contact by the points.
    - n_iterations: iterations of the solver.
    - has_corner_peak: whether the peak pressure may be at a free corner, which the few cells at
      the ends do not resolve.
    """

    surface: Surface
    intervals: np.ndarray
    values: Values
    resolution: Resolution
    n_iterations: int
    has_corner_peak: bool


def can_use_points(patch_model) -> bool:
    """Return whether a `PatchModel` can be solved on equally spaced points.

    This holds for pieces of equal length with a profile and without asperity layer.
    """
    return (
        patch_model.gap.profile is not None
        and patch_model.mesh.is_automatic
        and patch_model.mesh.edge_motion != "wear"
        and patch_model.interface.skin is None
        and not patch_model.pieces.has_overhang
    )


def solve_on_points(patch_model, meets_tolerance) -> PointSolution | None:
    """Solve a `PatchModel` on equally spaced points, doubling them until the tolerance is met.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with a profile.
    meets_tolerance : callable
        Function of a PointSolution that ends the refinement. MAX_PROFILE_POINTS and MAX_POINT_ITERATIONS end it as
        well.

    Returns
    -------
    PointSolution or None
        None if fewer than MIN_POINT_LEVELS levels are solved.
    """
    end_levels: list[PointLevel] = []

    def solve(count: int, coarser: list[PointLevel] | None) -> list[PointLevel] | None:
        """Solve the patch on more points, after the levels with fewer; None if the solver does not converge."""
        try:
            if coarser is None:
                # Finer and finer bricks of the free ends on the coarsest points
                end_levels[:] = [_solve_level(patch_model, level, count) for level in SIDE_LEVELS]
                return end_levels[-1:]
            pressure = coarser[-1].surface.sigma_n
            return [*coarser, _solve_level(patch_model, SIDE_LEVELS[-1], count, pressure)]
        except (NotConverged, np.linalg.LinAlgError):
            return None

    def make_solution(levels: list[PointLevel]) -> PointSolution | None:
        """Return the measures on the finest points; None if too few levels show no order of convergence."""
        if len(levels) < MIN_POINT_LEVELS:
            return None
        estimates = _combine_refinement_series(end_levels, levels)
        return PointSolution(estimates, levels[-1].surface, levels[-1].intervals)

    def judge(levels: list[PointLevel], excesses: list[float]) -> Verdict:
        """Double the points until the tolerance is met, or the next level is expensive."""
        solution = make_solution(levels)
        is_last = solution is not None and (
            meets_tolerance(solution) or _is_next_level_expensive(levels[-1])
        )
        return Verdict(0.0, None if is_last else 2 * levels[-1].surface.x.size)

    with use_one_blas_thread():
        levels, _ = refine(solve, _count_first_level_points(patch_model), judge, NO_LIMIT)
    return None if levels is None else make_solution(levels)


def _count_first_level_points(patch_model) -> int:
    """Return the number of points of the coarsest refinement level."""
    n_samples = patch_model.pieces.length / profile.find_sample_spacing(patch_model.gap.profile)
    return max(MIN_COARSEST_LEVEL_POINTS, min(round(n_samples / 4), MAX_PROFILE_POINTS // 4))


def _is_next_level_expensive(level: PointLevel) -> bool:
    """Return whether the next level would exceed the largest number of points or the largest work."""
    count = level.surface.x.size
    return 2 * count > MAX_PROFILE_POINTS or 3 * level.n_iterations * count > MAX_POINT_ITERATIONS


def _combine_refinement_series(
    end_levels: list[PointLevel], point_levels: list[PointLevel]
) -> Measures:
    """Combine two series of refinements into one estimate of each measure.

    The first series (`end_levels`) refines the bricks by which the compliance of the free ends is computed. The second
    (`point_levels`) doubles the points, with the finest of these bricks. With the limits p of the points and e of the
    ends, and the value e_n of the last end level, a measure is p + (e - e_n); the errors of both limits add up. A peak
    that may be at a free corner is left out, because the points do not resolve it.
    """
    finest = point_levels[-1]
    # Errors that a refinement does not show, such as that of a contact of few points.
    hidden_errors = estimate_hidden_errors(finest.resolution, finest.values)
    by_points = extrapolate_static_values(
        [level.values for level in point_levels], hidden_errors, 0.0
    )
    by_ends = extrapolate_static_values([level.values for level in end_levels], {}, 0.0)
    values = by_points.values + by_ends.values
    values -= np.array([[end_levels[-1].values[name]] for name in by_points.names])
    errors = by_points.errors + by_ends.errors

    # The loaded fraction is the mean pressure divided by the peak.
    combined = by_points._replace(values=values, errors=errors)
    peak, fraction = map(combined.names.index, PRESSURE_PEAK_MEASURES)
    if values[peak, 0] > 0:
        pressure, part = (finest.values[name] for name in PRESSURE_PEAK_MEASURES)
        values[fraction] = part * pressure / values[peak]
        errors[fraction] = 0.0
        errors[fraction] = compute_fraction_error(combined, peak, fraction)
    omitted = PRESSURE_PEAK_MEASURES if finest.has_corner_peak else ()
    return {
        name: make_measure(name, float(value), float(error), HALF_SPACE_SOURCE)
        for name, (value,), (error,) in zip(combined.names, values, errors)
        if name not in omitted
    }


def _solve_level(patch_model, side_level: int, count: int, start=None) -> PointLevel:
    """Solve the contact problem of a patch on equally spaced points.

    Parameters
    ----------
    patch_model : PatchModel
        Pieces and loading.
    side_level : int
        Refinement of the bricks of the free ends.
    count : int
        Number of points.
    start : (count/2,) array, optional
        Pressure [Pa] on the level with half as many points, from which the solution starts.
    """
    pieces = patch_model.pieces
    length = pieces.length
    shape = BlockShape(length, pieces.width, "x", pieces.pairs)
    normal, shear = make_block(shape, make_layer_stacks(patch_model), (count, 1), side_level)
    x = normal.x
    half_points = np.linspace(-length / 2, length / 2, 2 * count + 1)
    gap = patch_model.gap.evaluate(half_points).heights[1::2]

    pressed = press_cells(
        normal,
        gap[None],
        make_loading(patch_model),
        None if start is None else np.repeat(start, 2)[None],
        CONTACT_RESIDUAL_TOL,
    )
    pressure = pressed.pressure[0]
    opening = pressed.gap[0]
    active = pressure > 0
    if not active.any():
        raise NotConverged("contact: the pieces touch on coarser cells only")

    # The edges between the points follow from the pressure at the points in contact.
    unit = np.ones(count)
    pressure_rate = solve_on_set(normal, active[None], unit)[0]
    contact_edges = cell_edges.find_row_edges(normal, pressure, opening, pressure_rate)
    # A loaded point at an end of the interface is in contact as far as this end.
    intervals = find_intervals(half_points[[0, -1]], active[None, [0, -1]], contact_edges)[0]
    are_alike = pieces.are_alike
    shift = np.zeros(count)
    shift[contact_edges.node + contact_edges.side] = contact_edges.fraction - 0.5

    def compute_stiffness(compliance, motion=1.0) -> float:
        """Return the stiffness of the contact against a motion of its points."""
        return cell_edges.compute_contact_stiffness(compliance, active[None], motion, shift)

    edge_values = EdgeValues(
        length=float(np.diff(intervals).sum()),
        width=float(intervals[-1, 1] - intervals[0, 0]),
        normal=compute_stiffness(normal),
        tangential=compute_stiffness(shear) if are_alike else 0.0,
        rotational=compute_stiffness(normal, x),
    )

    # At an end of the interface the pressure is that of the point there.
    peak = estimate_peak_pressure(x, pressure, node_fraction=unit)
    area = normal.cell_area * count
    state = make_contact_state(pressed, normal, patch_model.gap.angle)
    values = assemble_static_values(length, area, state, peak, edge_values)
    # For dissimilar pieces, the tangential stiffness also depends on the coupling of shear and normal
    # displacement, which is not computed here.
    if not are_alike:
        del values["tangential_stiffness"]

    # What this level resolves, for the errors that a finer level does not show.
    cell = length / count
    resolution = Resolution(
        length=length,
        n_nodes=int(active.sum()),
        longest_cell=cell * bool(contact_edges.node.size),
        edge_cells=cell * contact_edges.node.size,
        edge_offset=MIN_CONTACT_EDGE_ERROR_IN_CELLS,
        can_rotate=patch_model.loading.moment is not None,
        closing=float(np.ptp(gap) + np.abs(normal.product(pressed.pressure)).max()),
    )
    n_corner = max(1, round(CORNER_REGION_LENGTH_RATIO * count))
    corner_pressure = max(pressure[:n_corner].max(), pressure[-n_corner:].max())

    return PointLevel(
        Surface(x, np.full(count, normal.cell_area), pressure, opening, gap),
        intervals,
        values,
        resolution,
        pressed.n_iterations,
        bool(corner_pressure > MIN_CORNER_PRESSURE_RATIO * pressure.max()),
    )
