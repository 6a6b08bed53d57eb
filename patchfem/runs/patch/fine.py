"""Contact under a measured profile, solved on successively more equally spaced points.

In: a `PatchModel` with a profile. Out: static measures with errors, and the pressure on the
points. The compliance of waves along the interface is known in closed form; finite elements
only compute the smooth change due to the free ends of the pieces. Errors come from the changes from
level to level, as for meshes: with cells half as long at the ends, and with twice as many
points.
"""

from typing import NamedTuple

import numpy as np

from ...contact.active_set import patch_problem
from ...contact.conjugate_gradients import solve_by_gradients
from ...contact.half_space.layer import end_compliance, layer_compliance
from ...contact.half_space.point_compliance import (
    PointCompliance,
    find_edges,
    set_stiffness,
    smooth_modes,
)
from ...core import NotConverged
from ...elasticity.elasticity import make_piece
from ...elasticity.lapack import one_thread
from ...mesh.grading import Layout, divide_into_columns, divide_into_rows
from ...model import profile
from ...model.pieces import make_elastic_layers
from .edge_values import EdgeValues
from .measures import (
    MIN_EDGE_OFFSET,
    PEAK_MEASURES,
    Estimate,
    Resolution,
    estimate_hidden_errors,
    extrapolate_static_measures,
    widen_error_by_peak_error,
)
from .press import PointSolution, Surface
from .values import assemble_static_values, estimate_peak_pressures

MIN_LEVELS = 3  # Smallest number of refinement levels from which an order of convergence is seen.
# Largest number of points of a level, because more would exceed the CPU time of a patch.
MAX_POINTS = 60_000
MAX_WORK = 2.5e7  # Largest iterations times points of a level, limited for the same reason.
MIN_POINTS = 500  # Smallest number of points of the coarsest level.
END_CELL_RATIO = 1e-4  # Cell length at the ends over the length of the interface, on level 0.
MIDDLE_CELL_RATIO = (
    1 / 30
)  # Cell length in the middle over the length of the interface, on level 0.
CELL_GROWTH = 0.8  # Increase of the cell length per distance from the end [1].
CONTACT_TOL = 3e-8  # Relative residual at which the contact counts as solved.
MAX_ITERATIONS = 4000  # Largest number of iterations of a contact solution.
CORNER_LENGTH_RATIO = 1e-3  # Length of the corner region over the length of the interface.
# Pressure at a corner over the largest pressure; above this ratio the peak may be at the corner.
MIN_CORNER_PRESSURE_RATIO = 0.2
# Largest overlap of the surfaces of a solved contact over the displacement due to the pressure.
MAX_OVERLAP_RATIO = 1e-6


class PointLevel(NamedTuple):
    """Contact solution on the equally spaced points of one refinement level.

    - force (n,): nodal forces [N].
    - surface: pressure and gap on the points.
    - intervals (k, 2): parts in contact [m].
    - values: static measures by name.
    - resolution: errors that the levels may share.
    - n_iterations: iterations of the solver.
    - has_corner_peak: whether the pressure at a free corner may be the largest; a few cells at the
      ends do not resolve it.
    """

    force: np.ndarray
    surface: Surface
    intervals: np.ndarray
    values: dict
    resolution: Resolution
    n_iterations: int
    has_corner_peak: bool


class FreeEnds(NamedTuple):
    """Change of the compliance of infinite elastic layers due to the free ends of the pieces.

    - x (k,): positions [m].
    - normal, tangential (k, k): changes [m2/N] for pressure and for shear.
    """

    x: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray


class PointForces(NamedTuple):
    """Contact forces at equally spaced points, with approach and rotation of the holder.

    - force (n,): nodal forces [N].
    - approach, rotation: [m] and [rad]; the rotation adds to that of the gap.
    - n_iterations: iterations of the solver.
    """

    force: np.ndarray
    approach: float
    rotation: float
    n_iterations: int


class HolderState(NamedTuple):
    """Load [N], moment [N m], approach [m] and rotation [rad] of the upper holder."""

    load: float
    moment: float
    approach: float
    rotation: float


def can_use_points(patch_model) -> bool:
    """Return whether a `PatchModel` can be solved on equally spaced points.

    These are bare pieces of equal length with a profile, under a load, or under an approach without
    rotation.
    """
    loading = patch_model.loading
    can_rotate = loading.can_rotate or loading.rotational_stiffness > 0
    return (
        patch_model.gap.profile is not None
        and patch_model.mesh.is_automatic
        and patch_model.mesh.edge_motion != "wear"
        and patch_model.interface.skin is None
        and patch_model.interface.strips is None
        and not patch_model.pieces.has_overhang
        and (loading.approach is None or not can_rotate)
    )


def solve_on_points(patch_model, meets_tolerance) -> PointSolution | None:
    """Solve the contact of a `PatchModel` on successively more equally spaced points.

    Parameters
    ----------
    patch_model : PatchModel
    meets_tolerance : callable
        Function of a PointSolution that ends the refinement; MAX_POINTS and MAX_WORK end it too.

    Returns
    -------
    PointSolution or None
        None if fewer than MIN_LEVELS levels are solved.
    """
    count = _first_level_points(patch_model)
    solution = None
    with one_thread():
        try:
            ends = [_compute_free_ends(patch_model, level) for level in range(MIN_LEVELS)]
            coarse = [_solve_level(patch_model, free_ends, count) for free_ends in ends]
            levels = coarse[-1:]
            while solution is None or not (
                meets_tolerance(solution) or _is_next_level_expensive(levels[-1])
            ):
                force = levels[-1].force
                levels.append(_solve_level(patch_model, ends[-1], 2 * force.size, force))
                if len(levels) >= MIN_LEVELS:
                    estimates = _combine_series(coarse, levels)
                    solution = PointSolution(estimates, levels[-1].surface, levels[-1].intervals)
        except (NotConverged, np.linalg.LinAlgError):
            pass
    return solution


def _first_level_points(patch_model) -> int:
    """Return the number of points of the coarsest refinement level of a patch."""
    n_samples = patch_model.pieces.length / profile.find_sample_spacing(patch_model.gap.profile)
    return max(MIN_POINTS, min(round(n_samples / 4), MAX_POINTS // 4))


def _is_next_level_expensive(level: PointLevel) -> bool:
    """Return whether a finer level would exceed the limit of points or of work."""
    count = level.force.size
    return 2 * count > MAX_POINTS or 3 * level.n_iterations * count > MAX_WORK


def _combine_series(coarse: list, levels: list) -> dict:
    """Combine two refinement series to one estimate of each measure.

    The first series refines the cells at the ends; the second increases the number of points with
    the finest of these cells. The extrapolation and the error of the first are added to the second.
    """
    finest = levels[-1]
    shared = estimate_hidden_errors(finest.resolution, finest.values)
    by_points = extrapolate_static_measures([level.values for level in levels], shared, 0.0)
    by_ends = extrapolate_static_measures([level.values for level in coarse], {}, 0.0)
    out = {}
    for name, estimate in by_points.items():
        if name not in PEAK_MEASURES or not finest.has_corner_peak:
            value = estimate.value + by_ends[name].value - coarse[-1].values[name]
            out[name] = Estimate(float(value), float(estimate.error + by_ends[name].error))
    peak = out.get("pressure_peak")
    if peak is not None and peak.value > 0:
        # The loaded fraction is the mean pressure divided by this peak.
        mean = finest.values["loaded_fraction"] * finest.values["pressure_peak"]
        fraction = mean / peak.value
        error = widen_error_by_peak_error(fraction, 0.0, peak.error / peak.value)
        out["loaded_fraction"] = Estimate(float(fraction), float(error))
    return out


def _compute_free_ends(patch_model, level: int) -> FreeEnds:
    """Compute the change of compliance due to the free ends, with cells of a refinement level."""
    half = patch_model.pieces.length / 2
    cell = END_CELL_RATIO * patch_model.pieces.length
    middle_cell = MIDDLE_CELL_RATIO * patch_model.pieces.length
    bands = ((-half, -half, cell), (half, half, cell))
    layout = Layout(
        start=-half,
        stop=half,
        bands=bands,
        span=(-half, half),
        max_loaded_length=middle_cell,
        max_length=middle_cell,
        slope=CELL_GROWTH,
    ).scale_cells(0.5**level)
    x = divide_into_columns(layout)
    changes = 0.0
    for piece, multiplicity in _distinct_pieces(patch_model):
        depth, coated = _row_depths(piece, layout)
        body = make_piece(x, depth, coated, make_elastic_layers(patch_model, piece))
        changes = changes + multiplicity * np.array(end_compliance(body))
    return FreeEnds(x, *changes)


def _distinct_pieces(patch_model) -> list:
    """Return the distinct pieces of a patch as pairs (piece, multiplicity)."""
    pieces = patch_model.pieces
    return [(pieces.upper, 2)] if pieces.are_alike else [(pieces.lower, 1), (pieces.upper, 1)]


def make_point_compliances(patch_model, ends: FreeEnds, count: int) -> tuple:
    """Return the compliance of equally spaced points for pressure and for shear.

    Parameters
    ----------
    patch_model : PatchModel
    ends : FreeEnds
    count : int
        Number of points.

    Returns
    -------
    tuple of PointCompliance
    """
    length = patch_model.pieces.length
    width = patch_model.pieces.width * patch_model.pieces.pairs
    x = ((np.arange(count) + 0.5) / count - 0.5) * length
    k = np.arange(count) * np.pi / length
    waves = 0
    for piece, multiplicity in _distinct_pieces(patch_model):
        layers = make_elastic_layers(patch_model, piece)
        wave_compliance = layer_compliance(k, piece.height, piece.thickness, layers)
        waves = waves + multiplicity * np.array(wave_compliance)
    out = []
    for wave, change in zip(waves, (ends.normal, ends.tangential)):
        modes, sizes = smooth_modes(ends.x, change, x)
        out.append(PointCompliance(x, length / count * width, wave, modes, sizes / width))
    return tuple(out)


def _row_depths(piece, layout: Layout) -> tuple:
    """Return the depths [m] of the element rows of a piece and the number of coating rows."""
    height = piece.height
    coating = piece.thickness
    end_cell = layout.bands[0][2]
    max_cell = 2 * height * layout.max_length / (layout.stop - layout.start)
    bands = [
        (0.0, 0.0, end_cell),
        (height, height, height * layout.max_length / (layout.stop - layout.start) / 2),
    ]
    if coating:
        bands.append((coating, coating, max(coating * layout.slope / 4, end_cell)))
    rows = Layout(0.0, height, tuple(bands), (0.0, height), max_cell, max_cell, layout.slope)
    return divide_into_rows(rows, coating)


def _solve_level(patch_model, ends: FreeEnds, count: int, start=None) -> PointLevel:
    """Solve the contact of a patch on a given number of equally spaced points.

    start: forces (n,) [N] of the level with half as many points, or None.
    """
    length = patch_model.pieces.length
    normal, shear = make_point_compliances(patch_model, ends, count)
    x = normal.x
    between = np.linspace(-length / 2, length / 2, 2 * count + 1)
    gap = patch_model.gap.evaluate(between).heights[1::2]
    solution = _solve_forces(patch_model, normal, gap, start)
    force = solution.force
    deflection = normal.product(force)
    opening = gap + solution.rotation * x - solution.approach + deflection
    largest_deflection = np.abs(deflection).max()
    active = force > 0
    if not opening.min() >= -MAX_OVERLAP_RATIO * largest_deflection:
        raise NotConverged(
            f"contact: at {count} points the pieces still overlap by up to {-opening.min():.1e} m"
        )
    if not active.any():
        raise NotConverged("contact: the pieces touch on coarser cells only")
    opening = np.where(active, 0.0, np.maximum(opening, 0.0))
    sigma = force / normal.area
    unit = np.ones(count)
    contact_edges = find_edges(normal, force, opening, normal.solve_forces(active, unit))
    intervals = _contact_intervals(active, contact_edges, length)
    state = HolderState(
        float(force.sum()),
        float(force @ x),
        solution.approach,
        patch_model.gap.angle + solution.rotation,
    )
    # For unlike pieces the stiffness depends on the normal closing that shear causes.
    tangential = np.nan
    if patch_model.pieces.are_alike:
        tangential = set_stiffness(shear, active, unit, contact_edges)
    edge_values = EdgeValues(
        length=float(np.maximum(np.diff(intervals).ravel(), 0.0).sum()),
        width=float(intervals[-1, 1] - intervals[0, 0]),
        normal=set_stiffness(normal, active, unit, contact_edges),
        tangential=tangential,
        rotational=set_stiffness(normal, active, x, contact_edges),
    )
    # The pressure at an end of the interface is taken from the point there.
    peak = float(estimate_peak_pressures(x, sigma[None], node_fraction=unit)[0])
    values = assemble_static_values(length, normal.area * count, state, peak, edge_values)
    if np.isnan(tangential):
        del values["tangential_stiffness"]
    cell = length / count
    resolution = Resolution(
        length=length,
        n_nodes=int(active.sum()),
        longest_cell=cell * bool(contact_edges),
        edge_cells=cell * len(contact_edges),
        edge_offset=MIN_EDGE_OFFSET,
        can_rotate=patch_model.loading.moment is not None,
        closing=float(np.ptp(gap) + largest_deflection),
    )
    n_corner = max(1, round(CORNER_LENGTH_RATIO * count))
    corner_force = max(force[:n_corner].max(), force[-n_corner:].max())
    return PointLevel(
        force,
        Surface(x, np.full(count, normal.area), sigma, opening, gap),
        intervals,
        values,
        resolution,
        solution.n_iterations,
        bool(corner_force > MIN_CORNER_PRESSURE_RATIO * force.max()),
    )


def _contact_intervals(active, contact_edges: list, length: float) -> np.ndarray:
    """Return the intervals in contact (k, 2) [m] for a contact set (n,) of bool.

    An interval ends at an edge between two points, or at an end of the interface.
    """
    is_active = np.concatenate([[False], active, [False]])
    edges = iter(contact_edges)
    places = []
    for point in np.flatnonzero(is_active[1:] != is_active[:-1]):
        is_inside = 0 < point < active.size
        places.append(next(edges).position if is_inside else (point / active.size - 0.5) * length)
    return np.array(places).reshape(-1, 2)


def _solve_forces(patch_model, normal: PointCompliance, gap, start) -> PointForces:
    """Solve for the nodal forces of a refinement level under the prescribed load or approach."""
    x = normal.x
    loading = patch_model.loading
    begin = None if start is None else np.repeat(start, 2) / 2
    has_approach = loading.approach is not None
    offset = loading.approach if has_approach else gap.min()
    moment = None if has_approach else loading.moment
    problem = patch_problem(
        x,
        gap - offset,
        None if has_approach else loading.load,
        moment,
        loading.rotational_stiffness,
    )
    force, n_iterations = solve_by_gradients(normal, problem, CONTACT_TOL, MAX_ITERATIONS, begin)
    active = force > 0
    if has_approach or not active.any():
        return PointForces(force, float(offset), 0.0, n_iterations)
    depth = (gap + normal.product(force))[active]
    if moment is None:
        return PointForces(force, float(depth.mean()), 0.0, n_iterations)
    middle = x[active].mean()
    arms = x[active] - middle
    slope = float(arms @ depth) / max(float(arms @ arms), 1e-300)
    return PointForces(force, float(depth.mean() - slope * middle), -slope, n_iterations)
