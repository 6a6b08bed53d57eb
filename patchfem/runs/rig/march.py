"""Run of a rig by time integration with constant steps, and its Solution.

In: a Model, its Numerics and its Patch. Out: a Solution. The measures come from samples, except the
work of the energy balance and the harmonics of the loop.
"""

from dataclasses import replace
from time import process_time

import numpy as np

from ...core import Outcome, add_interface_number
from ...measures.measures import Values, bound_sampling_errors, compute_step_harmonic
from ...structure.drive_sizes import estimate_peak_speed, find_drive_omega
from ...time_steps import time_march as engine
from ..interfaces import bands
from ..interfaces.contact_points import make_contact
from .evaluation import (
    RunEvaluator,
    compute_sampled_loop,
    compute_work_check,
    describe_escape,
    find_travel,
)


class MarchEvaluator(RunEvaluator):
    """Evaluator that computes runs with equal time steps, and measures from them.

    Parameters
    ----------
    model : Model
        Rig, drive and friction laws.
    numerics : Numerics
        Steps per cycle, cycles and window.
    patch : Patch or None
        None under [normal] and between masses.
    say : callable, optional
        Callback for a line of text.
    """

    def __init__(self, model, numerics, patch, say=None):
        begin = process_time()
        contact = make_contact(model, numerics, patch)
        reduced = process_time() - begin
        engine.load_kernels(contact, say)
        stick_tolerance = 0.0
        if model.friction is not None and contact.set_valued:
            drive = model.rig.drive.signal
            stick_tolerance = 1e-15 * estimate_peak_speed(drive) * drive.period
        elif model.friction is not None:
            stick_tolerance = 1e-3 * contact.length
        super().__init__(model, numerics, patch, contact, stick_tolerance)
        loaded = process_time() - begin - reduced
        self.prepare = {"reduce": reduced, "compiled_code": loaded}

    def integrate(
        self, drive, cycles: float, before: engine.Motion | None, n_frames: int = 0, progress=None
    ) -> engine.Motion:
        """Integrate the motion under a drive from the end of another run.

        Parameters
        ----------
        drive
            Acceleration of the base, or force over the modal mass.
        cycles : float
            Number of cycles of the drive.
        before : time_steps.time_march.Motion or None
            Run from whose end the motion goes on, or None for the start of the rig.
        n_frames : int
            Number of snapshots of the interface in the last cycle.
        progress : callable, optional
            Callback for the completed fraction.
        """
        rig = self.model.rig
        numerics = self.numerics
        # Rigid bands that slide independently have no common shear stress, so no output frames are stored.
        slide_apart = rig.friction.bands_slide_apart
        travel = find_travel(rig)
        run = engine.march(
            rig.modes,
            drive,
            self.contact,
            cycles,
            numerics.steps,
            window=numerics.window,
            travel=travel,
            start=rig.start if before is None else before.end,
            frames=0 if slide_apart and not self.model.partial_slip else n_frames,
            keeps_samples=numerics.whole,
            progress=progress,
        )
        if run.outcome is Outcome.EXCEEDS_TRAVEL:
            run = replace(run, message=describe_escape(rig, travel))
        if not slide_apart:
            return run

        # Bands are averaged to a single interface, whose force is known at the samples.
        run = bands.average_over_bands(run, self.patch)
        force = run.window.force
        return replace(run, step_force=(force[1:] + force[:-1]) / 2)

    def estimate_run_errors(self, run, drive, values: Values) -> Values:
        """Estimate how far the peaks of a motion exceed its samples.

        Parameters
        ----------
        run : time_steps.time_march.Motion
            Motion in time steps.
        drive
            Drive of the run.
        values : dict of float
            Measures by name.
        """
        known = self._find_release_forces(run.window)
        return bound_sampling_errors(run.window) | dict.fromkeys(known, 0.0)

    def _find_release_forces(self, window) -> Values:
        """Return the static friction limits [N] of rigid interfaces that stick and slip in a window, by name of their peak.

        The friction force reaches the limit at the instant of the release, between two samples.
        """
        if self.contact.has_loads or self.model.rig.friction.bands_slide_apart:
            return {}
        peaks = {}
        for k, (point_set, slide) in enumerate(zip(self.contact.point_sets, window.slides.T)):
            size = np.max(np.abs(window.modal) @ np.abs(point_set.row))
            # Largest move in a step of an interface that sticks rigidly, relative to the sum of the
            # slides of its modes: round-off
            rests = np.abs(np.diff(slide)) <= 1e-9 * size
            if self.contact.is_rigid(point_set) and (rests[:-1] > rests[1:]).any():
                name = add_interface_number("friction_force_peak", k)
                peaks[name] = float(point_set.law.limits.sum())
        return peaks

    def describe_cycles(self, run, drive) -> dict:
        """Return the check of the friction work, the friction loop, the energies, and the round-off of the slide.

        Parameters
        ----------
        run : time_steps.time_march.Motion
            Motion in time steps, with the friction force and work of its window.
        drive
            Drive of this motion, which may be a single level.
        """
        if not self.has_friction:
            return {}
        rig = self.model.rig
        energies = run.ledger
        if self.contact.set_valued and self.is_stuck(run):
            # The remaining motion of a stuck interface is round-off, not slip. Its energies are compared with the kinetic
            # energy at the peak speed of the drive.
            moving = rig.modes.mass * estimate_peak_speed(drive, rig.start) ** 2
            energies = energies | {"power": energies["power"] + moving}

        # `window_work` is that of all interfaces, whose stops and releases within a step it contains; that of the first of
        # several ones is int F dx. Bands that yaw do more work than follows from their mean displacement.
        window = run.window
        work = run.window_work
        if len(rig.friction.names) > 1:
            work = float(run.step_force @ np.diff(window.slide))
        loop = None
        span = window.time[-1] - window.time[0]
        if span > 0:
            # The mean force of a step includes the impulses in it, e.g. at the end of slip.
            force = compute_step_harmonic(window.time, run.step_force, find_drive_omega(drive))
            loop = compute_sampled_loop(window, drive, work * drive.period / span, force)
        return {
            "integrated": {"work_check": compute_work_check(energies)}
            | self._find_release_forces(window),
            "run_energies": energies,
            "loop": loop,
            "slide_round_off": self.stick_tolerance if self.contact.set_valued else 0.0,
            "is_single_interface": rig.friction.bands_slide_apart,
        }
