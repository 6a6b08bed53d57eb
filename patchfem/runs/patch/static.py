"""Static measures of many patches on the condensed pieces that they share, as `measures` gives them one by one.

It takes bare pieces, or pieces behind a linear skin, under a load: contacts of one stretch (`contact.batch`). What
presses otherwise is left to single runs.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...contact.batch.intervals import Intervals, Pressed
from ...contact.unilateral import RESIDUAL_TOL
from ...core import ContactState, Measure, Outcome, frozen_array
from ...elasticity.lapack import one_thread
from ...mesh.tensor import TensorGrid
from ..results.patch_rows import TABLE
from . import measures as one_by_one
from .condensed import Pair, shared_pair, shared_pairs
from .press import as_patch, with_linear_skin
from .values import EdgeValues, peak_pressures, static_values

BEYOND = 2  # cells beyond the end of a contact on coarser cells, in which it may end on these


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
            return np.array([gap.at(x).heights for gap in self.shapes])
        return np.broadcast_to(self.shapes[0].at(x[:, None])[0].T, (self.load.size, x.size))


class Level(NamedTuple):
    """q patches pressed on one mesh.

    values: static measures by name, (q,) each; pressure: a ContactState whose fields have a row or a number for each patch;
    contacts: the stretches in contact; gap_range: (q,) [m]; x: (m,) nodes [m].
    """

    values: dict
    pressure: ContactState
    contacts: Pressed
    gap_range: np.ndarray
    x: np.ndarray

    @property
    def is_solved(self) -> np.ndarray:
        """Whether each patch (q,) is a contact of one stretch that was found."""
        return self.contacts.residual <= RESIDUAL_TOL


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
        return (
            one_by_one.band_words(
                asked,
                *({name: float(column[k]) for name, column in one.items()} for one in self.planes),
            )
            if self.planes
            else []
        )

    def measures(self, k: int, floors: Mapping | None = None) -> dict:
        """The measures of the k-th patch by name; floors: name -> (q,) in place of those of the table."""
        return {
            name: Measure(
                float(column[k]),
                TABLE[name].unit,
                float(self.errors[name][k]),
                TABLE[name].floor if floors is None else float(floors[name][k]),
                engine=one_by_one.mesh_engine(column[k], self.levels[0].values[name][k]),
            )
            for name, column in self.values.items()
        }


def not_together(asked) -> str:
    """Why a `PatchModel` is not pressed together with others; "" where it may be."""
    if asked.mesh.shared is None:
        return "the case has a mesh of its own"
    if not all(
        isinstance(body, TensorGrid) or body is None
        for level in asked.mesh.shared.levels
        for body in level
    ):
        return "the meshes of the pieces are not plain grids"
    if asked.gap.profile is not None:
        return "a profile has its own averaging length"
    return _not_of_one_stretch(asked) or (
        "" if len(asked.mesh.shared.levels) > 2 else "the mesh of the case cannot be made coarser"
    )


def _not_of_one_stretch(asked) -> str:
    """Why contacts of one stretch press no `PatchModel` on plain grids; "" where they may."""
    skin = asked.interface.skin
    if asked.interface.strips is not None or (skin is not None and skin.law != "linear"):
        return "strips or a smooth skin lie between the pieces"
    if not asked.loading.load:
        return "no load presses the pieces together"
    is_unbounded = asked.has_singular_ends or asked.gap.jumps
    return "the pressure of the case may be unbounded" if is_unbounded else ""


def pressing_kind(asked) -> tuple:
    """What patches pressed together have in common beside their pieces."""
    return asked.mesh.shared.name, *_kind(asked)


def _kind(asked) -> tuple:
    skin = asked.interface.skin
    numbers = None if skin is None else (skin.normal_stiffness, skin.tangential_ratio)
    return numbers, asked.loading.moment is None


def asked_of(patches: Sequence) -> Asked:
    """What presses `PatchModel`s."""
    loadings = [one.loading for one in patches]
    moment = None
    if loadings[0].moment is not None:
        moment = np.array([one.moment for one in loadings], float)
    return Asked(
        patches[0],
        np.array([one.load for one in loadings], float),
        moment,
        np.array([one.rotational_stiffness for one in loadings], float),
        np.array([one.gap.angle for one in patches], float),
        tuple(one.gap for one in patches),
    )


def asked_by_columns(patch, count: int) -> Asked:
    """What presses `count` patches, given as one PatchModel whose numbers are columns where they differ."""

    def column(number) -> np.ndarray:
        return np.broadcast_to(np.asarray(number, float), count)

    moment = patch.loading.moment
    return Asked(
        patch,
        column(patch.loading.load),
        None if moment is None else column(moment),
        column(patch.loading.rotational_stiffness),
        column(patch.gap.angle),
        (patch.gap,),
    )


def patches_on(patches, pair: Pair) -> list:
    """Each of `PatchModel`s of one geometry as a solved Patch on a Pair; None of those that do not press as this module
    can."""
    out, groups = [None] * len(patches), {}
    grids = (
        isinstance(pair.grid, TensorGrid)
        and isinstance(pair.upper_grid, TensorGrid)
        and not pair.closing.any()
    )
    for k, asked in enumerate(patches if grids else ()):
        if not _not_of_one_stretch(asked):
            groups.setdefault(_kind(asked), []).append(k)
    for cases in groups.values():
        with one_thread():
            level = pressed_on(asked_of([patches[k] for k in cases]), pair)
        for place, k in enumerate(cases):
            if (
                level.is_solved[place]
                and level.contacts.n_nodes[place] > one_by_one.UNRESOLVED_NODES
            ):
                out[k] = _patch_of(patches[k], pair, level, place)
    return out


def solved_patches(patches, tolerance: float) -> list:
    """Each of `PatchModel`s alike in their pieces and in `pressing_kind` as SolvedPatch; None of those that do not
    press as this module can. tolerance: as `pressed_together` has it."""
    pairs, found = shared_pairs(patches[0]), pressed_together(asked_of(patches), tolerance)
    return [
        SolvedPatch(
            found.measures(k),
            found.band(one, k),
            tuple(_patch_of(one, pair, level, k) for pair, level in zip(pairs, found.levels)),
        )
        if found.good[k]
        else None
        for k, one in enumerate(patches)
    ]


def missed_on(patches, pairs: list, tolerance: float) -> list:
    """For each of `PatchModel`s of one geometry on pieces, fine to coarse, its largest error over the tolerance; None
    for those that do not press as this module can."""
    out, groups = [None] * len(patches), {}
    grids = all(
        isinstance(body, TensorGrid) for pair in pairs for body in (pair.grid, pair.upper_grid)
    )
    for k, asked in enumerate(patches if grids and len(pairs) > 2 else ()):
        if asked.gap.profile is None and not _not_of_one_stretch(asked):
            groups.setdefault((asked.mesh.tolerance, *_kind(asked)), []).append(k)
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
    good = np.logical_and.reduce([level.is_solved for level in (*levels, *theirs)])
    good &= (fine.contacts.n_nodes > one_by_one.UNRESOLVED_NODES) & (
        not any(one.closing.any() for one in pairs)
    )
    hidden = one_by_one.hidden_by_meshes(
        pair,
        _with_skin(first, pair),
        fine.contacts.force,
        fine.gap_range,
        first.loading.moment is not None,
    )
    found = one_by_one.converge(
        [level.values for level in reversed(levels)],
        one_by_one.least_of(hidden, fine.values),
        (first.mesh.tolerance or tolerance) if first.mesh.is_automatic else None,
        all(one_by_one.cells_halved(a, b) for a, b in pairwise(pairs)),
        max(one_by_one.MIN_ERROR, pair.rounding),
    )
    return Together(
        found.values,
        found.errors,
        good,
        fine.pressure.sigma_n.max(axis=1),
        fine.values["approach"],
        tuple(level.values for level in (levels[1], *theirs)) if theirs else (),
        levels,
    )


def _patch_of(asked, pair: Pair, level: Level, k: int):
    """Return the k-th patch of a level, of the PatchModel `asked`, as `press.pressed` gives it by itself."""
    gap, notes, seconds = asked.gap.at(level.x)
    rows = level.pressure
    pressure = ContactState(
        frozen_array(rows.sigma_n[k]),
        frozen_array(rows.gap[k]),
        float(rows.approach[k]),
        float(rows.rotation[k]),
        float(rows.load[k]),
        float(rows.moment[k]),
        Outcome.DONE,
        1,
        MappingProxyType({}),
    )
    return as_patch(
        asked,
        pair,
        gap + pair.rise,
        notes,
        seconds,
        (_with_skin(asked, pair), pressure, None, None),
    )


def _with_skin(asked, pair: Pair):
    """Return the Compliance of a pair with the linear skin of a `PatchModel`, that of the pair where it has none."""
    skin = asked.interface.skin
    return pair.compliance if skin is None else with_linear_skin(skin, pair.compliance)


def _in_other_plane(asked: Asked, known: Level) -> tuple:
    """Return the patches on the second mesh in the other plane state; () where its values in their own are enough."""
    other = one_by_one.other_plane(asked.first)
    return (
        ()
        if other is None
        else (pressed_on(asked._replace(first=other), shared_pair(other, 1), known),)
    )


def pressed_on(asked: Asked, pair: Pair, coarse: Level | None = None) -> Level:
    """Press patches on one Pair; coarse: the same on coarser cells, about which the contacts end."""
    bare, pieces = pair.compliance, _with_skin(asked.first, pair)
    x, held = bare.interface.x, asked.moment is None
    gap = asked.gaps(x) + pair.rise
    gap_range = np.ptp(gap, axis=1)
    turned = np.zeros(asked.load.size) if held else asked.angle
    # a free piece is counted from no angle, so that its rotation keeps its digits
    gap = gap - turned[:, None] * x
    low = gap.min(axis=1)
    normal, tangential = Intervals(pieces.normal, x), Intervals(pieces.tangential, x)
    contacts = normal.press(
        gap - low[:, None],
        asked.load,
        None if held else asked.moment - asked.spring * turned,
        asked.spring,
        coarse and _about(x, coarse),
    )
    tangential.fill_sums(contacts.first)
    sigma = contacts.force / bare.interface.weight
    pressure = ContactState(
        sigma,
        contacts.opening,
        low + contacts.closing,
        contacts.theta + asked.angle - turned,
        contacts.force.sum(axis=1),
        contacts.force @ x,
        Outcome.DONE,
        1,
        MappingProxyType({}),
    )
    softness = normal.c.diagonal() - bare.normal.diagonal()
    left, right = normal.edge_positions(contacts, softness, pair.row)
    width = np.maximum(right - left, 0.0)
    edge_values = EdgeValues(
        width,
        width,
        normal.stiffness(contacts),
        tangential.stiffness(contacts),
        normal.stiffness(contacts, is_rotation=True),
    )
    peak = peak_pressures(
        x, sigma, None if asked.first.interface.skin is None else softness / normal.c.diagonal()
    )
    return Level(
        static_values(bare.interface, pressure, peak, edge_values), pressure, contacts, gap_range, x
    )


def _about(x, coarse: Level) -> tuple:
    """Return the nodes at x (m,) [m] between which contacts lie that are known on other cells.

    (q,) nodes from which on and (q,) nodes before which they lie.
    """
    known, solved = coarse.contacts, coarse.is_solved
    before, after = (
        coarse.x[np.maximum(known.first - 1, 0)],
        coarse.x[np.minimum(known.stop, coarse.x.size - 1)],
    )
    first = np.searchsorted(x, before) - np.where(known.first > 0, 0, 1)
    stop = np.searchsorted(x, after) + 1 + BEYOND
    return np.where(solved, np.maximum(first, 0), 0), np.where(
        solved, np.minimum(stop, x.size), x.size
    )
