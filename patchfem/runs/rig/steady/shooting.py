"""Steady motion of a rig over grooves, by shooting with the map of a period of the engine `hybrid`.

In: a Model, its Numerics and its Patch. Out: the Solution under a sine, and the response curve over frequency
(`hybrid.periodic`).
"""

from dataclasses import replace
from time import perf_counter

import numpy as np

from .... import compiled
from ....core import NotConverged, Outcome
from ....hybrid import cases, periodic
from ....hybrid import runs as hybrid_runs
from ....hybrid.records import Clock, Status
from ..event_to_event import LumpedEvaluator
from ..hybrid_laws import make_joints
from ..solution import Solution
from .curves import (
    CurvePoint,
    TracedCurve,
    compute_response_curve,
    describe_instability,
    make_curve_point,
)

# Cycles from rest within which a lifted mass leaves its grooves, if it leaves them at all.
N_CYCLES_IN_GROOVES = 30
RTOL = 1e-9  # tolerance of a step, so that the change over a period is far below the motion
# Largest multiplier that counts as 1, because the derivatives of the map are differences.
MAX_STABLE_MULTIPLIER = 1 + 1e-3
MIN_DISTANCE = 1e-6  # smallest distance of a multiplier from 1 that is assumed for the error


class ShootingFinder(TracedCurve):
    """Solver for steady motions by Newton's method on the map of a period."""

    has_fallback = True

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        compiled.load("hybrid.engine_kernels", say)
        self.model = model
        self.patch = patch
        self.frames = frames
        self.numerics = replace(
            numerics, cycles=1.0, window=1, local=RTOL, steps=cases.MIN_STEPS, whole=True
        )
        self.joints = make_joints(model, self.numerics, patch)
        self.evaluator = LumpedEvaluator(model, self.numerics, patch, self.joints)

    def compute_steady_motion(self, drive, guess=None) -> tuple:
        """Compute the steady motion under sinusoidal drive, and the guess for a neighbouring drive.

        If the lifted mass leaves its grooves, there is no steady motion. The Solution is then that of the motion that
        leaves them, and the guess is None.
        """
        begin = perf_counter()
        if self.model.grooves.lifted_mass:
            run = self.evaluator.integrate(drive, N_CYCLES_IN_GROOVES, None, 0)
            if run.outcome is Outcome.LEAVES_GROOVES:
                return self._make_solution(run, drive, begin, "leaves its grooves"), None

        schedule = cases.Schedule(1.0, 1, np.zeros(0), np.inf)
        case = cases.make_rig_case(
            self.model.rig, self.joints.laws, schedule, signal=drive, rtol=RTOL
        )
        motion = periodic.find_periodic_motion(case, start=guess)
        status = Status(int(motion.batch.states.clock[0, Clock.STATUS]))
        if status != Status.DONE or motion.change > motion.tolerance:
            raise NotConverged(
                f"no periodic motion was found: the motion still changes by {motion.change:.2g} of its amplitude from "
                'one cycle to the next; use accuracy.method = "auto"'
            )
        state = motion.batch.states
        run = self.evaluator.integrate(drive, 1.0, state, self.frames)
        return self._make_periodic_solution(run, motion, drive, begin), state

    def _make_periodic_solution(self, run, motion, drive, begin: float) -> Solution:
        """Return the Solution of a periodic motion with its stability and errors."""
        regime = "stick-slip" if run.values.get("stick_fraction") else "sliding"
        is_stuck = self.evaluator.is_stuck(run)
        if is_stuck:
            regime = "stuck"
        largest = np.abs(motion.multipliers).max(initial=0.0)
        is_stable = is_stuck or largest <= MAX_STABLE_MULTIPLIER
        if not is_stable:
            regime = f"{regime}, unstable"
        solution = self._make_solution(run, drive, begin, regime)
        reach = float(np.abs(run.extremes).max())
        outcome = Outcome.STUCK if is_stuck else Outcome.STEADY
        if reach > self.model.rig.springs.travel:
            outcome = Outcome.EXCEEDS_TRAVEL
        if not is_stable:
            outcome = Outcome.NOT_CONVERGED
            solution = replace(solution, message=describe_instability(motion.multipliers))

        # The error of the fixed point is its change over a period over the distance of a multiplier from 1.
        distance = np.abs(1 - motion.multipliers).min(initial=1.0)
        relative = max(motion.change, RTOL) / max(distance, MIN_DISTANCE)
        coarse = replace(
            self.evaluator.numerics,
            local=hybrid_runs.COARSE * RTOL,
            steps=cases.MIN_STEPS / hybrid_runs.COARSE_STEP,
        )
        other = LumpedEvaluator(self.model, coarse, self.patch, self.joints)
        other_run = other.integrate(drive, 1.0, motion.batch.states, 0)
        coarse_values = other.evaluate_measures(other_run, drive, stuck=is_stuck)
        shared = {name: value for name, value in solution.values.items() if name in coarse_values}
        errors = hybrid_runs.estimate_errors(shared, coarse_values, RTOL)
        errors = {
            name: errors.get(name, abs(value)) + relative * abs(value)
            for name, value in solution.values.items()
        }
        extra = {"multipliers": motion.multipliers, "residual": motion.change, "map": "shooting"}
        return replace(
            solution,
            values=solution.values | {"drift_per_cycle": 0.0},
            outcome=outcome,
            errors=errors,
            extra=solution.extra | extra,
        )

    def _make_solution(self, run, drive, begin: float, regime: str) -> Solution:
        """Return the Solution of a run with a regime."""
        solution = self.evaluator.make_solution(run, perf_counter() - begin, drive)
        errors = {name: RTOL * abs(value) for name, value in solution.values.items()}
        extra = {"regime": regime, "multipliers": np.zeros(0)}
        return replace(solution, steady=(None, None), errors=errors, extra=extra)

    def compute_curve_point(self, drive, guess=None) -> CurvePoint:
        """Compute one point of a response curve, starting from a neighbouring motion or from rest."""
        try:
            return make_curve_point(drive, *self.compute_steady_motion(drive, guess))
        except NotConverged:
            if guess is None:
                raise
        return make_curve_point(drive, *self.compute_steady_motion(drive))

    def trace_curve(self, drive) -> tuple:
        """Compute the response curve over frequency, which has no folds.

        Each point starts from the motion at the previous one.
        """
        return compute_response_curve(self.model.rig.modes, drive, self.compute_curve_point), ()
