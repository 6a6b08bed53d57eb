"""A march of a rig: patch or point, law and modes, as a Solution."""

from time import perf_counter

import numpy as np

from ...core import IntegratedMeasures
from ...dynamics.march import march as engine
from ...effects import law_has_trait
from ...friction.record import law_from
from ...response.ends import end_error
from ...response.inside_steps import motion_inside_steps
from ...response.measures import peaks_between, step_harmonic
from ...response.rows import NEEDS_RUN, lateral_work
from ...response.spectrum import friction_harmonic, motion_harmonic
from ...structure.drive_sizes import drive_omega, has_full_cycle, is_sinusoidal, peak_speed
from . import levels as rig_levels
from . import strips
from .interface import contact_of
from .lists import ListGuard, has_list, quadrature_of
from .reading import Reader
from .solution import Solution, borne, sampled_loop

LATE = 1.5  # times what an end beside the asked one changes to first order


def run_march(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """One march at numerics.steps per cycle; patch: the solved Patch or None."""
    contact, done, seconds, prepare = marched(model, numerics, patch, frames, say, progress)
    return MarchReader(model, numerics, patch, contact).solution(done, seconds, prepare)


def marched(model, numerics, patch, frames: int = 0, say=None, progress=None) -> tuple:
    """(contact, MarchResult, seconds of the march, seconds before it by what they were for); arguments as `run_march`."""
    rig, begin = model.rig, perf_counter()
    contact = contact_of(model, numerics, patch)
    reduced = perf_counter() - begin
    engine.warm_up(rig.modes, rig.drive.signal, contact, say)
    loaded = perf_counter() - begin - reduced
    begin = perf_counter()
    # strips have no common field of shear
    frames = 0 if rig.friction.strips_slide_apart else frames
    progress = ListGuard(progress) if has_list(model, numerics) else progress
    folds = (
        model.patch is not None and model.patch.mesh.can_gather_points
    )  # nobody sees its histories
    done = engine.march(
        rig.modes,
        rig.drive.signal,
        contact,
        numerics.cycles,
        numerics.steps,
        numerics.window,
        rig.springs.travel,
        frames,
        say,
        progress,
        rig.start,
        rig_levels.level_ends(rig),
        numerics.whole and not folds,
        folds,
        even=bool(NEEDS_RUN),
    )
    seconds = perf_counter() - begin
    done = strips.run_of_strips(done, patch) if rig.friction.strips_slide_apart else done
    return contact, done, seconds, {"reduce": reduced, "compiled_code": loaded}


class MarchReader(Reader):
    """What a finished march shows."""

    def __init__(self, model, numerics, patch, contact):
        held = 0.0
        if model.friction is not None:
            least = 1e-15 * peak_speed(model.rig.drive.signal) * model.rig.drive.signal.period
            held = least if contact.set_valued else 1e-3 * contact.length
        super().__init__(model, numerics, patch, contact, held)

    def solution(self, run, seconds: float, prepare: dict | None, drive=None, **more) -> Solution:
        """The Solution of a MarchResult."""
        levels, probe = self._levels(run) if self.model.rig.drive.levels.amplitudes else ((), None)
        return super().solution(
            run,
            seconds,
            drive,
            prepare=prepare,
            levels=levels,
            probe=probe,
            summed=self.summed(),
            extra={"late": self.late(run.window)},
            **more,
        )

    def own(self, run, drive, values: dict) -> dict:
        """What the peaks and the end of a run leave open, by name."""
        late, between = self.late(run.window), self.between(run.window)
        return {name: late.get(name, 0.0) + between.get(name, 0.0) for name in late | between}

    def between(self, window) -> dict:
        """What the peaks of a run may lie above its samples, by name."""
        return peaks_between(window, self.model.grooves is not None)

    def late(self, window) -> dict:
        """What the end of a run at a sample leaves open, by name."""
        steps = self.numerics.cycles * self.numerics.steps
        found = end_error(window, self.model.rig.drive.signal.period, steps - round(steps))
        return {name: LATE * error for name, error in found.items()}

    def summed(self):
        """How the bonds are summed, a Choice; None of a law that is no sum."""
        f = self.model.friction
        return (
            quadrature_of(self.model, self.numerics)
            if f is not None and law_has_trait(f.law, "bonds")
            else None
        )

    def integrated(self, run, drive) -> IntegratedMeasures:
        """The two books of friction work, which a march keeps itself."""
        return IntegratedMeasures(
            friction_works=tuple(run.ledger[name] for name in ("sampled", "booked", "passed"))
        )

    def more(self, run, drive, stuck: bool) -> dict:
        """Harmonics and work of the loop, and what a law that jumps shows of an interface that holds."""
        if not self.rubs:
            return {}
        rig, jumps = self.model.rig, self.contact.set_valued
        out = {
            "loop": self._loop(run, drive),
            "still": self.held if jumps else 0.0,
            "together": rig.friction.strips_slide_apart,
            "inside": self.inside_steps,
        }
        if not (stuck and jumps):
            return out
        # its energies are round-off of such a one
        moving = rig.modes.mass * peak_speed(drive, rig.start) ** 2
        # what moves in it does not slide
        return out | {
            "book": run.ledger | {"power": run.ledger["power"] + moving},
            "known": {"slip_start_phase": None, "stick_fraction": 1.0},
        }

    def inside_steps(self, window, number: int):
        """Return the window of an interface with samples inside the steps, if the force of its law changes there."""
        model, one = self.model, self.model.rig.friction.interfaces[number]
        if (
            not law_has_trait(one.numbers.law, "overshoots")
            or model.grooves is not None
            or model.rig.friction.strips_slide_apart
        ):
            return window
        load = borne(model, self.patch) if one.load is None else one.load
        return motion_inside_steps(window, law_from(one.numbers, load), load)

    def _loop(self, part, drive) -> tuple | None:
        """(first harmonics of slide and force, work per cycle) of the first interface, or of all strips.

        Where nothing acts beside drive and friction its harmonics are those of the motion (`friction_harmonic`).
        """
        w, rig = part.window, self.model.rig
        work = getattr(part, "window_work", None)
        work = part.work if work is None else work
        # the yaw of strips works besides
        together = self.contact.set_valued and not rig.friction.strips_slide_apart
        if len(rig.friction.names) > 1 or together:  # of this interface, without the blows of stops
            work = float(part.step_force @ np.diff(w.slide)) + lateral_work(w, 0)
        span = w.time[-1] - w.time[0]
        work *= drive.period / span if span > 0 else 0.0
        alone = len(rig.modes.interfaces) == 1 and not (
            rig.friction.load_varies
            or rig.friction.strips_slide_apart
            or rig.springs.is_nonlinear
            or rig.modes.lateral_faces is not None
        )
        if alone and is_sinusoidal(drive) and has_full_cycle(span, drive):
            return (
                motion_harmonic(w.time, w.slide, w.slide_rate, drive_omega(drive)),
                friction_harmonic(w, rig.modes, drive),
                work,
            )
        return sampled_loop(
            w,
            drive,
            work,
            step_harmonic(w.time, part.step_force, drive_omega(drive)) if span > 0 else 0j,
        )

    def _levels(self, done) -> tuple:
        """Levels of the drive, and probe as `levels.onset` asks."""
        rig, numerics = self.model.rig, self.numerics

        def probe(number, level):
            other = rig_levels.drive_with(rig.drive.signal, number + 1, level)
            run = (
                done.marks[number].after.fork(other)
                if number >= 0
                else engine.fresh(
                    rig.modes, other, self.contact, numerics.steps, rig.springs.travel, rig.start
                )
            )
            mark = run.mark(round(rig.drive.levels.cycles), numerics.window)
            return self.level(
                level,
                strips.mark_as_one(mark, self.patch) if rig.friction.strips_slide_apart else mark,
                other,
            )

        amplitudes = rig.drive.levels.amplitudes
        return tuple(self.level(size, mark) for size, mark in zip(amplitudes, done.marks)), probe
