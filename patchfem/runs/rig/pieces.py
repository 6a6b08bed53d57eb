"""The engines that are exact from event to event (`dynamics.events`): Coulomb friction, or none at all, and
elastic-plastic elements."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ...core import IntegratedMeasures, InterfaceLoop, NotConverged, SineDrive
from ...dynamics.events import elements, histories
from ...dynamics.events import names_kernels as at
from ...dynamics.events import steady as steady_events
from ...dynamics.events.reading import Reading
from ...effects import law_has_trait
from ...response import run_events
from ...response.loops import interface_loops
from ...response.measures import REST, harmonic, relative_gap
from ...response.ringing import held_modes, held_ring, strongest
from ...response.rows import NEEDS_RUN, stuck_share
from ...response.spectrum import distorted
from ...structure.drive_sizes import (
    drive_omega,
    has_full_cycle,
    is_periodic,
    is_sinusoidal,
    max_acceleration,
    min_decay_rate,
)
from ..bench import averaged
from . import interface, strips
from .levels import by_levels, without_part_of_cycle
from .reading import Reader
from .solution import Solution, borne, mode_stiffness

# what is known without an interface
OF_MOTION = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "absolute_acceleration_fundamental",
    "acceleration_distortion",
)
CHANGES = 1e-2  # share of the tolerance by which a motion that has settled may still change
# by which it is told; share of a free motion that is lost in these, at least
WINDOWS, LEAST_LOST = (
    3,
    1e-6,
)


def run_exact(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Solution of a Coulomb rig, or of a structure without friction; patch: the solved Patch, or None under [normal] or
    between masses."""
    return _run(
        Pieces(model, numerics, patch, RigidElements(model, numerics, patch)), 0, say, progress
    )


def run_piecewise(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Solution of a rig behind elastic-plastic elements; patch: the solved Patch, or None."""
    return _run(
        Pieces(model, numerics, patch, YieldingElements(model, numerics, patch)),
        frames,
        say,
        progress,
    )


def _run(reader, frames: int, say, progress) -> Solution:
    rig, numerics, begin, more = reader.model.rig, reader.numerics, perf_counter(), {}
    histories.warm_up(say)
    prepare = {"reduce": reader.reduced, "compiled_code": perf_counter() - begin}
    begin = perf_counter()

    def go(drive, state, watch, last: bool, cycles: float = rig.drive.levels.cycles):
        done = histories.simulate(
            rig.modes,
            drive,
            reader.groups,
            cycles,
            numerics.window,
            rig.springs.travel,
            frames * last,
            watch,
            *state,
            even=bool(NEEDS_RUN),
        )
        return reader.over_strips(done)

    if rig.drive.levels.amplitudes:
        done, more = by_levels(reader, go, (rig.start, None), lambda run: run.end, progress)
    else:
        done = without_part_of_cycle(
            go(rig.drive.signal, (rig.start, None), progress, True, numerics.cycles)
        )
    more |= {} if reader.rigid else {"prepare": prepare}
    return reader.solution(done, perf_counter() - begin, **more)


class Pieces(Reader):
    """What a finished run from event to event shows, through Interfaces or Limits `found`."""

    def __init__(self, model, numerics, patch, found):
        super().__init__(model, numerics, patch, found.contact, found.held, histories.SAMPLES)
        self.groups, self.rigid, self.reduced = found.groups, found.rigid, found.seconds
        self.apart = found.rigid and model.rig.friction.strips_slide_apart

    def over_strips(self, run):
        """The run as that of the patch, where its strips slide apart."""
        if not self.apart:
            return run
        loads, offsets = strips.strip_loads(self.patch), self.patch.strips.offsets
        response, window = (
            strips.as_one(one, loads, offsets) for one in (run.response, run.window)
        )
        return replace(run, response=response, window=window)

    def sticks(self, run) -> bool:
        """Of strips that slide apart every one has to stick."""
        return (
            run_events.all_stick(run.window, self.held)
            if self.apart and self.rubs
            else super().sticks(run)
        )

    def integrated(self, run, drive) -> IntegratedMeasures:
        """The loops of the interfaces, of strips that slide apart the one of their samples; what else the series of the
        pieces give stands in `more`."""
        return IntegratedMeasures(loops=(_of_strips(run, drive),) if self.apart else run.loops)

    def more(self, run, drive, stuck: bool) -> dict:
        """What the series of the pieces give, by name; what goes into rigid elements is lost."""
        found = read_off(
            run.reading,
            run.ledger,
            is_sinusoidal(drive),
            bool(has_full_cycle(run.reading.span, drive)),
            mode_stiffness(self.model, run.window),
            max_acceleration(drive),
        )
        known = {name: None if np.isnan(value) else float(value) for name, value in found.items()}
        if not self.rubs:
            return {"known": {name: known[name] for name in (*OF_MOTION, "drift_per_cycle")}}
        if not self.rigid:
            return {"known": known}
        if self.apart:
            known = {name: known[name] for name in (*OF_MOTION, "slip_start_phase")}
        lost = run.ledger["friction"]
        return {
            "known": known,
            "ledger": np.array([[lost], [0.0], [lost], [0.0]]),
            "together": self.apart,
        }

    def rings(self, run, drive) -> tuple:
        """What rings is known in closed form of a single element and where every interface holds to the end of a run
        without a sine, and of a motion that repeats by one of its cycles."""
        if not self.rubs:
            return {}, {}
        if run.ring is not None:
            return held_ring(*run.ring, run.acceleration), {}
        if held := self.held_modes(run, run.window, drive):
            one = strongest(held, "acceleration")
            return held_ring(
                one.acceleration, 2 * np.pi * one.frequency, one.damping, run.acceleration
            ), {}
        return run_events.rings(
            run.window, self.model.rig.modes, drive, run.log, repeats=run.repeats
        )

    def held_modes(self, run, motion, drive) -> list:
        """`ringing.held_modes` of a part of a run; [] unless nothing but a constant drives it there and every interface
        is one spring that holds to the end."""
        springs = [one.stiffness for one in self.groups]
        held = (
            self.rubs
            and not self.rigid
            and all(one.size == 1 for one in springs)
            and not any(one.slip_range for one in run.loops)
            and (not run.log.time.size or run.log.time[-1] < motion.time[0])
        )
        if not held or is_periodic(drive) or not drive.segments or motion.time.size < 2:
            return []
        return held_modes(self.model.rig.modes, np.concatenate(springs), motion)

    def tail(self, run, drive) -> dict:
        """What rings after the last slip of a release, as the field `extra` of a Solution keeps it; {} without one."""
        if (
            self.model.rig.drive.kind != "free"
            or run.response is None
            or run.log is None
            or not run.log.time.size
        ):
            return {}
        after = run.response.select(run.response.time > run.log.time[-1])
        held = self.held_modes(run, after, drive)
        return {"tail": strongest(held, "displacement")} if held else {}

    def own(self, run, drive, values: dict) -> dict:
        """What samples leave open of the measures that no sum over the pieces has, and behind rigid elements the
        round-off of the two means that the drift is a difference of.

        No means in a window below 1.5 cycles, which has ends alone. Those of strips are of cubics through 400 samples a
        cycle, which miss h^4/384 of the fourth derivative: seen against 8000 a cycle, 2e-14 of the range, as the cycles
        miss nearly alike. What jumps excite in a mode r times as fast as the drive falls with 1/r^2, its fourth
        derivative grows with r^2.
        """
        window, modes = run.window, self.model.rig.modes
        left = {} if self.apart else self.sampled(run, drive, values)
        if not self.rigid or window.time[-1] - window.time[0] < 1.5 * drive.period:
            return left
        if not self.apart:
            return left | {"drift_per_cycle": 1e-14 * float(np.abs(window.slide).max(initial=0.0))}
        faster = max(1.0, float(modes.omega.max()) / drive_omega(drive)) ** 2
        return left | {"drift_per_cycle": 1e-13 * faster * float(np.ptp(window.slide))}

    def solution(self, run, seconds: float, drive=None, **more) -> Solution:
        """The Solution of a PieceRun; where its windows still change, with the motion that it settles to."""
        drive, numerics = drive or self.model.rig.drive.signal, self.numerics
        more |= {"extra": more.get("extra", {}) | tail} if (tail := self.tail(run, drive)) else {}
        unsettled = still_changes(
            run.amplitudes,
            numerics.window,
            self.model.accuracy.tolerance,
            min_decay_rate(self.model.rig.modes) * drive.period,
        )
        if (
            numerics.whole
            and run.outcome is None
            and not self.rigid
            and not self.sticks(run)
            and unsettled
        ):
            steady = settles(self.model.rig.modes, drive, self.groups, run)
            more |= {} if steady is None else {"steady": steady, "bounded": True}
        return super().solution(run, seconds, drive, **more)


def _of_strips(run, drive) -> InterfaceLoop:
    """Return the loop of strips averaged to one interface, from the samples of the window.

    The samples are those on both sides of every event; the yaw does work beside the mean slide.
    """
    window, omega = run.window, drive_omega(drive)
    gaps = np.diff(window.time)
    weight = np.concatenate([[0.0], gaps / 2]) + np.concatenate([gaps / 2, [0.0]])
    held = ~window.extra["slide_rates"].any(axis=1)
    power = (window.extra["forces"] * window.extra["slide_rates"]).sum(axis=1)
    slide = window.slide - weight @ window.slide / weight.sum()
    first, pull = (
        complex(harmonic(window.time, weight, one, omega)) for one in (slide, window.force)
    )
    return InterfaceLoop(
        first,
        pull,
        float(weight @ power),
        float(np.ptp(window.slip)),
        float(weight[held].sum()),
        float(np.abs(window.force).max()),
    )


def still_changes(extremes, window: int, tolerance: float, decay: float) -> bool:
    """Whether a motion of extremes (c, 2) [m] per cycle may still change by a share of the tolerance, or is too short
    to say: by what the ends of its cycles moved over the last WINDOWS of `window` cycles, over the share that its
    slowest free motion loses in these. Where that beats slowly, ends hardly move as long as it is largest.

    decay: of that free motion over a cycle [1].
    """
    last = np.asarray(extremes, float)[-WINDOWS * window :]
    lost = max(-np.expm1(-decay * len(last)), LEAST_LOST)
    return (
        len(last) < WINDOWS * window
        or np.ptp(last, axis=0).max() > CHANGES * tolerance * lost * np.ptp(last[-window:]) / 2
    )


def settles(modes, drive, groups, done) -> tuple | None:
    """(amplitude [m], its error) of the stable motion that a run under a sine settles to, by the map of its yields.

    None where the run does not end with a period of a sine, or where no such motion was found.
    """
    last = drive.segments[-1] if drive.segments else None
    if (
        last is None
        or not is_sinusoidal(drive)
        or last.constant != 0
        or abs(done.cycles_done - round(done.cycles_done)) > 1e-9
    ):
        return None
    sine = SineDrive(last.amplitude, last.omega, drive.moving)
    try:
        one = steady_events.settled(modes, sine, groups, *done.end)
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


class YieldingElements:
    """The elements of every interface of a model, as `groups`; contact: the ContactModel of a single one; held: slip
    [m] below which a cycle sticks; seconds: of its reduction."""

    rigid = False

    def __init__(self, model, numerics, patch):
        rig, self.contact, begin = model.rig, None, perf_counter()
        if len(rig.modes.interfaces) > 1:
            parts = interface.own_elements(model, numerics.meshed)
        else:
            self.contact = interface.contact_model(model, numerics, patch)
            parts = [self.contact.element]
        self.held = 1e-3 * min((one.length for one in parts if one.limit > 0), default=0.0)
        self.groups = tuple(elements_of_law(one) for one in parts)
        for _ in range(numerics.pairs):
            self.groups = tuple(map(elements.merged, self.groups))
        if numerics.joined:
            self.groups = tuple(
                elements.merged(one, *numerics.joined)
                if law_has_trait(law.numbers.law, "cells")
                else one
                for one, law in zip(self.groups, rig.friction.interfaces)
            )
        self.seconds = perf_counter() - begin


class RigidElements:
    """The rigid elements of every Coulomb interface of a model, as `groups`: no slip is small beside them."""

    rigid, contact, held, seconds = True, None, 0.0, 0.0

    def __init__(self, model, numerics, patch):
        self.groups = tuple(elements.coulomb(*pair) for pair in coulomb_limits(model, patch))


def coulomb_limits(model, patch) -> list:
    """(static, kinetic) friction [N] of every interface, 0 where nothing rubs."""
    rig, share = model.rig, 1.0
    if rig.friction.strips_slide_apart:
        return [
            tuple(map(float, model.friction_limits(load))) for load in strips.strip_loads(patch)
        ]
    if model.friction is None:
        return [(0.0, 0.0)] * len(rig.modes.interfaces)
    if rig.friction.names:
        return [tuple(map(float, one.friction_limits(one.load))) for one in rig.friction.interfaces]
    if law_has_trait(model.friction.law, "averaged"):
        share = averaged.limit_share(model, patch)
    static, kinetic = model.friction_limits(borne(model, patch))
    return [
        (
            float(static * share),
            float(kinetic if model.friction.kinetic is not None else static * share),
        )
    ]


def elements_of_law(element) -> elements.Elements:
    """Elements of an Element of form "parallel"."""
    count = int(element.numbers[1])
    return elements.elements_of(
        element.numbers[2 : 2 + count], element.numbers[2 + count : 2 + 2 * count]
    )


def read_off(reading: Reading, book: dict, sine: bool, whole: bool, stiffness, size) -> dict:
    """Measures of the first interface and of the motion by name, numbers or (n,) of n runs, NaN where a run has none.

    book: energies of the run [J]; sine: the drive ends as one; whole: the cycles that were read are whole ones;
    stiffness [N/m]: of the first mode as the contact meets it, 0 where no damping ratio refers to it; size [m s-2]: of
    the drive.
    """
    none, (first, third) = np.full(np.shape(reading.swing), np.nan)[()], reading.waves
    out = {
        "relative_displacement_amplitude": reading.swing,
        "absolute_acceleration_peak": reading.acceleration,
        "absolute_acceleration_fundamental": first if sine and whole else none,
        "acceleration_distortion": distorted(first, third, size) if sine and whole else none,
        "drift_per_cycle": reading.drift,
        "slip_start_phase": reading.start if sine else none,
        "work_check": _work_check(reading, book),
    }
    one = reading.loop()
    out |= {
        "slip_amplitude": one.slip_range / 2,
        "friction_force_peak": one.max_force,
        "stick_fraction": stuck_share(one.stuck_time, reading.span),
    }
    return out | (_loop(reading, sine, stiffness) if whole else {})


def _loop(reading: Reading, sine: bool, stiffness) -> dict:
    """Measures of the loop of the first interface."""
    one = reading.loop()
    moves = (reading.of(at.HIGH) - reading.of(at.LOW) > REST) & sine
    half = np.where(moves, reading.of(at.RANGE) / 2, 0.0)[()]
    work = one.work * reading.period / reading.span
    secant = np.where(moves, reading.of(at.SECANT), np.nan)[()]
    return interface_loops(half, one.displacement_harmonic, one.force_harmonic, work, stiffness) | {
        "secant_stiffness": secant
    }


def _work_check(reading: Reading, book: dict):
    """Gap [1] of the friction work of the cycles that were read: by the trapezoidal rule on the ends of the pieces
    against the ledger's."""
    turned, booked, passed = (
        reading.faces[..., place].sum(axis=-1) for place in (at.TURNED, at.WORK, at.PASSED)
    )
    return relative_gap(turned, booked, passed, book["power"] + book["peak_stored"])
