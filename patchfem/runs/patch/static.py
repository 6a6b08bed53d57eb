"""Static measures of many patches on the condensed pieces that they share, as `measures` gives them one by one.

It takes bare pieces, or pieces behind a linear skin, under a load: contacts of one stretch (`contact.many`). What
presses otherwise is left to single runs.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...contact.many.intervals import SOLVED, Intervals
from ...core import Measure, Outcome, Pressure, allowed, frozen_array
from ...elasticity.lapack import one_thread
from ...mesh.tensor import TensorGrid
from ..results.patch_rows import TABLE
from . import measures as one_by_one
from .condensed import Pair, shared_pair, shared_pairs
from .measures import Hidden, least_of, settled
from .press import as_patch, with_linear_skin
from .values import peak_pressure, vertex

BORDER = 3  # nodes whose means give the pressure at an end
BEYOND = 2  # cells beyond a contact on coarser cells in which the one on these may end


class SolvedPatch(NamedTuple):
    """A patch solved together with others: static measures by name; band: sentences on the plane state, as
    `measures.plane_band` has them; patches: the solved Patch on the meshes, fine to
    coarse."""

    measures: dict
    band: list
    patches: tuple


class Asked(NamedTuple):
    """What presses q patches that are alike in their pieces and in `pressing_kind`.

    first: the PatchModel of the first; load (q,) [N]; moment (q,) [N m], None where the rotation is held; spring (q,)
    [N m/rad]; angle (q,) [rad] at which the upper piece is held; shapes: Gap of each, or one with columns of numbers.
    """

    first: object
    load: np.ndarray
    moment: np.ndarray | None
    spring: np.ndarray
    angle: np.ndarray
    shapes: tuple

    def gaps(self, x) -> np.ndarray:
        """Gaps (q, m) [m] at x (m,) [m]."""
        if len(self.shapes) == self.load.size:
            return np.array([gap.at(x)[0] for gap in self.shapes])
        return np.broadcast_to(self.shapes[0].at(x[:, None])[0].T, (self.load.size, x.size))


class LevelValues(NamedTuple):
    """What q patches have on one level: values: name -> (q,); first, stop: (q,) the nodes in contact; ends: (2, q) [m]
    cells in which the contact ends on the left and on the right, 0 where it reaches the border; spread, corner: (q,) as
    `Hidden` has them; top: (q,) largest nodal pressure [Pa]; good: (q,) whether it was solved; force (q, m) [N] and
    opening (q, m) [m] of the nodes; x: (m,) [m]."""

    values: dict
    first: np.ndarray
    stop: np.ndarray
    ends: np.ndarray
    spread: np.ndarray
    corner: np.ndarray
    top: np.ndarray
    good: np.ndarray
    force: np.ndarray
    opening: np.ndarray
    x: np.ndarray

    @property
    def count(self) -> np.ndarray:
        """Nodes (q,) in contact."""
        return self.stop - self.first


class Together(NamedTuple):
    """Static measures of q patches: values, errors: name -> (q,); good: (q,) whether they were solved together; top:
    (q,) largest nodal pressure [Pa]; approach: (q,) [m] on the finest mesh; planes: name -> (q,) on the second mesh in
    the plane state of the model and in the other one, () where nobody asks; levels: of the meshes, fine to coarse."""

    values: dict
    errors: dict
    good: np.ndarray
    top: np.ndarray
    approach: np.ndarray
    planes: tuple
    levels: list

    def band(self, asked, k: int) -> list:
        """The sentence of `measures.plane_band` on the k-th patch, a PatchModel."""
        return one_by_one.band_words(asked, *({name: float(column[k]) for name, column in one.items()}
                                              for one in self.planes)) if self.planes else []

    def measures(self, k: int, floors: Mapping | None = None) -> dict:
        """The measures of the k-th patch by name; floors: name -> (q,) in place of those of the table."""
        return {name: Measure(float(column[k]), TABLE[name].unit, float(self.errors[name][k]),
                              TABLE[name].floor if floors is None else float(floors[name][k]),
                              engine=one_by_one.mesh_engine(column[k], self.levels[0].values[name][k]))
                for name, column in self.values.items()}


def not_together(asked) -> str:
    """Why a `PatchModel` is not pressed together with others; "" where it may be."""
    if asked.meshes is None:
        return "the case has a mesh of its own"
    if not all(isinstance(body, TensorGrid) or body is None for level in asked.meshes.levels for body in level):
        return "the meshes of the pieces are not plain grids"
    if asked.gap.profile is not None:
        return "a profile has its own averaging length"
    return _not_of_one_stretch(asked) or \
        ("" if len(asked.meshes.levels) > 2 else "the mesh of the case cannot be made coarser")


def _not_of_one_stretch(asked) -> str:
    """Why contacts of one stretch press no `PatchModel` on plain grids; "" where they may."""
    if asked.strips is not None or (asked.skin is not None and asked.skin.law != "linear"):
        return "strips or a smooth skin lie between the pieces"
    if not asked.load:
        return "no load presses the pieces together"
    return "the pressure of the case may be unbounded" if asked.singular_ends or asked.gap.jumps else ""


def pressing_kind(asked) -> tuple:
    """What patches pressed together have in common beside their pieces."""
    return asked.meshes.name, *_kind(asked)


def _kind(asked) -> tuple:
    skin = None if asked.skin is None else (asked.skin.normal_stiffness, asked.skin.tangential_ratio)
    return skin, asked.moment is None


def asked_of(patches: Sequence) -> Asked:
    """What presses `PatchModel`s."""
    first = patches[0]
    return Asked(first, np.array([one.load for one in patches], float),
                 None if first.moment is None else np.array([one.moment for one in patches], float),
                 np.array([one.spring for one in patches], float), np.array([one.gap.angle for one in patches], float),
                 tuple(one.gap for one in patches))


def asked_by_columns(patch, count: int) -> Asked:
    """What presses `count` patches, given as one PatchModel whose numbers are columns where they differ."""
    def column(number) -> np.ndarray:
        return np.broadcast_to(np.asarray(number, float), count)

    moment = patch.moment
    return Asked(patch, column(patch.load), None if moment is None else column(moment), column(patch.spring),
                 column(patch.gap.angle), (patch.gap,))


def patches_on(patches, pair: Pair) -> list:
    """Each of `PatchModel`s of one geometry as a solved Patch on a Pair; None of those that do not press as this module
    can."""
    out, groups = [None] * len(patches), {}
    grids = isinstance(pair.grid, TensorGrid) and isinstance(pair.upper_grid, TensorGrid) and not pair.closing.any()
    for k, asked in enumerate(patches if grids else ()):
        if not _not_of_one_stretch(asked):
            groups.setdefault(_kind(asked), []).append(k)
    for cases in groups.values():
        with one_thread():
            level = pressed_on(asked_of([patches[k] for k in cases]), pair)
        for place, k in enumerate(cases):
            if level.good[place] and level.count[place] > one_by_one.POINT:
                out[k] = _patch_of(patches[k], pair, level, place)
    return out


def solved_patches(patches, tolerance: float) -> list:
    """Each of `PatchModel`s alike in their pieces and in `pressing_kind` as SolvedPatch; None of those that do not
    press as this module can. tolerance: as `pressed_together` has it."""
    pairs, found = shared_pairs(patches[0]), pressed_together(asked_of(patches), tolerance)
    return [SolvedPatch(found.measures(k), found.band(one, k),
                        tuple(_patch_of(one, pair, level, k) for pair, level in zip(pairs, found.levels)))
            if found.good[k] else None for k, one in enumerate(patches)]


def missed_on(patches, pairs: list, tolerance: float) -> list:
    """For each of `PatchModel`s of one geometry on pieces, fine to coarse, its largest error over the tolerance; None
    for those that do not press as this module can."""
    out, groups = [None] * len(patches), {}
    grids = all(isinstance(body, TensorGrid) for pair in pairs for body in (pair.grid, pair.upper_grid))
    for k, asked in enumerate(patches if grids and len(pairs) > 2 else ()):
        if asked.gap.profile is None and not _not_of_one_stretch(asked):
            groups.setdefault((asked.mesh_tolerance, *_kind(asked)), []).append(k)
    for cases in groups.values():
        found = pressed_together(asked_of([patches[k] for k in cases]), tolerance, pairs)
        for place in np.flatnonzero(found.good).tolist():
            out[cases[place]] = one_by_one.missed(found.measures(place), tolerance)
    return out


def pressed_together(asked: Asked, tolerance: float, pieces: list | None = None) -> Together:
    """Patches on the meshes that they share, with their errors; tolerance: relative error beyond which values are
    extrapolated; pieces: those, fine to coarse, on which they are pressed without the other plane state."""
    pairs, first, level, levels = pieces or shared_pairs(asked.first), asked.first, None, []
    with one_thread():
        for pair in reversed(pairs):
            level = pressed_on(asked, pair, level)
            levels.insert(0, level)
        theirs = () if pieces else _in_other_plane(asked, levels[1])
    fine, pair = levels[0], pairs[0]
    good = np.logical_and.reduce([level.good for level in (*levels, *theirs)])
    good &= (fine.count > one_by_one.POINT) & (not any(one.closing.any() for one in pairs))
    nested = all(one_by_one.cells_halved(a, b) for a, b in pairwise(pairs))
    cell = fine.ends.max(axis=0)
    hidden = Hidden(pair.compliance.interface.length, np.maximum(fine.count, 1), cell, fine.ends.sum(axis=0),
                    one_by_one.offset(pair, cell), first.moment is not None, fine.spread, fine.corner, 0.0)
    names, mine = list(fine.values), fine.values
    known = np.array([[one.values[name] for name in names] for one in reversed(levels)])
    least = least_of(hidden, mine)
    floors = np.array([[TABLE[name].floor] for name in names])
    wanted = allowed(first.mesh_tolerance or tolerance, known[-1], floors) if first.chosen else np.inf
    with np.errstate(invalid="ignore", divide="ignore"):
        best, error = settled(known, np.array([np.broadcast_to(least.get(name, 0.0), cell.shape) for name in names]),
                              wanted, nested)
        error = np.maximum(error, max(one_by_one.ALIKE, pair.rounding) * np.abs(known[-1]))
        values, errors = dict(zip(names, best)), dict(zip(names, error))
        peak, fraction = values["pressure_peak"], values["loaded_fraction"]
        errors["loaded_fraction"] = one_by_one.of_peak(fraction, errors["loaded_fraction"],
                                                       errors["pressure_peak"] / peak)
    return Together(values, errors, good, fine.top, mine["approach"],
                    tuple(one.values for one in (levels[1], *theirs)) if theirs else (), levels)


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


def _in_other_plane(asked: Asked, known: LevelValues) -> tuple:
    """The patches on the second mesh in the other plane state, whose values in their own are known; () where nobody
    asks."""
    other = one_by_one.other_plane(asked.first)
    return () if other is None else (pressed_on(asked._replace(first=other), shared_pair(other, 1), known),)


def pressed_on(asked: Asked, pair: Pair, coarse: LevelValues | None = None) -> LevelValues:
    """Values of patches on one Pair; coarse: those on coarser cells, about which the contacts end."""
    bare, first = pair.compliance, asked.first
    pieces = bare if first.skin is None else with_linear_skin(first.skin, bare)
    x, weight, m = bare.interface.x, bare.interface.weight, bare.interface.x.size
    gap, held = asked.gaps(x) + pair.rise, asked.moment is None
    wide, turned = np.ptp(gap, axis=1), np.zeros(asked.load.size) if held else asked.angle
    gap = gap - turned[:, None] * x  # a free piece is counted from no angle, so that its rotation keeps its digits
    normal, tangential, low = Intervals(pieces.normal, x), Intervals(pieces.tangential, x), gap.min(axis=1)
    found = normal.press(gap - low[:, None], asked.load, None if held else asked.moment - asked.spring * turned,
                         asked.spring, coarse and _about(x, coarse))
    tangential.fill(found.first)
    soft = normal.c.diagonal() - bare.normal.diagonal()
    left, right = normal.places(found, soft, pair.row)
    left, right = np.minimum(left, (left + right) / 2), np.maximum(right, (left + right) / 2)
    sigma = found.force / weight
    peak = peak_pressures(x, sigma, found.count, None if first.skin is None else soft / normal.c.diagonal())
    total, moved = found.force.sum(axis=1), np.abs(found.force @ normal.c).max(axis=1)
    pull, top, cells = found.force @ x, sigma.max(axis=1), np.diff(x)
    with np.errstate(invalid="ignore", divide="ignore"):  # of those that were not solved
        values = {"normal_load": total, "contact_fraction": (right - left) / np.ptp(x), "pressure_peak": peak,
                  "moment": pull, "rotation": found.theta + asked.angle - turned, "approach": low + found.closing,
                  "contact_half_width": (right - left) / 2, "pressure_centre": pull / total,
                  "loaded_fraction": total / (weight.sum() * peak), "normal_stiffness": normal.stiffness(found),
                  "tangential_stiffness": tangential.stiffness(found),
                  "rotational_stiffness": normal.stiffness(found, True)}
    ends = np.stack([np.where(found.first > 0, cells[np.maximum(found.first - 1, 0)], 0.0),
                     np.where(found.stop < m, cells[np.clip(found.stop - 1, 0, m - 2)], 0.0)])
    corner = np.zeros(total.size) if first.skin is not None else \
        corner_layers(pair, sigma[:, [0, -1]].T, cells[[0, -1]])  # a skin evens it out
    return LevelValues(values, found.first, found.stop, ends, wide + moved, corner, top, found.flaw <= SOLVED,
                       found.force, found.opening, x)


def _about(x, coarse: LevelValues) -> tuple:
    """(nodes (q,) from which on, nodes (q,) before which) contacts at x (m,) [m] lie, by those on other cells."""
    before, after = coarse.x[np.maximum(coarse.first - 1, 0)], coarse.x[np.minimum(coarse.stop, coarse.x.size - 1)]
    first = np.searchsorted(x, before) - np.where(coarse.first > 0, 0, 1)
    stop = np.searchsorted(x, after) + 1 + BEYOND
    return np.where(coarse.good, np.maximum(first, 0), 0), np.where(coarse.good, np.minimum(stop, x.size), x.size)


def corner_layers(pair: Pair, sigma, cells):
    """`measures.corner_layer` of many patches: sigma (2, q) [Pa] at both ends, cells (2,) [m]."""
    sides = [one_by_one.corner_layer(pair, (1.0,), (cell,)) for cell in cells]
    return np.maximum(sides[0] * sigma[0], sides[1] * sigma[1])


def peak_pressures(x, sigma, count, skin=None):
    """`values.peak_pressure` (q,) [Pa] of pressures sigma (q, m) [Pa] on stretches of `count` (q,) nodes at x (m,) [m].
    """
    top, out = np.argmax(sigma, axis=1), sigma.max(axis=1)
    inner = (top > 0) & (top < x.size - 1)
    out[inner] = vertex(x, sigma[inner], top[inner])
    for border, turned in ((0, slice(None, None, 1)), (x.size - 1, slice(None, None, -1))):
        there = (top == border) & (count >= BORDER)
        if there.any():  # the pressure at the end is one linear form of the first means
            near, plain = np.abs(x[turned][:BORDER + 1] - x[border]), np.array([3.0, 2.0, 1.0, 0.0])
            form = [peak_pressure(near, plain + np.eye(4)[k] * 0.5) - peak_pressure(near, plain) for k in range(BORDER)]
            share = 0.0 if skin is None else skin[border]
            means = sigma[there][:, turned][:, :BORDER]
            out[there] = share * means[:, 0] + (1 - share) * (means @ (2 * np.array(form)))
    for k in np.flatnonzero(~inner & (count < BORDER) & (count > 0)):
        out[k] = peak_pressure(x, sigma[k], skin)
    return out
