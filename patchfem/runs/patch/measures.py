"""Static measures of a patch, with error estimates from coarser meshes.

In: a `Patch` and the same patch on coarser meshes. Out: measures by name. A value is that of the
finest mesh, or its limit by extrapolation (`limits`). Its error contains the change that further
refinement would cause and the errors that refinement does not show (`estimate_hidden_errors`). The
module also estimates the model error due to the plane state.
"""

from dataclasses import replace
from itertools import pairwise, takewhile
from typing import NamedTuple

import numpy as np

from ...contact import edges
from ...core import Measure, PatchfemError, compute_allowed_error
from ...formatting import format_length
from ...mesh.grid import TensorGrid
from ..results.patch_rows import (
    EXTRAPOLATED_SOURCE,
    FINEST_MESH_SOURCE,
    MESH_MEASURES,
    PATCH_TABLE,
    Measures,
    Values,
    make_measure,
)
from .condensed import condense_once
from .limits import extrapolate_to_zero_cell_length
from .press import Patch, Patches, solve_patch_contact
from .values import (
    compute_static_values,
    edge_cell_lengths,
    open_rounded_length,
    unresolved_edge_rounding_pressure,
)

# Smallest width/height of a piece for plane strain without doubt; the inverse holds for plane
# stress.
MIN_PLANE_STRAIN_WIDTH_RATIO = 8.0
# Smallest number of contact nodes at which the measures no longer depend on it.
MIN_RESOLVED_CONTACT_NODES = 12
# Largest number of nodes of a contact that counts as not resolved.
MAX_UNRESOLVED_CONTACT_NODES = 3
CONTACT_SOLUTION_ROUND_OFF = 5e-12  # Relative round-off error of the solved contact equations.
# Smallest relative error that is reported; no application needs a smaller one.
MIN_REPORTED_RELATIVE_ERROR = 1e-9
# Smallest position error of a contact edge, in cell lengths.
MIN_CONTACT_EDGE_ERROR_IN_CELLS = 0.012
# Ratio of the remaining increase of a corner pressure to its change by the last refinement.
CORNER_PRESSURE_RISE_FACTOR = 4.0
# Fraction of the corner pressure of a coating that cells longer than the coating thickness miss.
MISSED_CORNER_PRESSURE_FRACTION = 0.15
# Ratio of the hidden error of an extrapolated value to that of the finest mesh: 4/3 + 1/3, rounded
# up.
HIDDEN_ERROR_EXTRAPOLATION_FACTOR = 2.0
# Error factor for meshes that do not resolve the rounded ends of a piece.
UNRESOLVED_ROUNDING_ERROR_FACTOR = 2.0
MEASURES_BETWEEN_PLANE_STATES = ("pressure_peak", "normal_stiffness", "tangential_stiffness")
# Measures without a value where the pressure is unbounded.
PRESSURE_PEAK_MEASURES = ("pressure_peak", "loaded_fraction")


def estimate_static_measures(
    fine: Patch, *coarse: Patch | None, tolerance: float | None = None
) -> Measures:
    """Return the static measures of a patch with their error estimates.

    A value is that of the finest mesh, or its limit for vanishing cells if the value misses the
    tolerance and the limit is more accurate (`limits`). The error is the larger one of the change
    that further refinement would cause and of the errors that no refinement shows
    (`estimate_hidden_errors`).

    The pressure peak on a mesh is the vertex of the parabola through the largest nodal pressure and its
    neighbours, or at an end of the interface the end value of the curve whose cell means are the nodal
    pressures (`values.estimate_peak_pressure`). Lengths and stiffnesses include the part of a cell
    beyond the last loaded node (`contact.edges`).

    Parameters
    ----------
    fine : Patch
        The patch on its finest mesh.
    *coarse : Patch or None
        The patch on coarser meshes, from fine to coarse; None where there is no such mesh.
    tolerance : float or None
        Values whose error exceeds this tolerance are extrapolated. None: nothing is extrapolated.

    Returns
    -------
    dict
        Measure by name. The error is None without a coarser mesh, and 0 without a load.
    """
    finest = compute_static_values(fine)
    coarse = _select_meshes_with_same_contact_intervals(
        fine, [patch for patch in coarse if patch is not None]
    )

    # The series over the meshes gives a value, its limit and their errors.
    if coarse and finest["normal_load"] > 0:
        missed_peak = unresolved_edge_rounding_pressure(fine)
        out = extrapolate_static_measures(
            [*(compute_static_values(patch) for patch in reversed(coarse)), finest],
            estimate_hidden_errors(_compute_resolution(fine, missed_peak), finest),
            tolerance,
            all(are_cells_halved(a.pair, b.pair) for a, b in pairwise((fine, *coarse))),
            max(MIN_REPORTED_RELATIVE_ERROR, fine.pair.round_off_error),
            UNRESOLVED_ROUNDING_ERROR_FACTOR if missed_peak else 1.0,
            has_same_gap=fine.model.gap.profile is None,
        )
    else:
        error = 0.0 if coarse else None
        out = {}
        for name, value in finest.items():
            out[name] = make_measure(name, value, error, FINEST_MESH_SOURCE)

    # Errors and reasons that no series over meshes shows.
    if coarse and fine.averaging is not None:
        out |= _widen_errors_by_corner_pressure(out, fine, coarse[0])
    if fine.points is not None:
        out |= _select_more_accurate_measures(out, fine.points.measures)
    reason = _reason_for_unbounded_pressure(fine)
    for name in PRESSURE_PEAK_MEASURES if reason else ():
        out[name] = replace(out[name], value=None, error=None, reason=reason)
    return out


def with_static_measures(patches, tolerance: float | None, points=None) -> Patches:
    """Return solved patches of which the finest one has its static measures with their errors.

    The floor of the error of a measure that is a difference of larger terms is at least the tolerance times these terms:
    rotation times half the length for the approach, half the length for the centre of pressure, and load times half the
    length for the moment.

    Parameters
    ----------
    patches : sequence of Patch or None
        One patch on meshes from fine to coarse; None where there is no such mesh.
    tolerance : float or None
        Measures that miss it are extrapolated if the mesh is automatic (`PatchMesh`). None: no floor is raised.
    points : PointSolution, optional
        Solution on the points of a profile, added to the finest patch.

    Returns
    -------
    tuple
        The patches; the first one is a copy with `Patch.measures` and the points.
    """
    fine, *coarse = patches
    if points is not None:
        fine = replace(fine, points=points, averaging=points.spacing)
    used_tolerance = tolerance if fine.model.mesh.is_automatic else None
    measures = estimate_static_measures(fine, *coarse, tolerance=used_tolerance)

    arm = fine.model.pieces.length / 2
    larger_terms = {
        "approach": abs(measures["rotation"].value) * arm,
        "pressure_centre": arm,
        "moment": measures["normal_load"].value * arm,
    }
    for name, size in larger_terms.items():
        floor = max(measures[name].floor, (tolerance or 0.0) * size)
        measures[name] = replace(measures[name], floor=floor)
    return replace(fine, measures=measures), *coarse


def _select_more_accurate_measures(by_mesh: Measures, by_points: Measures) -> Measures:
    """Return those measures by name that the points of a profile determine more accurately than the mesh.

    `by_mesh` and `by_points` are the measures of both solutions. Peak measures are compared by their relative errors: a
    mesh that smooths the profile has a low peak pressure, and therefore a small absolute error.
    """
    out = {}
    for name, measure in by_points.items():
        other = by_mesh[name]
        ratio = 1.0
        if name in PRESSURE_PEAK_MEASURES and measure.value and other.value:
            ratio = other.value / measure.value
        if ratio * measure.error < other.error:
            out[name] = measure
    return out


def _select_meshes_with_same_contact_intervals(fine: Patch, coarse: list[Patch]) -> list[Patch]:
    """Select the coarser solutions with as many contact intervals as the finest one.

    A short contact interval beside a step may be missing on a coarse mesh. The change to this mesh
    then says nothing about the order of convergence, so that this mesh and all coarser ones are
    left out.

    Parameters
    ----------
    fine : Patch
        The patch on its finest mesh.
    coarse : list of Patch
        From fine to coarse.

    Returns
    -------
    list of Patch
        At least one solution; if it is the only one, its change determines the error.
    """
    if not fine.model.gap.step_edges:
        return coarse
    n_intervals = _count_contact_intervals(fine.active)
    selected = takewhile(
        lambda patch: _count_contact_intervals(patch.active) == n_intervals, coarse
    )
    return list(selected) or coarse[:1]


def _count_contact_intervals(active) -> int:
    """Return the number of separate parts of the interface that are in contact, from the contact set (m,) of its nodes."""
    return int(np.count_nonzero(active & np.diff(active, prepend=False)))


def _widen_errors_by_corner_pressure(
    measures_by_name: Measures, fine: Patch, coarse: Patch
) -> Measures:
    """Increase the errors of the peak measures if the pressure at a corner still grows.

    At a corner that the profile just reaches, every refinement raises the pressure, although the
    largest pressure of the patch may not change yet.

    Parameters
    ----------
    measures_by_name : dict of str to Measure
        Measures of the patch, with the errors found so far.
    fine, coarse : Patch
        Patch on the finest mesh, and on the mesh before it.

    Returns
    -------
    dict of str to Measure
        The peak measures with larger errors; {} if their errors are large enough already.
    """
    pressure = fine.pressure.sigma_n[[0, -1]].max()
    coarse_pressure = coarse.pressure.sigma_n[[0, -1]].max()
    peak, fraction = (measures_by_name[name] for name in PRESSURE_PEAK_MEASURES)
    error = pressure + CORNER_PRESSURE_RISE_FACTOR * abs(pressure - coarse_pressure) - peak.value
    if not pressure or error <= peak.error:
        return {}
    peak = replace(peak, error=float(error))
    return dict(zip(PRESSURE_PEAK_MEASURES, (peak, widen_fraction_error(peak, fraction))))


def extrapolate_static_measures(
    values_by_mesh: list[Values],
    hidden_errors: Values,
    tolerance: float | None,
    nested: bool = True,
    min_relative_error: float = MIN_REPORTED_RELATIVE_ERROR,
    error_factor: float = 1.0,
    *,
    has_same_gap: bool = True,
) -> Measures:
    """Extrapolate static measures over a sequence of refined meshes, with error estimates.

    The error of a value is the larger one of `error_factor` times the error of the series (`limits`) and
    the hidden error. For an extrapolated value the hidden error counts with HIDDEN_ERROR_EXTRAPOLATION_FACTOR.

    Parameters
    ----------
    values_by_mesh : list of dict
        Values on two meshes or more by name, coarse to fine.
    hidden_errors : dict
        Errors by name that no refinement shows (`estimate_hidden_errors`).
    tolerance : float or None
        Values whose error exceeds this tolerance are extrapolated. None: nothing is extrapolated.
    nested : bool
        Whether every mesh halves the cells of the previous one.
    min_relative_error : float
        Lower bound of the relative errors.
    error_factor : float
        Factor on all errors.
    has_same_gap : bool
        Whether the gap is the same on all meshes, which that of a measured profile is not.

    Returns
    -------
    dict
        Measure by name.
    """
    out = {}
    for name, finest in values_by_mesh[-1].items():
        series = [values[name] for values in values_by_mesh]
        limit = extrapolate_to_zero_cell_length(series, nested, has_same_gap=has_same_gap)
        hidden = hidden_errors.get(name, 0.0)

        # The limit replaces the value only if it is needed and has the smaller error.
        value = finest
        error = max(error_factor * limit.error, hidden)
        allowed = np.inf
        if tolerance is not None:
            allowed = compute_allowed_error(tolerance, finest, PATCH_TABLE[name].floor)
        if limit.extrapolated != finest and error > allowed:
            extrapolated_error = max(
                error_factor * limit.extrapolated_error, HIDDEN_ERROR_EXTRAPOLATION_FACTOR * hidden
            )
            if extrapolated_error < error:
                value = limit.extrapolated
                error = extrapolated_error

        error = max(error, min_relative_error * abs(finest))
        engine = FINEST_MESH_SOURCE if value == finest else EXTRAPOLATED_SOURCE
        out[name] = make_measure(name, value, error, engine)

    out["loaded_fraction"] = widen_fraction_error(*(out[name] for name in PRESSURE_PEAK_MEASURES))
    return out


def widen_fraction_error(peak: Measure, fraction: Measure) -> Measure:
    """Return the loaded fraction with an error that is at least that due to the peak pressure.

    The loaded fraction is the mean pressure divided by the peak pressure, so that both have the same
    relative error.
    """
    relative = peak.error / peak.value if peak.value > 0 else 0.0
    error = fraction.value * relative / (1 - min(relative, 0.5))
    return replace(fraction, error=max(fraction.error, error))


def max_mesh_error_ratio(measures_by_name: Measures, tolerance: float) -> float:
    """Return the largest ratio of error to allowed error of the measures that control the mesh.

    A ratio above 1 means that a measure misses the tolerance. Measures without value or error are
    ignored.
    """
    return max(measures_by_name[name].error_ratio(tolerance) for name in MESH_MEASURES)


def _reason_for_unbounded_pressure(patch: Patch) -> str:
    """Return why the peak pressure of a patch diverges under mesh refinement, or "" if it does not.

    A contact that ends at the edge of a step has the pressure singularity of a flat punch; a
    contact that extends over a closed step has a stronger one. An asperity layer (skin) bounds the
    pressure.
    """
    if patch.has_skin:
        return ""
    x = patch.x
    cells = np.diff(x)
    is_loaded = patch.active
    if patch.model.has_singular_ends and is_loaded[[0, -1]].any():
        return (
            "unbounded: a sharp corner of one piece presses on the longer face of the other piece"
        )
    for jump in patch.model.gap.step_edges:
        cell = cells[np.clip(np.searchsorted(x, jump), 1, cells.size) - 1]
        if is_loaded[np.abs(x - jump) <= 1.5 * cell].any():
            return f"unbounded, because the contact reaches a sharp corner, the edge of the step at {jump:.4g} m"
    return ""


def are_cells_halved(fine, coarse) -> bool:
    """Return whether the condensed pieces `fine` have a mesh that halves every cell of that of `coarse`."""
    bodies = ((fine.grid, coarse.grid), (fine.upper_grid, coarse.upper_grid))
    for halved, grid in bodies:
        if not (isinstance(halved, TensorGrid) and isinstance(grid, TensorGrid)):
            return False
        if halved.x.size != 2 * grid.x.size - 1 or halved.depth.size != 2 * grid.depth.size - 1:
            return False
    return True


class Resolution(NamedTuple):
    """Resolution of a contact by its mesh, from which hidden discretization errors follow.

    - length: length of the interface [m].
    - n_nodes: nodes in contact.
    - longest_cell, edge_cells: longest cell in which the contact ends, and the sum of all such
      cells [m].
    - edge_offset: position error of a contact edge, in cells; None under a smooth asperity layer, where it has no edge.
    - can_rotate: whether the rotation is free.
    - closing: range of the gap plus the largest elastic displacement [m].
    - corner_pressure: pressure [Pa] at loaded corners of a coating that the mesh misses.
    - wedge_pressure: pressure [Pa] beside a contact of few nodes.
    - rounding_pressure: peak pressure [Pa] of a rounded end that the mesh does not resolve.
    - open_ends: length of the rounded surface on which a contact edge may lie [m].
    - inner_cells: part of `edge_cells` between contact intervals [m].
    """

    length: float
    n_nodes: int
    longest_cell: float
    edge_cells: float
    edge_offset: float
    can_rotate: bool
    closing: float
    corner_pressure: float = 0.0
    wedge_pressure: float = 0.0
    rounding_pressure: float = 0.0
    open_ends: float = 0.0
    inner_cells: float = 0.0


def _compute_resolution(patch: Patch, missed_peak: float) -> Resolution:
    """Return how well the mesh of a solved patch resolves its contact.

    `missed_peak` is the measure `unresolved_edge_rounding_pressure` [Pa].
    """
    pair = patch.pair
    pieces = patch.pieces
    active = patch.active
    interface = pieces.interface
    sigma = patch.pressure.sigma_n

    all_cells = np.diff(interface.x)
    cells = edge_cell_lengths(patch.x, active)
    longest_cell = float(cells.max(initial=0.0))
    corner_pressure = 0.0
    if pieces is pair.compliance:  # An asperity layer (skin) bounds the pressure.
        # The free end of a coating raises the pressure in a layer as long as the coating is thick.
        # Cells longer than this layer do not resolve it; for shorter cells the missed pressure falls
        # with the square of their length.
        thicknesses = [grid.coating_thickness for grid in (pair.grid, pair.upper_grid)]
        thinnest = min((thickness for thickness in thicknesses if thickness > 0), default=np.inf)
        fraction = np.minimum(1.0, (all_cells[[0, -1]] / thinnest) ** 2)
        corner_pressure = float((MISSED_CORNER_PRESSURE_FRACTION * sigma[[0, -1]] * fraction).max())

    first, last = ~active[[0, -1]]
    n_nodes = max(int(active.sum()), 1)

    is_unresolved = n_nodes <= MAX_UNRESOLVED_CONTACT_NODES and cells.any()
    edge_offset = None
    if not patch.has_smooth_skin:
        edge_offset = _contact_edge_position_error(pair, longest_cell)
    return Resolution(
        length=interface.length,
        n_nodes=n_nodes,
        longest_cell=longest_cell,
        edge_cells=float(cells.sum()),
        edge_offset=edge_offset,
        can_rotate="moment_balance" in patch.pressure.residuals,
        closing=float(
            np.ptp(patch.unloaded_gap) + np.abs(pieces.normal @ (sigma * interface.weight)).max()
        ),
        corner_pressure=corner_pressure,
        wedge_pressure=_wedge_indentation_pressure(patch) if is_unresolved else 0.0,
        rounding_pressure=missed_peak,
        open_ends=float(open_rounded_length(patch)),
        inner_cells=float(cells[int(first) : cells.size - int(last)].sum()),
    )


def estimate_hidden_errors(resolution: Resolution, finest: Values) -> Values:
    """Estimate the errors of the static measures that mesh refinement does not reveal.

    They are due to a contact of few nodes, to a coating thinner than the cells at a loaded corner,
    to a rounded end shorter than the cells, and to round-off. The error of the pressure peak p is
    p/(4 n^2) for a contact of n <= MIN_RESOLVED_CONTACT_NODES nodes that ends inside the interface, plus the
    unresolved pressure of a corner, and at least that of a wedge or what a rounded end would add to p.

    Parameters
    ----------
    resolution : Resolution
        Resolution of the finest mesh.
    finest : dict
        Values on the finest mesh by name.

    Returns
    -------
    dict
        Error by name.
    """
    length = resolution.length
    n_nodes = resolution.n_nodes
    load = finest["normal_load"]
    peak = finest["pressure_peak"]

    # Errors add up over the edges of the contact: half of all their cells, but at least the longest one. The centre of a
    # resolved contact is far more accurate than its edges, because their position errors are alike.
    cell = max(resolution.longest_cell, resolution.edge_cells / 2)
    is_unresolved = n_nodes <= MAX_UNRESOLVED_CONTACT_NODES
    centre_error = cell / (2 * n_nodes**2) if is_unresolved else 1e-3 * cell

    peak_error = resolution.corner_pressure
    if cell > 0 and n_nodes <= MIN_RESOLVED_CONTACT_NODES:
        peak_error = peak_error + peak / (4 * n_nodes**2)
    peak_error = max(peak_error, resolution.wedge_pressure, resolution.rounding_pressure - peak)

    # A nodal displacement has the round-off of its terms, and an error of the centre times the angle of rotation. A
    # prescribed rotation has neither error.
    displacement = CONTACT_SOLUTION_ROUND_OFF * (abs(finest["approach"]) + resolution.closing)
    displacement += abs(finest["rotation"]) * centre_error
    fraction_per_pressure = finest["loaded_fraction"] / peak if peak else 0.0

    edge_offset = 0.0
    if resolution.edge_offset is not None:
        # In a contact of few nodes, an edge may lie anywhere in its cell.
        min_offset = 1.0 if is_unresolved else 1 / n_nodes**2
        edge_offset = max(resolution.edge_offset, min_offset)
    outer_cells = resolution.edge_cells - resolution.inner_cells
    length_error = edge_offset * resolution.edge_cells + resolution.open_ends
    width_error = edge_offset * outer_cells + resolution.open_ends

    return {
        "normal_load": 1e-10 * load,
        "pressure_peak": peak_error,
        "contact_fraction": length_error / length,
        "contact_half_width": width_error / 2,
        "loaded_fraction": peak_error * fraction_per_pressure,
        "pressure_centre": CONTACT_SOLUTION_ROUND_OFF * length + centre_error,
        "moment": (CONTACT_SOLUTION_ROUND_OFF * length + centre_error) * load,
        "rotation": displacement / length * resolution.can_rotate,
        "approach": CONTACT_SOLUTION_ROUND_OFF * resolution.closing,
    }


def _contact_edge_position_error(pair, cell):
    """Return the position error of a contact edge between two nodes, in cell lengths.

    A soft coating thinner than the cells acts as a Winkler foundation, whose contact ends where the
    nodal pressure vanishes. cell: longest cell in which the contact ends [m].
    """
    # The first row of a mesh file has no single height, on which the offset of an edge depends.
    out = MIN_CONTACT_EDGE_ERROR_IN_CELLS if isinstance(pair.grid, TensorGrid) else 0.1
    for grid, piece in ((pair.grid, pair.piece), (pair.upper_grid, pair.upper)):
        if grid.coating_thickness > 0:
            ratio = piece.layers.coating[0] / piece.layers.substrate[0]
            contrast = 1 - min(ratio, 1 / ratio)
            cells = min(1.0, cell / grid.coating_thickness)
            out = max(out, edges.compute_edge_offset(cells, cells, 0.0) * contrast)
    return out


def _wedge_indentation_pressure(patch: Patch) -> float:
    """Return the largest pressure [Pa] compatible with the slope of the gap beside the contact.

    It is E* times the slope, as for the indentation by a wedge, and is used for contacts of few
    nodes.
    """
    ends = np.flatnonzero(patch.active[1:] != patch.active[:-1])
    slopes = np.abs(np.diff(patch.unloaded_gap)) / np.diff(patch.x)
    flexibility = 0
    for piece in (patch.pair.piece, patch.pair.upper):
        young, nu = max(piece.layers.coating, piece.layers.substrate)
        flexibility += (1 - nu**2) / young
    return float(slopes[..., ends].max() / flexibility)


def note_on_plane_state(patch_model, patch: Patch) -> list[str]:
    """Return a list with a note on the model error due to assuming plane strain or plane stress.

    The list is empty for a piece in plane strain that is far wider than tall, and for one in plane
    stress that is far taller than wide. No mesh refinement reduces this error.
    """
    pieces = patch_model.pieces
    ratio = pieces.width / pieces.height
    if pieces.plane == "strain":
        other_plane = "stress"
        is_certain = ratio >= MIN_PLANE_STRAIN_WIDTH_RATIO
    else:
        other_plane = "strain"
        is_certain = ratio <= 1 / MIN_PLANE_STRAIN_WIDTH_RATIO
    if is_certain:
        return []

    assumption = (
        f"plane {pieces.plane} is assumed, and the pieces are {ratio:.2g} times as wide as tall; "
        "the true state lies between plane strain and plane stress"
    )

    # The change between the two plane states bounds the error, because the true state lies between
    # them.
    other_model = replace(patch_model, pieces=replace(pieces, plane=other_plane))
    try:
        pair = condense_once(other_model, *patch.pair.meshes)
        other_values = compute_static_values(solve_patch_contact(other_model, pair, coarse=patch))
    except PatchfemError as error:
        return [
            f"{assumption}; how much the two "
            f"differ is not known, because for plane {other_plane} the contact could not be solved ({error})"
        ]

    changes = _format_changes(patch_model, compute_static_values(patch), other_values)
    if not changes:
        return []
    return [
        f"{assumption}; plane {other_plane} would change the results by these amounts: {', '.join(changes)}"
    ]


def _format_changes(patch_model, values: Values, other_values: Values) -> list[str]:
    """Format the changes of the measures from the assumed plane state to the opposite one.

    `values` and `other_values` are the static measures in the assumed and in the opposite state, by name. Changes of up to
    0.1 % are left out. If the scene of `patch_model` prescribes the approach, the load is a measure that changes.
    """
    changes = []
    names = MEASURES_BETWEEN_PLANE_STATES
    if patch_model.loading.approach is not None:
        names = ("normal_load", *names)
    elif approach_change := other_values["approach"] - values["approach"]:
        changes.append(
            f"approach by {'+' * (approach_change > 0)}{format_length(approach_change, 3)}"
        )
    for name in names:
        change = other_values[name] / values[name] - 1 if values[name] else 0.0
        if abs(change) > 1e-3:
            changes.append(f"{name} by {100 * change:+.2g} %")
    return changes
