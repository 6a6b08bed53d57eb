"""What the engines of a rig cost, before anything runs, for the choice of an engine, a plan and a refusal.

A run from event to event counts its pieces, one of high order and a march their steps; `rates` has the seconds of
each. A spring that an element holds by rings on, which costs pieces only while it holds: all the time where the
friction limit exceeds the push of the drive, hardly any where it is half of it.
"""

from dataclasses import replace
from functools import lru_cache
from math import inf, log2, pi, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ... import compiled, cost_model
from ...core import Missing
from ...dynamics import checkpoint
from ...dynamics.events import cost as events_cost
from ...dynamics.events import modal_system
from ...effects import law_has_trait
from ...friction import record
from ...friction.bonds import engines
from ...friction.laws import stretch
from ...model import patch as patch_model
from ...model.model import Model
from ...structure.drive_sizes import (
    drive_omega,
    is_sinusoidal,
    max_acceleration,
    max_frequency_ratio,
    min_decay_rate,
)
from ..cost import EVENT_CODE, LINEAR_CODE, SMOOTH_CODE, Cost, MemoryPart

if TYPE_CHECKING:
    from ...friction.protocol import Element

WORTH = 5.0  # that an exact motion may take where steps would take less, and be off by their bars
PATIENCE = 60.0  # that it may take where the finest march does not resolve the modes
LONGEST = 600.0  # seconds that an exact motion may take before it is refused
MOST_STEPS = 6400  # finest automatic march, steps per cycle
HELD = 6  # power of the limit over the push that gives the share of the time in which an element holds (measured .01)
# 49 of 769 cells at this tolerance and above: 2e-4 of the motion behind a joint that slips
MOST_PAIRS, AT = (
    4,
    1e-3,
)
REACH = 2.0  # radians of the fastest rate in a piece, of `dynamics.events.series_kernels`
DYING = 33.0  # times of decay until what rings after an event is round-off, `dynamics.events.slow_kernels`
PINNED = ("steps_per_cycle", "tail", "merge", "shear_modes")  # knobs of the march
# times of decay of the slowest mode, after which a motion is seen to repeat to its digits
REPEATS = 30.0
MORE = 3.5  # times the steps of a march, of which more are not worth their digits: a step costs less than one of it
EASES = 9.0  # steps of a stiff law of the speed per cycle, over those of one that holds: .5 at r = 1.07, .1 at 1.26
STABLE = 3.0  # times the length over which a state of a law relaxes, in a step
# engines that keep SAMPLES of each of the last cycles, not their steps
RESAMPLED = (
    "exact",
    "piecewise",
    "smooth",
)
SAMPLES = 400  # of a kept cycle, of `dynamics.events.histories` and `dynamics.smooth`
TURNS = 4.0  # turns a cycle that are kept from before the last cycles


class HistoryBytes(NamedTuple):
    """Memory of the histories of an engine.

    Attributes
    ----------
    sample : float
        Bytes per number of a kept sample: the window, the response and what is read off it. Random records of 4e5 to
        2e6 samples took 0.8 to 1.2 of this.
    cycle : float
        Bytes per cycle of a run: extremes, phasors and places of all cycles, of the run and of its coarser runs. Single
        modes over 1e6 to 1e7 cycles took 0.8 to 1.3 of this.
    turn : float
        Bytes per number of a turn that is kept from before the last cycles. Runs of 1e5 to 1e6 cycles took 0.8 to 1.5
        of this.
    """

    sample: float
    cycle: float
    turn: float


EVENT_HISTORY = HistoryBytes(32.0, 85.0, 6.0)
SMOOTH_HISTORY = HistoryBytes(80.0, 140.0, 16.0)
MARCH_HISTORY = HistoryBytes(45.0, 50.0, 18.0)


def steps_wanted(model: Model) -> int:
    """Steps per cycle that the tolerance asks of a march, however many."""
    accuracy, rig = model.accuracy, model.rig
    quickest = max(
        max_frequency_ratio(rig.drive.signal),
        float(rig.structure.frequencies.max()) * rig.drive.signal.period,
    )
    if model.load_varies:
        quickest = max(quickest, model.point.frequency * rig.drive.signal.period)
    # errors fall with the square of the step; 400 steps per cycle of the fastest motion give about 1e-3
    return 2 * round(200 * sqrt(1e-3 / accuracy.tolerance) * quickest)


def steps_per_cycle(model: Model) -> int:
    """Steps per cycle of a march: those of the scene, else what the tolerance asks for, within its bounds."""
    return model.accuracy.steps_per_cycle or min(max(steps_wanted(model), 100), MOST_STEPS)


def pairs_of(model: Model) -> int:
    """How often each two cells of a density count as one at first: what cells leave open falls with their square, and
    where the error of a run shows too much it is made again with more (`Numerics.finer`)."""
    laws = [one.numbers.law for one in model.rig.friction.interfaces]
    if (
        model.partial_slip
        or model.rig.friction.has_partial_slip
        or not all(law_has_trait(law, "cells") for law in laws)
    ):
        return 0
    return int(min(max(MOST_PAIRS + log2(model.accuracy.tolerance / AT) / 2, 0), MOST_PAIRS))


@lru_cache(8)
def expected_elements(model: Model) -> tuple:
    """(elements, stiffness [N/m] of those of the stiffest interface) that the interfaces of a rig have, estimated; a
    rigid element has no spring to ring on."""
    count, stiff = 0, 0.0
    for one in model.rig.friction.interfaces:
        load = model.nominal_load if one.load is None else one.load
        if law_has_trait(one.numbers.law, "set-valued"):
            most, mine = inf, 1
        else:
            element = record.law_from(one.numbers, load).element(load)
            mine = int(element.numbers[1]) >> pairs_of(model)
            most = float(element.numbers[2 : 2 + int(element.numbers[1])].sum())
        if model.partial_slip or one.partial_slip:
            patch = one.patch or model.patch
            most = 1 / (1 / most + 1 / patch.pieces.shear_stiffness)
            mine = patch_model.TYPICAL_POINTS
            if not patch.mesh.is_automatic:
                mine = round(patch.pieces.length / patch.even_element_size) + 1
        count, stiff = count + mine, max(stiff, most if most < inf else 0.0)
    return count, stiff


def pieces_per_cycle(model: Model) -> float:
    """Pieces of the motion per cycle of the drive at most: of its fastest rate while all holds, and of every event."""
    return sum(ringing_and_events(model))


def ringing_and_events(model: Model) -> tuple:
    """Pieces per cycle of a motion whose elements hold all the time, and those of every event and row."""
    modes, drive = model.rig.modes, model.rig.drive.signal
    (count, stiff), made = expected_elements(model), modal_system.plant_of(modes)
    faces, damping = len(made.faces), made.damping_most
    rate = damping / 2 + sqrt(
        damping**2 / 4 + made.square_most + stiff * max(made.reach, default=0.0)
    )
    rows = 0 if drive.segments else len(drive.breaks) / model.rig.drive.cycles
    ringing, quick = (
        max(rate * drive.period, 2 * pi * max_frequency_ratio(drive)) / REACH,
        max_frequency_ratio(drive),
    )
    events = 2 * max(count, faces) * quick + 2 + rows
    if 2 * pi * quick <= made.slow * drive.period:
        dying = DYING / min(min_decay_rate(modes), float(modes.omega.min()) ** 2 / damping)
        # that it rings
        times = (
            events + _jumps(model) if model.rig.friction.interfaces else 1 / model.rig.drive.cycles
        )
        ringing = min(ringing, times * dying * rate / REACH + 4 * quick)
    return ringing, events


def _jumps(model: Model) -> float:
    """Slips per cycle of a slow drive that end early as static friction falls to kinetic, at most."""
    falls = [
        (one.numbers.static - one.numbers.kinetic)
        * (model.nominal_load if one.load is None else one.load)
        for one in model.rig.friction.interfaces
        if one.numbers.kinetic is not None
    ]
    drive_force = model.rig.first_mode.mass * max_acceleration(model.rig.drive.signal)
    return sum(2 * drive_force / fall for fall in falls if fall > 0)


def seconds_of_pieces(model: Model) -> float:
    """Seconds of a run from event to event at most, by which its engine is chosen: all holds all the time."""
    cycles, each = model.rig.drive.cycles, cost_model.MAX_PIECE_SECONDS + _of_size(model)
    return (each * cycles + cost_model.READ_PIECE_SECONDS * min(cycles, 10.0)) * pieces_per_cycle(
        model
    )


def _of_size(model: Model) -> float:
    """Seconds of a piece of several modes and interfaces besides that of one."""
    modes = model.rig.modes
    return cost_model.PIECE_MODE_SECONDS * (
        modes.omega.size - 1
    ) + cost_model.PIECE_INTERFACE_SECONDS * max(0, len(modes.interfaces) - 1)


def expected_seconds(model: Model) -> float:
    """Seconds of a run from event to event as a plan counts them: what rings while an element holds is passed in the
    share of the time in which it does."""
    rig, (count, stiff) = model.rig, expected_elements(model)
    limit = sum(
        one.numbers.static * (model.nominal_load if one.load is None else one.load)
        for one in rig.friction.interfaces
    )
    push = rig.drive.force or rig.first_mode.mass * max_acceleration(rig.drive.signal)
    ringing, events = ringing_and_events(model)
    share = min(1.0, limit / push) ** HELD if stiff and push else 1.0
    return (
        (cost_model.PIECE_SECONDS + _of_size(model) + cost_model.PIECE_ELEMENT_SECONDS * count)
        * (ringing * share + events)
        * rig.drive.cycles
    )


def seconds_of_steps(model: Model) -> float:
    """Estimated seconds of a march with the coarser runs of its error, which has none of the exactness."""
    count, many = expected_elements(model)[0], len(model.rig.friction.interfaces)
    step = cost_model.STEP_SECONDS + cost_model.STEP_ELEMENT_SECONDS * count
    return (
        1.75
        * model.rig.drive.cycles
        * (cost_model.CYCLE_SECONDS + steps_per_cycle(model) * many * step)
    )


def dear_events(model: Model) -> str:
    """Why the march is to run what the engine of events takes: its events cost more than steps and more than an exact
    motion is worth."""
    worth = PATIENCE if steps_wanted(model) > MOST_STEPS else max(WORTH, seconds_of_steps(model))
    return (
        "time steps are faster than the exact solution" if seconds_of_pieces(model) > worth else ""
    )


def dear_elements(model: Model) -> str:
    """Why the march is to run elements that stick or slip: the scene names its steps, or as of `dear_events`."""
    return (
        "accuracy.steps_per_cycle is set"
        if model.accuracy.steps_per_cycle is not None
        else dear_events(model)
    )


def refuse_endless(model: Model, numerics=None) -> None:
    """Raise Missing when a run from event to event would take longer than LONGEST seconds."""
    seconds = seconds_of_pieces(model)
    if seconds > LONGEST:
        march = ', or use accuracy.method = "march"' * (seconds_of_steps(model) < seconds)
        raise Missing(
            f"the exact solution (about {pieces_per_cycle(model):.2g} time intervals per cycle, set by "
            "events, rows of the drive and the fastest free vibration) would need a computing time of about "
            f"{seconds:.0f} s, more than the limit of {LONGEST:.0f} s; lower drive.cycles or the stiffness "
            f"of modes and elements{march}",
            "",
        )


def exact_cost(model: Model, numerics, points: int) -> Cost:
    """Return the cost of a run from event to event."""
    steps = int(pieces_per_cycle(model) * numerics.cycles)
    times = {
        "motion": expected_seconds(model),
        "histories": cost_model.KEPT_EVENT_SAMPLE_SECONDS * kept_samples(numerics),
    }
    code = EVENT_CODE if model.rig.friction.interfaces else LINEAR_CODE
    if _python_seconds(model) <= compiled.PATIENCE:
        # without machine code such a run takes 86 MB; with it 152 MB, because it loads the library of LLVM
        loading = replace(
            (code if _is_loop_kept(model) else code._replace(bytes=0.0)).cost(), compile_seconds=0.0
        )
    else:
        loading = code.cost()
    return Cost(times, history_parts(model, numerics, EVENT_HISTORY), (), steps) + loading


def _python_seconds(model: Model) -> float:
    """Return the CPU seconds of a run from event to event as Python, with all cells of a density."""
    count, stiffness = expected_elements(model)
    each = events_cost.python_seconds(
        model.rig.modes, model.rig.drive.signal, stiffness, count if stiffness else 0
    )
    return model.rig.drive.cycles * each * 2 ** pairs_of(model)


def _is_loop_kept(model: Model) -> bool:
    """Return whether machine code of the loop from event to event is kept for the modes of a rig."""
    from ...dynamics.events.histories import (
        is_loop_kept,  # a plan does not load the engine otherwise
    )

    return is_loop_kept(model.rig.modes, model.rig.drive.signal)


def kept_samples(numerics) -> float:
    """Return how many samples of the last cycles a run keeps."""
    each = SAMPLES if numerics.engine in RESAMPLED else numerics.steps
    return float(max(2, numerics.window) * each)


def history_parts(model: Model, numerics, history: HistoryBytes) -> tuple[MemoryPart, ...]:
    """Return the memory of the last cycles and of what is kept of all others."""
    rig, samples = model.rig, kept_samples(numerics)
    width = 2.0 * len(rig.structure.frequencies) + 12 + 6 * len(rig.friction.interfaces)
    length_key = "drive.duration" if rig.drive.waveform.is_random else "drive.cycles"
    key = "accuracy.steps_per_cycle" if model.accuracy.steps_per_cycle else length_key
    turns = min(TURNS * rig.drive.cycles, checkpoint.MOST_KEPT)
    early = history.cycle * rig.drive.cycles + history.turn * width * turns
    return (
        MemoryPart(
            history.sample * width * samples, f"{samples:.0f} samples of the last cycles", key
        ),
        MemoryPart(early, f"the histories of {rig.drive.cycles:.3g} cycles", length_key),
    )


def exact_words(model: Model, engine: str) -> list:
    """The sentence of a plan on which engine takes the elements, and why."""
    count, exact, march = (
        expected_elements(model)[0],
        expected_seconds(model),
        seconds_of_steps(model),
    )
    return [
        f"{count} element{'s' * (count > 1)} by engine {engine}; computing time: about {exact:.2g} s with the "
        f"exact solution between yield events, about {march:.2g} s with time steps at this tolerance"
    ]


def not_smooth(model: Model) -> str:
    """Why a rig that the smooth engine may take is marched rather than integrated at high order; empty where it is not."""
    rig, accuracy = model.rig, model.accuracy
    pinned = next((f"accuracy.{key}" for key in PINNED if getattr(accuracy, key) is not None), "")
    if pinned or accuracy.quadrature not in ("auto", "recursion"):
        return f"with {pinned or 'accuracy.quadrature'}"
    if len(rig.modes.interfaces) > 1:
        return "with other forces"
    if model.side == "lower" and law_has_trait(model.friction.law, "bonds"):
        return "under a pressure that stays"
    element = smooth_element(model)
    if element is None or element.sizes is None:
        return f"for law '{model.friction.law}'"
    return (
        "in so many steps"
        if smooth_steps(model, element) > MORE * max(steps_per_cycle(model), 400)
        else ""
    )


def smooth_element(model: Model) -> "Element | None":
    """The law of the interface as compiled code takes it, None where its bonds have no state or it asks for the
    pressure behind each point."""
    f = model.friction
    load = model.nominal_load
    if law_has_trait(f.law, "averaged"):
        return None
    if not law_has_trait(f.law, "bonds"):
        return record.law_from(f, load).element(load)
    if engines.impossible("recursion", f.reading, 1.0 if f.order is None else f.order):
        return None
    return stretch.points_element(model.bonds, [1.0], [load])


def smooth_steps(model: Model, element: "Element") -> float:
    """Steps per cycle to expect: some per radian of the fastest motion, some at every reversal, and those that keep a
    state of the law which relaxes over a short path or time stable."""
    rig, modes = model.rig, model.rig.modes
    omega, period = drive_omega(rig.drive.signal), rig.drive.signal.period
    damper = modes.damping if modes.damping is not None else np.diag(2 * modes.zeta * modes.omega)
    pace = max(
        float(modes.omega.max()),
        float(np.abs(damper).sum(axis=1).max()),
        omega * max_frequency_ratio(rig.drive.signal),
    )
    ease = float((modes.slide**2).sum()) / modes.mass
    rigid = (
        0.0
        if element.length
        else element.limit / model.friction.reference_speed * ease * clings(model, element)
    )
    path = 4 * model.speed_scale / omega
    states = path / element.length if element.sizes and element.length else 0.0
    grown = model.friction.slip_growth if law_has_trait(model.friction.law, "bonds") else None
    if grown:
        states = max(states, path / grown)
    return 24 + 1.2 * pace * period + (states + rigid * period) / STABLE


def clings(model: Model, element: "Element") -> float:
    """Share [1] of the time that a law of the speed spends at speeds over which it turns, where it is stiff.

    One mode is held all the time by a force r of the limit up to 1, and less of the time the more is left to slide.
    """
    rig, modes = model.rig, model.rig.modes
    if modes.omega.size > 1 or not modes.slide[0]:
        return 1.0
    if not element.limit:
        return 0.0
    r = (
        modes.mass
        * max_acceleration(rig.drive.signal)
        * abs(modes.base[0] / modes.slide[0])
        / element.limit
    )
    return min(1.0, float(np.exp(EASES * (1 - r))))


def smooth_cost(model: Model, numerics, points: int) -> Cost:
    """Return the cost of all runs of high order."""
    rig, cycles = model.rig, model.rig.drive.cycles
    # then it repeats
    if (
        is_sinusoidal(rig.drive.signal)
        and (decay := min_decay_rate(rig.modes) * rig.drive.signal.period) > 0
    ):
        cycles = min(cycles, 20 + REPEATS / decay)
    steps = 2 * cycles * smooth_steps(model, smooth_element(model))
    times = {
        "motion": cost_model.SMOOTH_RUN_SECONDS + cost_model.SMOOTH_STEP_SECONDS * steps,
        "histories": cost_model.KEPT_SAMPLE_SECONDS * kept_samples(numerics),
    }
    return (
        Cost(times, history_parts(model, numerics, SMOOTH_HISTORY), (), int(steps))
        + SMOOTH_CODE.cost()
    )
