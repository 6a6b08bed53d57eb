"""The engine of elastic-plastic elements of a rig: from yield to yield in closed form (`dynamics.piecewise`)."""

from time import perf_counter

import numpy as np

from ....core import BaseSine, NotConverged
from ....dynamics.integrated import Integrated
from ....dynamics.piecewise import elements, histories
from ....dynamics.piecewise.steady import settled
from ....friction.record import law_from
from ....response import run_events
from ....response.measures import window_amplitudes
from ....response.ringing import held_ring
from ....structure.drive_sizes import largest, sinusoidal, whole
from ..interface import contact_model
from ..levels import by_levels, whole_cycles
from ..reading import Reader
from ..solution import Solution, stiffness_of
from .costs import refuse_endless
from .values import read_off

CHANGES = 1e-2  # share of the tolerance by which windows may differ in a motion that has settled


def run_piecewise(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Solution of a rig behind elastic-plastic elements; patch: the solved Patch, or None."""
    refuse_endless(model)
    rig, begin, more = model.rig, perf_counter(), {}
    found = Interfaces(model, numerics, patch)
    reduced = perf_counter() - begin
    histories.warm_up(say)
    loaded, begin = perf_counter() - begin - reduced, perf_counter()
    reader = Pieces(model, numerics, patch, found)

    def go(drive, state, watch, last: bool, cycles: float = rig.level_cycles):
        return histories.simulate(rig.modes, drive, found.groups, cycles, numerics.window, rig.travel, frames * last,
                                  watch, *state)

    if rig.levels:
        done, more = by_levels(reader, go, (rig.start, None), lambda run: run.end, progress)
    else:
        done = whole_cycles(go(rig.drive, (rig.start, None), progress, True, numerics.cycles))
    return reader.solution(done, perf_counter() - begin, prepare={"reduce": reduced, "compiled_code": loaded}, **more)


class Pieces(Reader):
    """What a finished run from yield to yield shows, through Interfaces `found`."""

    def __init__(self, model, numerics, patch, found):
        super().__init__(model, numerics, patch, found.contact, found.held, histories.SAMPLES)
        self.groups = found.groups

    def integrated(self, run, drive) -> Integrated:
        """The loops of the interfaces; what else the series of the pieces give stands in `more`."""
        return Integrated(loops=run.loops)

    def more(self, run, drive, stuck: bool) -> dict:
        """What the series of the pieces give, by name."""
        found = read_off(run.reading, run.ledger, sinusoidal(drive), bool(whole(run.reading.span, drive)),
                         stiffness_of(self.model, run.window), largest(drive))
        return {"known": {name: None if np.isnan(value) else float(value) for name, value in found.items()}}

    def rings(self, run, drive) -> tuple:
        """What rings is known in closed form of a single element, and of a motion that repeats by one of its cycles."""
        if run.ring is not None:
            return held_ring(*run.ring, run.acceleration), {}
        return run_events.rings(run.window, self.model.rig.modes, drive, run.log, repeats=run.repeats)

    def own(self, run, drive, values: dict) -> dict:
        """What samples leave open of the measures that no sum over the pieces has."""
        return self.sampled(run, drive, values)

    def solution(self, run, seconds: float, drive=None, **more) -> Solution:
        """The Solution of a PieceRun; where its windows still change, with the motion that it settles to."""
        drive, numerics = drive or self.model.rig.drive, self.numerics
        unsettled = changes(window_amplitudes(run.amplitudes, numerics.window), self.model.accuracy.tolerance)
        if numerics.whole and run.outcome is None and not self.sticks(run) and unsettled:
            steady = settles(self.model.rig.modes, drive, self.groups, run)
            more |= {} if steady is None else {"steady": steady, "bounded": True}
        return super().solution(run, seconds, drive, **more)


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
    try:
        one = settled(modes, sine, groups, *done.end)
    except NotConverged:
        return None
    amplitude, error = settled_of(one.amplitude, one.residual, one.multipliers)
    return None if np.isnan(amplitude) else (amplitude, error)


def settled_of(amplitude: float, residual: float, multipliers) -> tuple:
    """Amplitude [m] of a stable motion and its error, NaN of another.

    residual: by which it misses to close, over its size; multipliers (m,) over a period. What it leaves in the motion
    is that over how far they are from 1, and its last digits are rounding.
    """
    if np.abs(multipliers).max(initial=0.0) >= 1:
        return np.nan, np.nan
    apart = max(float(np.abs(1 - multipliers).min(initial=1.0)), 1e-12)
    return float(amplitude), float(amplitude * max(1e-9, 10 * residual / apart))


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


def group_of(element) -> elements.Elements:
    """Elements of an Element of form "parallel"."""
    count = int(element.numbers[1])
    return elements.elements_of(element.numbers[2:2 + count], element.numbers[2 + count:2 + 2 * count])
