"""Wear of a patch over many cycles: contact, motion and worn depth advance in jumps.

In: a model with [wear], its pressed patch and the same on coarser meshes. Out: `WornPatch`. The
state is saved after every jump, and an interrupted run that continues from it gives the same
bits.
"""

import json
import os
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...contact import strips
from ...core import PatchfemError, frozen_array
from ...disk.atomic_write import write_atomically
from ...effects import describe_unsupported
from ...wear.depth import wear_rates
from ...wear.jumps import WearProblem, WearState, replay_jumps, start_wear, take_jump
from ..patch.measures import with_other_strip_count
from ..patch.press import make_contact_force_function, nodal_areas, solve_patch_contact
from ..patch.values import compute_static_values
from ..rig import numerics
from .slip import (
    CycleSlip,
    compute_cycle_slip,
    count_frames,
    slips_uniformly,
    strips_slide_independently,
)

STATE_FIELDS = tuple(WearState.__slots__)  # Fields of the wear state in a saved file.
MOMENT_FIELDS = (
    "cycle",
    "depth",
    "used",
    "pressure",
    "gap",
    "miss",
)  # Arrays of a saved WearMoment.
# Fraction of the thickness of a coating that may remain where it counts as worn through.
THIN_FRACTION = 1e-6
# Largest number of jumps of the search for the cycle at which a coating is worn through.
MAX_SEARCH_JUMPS = 60
# Distance to the next row of the friction table, relative to the row spacing; a nearer row is passed.
MIN_ROW_DISTANCE = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class WearMoment:
    """Contact, slip path and measures of a worn patch after a number of cycles.

    - cycle: number of cycles.
    - depth: worn depth (m,), of strips (s, m) [m].
    - used: slip path per cycle in the last jump (m,), of strips (s, m) [m].
    - pressure, gap (m,): pressure [Pa] and remaining gap [m]; for strips the mean pressure and the
      smallest gap over the width.
    - miss: relative error of the slip path due to the number of frames.
    - values: measures of patch and motion by name.
    """

    cycle: float
    depth: np.ndarray
    used: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    miss: float
    values: dict


@dataclass(frozen=True, eq=False, slots=True)
class WornPatch:
    """Worn patch with the history of its wear, also on coarser meshes.

    - patch, coarse: worn patch, and those on coarser meshes (None for a missing one).
    - state: at the end; None if nothing was worn.
    - moments: after every jump; the first one is before any wear.
    - depths: worn depths (k,), of strips (s, k) [m], on the nodes of each coarser mesh.
    - stripped: (patch, depth (t, m) [m]) in another number of strips, by the same jumps
      (`measures.with_other_strip_count`); None without strips.
    - frame_error: relative error of the slip path due to the number of frames.
    - seconds: CPU seconds.
    - stopped: reason of an early end, else "".
    """

    patch: object
    coarse: tuple
    state: WearState
    moments: tuple
    depths: tuple
    stripped: tuple | None
    frame_error: float
    seconds: float
    stopped: str


class _UnboundedMotion(Exception):
    """Exception that is raised if the motion of a worn model has no periodic cycle."""


class _Motion:
    """Function that computes the slip path per cycle on a worn patch.

    A motion that does not depend on wear is computed once, on the unworn patch, so that a run that
    continues from a saved state gives the same bits.
    """

    def __init__(self, model, patch):
        self.model = model
        self.pair = patch.pair
        self.frames = count_frames(model.accuracy.tolerance)
        self.same = (
            model.grooves is None
            and model.wear.friction is None
            and not strips_slide_independently(model)
            and slips_uniformly(
                model, model.rig is not None and numerics.choose_numerics(model).per_point
            )
        )
        self.last: CycleSlip | None = None

    def __call__(self, worn) -> np.ndarray:
        """Return the slip path [m] per cycle, (m,) or (s, m) for strips, at a worn depth [m]."""
        if self.last is None or not self.same:
            worn = np.zeros_like(worn) if self.same else worn
            patch = solve_patch_contact(self.model.patch, self.pair, worn)
            slip = compute_cycle_slip(worn_model(self.model, patch, worn), patch, self.frames)
            if slip.outcome is not None:
                raise _UnboundedMotion(slip.outcome.sentence)
            self.last = slip
        return self.last.path


def mean_worn_depth(patch, depth) -> float:
    """Return the mean worn depth [m] of a patch, which is worn volume divided by area.

    depth: (m,), of strips (s, m) [m].
    """
    area = patch.pieces.interface.weight
    return float(np.atleast_2d(depth).mean(axis=0) @ area / area.sum())


def worn_model(model, patch, depth):
    """Return the model with grooves and friction law at the mean worn depth of its patch.

    It is unchanged if neither depends on wear.

    Parameters
    ----------
    model : Model
    patch : Patch
    depth : (m,) or (s, m)
        Worn depth [m].
    """
    wear = model.wear
    new = {}
    if model.grooves is not None:
        new["grooves"] = model.grooves.after_wear(mean_worn_depth(patch, depth), wear.upper_share)
    if wear.friction is not None:
        law = new["friction"] = wear.friction.compute_worn_law(
            model.friction, mean_worn_depth(patch, depth)
        )
        if model.rig is not None:
            friction = model.rig.friction
            interfaces = tuple(replace(interface, numbers=law) for interface in friction.interfaces)
            new["rig"] = replace(model.rig, friction=replace(friction, interfaces=interfaces))
    return replace(model, **new) if new else model


def compute_wear(
    model, patch, coarse, progress=None, initial: tuple | None = None, store=None
) -> WornPatch:
    """Compute the wear of a patch over all cycles of a model with [wear].

    Parameters
    ----------
    model : Model
    patch : Patch
        Unworn pressed patch.
    coarse : sequence of Patch or None
        The same on coarser meshes.
    progress : callable, optional
        Called with the completed fraction of the cycles.
    initial : tuple, optional
        (state, moments) of an interrupted run.
    store : callable, optional
        Called with state and moments after every jump to store them.

    Returns
    -------
    WornPatch

    Raises
    ------
    PatchfemError
        For a slide in two directions.
    """
    if model.slide is not None and model.slide.across is not None:
        text = describe_unsupported(
            "with a slide in two directions",
            "leave out [wear], or leave the column `lateral` out of slide.file",
        )
        raise PatchfemError(text, "wear")
    clock = perf_counter()
    motion = _Motion(model, patch)
    problem = WearProblem(
        make_contact_force_function(model.patch, patch.pair),
        motion,
        nodal_areas(model.patch, patch.pieces.interface),
        model.wear.coefficient,
        model.wear.cycles,
    )
    stopped = ""
    try:
        if initial is None:
            patch = _with_earlier_wear(model, patch)
            state, moments = _start_state(model, patch, problem, motion)
        else:
            state, moments = initial
            patch = solve_patch_contact(model.patch, patch.pair, frozen_array(state.depth))
    except _UnboundedMotion as reason:
        worn = tuple(mesh and _with_earlier_wear(model, mesh) for mesh in coarse)
        stopped = f"nothing was worn: {reason}"
        seconds = perf_counter() - clock
        return WornPatch(patch, worn, None, (), (), None, 0.0, seconds, stopped)
    while state.cycle < model.wear.cycles and find_worn_through_coating(model, state.depth) is None:
        try:
            state = _take_next_jump(model, problem, state)
        except _UnboundedMotion as reason:
            stopped = (
                f"wear was computed only up to cycle {state.cycle:.6g} of {model.wear.cycles:.6g}: "
                f"{reason}"
            )
            break
        patch = solve_patch_contact(model.patch, patch.pair, frozen_array(state.depth))
        moments = (*moments, _record_moment(patch, state, motion))
        if store is not None:
            store(state, moments)
        if progress is not None:
            progress(state.cycle / model.wear.cycles)
    replayed = [
        _repeat_on_mesh(model.patch, model, patch, mesh, moments)
        for mesh in coarse
        if mesh is not None
    ]
    strips_model, _ = with_other_strip_count(model.patch)
    stripped = None
    if replayed and strips_model is not model.patch:
        stripped = _repeat_on_mesh(strips_model, model, patch, patch, moments)
    return WornPatch(
        patch,
        (*(worn for worn, _ in replayed), *(None for mesh in coarse if mesh is None)),
        state,
        moments,
        tuple(depth for _, depth in replayed),
        stripped,
        moments[-1].miss,
        perf_counter() - clock,
        stopped,
    )


class WornCoating(NamedTuple):
    """Coating of a piece, with the fraction of its thickness that is worn off.

    - fraction: worn fraction at the deepest point.
    - piece: "upper" or "lower".
    - thickness: [m].
    """

    fraction: float
    piece: str
    thickness: float


def find_worn_through_coating(model, depth) -> WornCoating | None:
    """Return the coating that is worn through at a worn depth; None if there is none.

    depth: depth worn off both pieces, (m,) or (s, m) [m].
    """
    coating = _most_worn_coating(model, depth)
    return coating if coating.fraction >= 1 - THIN_FRACTION else None


def _most_worn_coating(model, depth) -> WornCoating:
    """Return the coating with the largest worn fraction of its thickness.

    Its fraction is 0 without coatings.
    """
    max_depth = float(depth.max(initial=0.0))
    upper_share = model.wear.upper_share
    pieces = model.patch.pieces
    coatings = [WornCoating(0.0, "", 0.0)]
    for share, piece, name in (
        (upper_share, pieces.upper, "upper"),
        (1 - upper_share, pieces.lower, "lower"),
    ):
        if piece.coating is not None:
            fraction = share * max_depth / piece.thickness
            coatings.append(WornCoating(fraction, name, piece.thickness))
    return max(coatings)


def _take_next_jump(model, problem: WearProblem, state: WearState) -> WearState:
    """Compute the wear after the next jump over cycles, or when a coating is worn through.

    The latter is found by the Illinois variant of regula falsi.
    """

    def excess(state: WearState) -> float:
        """Return the largest worn fraction of a coating thickness minus 1."""
        return _most_worn_coating(model, state.depth).fraction - 1

    def jump_to(cycle: float) -> WearState:
        """Compute the wear after a jump over cycles that ends at a given cycle or earlier."""
        return take_jump(problem, state, model.accuracy.tolerance, model.wear.jumps, until=cycle)

    if model.patch.interface.strips is not None:
        problem.press.start_from_forces(state.force)
    after = jump_to(next_row_cycle(model.wear, problem, state))
    low = state.cycle
    high = np.inf
    previous = 0.0
    low_value = excess(state)
    high_value = excess(after)
    end = after.cycle
    for _ in range(MAX_SEARCH_JUMPS):
        value = excess(after)
        if abs(value) <= THIN_FRACTION or (value < 0 and (after.cycle < end or high == np.inf)):
            return after
        if value > 0:
            if high < np.inf and previous > 0:
                low_value = low_value / 2
            high = after.cycle
            high_value = value
        else:
            if previous < 0:
                high_value = high_value / 2
            low = after.cycle
            low_value = value
        previous = value
        end = low - low_value * (high - low) / (high_value - low_value)
        after = jump_to(end)
    return after


def next_row_cycle(wear, problem: WearProblem, state: WearState) -> float:
    """Return the last cycle to which a jump can go before the next row of the friction table.

    At this cycle the current wear rate reaches the next row of the table, or the row after it if
    the next one is nearer than a tenth of their distance. A jump past a row would miss its values.

    Parameters
    ----------
    wear
        Wear of the model.
    problem : WearProblem
    state : WearState

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
    is_near = len(rows) > 1 and rows[0] - depth < MIN_ROW_DISTANCE * (rows[1] - rows[0])
    rates = wear_rates(problem.coefficient, state.path, problem.area) * state.force
    rate = float(np.vdot(rates, weight))
    if rate <= 0:
        return np.inf
    return state.cycle + (rows[is_near] - depth) / rate


def _with_earlier_wear(model, patch):
    """Return the patch with the worn depth of earlier runs included in its gap.

    It is unchanged if there is no earlier wear.

    Raises
    ------
    PatchfemError
        If this depth was worn on other surfaces, or through a coating.
    """
    start = model.wear.start
    if start is None:
        return patch
    start.require_same_surfaces(patch.x, patch.unloaded_gap)
    area = nodal_areas(model.patch, patch.pieces.interface)
    depth = frozen_array(model.wear.compute_earlier_depth(patch.x, area))
    if (coating := find_worn_through_coating(model, depth)) is not None:
        raise PatchfemError(
            f"{start.path}: in that run the coating of the {coating.piece} piece was worn through; choose a "
            "run in which this coating was not worn through",
            "wear.start",
        )
    return solve_patch_contact(model.patch, patch.pair, depth)


def _start_state(model, patch, problem: WearProblem, motion: _Motion) -> tuple:
    """Return the initial wear state and the initial history of a patch.

    It includes earlier wear only.
    """
    state = start_wear(problem, model.wear.compute_earlier_depth(patch.x, problem.area))
    return state, (_record_moment(patch, state, motion),)


def _record_moment(patch, state: WearState, motion: _Motion) -> WearMoment:
    """Return the contact, slip path and measures of a worn patch as a WearMoment."""
    model = motion.model
    area = nodal_areas(model.patch, patch.pieces.interface)
    worn = worn_model(model, patch, state.depth)
    measures = compute_static_values(patch) | motion.last.values
    measures["worn_volume"] = float(np.vdot(state.depth, area))
    measures["worn_depth_max"] = float(state.depth.max(initial=0.0))
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


def _repeat_on_mesh(patch_model, model, patch, other_patch, moments) -> tuple:
    """Repeat on another mesh the wear of a run, with its jumps and slip paths.

    The other patch may also have another number of strips. Return its worn patch and its worn depth
    [m].

    Parameters
    ----------
    patch_model : PatchModel
        With the strips of the other patch.
    model : Model
    patch, other_patch : Patch
        Patch of the moments, and the unworn patch that is worn.
    moments : sequence of WearMoment
    """
    area = nodal_areas(patch_model, other_patch.pieces.interface)

    def interpolate(path) -> np.ndarray:
        """Interpolate a slip path to the nodes and strips of another patch."""
        if patch_model.interface.strips is None:
            return np.interp(other_patch.x, patch.x, path)
        rows = np.array([np.interp(other_patch.x, patch.x, row) for row in path])
        width = patch_model.pieces.width
        offsets = strips.strip_offsets(width, len(area))
        row_offsets = strips.strip_offsets(width, len(rows))
        return np.array([np.interp(offsets, row_offsets, column) for column in rows.T]).T

    jumps = [
        (after.cycle - before.cycle, interpolate(after.used)) for before, after in pairwise(moments)
    ]
    depth = replay_jumps(
        make_contact_force_function(patch_model, other_patch.pair),
        area,
        model.wear.coefficient,
        jumps,
        model.wear.compute_earlier_depth(other_patch.x, area),
    )
    return solve_patch_contact(patch_model, other_patch.pair, frozen_array(depth)), depth


def compute_and_save_wear(storage, key: str, model, patch, coarse, progress=None) -> WornPatch:
    """Compute the wear of a patch, saving its state after every jump over cycles.

    Parameters
    ----------
    storage
        Storage of the state; None: the state is not saved.
    key : str
        Identifies what the state belongs to.
    model, patch, coarse, progress
        See `compute_wear`.
    """
    if storage is None:
        return compute_wear(model, patch, coarse, progress)
    begin = load_state(storage.path, key) if storage.resume else None
    return compute_wear(
        model, patch, coarse, progress, begin, partial(save_state, storage.path, key)
    )


def save_state(path: Path, key: str, state: WearState, moments: tuple) -> None:
    """Write a wear state with its history to a file, which is replaced atomically.

    Parameters
    ----------
    path : Path
    key : str
        Identifies what the state belongs to.
    state : WearState
    moments : tuple of WearMoment
    """
    arrays = {f"state_{name}": np.asarray(getattr(state, name)) for name in STATE_FIELDS}
    for name in MOMENT_FIELDS:
        arrays[f"moment_{name}"] = np.array([getattr(moment, name) for moment in moments])
    values = json.dumps([moment.values for moment in moments], default=float)
    with write_atomically(path) as partial, open(partial, "wb") as file:
        np.savez(file, key=np.array(key), values=np.array(values), **arrays)
        file.flush()
        os.fsync(file.fileno())


def no_saved_state_error(path: Path) -> PatchfemError:
    """Return the exception for a run folder without a saved wear state.

    path: file of the state.
    """
    return PatchfemError(
        f"{path.parent.name.removesuffix('.partial')}: this folder contains no interrupted run; run "
        "without --resume"
    )


def load_state(path: Path, key: str) -> tuple:
    """Read a wear state with its history from a file.

    Raises
    ------
    PatchfemError
        If it belongs to another scene or cannot be read.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if str(arrays["key"]) != key:
            raise PatchfemError(
                f"{path.parent.name}: the state saved there belongs to another scene or to another "
                "version of patchfem; run without --resume"
            )
        fields = {name: arrays[f"state_{name}"] for name in STATE_FIELDS}
        for name, value in fields.items():
            if value.ndim == 0:
                fields[name] = float(value)
        state = WearState(**fields)
        columns = [arrays[f"moment_{name}"] for name in MOMENT_FIELDS]
        moments = tuple(
            WearMoment(float(row[0]), *row[1:-1], float(row[-1]), values)
            for *row, values in zip(*columns, json.loads(str(arrays["values"])), strict=True)
        )
    except FileNotFoundError:
        raise no_saved_state_error(path) from None
    except PatchfemError:
        raise
    except Exception as error:  # A damaged archive can fail in many ways.
        raise PatchfemError(
            f"{path.parent.name}: the state saved there cannot be read ({error}); run without "
            "--resume"
        ) from None
    return state, moments
