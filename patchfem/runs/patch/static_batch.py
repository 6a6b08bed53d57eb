"""Static measures of many patches, solved in one batch on the same condensed pieces.

In: `PatchModel`s with shared meshes. Out: measures with error estimates, (q,) for q patches. The
batch solver is limited to patches under a load that are in contact on a single interval
(`contact.batch`), without asperity layer or with a linear one. All other patches are solved one by
one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain, pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...contact.batch.intervals import ContactBatch, Intervals
from ...contact.unilateral import RESIDUAL_TOL
from ...core import ContactState, Outcome, frozen_array
from ...elasticity.lapack import use_one_blas_thread
from ...mesh.grid import TensorGrid
from .condensed import CondensedPair, condense_on_shared_level, condense_on_shared_meshes
from .edge_values import EdgeValues
from .measures import (
    MAX_UNRESOLVED_NODES,
    MIN_ERROR,
    are_cells_halved,
    compute_contact_resolution,
    estimate_hidden_errors,
    extrapolate_static_measures,
    max_mesh_error_ratio,
    note_on_plane_state_changes,
    with_opposite_plane_state,
)
from .press import SolvedContact, add_linear_skin_compliance, make_patch
from .values import assemble_static_values, estimate_peak_pressures

# Number of cells beyond the contact edge on the coarser mesh within which the edge is searched for.
MAX_END_CELLS = 2


class SolvedPatch(NamedTuple):
    """Solution of a patch that was computed in a batch with other patches.

    - plane_sentences: notes on the plane state (`measures.note_on_plane_state`).
    - patches: the solved Patch on all meshes, from fine to coarse; the first has its measures.
    """

    plane_sentences: list
    patches: tuple


class PatchLoads(NamedTuple):
    """Loads and surface shapes of q patches that are solved in one batch.

    - first: PatchModel of the first patch.
    - load (q,): loads [N].
    - moment (q,): moments [N m]; None if the rotation is fixed.
    - spring (q,): rotational stiffnesses of the holders [N m/rad].
    - angle (q,): initial rotations of the upper pieces [rad].
    - shapes: Gap of each patch, or a single Gap whose parameters are arrays (q,).
    """

    first: object
    load: np.ndarray
    moment: np.ndarray | None
    spring: np.ndarray
    angle: np.ndarray
    shapes: tuple

    def gaps(self, x) -> np.ndarray:
        """Return the unloaded gaps (q, m) [m] at positions x (m,) [m]."""
        if len(self.shapes) == self.load.size:
            return np.array([gap.evaluate(x).heights for gap in self.shapes])
        return np.broadcast_to(self.shapes[0].evaluate(x[:, None])[0].T, (self.load.size, x.size))


class BatchLevel(NamedTuple):
    """Contact solutions of q patches on one mesh.

    - values: static measures (q,) by name.
    - pressure: ContactState whose fields have one row or one number per patch.
    - contacts: contact intervals.
    - gap_range (q,): range of the gap [m].
    - x (m,): nodal positions [m].
    """

    values: dict
    pressure: ContactState
    contacts: ContactBatch
    gap_range: np.ndarray
    x: np.ndarray

    @property
    def is_solved(self) -> np.ndarray:
        """Whether each patch (q,) is solved with contact on a single interval."""
        return self.contacts.residual <= RESIDUAL_TOL


class BatchSolution(NamedTuple):
    """Static measures of q patches that were solved in one batch.

    - estimates: Estimate (q,) by name.
    - is_solved (q,): whether the batch solved each patch.
    - plane_values: static measures (q,) by name on the second mesh, in the assumed plane state
      and in the opposite one; () if no note needs them.
    - levels: solutions on all meshes, from fine to coarse.
    """

    estimates: dict
    is_solved: np.ndarray
    plane_values: tuple
    levels: list

    @property
    def approach(self) -> np.ndarray:
        """Approach (q,) [m] on the finest mesh."""
        return self.levels[0].values["approach"]

    @property
    def largest_pressure(self) -> np.ndarray:
        """Largest nodal pressure (q,) [Pa] on the finest mesh."""
        return self.levels[0].pressure.sigma_n.max(axis=1)

    def plane_sentences(self, patch_model, case: int) -> list:
        """Return a list with a note on the plane state of one patch of the batch."""
        if not self.plane_values:
            return []
        values = []
        for columns in self.plane_values:
            values.append({name: float(column[case]) for name, column in columns.items()})
        return note_on_plane_state_changes(patch_model, *values)

    def measures(self, case: int, floors: Mapping | None = None) -> dict:
        """Return the static measures of one patch of the batch by name.

        floors: error floors (q,) by name that replace those of the measure table.
        """
        measures = {}
        for name, estimate in self.estimates.items():
            floor = None if floors is None else float(floors[name][case])
            measures[name] = estimate.select(case).to_measure(name, floor)
        return measures


def reason_not_batched(patch_model) -> str:
    """Return why a patch cannot be solved in a batch, or "" if it can."""
    if patch_model.mesh.shared is None:
        return "the case has a mesh of its own"
    bodies = chain.from_iterable(patch_model.mesh.shared.levels)
    if not all(body is None or _is_rectangle(body) for body in bodies):
        return "the meshes of the pieces are not plain grids"
    if patch_model.gap.profile is not None:
        return "a profile has its own averaging length"
    if reason := _reason_for_several_intervals(patch_model):
        return reason
    has_levels = len(patch_model.mesh.shared.levels) > 2
    return "" if has_levels else "the mesh of the case cannot be made coarser"


def _reason_for_several_intervals(patch_model) -> str:
    """Return why a patch may be in contact on more than one interval, or "" if it cannot."""
    skin = patch_model.interface.skin
    if patch_model.interface.strips is not None or (skin is not None and skin.law != "linear"):
        return "strips or a smooth skin lie between the pieces"
    if not patch_model.loading.load:
        return "no load presses the pieces together"
    is_unbounded = patch_model.has_singular_ends or patch_model.gap.jumps
    return "the pressure of the case may be unbounded" if is_unbounded else ""


def batch_key(patch_model) -> tuple:
    """Return a hashable key that is equal for patches that one batch can solve."""
    return patch_model.mesh.shared.name, *_layer_and_rotation_key(patch_model)


def _layer_and_rotation_key(patch_model) -> tuple:
    """Return the parameters of the linear asperity layer, and whether the rotation is fixed."""
    skin = patch_model.interface.skin
    numbers = None if skin is None else (skin.normal_stiffness, skin.tangential_ratio)
    return numbers, patch_model.loading.moment is None


def collect_patch_loads(patches: Sequence) -> PatchLoads:
    """Collect the loads and shapes of several patches in arrays."""
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


def patch_loads_from_arrays(patch_model, count: int) -> PatchLoads:
    """Return the loads of q patches from one PatchModel whose parameters are arrays (q,)."""

    def column(number) -> np.ndarray:
        """Return a parameter as an array (q,)."""
        return np.broadcast_to(np.asarray(number, float), count)

    loading = patch_model.loading
    return PatchLoads(
        patch_model,
        column(loading.load),
        None if loading.moment is None else column(loading.moment),
        column(loading.rotational_stiffness),
        column(patch_model.gap.angle),
        (patch_model.gap,),
    )


def solve_patches_on_pair(patch_models, pair: CondensedPair) -> list:
    """Solve several patches of equal geometry in batches on the same condensed pieces.

    Parameters
    ----------
    patch_models : sequence of PatchModel
    pair : CondensedPair

    Returns
    -------
    list of Patch
        None for each patch that the batch solver cannot treat.
    """
    out = [None] * len(patch_models)
    if not _has_plain_grids(pair) or pair.closing.any():
        return out
    for cases in _group_batches(patch_models):
        batch = [patch_models[case] for case in cases]
        with use_one_blas_thread():
            level = solve_batch_on_pair(collect_patch_loads(batch), pair)
        for row, case in enumerate(cases):
            if level.is_solved[row] and level.contacts.n_nodes[row] > MAX_UNRESOLVED_NODES:
                out[case] = _extract_patch(patch_models[case], pair, level, row)
    return out


def _has_plain_grids(pair: CondensedPair) -> bool:
    """Return whether the meshes of both pieces are tensor grids."""
    return _is_rectangle(pair.grid) and _is_rectangle(pair.upper_grid)


def _is_rectangle(mesh) -> bool:
    """Return whether a mesh is a grid of a rectangle as long as the interface."""
    return isinstance(mesh, TensorGrid) and mesh.is_rectangle


def _group_batches(patch_models) -> list:
    """Group the indices of patches of equal geometry into batches."""
    groups = {}
    for case, patch_model in enumerate(patch_models):
        if not _reason_for_several_intervals(patch_model):
            key = (patch_model.mesh.tolerance, *_layer_and_rotation_key(patch_model))
            groups.setdefault(key, []).append(case)
    return list(groups.values())


def solve_similar_patches(patch_models, tolerance: float) -> list:
    """Solve similar patches in one batch, and return a SolvedPatch or None for each.

    All patches have the same `batch_key`. None: the batch solver cannot treat this patch.
    tolerance: see `solve_patch_batch`.
    """
    pairs = condense_on_shared_meshes(patch_models[0])
    solution = solve_patch_batch(collect_patch_loads(patch_models), tolerance)
    levels = list(zip(pairs, solution.levels))
    out = [None] * len(patch_models)
    for case in np.flatnonzero(solution.is_solved).tolist():
        patch_model = patch_models[case]
        fine, *coarse = (_extract_patch(patch_model, *level, case) for level in levels)
        fine = replace(fine, measures=solution.measures(case))
        sentences = solution.plane_sentences(patch_model, case)
        out[case] = SolvedPatch(sentences, (fine, *coarse))
    return out


def max_mesh_error_ratios(patch_models, pairs: list, tolerance: float) -> list:
    """Return the largest ratio of error to allowed error for each patch; None if not solved.

    Parameters
    ----------
    patch_models : sequence of PatchModel
        Patches of equal geometry.
    pairs : list of CondensedPair
        From fine to coarse.
    tolerance : float

    Returns
    -------
    list of float
    """
    out = [None] * len(patch_models)
    if len(pairs) < 3 or not all(map(_has_plain_grids, pairs)):
        return out
    for cases in _group_batches(patch_models):
        # A profile has its own averaging length, so that the batch solver does not treat it.
        if patch_models[cases[0]].gap.profile is not None:
            continue
        batch = [patch_models[case] for case in cases]
        solution = solve_patch_batch(collect_patch_loads(batch), tolerance, pairs)
        for row in np.flatnonzero(solution.is_solved).tolist():
            out[cases[row]] = max_mesh_error_ratio(solution.measures(row), tolerance)
    return out


def solve_patch_batch(
    loads: PatchLoads, tolerance: float, pairs: list | None = None
) -> BatchSolution:
    """Solve q patches in one batch on their shared meshes, with error estimates.

    Parameters
    ----------
    loads : PatchLoads
    tolerance : float
        Values with a larger relative error are extrapolated.
    pairs : list of CondensedPair, optional
        Condensed pieces, from fine to coarse, that replace those of the shared meshes; the opposite
        plane state is then not solved.

    Returns
    -------
    BatchSolution
    """
    first = loads.first
    other_model = with_opposite_plane_state(first) if pairs is None else None
    pairs = pairs or condense_on_shared_meshes(first)
    levels = []
    other_level = None
    with use_one_blas_thread():
        for pair in reversed(pairs):
            levels.insert(0, solve_batch_on_pair(loads, pair, levels[0] if levels else None))
        if other_model is not None:
            other_loads = loads._replace(first=other_model)
            other_level = solve_batch_on_pair(
                other_loads, condense_on_shared_level(other_model, 1), levels[1]
            )
    fine = levels[0]
    is_solved = fine.contacts.n_nodes > MAX_UNRESOLVED_NODES
    for level in levels if other_level is None else (*levels, other_level):
        is_solved = is_solved & level.is_solved
    if any(pair.closing.any() for pair in pairs):
        is_solved = np.zeros_like(is_solved)
    resolution = compute_contact_resolution(
        pairs[0],
        add_linear_skin_compliance(first.interface.skin, pairs[0].compliance),
        fine.contacts.force,
        fine.gap_range,
        first.loading.moment is not None,
    )
    estimates = extrapolate_static_measures(
        [level.values for level in reversed(levels)],
        estimate_hidden_errors(resolution, fine.values),
        (first.mesh.tolerance or tolerance) if first.mesh.is_automatic else None,
        all(are_cells_halved(a, b) for a, b in pairwise(pairs)),
        max(MIN_ERROR, pairs[0].round_off_error),
    )
    plane_values = () if other_level is None else (levels[1].values, other_level.values)
    return BatchSolution(estimates, is_solved, plane_values, levels)


def _extract_patch(patch_model, pair: CondensedPair, level: BatchLevel, case: int):
    """Convert the solution of one patch of a batch to a Patch."""
    gap, notes, seconds = patch_model.gap.evaluate(level.x)
    rows = level.pressure
    pressure = ContactState(
        frozen_array(rows.sigma_n[case]),
        frozen_array(rows.gap[case]),
        float(rows.approach[case]),
        float(rows.rotation[case]),
        float(rows.load[case]),
        float(rows.moment[case]),
        Outcome.DONE,
        1,
        MappingProxyType({}),
    )
    pieces = add_linear_skin_compliance(patch_model.interface.skin, pair.compliance)
    contact = SolvedContact(pieces, pressure)
    return make_patch(patch_model, pair, gap + pair.end_gap, contact, notes, seconds)


def solve_batch_on_pair(
    loads: PatchLoads, pair: CondensedPair, coarse: BatchLevel | None = None
) -> BatchLevel:
    """Solve the contact problems of q patches in one batch on the same condensed pieces.

    Parameters
    ----------
    loads : PatchLoads
    pair : CondensedPair
    coarse : BatchLevel, optional
        Solution on the next coarser mesh, near whose contact edges the search starts.

    Returns
    -------
    Level
        BatchLevel
    """
    bare = pair.compliance
    skin = loads.first.interface.skin
    pieces = add_linear_skin_compliance(skin, bare)
    x = bare.interface.x
    has_fixed_rotation = loads.moment is None
    gap = loads.gaps(x) + pair.end_gap
    gap_range = np.ptp(gap, axis=1)
    angle = np.zeros(loads.load.size) if has_fixed_rotation else loads.angle
    # The rotation of a free piece is measured from zero, which avoids cancellation.
    gap = gap - angle[:, None] * x
    min_gap = gap.min(axis=1)
    normal = Intervals(pieces.normal, x)
    tangential = Intervals(pieces.tangential, x)
    contacts = normal.press(
        gap - min_gap[:, None],
        loads.load,
        None if has_fixed_rotation else loads.moment - loads.spring * angle,
        loads.spring,
        coarse and _contact_node_range(x, coarse),
    )
    tangential.fill_sums(contacts.first)
    sigma = contacts.force / bare.interface.weight
    pressure = ContactState(
        sigma,
        contacts.opening,
        min_gap + contacts.closing,
        contacts.theta + loads.angle - angle,
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
    skin_fraction = None if skin is None else softness / normal.c.diagonal()
    peak = estimate_peak_pressures(x, sigma, skin_fraction)
    area = bare.interface.weight.sum()
    values = assemble_static_values(np.ptp(x), area, pressure, peak, edge_values)
    return BatchLevel(values, pressure, contacts, gap_range, x)


def _contact_node_range(x, coarse: BatchLevel) -> tuple:
    """Return the range of nodes that may be in contact, from the contact on a coarser mesh.

    The range is given by its first node (q,) and the node (q,) after its last one.
    """
    contacts = coarse.contacts
    is_solved = coarse.is_solved
    before = coarse.x[np.maximum(contacts.first - 1, 0)]
    after = coarse.x[np.minimum(contacts.stop, coarse.x.size - 1)]
    first = np.searchsorted(x, before) - np.where(contacts.first > 0, 0, 1)
    stop = np.searchsorted(x, after) + 1 + MAX_END_CELLS
    return np.where(is_solved, np.maximum(first, 0), 0), np.where(
        is_solved, np.minimum(stop, x.size), x.size
    )
