"""Measures of a static patch, with errors from coarser meshes.

In: a `Patch` and the same on coarser meshes. Out: measures by name with errors by `limits`,
plus the errors that a change of the mesh does not show (`Hidden`); and the model errors due to
the plane state and the number of strips.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...contact import edges
from ...core import Measure, PatchfemError, compute_allowed_error
from ...formatting import format_length
from ...response import errors
from ...scene.keys.contact import compute_outermost_strip_distance
from ..results import patch_rows
from ..results.patch_rows import DECISIVE, TABLE
from .condensed import pair_on_same_meshes
from .limits import extrapolate
from .press import Patch, press_patch
from .values import edge_cells, open_ends, unresolved_rounding, values

# width over height of a piece that is clearly in plane strain; its inverse: in plane stress
CLEAR = 8.0
FEW_NODES = 12  # the measures of a contact with fewer nodes depend on this number
UNRESOLVED_NODES = 3  # contacts with at most this many nodes are not resolved
ROUND_OFF_FRACTION = 5e-12  # relative round-off of the equations of contact
MIN_ERROR = 1e-9  # smallest relative error that is stated, because nobody needs less
OFFSET = 0.012  # error of the position of an edge between nodes, in cells
RISING = 4.0  # the pressure at a corner may still increase by this many times its last change
# fraction of the pressure at the corner of a coating that cells longer than its thickness may miss
CORNER = 0.15
# hidden error of an extrapolated value over that of the finest mesh: 4/3 + 1/3, rounded up
EXTRAPOLATED_ERROR_RATIO = 2.0
MEASURES_WITH_BAND = ("pressure_peak", "normal_stiffness", "tangential_stiffness")


def plane_band(patch_model, patch: Patch) -> list:
    """Return a sentence, as a list, on the model error of the plane state of a patch.

    There is none for a piece that is far wider than tall in plane strain, or far taller than wide
    in plane stress. Otherwise no mesh reduces this error.
    """
    other = other_plane(patch_model)
    if other is None:
        return []
    try:
        mine = values(patch)
        theirs = values(press_patch(other, pair_on_same_meshes(other, patch.pair)))
    except PatchfemError as error:
        return [
            f"{_plane_state_clause(patch_model)}; the true state lies between plane strain and plane stress; how much the two "
            f"differ is not known, because for plane {other.pieces.plane} the contact could not be solved ({error})"
        ]
    return band_words(patch_model, mine, theirs)


def other_plane(patch_model):
    """Return the `PatchModel` in the other plane state; None if its own is clearly right."""
    ratio = patch_model.pieces.width / patch_model.pieces.height
    if ratio >= CLEAR if patch_model.pieces.plane == "strain" else ratio <= 1 / CLEAR:
        return None
    plane = "stress" if patch_model.pieces.plane == "strain" else "strain"
    return replace(patch_model, pieces=replace(patch_model.pieces, plane=plane))


def _plane_state_clause(patch_model) -> str:
    """Return the clause on the assumed plane state."""
    pieces = patch_model.pieces
    ratio = pieces.width / pieces.height
    return f"plane {pieces.plane} is assumed, and the pieces are {ratio:.2g} times as wide as tall"


def band_words(patch_model, mine: dict, theirs: dict) -> list:
    """Return the sentence of `plane_band` from values by name in both plane states.

    Parameters
    ----------
    patch_model : PatchModel
    mine, theirs : dict
        Values in the plane state of the model and in the other one.
    """
    first = "approach" if patch_model.loading.approach is None else "normal_load"
    closing = (theirs["approach"] - mine["approach"]) if first == "approach" else 0.0
    parts = [f"approach by {'+' * (closing > 0)}{format_length(closing, 3)}"] if closing else []
    shares = [
        (name, theirs[name] / mine[name] - 1)
        for name in (first, *MEASURES_WITH_BAND)
        if name != "approach" and mine[name]
    ]
    parts += [f"{name} by {100 * share:+.2g} %" for name, share in shares if abs(share) > 1e-3]
    other = "stress" if patch_model.pieces.plane == "strain" else "strain"
    return (
        [
            f"{_plane_state_clause(patch_model)}; the true state lies between plane strain and plane stress; "
            f"plane {other} would change "
            f"the results by these amounts: {', '.join(parts)}"
        ]
        if parts
        else []
    )


def strip_error(patch_model, patch: Patch, found: dict) -> dict:
    """Return measures whose errors include the effect of the number of strips.

    It is the change to another number of strips on the mesh of `patch`, at second order. Measures
    without a value are not changed.

    Parameters
    ----------
    patch_model : PatchModel
    patch : Patch
    found : dict
        Measures by name.
    """
    other, ratio = other_strips(patch_model)
    if other is patch_model:
        return found
    beside = values(press_patch(other, patch.pair))
    here = values(patch)
    added = {
        name: errors.error_of_change(here[name] - beside[name], ratio, errors.MAX_ORDER)
        for name in here
    }
    return {
        name: m if m.value is None else replace(m, error=float(m.error + added[name]))
        for name, m in found.items()
    }


def other_strips(patch_model) -> tuple:
    """Return the `PatchModel` with another number of strips, and how many times coarser it is.

    It has half as many strips, or twice as many if half as many would not reach to the load line.
    Without strips to halve it is the model itself.
    """
    strips = patch_model.interface.strips
    if strips is None or strips.count < 2:
        return patch_model, 2.0
    count = strips.count // 2
    ratio = 2.0
    if strips.offset is not None and abs(strips.offset) >= compute_outermost_strip_distance(
        patch_model.pieces.width, count
    ):
        count = 2 * strips.count
        ratio = 0.5
    interface = replace(patch_model.interface, strips=strips._replace(count=count))
    return replace(patch_model, interface=interface), ratio


def measures(fine: Patch, *coarse: Patch | None, tolerance: float | None = None) -> dict:
    """Return the static measures of a patch by name, each with its error.

    A value is that of the finest mesh. Its error contains the remaining change by refinement
    (`limits`) and the errors that no change of the mesh shows.

    Parameters
    ----------
    fine : Patch
    coarse : Patch or None
        The patch on coarser meshes, fine to coarse; None for a missing one.
    tolerance : float or None
        Tolerance of a patch whose mesh it chose; a value whose error exceeds it is extrapolated.
    """
    series = [one for one in coarse if one is not None]
    mine = values(fine)
    if not series:
        return _remove_unbounded(_why_unbounded(fine), measures_from_series([mine], {}))
    missed_peak = unresolved_rounding(fine)
    series = _with_parts_of_finest(fine, series)
    found = [values(one) for one in reversed(series)]
    nested = all(cells_halved(a.pair, b.pair) for a, b in pairwise((fine, *series)))
    # none of several meshes that do not resolve a rounding shows its effect
    rough = 2.0 if missed_peak else 1.0
    least = (
        shared_errors(_hidden_by_mesh(fine, missed_peak), mine) if mine["normal_load"] > 0 else {}
    )
    out = measures_from_series(
        [*found, mine], least, nested, tolerance, max(MIN_ERROR, fine.pair.round_off_error), rough
    )
    if fine.averaging is not None:
        out = _with_corner_errors(out, fine, series[0])
    for name, (value, error) in fine.sharper.items():
        if error < out[name].error:
            out[name] = replace(out[name], value=value, error=error, engine=patch_rows.ON_POINTS)
    return _remove_unbounded(_why_unbounded(fine), out)


def _with_parts_of_finest(fine: Patch, series: list) -> list:
    """Return the coarser patches that resolve as many parts of the contact as the finest one.

    A part of a few cells next to a step may be missing on a coarse mesh. The change to such a mesh
    shows this part and no order of convergence, so that neither this mesh nor coarser ones count.

    Parameters
    ----------
    fine : Patch
    series : list of Patch
        From fine to coarse.

    Returns
    -------
    list of Patch
        At least the first one, whose change is then the only one that the error rests on.
    """
    if not fine.jumps:
        return series
    n_parts = _count_parts(fine.active)
    n_alike = next(
        (k for k, one in enumerate(series) if _count_parts(one.active) != n_parts), len(series)
    )
    return series[: max(n_alike, 1)]


def _count_parts(active) -> int:
    """Return the number of intervals in contact of a contact set (m,) of bool."""
    return int(active[0]) + int(np.count_nonzero(active[1:] & ~active[:-1]))


def _with_corner_errors(found: dict, fine: Patch, coarse: Patch) -> dict:
    """Return the measures with an error of the peak that contains the pressure at a corner.

    Under a profile, the pressure at a corner may still increase with refinement, although the
    largest pressure does not change: a corner that the profile just reaches carries ever more on
    cells half as long.
    """
    now, before = (one.pressure.sigma_n[[0, -1]].max() for one in (fine, coarse))
    peak = found["pressure_peak"]
    lack = now + RISING * abs(now - before) - peak.value
    if not now or lack <= peak.error:
        return found
    peak = replace(peak, error=float(lack))
    return found | {
        "pressure_peak": peak,
        "loaded_fraction": _widen_for_peak(found["loaded_fraction"], peak),
    }


class Converged(NamedTuple):
    """Static measures from nested meshes: values and errors by name, numbers or (q,)."""

    values: dict
    errors: dict


def converge(
    series: list, least: dict, wanted, nested: bool, alike: float, rough: float = 1.0
) -> Converged:
    """Estimate the limits of static measures on nested meshes, and their errors.

    Parameters
    ----------
    series : list of dict
        Values on two meshes or more by name, coarse to fine; numbers or (q,).
    least : dict
        Errors by name that all meshes may share.
    wanted : float or None
        Tolerance: a value whose error is within it is not extrapolated; None: no value is.
    nested : bool
        Whether every mesh halves the cells of the previous one.
    alike : float
        Smallest relative error that is stated.
    rough : float
        Factor of the errors.
    """
    names = list(series[-1])
    known = np.array([[values[name] for name in names] for values in series])
    hidden, floors = np.zeros((2, *known.shape[1:]))
    for row, name in enumerate(names):
        hidden[row] = least.get(name, 0.0)
        floors[row] = TABLE[name].floor
    enough = np.inf if wanted is None else compute_allowed_error(wanted, known[-1], floors)
    with np.errstate(invalid="ignore", divide="ignore"):  # patches that were not solved have NaN
        seen = extrapolate(known, nested)
        plain = np.maximum(rough * seen.error, hidden)
        is_extrapolated = (seen.extrapolated != seen.value) & (plain > enough)
        left = np.where(
            is_extrapolated,
            np.maximum(rough * seen.left, EXTRAPOLATED_ERROR_RATIO * hidden),
            np.inf,
        )
        best = np.where(left < plain, seen.extrapolated, seen.value)
        error = np.maximum(np.minimum(left, plain), alike * np.abs(known[-1]))
        found = Converged(dict(zip(names, best)), dict(zip(names, error)))
        fraction = found.values["loaded_fraction"]
        peak = found.values["pressure_peak"]
        relative = np.where(peak > 0, found.errors["pressure_peak"] / peak, 0.0)
        found.errors["loaded_fraction"] = contain_peak_error(
            fraction, found.errors["loaded_fraction"], relative
        )
    return found


def measures_from_series(
    series: list,
    least: dict,
    nested: bool = True,
    tolerance: float | None = None,
    alike: float = MIN_ERROR,
    rough: float = 1.0,
) -> dict:
    """Return measures by name from their values on the meshes of one patch.

    Without a coarser mesh there are no errors; without a load they are 0. The parameters are those
    of `converge`.
    """
    mine = series[-1]
    if len(series) == 1 or not mine["normal_load"] > 0:
        error = None if len(series) == 1 else 0.0
        found = Converged(mine, dict.fromkeys(mine, error))
    else:
        found = converge(series, least, tolerance, nested, alike, rough)
    out = {}
    for name, value in found.values.items():
        error = found.errors[name]
        out[name] = Measure(
            float(value),
            TABLE[name].unit,
            None if error is None else float(error),
            TABLE[name].floor,
            engine=mesh_engine(value, mine[name]),
        )
    return out


def mesh_engine(value: float, finest: float) -> str:
    """Return what computed a value: the finest mesh, if it gives `finest`, or extrapolation."""
    return patch_rows.ON_FINEST_MESH if value == finest else patch_rows.EXTRAPOLATED_SOURCE


def is_within_tolerance(found: dict, tolerance: float) -> bool:
    """Return whether the errors of the decisive measures are within the tolerance.

    A measure without a value counts as within.
    """
    return max_error_ratio(found, tolerance) <= 1


def max_error_ratio(found: dict, tolerance: float) -> float:
    """Return the largest error of the decisive measures over the allowed error [1].

    A missing error counts as 0.
    """
    return max(found[name].error_ratio(tolerance) for name in DECISIVE)


def _remove_unbounded(why: str, found: dict) -> dict:
    """Return the measures, with `why` in place of values that diverge under mesh refinement.

    These are the peak pressure next to a loaded step or at a free corner, and the loaded fraction;
    "" changes nothing.
    """
    if not why:
        return found
    return found | {
        name: replace(found[name], value=None, error=None, reason=why)
        for name in ("pressure_peak", "loaded_fraction")
        if name in found
    }


def _why_unbounded(patch: Patch) -> str:
    """Return the reason why the pressure of a patch is unbounded; "" if it is bounded.

    A contact that ends at the edge of a step has the pressure of a punch with a sharp corner; a
    contact across a closed step is more singular. A skin makes the pressure bounded.
    """
    if patch.skinned:
        return ""
    x = patch.x
    cells = np.diff(patch.x)
    bears = patch.strips.pressure.any(axis=0) if patch.strips is not None else patch.active
    if patch.sharp and bears[[0, -1]].any():
        return (
            "unbounded: a sharp corner of one piece presses on the longer face of the other piece"
        )
    for place in patch.jumps:
        beside = (
            np.abs(x - place) <= 1.5 * cells[np.clip(np.searchsorted(x, place), 1, cells.size) - 1]
        )
        if bears[beside].any():
            return f"unbounded, because the contact reaches a sharp corner, the edge of the step at {place:.4g} m"
    return ""


def contain_peak_error(fraction, error, share):
    """Return errors of loaded fractions that contain the relative error `share` of the peak.

    The peak is the divisor of the fraction.
    """
    return np.maximum(error, fraction * share / (1 - np.minimum(share, 0.5)))


def _widen_for_peak(fraction: Measure, peak: Measure) -> Measure:
    """Return a loaded fraction whose error contains that of the peak."""
    return replace(
        fraction,
        error=float(contain_peak_error(fraction.value, fraction.error, peak.error / peak.value)),
    )


def cells_halved(fine, coarse) -> bool:
    """Return whether every cell of the coarse Pair was split in two."""
    bodies = ((fine.grid, coarse.grid), (fine.upper_grid, coarse.upper_grid))
    grids = [(a.base_grid, b.base_grid) for a, b in bodies]
    return all(
        None not in (a, b) and a.x.size == 2 * b.x.size - 1 and a.depth.size == 2 * b.depth.size - 1
        for a, b in grids
    )


class Hidden(NamedTuple):
    """Properties of a patch, or (q,) of many, that determine the errors which its meshes share.

    - length: length of the interface [m].
    - count: nodes in contact.
    - cell, cells: longest cell in which the contact ends, and the sum of all of them [m].
    - offset: error of the position of an edge, in cells.
    - turns: whether the rotation is free.
    - spread: range of the gap plus largest elastic closing [m].
    - corner: pressure [Pa] that is missed at loaded corners of a coating.
    - wedge: pressure [Pa] next to a contact of few nodes.
    - missed: pressure [Pa] of a rounding that is not resolved.
    - open_ends: length of rounded face in which the contact may end [m].
    - skin: whether the skin is smooth.
    - between: sum of the cells between two parts of the contact [m].
    """

    length: float
    count: int
    cell: float
    cells: float
    offset: float
    turns: bool
    spread: float
    corner: float
    wedge: float
    missed: float = 0.0
    open_ends: float = 0.0
    skin: bool = False
    between: float = 0.0


def hidden_by_meshes(pair, pieces, force, gap_range, turns: bool) -> Hidden:
    """Return the Hidden properties of q patches on one Pair.

    Parameters
    ----------
    pair : Pair
    pieces : Compliance
        That of the pair with its skin.
    force : (q, m) ndarray
        Nodal forces [N].
    gap_range : float or (q,) ndarray
        Range of the gap [m].
    turns : bool
        Whether the rotation is free.
    """
    interface = pieces.interface
    active = force > 0
    cells = np.where(active[:, 1:] != active[:, :-1], np.diff(interface.x), 0.0)
    longest = cells.max(axis=1)
    spread = gap_range + np.abs(force @ pieces.normal).max(axis=1)
    corner = 0.0
    if pieces is pair.compliance:  # a compliant layer of asperities (skin) bounds the pressure
        corner = corner_layer(
            pair, (force / interface.weight)[:, [0, -1]], np.diff(interface.x)[[0, -1]]
        )
    return Hidden(
        interface.length,
        np.maximum(active.sum(axis=1), 1),
        longest,
        cells.sum(axis=1),
        offset(pair, longest),
        turns,
        spread,
        corner,
        0.0,
    )


def _hidden_by_mesh(patch: Patch, missed_peak: float) -> Hidden:
    """Return the Hidden properties of a Patch under load.

    missed_peak: pressure [Pa] of `unresolved_rounding`.
    """
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    out = hidden_by_meshes(
        patch.pair,
        patch.pieces,
        force[None],
        np.ptp(patch.gap),
        "moment_balance" in patch.pressure.residuals,
    )
    out = Hidden(*(np.ravel(value)[0] for value in out))
    cells = edge_cells(patch.x, patch.active)
    first, last = ~patch.active[[0, -1]]
    wedge = _wedge(patch) if out.count <= UNRESOLVED_NODES and cells.any() else 0.0
    return out._replace(
        wedge=wedge,
        missed=missed_peak,
        open_ends=float(open_ends(patch)),
        skin=patch.skin is not None,
        between=float(cells[int(first) : cells.size - int(last)].sum()),
    )


def shared_errors(hidden: Hidden, mine: dict) -> dict:
    """Return the errors by name that three meshes may share.

    The changes from mesh to mesh do not show them. They are due to a contact of few nodes, the
    layer at a loaded corner of a coating thinner than the cells there, a rounding smaller than the
    cells, and round-off.

    Parameters
    ----------
    hidden : Hidden
    mine : dict
        Values by name on the finest mesh.
    """
    length = hidden.length
    load = mine["normal_load"]
    count = hidden.count
    total = mine["pressure_peak"]
    # half the sum exceeds the longest cell only if the contact has many ends
    cell = np.maximum(hidden.cell, hidden.cells / 2)
    few = count <= UNRESOLVED_NODES
    aside = np.where(few, cell / (2 * count**2), 1e-3 * cell)
    peak = hidden.corner + np.where((cell > 0) & (count <= FEW_NODES), total / (4 * count**2), 0.0)
    peak = np.maximum(np.maximum(peak, hidden.wedge), hidden.missed - total)
    turned = (
        ROUND_OFF_FRACTION * (np.abs(mine["approach"]) + hidden.spread)
        + np.abs(mine["rotation"]) * aside * hidden.turns
    )
    fullness = np.divide(
        mine["loaded_fraction"], total, out=np.zeros(np.shape(total)), where=total != 0
    )
    # an edge of a contact of few nodes may lie anywhere in its cell
    near = np.maximum(hidden.offset, np.where(few, 1.0, 1 / count**2)) * (not hidden.skin)
    off, outer = (
        near * cells + hidden.open_ends for cells in (hidden.cells, hidden.cells - hidden.between)
    )
    return {
        "normal_load": 1e-10 * load,
        "pressure_peak": peak,
        "contact_fraction": off / length,
        "contact_half_width": outer / 2,
        "loaded_fraction": peak * fullness,
        "pressure_centre": ROUND_OFF_FRACTION * length + aside,
        "moment": (ROUND_OFF_FRACTION * length + aside) * load,
        "rotation": turned / length,
        "approach": ROUND_OFF_FRACTION * hidden.spread,
    }


def offset(pair, cell):
    """Return the error of the position of an edge between two nodes of a Pair, in cells.

    A soft coating thinner than the cells acts as a bed of springs, whose edge is where the pressure
    of a node vanishes. cell: longest cell in which the contact ends [m].
    """
    out = OFFSET
    for grid, piece in ((pair.grid, pair.piece), (pair.upper_grid, pair.upper)):
        if grid.coating_thickness > 0:
            ratio = piece.layers.coating[0] / piece.layers.substrate[0]
            stiffer = 1 - min(ratio, 1 / ratio)
            out = np.maximum(
                out,
                edges.edge_offset_fraction(1.0)
                * np.minimum(1.0, cell / grid.coating_thickness)
                * stiffer,
            )
    return out


def corner_layer(pair, sigma, cells):
    """Return pressures (...) [Pa] that the free end of a coating may add at a loaded corner.

    They are not resolved by cells longer than the thickness of the coating, and fall with the
    square of the cells.

    Parameters
    ----------
    pair : Pair
    sigma : (..., 2)
        Pressures at both ends [Pa].
    cells : (2,)
        Cells at both ends [m].
    """
    thick = [
        grid.coating_thickness
        for grid in (pair.grid, pair.upper_grid)
        if grid.coating_thickness > 0
    ]
    if not thick:
        return np.zeros(np.shape(sigma)[:-1])
    return (CORNER * sigma * np.minimum(1.0, (cells / min(thick)) ** 2)).max(axis=-1)


def _wedge(patch: Patch) -> float:
    """Return the largest pressure [Pa] that the gap next to a contact of few nodes allows.

    It is E* times the slope of the gap there.
    """
    x = patch.x
    active = patch.active
    ends = np.flatnonzero(active[1:] != active[:-1])
    slope = (np.abs(np.diff(patch.gap)) / np.diff(x))[..., ends].max()
    bending = [
        (1 - nu**2) / young
        for piece in (patch.pair.piece, patch.pair.upper)
        for young, nu in (max(piece.layers.coating, piece.layers.substrate),)
    ]
    return float(slope / sum(bending))
