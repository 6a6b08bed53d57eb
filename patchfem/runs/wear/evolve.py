"""Patch over many cycles of wear: contact, motion and worn depth advance in jumps.

In: a model with [wear], its pressed patch and the same on coarser meshes. Out: `Evolved`. The
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

import numpy as np

from ...contact import strips
from ...core import PatchfemError, frozen_array
from ...disk.atomic_write import write_atomically
from ...effects import describe_unsupported
from ...wear.depth import wear_rates
from ...wear.jumps import WearProblem, WearState, replay_jumps, start_wear, take_jump
from ..patch.measures import other_strips
from ..patch.press import areas, make_force_function, press_patch
from ..patch.values import values
from ..rig import numerics
from .slip import CycleSlip, frames_for, slip_of_cycle, slips_uniformly, strips_slide_independently

STATE = tuple(WearState.__slots__)
# fraction of the thickness of a coating that may remain where it counts as worn through
THIN = 1e-6
MOST_TRIES = 60  # most jumps of the search for the cycle at which a coating is worn through
MOMENT = ("cycle", "depth", "used", "pressure", "gap", "miss")


@dataclass(frozen=True, eq=False, slots=True)
class Moment:
    """Interface after a number of cycles.

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
class Evolved:
    """Worn patch with those on coarser meshes, and the history of the wear.

    - patch, coarse: worn patch, and those on coarser meshes (None for a missing one).
    - state: at the end; None if nothing was worn.
    - moments: after every jump; the first one is before any wear.
    - depths: worn depths (k,), of strips (s, k) [m], on the nodes of each coarser mesh.
    - stripped: (patch, depth (t, m) [m]) in another number of strips, by the same jumps
      (`measures.other_strips`); None without strips.
    - miss: relative error of the slip path due to the number of frames.
    - seconds: CPU seconds.
    - stopped: reason of an early end, else "".
    """

    patch: object
    coarse: tuple
    state: WearState
    moments: tuple
    depths: tuple
    stripped: tuple | None
    miss: float
    seconds: float
    stopped: str


class _Unbounded(Exception):
    """The motion has no periodic cycle."""


class _Motion:
    """Slip path of a model on its worn patch.

    A motion that does not depend on wear is computed once, on the unworn patch, so that a run that
    continues from a saved state gives the same bits.
    """

    def __init__(self, model, patch):
        self.model = model
        self.pair = patch.pair
        self.frames = frames_for(model.accuracy.tolerance)
        self.same = (
            model.grooves is None
            and model.wear.friction is None
            and not strips_slide_independently(model)
            and slips_uniformly(model, model.rig is not None and numerics.choose(model).per_point)
        )
        self.last: CycleSlip | None = None

    def __call__(self, worn) -> np.ndarray:
        """Return the slip path (m,), of strips (s, m) [m], per cycle at a worn depth [m]."""
        if self.last is None or not self.same:
            worn = np.zeros_like(worn) if self.same else worn
            patch = press_patch(self.model.patch, self.pair, worn)
            found = slip_of_cycle(worn_model(self.model, patch, worn), patch, self.frames)
            if found.outcome is not None:
                raise _Unbounded(found.outcome.sentence)
            self.last = found
        return self.last.path


def mean_depth(patch, depth) -> float:
    """Return the worn volume over the area of the patch [m]; depth: (m,), of strips (s, m) [m]."""
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
        new["grooves"] = model.grooves.after_wear(mean_depth(patch, depth), wear.upper_share)
    if wear.friction is not None:
        law = new["friction"] = wear.friction.compute_worn_law(
            model.friction, mean_depth(patch, depth)
        )
        if model.rig is not None:
            friction = model.rig.friction
            interfaces = tuple(replace(interface, numbers=law) for interface in friction.interfaces)
            new["rig"] = replace(model.rig, friction=replace(friction, interfaces=interfaces))
    return replace(model, **new) if new else model


def evolve(model, patch, coarse, progress=None, begin: tuple | None = None, keep=None) -> Evolved:
    """Wear the patch of a model with [wear] over all its cycles.

    Parameters
    ----------
    model : Model
    patch : Patch
        Unworn pressed patch.
    coarse : sequence of Patch or None
        The same on coarser meshes.
    progress : callable, optional
        Called with the completed fraction of the cycles.
    begin : tuple, optional
        (state, moments) of an interrupted run.
    keep : callable, optional
        Called with state and moments after every jump.

    Returns
    -------
    Evolved

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
    wear = model.wear
    motion = _Motion(model, patch)
    stopped = ""
    asked = WearProblem(
        make_force_function(model.patch, patch.pair),
        motion,
        areas(model.patch, patch.pieces.interface),
        wear.coefficient,
        wear.cycles,
    )
    patch = (
        _with_earlier_wear(model, patch, asked.area)
        if begin is None
        else press_patch(model.patch, patch.pair, frozen_array(begin[0].depth))
    )
    try:
        state, moments = begin or _start_state(model, patch, asked, motion)
    except _Unbounded as why:
        coarse = (
            one and _with_earlier_wear(model, one, areas(model.patch, one.pieces.interface))
            for one in coarse
        )
        return Evolved(
            patch,
            tuple(coarse),
            None,
            (),
            (),
            None,
            0.0,
            perf_counter() - clock,
            f"nothing was worn: {why}",
        )
    while state.cycle < wear.cycles and worn_through(model, state.depth) is None:
        try:
            state = _jump(model, asked, state)
        except _Unbounded as why:
            stopped = (
                f"wear was computed only up to cycle {state.cycle:.6g} of {wear.cycles:.6g}: {why}"
            )
            break
        patch = press_patch(model.patch, patch.pair, frozen_array(state.depth))
        moments = (*moments, _record_moment(patch, state, motion))
        if keep is not None:
            keep(state, moments)
        if progress is not None:
            progress(state.cycle / wear.cycles)
    others = [one for one in coarse if one is not None]
    worn, depths = (
        zip(*(_replay_on(model.patch, model, patch, other, moments) for other in others))
        if others
        else ((), ())
    )
    other, _ = other_strips(model.patch)
    stripped = (
        _replay_on(other, model, patch, patch, moments)
        if other is not model.patch and others
        else None
    )
    return Evolved(
        patch,
        (*worn, *(None for one in coarse if one is None)),
        state,
        moments,
        depths,
        stripped,
        moments[-1].miss,
        perf_counter() - clock,
        stopped,
    )


def worn_through(model, depth) -> tuple | None:
    """Return (name, thickness [m]) of a piece whose coating is worn through, else None.

    depth: depth worn off both pieces, (m,) or (s, m) [m].
    """
    share, name, thickness = max(_wear_fractions(model, depth), default=(0.0, "", 0.0))
    return (name, thickness) if share >= 1 - THIN else None


def _wear_fractions(model, depth) -> list:
    """Return (worn fraction of the coating at the deepest point, name, thickness [m]) per piece.

    Only coated pieces are listed.
    """
    deepest = float(depth.max(initial=0.0))
    upper = model.wear.upper_share
    asked = model.patch
    return [
        (part * deepest / piece.thickness, name, piece.thickness)
        for part, piece, name in (
            (upper, asked.pieces.upper, "upper"),
            (1 - upper, asked.pieces.lower, "lower"),
        )
        if piece.coating is not None
    ]


def _jump(model, asked: WearProblem, state: WearState) -> WearState:
    """Return the state after the next jump, or where a coating is worn through.

    The latter is found by the Illinois variant of regula falsi.
    """

    def ahead(one: WearState) -> float:
        """Return the largest worn fraction of a coating minus 1."""
        return max(_wear_fractions(model, one.depth), default=(0.0,))[0] - 1

    if model.patch.interface.strips is not None:
        asked.press.begin(state.force)
    how = asked, state, model.accuracy.tolerance, model.wear.jumps
    found = take_jump(*how, until=next_row(model.wear, asked, state))
    low = state.cycle
    high = np.inf
    last = 0.0
    below = ahead(state)
    above = ahead(found)
    end = found.cycle
    for _ in range(MOST_TRIES):
        over = ahead(found)
        if abs(over) <= THIN or (over < 0 and (found.cycle < end or high == np.inf)):
            return found
        if over > 0:
            below = below / 2 if high < np.inf and last > 0 else below
            high = found.cycle
            above = over
        else:
            above = above / 2 if last < 0 else above
            low = found.cycle
            below = over
        last = over
        end = low - below * (high - low) / (above - below)
        found = take_jump(*how, until=end)
    return found


def next_row(wear, asked: WearProblem, state: WearState) -> float:
    """Return the cycle up to which an automatic jump may go, to use each row of friction.

    It is the cycle at which the current wear rate reaches the next row of the table, or the row
    after it if the next one is nearer than a tenth of their distance. A jump past a row would miss
    its values.

    Parameters
    ----------
    wear
        Wear of the model.
    asked : WearProblem
    state : WearState

    Returns
    -------
    float
        inf if there is no further row.
    """
    change = wear.friction
    weight = asked.area / asked.area.sum()
    mean = float(np.vdot(state.depth, weight))
    ahead = [] if change is None or wear.jumps else [row for row in change.depth if row > mean]
    if not ahead:
        return np.inf
    near = len(ahead) > 1 and ahead[0] - mean < 0.1 * (ahead[1] - ahead[0])
    rate = float(
        np.vdot(wear_rates(asked.coefficient, state.path, asked.area) * state.force, weight)
    )
    return state.cycle + (ahead[near] - mean) / rate if rate > 0 else np.inf


def _with_earlier_wear(model, patch, area):
    """Return the patch with the depth that was worn before the first cycle.

    It is unchanged if there is none.

    Raises
    ------
    PatchfemError
        If this depth was worn on other surfaces, or through a coating.
    """
    begun = model.wear.start
    if begun is None:
        return patch
    begun.require_same_surfaces(patch.x, patch.unloaded_gap)
    depth = frozen_array(model.wear.compute_earlier_depth(patch.x, area))
    if (gone := worn_through(model, depth)) is not None:
        raise PatchfemError(
            f"{begun.path}: in that run the coating of the {gone[0]} piece was worn through; choose a "
            "run in which this coating was not worn through",
            "wear.start",
        )
    return press_patch(model.patch, patch.pair, depth)


def _start_state(model, patch, asked: WearProblem, motion: _Motion) -> tuple:
    """Return (state, moments) before any wear except that of `_with_earlier_wear`."""
    state = start_wear(asked, model.wear.compute_earlier_depth(patch.x, asked.area))
    return state, (_record_moment(patch, state, motion),)


def _record_moment(patch, state: WearState, motion: _Motion) -> Moment:
    """Return the Moment of a worn patch."""
    area = areas(motion.model.patch, patch.pieces.interface)
    worn = {
        "worn_volume": float(np.vdot(state.depth, area)),
        "worn_depth_max": float(state.depth.max(initial=0.0)),
    }
    after_wear = worn_model(motion.model, patch, state.depth)
    if motion.model.grooves is not None:
        left = after_wear.grooves
        worn["groove_amplitude"] = 0.0 if left is None else left.amplitude
    if motion.model.wear.friction is not None:
        law = after_wear.friction
        worn |= {"static_coefficient": law.static} | (
            {} if law.bond_length is None else {"bond_length": law.bond_length}
        )
    return Moment(
        state.cycle,
        state.depth,
        state.jump_path,
        patch.pressure.sigma_n,
        patch.pressure.gap,
        motion.last.miss,
        values(patch) | motion.last.values | worn,
    )


def _replay_on(asked, model, patch, other, moments) -> tuple:
    """Return (patch, worn depth) on another mesh, or in other strips, by the same slip paths.

    The jumps are the same, too.
    """
    area = areas(asked, other.pieces.interface)

    def path(used) -> np.ndarray:
        """Return a slip path on the nodes and strips of the other patch."""
        if asked.interface.strips is None:
            return np.interp(other.x, patch.x, used)
        rows = np.array([np.interp(other.x, patch.x, row) for row in used])
        y, own = (strips.strip_offsets(asked.pieces.width, len(one)) for one in (area, rows))
        return np.array([np.interp(y, own, column) for column in rows.T]).T

    legs = [(two.cycle - one.cycle, path(two.used)) for one, two in pairwise(moments)]
    depth = replay_jumps(
        make_force_function(asked, other.pair),
        area,
        model.wear.coefficient,
        legs,
        model.wear.compute_earlier_depth(other.x, area),
    )
    return press_patch(asked, other.pair, frozen_array(depth)), depth


def evolved_with(kept, key: str, model, patch, coarse, progress=None) -> Evolved:
    """Wear the patch of a model as `evolve` does, and save the state after every jump.

    Parameters
    ----------
    kept
        Where the state is saved; None: nowhere.
    key : str
        Identifies what the state belongs to.
    model, patch, coarse, progress
        See `evolve`.
    """
    if kept is None:
        return evolve(model, patch, coarse, progress)
    begin = load_state(kept.path, key) if kept.resume else None
    return evolve(model, patch, coarse, progress, begin, partial(save_state, kept.path, key))


def save_state(path: Path, key: str, state: WearState, moments: tuple) -> None:
    """Save a state and the moments so far; an earlier file is replaced atomically.

    Parameters
    ----------
    path : Path
    key : str
        Identifies what the state belongs to.
    state : WearState
    moments : tuple of Moment
    """
    arrays = {f"state_{name}": np.asarray(getattr(state, name)) for name in STATE}
    arrays |= {
        f"moment_{name}": np.array([getattr(moment, name) for moment in moments]) for name in MOMENT
    }
    values = json.dumps([moment.values for moment in moments], default=float)
    with write_atomically(path) as partial, open(partial, "wb") as file:
        np.savez(file, key=np.array(key), values=np.array(values), **arrays)
        file.flush()
        os.fsync(file.fileno())


def nothing_kept(path: Path) -> PatchfemError:
    """Return the error that there is no saved state; path: of the state, in the folder of a run."""
    return PatchfemError(
        f"{path.parent.name.removesuffix('.partial')}: this folder contains no interrupted run; run "
        "without --resume"
    )


def load_state(path: Path, key: str) -> tuple:
    """Return (state, moments) from a saved file.

    Raises
    ------
    PatchfemError
        If it belongs to another scene or cannot be read.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: file[name] for name in file.files}
        if str(found["key"]) != key:
            raise PatchfemError(
                f"{path.parent.name}: the state saved there belongs to another scene or to another "
                "version of patchfem; run without --resume"
            )
        whole = {name: found[f"state_{name}"] for name in STATE}
        state = WearState(
            **{name: float(value) if value.ndim == 0 else value for name, value in whole.items()}
        )
        columns = [found[f"moment_{name}"] for name in MOMENT]
        moments = tuple(
            Moment(float(row[0]), *row[1:-1], float(row[-1]), values)
            for *row, values in zip(*columns, json.loads(str(found["values"])), strict=True)
        )
    except FileNotFoundError:
        raise nothing_kept(path) from None
    except PatchfemError:
        raise
    except Exception as error:  # a damaged archive can fail in many ways
        raise PatchfemError(
            f"{path.parent.name}: the state saved there cannot be read ({error}); run without "
            "--resume"
        ) from None
    return state, moments
