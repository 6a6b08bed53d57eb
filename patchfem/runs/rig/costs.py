"""Predicted cost of the engines of a rig, for the choice of an engine, a plan and a refusal.

In: a Model. Out: CPU seconds, steps, memory (`Cost`), and reasons to march instead of solving
exactly. A run from event to event counts its pieces (intervals of one power series), a run of
high order and a march count their steps; `cost_model` has the seconds of each. The free
vibration of a mode on a stuck element costs pieces only during stick: all the time if the
friction limit exceeds the force of the drive, hardly any if it is half of it.
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
    find_drive_omega,
    find_max_acceleration,
    find_max_frequency_ratio,
    find_min_decay_rate,
    is_sinusoidal,
)
from ..cost import EVENT_CODE, LINEAR_CODE, SMOOTH_CODE, Cost, MemoryPart

if TYPE_CHECKING:
    from ...friction.protocol import Element

# CPU seconds that an exact solution may take if a march, which has errors, takes less.
MAX_EXACT_SECONDS_OVER_MARCH = 5.0
# CPU seconds of an exact solution if no march resolves the modes.
MAX_EXACT_SECONDS_UNRESOLVED = 60.0
MAX_EXACT_SECONDS = 600.0  # CPU seconds of an exact solution above which it is refused
MAX_MARCH_STEPS = 6400  # largest number of steps per cycle that a march chooses by itself
# Exponent of (friction limit / drive force), which gives the expected fraction of the time in stick: a
# limit of half the force was measured to stick for 0.01 of the time.
STICKING_EXPONENT = 6
# Cells are merged in pairs at most this many times: 49 of 769 cells remain, with an error of 2e-4 of
# the motion of a slipping joint.
MAX_MERGES = 4
MERGE_TOLERANCE = 1e-3  # cells are merged MAX_MERGES times at this or a larger tolerance
# Phase [rad] of the fastest vibration in a time interval, as in `dynamics.events.series_kernels`.
MAX_INTERVAL_PHASE = 2.0
MARCH_SETTINGS = (
    "steps_per_cycle",
    "tail",
    "merge",
    "shear_modes",
)  # keys of [accuracy] that ask for a march instead of the smooth engine
# number of decay times of the slowest mode after which a motion repeats to round-off (e^-30)
N_DECAY_TIMES_TO_REPEAT = 30.0
# Largest ratio of the steps of the smooth engine to those of a march: with a larger ratio a march is
# preferred although each of its steps costs more.
MAX_STEP_RATIO = 3.5
# A speed-dependent law is stiff for the fraction exp(STIFF_TIME_EXPONENT (1 - r)) of the time, where r is the drive
# force over the friction limit: measured 0.5 at r = 1.07 and 0.1 at r = 1.26.
STIFF_TIME_EXPONENT = 9.0
# Largest stable step, in relaxation lengths of a state of the friction law.
MAX_STEP_RELAXATION_LENGTHS = 3.0
# engines that keep a fixed number of samples of each of the last cycles, independent of their steps
RESAMPLING_ENGINES = (
    "exact",
    "piecewise",
    "smooth",
)
SAMPLES_PER_CYCLE = 400  # number of samples of a kept cycle, as in `dynamics.cycles`
# Expected reversals per cycle, which are kept from before the last cycles.
REVERSALS_PER_CYCLE = 4.0


class HistoryBytes(NamedTuple):
    """Memory [bytes] per sample, cycle and reversal of the histories that an engine stores.

    Attributes
    ----------
    sample : float
        Bytes per number of a kept sample: window, response and derived arrays. Random records of
        4e5 to 2e6 samples took 0.8 to 1.2 of this.
    cycle : float
        Bytes per cycle of a run: extremes, phasors and positions of all cycles, of the run and of
        its coarse runs. Single modes over 1e6 to 1e7 cycles took 0.8 to 1.3 of this.
    turn : float
        Bytes per number of a reversal that is kept from before the last cycles. Runs of 1e5 to 1e6
        cycles took 0.8 to 1.5 of this.
    """

    sample: float
    cycle: float
    turn: float


EVENT_HISTORY = HistoryBytes(32.0, 85.0, 6.0)
SMOOTH_HISTORY = HistoryBytes(80.0, 140.0, 16.0)
MARCH_HISTORY = HistoryBytes(45.0, 50.0, 18.0)


def required_steps_per_cycle(model: Model) -> int:
    """Return the time steps per cycle that meet the tolerance, without an upper bound."""
    accuracy = model.accuracy
    rig = model.rig
    quickest = max(
        find_max_frequency_ratio(rig.drive.signal),
        float(rig.structure.frequencies.max()) * rig.drive.signal.period,
    )
    if model.load_varies:
        quickest = max(quickest, model.point.frequency * rig.drive.signal.period)
    # the error falls with the square of the step; 400 steps per cycle of the fastest motion give 1e-3
    return 2 * round(200 * sqrt(1e-3 / accuracy.tolerance) * quickest)


def steps_per_cycle(model: Model) -> int:
    """Return the time steps per cycle of a march, from the scene or else from the tolerance.

    The tolerance chooses between 100 and MAX_MARCH_STEPS steps.
    """
    return model.accuracy.steps_per_cycle or min(
        max(required_steps_per_cycle(model), 100), MAX_MARCH_STEPS
    )


def count_merges(model: Model) -> int:
    """Return how often neighbouring slider cells are merged in pairs for the first run.

    The error of cells falls with the square of their width. If the error of the run is too large,
    the run is repeated with more cells (`Numerics.finer`).
    """
    laws = [interface.numbers.law for interface in model.rig.friction.interfaces]
    if (
        model.partial_slip
        or model.rig.friction.has_partial_slip
        or not all(law_has_trait(law, "cells") for law in laws)
    ):
        return 0
    n_merges = MAX_MERGES + log2(model.accuracy.tolerance / MERGE_TOLERANCE) / 2
    return int(min(max(n_merges, 0), MAX_MERGES))


def interface_load(model: Model, interface) -> float:
    """Return the normal load [N] on an interface, by default that of the whole model."""
    return model.nominal_load if interface.load is None else interface.load


@lru_cache(8)
def expected_elements(model: Model) -> tuple:
    """Return the expected number of friction elements and the largest stick stiffness [N/m].

    A rigid element has no spring, and counts as stiffness 0.
    """
    count = 0
    stiff = 0.0
    for interface in model.rig.friction.interfaces:
        load = interface_load(model, interface)
        if law_has_trait(interface.numbers.law, "set-valued"):
            stiffness = inf
            n_elements = 1
        else:
            element = record.make_law(interface.numbers, load).element(load)
            n_elements = int(element.numbers[1]) >> count_merges(model)
            stiffness = float(element.numbers[2 : 2 + int(element.numbers[1])].sum())
        if model.partial_slip or interface.partial_slip:
            patch = interface.patch or model.patch
            stiffness = 1 / (1 / stiffness + 1 / patch.pieces.shear_stiffness)
            n_elements = patch_model.TYPICAL_N_NODES
            if not patch.mesh.is_automatic:
                n_elements = round(patch.pieces.length / patch.uniform_element_size) + 1
        count = count + n_elements
        stiff = max(stiff, stiffness if stiffness < inf else 0.0)
    return count, stiff


def intervals_per_cycle(model: Model) -> float:
    """Return the largest number of time intervals per drive cycle of the event-driven solution."""
    return sum(count_intervals_by_cause(model))


def count_intervals_by_cause(model: Model) -> tuple:
    """Return the intervals per cycle of the event-driven solution, from ringing and from events.

    The intervals due to events include the rows of a recorded drive.
    """
    modes = model.rig.modes
    drive = model.rig.drive.signal
    count, stiff = expected_elements(model)
    made = modal_system.make_modal_system(modes)
    faces = len(made.interfaces)
    damping = made.damping_norm
    rate = damping / 2 + sqrt(
        damping**2 / 4 + made.max_omega_squared + stiff * max(made.inverse_mass, default=0.0)
    )
    rows = 0 if drive.segments else len(drive.breaks) / model.rig.drive.cycles
    ringing = (
        max(rate * drive.period, 2 * pi * find_max_frequency_ratio(drive)) / MAX_INTERVAL_PHASE
    )
    quick = find_max_frequency_ratio(drive)
    events = 2 * max(count, faces) * quick + 2 + rows
    return ringing, events


def max_exact_seconds(model: Model) -> float:
    """Return an upper estimate of the CPU time [s] of an event-driven run.

    The elements are assumed to stick all the time. The choice of an engine is based on this time.
    """
    cycles = model.rig.drive.cycles
    each = cost_model.MAX_PIECE_SECONDS + _extra_interval_seconds(model)
    return (
        each * cycles + cost_model.READ_PIECE_SECONDS * min(cycles, 10.0)
    ) * intervals_per_cycle(model)


def _extra_interval_seconds(model: Model) -> float:
    """Return the CPU time [s] per time interval for modes and interfaces beyond the first."""
    modes = model.rig.modes
    return cost_model.PIECE_MODE_SECONDS * (
        modes.omega.size - 1
    ) + cost_model.PIECE_INTERFACE_SECONDS * max(0, len(modes.interfaces) - 1)


def expected_exact_seconds(model: Model) -> float:
    """Estimate the CPU time [s] of an event-driven run.

    Intervals due to ringing count only for the expected fraction of the time in stick.
    """
    rig = model.rig
    count, stiff = expected_elements(model)
    laws = rig.friction.interfaces
    limit = sum(law.numbers.static * interface_load(model, law) for law in laws)
    push = rig.drive.force or rig.first_mode.mass * find_max_acceleration(rig.drive.signal)
    ringing, events = count_intervals_by_cause(model)
    share = min(1.0, limit / push) ** STICKING_EXPONENT if stiff and push else 1.0
    return (
        (
            cost_model.PIECE_SECONDS
            + _extra_interval_seconds(model)
            + cost_model.PIECE_ELEMENT_SECONDS * count
        )
        * (ringing * share + events)
        * rig.drive.cycles
    )


def expected_march_seconds(model: Model) -> float:
    """Estimate the CPU time [s] of a march with the coarse runs of its error estimate."""
    count = expected_elements(model)[0]
    many = len(model.rig.friction.interfaces)
    step = cost_model.STEP_SECONDS + cost_model.STEP_ELEMENT_SECONDS * count
    return (
        1.75
        * model.rig.drive.cycles
        * (cost_model.CYCLE_SECONDS + steps_per_cycle(model) * many * step)
    )


def reason_to_march_events(model: Model) -> str:
    """Return the reason why a model is integrated in time steps instead of event by event.

    The events cost more than time steps, and more than an exact solution is worth. The reason is ""
    if the model is better solved from event to event.
    """
    if required_steps_per_cycle(model) > MAX_MARCH_STEPS:
        max_seconds = MAX_EXACT_SECONDS_UNRESOLVED
    else:
        max_seconds = max(MAX_EXACT_SECONDS_OVER_MARCH, expected_march_seconds(model))
    if max_exact_seconds(model) <= max_seconds:
        return ""
    return "time steps are faster than the exact solution"


def reason_to_march_elements(model: Model) -> str:
    """Return the reason why a model with friction elements needs time steps, or "".

    The scene prescribes the steps, or the reason is that of `reason_to_march_events`.
    """
    if model.accuracy.steps_per_cycle is not None:
        return "accuracy.steps_per_cycle is set"
    return reason_to_march_events(model)


def refuse_long_exact_run(model: Model, numerics=None) -> None:
    """Raise Missing if an event-driven run would take more CPU time than is allowed."""
    seconds = max_exact_seconds(model)
    if seconds > MAX_EXACT_SECONDS:
        march = ', or use accuracy.method = "march"' * (expected_march_seconds(model) < seconds)
        raise Missing(
            f"the exact solution (about {intervals_per_cycle(model):.2g} time intervals per cycle, set by "
            "events, rows of the drive and the fastest free vibration) would need a computing time of about "
            f"{seconds:.0f} s, more than the limit of {MAX_EXACT_SECONDS:.0f} s; lower drive.cycles or the stiffness "
            f"of modes and elements{march}",
            "",
        )


def predict_exact_cost(model: Model, numerics, points: int) -> Cost:
    """Return the predicted cost of an event-driven run.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    points : int
        Nodes of the interface; not used.
    """
    steps = int(intervals_per_cycle(model) * numerics.cycles)
    times = {
        "motion": expected_exact_seconds(model),
        "histories": cost_model.KEPT_EVENT_SAMPLE_SECONDS * count_kept_samples(numerics),
    }
    code = EVENT_CODE if model.rig.friction.interfaces else LINEAR_CODE
    if _interpreted_seconds(model) <= compiled.MAX_PYTHON_SECONDS:
        # a run in interpreted Python takes 86 MB without machine code, and 152 MB with it, because
        # machine code loads the LLVM library
        if not _is_event_loop_cached(model):
            code = code._replace(bytes=0.0)
        loading = replace(code.cost(), compile_seconds=0.0)
    else:
        loading = code.cost()
    return Cost(times, history_memory_parts(model, numerics, EVENT_HISTORY), (), steps) + loading


def _interpreted_seconds(model: Model) -> float:
    """Estimate the CPU time [s] of an event-driven run in interpreted Python.

    Cells of a slider density are not merged.
    """
    count, stiffness = expected_elements(model)
    each = events_cost.estimate_cycle_time(
        model.rig.modes, model.rig.drive.signal, stiffness, count if stiffness else 0
    )
    return model.rig.drive.cycles * each * 2 ** count_merges(model)


def _is_event_loop_cached(model: Model) -> bool:
    """Return whether the compiled event loop for the number of modes of a rig is cached."""
    from ...dynamics.events.histories import (
        is_loop_cached,  # imported here because a plan does not need the engine otherwise
    )

    return is_loop_cached(model.rig.modes, model.rig.drive.signal)


def count_kept_samples(numerics) -> float:
    """Return the number of samples of the last cycles that a run stores."""
    each = SAMPLES_PER_CYCLE if numerics.engine in RESAMPLING_ENGINES else numerics.steps
    return float(max(2, numerics.window) * each)


def history_memory_parts(model: Model, numerics, history: HistoryBytes) -> tuple[MemoryPart, ...]:
    """Return the memory of the histories that a run stores, by contribution.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    history : HistoryBytes
    """
    rig = model.rig
    samples = count_kept_samples(numerics)
    width = 2.0 * len(rig.structure.frequencies) + 12 + 6 * len(rig.friction.interfaces)
    length_key = "drive.duration" if rig.drive.waveform.is_random else "drive.cycles"
    key = "accuracy.steps_per_cycle" if model.accuracy.steps_per_cycle else length_key
    turns = min(REVERSALS_PER_CYCLE * rig.drive.cycles, checkpoint.MAX_EARLY_SAMPLES)
    early = history.cycle * rig.drive.cycles + history.turn * width * turns
    return (
        MemoryPart(
            history.sample * width * samples, f"{samples:.0f} samples of the last cycles", key
        ),
        MemoryPart(early, f"the histories of {rig.drive.cycles:.3g} cycles", length_key),
    )


def describe_element_engine(model: Model, engine: str) -> list:
    """Return the sentence of a plan on the engine of friction elements and its CPU time."""
    count = expected_elements(model)[0]
    exact = expected_exact_seconds(model)
    march = expected_march_seconds(model)
    return [
        f"{count} element{'s' * (count > 1)} by engine {engine}; computing time: about {exact:.2g} s with the "
        f"exact solution between yield events, about {march:.2g} s with time steps at this tolerance"
    ]


def reason_to_march_smooth_law(model: Model) -> str:
    """Return the reason why a smooth law needs the march instead of the smooth engine, or ""."""
    rig = model.rig
    accuracy = model.accuracy
    for key in MARCH_SETTINGS:
        if getattr(accuracy, key) is not None:
            return f"with accuracy.{key}"
    if accuracy.quadrature not in ("auto", "recursion"):
        return "with accuracy.quadrature"
    if len(rig.modes.interfaces) > 1:
        return "with other forces"
    if model.side == "lower" and law_has_trait(model.friction.law, "bonds"):
        return "under a pressure that stays"
    element = make_smooth_element(model)
    if element is None or element.state_scales is None:
        return f"for law '{model.friction.law}'"
    if smooth_steps_per_cycle(model, element) > MAX_STEP_RATIO * max(steps_per_cycle(model), 400):
        return "in so many steps"
    return ""


def make_smooth_element(model: Model) -> "Element | None":
    """Return the friction law of the interface as an Element for the smooth engine.

    The result is None if the bonds are summed in a list, or if the law averages the friction over
    the pressure of all points.
    """
    f = model.friction
    load = model.nominal_load
    if law_has_trait(f.law, "averaged"):
        return None
    if not law_has_trait(f.law, "bonds"):
        return record.make_law(f, load).element(load)
    if engines.unsupported_reason("recursion", f.reading, 1.0 if f.order is None else f.order):
        return None
    return stretch.points_element(model.bonds, [1.0], [load])


def smooth_steps_per_cycle(model: Model, element: "Element") -> float:
    """Estimate the steps per cycle of the smooth engine.

    It is proportional to the phase of the fastest motion, plus steps at every reversal, plus the
    steps that keep the states of a law with a short relaxation length stable.
    """
    rig = model.rig
    modes = model.rig.modes
    omega = find_drive_omega(rig.drive.signal)
    period = rig.drive.signal.period
    damper = modes.damping_matrix
    pace = max(
        float(modes.omega.max()),
        float(np.abs(damper).sum(axis=1).max()),
        omega * find_max_frequency_ratio(rig.drive.signal),
    )
    ease = float((modes.slide**2).sum()) / modes.mass
    rigid = 0.0
    if not element.length:
        slope = element.limit / model.friction.reference_speed
        rigid = slope * ease * stiff_time_fraction(model, element)
    path = 4 * model.speed_scale / omega
    states = path / element.length if element.state_scales and element.length else 0.0
    grown = model.friction.slip_growth if law_has_trait(model.friction.law, "bonds") else None
    if grown:
        states = max(states, path / grown)
    return 24 + 1.2 * pace * period + (states + rigid * period) / MAX_STEP_RELAXATION_LENGTHS


def stiff_time_fraction(model: Model, element: "Element") -> float:
    """Return the fraction [1] of time in which a speed-dependent law makes the equations stiff.

    With a single mode it is 1 up to a ratio 1 of the drive force to the friction limit, and less
    above it; with several modes it is 1.
    """
    rig = model.rig
    modes = model.rig.modes
    if modes.omega.size > 1 or not modes.slide[0]:
        return 1.0
    if not element.limit:
        return 0.0
    r = (
        modes.mass
        * find_max_acceleration(rig.drive.signal)
        * abs(modes.base[0] / modes.slide[0])
        / element.limit
    )
    return min(1.0, float(np.exp(STIFF_TIME_EXPONENT * (1 - r))))


def predict_smooth_cost(model: Model, numerics, points: int) -> Cost:
    """Predict the cost of a run of the smooth engine, including its coarse run.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    points : int
        Nodes of the interface; not used.
    """
    rig = model.rig
    cycles = model.rig.drive.cycles
    # the cycles after the motion has become periodic are not computed
    if (
        is_sinusoidal(rig.drive.signal)
        and (decay := find_min_decay_rate(rig.modes) * rig.drive.signal.period) > 0
    ):
        cycles = min(cycles, 20 + N_DECAY_TIMES_TO_REPEAT / decay)
    steps = 2 * cycles * smooth_steps_per_cycle(model, make_smooth_element(model))
    times = {
        "motion": cost_model.SMOOTH_RUN_SECONDS + cost_model.SMOOTH_STEP_SECONDS * steps,
        "histories": cost_model.KEPT_SAMPLE_SECONDS * count_kept_samples(numerics),
    }
    return (
        Cost(times, history_memory_parts(model, numerics, SMOOTH_HISTORY), (), int(steps))
        + SMOOTH_CODE.cost()
    )
