"""Static measures of many patches on the condensed pieces that they share, as `measures` gives them one by one.

It takes bare pieces, or pieces behind a linear skin, under a load: contacts that begin at an end of the interface and
end once inside it (`contact.many`). What presses otherwise is left to single runs.
"""

from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...contact.many.anchored import Anchored
from ...core import Outcome, Pressure, frozen_array
from ...elasticity.lapack import one_thread
from ...mesh.tensor import TensorGrid
from . import measures as one_by_one
from .condensed import Pair, shared_pairs
from .measures import Hidden, combined, least_of
from .press import as_patch, with_linear_skin
from .values import peak_pressure, vertex

SOLVED = 1e-12  # largest residual, as `contact.unilateral` has it
BORDER = 3  # nodes whose means give the pressure at an end


class SolvedPatch(NamedTuple):
    """A patch solved together with others: static measures by name; top [Pa]: largest nodal pressure; approach [m] of
    the finest mesh; band: sentences on the plane state, as `measures.plane_band` has them; nodes: of the interface;
    patches: the solved Patch on the finest mesh and on the next one, () where nobody asked."""

    measures: dict
    top: float
    approach: float
    band: list
    nodes: int
    patches: tuple = ()


class LevelValues(NamedTuple):
    """What q patches have on one level: values: name -> (q,); count: (q,) nodes in contact; cell: (q,) [m] in which the
    contact ends, 0 of full contact; spread, corner: (q,) as `Hidden` has them; top: (q,) largest nodal pressure [Pa];
    inside: (q,) whether no border of the interface bears as much; good: (q,) whether it was solved; force (q, m) [N]
    and opening (q, m) [m] of the nodes."""

    values: dict
    count: np.ndarray
    cell: np.ndarray
    spread: np.ndarray
    corner: np.ndarray
    top: np.ndarray
    inside: np.ndarray
    good: np.ndarray
    force: np.ndarray
    opening: np.ndarray


def not_together(asked) -> str:
    """Why a `PatchModel` is not pressed together with others; "" where it may be."""
    if asked.meshes is None:
        return "its mesh is its own"
    if not all(isinstance(body, TensorGrid) or body is None for level in asked.meshes.levels for body in level):
        return "its pieces are no plain grids"
    return _not_anchored(asked) or ("" if len(asked.meshes.levels) > 2 else "its mesh has no coarser ones")


def _not_anchored(asked) -> str:
    """Why no contacts of `contact.many` press a `PatchModel` on plain grids; "" where they may."""
    if asked.strips is not None or (asked.skin is not None and asked.skin.law != "linear"):
        return "strips or a smooth skin lie between the pieces"
    if not asked.load:
        return "no load presses it"
    return "its pressure may have no bound" if asked.singular_ends or asked.gap.jumps else ""


def pressing_kind(asked) -> tuple:
    """What patches pressed together have in common beside their pieces."""
    return asked.meshes.name, *_kind(asked)


def _kind(asked) -> tuple:
    skin = None if asked.skin is None else (asked.skin.normal_stiffness, asked.skin.tangential_ratio)
    return skin, asked.moment is None


def patches_on(patches, pair: Pair) -> list:
    """Each of `PatchModel`s of one geometry as a solved Patch on a Pair; None of those that do not press as this module
    can."""
    out, groups = [None] * len(patches), {}
    grids = isinstance(pair.grid, TensorGrid) and isinstance(pair.upper_grid, TensorGrid) and not pair.closing.any()
    for k, asked in enumerate(patches if grids else ()):
        if not _not_anchored(asked):
            groups.setdefault(_kind(asked), []).append(k)
    for cases in groups.values():
        with one_thread():
            level = pressed_on([patches[k] for k in cases], pair)
        for place, k in enumerate(cases):
            if level.good[place] and level.count[place] > one_by_one.POINT:
                out[k] = _patch_of(patches[k], pair, level, place)
    return out


def pressed_together(patches, tolerance: float, moving: bool = False) -> list:
    """Each of `PatchModel`s alike in their pieces and in `pressing_kind` as SolvedPatch; None of those that do not
    press as this module can.

    tolerance: relative error beyond which values are extrapolated; moving: the solved patches are wanted as well, by
    what moves them.
    """
    pairs = shared_pairs(patches[0])
    if any(pair.closing.any() for pair in pairs):
        return [None] * len(patches)
    tolerance = patches[0].mesh_tolerance or tolerance
    with one_thread():
        levels = [pressed_on(patches, pair) for pair in pairs]
        theirs = _in_other_plane(patches)
    good = np.logical_and.reduce([level.good for level in (*levels, *([] if theirs is None else [theirs]))])
    good &= levels[0].count > one_by_one.POINT  # what a node or two hide only their own run looks at
    theirs = None if theirs is None else _rows(theirs.values)
    series = [_rows(level.values) for level in reversed(levels)]
    fine, pair = levels[0], pairs[0]
    nested = all(one_by_one.cells_halved(a, b) for a, b in pairwise(pairs))
    alike, turns = max(one_by_one.ALIKE, pair.rounding), patches[0].moment is not None
    length, out = pair.compliance.interface.length, []
    stated = tolerance if patches[0].chosen else None
    for k, fits in enumerate(good):
        if not fits:
            out.append(None)
            continue
        cell = float(fine.cell[k])
        hidden = Hidden(length, int(fine.count[k]), (cell,) * bool(cell), one_by_one.offset(pair, cell), turns,
                        float(fine.spread[k]), float(fine.corner[k]), 0.0)
        mine = series[-1][k]
        found = combined([rows[k] for rows in series], least_of(hidden, mine), nested, stated, alike)
        found = one_by_one.reaching(found, float(fine.top[k])) if fine.inside[k] else found
        band = one_by_one.band_words(patches[k], series[-2][k], theirs[k]) if theirs is not None else []
        solved = tuple(_patch_of(patches[k], *one, k) for one in zip(pairs[:2], levels)) if moving else ()
        out.append(SolvedPatch(found, float(fine.top[k]), mine["approach"], band, pair.compliance.interface.x.size,
                               solved))
    return out


def _patch_of(asked, pair: Pair, level: LevelValues, k: int):
    """The k-th patch of a level, of the PatchModel `asked`, as `press.pressed` gives it by itself."""
    x, weight, bare = pair.compliance.interface.x, pair.compliance.interface.weight, pair.compliance
    gap, notes, seconds = asked.gap.at(x)
    value = {name: float(column[k]) for name, column in level.values.items()}
    pressure = Pressure(frozen_array(level.force[k] / weight), frozen_array(level.opening[k]), value["approach"],
                        value["rotation"], value["normal_load"], value["moment"], Outcome.DONE, 1,
                        MappingProxyType({}))
    pieces = bare if asked.skin is None else with_linear_skin(asked.skin, bare)
    return as_patch(asked, pair, gap + pair.rise, notes, seconds, (pieces, pressure, None, None))


def _in_other_plane(patches) -> LevelValues | None:
    """The patches on the second mesh in the other plane state; None where nobody asks."""
    first = one_by_one.other_plane(patches[0])
    if first is None:
        return None
    return pressed_on(patches, shared_pairs(first)[1])


def _rows(values: dict) -> list:
    names = list(values)
    return [dict(zip(names, row)) for row in np.stack([values[name] for name in names], axis=1).tolist()]


def pressed_on(patches, pair: Pair) -> LevelValues:
    """Values of patches on one Pair, by contacts that begin at either end."""
    gaps = np.array([asked.gap.at(pair.compliance.interface.x)[0] for asked in patches]) + pair.rise
    left = _from_one_end(patches, pair, gaps, 1)
    if left.good.all():
        return left
    rest = np.flatnonzero(~left.good)
    right = _from_one_end([patches[k] for k in rest], pair, gaps[rest], -1)
    for name, values in left.values.items():
        values[rest] = right.values[name]
    for mine, other in zip(left[1:], right[1:]):
        mine[rest] = other
    return left


def _from_one_end(patches, pair: Pair, gaps, way: int) -> LevelValues:
    """Values of patches on one Pair by contacts from the end at -x (way 1) or at +x (-1), seen in its mirror."""
    first, bare = patches[0], pair.compliance
    pieces = bare if first.skin is None else with_linear_skin(first.skin, bare)
    turned, x = slice(None, None, way), way * bare.interface.x[::way]
    weight, g = bare.interface.weight[turned], gaps[:, turned]
    normal, tangential = (Anchored(part[turned, turned], x) for part in (pieces.normal, pieces.tangential))
    load = np.array([asked.load for asked in patches])
    held, low = first.moment is None, g.min(axis=1)
    moment = None if held else way * np.array([asked.moment for asked in patches])
    spring = np.zeros(load.size) if held else np.array([asked.spring for asked in patches])
    found = normal.press(g - low[:, None], load, moment, spring)
    count, share, m = found.count, normal.shares(found), x.size
    soft = normal.c.diagonal() - bare.normal.diagonal()[turned]
    edge = np.maximum(normal.places(count, share, soft, pair.row), x[0])
    edge = np.where(count < m, np.minimum(edge, x[-1]), x[-1])
    sigma = found.force / weight
    skin = None if first.skin is None else soft / normal.c.diagonal()
    peak = peak_pressures(x, sigma, count, skin)
    total, moved = found.force.sum(axis=1), np.abs(found.force @ normal.c).max(axis=1)
    turn = way * found.theta + np.array([asked.gap.angle for asked in patches])
    pull = way * (found.force @ x)
    values = {"normal_load": total, "contact_fraction": (edge - x[0]) / np.ptp(x), "pressure_peak": peak,
              "moment": pull, "rotation": turn, "approach": low + found.closing,
              "contact_half_width": (edge - x[0]) / 2, "pressure_centre": pull / total,
              "loaded_fraction": total / (weight.sum() * peak), "normal_stiffness": normal.stiffness(count, share),
              "tangential_stiffness": tangential.stiffness(count, share),
              "rotational_stiffness": normal.stiffness(count, share, True)}
    cells = np.diff(x)
    ends = np.stack([sigma[:, 0], sigma[:, -1]])
    corner = np.zeros(load.size) if first.skin is not None else corner_layers(pair, ends, cells[[0, -1]])
    good = found.flaw <= SOLVED
    cell = np.where(count < m, cells[np.minimum(count, m - 1) - 1], 0.0)
    top = sigma.max(axis=1)
    inside = (sigma[:, 0] < top) & (sigma[:, -1] < top)
    return LevelValues(values, count, cell, np.ptp(g, axis=1) + moved, corner, top, inside, good,
                       found.force[:, turned], found.opening[:, turned])


def corner_layers(pair: Pair, sigma, cells):
    """`measures.corner_layer` of many patches: sigma (2, q) [Pa] at both ends, cells (2,) [m]."""
    sides = [one_by_one.corner_layer(pair, (1.0,), (cell,)) for cell in cells]
    return np.maximum(sides[0] * sigma[0], sides[1] * sigma[1])


def peak_pressures(x, sigma, count, skin=None):
    """`values.peak_pressure` (q,) [Pa] of pressures sigma (q, m) [Pa] on the first `count` (q,) nodes at x (m,) [m]."""
    top = np.argmax(sigma, axis=1)
    out = np.empty(len(sigma))
    inner = (top > 0) & (top < count - 1)
    out[inner] = vertex(x, sigma[inner], top[inner])
    first = (top == 0) & (count >= BORDER)
    if first.any():  # the pressure at the end is one linear form of the first means
        form = [peak_pressure(x[:BORDER + 1], np.array([3.0, 2.0, 1.0, 0.0]) + np.eye(4)[k] * 0.5)
                - peak_pressure(x[:BORDER + 1], np.array([3.0, 2.0, 1.0, 0.0])) for k in range(BORDER)]
        bare = sigma[first, :BORDER] @ (2 * np.array(form))
        share = 0.0 if skin is None else skin[0]
        out[first] = share * sigma[first, 0] + (1 - share) * bare
    for k in np.flatnonzero(~(inner | first)):
        out[k] = peak_pressure(x, sigma[k], skin)
    return out
