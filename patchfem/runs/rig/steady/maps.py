"""Steady motion of a rig that is linear between events, as fixed point of the map of a period.

In: a Model, its Numerics and its Patch. Out: the Solution under a sine, and the response curve over
frequency or drive level. `EventFinder` is for Coulomb interfaces or none, `YieldFinder` for
elastic-plastic elements. Errors are due to round-off and to the residual of the fixed point only,
because the motion between events is exact.
"""

from dataclasses import replace
from functools import cached_property
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ....core import InitialState, Outcome, PatchfemError
from ....dynamics.events import elements as event_elements
from ....dynamics.events import histories, steady, stick_steady
from ....dynamics.periodic import is_stable
from ....response.measures import measure_half_range
from ....response.spectrum import harmonic_measures
from ....structure.drive_sizes import find_max_acceleration
from ....structure.response import compute_receptance
from ..event_driven import EventEvaluator, RigidElements, YieldingElements
from .curves import (
    COLUMN_MEASURES,
    CurvePoint,
    TracedCurve,
    compute_response_curve,
    describe_instability,
    estimate_exact_errors,
)


class PeriodicMotion(NamedTuple):
    """Fixed point of the map of a period, with its stability.

    - start, memory: state of the rig and memory of its elements at phase 0 of the drive.
    - guess: initial guess for the motion at a neighbouring drive.
    - regime: name of the motion, such as "stick-slip".
    - multipliers (m,): Floquet multipliers.
    - residual: relative change of the state over a period.
    - error: relative error due to the residual.
    - iterations: number of iterations.
    - bounded: whether a bounded motion exists.
    - stable: whether the motion is stable.
    """

    start: InitialState
    memory: Any
    guess: Any
    regime: str
    multipliers: np.ndarray
    residual: float
    error: float
    iterations: int
    bounded: bool
    stable: bool

    @property
    def regime_text(self) -> str:
        """Regime of the motion as text, which says if the motion is unstable."""
        return self.regime if self.stable else f"{self.regime}, unstable"

    @property
    def largest_multiplier(self) -> float:
        """Largest magnitude of the Floquet multipliers."""
        return float(np.abs(self.multipliers).max(initial=0.0))


class MapFinder(TracedCurve):
    """Base class of solvers for steady motions as fixed points of the map of a drive period.

    Subclasses compute the fixed point in `find_periodic_motion`. If several motions exist, the search starts
    from `guess`.
    """

    name = ""
    elements = None
    has_fallback = False

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        histories.load_event_kernels(say)
        self.model = model
        self.numerics = numerics
        self.modes = model.rig.modes
        self.patch = patch
        self.frames = frames
        self.contact_elements = self.elements(model, numerics, patch)
        self.groups = self.contact_elements.groups

    def find_periodic_motion(self, drive, guess) -> PeriodicMotion:
        """Find the periodic motion under sinusoidal drive."""
        raise NotImplementedError

    def compute_steady_motion(self, drive, guess=None) -> tuple:
        """Compute the steady motion under sinusoidal drive, and the guess for a neighbouring drive."""
        begin = perf_counter()
        motion = self.find_periodic_motion(drive, guess)
        numerics = replace(self.numerics, cycles=2.0, window=1)
        evaluator = EventEvaluator(self.model, numerics, self.patch, self.contact_elements)
        run = histories.simulate(
            self.modes,
            drive,
            self.groups,
            2.0,
            1,
            np.inf,
            self.frames,
            None,
            motion.start,
            self.convert_memory(motion.memory),
        )
        run = evaluator.average_over_strips(run)
        solution = evaluator.make_solution(run, perf_counter() - begin, drive)
        outcome = solution.outcome or Outcome.STEADY
        if not motion.bounded:
            outcome = Outcome.GROWS
        elif float(np.abs(run.extremes).max()) > self.model.rig.springs.travel:
            outcome = Outcome.EXCEEDS_TRAVEL
        message = solution.message
        if not motion.stable:
            outcome = Outcome.NOT_CONVERGED
            message = describe_instability(motion.multipliers)
        extra = {
            "regime": motion.regime_text,
            "multipliers": motion.multipliers,
            "residual": motion.residual,
            "map": self.name,
        }
        return replace(
            solution,
            outcome=outcome,
            message=message,
            steady=(None, None),
            extra=extra,
            errors=estimate_exact_errors(solution.values, motion.error),
            book=solution.book | {"iterations": float(motion.iterations)},
        ), motion.guess

    def convert_memory(self, memory):
        """Return the initial memory of the friction elements."""
        return memory

    def compute_curve_point(self, drive, guess=None) -> CurvePoint:
        """Compute one point of a response curve."""
        motion = self.find_periodic_motion(drive, guess)
        if not motion.bounded:
            return CurvePoint(
                drive, {}, {}, motion.regime_text, motion.largest_multiplier, False, Outcome.GROWS
            )
        run = histories.simulate(
            self.modes, drive, self.groups, 1, 1, start=motion.start, memory=motion.memory
        )
        window = run.window
        gauge = self.modes.gauge
        amplitude = float(run.extremes[:, 1].max() - run.extremes[:, 0].min()) / 2
        if gauge is not None:
            amplitude = measure_half_range(
                window.time, window.modal @ gauge, window.modal_rate @ gauge
            )
        waves = harmonic_measures(
            *map(float, run.reading.acceleration_harmonics), find_max_acceleration(drive)
        )
        values = _collect_curve_measures(amplitude, run.acceleration, waves)
        is_stuck = EventEvaluator(
            self.model, self.numerics, self.patch, self.contact_elements
        ).is_stuck(run)
        return CurvePoint(
            drive=drive,
            values=values,
            errors=estimate_exact_errors(values, motion.error),
            regime=motion.regime_text,
            multiplier=motion.largest_multiplier,
            stable=motion.stable,
            outcome=Outcome.STUCK if is_stuck else Outcome.STEADY,
            guess=motion.guess,
        )

    def trace_curve(self, drive) -> tuple:
        """Compute the response curve over frequency, which has no folds.

        Each point starts from the motion at the previous one.
        """
        return compute_response_curve(self.modes, drive, self.compute_curve_point), ()


def _collect_curve_measures(amplitude: float, acceleration: float, waves: dict) -> dict:
    """Return a dict of the known measures of a point of a response curve."""
    values = {
        COLUMN_MEASURES["amplitude"]: amplitude,
        COLUMN_MEASURES["acceleration_peak"]: acceleration,
        **waves,
    }
    return {name: value for name, value in values.items() if value is not None}


class YieldFinder(MapFinder):
    """Solver for steady motions of elastic-plastic elements, by the map between yield events."""

    name = "yields"
    elements = YieldingElements

    def __init__(self, model, *given):
        super().__init__(model, *given)
        self.has_fallback = len(model.rig.friction.interfaces) == 1

    def convert_memory(self, memory):
        """Return the initial memory of the elements with zero work and dissipation."""
        return event_elements.reset_work(memory)

    def find_periodic_motion(self, drive, guess) -> PeriodicMotion:
        """Find the periodic motion of elastic-plastic elements under sinusoidal drive."""
        state = steady.solve_steady(self.modes, drive, self.groups, guess)
        return PeriodicMotion(
            start=state.start,
            memory=state.memory,
            guess=state.point,
            regime=state.regime,
            multipliers=state.multipliers,
            residual=state.residual,
            error=state.error,
            iterations=state.iterations,
            bounded=True,
            stable=is_stable(state.multipliers),
        )


class EventFinder(MapFinder):
    """Solver for steady motions with Coulomb friction or no friction, by the map of events."""

    name = "events"
    elements = RigidElements

    @cached_property
    def friction_limits(self) -> np.ndarray:
        """Static and kinetic friction limits (2, i) [N] of the interfaces."""
        return np.array([(group.static, group.kinetic) for group in self.groups]).T

    def find_periodic_motion(self, drive, guess) -> PeriodicMotion:
        """Find the periodic motion of Coulomb interfaces under sinusoidal drive.

        If static friction exceeds kinetic friction, several motions exist, and the search starts
        from the state `guess`. The multipliers of two simultaneous events depend on their order, so
        they do not decide the stability.
        """
        falls = bool(np.any(self.friction_limits[0] > self.friction_limits[1]))
        start = guess if falls else None
        state = stick_steady.solve_steady(self.modes, drive, self.groups, start=start)
        bounded = state.regime != "unbounded"
        return PeriodicMotion(
            start=state.start,
            memory=None,
            guess=state.start,
            regime=state.regime,
            multipliers=state.multipliers,
            residual=state.residual,
            error=state.residual,
            iterations=state.iterations,
            bounded=bounded,
            stable=not bounded or not state.alone or is_stable(state.multipliers),
        )

    def compute_curve_point(self, drive, guess=None) -> CurvePoint:
        """Compute one point of a response curve, which has a closed form without friction.

        An undamped resonance has no closed form.
        """
        if self.friction_limits.any():
            return super().compute_curve_point(drive, guess)
        modes = self.modes
        gauge = self.modes.output if self.modes.gauge is None else self.modes.gauge
        try:
            receptance = compute_receptance(modes, drive.omega, [gauge, modes.output], modes.base)
        except PatchfemError:
            return super().compute_curve_point(drive)
        at_gauge, at_output = receptance[0, :, 0] * modes.mass
        acceleration = drive.acceleration * float(abs(drive.moving + drive.omega**2 * at_output))
        amplitude = drive.acceleration * float(abs(at_gauge))
        values = _collect_curve_measures(
            amplitude, acceleration, harmonic_measures(acceleration, 0.0)
        )
        return CurvePoint(
            drive,
            values,
            estimate_exact_errors(values, 0.0),
            "sliding",
            float(np.exp(self.max_growth_rate * drive.period)),
            True,
            Outcome.STEADY,
        )

    @cached_property
    def max_growth_rate(self) -> float:
        """Largest growth rate [1/s] of the free motions without friction; negative if all of them decay."""
        n = self.modes.omega.size
        state = np.block(
            [
                [np.zeros((n, n)), np.eye(n)],
                [-np.diag(self.modes.omega**2), -self.modes.damping_matrix],
            ]
        )
        return float(np.linalg.eigvals(state).real.max())
