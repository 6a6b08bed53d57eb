"""Contact under a measured profile, solved on equally spaced points.

In: a `PatchModel` with a profile. Out: static measures with error estimates, and the pressure at
the points. The compliance of infinite elastic layers is known in closed form for waves along the
interface; finite elements compute only its smooth change due to the free ends of the pieces. The
number of points is doubled from level to level. Errors follow from the changes when the points are
doubled and when the cells at the ends are halved.
"""

from typing import NamedTuple

import numpy as np

from ...contact.active_set import make_patch_problem
from ...contact.conjugate_gradients import fit_motion, solve_by_gradients
from ...contact.edges import contact_intervals
from ...contact.half_space.layer import end_compliance, layer_compliance
from ...contact.half_space.point_compliance import (
    PointCompliance,
    find_edges,
    set_stiffness,
    smooth_modes,
)
from ...core import NotConverged
from ...elasticity.elasticity import Piece
from ...elasticity.lapack import use_one_blas_thread
from ...mesh.grading import Layout, divide_into_columns
from ...mesh.grid import TensorGrid
from ...model import profile
from ...model.patch import PatchPiece
from ...model.pieces import make_elastic_layers
from ..results.patch_rows import HALF_SPACE_SOURCE, Measures, Values, make_measure
from .grids import divide_piece_into_rows
from .measures import (
    MIN_CONTACT_EDGE_ERROR_IN_CELLS,
    PRESSURE_PEAK_MEASURES,
    Resolution,
    estimate_hidden_errors,
    extrapolate_static_measures,
    widen_fraction_error,
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
# Ratio of the cell length at the ends to the length of the interface, on level 0.
END_CELL_LENGTH_RATIO = 1e-4
MIDDLE_CELL_LENGTH_RATIO = 1 / 30  # The same ratio in the middle of the interface.
POINT_CELL_GROWTH = 0.8  # Increase of the cell length per distance from the end [1].
# Largest relative residual at which the contact problem counts as solved.
CONTACT_RESIDUAL_TOL = 3e-8
MAX_CONTACT_ITERATIONS = 4000  # Largest number of iterations of a contact solution.
# Ratio of the length of the corner region to the length of the interface.
CORNER_REGION_LENGTH_RATIO = 1e-3
# Smallest ratio of corner pressure to largest pressure at which the peak may be at the corner.
MIN_CORNER_PRESSURE_RATIO = 0.2
# Largest ratio of overlap to elastic displacement of a solved contact.
MAX_OVERLAP_RATIO = 1e-6


class PointLevel(NamedTuple):
    """Contact solution on the equally spaced points of one refinement level.

    - force (n,): nodal forces [N].
    - surface: pressure and gap at the points.
    - intervals (k, 2): contact intervals [m].
    - values: static measures by name.
    - resolution: Resolution of the contact by the points.
    - n_iterations: iterations of the solver.
    - has_corner_peak: whether the peak pressure may be at a free corner, which the few cells at
      the ends do not resolve.
    """

    force: np.ndarray
    surface: Surface
    intervals: np.ndarray
    values: Values
    resolution: Resolution
    n_iterations: int
    has_corner_peak: bool


class FreeEnds(NamedTuple):
    """Change of the compliance of infinite elastic layers due to the free ends of the pieces.

    - x (k,): positions [m].
    - normal, tangential (k, k): changes [m2/N] of the normal and of the tangential compliance.
    """

    x: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray


class PointForces(NamedTuple):
    """Nodal forces at equally spaced points, with the state of the holder.

    - force (n,): nodal forces [N].
    - load, moment: sum [N] and moment [N m] of the forces.
    - approach, rotation: [m] and [rad]. The rotation includes that of the gap.
    - n_iterations: iterations of the solver.
    """

    force: np.ndarray
    load: float
    moment: float
    approach: float
    rotation: float
    n_iterations: int


def can_use_points(patch_model) -> bool:
    """Return whether a `PatchModel` can be solved on equally spaced points.

    This holds for pieces of equal length with a profile and without asperity layer.
    """
    return (
        patch_model.gap.profile is not None
        and patch_model.mesh.is_automatic
        and patch_model.mesh.edge_motion != "wear"
        and patch_model.interface.skin is None
        and patch_model.interface.strips is None
        and not patch_model.pieces.has_overhang
    )


def solve_on_points(patch_model, meets_tolerance) -> PointSolution | None:
    """Solve a `PatchModel` on equally spaced points, doubling them until the tolerance is met.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with a profile, without strips.
    meets_tolerance : callable
        Function of a PointSolution that ends the refinement. MAX_PROFILE_POINTS and MAX_POINT_ITERATIONS end it as
        well.

    Returns
    -------
    PointSolution or None
        None if fewer than MIN_POINT_LEVELS levels are solved.
    """
    count = _count_first_level_points(patch_model)
    solution = None
    with use_one_blas_thread():
        try:
            # Finer compliances of the free ends on the coarsest points, then the last of them on more and more points
            ends = [
                _compute_free_end_compliance(patch_model, level)
                for level in range(MIN_POINT_LEVELS)
            ]
            end_levels = [_solve_level(patch_model, free_ends, count) for free_ends in ends]

            # The points are doubled until the tolerance is met.
            point_levels = end_levels[-1:]
            while solution is None or not (
                meets_tolerance(solution) or _is_next_level_expensive(point_levels[-1])
            ):
                force = point_levels[-1].force
                point_levels.append(_solve_level(patch_model, ends[-1], 2 * force.size, force))
                if len(point_levels) >= MIN_POINT_LEVELS:
                    estimates = _combine_refinement_series(end_levels, point_levels)
                    solution = PointSolution(
                        estimates, point_levels[-1].surface, point_levels[-1].intervals
                    )
        except (NotConverged, np.linalg.LinAlgError):
            pass
    return solution


def _count_first_level_points(patch_model) -> int:
    """Return the number of points of the coarsest refinement level."""
    n_samples = patch_model.pieces.length / profile.find_sample_spacing(patch_model.gap.profile)
    return max(MIN_COARSEST_LEVEL_POINTS, min(round(n_samples / 4), MAX_PROFILE_POINTS // 4))


def _is_next_level_expensive(level: PointLevel) -> bool:
    """Return whether the next level would exceed the largest number of points or the largest work."""
    count = level.force.size
    return 2 * count > MAX_PROFILE_POINTS or 3 * level.n_iterations * count > MAX_POINT_ITERATIONS


def _combine_refinement_series(
    end_levels: list[PointLevel], point_levels: list[PointLevel]
) -> Measures:
    """Combine two series of refinements into one estimate of each measure.

    The first series (`end_levels`) halves the cells by which the compliance of the free ends is computed. The second
    (`point_levels`) doubles the points, with the shortest of these cells. With the limits p of the points and e of the
    ends, and the value e_n of the last end level, a measure is p + (e - e_n); the errors of both limits add up. A peak
    that may be at a free corner is left out, because the points do not resolve it.
    """
    finest = point_levels[-1]
    # Errors that a refinement does not show, such as that of a contact of few points.
    hidden_errors = estimate_hidden_errors(finest.resolution, finest.values)
    by_points = extrapolate_static_measures(
        [level.values for level in point_levels], hidden_errors, 0.0
    )
    by_ends = extrapolate_static_measures([level.values for level in end_levels], {}, 0.0)
    out = {}
    for name, estimate in by_points.items():
        if name not in PRESSURE_PEAK_MEASURES or not finest.has_corner_peak:
            value = estimate.value + by_ends[name].value - end_levels[-1].values[name]
            error = estimate.error + by_ends[name].error
            out[name] = make_measure(name, value, error, HALF_SPACE_SOURCE)

    # The loaded fraction is the mean pressure divided by the peak.
    peak_name, fraction_name = PRESSURE_PEAK_MEASURES
    peak = out.get(peak_name)
    if peak is not None and peak.value > 0:
        fraction = finest.values[fraction_name] * finest.values[peak_name] / peak.value
        measure = make_measure(fraction_name, fraction, 0.0, HALF_SPACE_SOURCE)
        out[fraction_name] = widen_fraction_error(peak, measure)
    return out


def _compute_free_end_compliance(patch_model, level: int) -> FreeEnds:
    """Compute the change of compliance due to the free ends, with the cells of a given level."""
    length = patch_model.pieces.length
    half = length / 2
    cell = END_CELL_LENGTH_RATIO * length
    middle_cell = MIDDLE_CELL_LENGTH_RATIO * length

    # Short columns only at both ends, where the compliance differs from that of infinite layers.
    bands = ((-half, -half, cell), (half, half, cell))
    layout = Layout(
        start=-half,
        stop=half,
        bands=bands,
        span=(-half, half),
        max_loaded_length=middle_cell,
        max_length=middle_cell,
        slope=POINT_CELL_GROWTH,
    ).scale_cells(0.5**level)
    x = divide_into_columns(layout)

    # Two equal pieces count twice.
    changes = 0.0
    for piece, multiplicity in _distinct_pieces(patch_model):
        middle_row = piece.height * layout.max_length / length
        rows = divide_piece_into_rows(
            piece,
            first_row=layout.bands[0][2],
            last_row=middle_row / 2,
            coating_row=piece.thickness * layout.slope / 4,
            max_row=2 * middle_row,
            growth=layout.slope,
        )
        body = Piece(TensorGrid(x, *rows), make_elastic_layers(patch_model, piece))
        changes = changes + multiplicity * np.array(end_compliance(body))
    return FreeEnds(x, *changes)


def _distinct_pieces(patch_model) -> list[tuple[PatchPiece, int]]:
    """Return (piece, number of times it occurs) for the pieces of a patch: one pair if both are alike, else two."""
    pieces = patch_model.pieces
    return [(pieces.upper, 2)] if pieces.are_alike else [(pieces.lower, 1), (pieces.upper, 1)]


def make_point_compliances(
    patch_model, ends: FreeEnds, count: int
) -> tuple[PointCompliance, PointCompliance]:
    """Return the normal and the tangential compliance of equally spaced points.

    Parameters
    ----------
    patch_model : PatchModel
        Patch whose pieces and coatings the points are on.
    ends : FreeEnds
        Ends of the pieces that are free sides.
    count : int
        Number of points.

    Returns
    -------
    normal, tangential : PointCompliance
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
    normal, tangential = out
    return normal, tangential


def _solve_level(patch_model, ends: FreeEnds, count: int, start=None) -> PointLevel:
    """Solve the contact problem of a patch on equally spaced points.

    Parameters
    ----------
    patch_model : PatchModel
        Pieces and loading.
    ends : FreeEnds
        Correction of the compliance for the free ends of the pieces.
    count : int
        Number of points.
    start : (count/2,) array, optional
        Forces [N] on the level with half as many points, from which the solution starts.
    """
    length = patch_model.pieces.length
    normal, shear = make_point_compliances(patch_model, ends, count)
    x = normal.x
    half_points = np.linspace(-length / 2, length / 2, 2 * count + 1)
    gap = patch_model.gap.evaluate(half_points).heights[1::2]

    # Opening of the interface: gap + rotation x - approach + deflection, not below 0.
    solution = _solve_nodal_forces(patch_model, normal, gap, start)
    force = solution.force
    deflection = normal.product(force)
    turn = solution.rotation - patch_model.gap.angle
    opening = gap + turn * x - solution.approach + deflection
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

    # The edges between the points follow from the forces on the points in contact.
    contact_edges = find_edges(normal, force, opening, normal.solve_forces(active, unit))
    # A loaded point at an end of the interface is in contact as far as this end.
    intervals = contact_intervals(half_points[[0, -1]], force[[0, -1]], contact_edges)
    are_alike = patch_model.pieces.are_alike
    edge_values = EdgeValues(
        length=float(np.diff(intervals).sum()),
        width=float(intervals[-1, 1] - intervals[0, 0]),
        normal=set_stiffness(normal, active, unit, contact_edges),
        tangential=set_stiffness(shear, active, unit, contact_edges) if are_alike else 0.0,
        rotational=set_stiffness(normal, active, x, contact_edges),
    )

    # At an end of the interface the pressure is that of the point there.
    peak = estimate_peak_pressure(x, sigma, node_fraction=unit)
    values = assemble_static_values(length, normal.area * count, solution, peak, edge_values)
    # For dissimilar pieces, the tangential stiffness also depends on the coupling of shear and normal
    # displacement, which is not computed here.
    if not are_alike:
        del values["tangential_stiffness"]

    # What this level resolves, for the errors that a finer level does not show.
    cell = length / count
    resolution = Resolution(
        length=length,
        n_nodes=int(active.sum()),
        longest_cell=cell * bool(contact_edges),
        edge_cells=cell * len(contact_edges),
        edge_offset=MIN_CONTACT_EDGE_ERROR_IN_CELLS,
        can_rotate=patch_model.loading.moment is not None,
        closing=float(np.ptp(gap) + largest_deflection),
    )
    n_corner = max(1, round(CORNER_REGION_LENGTH_RATIO * count))
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


def _solve_nodal_forces(patch_model, normal: PointCompliance, gap, start) -> PointForces:
    """Solve for the nodal forces of a refinement level under the prescribed load or approach.

    Parameters
    ----------
    patch_model : PatchModel
        Pieces and loading.
    normal : PointCompliance
        Normal compliance of the n points of the level.
    gap : (n,) array
        Gap of the unloaded pieces [m].
    start : (n/2,) array or None
        Forces [N] on the level with half as many points.
    """
    x = normal.x
    loading = patch_model.loading
    initial_force = None if start is None else np.repeat(start, 2) / 2
    offset = float(gap.min()) if loading.approach is None else loading.approach
    problem = make_patch_problem(
        x, gap - offset, loading.load, loading.moment, loading.rotational_stiffness
    )
    force, n_iterations = solve_by_gradients(
        normal, problem, CONTACT_RESIDUAL_TOL, MAX_CONTACT_ITERATIONS, initial_force
    )

    # Approach and rotation follow from the rigid motion of the loaded points, as far as it is free (least squares).
    active = force > 0
    closing = gap - offset + normal.product(force)
    motion = np.zeros(2)
    motion[: problem.target.size] = fit_motion(problem.motions[active], closing[active])
    approach, slope = motion.tolist()
    return PointForces(
        force,
        float(force.sum()),
        float(force @ x),
        approach=offset + approach,
        rotation=patch_model.gap.angle - slope,
        n_iterations=n_iterations,
    )
