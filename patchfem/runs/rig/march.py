"""March of a rig: contact, time integration, and its Solution.

In: a Model, its Numerics and its pressed patch. Out: a Solution whose measures come from
samples, except the work of the energy balance and the harmonics of the loop.
"""

from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import IntegratedMeasures
from ...dynamics.march import march as engine
from ...effects import law_has_trait
from ...friction.record import make_law
from ...response.ends import estimate_window_error
from ...response.inside_steps import motion_inside_steps
from ...response.measures import compute_step_harmonic, peak_sampling_errors
from ...response.rows import ROWS_NEEDING_RUN, lateral_work
from ...response.spectrum import friction_harmonic, motion_harmonic
from ...structure.drive_sizes import (
    estimate_peak_speed,
    find_drive_omega,
    has_full_cycle,
    is_sinusoidal,
)
from . import levels as rig_levels
from . import strips
from .bond_lists import ListGuard, choose_bond_summation, has_list
from .evaluation import Reader, compute_work_check
from .interface import make_contact
from .solution import CycleLoop, Solution, compute_sampled_loop, normal_load

# Safety factor on the first-order error of a run that ends beside its requested end.
END_ERROR_FACTOR = 1.5


class March(NamedTuple):
    """Finished march of a rig, with its contact model and CPU time.

    - contact: contact model of the march.
    - result: MarchResult.
    - seconds: CPU seconds of the march.
    - prepare: CPU seconds of its preparation by name.
    """

    contact: object
    result: object
    seconds: float
    prepare: dict


def run_march(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """March a rig in time and evaluate its measures.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
    frames : int
        Number of snapshots of the interface in the last cycle.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.
    """
    march = march_model(model, numerics, patch, frames, say, progress)
    reader = MarchReader(model, numerics, patch, march.contact)
    return reader.solution(march.result, march.seconds, prepare=march.prepare)


def march_model(model, numerics, patch, frames: int = 0, say=None, progress=None) -> March:
    """March a rig in time without evaluating its measures.

    Parameters
    ----------
    model, numerics, patch, frames, say, progress
        See `run_march`.
    """
    rig = model.rig
    begin = perf_counter()
    contact = make_contact(model, numerics, patch)
    reduced = perf_counter() - begin
    engine.warm_up(rig.modes, rig.drive.signal, contact, say)
    loaded = perf_counter() - begin - reduced
    begin = perf_counter()
    # strips that slide independently have no common shear stress, so that no frames are kept
    frames = 0 if rig.friction.strips_slide_apart else frames
    progress = ListGuard(progress) if has_list(model, numerics) else progress
    # the histories of a patch reduced to few points are not used
    keeps_extremes = model.patch is not None and model.patch.mesh.can_gather_points
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
        rig_levels.list_level_ends(rig),
        keeps_samples=numerics.whole and not keeps_extremes,
        keeps_extremes=keeps_extremes,
        even=bool(ROWS_NEEDING_RUN),
    )
    seconds = perf_counter() - begin
    done = strips.average_march(done, patch) if rig.friction.strips_slide_apart else done
    return March(contact, done, seconds, {"reduce": reduced, "compiled_code": loaded})


class MarchReader(Reader):
    """Evaluation of the runs of the march."""

    def __init__(self, model, numerics, patch, contact):
        held = 0.0
        if model.friction is not None and contact.set_valued:
            drive = model.rig.drive.signal
            held = 1e-15 * estimate_peak_speed(drive) * drive.period
        elif model.friction is not None:
            held = 1e-3 * contact.length
        super().__init__(model, numerics, patch, contact, held)

    def solution_fields(self, run, drive) -> dict:
        """Return the drive levels, the bond summation and the errors due to the end of the run."""
        fields = {"summed": self.choose_bond_summation(), "extra": {"late": self.late(run.window)}}
        if self.model.rig.drive.levels.amplitudes:
            fields["levels"], fields["probe"] = self._levels(run)
        return fields

    def stated_errors(self, run, drive, values: dict) -> dict:
        """Return the errors due to peaks between samples and due to the end of the run.

        Parameters
        ----------
        run, drive, values
            See `Reader.stated_errors`.
        """
        late = self.late(run.window)
        between = self.peak_excesses(run.window)
        return {name: late.get(name, 0.0) + between.get(name, 0.0) for name in late | between}

    def peak_excesses(self, window) -> dict:
        """Estimate how far the peaks of a motion exceed its largest samples, as a dict."""
        return peak_sampling_errors(window, self.model.grooves is not None)

    def late(self, window) -> dict:
        """Estimate the errors due to a last sample that is not exactly at the requested end."""
        steps = self.numerics.cycles * self.numerics.steps
        period = self.model.rig.drive.signal.period
        changes = estimate_window_error(window, period, steps - round(steps))
        return {name: END_ERROR_FACTOR * change for name, change in changes.items()}

    def choose_bond_summation(self):
        """Choose the bond summation of the run; None for a law without bonds."""
        friction = self.model.friction
        if friction is None or not law_has_trait(friction.law, "bonds"):
            return None
        return choose_bond_summation(self.model, self.numerics)

    def integrated_measures(self, run, drive, *, stuck: bool = False) -> IntegratedMeasures:
        """Return the check of the friction work, and the measures of a stuck interface.

        Parameters
        ----------
        run, drive, stuck
            See `Reader.integrated_measures`.
        """
        if not self.has_friction:
            return IntegratedMeasures()
        book = self._energies(run, drive, stuck=stuck)
        values = {"work_check": compute_work_check(book)}
        if stuck and self.contact.set_valued:
            # the remaining motion of the interface is round-off, not slip
            values |= {"slip_start_phase": None, "stick_fraction": 1.0}
        return IntegratedMeasures(values)

    def _energies(self, run, drive, *, stuck: bool) -> dict:
        """Return the energies of a run; those of a stuck interface are round-off of the kinetic energy."""
        if not (stuck and self.contact.set_valued):
            return run.ledger
        rig = self.model.rig
        moving = rig.modes.mass * estimate_peak_speed(drive, rig.start) ** 2
        return run.ledger | {"power": run.ledger["power"] + moving}

    def further_fields(self, run, drive, *, stuck: bool) -> dict:
        """Return the friction loop and the energies for the evaluation.

        Parameters
        ----------
        run, drive, stuck
            See `Reader.further_fields`.
        """
        if not self.has_friction:
            return {}
        return {
            "book": self._energies(run, drive, stuck=stuck),
            "loop": self._loop(run, drive),
            "still": self.held if self.contact.set_valued else 0.0,
            "together": self.model.rig.friction.strips_slide_apart,
            "inside": self.inside_steps,
        }

    def inside_steps(self, window, number: int):
        """Add samples inside the time steps to the window, for laws whose force overshoots.

        Samples are added for laws whose force exceeds its limit within a step.

        Parameters
        ----------
        window : Response
        number : int
            Index of the interface.
        """
        model = self.model
        interface = model.rig.friction.interfaces[number]
        if (
            not law_has_trait(interface.numbers.law, "overshoots")
            or model.grooves is not None
            or model.rig.friction.strips_slide_apart
        ):
            return window
        load = interface.load
        if load is None:
            load = normal_load(model, self.patch)
        return motion_inside_steps(window, make_law(interface.numbers, load), load)

    def _loop(self, part, drive) -> CycleLoop | None:
        """Compute the first harmonics of displacement and friction force, and the work per cycle.

        If no other forces act besides drive and friction, the harmonics of the force come from the
        motion (`friction_harmonic`).
        """
        window = part.window
        omega = find_drive_omega(drive)
        rig = self.model.rig
        work = getattr(part, "window_work", None)
        work = part.work if work is None else work
        # the friction of strips that yaw does more work than the mean slide shows
        together = self.contact.set_valued and not rig.friction.strips_slide_apart
        # the work of this interface excludes other interfaces and impacts at stops
        if len(rig.friction.names) > 1 or together:
            work = float(part.step_force @ np.diff(window.slide)) + lateral_work(window, 0)
        span = window.time[-1] - window.time[0]
        work *= drive.period / span if span > 0 else 0.0
        alone = len(rig.modes.interfaces) == 1 and not (
            rig.friction.load_varies
            or rig.friction.strips_slide_apart
            or rig.springs.is_nonlinear
            or rig.modes.lateral_faces is not None
        )
        if alone and is_sinusoidal(drive) and has_full_cycle(span, drive):
            slide = motion_harmonic(window.time, window.slide, window.slide_rate, omega)
            return CycleLoop(slide, friction_harmonic(window, rig.modes, drive), work)
        force = 0j
        if span > 0:
            force = compute_step_harmonic(window.time, part.step_force, omega)
        return compute_sampled_loop(window, drive, work, force)

    def _levels(self, done) -> tuple:
        """Return the drive levels of a run, and a function that runs a further level."""
        rig = self.model.rig
        numerics = self.numerics

        def probe(number, level):
            """Run a level from the end of an earlier one; number -1 means a start from rest."""
            other = rig_levels.replace_level(rig.drive.signal, number + 1, level)
            if number >= 0:
                run = done.marks[number].after.fork(other)
            else:
                run = engine.start_run(
                    rig.modes, other, self.contact, numerics.steps, rig.springs.travel, rig.start
                )
            mark = run.march_to_mark(round(rig.drive.levels.cycles), numerics.window)
            if rig.friction.strips_slide_apart:
                mark = strips.average_mark(mark, self.patch)
            return self.level(level, mark, other)

        amplitudes = rig.drive.levels.amplitudes
        return tuple(self.level(size, mark) for size, mark in zip(amplitudes, done.marks)), probe
