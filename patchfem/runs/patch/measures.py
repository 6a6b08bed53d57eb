"""Measures of a static patch with their errors from coarser meshes."""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...contact import edges
from ...core import Measure, PatchfemError, allowed_error
from ...formatting import format_length
from ...response import errors
from ...scene.keys.contact import outermost_strip
from ..results import patch_rows
from ..results.patch_rows import DECISIVE, TABLE
from .condensed import pair_beside
from .limits import limit
from .press import Patch, pressed
from .values import edge_cells, open_ends, unresolved_rounding, values

CLEAR = 8.0  # width over height from which a piece is clearly in plane strain (its inverse: in plane stress)
FEW_NODES = 12  # the measures of a contact of fewer nodes depend on their number
UNRESOLVED_NODES = 3  # nodes of a contact that meshes of these cells do not resolve
ROUND = 5e-12  # relative round-off of the equations of contact
MIN_ERROR = 1e-9  # relative error below which no error is estimated, because nobody asks for less
OFFSET = 0.012  # cells by which an edge found between nodes may lie off
RISING = 4.0  # the pressure at a corner may still rise by so many times its last change
CORNER = 0.15  # fraction of the pressure at the corner of a coating that cells coarser than it may leave out
EXTRAPOLATED = 2.0  # errors that an extrapolated value may hide, over those of the finest mesh: 4/3 + 1/3, rounded up
BANDED = ("pressure_peak", "normal_stiffness", "tangential_stiffness")


def plane_band(asked, patch: Patch) -> list:
    """A sentence on the model error of the plane state, from the mesh of `patch`, as a list.

    There is none for a piece far wider than tall in plane strain or far taller than wide in plane stress. Between the
    two no mesh narrows the band.
    """
    other = other_plane(asked)
    if other is None:
        return []
    try:
        mine, theirs = values(patch), values(pressed(other, pair_beside(other, patch.pair)))
    except PatchfemError as error:
        return [
            f"{_assumed(asked)}; the true state lies between plane strain and plane stress; how much the two "
            f"differ is not known, because for plane {other.pieces.plane} the contact could not be solved ({error})"
        ]
    return band_words(asked, mine, theirs)


def other_plane(asked):
    """The `PatchModel` in the other plane state, None where its own is clearly the right one."""
    ratio = asked.pieces.width / asked.pieces.height
    if ratio >= CLEAR if asked.pieces.plane == "strain" else ratio <= 1 / CLEAR:
        return None
    plane = "stress" if asked.pieces.plane == "strain" else "strain"
    return replace(asked, pieces=replace(asked.pieces, plane=plane))


def _assumed(asked) -> str:
    pieces = asked.pieces
    ratio = pieces.width / pieces.height
    return f"plane {pieces.plane} is assumed, and the pieces are {ratio:.2g} times as wide as tall"


def band_words(asked, mine: dict, theirs: dict) -> list:
    """The sentence of `plane_band`, from values by name in the plane state of the model and in the other one."""
    first = "approach" if asked.loading.approach is None else "normal_load"
    closing = (theirs["approach"] - mine["approach"]) if first == "approach" else 0.0
    parts = [f"approach by {'+' * (closing > 0)}{format_length(closing, 3)}"] if closing else []
    shares = [
        (name, theirs[name] / mine[name] - 1)
        for name in (first, *BANDED)
        if name != "approach" and mine[name]
    ]
    parts += [f"{name} by {100 * share:+.2g} %" for name, share in shares if abs(share) > 1e-3]
    other = "stress" if asked.pieces.plane == "strain" else "strain"
    return (
        [
            f"{_assumed(asked)}; the true state lies between plane strain and plane stress; plane {other} would change "
            f"the results by these amounts: {', '.join(parts)}"
        ]
        if parts
        else []
    )


def strip_error(asked, patch: Patch, found: dict) -> dict:
    """Measures `found` with what the number of strips adds to their errors; those without a value stay as they are.

    That is the change to another number of strips on the mesh of `patch`, at second order.
    """
    other, ratio = other_strips(asked)
    if other is asked:
        return found
    beside, here = values(pressed(other, patch.pair)), values(patch)
    added = {
        name: errors.error_of_change(here[name] - beside[name], ratio, errors.MAX_ORDER)
        for name in here
    }
    return {
        name: m if m.value is None else replace(m, error=float(m.error + added[name]))
        for name, m in found.items()
    }


def other_strips(asked) -> tuple:
    """Return the `PatchModel` in another number of strips, and how many times as coarse it is.

    It has half as many strips, or twice as many where half as many would not reach to the load line. Without strips to
    halve it is the model itself.
    """
    strips = asked.interface.strips
    if strips is None or strips.count < 2:
        return asked, 2.0
    count, ratio = strips.count // 2, 2.0
    if strips.offset is not None and abs(strips.offset) >= outermost_strip(
        asked.pieces.width, count
    ):
        count, ratio = 2 * strips.count, 0.5
    interface = replace(asked.interface, strips=strips._replace(count=count))
    return replace(asked, interface=interface), ratio


def measures(fine: Patch, *coarse: Patch | None, tolerance: float | None = None) -> dict:
    """Static measures of a patch by name, each with its error.

    coarse: the patch on coarser meshes, the finest of them first; None without one. A value is that of the finest mesh,
    and its error what the change from mesh to mesh leaves to come (`limits`) with what no change of the mesh shows.
    tolerance: of a patch whose mesh it chose; a value whose error exceeds it is extrapolated.
    """
    series, mine = [one for one in coarse if one is not None], values(fine)
    if not series:
        return _bounded(_unbounded(fine), combined([mine], {}))
    missed_peak = unresolved_rounding(fine)
    found = [values(one) for one in reversed(series)]
    nested = all(cells_halved(a.pair, b.pair) for a, b in pairwise((fine, *series)))
    # of meshes that pass over a rounding none shows what it does
    rough = 2.0 if missed_peak else 1.0
    least = least_of(_hidden(fine, missed_peak), mine) if mine["normal_load"] > 0 else {}
    out = combined(
        [*found, mine], least, nested, tolerance, max(MIN_ERROR, fine.pair.rounding), rough
    )
    if fine.averaging is not None:
        out = _cornered(out, fine, series[0])
    for name, (value, error) in fine.sharper.items():
        if error < out[name].error:
            out[name] = replace(out[name], value=value, error=error, engine=patch_rows.ON_POINTS)
    return _bounded(_unbounded(fine), out)


def _cornered(found: dict, fine: Patch, coarse: Patch) -> dict:
    """The measures with a peak that holds the pressure at a corner under a profile, where it still rises.

    Elsewhere the largest pressure may have settled, which its change from mesh to mesh shows alone. A corner that a
    trace just reaches bears ever more on cells half as long.
    """
    now, before = (one.pressure.sigma_n[[0, -1]].max() for one in (fine, coarse))
    peak = found["pressure_peak"]
    lack = now + RISING * abs(now - before) - peak.value
    if not now or lack <= peak.error:
        return found
    peak = replace(peak, error=float(lack))
    return found | {
        "pressure_peak": peak,
        "loaded_fraction": _of_peak(found["loaded_fraction"], peak),
    }


class Converged(NamedTuple):
    """Static measures from nested meshes: values and errors by name, numbers or (q,) of q patches."""

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
        Errors that the meshes may agree to hide, by name.
    wanted : float or None
        Tolerance; a value whose error is within it is not extrapolated, None: no value is.
    nested : bool
        Whether every mesh halves the cells of the one before.
    alike : float
        Relative error below which no error is estimated.
    rough : float
        Factor of the errors.
    """
    names = list(series[-1])
    known = np.array([[values[name] for name in names] for values in series])
    hidden, floors = np.zeros((2, *known.shape[1:]))
    for row, name in enumerate(names):
        hidden[row], floors[row] = least.get(name, 0.0), TABLE[name].floor
    enough = np.inf if wanted is None else allowed_error(wanted, known[-1], floors)
    with np.errstate(invalid="ignore", divide="ignore"):  # of patches that were not solved
        seen = limit(known, nested)
        plain = np.maximum(rough * seen.error, hidden)
        is_extrapolated = (seen.extrapolated != seen.value) & (plain > enough)
        left = np.where(
            is_extrapolated, np.maximum(rough * seen.left, EXTRAPOLATED * hidden), np.inf
        )
        best = np.where(left < plain, seen.extrapolated, seen.value)
        error = np.maximum(np.minimum(left, plain), alike * np.abs(known[-1]))
        found = Converged(dict(zip(names, best)), dict(zip(names, error)))
        fraction, peak = found.values["loaded_fraction"], found.values["pressure_peak"]
        relative = np.where(peak > 0, found.errors["pressure_peak"] / peak, 0.0)
        found.errors["loaded_fraction"] = of_peak(
            fraction, found.errors["loaded_fraction"], relative
        )
    return found


def combined(
    series: list,
    least: dict,
    nested: bool = True,
    tolerance: float | None = None,
    alike: float = MIN_ERROR,
    rough: float = 1.0,
) -> dict:
    """Return measures by name from their values on meshes of one patch, coarse to fine; parameters as of `converge`.

    Without a coarser mesh there are no errors, without a load they are 0.
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
    """Return what computed a value of nested meshes, of which the finest gives `finest`."""
    return patch_rows.ON_FINEST_MESH if value == finest else patch_rows.EXTRAPOLATED


def met(found: dict, tolerance: float) -> bool:
    """Whether the decisive measures of a patch have errors within the tolerance; a measure without a value has."""
    return missed(found, tolerance) <= 1


def missed(found: dict, tolerance: float) -> float:
    """Largest error of the decisive measures over what the tolerance allows [1]; no error counts as none."""
    return max(found[name].error_ratio(tolerance) for name in DECISIVE)


def _bounded(why: str, found: dict) -> dict:
    """The measures without the numbers that no mesh bounds: the peak beside a step that bears, or at a free corner.

    why: there is none, "" where there is."""
    if not why:
        return found
    return found | {
        name: replace(found[name], value=None, error=None, reason=why)
        for name in ("pressure_peak", "loaded_fraction")
        if name in found
    }


def _unbounded(patch: Patch) -> str:
    """Why the pressure of a patch has no bound, "" where it has one.

    A pressure that ends at the edge of a step is that of a punch with a sharp corner, and across a step that is closed
    it is worse. A skin yields at its peaks, so behind one the pressure stays bounded.
    """
    if patch.skinned:
        return ""
    x, cells = patch.x, np.diff(patch.x)
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


def of_peak(fraction, error, share):
    """Errors of loaded fractions with at least the relative error `share` of the peak that each is divided by."""
    return np.maximum(error, fraction * share / (1 - np.minimum(share, 0.5)))


def _of_peak(fraction: Measure, peak: Measure) -> Measure:
    return replace(
        fraction, error=float(of_peak(fraction.value, fraction.error, peak.error / peak.value))
    )


def cells_halved(fine, coarse) -> bool:
    """Whether every cell of the coarse Pair was split in two."""
    bodies = ((fine.grid, coarse.grid), (fine.upper_grid, coarse.upper_grid))
    grids = [(a.base_grid, b.base_grid) for a, b in bodies]
    return all(
        None not in (a, b) and a.x.size == 2 * b.x.size - 1 and a.depth.size == 2 * b.depth.size - 1
        for a, b in grids
    )


class Hidden(NamedTuple):
    """What a pressed patch is told by that three meshes may agree to hide, or (q,) of many.

    length [m]; count: nodes in contact; cell, cells [m]: the longest of those in which the contact ends, and all of
    them together; offset: cells by which an edge may lie off; turns: the rotation is free; spread: range of the gap and
    largest elastic closing [m]; corner, wedge, missed: pressures [Pa] at loaded corners of a coating, beside a contact
    of few nodes, of a rounding that is passed over; open_ends [m] of rounded faces; skin: it is smooth; between [m]: of
    cells, those between two stretches.
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
    """Return what meshes hide of q patches on one Pair.

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
    interface, active = pieces.interface, force > 0
    cells = np.where(active[:, 1:] != active[:, :-1], np.diff(interface.x), 0.0)
    longest = cells.max(axis=1)
    spread = gap_range + np.abs(force @ pieces.normal).max(axis=1)
    corner = 0.0
    if pieces is pair.compliance:  # a skin evens the pressure out
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


def _hidden(patch: Patch, missed_peak: float) -> Hidden:
    """Return what meshes hide of a Patch under load; missed_peak [Pa]: `unresolved_rounding`."""
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


def least_of(hidden: Hidden, mine: dict) -> dict:
    """Errors that three meshes may agree to hide, by name; mine: values on the finest of them.

    They are a contact of few nodes, the layer at a loaded corner of a coating thinner than the cells there, a rounding
    smaller than the cells, and round-off.
    """
    length, load, count, total = (
        hidden.length,
        mine["normal_load"],
        hidden.count,
        mine["pressure_peak"],
    )
    cell = np.maximum(hidden.cell, hidden.cells / 2)  # the average where the ends are many
    few = count <= UNRESOLVED_NODES
    aside = np.where(few, cell / (2 * count**2), 1e-3 * cell)
    peak = hidden.corner + np.where((cell > 0) & (count <= FEW_NODES), total / (4 * count**2), 0.0)
    peak = np.maximum(np.maximum(peak, hidden.wedge), hidden.missed - total)
    turned = (
        ROUND * (np.abs(mine["approach"]) + hidden.spread)
        + np.abs(mine["rotation"]) * aside * hidden.turns
    )
    fullness = np.divide(
        mine["loaded_fraction"], total, out=np.zeros(np.shape(total)), where=total != 0
    )
    # an edge of a contact of few nodes lies anywhere in its cell
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
        "pressure_centre": ROUND * length + aside,
        "moment": (ROUND * length + aside) * load,
        "rotation": turned / length,
        "approach": ROUND * hidden.spread,
    }


def offset(pair, cell):
    """Cells by which an edge may lie off its place between two nodes of a Pair; cell [m]: the longest there.

    A soft coating thinner than the cells is a bed of springs, whose edge lies where the pressure of a node vanishes.
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

    They are not resolved by cells longer than the coating is thick, and fall with the square of the cells. sigma
    (..., 2) [Pa], cells (2,) [m]: at both ends.
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
    """Pressure [Pa] that the gap just beside a contact of few nodes allows at most: E* times its slope there."""
    x, active = patch.x, patch.active
    ends = np.flatnonzero(active[1:] != active[:-1])
    slope = (np.abs(np.diff(patch.gap)) / np.diff(x))[..., ends].max()
    bending = [
        (1 - nu**2) / young
        for piece in (patch.pair.piece, patch.pair.upper)
        for young, nu in (max(piece.layers.coating, piece.layers.substrate),)
    ]
    return float(slope / sum(bending))
