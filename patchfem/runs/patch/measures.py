"""Measures of a static patch with their errors from coarser meshes."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...core import Measure, PatchfemError
from ...mesh.tensor import TensorGrid
from ..results.patch_rows import TABLE
from .press import Patch, pressed, solve
from .values import edge_cells, values

CLEAR = 8.0  # width over height from which a piece is clearly in plane strain (its inverse: in plane stress)
GROWING, SLOWEST, DOUBTFUL, SECOND, LUCKY = 1.3, 1.5, 2.5, 4.0, 6.0  # ratios of successive changes that are believed
FEW = 3  # nodes of a contact that no mesh of these cells resolves
ROUND = 5e-12  # round-off, relative
CORNER = 0.15  # largest share of the pressure at the corner of a coating that cells coarser than it leave out
BANDED = ("pressure_peak", "normal_stiffness", "tangential_stiffness")


def plane_band(asked, patch: Patch) -> list:
    """A sentence on the model error of the plane state, from the mesh of `patch`, as a list.

    There is none for a piece far wider than tall in plane strain or far taller than wide in plane stress. Between the
    two no mesh narrows the band.
    """
    pair, ratio = patch.pair, asked.width / asked.height
    if ratio >= CLEAR if asked.plane == "strain" else ratio <= 1 / CLEAR:
        return []
    other = "stress" if asked.plane == "strain" else "strain"
    upper = None if pair.upper is pair.piece else pair.upper_grid
    assumed = f"plane {asked.plane} is assumed for pieces {ratio:.2g} times as wide as tall"
    try:
        mine, theirs = values(patch), values(solve(replace(asked, plane=other), pair.grid, upper))
    except PatchfemError as error:
        return [f"{assumed}; the truth lies towards plane {other}, where the patch has no answer ({error})"]
    first = "approach" if asked.approach is None else "normal_load"
    closing = (theirs["approach"] - mine["approach"]) if first == "approach" else 0.0
    parts = [f"approach by {closing:+.2g} m"] if closing else []
    shares = [(name, theirs[name] / mine[name] - 1) for name in (first, *BANDED) if name != "approach" and mine[name]]
    parts += [f"{name} by {100 * share:+.2g} %" for name, share in shares if abs(share) > 1e-3]
    return [f"{assumed}; the truth lies towards plane {other}, which would change {', '.join(parts)}"] if parts else []


def strip_error(asked, patch: Patch, found: dict) -> dict:
    """Measures `found` with what the number of strips adds to their errors.

    That is the change to half as many strips on the mesh of `patch`, three times what second order leaves of it.
    """
    count, roll = asked.strips
    if count < 2:
        return found
    half = values(pressed(replace(asked, strips=(max(1, count // 2), roll)), patch.pair))
    here = values(patch)
    return {name: replace(m, error=m.error + abs(here[name] - half[name])) for name, m in found.items()}


def remainder(last: float, before: float, nested: bool = False) -> float:
    """Rest of a converging series: what is still to come after the changes `before` and `last` under two halvings of
    the mesh.

    The series is geometric. Its ratio is taken from the changes, no worse than 1.5 (1.3 where the changes grow) and no
    better than 2.5. Second order, a ratio of 4, is believed where every cell was halved (`nested`), the changes have
    one sign and their ratio is below 6. A last change may be small by chance, its parts against one another; it counts
    as what the first one leaves.
    """
    best = SECOND if nested and last * before > 0 and abs(before) < LUCKY * abs(last) else DOUBTFUL
    before = abs(before)
    last = max(abs(last), before / best)
    ratio = min(max(before / last, SLOWEST if before > last else GROWING), best) if last > 0 else best
    return last / (ratio - 1)


def measures(fine: Patch, coarse: Patch | None, coarsest: Patch | None = None) -> dict:
    """Static measures of a patch by name, each with its error.

    The error is three times what the changes between the three meshes leave to come (`remainder`) and what the snapping
    of the contact edges to nodes costs; it is at least what no change between meshes shows.
    """
    mine = values(fine)
    floors = _floors(fine)
    if coarse is None:
        return {name: Measure(value, TABLE[name].unit, None, floors[name]) for name, value in mine.items()}
    nested = coarsest is not None and _halved(fine, coarse) and _halved(coarse, coarsest)
    snap, least, out = _snap(fine, mine), _least(fine, mine), {}
    for name, (last, before) in _changes(fine, coarse, coarsest).items():
        error = 3 * remainder(last, before, nested) + snap.get(name, 0.0)
        error = max(error, least.get(name, 0.0), 1e-12 * abs(mine[name])) if mine["normal_load"] > 0 else 0.0
        out[name] = Measure(mine[name], TABLE[name].unit, float(error), floors[name])
    if mine["pressure_peak"] > 0:
        out["loaded_fraction"] = _of_peak(out["loaded_fraction"], out["pressure_peak"])
    return out


def _of_peak(fraction: Measure, peak: Measure) -> Measure:
    """The loaded fraction with at least the relative error of the peak that it is divided by."""
    share = peak.error / peak.value
    return replace(fraction, error=max(fraction.error, fraction.value * share / (1 - min(share, 0.5))))


def order(fine: Patch, coarse: Patch, coarsest: Patch) -> dict:
    """Power of the cell length with which the error of each measure falls, by name, from 1/2 to 2; 1 where unknown.

    fine, coarse, coarsest: the patch on three meshes, each of cells about twice as long as the one before.
    """
    changes = {name: np.abs(pair) for name, pair in _changes(fine, coarse, coarsest).items()}
    return {name: float(np.clip(np.log2(before / last), 0.5, 2.0)) if last > 0 and before > 0 else 1.0
            for name, (last, before) in changes.items()}


def _changes(fine: Patch, coarse: Patch, coarsest: Patch | None) -> dict:
    """Changes of each measure, by name: from the coarse mesh to the fine one and from the coarsest to the coarse one.

    They are taken less a quarter of what the contact edges leave open on both meshes; the second is 0 without a
    coarsest mesh.
    """
    found = [values(patch) for patch in (fine, coarse, coarsest) if patch is not None]
    snaps = [_snap(patch, value) for patch, value in zip((fine, coarse, coarsest), found, strict=False)]
    out = {}
    for name in found[0]:
        steps = [a[name] - b[name] for a, b in pairwise(found)]
        noise = [(a.get(name, 0.0) + b.get(name, 0.0)) / 4 for a, b in pairwise(snaps)]
        left = [float(np.sign(step) * max(0.0, abs(step) - cut)) for step, cut in zip(steps, noise, strict=True)]
        out[name] = (*left, 0.0)[:2]
    return out


def _snap(patch: Patch, mine: dict) -> dict:
    """Uncertainty of the measures that count nodes: what a contact edge between two nodes leaves open.

    There is none for a smooth skin, whose pressure has no edge.
    """
    cell, length = _cell(patch), patch.pieces.interface.length
    if not cell or patch.skin is not None:
        return {}
    few = cell * (1 + 2 / max(patch.active.sum(), 1))
    share = few / max(2 * cell, mine["contact_fraction"] * length)
    return {"contact_fraction": 2.5 * few / length, "contact_half_width": 1.25 * few,
            "normal_stiffness": share * mine["normal_stiffness"],
            "tangential_stiffness": share / 2 * mine["tangential_stiffness"],
            "rotational_stiffness": 3 * share / 2 * mine["rotational_stiffness"]}


def _halved(fine: Patch, coarse: Patch) -> bool:
    """Whether every cell of the coarse grids was split in two."""
    pairs = ((fine.pair.grid, coarse.pair.grid), (fine.pair.upper_grid, coarse.pair.upper_grid))
    return all(isinstance(a, TensorGrid) and a.x.size == 2 * b.x.size - 1 and a.depth.size == 2 * b.depth.size - 1
               for a, b in pairs)


def _cell(patch: Patch) -> float:
    """Length [m] of the cell in which the contact ends, on the average of the ends where they are many; 0 if full."""
    cells = edge_cells(patch.x, patch.active)
    return float(max(cells.max(), cells.sum() / 2)) if cells.size else 0.0


def _floors(fine: Patch) -> dict:
    """Floor of the error of each measure, by name: that of its row, one cell of the mesh for the share in contact."""
    cell = max(_cell(fine), np.diff(fine.x).min()) / fine.pieces.interface.length
    return {name: row.floor for name, row in TABLE.items()} | {"contact_fraction": cell}


def _least(patch: Patch, mine: dict) -> dict:
    """Errors that three meshes may agree to hide.

    They are a contact of few nodes, the layer at a loaded corner of a coating thinner than the cells there, and
    round-off.
    """
    length, load, cell = patch.pieces.interface.length, mine["normal_load"], _cell(patch)
    count = max(int(patch.active.sum()), 1)
    aside = cell / (2 * count**2) if count <= FEW else 0.0
    turns = "moment_balance" in patch.pressure.residuals
    peak = _corner_layer(patch) + (mine["pressure_peak"] / (4 * count**2) if cell else 0.0)
    if count <= FEW and cell:
        peak = max(peak, _wedge(patch))
    moved = np.abs(patch.pieces.normal @ (patch.pressure.sigma_n * patch.pieces.interface.weight)).max()
    turned = ROUND * (abs(mine["approach"]) + np.ptp(patch.gap) + moved) + abs(mine["rotation"]) * aside * turns
    fullness = mine["loaded_fraction"] / mine["pressure_peak"] if mine["pressure_peak"] else 0.0
    return {"normal_load": 1e-10 * load, "pressure_peak": peak, "loaded_fraction": peak * fullness,
            "pressure_centre": ROUND * length + aside, "moment": (ROUND * length + aside) * load,
            "rotation": turned / length, "approach": ROUND * (np.ptp(patch.gap) + moved)}


def _corner_layer(patch: Patch) -> float:
    """Pressure [Pa] that the free end of a coating may add at a loaded corner, unresolved by cells longer than it is
    thick; it falls with the square of the cells."""
    thick = [grid.coating for grid in (patch.pair.grid, patch.pair.upper_grid) if grid.coating > 0]
    sigma, cells = patch.pressure.sigma_n, np.diff(patch.x)
    if not thick or patch.pieces is not patch.pair.compliance:  # a skin evens the pressure out
        return 0.0
    return max(CORNER * s * min(1.0, (h / min(thick))**2) for s, h in ((sigma[0], cells[0]), (sigma[-1], cells[-1])))


def _wedge(patch: Patch) -> float:
    """Pressure [Pa] that the gap just beside a contact of few nodes allows at most: E* times its slope there."""
    x, active = patch.x, patch.active
    ends = np.flatnonzero(active[1:] != active[:-1])
    slope = (np.abs(np.diff(patch.gap)) / np.diff(x))[ends].max()
    bending = [(1 - nu**2) / young for piece in (patch.pair.piece, patch.pair.upper)
               for young, nu in (max(piece.layers.coating, piece.layers.substrate),)]
    return float(slope / sum(bending))
