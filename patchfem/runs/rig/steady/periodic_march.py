"""Steady motion over grooves, by time integration from a corrected initial state.

In: a Model with grooves, its Numerics and its Patch. Out: the Solution under a sine, and the
response curve over frequency (`points.orbits`).
"""

from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ....core import NotConverged, Outcome
from ....effects import SINE_WAVEFORM
from ....model.rig import DriveLevels
from ....points import orbits
from ....points import time_march as engine
from ....response.measures import peak_sampling_errors
from ..interface import make_contact
from ..march import MarchEvaluator
from ..solution import Solution
from .curves import (
    CurvePoint,
    ResponseCurve,
    TracedCurve,
    compute_response_curve,
    describe_instability,
    make_curve_point,
)

START_STEPS = 256  # Steps per cycle of the first march for a law that is not set-valued.
MAX_STEPS = 4096  # Largest number of steps per cycle of a refined march.
# Samples per cycle for a set-valued law, whose step size is controlled by its error.
SET_VALUED_SAMPLES = 1024
# Number of cycles from rest within which a lifted mass leaves its grooves, if it leaves them at
# all.
N_CYCLES_IN_GROOVES = 30
STEP_END_ERROR = 1e-9  # Relative error of the measures due to round-off at the ends of steps.
# Largest change per cycle, relative to the amplitude, at which a motion counts as periodic.
PERIODIC_TOL = 1e-6
# Error of the Floquet multipliers due to the step size; a motion counts as unstable only if a
# multiplier exceeds 1 by more.
MULTIPLIER_TOL = 1e-2


def march_out_of_grooves(model, numerics, patch, drive, contact) -> Solution | None:
    """Return the Solution of a motion that leaves its grooves; None if it stays in them.

    This is decided by integrating N_CYCLES_IN_GROOVES cycles from rest. The errors are the
    differences from an integration with half the steps.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
    drive : SineDrive
    contact
        Contact model of the grooves.
    """
    if not model.grooves.lifted_mass:
        return None
    begin = perf_counter()
    solutions = []
    rig = model.rig.with_signal(drive, levels=DriveLevels(), waveform=SINE_WAVEFORM)
    for steps in (START_STEPS, START_STEPS // 2):
        run = engine.march(
            rig.modes,
            drive,
            contact,
            N_CYCLES_IN_GROOVES,
            steps,
            window=1,
            travel=rig.springs.travel,
            keeps_samples=False,
        )
        if run.outcome is not Outcome.LEAVES_GROOVES:
            return None
        few_cycles = replace(numerics, cycles=N_CYCLES_IN_GROOVES, steps=steps, window=1)
        evaluator = MarchEvaluator(replace(model, rig=rig), few_cycles, patch, contact)
        solutions.append(evaluator.make_solution(run, perf_counter() - begin))
    fine, half = solutions
    errors = {}
    for name, value in fine.values.items():
        errors[name] = abs(value - half.values.get(name, 0.0)) + STEP_END_ERROR * abs(value)
    extra = {"regime": "leaves its grooves", "multipliers": np.zeros(0)}
    return replace(fine, errors=errors, extra=extra)


class CycleEvaluation(NamedTuple):
    """Measures and histories of one cycle of a periodic motion over grooves.

    - values: measures by name.
    - motion: points.time_march.Motion of the cycle.
    - is_stuck: whether the interface sticks.
    """

    values: dict
    motion: object
    is_stuck: bool


class MarchFinder(TracedCurve):
    """Solver for steady motions over grooves, by time integration from a corrected initial state."""

    # The points of the curve have errors of the size of the tolerance, so that a refined peak
    # cannot have a smaller error.
    peak_tolerances = (0.3, 30.0)

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        self.model = model
        self.patch = patch
        self.frames = frames
        self.contact = make_contact(model, numerics, patch)
        exact = self.contact.set_valued
        self.steps = model.accuracy.steps_per_cycle or (
            SET_VALUED_SAMPLES if exact else START_STEPS
        )
        self.numerics = replace(numerics, cycles=1.0, window=1)
        engine.load_kernels(self.contact, say)

    def _march_to_periodic(self, drive, guess, steps: int):
        """Integrate until the motion is periodic; return the run and its change per period."""
        rig = self.model.rig
        run = engine.March(rig.modes, drive, self.contact, steps, rig.springs.travel)
        if guess is not None:
            run.continue_from(guess)
        change = orbits.march_to_periodic(run)
        if run.outcome is not None and run.outcome is not Outcome.EXCEEDS_TRAVEL:
            raise NotConverged(run.message)
        if run.outcome is None and change > PERIODIC_TOL:
            raise NotConverged(
                f"no periodic motion was found within {orbits.MAX_CYCLES} cycles: "
                f"the motion still changes by {change:.2g} of its amplitude from one cycle to the next; "
                'use accuracy.method = "march"'
            )
        return run, change

    def _evaluate_cycle(self, run, steps: int, frames: int = 0) -> CycleEvaluation:
        """Evaluate one cycle of a periodic time integration."""
        motion = orbits.march_cycle(run, frames)
        numerics = replace(self.numerics, steps=steps)
        evaluator = MarchEvaluator(self.model, numerics, self.patch, self.contact)
        is_stuck = (
            bool(np.ptp(motion.window.slip) <= evaluator.stick_tolerance) and not evaluator.creeps
        )
        values = evaluator.evaluate_measures(motion, run.drive, stuck=is_stuck)
        return CycleEvaluation(values | {"drift_per_cycle": 0.0}, motion, is_stuck)

    def compute_steady_motion(self, drive, guess=None) -> tuple:
        """Compute the steady motion under sinusoidal drive, and the guess for a neighbouring drive.

        If the lifted mass leaves its grooves, there is no steady motion. The Solution is then that
        of the motion that leaves them, and the run is None.
        """
        try:
            return self._refine_point(drive, guess)
        except NotConverged:
            if (
                gone := march_out_of_grooves(
                    self.model, self.numerics, self.patch, drive, self.contact
                )
            ) is None:
                raise
        return gone, None

    def _refine_point(self, drive, guess) -> tuple:
        """Compute the steady motion with as many time steps as the tolerance requires.

        The steps are doubled until the amplitude changes by less than the tolerance. The errors
        include the difference from half the steps.
        """
        begin = perf_counter()
        name = "relative_displacement_amplitude"
        run, change = self._march_to_periodic(drive, guess, self.steps)
        half = self._evaluate_cycle(
            self._march_to_periodic(drive, run, self.steps // 2)[0], self.steps // 2
        ).values
        steps = self.steps
        reading = self._evaluate_cycle(run, self.steps, self.frames)
        while self._has_step_error(reading.values[name], half[name]) and run.outcome is None:
            if 2 * steps > MAX_STEPS or self.model.accuracy.steps_per_cycle is not None:
                break
            steps = 2 * steps
            half = reading.values
            run, change = self._march_to_periodic(drive, run, steps)
            reading = self._evaluate_cycle(run, steps, self.frames)
        values, motion, is_stuck = reading
        peak_errors = peak_sampling_errors(motion.window)
        multipliers = orbits.estimate_multipliers(run) if run.outcome is None else np.zeros(0)
        regime = "stick-slip" if values.get("stick_fraction") else "sliding"
        outcome = run.outcome or Outcome.STEADY
        if is_stuck:
            regime = "stuck"
            outcome = run.outcome or Outcome.STUCK
        message = run.message
        if not is_stuck and np.abs(multipliers).max(initial=0.0) > 1 + MULTIPLIER_TOL:
            outcome = Outcome.NOT_CONVERGED
            message = describe_instability(multipliers)
            regime = f"{regime}, unstable"
        errors = {}
        for key, value in values.items():
            if value is not None:
                error = abs(value - half.get(key, value)) + abs(value) * (change + STEP_END_ERROR)
                errors[key] = error + peak_errors.get(key, 0.0)
        if "slip_start_phase" in errors:
            errors["slip_start_phase"] = (
                min(errors["slip_start_phase"], np.pi / 2) + 2 * np.pi / steps
            )
        extra = {
            "regime": regime,
            "multipliers": multipliers,
            "residual": change,
            "map": "march",
            "steps_per_cycle": steps,
        }
        return Solution(
            values,
            motion.window,
            motion.window,
            np.array([values[name]]),
            (None, None),
            outcome,
            motion.snapshots,
            motion.ledger,
            perf_counter() - begin,
            self.contact,
            message=message,
            errors=errors,
            extra=extra,
        ), run

    def _has_step_error(self, value: float, half: float) -> bool:
        """Return whether the amplitudes with all and with half of the steps differ by more than the tolerance."""
        return abs(value - half) > self.model.accuracy.tolerance * abs(value)

    def compute_curve_point(self, drive, guess=None) -> CurvePoint:
        """Compute one point of a response curve, starting from a neighbouring motion or from rest."""
        try:
            return make_curve_point(drive, *self.compute_steady_motion(drive, guess))
        except NotConverged:
            if guess is None:
                raise
        return make_curve_point(drive, *self.compute_steady_motion(drive))

    def trace_curve(self, drive) -> ResponseCurve:
        """Compute the response curve over frequency, which has no folds.

        Each point starts from the motion at the previous one.
        """
        points = compute_response_curve(self.model.rig.modes, drive, self.compute_curve_point)
        return ResponseCurve(points)
