"""Static measures of many patches on shared condensed pieces, equal to those of `measures`.

In: `PatchModel`s with shared meshes. Out: measures with errors, (q,) for q patches. This module
treats bare pieces, or pieces with a linear asperity layer, under a load, whose contact is a single
interval (`contact.batch`). Other patches are left to single runs.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...contact.batch.intervals import ContactBatch, Intervals
from ...contact.unilateral import RESIDUAL_TOL
from ...core import ContactState, Measure, Outcome, frozen_array
from ...elasticity.lapack import one_thread
from ...mesh.tensor import TensorGrid
from ..results.patch_rows import TABLE
from . import measures as one_by_one
from .condensed import Pair, shared_pair, shared_pairs
from .press import as_patch, with_linear_skin
from .values import EdgeValues, peak_pressures, static_values

# cells beyond the end of a contact on the coarser mesh within which it may end on this one
MAX_END_CELLS = 2


class SolvedPatch(NamedTuple):
    """Patch that was solved together with others.

    - measures: static measures by name.
    - band: sentences on the plane state (`measures.plane_band`).
    - patches: the solved Patch on all meshes, fine to coarse.
    """

    measures: dict
    band: list
    patches: tuple


class PatchLoads(NamedTuple):
    """Loads and shapes of q patches that are alike in their pieces and in `pressing_kind`.

    - first: PatchModel of the first one.
    - load (q,): [N].
    - moment (q,): [N m]; None if the rotation is fixed.
    - spring (q,): rotational stiffness of the holder [N m/rad].
    - angle (q,): initial rotation of the upper piece [rad].
    - shapes: Gap of each patch, or a single one whose numbers are columns.
    """

    first: object
    load: np.ndarray
    moment: np.ndarray | None
    spring: np.ndarray
    angle: np.ndarray
    shapes: tuple

    def gaps(self, x) -> np.ndarray:
        """Return the gaps (q, m) [m] at x (m,) [m]."""
        if len(self.shapes) == self.load.size:
            return np.array([gap.evaluate(x).heights for gap in self.shapes])
        return np.broadcast_to(self.shapes[0].evaluate(x[:, None])[0].T, (self.load.size, x.size))


class Level(NamedTuple):
    """q patches solved on one mesh.

    - values: static measures by name, (q,) each.
    - pressure: ContactState whose fields have a row or a number for each patch.
    - contacts: intervals in contact.
    - gap_range (q,): range of the gap [m].
    - x (m,): nodes [m].
    """

    values: dict
    pressure: ContactState
    contacts: ContactBatch
    gap_range: np.ndarray
    x: np.ndarray

    @property
    def is_solved(self) -> np.ndarray:
        """Whether the contact of each patch (q,) is a single interval and was found."""
        return self.contacts.residual <= RESIDUAL_TOL


class BatchSolution(NamedTuple):
    """Static measures of q patches that were solved together.

    - values, errors: (q,) by name.
    - good (q,): whether the patch was solved together with the others.
    - top (q,): largest nodal pressure [Pa].
    - approach (q,): on the finest mesh [m].
    - planes: values (q,) by name on the second mesh, in the plane state of the model and in the
      other one; () if not needed.
    - levels: the patches on all meshes, fine to coarse.
    """

    values: dict
    errors: dict
    good: np.ndarray
    top: np.ndarray
    approach: np.ndarray
    planes: tuple
    levels: list

    def band(self, patch_model, k: int) -> list:
        """Return the sentence of `measures.plane_band` on the k-th patch, of PatchModel `patch_model`."""
        return (
            one_by_one.band_words(
                patch_model,
                *(
                    {name: float(column[k]) for name, column in plane.items()}
                    for plane in self.planes
                ),
            )
            if self.planes
            else []
        )

    def measures(self, k: int, floors: Mapping | None = None) -> dict:
        """Return the measures of the k-th patch by name.

        floors: floors (q,) by name that replace those of the table.
        """
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


def not_together(patch_model) -> str:
    """Return the reason why a `PatchModel` is not solved with others; "" if it may be."""
    if patch_model.mesh.shared is None:
        return "the case has a mesh of its own"
    if not all(
        isinstance(body, TensorGrid) or body is None
        for level in patch_model.mesh.shared.levels
        for body in level
    ):
        return "the meshes of the pieces are not plain grids"
    if patch_model.gap.profile is not None:
        return "a profile has its own averaging length"
    return _not_of_one_stretch(patch_model) or (
        ""
        if len(patch_model.mesh.shared.levels) > 2
        else "the mesh of the case cannot be made coarser"
    )


def _not_of_one_stretch(patch_model) -> str:
    """Return the reason why a `PatchModel` on plain grids cannot have a contact of one interval.

    "" if it can.
    """
    skin = patch_model.interface.skin
    if patch_model.interface.strips is not None or (skin is not None and skin.law != "linear"):
        return "strips or a smooth skin lie between the pieces"
    if not patch_model.loading.load:
        return "no load presses the pieces together"
    is_unbounded = patch_model.has_singular_ends or patch_model.gap.jumps
    return "the pressure of the case may be unbounded" if is_unbounded else ""


def pressing_kind(patch_model) -> tuple:
    """Return the properties that patches solved together share, apart from their pieces."""
    return patch_model.mesh.shared.name, *_kind(patch_model)


def _kind(patch_model) -> tuple:
    """Return the numbers of the linear asperity layer, and whether the rotation is fixed."""
    skin = patch_model.interface.skin
    numbers = None if skin is None else (skin.normal_stiffness, skin.tangential_ratio)
    return numbers, patch_model.loading.moment is None


def collect_loads(patches: Sequence) -> PatchLoads:
    """Return the `PatchLoads` of some `PatchModel`s."""
    loadings = [patch.loading for patch in patches]
    moment = None
    if loadings[0].moment is not None:
        moment = np.array([loading.moment for loading in loadings], float)
    return PatchLoads(
        patches[0],
        np.array([loading.load for loading in loadings], float),
        moment,
        np.array([loading.rotational_stiffness for loading in loadings], float),
        np.array([patch.gap.angle for patch in patches], float),
        tuple(patch.gap for patch in patches),
    )


def asked_by_columns(patch, count: int) -> PatchLoads:
    """Return the `PatchLoads` of `count` patches, given as one PatchModel with columns of numbers."""

    def column(number) -> np.ndarray:
        """Return a number as a column (q,)."""
        return np.broadcast_to(np.asarray(number, float), count)

    moment = patch.loading.moment
    return PatchLoads(
        patch,
        column(patch.loading.load),
        None if moment is None else column(moment),
        column(patch.loading.rotational_stiffness),
        column(patch.gap.angle),
        (patch.gap,),
    )


def patches_on(patches, pair: Pair) -> list:
    """Solve `PatchModel`s of one geometry on a Pair.

    Returns a list of Patch; None for each that this module cannot solve.
    """
    out = [None] * len(patches)
    groups = {}
    grids = (
        isinstance(pair.grid, TensorGrid)
        and isinstance(pair.upper_grid, TensorGrid)
        and not pair.closing.any()
    )
    for k, patch_model in enumerate(patches if grids else ()):
        if not _not_of_one_stretch(patch_model):
            groups.setdefault(_kind(patch_model), []).append(k)
    for cases in groups.values():
        with one_thread():
            level = solve_on_pair(collect_loads([patches[k] for k in cases]), pair)
        for place, k in enumerate(cases):
            if (
                level.is_solved[place]
                and level.contacts.n_nodes[place] > one_by_one.UNRESOLVED_NODES
            ):
                out[k] = _make_patch(patches[k], pair, level, place)
    return out


def solved_patches(patches, tolerance: float) -> list:
    """Return each of alike `PatchModel`s as SolvedPatch; None for those not solved here.

    They are alike in their pieces and in `pressing_kind`. tolerance: see `pressed_together`.
    """
    pairs = shared_pairs(patches[0])
    found = pressed_together(collect_loads(patches), tolerance)
    return [
        SolvedPatch(
            found.measures(k),
            found.band(one, k),
            tuple(_make_patch(one, pair, level, k) for pair, level in zip(pairs, found.levels)),
        )
        if found.good[k]
        else None
        for k, one in enumerate(patches)
    ]


def max_error_ratios(patches, pairs: list, tolerance: float) -> list:
    """Return the largest error over the tolerance of each `PatchModel`; None if not solved here.

    Parameters
    ----------
    patches : sequence of PatchModel
        Of one geometry.
    pairs : list of Pair
        Condensed pieces, fine to coarse.
    tolerance : float
    """
    out = [None] * len(patches)
    groups = {}
    grids = all(
        isinstance(body, TensorGrid) for pair in pairs for body in (pair.grid, pair.upper_grid)
    )
    for k, patch_model in enumerate(patches if grids and len(pairs) > 2 else ()):
        if patch_model.gap.profile is None and not _not_of_one_stretch(patch_model):
            groups.setdefault((patch_model.mesh.tolerance, *_kind(patch_model)), []).append(k)
    for cases in groups.values():
        found = pressed_together(collect_loads([patches[k] for k in cases]), tolerance, pairs)
        for place in np.flatnonzero(found.good).tolist():
            out[cases[place]] = one_by_one.max_error_ratio(found.measures(place), tolerance)
    return out


def pressed_together(
    patch_model: PatchLoads, tolerance: float, pieces: list | None = None
) -> BatchSolution:
    """Solve patches on the meshes that they share, and estimate their errors.

    Parameters
    ----------
    patch_model : PatchLoads
    tolerance : float
        Relative error above which values are extrapolated.
    pieces : list of Pair, optional
        Pieces, fine to coarse, that replace the shared ones; the other plane state is then not
        solved.
    """
    pairs = pieces or shared_pairs(patch_model.first)
    first = patch_model.first
    level = None
    levels = []
    with one_thread():
        for pair in reversed(pairs):
            level = solve_on_pair(patch_model, pair, level)
            levels.insert(0, level)
        theirs = () if pieces else _in_other_plane(patch_model, levels[1])
    fine = levels[0]
    pair = pairs[0]
    good = np.logical_and.reduce([level.is_solved for level in (*levels, *theirs)])
    good &= (fine.contacts.n_nodes > one_by_one.UNRESOLVED_NODES) & (
        not any(one.closing.any() for one in pairs)
    )
    hidden = one_by_one.hidden_by_meshes(
        pair,
        _with_asperities(first, pair),
        fine.contacts.force,
        fine.gap_range,
        first.loading.moment is not None,
    )
    found = one_by_one.converge(
        [level.values for level in reversed(levels)],
        one_by_one.shared_errors(hidden, fine.values),
        (first.mesh.tolerance or tolerance) if first.mesh.is_automatic else None,
        all(one_by_one.cells_halved(a, b) for a, b in pairwise(pairs)),
        max(one_by_one.MIN_ERROR, pair.round_off_error),
    )
    return BatchSolution(
        found.values,
        found.errors,
        good,
        fine.pressure.sigma_n.max(axis=1),
        fine.values["approach"],
        tuple(level.values for level in (levels[1], *theirs)) if theirs else (),
        levels,
    )


def _make_patch(patch_model, pair: Pair, level: Level, k: int):
    """Return the k-th patch of a level, of PatchModel `patch_model`, as `press.press_patch` returns it."""
    gap, notes, seconds = patch_model.gap.evaluate(level.x)
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
        patch_model,
        pair,
        gap + pair.rise,
        notes,
        seconds,
        (_with_asperities(patch_model, pair), pressure, None, None),
    )


def _with_asperities(patch_model, pair: Pair):
    """Return the Compliance of a pair, in series with a linear asperity layer if there is one."""
    skin = patch_model.interface.skin
    return pair.compliance if skin is None else with_linear_skin(skin, pair.compliance)


def _in_other_plane(patch_model: PatchLoads, known: Level) -> tuple:
    """Return the patches on the second mesh in the other plane state; () if it is not needed."""
    other = one_by_one.other_plane(patch_model.first)
    return (
        ()
        if other is None
        else (solve_on_pair(patch_model._replace(first=other), shared_pair(other, 1), known),)
    )


def solve_on_pair(patch_model: PatchLoads, pair: Pair, coarse: Level | None = None) -> Level:
    """Solve patches on one Pair.

    Parameters
    ----------
    patch_model : PatchLoads
    pair : Pair
    coarse : Level, optional
        The same patches on coarser cells, near whose ends of contact the search starts.
    """
    bare = pair.compliance
    pieces = _with_asperities(patch_model.first, pair)
    x = bare.interface.x
    held = patch_model.moment is None
    gap = patch_model.gaps(x) + pair.rise
    gap_range = np.ptp(gap, axis=1)
    turned = np.zeros(patch_model.load.size) if held else patch_model.angle
    # the rotation of a free piece is measured from zero, so that it keeps its digits
    gap = gap - turned[:, None] * x
    low = gap.min(axis=1)
    normal = Intervals(pieces.normal, x)
    tangential = Intervals(pieces.tangential, x)
    contacts = normal.press(
        gap - low[:, None],
        patch_model.load,
        None if held else patch_model.moment - patch_model.spring * turned,
        patch_model.spring,
        coarse and _about(x, coarse),
    )
    tangential.fill_sums(contacts.first)
    sigma = contacts.force / bare.interface.weight
    pressure = ContactState(
        sigma,
        contacts.opening,
        low + contacts.closing,
        contacts.theta + patch_model.angle - turned,
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
        x,
        sigma,
        None if patch_model.first.interface.skin is None else softness / normal.c.diagonal(),
    )
    return Level(
        static_values(bare.interface, pressure, peak, edge_values), pressure, contacts, gap_range, x
    )


def _about(x, coarse: Level) -> tuple:
    """Return the nodes at x (m,) [m] between which contacts known on coarser cells lie.

    They are the first node (q,) and the node (q,) after the last one.
    """
    known = coarse.contacts
    solved = coarse.is_solved
    before = coarse.x[np.maximum(known.first - 1, 0)]
    after = coarse.x[np.minimum(known.stop, coarse.x.size - 1)]
    first = np.searchsorted(x, before) - np.where(known.first > 0, 0, 1)
    stop = np.searchsorted(x, after) + 1 + MAX_END_CELLS
    return np.where(solved, np.maximum(first, 0), 0), np.where(
        solved, np.minimum(stop, x.size), x.size
    )
