"""Static measures of a patch, with error estimates from coarser meshes.

In: a `Patch` and the same patch on coarser meshes. Out: measures by name. A value is that of the
finest mesh, or its limit by extrapolation (`limits`). Its error contains the change that further
refinement would cause and the errors that refinement does not show (`estimate_hidden_errors`). The
module also estimates the model error due to the plane state.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...contact import edges
from ...core import PatchfemError, compute_allowed_error
from ...formatting import format_length
from ...mesh.grid import TensorGrid
from ..results.patch_rows import (
    EXTRAPOLATED_SOURCE,
    FINEST_MESH_SOURCE,
    MESH_MEASURES,
    PATCH_TABLE,
    Arrays,
    Measures,
    Values,
    make_measure,
)
from .condensed import CondensedPair, condense
from .limits import extrapolate_to_zero_cell_length
from .press import Patch, Patches, PressedCases, solve_patch_contact
from .values import (
    compute_static_values,
    compute_values,
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
# Ratio of the hidden error of an extrapolated value to that of the finest mesh: 4/3 + 1/3, rounded
# up.
HIDDEN_ERROR_EXTRAPOLATION_FACTOR = 2.0
# Error factor for meshes that do not resolve the rounded ends of a piece.
UNRESOLVED_ROUNDING_ERROR_FACTOR = 2.0
MEASURES_BETWEEN_PLANE_STATES = ("pressure_peak", "normal_stiffness", "tangential_stiffness")
# Measures without a value where the pressure is unbounded.
PRESSURE_PEAK_MEASURES = ("pressure_peak", "loaded_fraction")


class MeshValues(NamedTuple):
    """What the error estimate needs of n cases on one mesh.

    - pair: condensed pieces of the mesh.
    - values {name: (n,)}: static measures in SI units.
    - n_intervals (n,): number of separate intervals in contact.
    - end_pressure (n,): larger one of the pressures [Pa] at the ends of the interface.
    """

    pair: CondensedPair
    values: Arrays
    n_intervals: np.ndarray
    end_pressure: np.ndarray

    def take(self, rows) -> "MeshValues":
        """Return selected cases; `rows` are indices or a mask (n,)."""
        values = {name: column[rows] for name, column in self.values.items()}
        return MeshValues(self.pair, values, self.n_intervals[rows], self.end_pressure[rows])


def collect_mesh_values(pressed: PressedCases) -> MeshValues:
    """Return what the error estimate needs of pressed cases."""
    active = pressed.active
    begins = active & np.diff(active, axis=1, prepend=False)
    end_pressure = pressed.contact_pressure[:, [0, -1]].max(axis=1)
    return MeshValues(
        pressed.level.pair, compute_values(pressed), np.count_nonzero(begins, axis=1), end_pressure
    )


class StaticEstimates(NamedTuple):
    """Static measures of n cases with their errors, as arrays (k, n) of k measures in SI units.

    - names: names of the measures.
    - values, errors: a value is NaN where the pressure is unbounded; an error is NaN without a coarser mesh, and 0 without
      load.
    - is_limit (k, n): whether the value is extrapolated to vanishing cells.
    - reasons: {reason: mask (n,) of the cases whose pressure is unbounded for this reason}.
    - floors (k, n): absolute errors that are allowed at any tolerance (`compute_floors`); None before they are known.
    """

    names: tuple[str, ...]
    values: np.ndarray
    errors: np.ndarray
    is_limit: np.ndarray
    reasons: Arrays
    floors: np.ndarray | None = None

    def make_measures(self, case: int) -> Measures:
        """Return the static measures of the case with an index, by name, with errors and reasons of missing values."""
        out = {}
        reason = next((text for text, mask in self.reasons.items() if mask[case]), "")
        for name, value, error, is_limit in zip(
            self.names, self.values[:, case], self.errors[:, case], self.is_limit[:, case]
        ):
            source = EXTRAPOLATED_SOURCE if is_limit else FINEST_MESH_SOURCE
            out[name] = make_measure(name, value, None if np.isnan(error) else error, source)
            if reason and name in PRESSURE_PEAK_MEASURES:
                out[name] = replace(out[name], value=None, error=None, reason=reason)
        return out

    def compute_excess(self, tolerance: float) -> np.ndarray:
        """Return the largest ratios (n,) of error to allowed error of the measures that control the mesh.

        Measures without value or error do not count. `tolerance` is relative.
        """
        rows = [self.names.index(name) for name in MESH_MEASURES]
        columns = (self.values[rows], self.errors[rows], self.floors[rows])
        return compute_error_ratios(tolerance, *columns).max(axis=0)


def compute_floors(values: "Arrays | Values", tolerance: float, length: float) -> np.ndarray:
    """Return the absolute errors (k, n) of static measures that are allowed at any tolerance.

    The floor of a measure that is a difference of larger terms is at least the tolerance times these terms
    (`list_larger_terms`).

    Parameters
    ----------
    values : dict
        All k static measures by name; numbers or arrays (n,).
    tolerance : float
        Relative tolerance; 0 raises no floor.
    length : float
        Length [m] of the interface.
    """
    larger_terms = list_larger_terms(values, tolerance * length / 2)
    floors = []
    for name, value in values.items():
        floor = np.maximum(PATCH_TABLE[name].floor, larger_terms.get(name, 0.0))
        floors.append(floor + np.zeros(np.shape(value)))
    return np.array(floors)


def compute_error_ratios(tolerance: float, values, errors, floors) -> np.ndarray:
    """Return the ratios (k, n) of the errors of k measures of n cases to those that a tolerance allows.

    The rule is that of `core.Measure.error_ratio`. A measure without value or error has the ratio 0.

    Parameters
    ----------
    tolerance : float
        Relative tolerance.
    values, errors, floors : (k, n) ndarray
        Measures with their errors and absolute floors, in the unit of each measure; NaN where there is none.
    """
    allowed = np.maximum(compute_allowed_error(tolerance, values, floors), 1e-300)
    with np.errstate(over="ignore"):  # of a value of 0 without a floor
        return np.nan_to_num(errors / allowed)


def list_larger_terms(
    values: "Arrays | Values", arm: float, arm_y: float | None = None
) -> "Arrays | Values":
    """Return the sizes of the larger terms whose differences some measures are, by name, in the units of the measures.

    Parameters
    ----------
    values : dict
        Static measures by name, numbers or arrays (n,).
    arm : float
        Half the length of the interface [m], or a fraction of it for a fraction of the terms.
    arm_y : float, optional
        Half the width [m] of a face whose pressure varies along y, or the same fraction of it.

    Returns
    -------
    dict
        The arms for the centres of pressure, the load times them for the moments, and the rotations times them for the
        approach; numbers or arrays (n,).
    """
    load = values["normal_load"]
    terms = {
        "approach": np.abs(values["rotation"]) * arm,
        "pressure_centre": arm,
        "moment": load * arm,
    }
    if arm_y is not None:
        terms["approach"] = terms["approach"] + np.abs(values["roll"]) * arm_y
        terms |= {"pressure_centre_y": arm_y, "roll_moment": load * arm_y}
    return terms


def estimate_static_measures(
    fine: PressedCases,
    series: list[MeshValues],
    tolerance: float | None = None,
    centre_error: float | None = None,
) -> StaticEstimates:
    """Return the static measures of pressed cases with their error estimates.

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
    fine : PressedCases
        n cases on their finest mesh.
    series : list of MeshValues
        The same cases on all meshes from coarse to fine, the last one that of `fine`.
    tolerance : float or None
        Relative tolerance of the floors. On an automatic mesh, values whose error exceeds it are extrapolated. None: nothing
        is extrapolated, and no floor is raised.
    centre_error : float
        Error of the centre of a resolved contact [cell lengths]; by default that of a mesh for one contact.

    Returns
    -------
    StaticEstimates
    """
    finest = series[-1].values
    names = tuple(finest)
    model = fine.level.model
    n_meshes = _count_meshes_with_same_intervals(fine, series)
    missed_peak = unresolved_edge_rounding_pressure(fine)
    resolution = _compute_resolution(fine, missed_peak)
    if centre_error is not None:
        stiffness = _compute_turn_stiffness(fine, resolution.longest_cell)
        resolution = resolution._replace(centre_error=centre_error, turn_stiffness=stiffness)
    hidden_errors = estimate_hidden_errors(resolution, finest)
    factor = np.where(missed_peak > 0, UNRESOLVED_ROUNDING_ERROR_FACTOR, 1.0)
    values = np.array(list(finest.values()))
    errors = np.full(values.shape, np.nan if len(series) == 1 else 0.0)
    is_limit = np.zeros(values.shape, bool)

    # Cases with the same number of usable meshes form one series; without load there are no errors.
    for count in np.unique(n_meshes) if len(series) > 1 else ():
        rows = (n_meshes == count) & (finest["normal_load"] > 0)
        if not rows.any():
            continue
        used = series[-count:]
        part = extrapolate_static_values(
            [mesh.take(rows).values for mesh in used],
            {name: error[rows] for name, error in hidden_errors.items()},
            tolerance if model.mesh.is_automatic else None,
            max(MIN_REPORTED_RELATIVE_ERROR, fine.level.pair.round_off_error),
            factor[rows],
            nested=all(are_cells_halved(b.pair, a.pair) for a, b in pairwise(used)),
            has_same_gap=model.gap.profile is None,
        )
        values[:, rows] = part.values
        errors[:, rows] = part.errors
        is_limit[:, rows] = part.is_limit

    floors = compute_floors(dict(zip(names, values)), tolerance or 0.0, model.pieces.length)
    if centre_error is not None:
        # The rotation due to an error of the moment is allowed if the moment meets its tolerance
        name = "rotation"
        row = names.index(name)
        allowed = HIDDEN_ERROR_EXTRAPOLATION_FACTOR * hidden_errors[name]
        floors[row] = np.maximum(floors[row], allowed)
    reasons = _find_unbounded_pressure(fine)
    estimates = StaticEstimates(names, values, errors, is_limit, reasons, floors)
    if len(series) > 1 and model.gap.profile is not None:
        _widen_errors_by_end_pressure(estimates, *series[-2:])
    for mask in estimates.reasons.values():
        for name in PRESSURE_PEAK_MEASURES:
            values[names.index(name), mask] = np.nan
            errors[names.index(name), mask] = np.nan
    return estimates


def with_static_measures(patches, tolerance: float | None, points=None) -> Patches:
    """Return solved patches of which the finest one has its static measures with their errors.

    Parameters
    ----------
    patches : sequence of Patch or None
        One patch on meshes from fine to coarse; None where there is no such mesh.
    tolerance : float or None
        Relative tolerance (`estimate_static_measures`).
    points : PointSolution, optional
        Solution on the points of a profile, added to the finest patch.

    Returns
    -------
    tuple
        The patches; the first one is a copy with `Patch.measures` and the points.
    """
    fine, *coarse = patches
    meshes = [patch.pressed for patch in (fine, *coarse) if patch is not None]
    estimates = estimate_static_measures(
        fine.pressed,
        [collect_mesh_values(pressed) for pressed in reversed(meshes)],
        tolerance,
    )
    return add_measures(fine, estimates, tolerance, points), *coarse


def add_measures(
    patch: Patch, estimates: StaticEstimates, tolerance: float | None, points=None
) -> Patch:
    """Return a patch with its static measures.

    Parameters
    ----------
    patch : Patch
        Patch on its finest mesh.
    estimates : StaticEstimates
        Measures of this single case.
    tolerance : float or None
        Relative tolerance, which raises the floors of differences of larger terms; None raises no floor.
    points : PointSolution, optional
        Solution on the points of a profile, added to the patch.
    """
    measures = estimates.make_measures(0)
    floors = estimates.floors[:, 0]
    if points is not None:
        patch = replace(patch, points=points, averaging=points.spacing)
        measures |= _select_more_accurate_measures(measures, points.measures)
        # The floors follow from the values of the points, if these are more accurate
        values = dict.fromkeys(measures, np.nan)
        known = {name: one.value for name, one in measures.items() if one.value is not None}
        floors = compute_floors(values | known, tolerance or 0.0, patch.model.pieces.length)
    for (name, measure), floor in zip(measures.items(), floors):
        measures[name] = replace(measure, floor=float(floor))
    return replace(patch, measures=measures)


def _select_more_accurate_measures(by_mesh: Measures, by_points: Measures) -> Measures:
    """Return those measures by name that the points of a profile determine more accurately than the mesh.

    `by_mesh` and `by_points` are the measures of both solutions. Peak measures are compared by their relative errors: a
    mesh that smooths the profile has a low peak pressure, and therefore a small absolute error. An unbounded pressure has no
    value on the points either.
    """
    out = {}
    for name, measure in by_points.items():
        other = by_mesh[name]
        if other.value is None:
            continue
        ratio = 1.0
        if name in PRESSURE_PEAK_MEASURES and measure.value and other.value:
            ratio = other.value / measure.value
        if ratio * measure.error < other.error:
            out[name] = measure
    return out


def _count_meshes_with_same_intervals(fine: PressedCases, series: list[MeshValues]) -> np.ndarray:
    """Return how many of the last meshes (n,) have as many contact intervals as the finest one.

    A short contact interval beside a step may be missing on a coarse mesh. The change to this mesh
    then says nothing about the order of convergence, so that this mesh and all coarser ones are
    left out. The change to one coarser mesh is always used.

    Parameters
    ----------
    fine : PressedCases
        n cases on their finest mesh.
    series : list of MeshValues
        The same cases on all meshes from coarse to fine.
    """
    if not fine.level.model.gap.step_edges:
        return np.full(len(fine), len(series))
    counts = np.array([mesh.n_intervals for mesh in reversed(series)])
    n_same = np.logical_and.accumulate(counts == counts[0]).sum(axis=0)
    return np.maximum(n_same, min(2, len(series)))


def _widen_errors_by_end_pressure(
    estimates: StaticEstimates, coarse: MeshValues, fine: MeshValues
) -> None:
    """Increase the errors of the peak measures if the pressure at a corner still grows, in place.

    At a corner that the profile just reaches, every refinement raises the pressure, although the
    largest pressure of the patch may not change yet.

    Parameters
    ----------
    estimates : StaticEstimates
        Measures of the cases, with the errors found so far.
    coarse, fine : MeshValues
        The cases on the last two meshes.
    """
    peak, fraction = (estimates.names.index(name) for name in PRESSURE_PEAK_MEASURES)
    pressure = fine.end_pressure
    growth = np.abs(pressure - coarse.end_pressure)
    # Ratio of the remaining increase of a corner pressure to its change by the last refinement.
    error = pressure + 4.0 * growth - estimates.values[peak]
    grows = (pressure > 0) & (error > estimates.errors[peak])
    estimates.errors[peak, grows] = error[grows]
    widened = compute_fraction_error(estimates, peak, fraction)
    estimates.errors[fraction, grows] = widened[grows]


def extrapolate_static_values(
    values_by_mesh: "list[Arrays] | list[Values]",
    hidden_errors: "Arrays | Values",
    tolerance: float | None,
    min_relative_error: float = MIN_REPORTED_RELATIVE_ERROR,
    error_factor: float | np.ndarray = 1.0,
    *,
    nested: bool = True,
    has_same_gap: bool = True,
) -> StaticEstimates:
    """Extrapolate static measures over a sequence of refined meshes, with error estimates.

    The error of a value is the larger one of `error_factor` times the error of the series (`limits`) and
    the hidden error. For an extrapolated value the hidden error counts with HIDDEN_ERROR_EXTRAPOLATION_FACTOR.

    Parameters
    ----------
    values_by_mesh : list of dict
        Values (n,) or numbers on two meshes or more by name, coarse to fine.
    hidden_errors : dict
        Errors by name that no refinement shows (`estimate_hidden_errors`).
    tolerance : float or None
        Values whose error exceeds this tolerance are extrapolated. None: nothing is extrapolated.
    min_relative_error : float
        Lower bound of the relative errors.
    error_factor : float or (n,) ndarray
        Factor on all errors.
    nested : bool
        Whether every mesh halves the cells of the previous one.
    has_same_gap : bool
        Whether the gap is the same on all meshes, which that of a measured profile is not.

    Returns
    -------
    StaticEstimates
    """
    names = tuple(values_by_mesh[-1])
    by_mesh = np.array([[np.atleast_1d(mesh[name]) for name in names] for mesh in values_by_mesh])
    limit = extrapolate_to_zero_cell_length(by_mesh, nested, has_same_gap=has_same_gap)
    none = np.zeros(by_mesh.shape[2])
    hidden = np.array([hidden_errors.get(name, none) + none for name in names])

    # The limit replaces the value only if it is needed and has the smaller error.
    finest = limit.value
    errors = np.maximum(error_factor * limit.error, hidden)
    is_limit = np.zeros(finest.shape, bool)
    if tolerance is not None:
        floors = np.array([[PATCH_TABLE[name].floor] for name in names])
        is_limit = (limit.extrapolated != finest) & (
            errors > compute_allowed_error(tolerance, finest, floors)
        )
        limit_errors = np.maximum(
            error_factor * limit.extrapolated_error, HIDDEN_ERROR_EXTRAPOLATION_FACTOR * hidden
        )
        is_limit &= limit_errors < errors
        errors = np.where(is_limit, limit_errors, errors)
    values = np.where(is_limit, limit.extrapolated, finest)
    errors = np.maximum(errors, min_relative_error * np.abs(finest))

    estimates = StaticEstimates(names, values, errors, is_limit, {})
    if PRESSURE_PEAK_MEASURES[0] in names:
        peak, fraction = (names.index(name) for name in PRESSURE_PEAK_MEASURES)
        errors[fraction] = compute_fraction_error(estimates, peak, fraction)
    return estimates


def compute_fraction_error(estimates: StaticEstimates, peak: int, fraction: int) -> np.ndarray:
    """Return errors (n,) of the loaded fraction that are at least those due to the peak pressure.

    The loaded fraction is the mean pressure divided by the peak pressure, so that both have the same
    relative error.

    Parameters
    ----------
    estimates : StaticEstimates
        Measures with their errors so far.
    peak, fraction : int
        Rows of the peak pressure and of the loaded fraction.
    """
    values = estimates.values
    pressure = np.where(values[peak] > 0, values[peak], np.inf)
    relative = estimates.errors[peak] / pressure
    error = values[fraction] * relative / (1 - np.minimum(relative, 0.5))
    return np.maximum(estimates.errors[fraction], error)


def max_mesh_error_ratio(measures_by_name: Measures, tolerance: float) -> float:
    """Return the largest ratio of error to allowed error of the measures that control the mesh.

    A ratio above 1 means that a measure misses the tolerance. Measures without value or error are
    ignored.
    """
    return max(measures_by_name[name].error_ratio(tolerance) for name in MESH_MEASURES)


def list_unbounded_pressure_reasons(patch_model) -> list[str]:
    """Return why the peak pressure of a patch may diverge under mesh refinement; [] if it cannot.

    A contact that ends at the edge of a step has the pressure singularity of a flat punch; a
    contact that extends over a closed step has a stronger one. An asperity layer (skin) bounds the
    pressure. A reason due to the ends of the interface comes first, then one for each step.
    """
    reasons = []
    if patch_model.interface.skin is not None:
        return reasons
    if patch_model.has_singular_ends:
        reasons.append(
            "unbounded: a sharp corner of one piece presses on the longer face of the other piece"
        )
    for jump in patch_model.gap.step_edges:
        reasons.append(
            f"unbounded, because the contact reaches a sharp corner, the edge of the step at {jump:.4g} m"
        )
    return reasons


def _find_unbounded_pressure(pressed: PressedCases) -> dict[str, np.ndarray]:
    """Return the cases (n,) whose peak pressure diverges under mesh refinement, as masks by reason."""
    patch_model = pressed.level.model
    x = pressed.x
    cells = np.diff(x)
    active = pressed.active
    masks = [active[:, [0, -1]].any(axis=1)] if patch_model.has_singular_ends else []
    for jump in patch_model.gap.step_edges:
        cell = cells[np.clip(np.searchsorted(x, jump), 1, cells.size) - 1]
        masks.append(active[:, np.abs(x - jump) <= 1.5 * cell].any(axis=1))
    return dict(zip(list_unbounded_pressure_reasons(patch_model), masks))


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
    """Resolution of n contacts by a mesh, from which hidden discretization errors follow; numbers or arrays (n,).

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
    - centre_error: error of the centre of a resolved contact, in cells; on a mesh for one contact the errors of its ends
      cancel.
    - turn_stiffness: stiffness [N m/rad] against the rotation that the load at a wrong centre causes; inf on a mesh for
      one contact.
    """

    length: float
    n_nodes: np.ndarray
    longest_cell: np.ndarray
    edge_cells: np.ndarray
    edge_offset: np.ndarray | None
    can_rotate: np.ndarray
    closing: np.ndarray
    corner_pressure: np.ndarray | float = 0.0
    wedge_pressure: np.ndarray | float = 0.0
    rounding_pressure: np.ndarray | float = 0.0
    open_ends: np.ndarray | float = 0.0
    inner_cells: np.ndarray | float = 0.0
    centre_error: float = 1e-3
    turn_stiffness: np.ndarray | float = np.inf


def _compute_resolution(pressed: PressedCases, missed_peak) -> Resolution:
    """Return how well the mesh resolves the contact of pressed cases.

    `missed_peak` (n,) is the measure `unresolved_edge_rounding_pressure` [Pa].
    """
    level = pressed.level
    pair = level.pair
    holder = pressed.holder
    active = pressed.active

    # Cells in which the contact ends; those beside the outermost contact nodes are not between intervals
    all_cells = np.diff(pressed.x)
    cells = np.where(active[:, 1:] != active[:, :-1], all_cells, 0.0)
    edge_cells = cells.sum(axis=1)
    longest_cell = cells.max(axis=1)
    is_inner = np.logical_or.accumulate(active, axis=1)[:, :-1]
    is_inner &= np.logical_or.accumulate(active[:, ::-1], axis=1)[:, ::-1][:, 1:]

    corner_pressure = np.zeros(len(pressed))
    if not level.has_layer:  # An asperity layer (skin) bounds the pressure.
        # The free end of a coating raises the pressure in a layer as long as the coating is thick.
        # Cells longer than this layer do not resolve it; for shorter cells the missed pressure falls
        # with the square of their length.
        thicknesses = [grid.coating_thickness for grid in (pair.grid, pair.upper_grid)]
        thinnest = min((thickness for thickness in thicknesses if thickness > 0), default=np.inf)
        fraction = np.minimum(1.0, (all_cells[[0, -1]] / thinnest) ** 2)
        end_pressure = pressed.contact_pressure[:, [0, -1]]
        # Fraction of the corner pressure of a coating that cells longer than the coating thickness
        # miss.
        corner_pressure = (0.15 * end_pressure * fraction).max(axis=1)

    # The elastic displacement is the gap under load less that of rigid pieces in the same position
    rigid = pressed.unloaded_gap - holder.approach[:, None] + holder.turn[:, None] * pressed.x
    displacement = np.abs(pressed.gap - rigid).max(axis=1)

    n_nodes = np.maximum(active.sum(axis=1), 1)
    is_unresolved = (n_nodes <= MAX_UNRESOLVED_CONTACT_NODES) & (edge_cells > 0)
    edge_offset = None
    if not level.is_smooth:
        edge_offset = _contact_edge_position_error(pair, longest_cell)
    return Resolution(
        length=level.pair.compliance.interface.length,
        n_nodes=n_nodes,
        longest_cell=longest_cell,
        edge_cells=edge_cells,
        edge_offset=edge_offset,
        can_rotate=holder.can_rotate,
        closing=np.ptp(pressed.unloaded_gap, axis=1) + displacement,
        corner_pressure=corner_pressure,
        wedge_pressure=np.where(is_unresolved, _wedge_indentation_pressure(pressed), 0.0),
        rounding_pressure=missed_peak,
        open_ends=open_rounded_length(pressed),
        inner_cells=np.where(is_inner, cells, 0.0).sum(axis=1),
    )


def _compute_turn_stiffness(pressed: PressedCases, cell) -> np.ndarray:
    """Return the stiffnesses (n,) [N m/rad] of contact and holder against rotations under a load.

    It is inf with a smooth layer, a prescribed rotation or without load. A contact is at least as stiff as one of
    the length of `cell` (n,) [m], the longest cell in which the contact ends.
    """
    if pressed.level.is_smooth:
        return np.full(len(pressed), np.inf)
    table = pressed.level.tables[0]
    work = table.work[table.find_slots(pressed.active)]
    normal = work[:, 0, 0]
    coupling = work[:, 0, 1] ** 2 / np.where(normal > 0, normal, np.inf)
    contact = np.maximum(work[:, 1, 1] - coupling, normal * cell**2 / 12)
    stiffness = contact + pressed.holder.spring
    return np.where(pressed.holder.can_rotate & (stiffness > 0), stiffness, np.inf)


def estimate_hidden_errors(resolution: Resolution, finest: "Arrays | Values") -> "Arrays | Values":
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
        Values on the finest mesh by name; numbers or arrays (n,).

    Returns
    -------
    dict
        Error by name; numbers or arrays (n,).
    """
    length = resolution.length
    n_nodes = resolution.n_nodes
    load = finest["normal_load"]
    peak = finest["pressure_peak"]

    # Errors add up over the edges of the contact: half of all their cells, but at least the longest one. The centre of a
    # resolved contact is far more accurate than its edges, because their position errors are alike.
    cell = np.maximum(resolution.longest_cell, resolution.edge_cells / 2)
    is_unresolved = n_nodes <= MAX_UNRESOLVED_CONTACT_NODES
    centre_error = np.where(is_unresolved, cell / (2 * n_nodes**2), resolution.centre_error * cell)

    has_few_nodes = (cell > 0) & (n_nodes <= MIN_RESOLVED_CONTACT_NODES)
    peak_error = resolution.corner_pressure + np.where(has_few_nodes, peak / (4 * n_nodes**2), 0.0)
    peak_error = np.maximum(peak_error, resolution.wedge_pressure)
    peak_error = np.maximum(peak_error, resolution.rounding_pressure - peak)

    # A nodal displacement has the round-off of its terms, and an error of the centre times the angle of rotation. The load
    # at a wrong centre turns the contact and the holder. A prescribed rotation has none of these errors.
    displacement = CONTACT_SOLUTION_ROUND_OFF * (np.abs(finest["approach"]) + resolution.closing)
    displacement = displacement + np.abs(finest["rotation"]) * centre_error
    moment_error = (CONTACT_SOLUTION_ROUND_OFF * length + centre_error) * load
    turn = moment_error / resolution.turn_stiffness
    fraction_per_pressure = finest["loaded_fraction"] / np.where(peak > 0, peak, np.inf)

    edge_offset = 0.0
    if resolution.edge_offset is not None:
        # In a contact of few nodes, an edge may lie anywhere in its cell.
        min_offset = np.where(is_unresolved, 1.0, 1 / n_nodes**2)
        edge_offset = np.maximum(resolution.edge_offset, min_offset)
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
        "moment": moment_error,
        "rotation": (displacement / length + turn) * resolution.can_rotate,
        "approach": CONTACT_SOLUTION_ROUND_OFF * resolution.closing,
    }


def _contact_edge_position_error(pair: CondensedPair, cell) -> np.ndarray:
    """Return the position errors (n,) of a contact edge between two nodes, in cell lengths.

    A soft coating thinner than the cells acts as a Winkler foundation, whose contact ends where the
    nodal pressure vanishes. `cell` (n,) [m] is the longest cell in which the contact ends.
    """
    # The first row of a mesh file has no single height, on which the offset of an edge depends.
    min_error = MIN_CONTACT_EDGE_ERROR_IN_CELLS if isinstance(pair.grid, TensorGrid) else 0.1
    out = np.full(cell.shape, min_error)
    for grid, piece in ((pair.grid, pair.piece), (pair.upper_grid, pair.upper)):
        if grid.coating_thickness > 0:
            ratio = piece.layers.coating[0] / piece.layers.substrate[0]
            contrast = 1 - min(ratio, 1 / ratio)
            cells = np.minimum(1.0, cell / grid.coating_thickness)
            out = np.maximum(out, edges.compute_edge_offset(cells, cells, 0.0) * contrast)
    return out


def _wedge_indentation_pressure(pressed: PressedCases) -> np.ndarray:
    """Return the largest pressures (n,) [Pa] compatible with the slope of the gap beside each contact.

    It is E* times the slope, as for the indentation by a wedge, and is used for contacts of few
    nodes.
    """
    active = pressed.active
    is_end = active[:, 1:] != active[:, :-1]
    slopes = np.abs(np.diff(pressed.unloaded_gap)) / np.diff(pressed.x)
    flexibility = 0
    for piece in (pressed.level.pair.piece, pressed.level.pair.upper):
        young, nu = max(piece.layers.coating, piece.layers.substrate)
        flexibility += (1 - nu**2) / young
    return np.where(is_end, slopes, 0.0).max(axis=1) / flexibility


def describe_assumed_plane_state(pieces) -> str:
    """Describe the assumption of plane strain or plane stress for the `PatchPieces` of a patch; "" if it is beyond doubt.

    It is for a piece in plane strain that is far wider than tall, and for one in plane stress that is far taller than wide.
    """
    ratio = pieces.width / pieces.height
    if pieces.plane == "strain":
        is_certain = ratio >= MIN_PLANE_STRAIN_WIDTH_RATIO
    else:
        is_certain = ratio <= 1 / MIN_PLANE_STRAIN_WIDTH_RATIO
    if is_certain:
        return ""
    return (
        f"plane {pieces.plane} is assumed, and the pieces are {ratio:.2g} times as wide as tall; "
        "the true state lies between plane strain and plane stress"
    )


def note_on_plane_state(patch_model, patch: Patch) -> list[str]:
    """Return a list with a note on the model error due to assuming plane strain or plane stress.

    The list is empty if the state is beyond doubt. No mesh refinement reduces this error.
    """
    pieces = patch_model.pieces
    assumption = describe_assumed_plane_state(pieces)
    if not assumption:
        return []
    other_plane = "stress" if pieces.plane == "strain" else "strain"

    # The change between the two plane states bounds the error, because the true state lies between
    # them.
    other_model = replace(patch_model, pieces=replace(pieces, plane=other_plane))
    try:
        pair = condense(other_model, *patch.pair.meshes, keep_factors=False)
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
