"""The exact engine of a rig: Coulomb friction from event to event, one mode under sines by its own fast engine."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ...core import Start
from ...dynamics.events.histories import simulate
from ...dynamics.integrated import Integrated, Loop
from ...dynamics.one_mode import sdof
from ...dynamics.second_book import sampled_work
from ...effects import has
from ...response import run_events
from ...response.events import stuck_time
from ...response.measures import harmonic, swing
from ...structure.drive_sizes import omega_of, whole
from ..bench.averaged import limit_share
from .levels import by_levels, whole_cycles
from .reading import Reader
from .solution import Solution, borne
from .strips import as_one, strip_loads

SAMPLES = 400  # of a cycle


def run_exact(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Solution of a Coulomb rig, or of a structure without friction.

    patch: the solved Patch, or None under [normal] or between masses.
    """
    rig, begin, forces, found = model.rig, perf_counter(), forces_of(model, patch), {}
    reader = Exact(model, numerics, patch, steps=SAMPLES)
    if rig.levels:
        done, found = by_levels(reader, lambda sine, state, watch, last: _go(
            rig, sine, forces, rig.level_cycles, numerics.window, state, watch, say), rig.start, _end, progress)
    else:
        done = _go(rig, rig.drive, forces, numerics.cycles, numerics.window, rig.start, progress, say)
        done = whole_cycles(_over_strips(done, patch) if rig.strips_slide_apart else done)
    return reader.solution(done, perf_counter() - begin, **found)


def _end(done) -> Start:
    """Where a run ended."""
    return Start(done.response.modal[-1], done.response.modal_rate[-1])


class Exact(Reader):
    """What a finished run from event to event shows."""

    def sticks(self, run) -> bool:
        """Whether no interface slips at all."""
        span = run.window.time[-1] - run.window.time[0]
        return self.rubs and run.stick >= span * (1 - 1e-12) and not any(
            run_events.moving(run.window, self.model.rig.drive, run.log)[1:])

    def integrated(self, run, drive) -> Integrated:
        """What the events and the quadrature between them give."""
        apart, whole_run = self.model.rig.strips_slide_apart, abs(run.cycles_done - round(run.cycles_done)) <= 1e-9
        span, drift = run.window.time[-1] - run.window.time[0], None
        cycles = span / drive.period
        if run.means is not None and not apart and cycles >= 1.5:
            drift = (run.means[1] - run.means[0]) / (cycles - 1)
        known = Integrated(None if whole_run else swing(run.window),  # the cycles are counted from the start
                           run.acceleration, drift, None if run.waves is None else tuple(np.abs(run.waves)))
        if not self.rubs:
            return known
        loops = (_first(run, drive, span, apart), *(() if apart else _others(run)))
        return replace(known, loops=loops, starts=run.starts, books=None if apart else _books(run))

    def more(self, run, drive, stuck: bool) -> dict:
        """The ledger, all of which is lost."""
        if not self.rubs:
            return {}
        lost = run.ledger["friction"]
        return {"ledger": np.array([[lost], [0.0], [lost], [0.0]]), "together": self.model.rig.strips_slide_apart}

    def own(self, run, drive, values: dict) -> dict:
        """What samples leave open, and of the drift the round-off of its two means, which cancel.

        No means in a window below 1.5 cycles, which has ends alone. Where a run ends inside a cycle, and of strips,
        the means are those of cubics through 400 samples a cycle, which miss h^4/384 of the fourth derivative: seen
        against 8000 a cycle, 2e-14 of the range, as the cycles miss nearly alike. What jumps excite in a mode r times
        as fast as the drive falls with 1/r^2, its fourth derivative grows with r^2.
        """
        window, modes, apart = run.window, self.model.rig.modes, self.model.rig.strips_slide_apart
        open_ = {} if apart else self.sampled(run, drive, values)
        if window.time[-1] - window.time[0] < 1.5 * drive.period:
            return open_
        if run.means is not None and not apart:
            return open_ | {"drift_per_cycle": 1e-14 * float(np.abs(window.slide).max(initial=0.0))}
        faster = max(1.0, float(modes.omega.max()) / omega_of(drive))**2
        return open_ | {"drift_per_cycle": 1e-13 * faster * float(np.ptp(window.slide))}


def _first(run, drive, span: float, apart: bool) -> Loop:
    """The Loop of the first interface by the quadrature of the run. apart: loops of every strip, because a yaw works
    besides the mean slide."""
    time, weight, slide, rate, force = run.loop
    power, q, pull = force * rate, 0j, 0j
    if apart:
        power = (run.window.extra["forces"] * run.window.extra["slide_rates"]).sum(axis=1)
    if whole(span, drive):
        q, pull = (harmonic(time, weight, column, omega_of(drive)) for column in (slide - weight @ slide / span, force))
    peak = float(np.abs(run.window.force).max()) if apart else float(run.force_peaks[0])
    return Loop(q, pull, float(weight @ power), float(np.ptp(run.window.slip)), run.stick, peak)


def _others(run) -> list:
    """The Loops of the interfaces after the first: sticks by their events, work by the trapezoidal rule, which leaves
    nothing out where the friction is constant in slip."""
    slips, slides = run_events.slips_of(run.window)
    if slips.shape[1] == 1:
        return []
    events, (begin, end) = run_events.of_log(run.log), run.window.time[[0, -1]]
    ranges, forces = np.ptp(slips, axis=0), run.window.extra["forces"]
    return [Loop(0j, 0j, float(np.trapezoid(forces[:, k], slides[:, k])), float(ranges[k]),
                 stuck_time(events, k + 1, begin, end, bool(ranges[k])), float(run.force_peaks[k]))
            for k in range(1, len(ranges))]


def _books(run) -> tuple:
    """Friction work of the first interface in the window by the trapezoidal rule on its samples, both sides of every
    jump among them, by the quadrature of the pieces between events, and to and fro."""
    window, (_, weight, _, rate, force) = run.window, run.loop
    power = weight * force * rate
    return float(sampled_work(window.slide, window.force).sum()), float(power.sum()), float(np.abs(power).sum())


def forces_of(model, patch) -> tuple:
    """Static and kinetic friction [N] of every interface, (i,) each."""
    rig, share = model.rig, 1.0
    if rig.strips_slide_apart:
        return tuple(np.array(column) for column in zip(*(model.limits(n) for n in strip_loads(patch))))
    if model.friction is None:
        return (np.zeros(len(rig.modes.interfaces)),) * 2
    if rig.names:
        pairs = [one.limits(one.load) for one in rig.interfaces]
    else:
        if has(model.friction.law, "averaged"):
            share = limit_share(model, patch)
        static, kinetic = model.limits(borne(model, patch))
        pairs = [(static * share, kinetic if model.friction.kinetic is not None else static * share)]
    return tuple(np.array(column) for column in zip(*pairs))


def _over_strips(done, patch):
    """A run of strips as a run of the patch: loops from the samples of the window and from both sides of every
    event."""
    loads, offsets = strip_loads(patch), patch.strips.offsets
    window = as_one(done.window, loads, offsets)
    gaps = np.diff(window.time)
    weight = np.concatenate([[0.0], gaps / 2]) + np.concatenate([gaps / 2, [0.0]])
    held = ~window.extra["slide_rates"].any(axis=1)
    return replace(done, response=as_one(done.response, loads, offsets), window=window, stick=float(weight[held].sum()),
                   loop=(window.time, weight, window.slide, window.slide_rate, window.force))


def _go(rig, drive, forces, cycles: float, window: int, start, progress, say):
    modes, travel = rig.modes, rig.travel
    if modes.omega.size == 1 and len(modes.interfaces) == 1 and drive.segments:
        fast = cycles > sdof.COMPILED_FROM
        if fast:
            sdof.kernels(True, say)
        return sdof.simulate(modes, drive, float(forces[0][0]), float(forces[1][0]), cycles, window, travel, progress,
                             start, fast)

    return simulate(modes, drive, *forces, cycles, window, travel, progress, start)
