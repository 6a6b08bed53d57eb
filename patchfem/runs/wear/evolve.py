"""Wear of a patch over many cycles, computed in jumps of many cycles each.

In: a model with [wear], its solved patch and the same patch on coarser meshes. Out: `WornPatch`.
The state is saved after every jump. A run that continues from a saved state gives bitwise the same
results as an uninterrupted run.
"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...model.earlier_wear import interpolate_nodes
from ...model.patch import PatchPiece
from ...time_steps.checkpoint import RETRY_ADVICE, read_state, write_state
from ...wear.depth import wear_rates
from ...wear.jumps import WearProblem, WearState, make_initial_wear_state, replay_jumps, take_jump
from ..patch import area
from ..patch.measures import with_static_measures
from ..patch.press import (
    Patch,
    Patches,
    make_contact_force_function,
    solve_patch_contact,
)
from ..patch.values import compute_static_values
from ..results.patch_rows import Values
from .slip import (
    CycleSlip,
    bands_slide_independently,
    choose_frame_count,
    compute_cycle_slip,
    slips_uniformly,
)

# Largest remaining fraction of the coating thickness at which the coating counts as worn through.
WORN_THROUGH_FRACTION = 1e-6
# Smallest distance to the next row of the friction table, relative to the row spacing, at which a
# jump ends at this row.
MIN_FRICTION_ROW_DISTANCE_RATIO = 0.1


class WearMoment(NamedTuple):
    """Contact, slip path and measures of a worn patch after a number of cycles.

    - cycle: number of cycles.
    - depth: worn depth (m,) [m].
    - used: slip path per cycle (m,) [m] in the last jump.
    - pressure, gap (m,): pressure [Pa] and gap under load [m].
    - miss: relative error of the slip path due to the finite number of frames.
    - values: measures of the patch and of the motion by name.
    """

    cycle: float
    depth: np.ndarray
    used: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    miss: float
    values: dict[str, float]


@dataclass(frozen=True, eq=False, slots=True)
class WornPatch:
    """Worn patch with its wear history, on the finest mesh and on coarser meshes.

    - patch, coarse: worn patch, and those on coarser meshes (None for a missing one).
    - state: final state; None if nothing was worn.
    - moments: WearMoment before any wear and after each jump.
    - depths: worn depths (k,) [m] on the nodes of each coarser mesh.
    - seconds: CPU seconds.
    - stopped: reason why the computation ended early; "" if it did not.
    """

    patch: Patch
    coarse: Patches
    state: WearState
    moments: tuple[WearMoment, ...]
    depths: tuple[np.ndarray, ...]
    seconds: float
    stopped: str


# State of the wear after the last jump, and the history of all jumps
History = tuple[WearState, tuple[WearMoment, ...]]


class _UnboundedMotion(Exception):
    """Signal that the motion of a worn rig grows without bound, so that no cycle repeats and the wear ends."""


class _SlipPathFunction:
    """Callable that returns the slip path per cycle on a worn patch.

    A motion that does not depend on the wear is computed once, on the unworn patch. A run that
    continues from a saved state then gives bitwise the same results.
    """

    def __init__(self, model, patch):
        self.model = model
        self.patch = patch
        self.frames = choose_frame_count(model.accuracy.tolerance)
        self.same = (
            model.grooves is None
            and model.wear.friction is None
            and not bands_slide_independently(model)
            and slips_uniformly(model)
        )
        self.last: CycleSlip | None = None

    def __call__(self, worn) -> np.ndarray:
        """Return the slip path (m,) [m] per cycle at a worn depth [m]."""
        if self.last is None or not self.same:
            worn = np.zeros_like(worn) if self.same else worn
            patch = solve_worn(self.patch, worn)
            slip = compute_cycle_slip(make_worn_model(self.model, patch, worn), patch, self.frames)
            if slip.outcome is not None:
                raise _UnboundedMotion(slip.outcome.sentence)
            self.last = slip
        return self.last.path


def compute_mean_worn_depth(patch, depth) -> float:
    """Return the mean worn depth [m] of a patch, i.e. worn volume divided by area.

    `depth` [m] is the worn depth (m,).
    """
    weight = patch.pieces.interface.weight
    return float(depth @ weight / weight.sum())


def make_worn_model(model, patch, depth):
    """Return the model with the grooves and the friction law at the mean worn depth.

    It is unchanged if neither depends on wear.

    Parameters
    ----------
    model : Model
        Unworn model with [wear].
    patch : Patch
        Patch on whose nodes the depth is given.
    depth : (m,)
        Worn depth [m].
    """
    wear = model.wear
    mean_depth = compute_mean_worn_depth(patch, depth)
    if model.grooves is not None:
        model = replace(model, grooves=model.grooves.after_wear(mean_depth, wear.upper_share))
    if wear.friction is None:
        return model

    # The friction of a rig is also that of its interface.
    law = wear.friction.compute_worn_law(model.friction, mean_depth)
    rig = model.rig
    if rig is not None:
        interfaces = tuple(replace(face, numbers=law) for face in rig.friction.interfaces)
        rig = replace(rig, friction=replace(rig.friction, interfaces=interfaces))
    return replace(model, friction=law, rig=rig)


def compute_wear(
    model, patch, coarse, progress=None, initial: "History | None" = None, store=None
) -> WornPatch:
    """Compute the wear of a patch over all cycles of a model with [wear], in jumps over many cycles.

    Parameters
    ----------
    model : Model
        Unworn model with [wear].
    patch : Patch
        Unworn patch, solved on its finest mesh.
    coarse : sequence of Patch or None
        The unworn patch solved on two coarser meshes, on which the same jumps are repeated to estimate the error; None for
        a mesh that does not exist.
    progress : callable, optional
        Called with the completed fraction of the cycles.
    initial : tuple, optional
        WearState (worn depth, cycle, length of the next jump) and tuple of WearMoments, with which an interrupted run goes
        on.
    store : callable, optional
        Called with WearState and WearMoments after each jump, to save them.

    Returns
    -------
    WornPatch
    """
    clock = process_time()
    patch_model = model.patch
    n_cycles = model.wear.cycles

    motion = _SlipPathFunction(model, patch)
    problem = WearProblem(
        _make_force_function(patch),
        motion,
        patch.pieces.interface.weight,
        model.wear.coefficient,
        n_cycles,
    )

    # A motion without bound has no slip path, so that no wear is computed for it.
    state, moments = initial or (None, ())
    stop_reason = ""
    try:
        if initial is None:
            patch = _add_earlier_wear(model, patch)
            earlier_depth = model.wear.compute_earlier_depth(_list_axes(patch), problem.area)
            state = make_initial_wear_state(problem, earlier_depth)
            moments = (_record_moment(patch, state, motion),)
        else:
            patch = solve_worn(patch, frozen_array(state.depth))
    except _UnboundedMotion as reason:
        stop_reason = f"nothing was worn: {reason}"

    # Jumps over many cycles, each with the contact solved on the worn gap.
    while state is not None and state.cycle < n_cycles:
        if find_worn_through_coating(model, state.depth) is not None:
            break
        try:
            state = _take_next_jump(model, problem, state)
        except _UnboundedMotion as reason:
            stop_reason = (
                f"wear was computed only up to cycle {state.cycle:.6g} of {n_cycles:.6g}: {reason}"
            )
            break
        patch = solve_worn(patch, frozen_array(state.depth))
        moments = (*moments, _record_moment(patch, state, motion))
        if store is not None:
            store(state, moments)
        if progress is not None:
            progress(state.cycle / n_cycles)

    # The jumps are repeated on coarser meshes for the errors. Without any jump, this adds the wear of an earlier run.
    replayed = []
    for mesh in coarse:
        if mesh is not None:
            replayed.append(_replay_wear(model, patch, mesh, moments))

    worn = (*(worn for worn, _ in replayed), *(None for mesh in coarse if mesh is None))
    add_measures = with_static_measures if patch_model.area is None else area.with_face_measures
    patch, *worn = add_measures((patch, *worn), model.accuracy.tolerance)
    return WornPatch(
        patch,
        tuple(worn),
        state,
        moments,
        tuple(depth for _, depth in replayed),
        process_time() - clock,
        stop_reason,
    )


class WornCoating(NamedTuple):
    """Coating of a piece, with the fraction of its thickness that is worn off.

    - fraction: worn fraction of the thickness at the deepest point.
    - piece: "upper" or "lower".
    - thickness: thickness of the coating [m].
    """

    fraction: float
    piece: str
    thickness: float


def find_worn_through_coating(model, depth) -> WornCoating | None:
    """Return the coating that is worn through at a worn depth, or None if there is none.

    `depth` [m] is the worn depth of both pieces together (m,).
    """
    coating = _most_worn_coating(model, depth)
    return coating if coating.fraction >= 1 - WORN_THROUGH_FRACTION else None


def _most_worn_coating(model, depth) -> WornCoating:
    """Return the coating with the largest worn fraction of its thickness.

    The fraction is 0 if there are no coatings.
    """
    coatings = [WornCoating(0.0, "", 0.0)]
    for piece, name, piece_depth in list_worn_pieces(model, depth):
        if piece.coating is not None:
            coatings.append(WornCoating(piece_depth / piece.thickness, name, piece.thickness))
    return max(coatings)


class WornPiece(NamedTuple):
    """Part of the wear that one piece of a patch has.

    - piece: the piece.
    - name: "upper" or "lower".
    - depth: largest depth that is worn off it [m].
    """

    piece: PatchPiece
    name: str
    depth: float


def list_worn_pieces(model, depth) -> list[WornPiece]:
    """Return both pieces, each with its part of the largest worn depth [m], which the scene divides among them.

    `depth` (m,) [m] is the worn depth of both together.
    """
    largest = float(depth.max(initial=0.0))
    share = model.wear.upper_share
    pieces = model.patch.pieces
    return [
        WornPiece(pieces.upper, "upper", share * largest),
        WornPiece(pieces.lower, "lower", (1 - share) * largest),
    ]


def _take_next_jump(model, problem: WearProblem, state: WearState) -> WearState:
    """Compute the state after the next jump, which ends early if a coating is worn through.

    `model` has the wear and the accuracy, `problem` the contact and the coefficient, and `state` the worn depth and the
    cycle before the jump.
    """

    def jump_to(cycle: float) -> WearState:
        """Compute the state after a jump that ends at a given cycle or earlier."""
        return take_jump(problem, state, model.accuracy.tolerance, model.wear.jumps, until=cycle)

    def find_excess(cycle: float) -> float:
        """Return the worn fraction of the coating that is most worn after a jump to a cycle, minus 1."""
        end = state if cycle == state.cycle else jump_to(cycle)
        return _most_worn_coating(model, end.depth).fraction - 1

    next_state = jump_to(find_cycle_of_next_table_row(model.wear, problem, state))
    if _most_worn_coating(model, next_state.depth).fraction <= 1 + WORN_THROUGH_FRACTION:
        return next_state

    # scipy.optimize takes half a second to import, and most runs never wear a coating through.
    from scipy.optimize import brentq

    # The wear rate changes little within a jump, so that the worn fraction is exact to WORN_THROUGH_FRACTION.
    length = next_state.cycle - state.cycle
    cycle = brentq(
        find_excess, state.cycle, next_state.cycle, xtol=0.1 * WORN_THROUGH_FRACTION * length
    )
    return jump_to(cycle)


def find_cycle_of_next_table_row(wear, problem: WearProblem, state: WearState) -> float:
    """Return the last cycle that a jump may reach without skipping a row of the friction table.

    At this cycle, with the present wear rate, the mean worn depth reaches the next row of the
    table; or the row after it, if the next row is nearer than a tenth of their distance. A longer
    jump would skip the values of a row.

    Parameters
    ----------
    wear
        Wear parameters of the model.
    problem : WearProblem
        Contact, slip path and wear law.
    state : WearState
        State at the start of the jump.

    Returns
    -------
    float
        inf if there is no further row.
    """
    if wear.friction is None or wear.jumps:
        return np.inf
    weight = problem.area / problem.area.sum()
    depth = float(np.vdot(state.depth, weight))
    rows = [row for row in wear.friction.depth if row > depth]
    if not rows:
        return np.inf
    is_near = len(rows) > 1 and rows[0] - depth < MIN_FRICTION_ROW_DISTANCE_RATIO * (
        rows[1] - rows[0]
    )
    rates = wear_rates(problem.coefficient, state.path, problem.area) * state.force
    rate = float(np.vdot(rates, weight))
    if rate <= 0:
        return np.inf
    return state.cycle + (rows[is_near] - depth) / rate


def _list_axes(patch) -> tuple[np.ndarray, ...]:
    """Return the positions [m] of the nodes of a patch, (x,), or of the rows and columns of cells of a face, (y, x)."""
    cells = patch.pieces.normal
    return (patch.x,) if patch.model.area is None else (cells.y, cells.x)


def _add_earlier_wear(model, patch):
    """Return the patch with the worn depth of an earlier run added to its gap.

    It is unchanged without an earlier run.

    Raises
    ------
    PatchfemError
        If the earlier run had other surfaces, or wore through a coating.
    """
    earlier_run = model.wear.start
    if earlier_run is None:
        return patch
    axes = _list_axes(patch)
    earlier_run.require_same_surfaces(axes, patch.unloaded_gap)
    depth = frozen_array(earlier_run.depth_at(axes))
    if (coating := find_worn_through_coating(model, depth)) is not None:
        raise PatchfemError(
            f"{earlier_run.path}: in that run the coating of the {coating.piece} piece was worn through; choose a "
            "run in which this coating was not worn through",
            "wear.start",
        )
    return solve_worn(patch, depth)


def solve_worn(patch, worn):
    """Solve the contact of a patch again on its mesh or cells, with a worn depth [m] added to its unworn gap."""
    if patch.model.area is not None:
        return area.press_worn(patch, worn)
    return solve_patch_contact(patch.model, patch.pair, worn, coarse=patch)


def compute_values(patch) -> Values:
    """Return the values of all static measures of a patch by name, in SI units."""
    if patch.model.area is not None:
        return area.compute_face_values(patch)
    return compute_static_values(patch)


def _make_force_function(patch):
    """Return a function of worn depth and softening that computes the contact forces [N] (`wear.depth.Press`)."""
    if patch.model.area is not None:
        return area.make_force_function(patch)
    return make_contact_force_function(patch.model, patch.pair)


def _record_moment(patch, state: WearState, motion: _SlipPathFunction) -> WearMoment:
    """Return contact, slip path and measures of a worn patch as a WearMoment.

    `patch` is solved with the worn depth of `state`, and `motion` is the function that computed the last slip path, with
    its measures.
    """
    model = motion.model
    worn = make_worn_model(model, patch, state.depth)
    measures = compute_values(patch) | motion.last.values
    measures |= compute_worn_volume_and_depth(patch, state.depth)

    # Wear changes the grooves and, by a table, the friction law.
    if model.grooves is not None:
        measures["groove_amplitude"] = 0.0 if worn.grooves is None else worn.grooves.amplitude
    if model.wear.friction is not None:
        measures["static_coefficient"] = worn.friction.static
        if worn.friction.bond_length is not None:
            measures["bond_length"] = worn.friction.bond_length

    return WearMoment(
        state.cycle,
        state.depth,
        state.jump_path,
        patch.pressure.sigma_n,
        patch.pressure.gap,
        motion.last.error,
        measures,
    )


def compute_worn_volume_and_depth(patch, depth) -> Values:
    """Return the worn volume [m3] and the largest worn depth [m] of a patch by name, for the depth (m,) [m] at its nodes."""
    return {
        "worn_volume": float(np.vdot(depth, patch.pieces.interface.weight)),
        "worn_depth_max": float(depth.max(initial=0.0)),
    }


def _replay_wear(model, patch, other_patch, moments) -> tuple[Patch, np.ndarray]:
    """Repeat the jumps of a run on another mesh.

    The slip paths are interpolated. Returns the worn patch and its worn depth [m].

    Parameters
    ----------
    model : Model
        Model of the run.
    patch, other_patch : Patch
        Patch of the moments, and the unworn patch on the other mesh.
    moments : sequence of WearMoment
        States after each jump of the run.
    """
    areas = other_patch.pieces.interface.weight
    axes = _list_axes(patch)
    others = _list_axes(other_patch)

    # Cycles of each jump, and the slip path with which the run wore the patch
    jumps = []
    for before, after in pairwise(moments):
        path = interpolate_nodes(axes, after.used, others)
        jumps.append((after.cycle - before.cycle, path))
    depth = replay_jumps(
        _make_force_function(other_patch),
        areas,
        model.wear.coefficient,
        jumps,
        model.wear.compute_earlier_depth(others, areas),
    )
    return solve_worn(other_patch, frozen_array(depth)), depth


def compute_and_save_wear(storage, key: str, model, patch, coarse, progress=None) -> WornPatch:
    """Compute the wear of a patch and save its state after each jump.

    Parameters
    ----------
    storage
        File of the state, as `run.StateFile`; None: the state is not saved.
    key : str
        Hash of scene and version, which a saved state must match.
    model : Model
        Unworn model with [wear].
    patch : Patch
        Unworn patch.
    coarse : sequence of Patch or None
        The unworn patch on coarser meshes; None for a missing one.
    progress : callable, optional
        Called with the completed fraction of the cycles.
    """
    if storage is None:
        return compute_wear(model, patch, coarse, progress)
    initial = load_wear_state(storage.path, key) if storage.resume else None
    return compute_wear(
        model, patch, coarse, progress, initial, partial(save_wear_state, storage.path, key)
    )


def save_wear_state(
    path: Path, key: str, state: WearState, moments: tuple[WearMoment, ...]
) -> None:
    """Write a wear state and its history to a file, which is replaced atomically.

    Parameters
    ----------
    path : Path
        File of the saved state.
    key : str
        Hash of scene and version.
    state : WearState
        State after the last jump.
    moments : tuple of WearMoment
        States after each jump so far.
    """
    rows = [(*moment[:-1], list(moment.values.items())) for moment in moments]
    write_state(path, key, ([getattr(state, name) for name in WearState.__slots__], rows))


def load_wear_state(path: Path, key: str) -> History:
    """Read a wear state and its history from a file.

    Raises
    ------
    PatchfemError
        If the state belongs to another scene or cannot be read.
    """
    if not path.is_file():
        raise make_missing_state_error(path)
    fields, rows = read_state(path, key)
    moments = (WearMoment(*fields_of_moment, dict(values)) for *fields_of_moment, values in rows)
    return WearState(*fields), tuple(moments)


def make_missing_state_error(path: Path) -> PatchfemError:
    """Return the exception for a run folder that has no saved state.

    `path` is that of the missing file.
    """
    return PatchfemError(
        f"{path.parent.name.removesuffix('.partial')}: this folder contains no interrupted run; {RETRY_ADVICE}"
    )
