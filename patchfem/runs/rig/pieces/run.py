"""The engine of elastic-plastic elements of a rig: from yield to yield in closed form (`dynamics.piecewise`)."""

from time import perf_counter

import numpy as np

from ....core import BaseSine, NotConverged, Outcome
from ....dynamics.piecewise import elements, histories
from ....dynamics.piecewise.steady import settled
from ....dynamics.piecewise_one.steady import settled_alone
from ....dynamics.second_book import gap, sampled_work
from ....friction.record import law_from
from ....response import run_events
from ....response.levels import Level
from ....response.measures import circular_mean, window_amplitudes, window_ends
from ....response.outcome import steady_of
from ....response.ringing import held_ring
from ....response.rows import measures_of
from ....response.spectrum import wave_measures
from ....structure.drive_sizes import omega_of, sinusoidal, whole
from .. import levels as rig_levels
from ..exact import joined_runs, whole_cycles
from ..interface import contact_model
from ..solution import Solution, seen
from .costs import refuse_endless

CHANGES = 1e-2  # share of the tolerance by which windows may differ in a motion that has settled


def run_piecewise(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Solution of a rig behind elastic-plastic elements; patch: the solved Patch, or None."""
    refuse_endless(model)
    rig, drive, begin = model.rig, model.rig.drive, perf_counter()
    found = Interfaces(model, numerics, patch)
    reduced = perf_counter() - begin
    histories.warm_up(say)
    loaded, begin = perf_counter() - begin - reduced, perf_counter()
    if rig.levels:
        done, levels, probe = _levels(model, numerics, patch, found, frames, progress)
    else:
        done = histories.simulate(rig.modes, drive, found.groups, numerics.cycles, numerics.window, rig.travel, frames,
                                  progress, rig.start)
        levels, probe, done = (), None, whole_cycles(done)
    return solution_of(model, numerics, patch, drive, found, done, perf_counter() - begin, levels=levels, probe=probe,
                       prepare={"reduce": reduced, "compiled_code": loaded})


def solution_of(model, numerics, patch, drive, found, done, seconds: float, **more) -> Solution:
    """The Solution of a PieceRun through Interfaces `found`; more: other fields of it."""
    values = values_of(model, numerics, patch, drive, done)
    if done.ring is None:
        rings, own = run_events.rings(done.window, model.rig.modes, drive, done.log, repeats=done.repeats)
    else:
        rings, own = held_ring(*done.ring, done.acceleration), {}
    outcome = done.outcome or (Outcome.STUCK if found.holds(done) else None)
    amplitudes = window_amplitudes(done.amplitudes, numerics.window)
    steady, bounded = None, False
    if numerics.whole and outcome is None and changes(amplitudes, model.accuracy.tolerance):
        steady = settles(model.rig.modes, drive, found.groups, done)
        bounded = steady is not None
    if steady is None:
        steady = steady_of(drive, *window_ends(done.amplitudes, done.phasors, numerics.window))
    return Solution(values | rings, done.response, done.window, amplitudes, steady, outcome, done.snapshots,
                    done.ledger, seconds, found.contact, log=done.log, held=found.held, own=own,
                    extremes=done.amplitudes, bounded=bounded, **more)


def changes(amplitudes, tolerance: float) -> bool:
    """Whether amplitudes (w,) of successive windows still change by a share of the tolerance, or are too few to say."""
    return amplitudes.size < 3 or np.ptp(amplitudes[-3:]) > CHANGES * tolerance * amplitudes[-1]


def settles(modes, drive, groups, done) -> tuple | None:
    """(amplitude [m], its error) of the stable motion that a run under a sine settles to, by the map of its yields.

    None where the run does not end with a period of a sine, or where no such motion was found.
    """
    last = drive.segments[-1] if drive.segments else None
    if last is None or not sinusoidal(drive) or last.constant != 0 \
            or abs(done.cycles_done - round(done.cycles_done)) > 1e-9:
        return None
    sine = BaseSine(last.amplitude, last.omega, drive.moving)
    found = settled_alone(modes, sine, groups, *done.end)
    if found is None:
        try:
            one = settled(modes, sine, groups, *done.end)
        except NotConverged:
            return None
        found = one.amplitude, one.residual, one.multipliers
    amplitude, error = (float(one[0]) for one in settled_of(*(np.asarray(one)[None] for one in found)))
    return None if np.isnan(amplitude) else (amplitude, error)


def settled_of(amplitude, residual, multipliers) -> tuple:
    """Amplitudes [m] of stable motions and their errors, NaN of others, (n,) each.

    residual (n,): by which they miss to close, over their size; multipliers (n, m) over a period. What it leaves in the
    motion is that over how far they are from 1, and its last digits are rounding.
    """
    apart = np.maximum(np.abs(1 - multipliers).min(axis=1, initial=1.0), 1e-12)
    error = amplitude * np.maximum(1e-9, 10 * residual / apart)
    stable = np.abs(multipliers).max(axis=1, initial=0.0) < 1
    return np.where(stable, amplitude, np.nan), np.where(stable, error, np.nan)


class Interfaces:
    """The elements of every interface of a model, as `groups`; contact: the ContactModel of a single one; held: slip
    [m] below which a cycle sticks."""

    def __init__(self, model, numerics, patch):
        rig, self.contact = model.rig, None
        if len(rig.modes.interfaces) > 1:
            parts = [law_from(one.numbers, one.load).element(one.load) for one in rig.interfaces]
        else:
            self.contact = contact_model(model, numerics, patch)
            parts = [self.contact.element]
        self.held = 1e-3 * min(one.length for one in parts)
        self.groups = tuple(group_of(one) for one in parts)
        for _ in range(numerics.pairs):
            self.groups = tuple(map(elements.paired, self.groups))

    def holds(self, done) -> bool:
        """Whether no interface slips in the window of a run by more than `held`, or the last digit."""
        noise = 1e-13 * float(np.abs(done.window.modal).max(initial=0.0))
        return all(one.slip / 2 <= max(self.held, noise) for one in done.loops)


def group_of(element) -> elements.Elements:
    """Elements of an Element of form "parallel"."""
    count = int(element.numbers[1])
    return elements.elements_of(element.numbers[2:2 + count], element.numbers[2 + count:2 + 2 * count])


def values_of(model, numerics, patch, drive, done) -> dict:
    """Measures of the window of a PieceRun, read off its series."""
    window, span = done.window, done.window.time[-1] - done.window.time[0]
    known = {"absolute_acceleration_peak": done.acceleration, "relative_displacement_amplitude": done.swing,
             "drift_per_cycle": done.drift}
    for k, one in enumerate(done.loops):
        known |= {f"{name}{f'_{k + 1}' * (k > 0)}": value for name, value in _of_interface(one, span).items()}
    if sinusoidal(drive) and whole(span, drive):
        known |= wave_measures(*np.abs(done.waves))
    known["work_check"] = _second_book(done)
    known["slip_start_phase"] = circular_mean(done.starts) if done.starts.size and sinusoidal(drive) else None
    extremes, loop = done.amplitudes[-min(numerics.window, len(done.amplitudes)):], None
    first = done.loops[0]
    if whole(span, drive):
        loop = np.array([first.low, first.high]), first.first, first.pull, first.work * drive.period / span
    found = measures_of(seen(model, patch, window, extremes, done.ledger, histories.SAMPLES, drive=drive, loop=loop,
                             ledger=done.response.extra["ledger"], known=known))
    others = {name: value for name, value in known.items() if name[-1].isdigit()}
    areas = {f"loop_area_{k + 2}": one.work * drive.period / max(span, 1e-300) for k, one in enumerate(done.loops[1:])}
    return found | others | areas


def _second_book(done) -> float:
    """Gap [1] of the friction work of the window: by the trapezoidal rule on its samples against the sum of its
    pieces."""
    w, extra = done.window, done.window.extra
    pairs = zip(extra["slides"].T, extra["forces"].T) if "slides" in extra else [(w.slide, w.force)]
    sampled = sum(float(sampled_work(slide, force).sum()) for slide, force in pairs)
    works = extra["ledger"][0]
    energy = done.ledger["power"] + done.ledger["peak_stored"]
    return gap(sampled, float(works[-1] - works[0]), float(np.abs(np.diff(works)).sum()), energy)


def _of_interface(one, span: float) -> dict:
    """Measures of an interface by name, from its Loop over a window of `span` [s]."""
    return {"slip_amplitude": one.slip / 2, "stick_fraction": stuck_share(one.stuck, span),
            "friction_force_peak": one.force}


def stuck_share(stuck, span):
    """Share of a time span [s] that is stuck [s], 1 but for round-off of the sum of its pieces; numbers or (n,)."""
    return np.where(stuck >= span * (1 - 1e-12), 1.0, stuck / span)[()]


def _levels(model, numerics, patch, found, frames: int, progress) -> tuple:
    """Run of all levels one after the other: (PieceRun, its Levels, probe as `levels.onset` asks)."""
    rig, drive, cycles = model.rig, model.rig.drive, model.rig.level_cycles
    states, parts, levels, last = [(rig.start, None)], [], [], len(rig.levels) - 1

    def go(level, state, watch=None, frames=0):
        sine = BaseSine(level, omega_of(drive), drive.moving)
        return histories.simulate(rig.modes, sine, found.groups, cycles, numerics.window, rig.travel, frames, watch,
                                  *state), sine

    def level_of(level, sine, done) -> Level:
        values = values_of(model, numerics, patch, sine, done)
        kept = {name: values[name] for name in rig_levels.KEPT if name in values}
        return Level(level, found.holds(done), kept, {name: 1e-9 * abs(v) for name, v in kept.items()})

    for k, level in enumerate(rig.levels):
        share = None if progress is None else (lambda part, k=k: progress((k + part) / len(rig.levels)))
        done, sine = go(level, states[-1], share, frames * (k == last))
        levels.append(level_of(level, sine, done))
        parts.append(done)
        states.append(done.end)
        if done.outcome is not None:
            break

    def probe(number, level):
        return level_of(level, *go(level, states[number + 1])[::-1])

    return joined_runs(parts, cycles * drive.period), tuple(levels), probe

