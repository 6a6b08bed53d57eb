"""A march of a rig: patch or point, law and modes, as a Solution."""

from time import perf_counter

import numpy as np

from ...core import Outcome
from ...dynamics.march import march as hub
from ...dynamics.second_book import gap
from ...effects import has
from ...response import run_events
from ...response.ends import end_error
from ...response.loops import at_turns
from ...response.measures import peaks_between, step_harmonic, window_amplitudes, window_ends
from ...response.outcome import steady_of
from ...response.rows import measures_of
from ...response.spectrum import friction_harmonic, motion_harmonic
from ...structure.drive_sizes import omega_of, peak_speed, sinusoidal, whole
from . import levels as rig_levels
from .interface import model_of
from .numerics import quadrature_of
from .solution import Solution, sampled_loop, seen
from .strips import joined, mark_as_one, other_measures

LATE = 1.5  # times what an end beside the asked one changes to first order


def run_march(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """One march at numerics.steps per cycle; patch: the solved Patch or None."""
    contact, done, seconds, prepare = marched(model, numerics, patch, frames, say, progress)
    return Read(model, numerics, patch, contact).solution(done, seconds, prepare)


def marched(model, numerics, patch, frames: int = 0, say=None, progress=None) -> tuple:
    """(contact, MarchResult, seconds of the march, seconds before it by what they were for); arguments as `run_march`.
    """
    rig, begin = model.rig, perf_counter()
    contact = model_of(model, numerics, patch)
    reduced = perf_counter() - begin
    hub.warm_up(rig.modes, rig.drive, contact, say)
    loaded = perf_counter() - begin - reduced
    begin = perf_counter()
    frames = 0 if rig.strips_slide_apart else frames  # strips have no common field of shear
    done = hub.march(rig.modes, rig.drive, contact, numerics.cycles, numerics.steps, numerics.window, rig.travel,
                     frames, say, progress, rig.start, rig_levels.ends(rig), numerics.whole)
    seconds = perf_counter() - begin
    done = joined(done, patch) if rig.strips_slide_apart else done
    return contact, done, seconds, {"reduce": reduced, "compiled_code": loaded}


class Read:
    """The measures, outcome and levels of a finished march."""

    def __init__(self, model, numerics, patch, contact):
        self.model, self.numerics, self.patch, self.contact, rig = model, numerics, patch, contact, model.rig
        self.held = 0.0  # slip [m] below which a cycle sticks
        if model.friction is not None:
            least = 1e-15 * peak_speed(rig.drive) * rig.drive.period
            self.held = least if contact.set_valued else 1e-3 * contact.length
            self.creeps = has(model.friction.law, "creeps")  # it never holds, nor sticks
            self.held *= not self.creeps

    def solution(self, done, seconds: float, prepare: dict) -> Solution:
        """The Solution of a MarchResult."""
        rig, window = self.model.rig, self.numerics.window
        rubs, stuck, rings, own = self.model.friction is not None, False, {}, {}
        if rubs:
            if not self.creeps:
                rings, own = run_events.rings(done.window, rig.modes, rig.drive, None, self.held)
            stuck = run_events.all_stick(done.window, self.held) and not self.creeps
        late, between = self.late(done.window), self.between(done.window)
        own = own | {name: late.get(name, 0.0) + between.get(name, 0.0) for name in late | between}
        last = min(window, len(done.amplitudes))
        values = self.values(done, done.amplitudes[-last:], done.response.extra.get("ledger"), stuck) | rings
        levels, probe = self._levels(done) if rig.levels else ((), None)
        outcome = done.outcome or (Outcome.STUCK if stuck else None)
        ends = window_ends(done.amplitudes, done.phasors, window)
        return Solution(values, done.response, done.window, window_amplitudes(done.amplitudes, window),
                        steady_of(rig.drive, *ends), outcome, done.snapshots, done.ledger, seconds, self.contact,
                        prepare, done.message, levels, probe, held=self.held, own=own, summed=self.summed(),
                        extremes=done.amplitudes, extra={"late": late})

    def between(self, window) -> dict:
        """What the peaks of a run may lie above its samples, by name."""
        return peaks_between(window, self.model.grooves is not None)

    def late(self, window) -> dict:
        """What the end of a run at a sample leaves open, by name."""
        steps = self.numerics.cycles * self.numerics.steps
        found = end_error(window, self.model.rig.drive.period, steps - round(steps))
        return {name: LATE * error for name, error in found.items()}

    def summed(self):
        """How the bonds are summed, a Choice; None of a law that is no sum."""
        f = self.model.friction
        return quadrature_of(self.model, self.numerics) if f is not None and has(f.law, "bonds") else None

    def values(self, part, extremes, ledger, stuck: bool = False, drive=None) -> dict:
        """Measures of a MarchResult or of a Mark of it; ledger (4, k) [J] or None; drive: where it is another."""
        drive, book, known = drive or self.model.rig.drive, part.ledger, {}
        if self.model.friction is None:
            return measures_of(seen(self.model, self.patch, part.window, extremes, book, self.numerics.steps,
                                    drive=drive))
        if stuck and self.contact.set_valued:  # what moves in round-off does not slide
            known |= {"slip_start_phase": None, "stick_fraction": 1.0}
            moving = self.model.rig.modes.mass * peak_speed(drive, self.model.rig.start)**2
            book = book | {"power": book["power"] + moving}  # its energies are round-off of such a one
        energy = book["power"] + book["peak_stored"]
        known["work_check"] = gap(book["sampled"], book["booked"], book["passed"], energy)
        found = measures_of(seen(self.model, self.patch, part.window, extremes, book, self.numerics.steps, drive=drive,
                                 loop=self._loop(part, drive), ledger=ledger, known=known, by=at_turns(self.model),
                                 still=self.held if self.contact.set_valued else 0.0))
        others = not self.model.rig.strips_slide_apart
        return found | (other_measures(part.window, drive, self.numerics.steps) if others else {})

    def _loop(self, part, drive) -> tuple | None:
        """Loop of the first interface, or of all strips; the others have their own.

        Where nothing acts beside drive and friction its harmonics are those of the motion (`friction_harmonic`).
        """
        w, rig = part.window, self.model.rig
        work = getattr(part, "window_work", None)
        work = part.work if work is None else work
        together = self.contact.set_valued and not rig.strips_slide_apart  # the yaw of strips works besides
        if len(rig.names) > 1 or together:  # of this interface, without the blows of stops
            work = float(part.step_force @ np.diff(w.slide))
        span = w.time[-1] - w.time[0]
        work *= drive.period / span if span > 0 else 0.0
        alone = len(rig.modes.interfaces) == 1 and not (rig.load_varies or rig.strips_slide_apart or rig.bends)
        if alone and sinusoidal(drive) and whole(span, drive):
            slide = motion_harmonic(w.time, w.slide, w.slide_rate, omega_of(drive))
            return w.slide, slide, friction_harmonic(w, rig.modes, drive), work
        return sampled_loop(w, drive, work, step_harmonic(w.time, part.step_force, omega_of(drive)) if span > 0 else 0j)

    def _levels(self, done) -> tuple:
        """Levels of the drive, and probe as `levels.onset` asks."""
        rig, numerics = self.model.rig, self.numerics
        rubs = self.model.friction is not None
        found = rig_levels.rows(rig.levels, done.marks, lambda mark: self.values(mark, mark.amplitudes, None),
                                self.held if rubs else None)

        def probe(number, level):
            other = rig_levels.drive_with(rig.drive, number + 1, level)
            run = done.marks[number].after.fork(other) if number >= 0 else hub.fresh(
                rig.modes, other, self.contact, numerics.steps, rig.travel, rig.start)
            mark = run.mark(round(rig.level_cycles), numerics.window)
            mark = mark_as_one(mark, self.patch) if rig.strips_slide_apart else mark
            return rig_levels.row(level, self.values(mark, mark.amplitudes, None, drive=other),
                                  self.held if rubs else None)

        return found, probe
