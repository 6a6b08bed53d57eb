"""Steady motion of laws with memory and of nonlinear springs, by harmonic balance.

In: a Model, its Numerics and its Patch. Out: the Solution under a sine, and the response curve over
frequency with its folds (`dynamics.harmonic`).
"""

from dataclasses import replace
from functools import cached_property
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ....core import IntegratedMeasures, NotConverged, Outcome, Response, SineDrive
from ....dynamics.harmonic import branch as branches
from ....dynamics.harmonic.motion import SteadyMotion, find_cycle_energies, make_cycle_response
from ....dynamics.harmonic.motion import find_regime as balanced_regime
from ....dynamics.harmonic.steady import find_steady_motion as periodic_point
from ....dynamics.harmonic.steady import list_coexisting_slides, refine_steady_motion
from ....formatting import format_length, format_quantity
from ....response.errors import finer_errors
from ....response.measures import Values, compute_peak
from ....response.spectrum import find_acceleration_harmonics, make_acceleration_measures
from ...results.result import Settings, SteadyData
from ..evaluation import RunEvaluator, compute_sampled_work, compute_work_check
from ..joints import make_law_group
from ..solution import Fields, Solution, compute_sampled_loop
from .curves import (
    COLUMN_MEASURES,
    HARMONIC_ROUND_OFF,
    CurvePoint,
    ObservedMotion,
    ResponseCurve,
    describe_instability,
)
from .shooting import PeriodMap

# Reasons why a branch ends before the last frequency, by the value of `Branch.ended`.
REASONS_OF_END = {
    "start": "it turns back to its first frequency",
    "points": "it has too many points",
    "step": "no neighbouring motion was found there",
}
# Number of samples per cycle from which the measures of a steady motion are computed.
BALANCE_SAMPLES_PER_CYCLE = 4096


class CycleRun(NamedTuple):
    """One cycle of a motion from harmonic balance as a run that is evaluated.

    - window: histories of the cycle
    - extremes (1, 2): smallest and largest output [m]
    - ledger: energies [J] by name
    - reversals: displacement [m], friction force [N] and slip [m] at each of them (`SteadyMotion.find_reversals`)
    """

    window: Response
    extremes: np.ndarray
    ledger: Values
    reversals: tuple[tuple[float, float, float], ...]


class BalanceEvaluator(RunEvaluator):
    """Evaluation of one cycle of a motion from harmonic balance."""

    def describe_cycles(self, run, drive, *, stuck: bool) -> Fields:
        """Return the friction loop, the check of the friction work, and the measures that depend on reversals.

        A periodic motion has no drift.

        Parameters
        ----------
        run : CycleRun
            One cycle of the steady motion.
        drive
            Sine that drives the cycle.
        stuck : bool
            Whether the interface is stuck during the last cycles.
        """
        work = run.ledger["friction"]
        fields = {"loop": compute_sampled_loop(run.window, drive, work)}
        values = {"drift_per_cycle": 0.0}
        pairs = ()
        if self.has_friction:
            book = run.ledger | {"booked": work}
            values["work_check"] = compute_work_check(book | compute_sampled_work(run.window))
        if self.has_friction and run.reversals:
            slides, forces, slips = zip(*run.reversals)
            values["friction_force_peak"] = float(np.abs([*forces, *run.window.force]).max())
            values["slip_amplitude"] = float(np.ptp([*slips, *run.window.slip])) / 2
            pairs = (tuple(zip(slides, forces)),)
        return fields | {"integrated": IntegratedMeasures(values, reversals=pairs)}


class StableMotion(NamedTuple):
    """Reported steady motion, with its stability and notes on coexisting motions.

    - motion, stability: SteadyMotion without and with its Floquet multipliers.
    - notes: sentences on other motions under the same drive.
    """

    motion: SteadyMotion
    stability: SteadyMotion
    notes: tuple[str, ...] = ()


class BalanceFinder:
    """Solver for steady motions with memory laws or nonlinear springs, by harmonic balance.

    If several motions exist, the iteration starts from a given point of the response curve.
    """

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        self.model = model
        self.modes = model.rig.modes
        self.patch = patch
        self.harmonics = model.accuracy.harmonics
        self.numerics = numerics
        self.group = make_law_group(model, numerics, patch)
        self.tolerance = model.accuracy.tolerance
        self.say = say

    def compute_steady_motion(self, drive, guess=None) -> Solution:
        """Compute the steady motion under sinusoidal drive, with error estimates.

        The errors are estimated with twice as many harmonics and twice as many samples.

        Parameters
        ----------
        drive : SineDrive
            Amplitude [m s-2] and angular frequency [rad/s].
        guess : SteadyMotion, optional
            Initial guess from the response curve, for use if several motions exist.
        """
        begin = perf_counter()
        motion = self._solve_balance(drive, guess)
        motion, stability, notes = self._find_stable_motion(drive, motion)
        values, run = self._compute_measures(motion, drive)
        errors = self._estimate_errors(
            values,
            motion,
            drive,
            lambda motion, sine: self._compute_measures(
                motion, sine, 2 * BALANCE_SAMPLES_PER_CYCLE
            )[0],
        )

        # The instants of slip have at least the error of a sample, and a phase at most that of half a cycle.
        if "slip_start_phase" in errors:
            errors["slip_start_phase"] = max(
                min(errors["slip_start_phase"], np.pi / 2), 2 * np.pi / BALANCE_SAMPLES_PER_CYCLE
            )
            errors["stick_fraction"] = max(
                errors.get("stick_fraction", 0.0), 4 / BALANCE_SAMPLES_PER_CYCLE
            )
        name = balanced_regime(motion)
        regime = name if stability.stable else f"{name}, unstable"
        outcome = Outcome.STUCK if name == "stuck" else Outcome.STEADY
        message = ""
        if not stability.stable:
            outcome = Outcome.NOT_CONVERGED
            message = describe_instability(stability.multipliers)

        return Solution(
            values,
            run.window,
            run.window,
            outcome,
            [],
            run.ledger,
            perf_counter() - begin,
            message=message,
            errors=errors,
            notes=notes,
            settings=Settings(harmonics=motion.harmonics),
            periodic=SteadyData(regime, stability.multipliers),
        )

    def _solve_balance(self, drive, guess) -> SteadyMotion:
        """Solve the harmonic balance under a drive from an initial guess; None for none."""
        return periodic_point(
            self.modes, drive, self.group, self.harmonics, self.tolerance, start=guess
        )

    def _estimate_errors(self, values: Values, motion, drive, compute_measures) -> Values:
        """Estimate the errors of the measures of a steady motion from a solution with more harmonics.

        If that solution does not converge, the error estimate of the balance itself is used.

        Parameters
        ----------
        values : dict
            Measures by name.
        motion : SteadyMotion
            Solution of the balance, with the error of its truncation.
        drive : SineDrive
            Drive of the motion.
        compute_measures : callable
            Function (SteadyMotion, drive) that returns measures by name.
        """
        errors = {name: abs(v) * min(motion.error, 1.0) for name, v in values.items()}
        try:
            finer = refine_steady_motion(motion, self.modes, drive)
        except NotConverged:
            return errors
        return errors | finer_errors(values, compute_measures(finer, drive))

    def _find_stable_motion(self, drive, motion) -> StableMotion:
        """Return a steady motion if it is stable, otherwise the smallest stable one.

        If no motion under this drive is stable, the given motion is returned.
        """
        stability = self._add_stability(motion, drive)
        if stability.stable:
            return StableMotion(motion, stability)

        # An unstable motion is not seen in a test, so that all motions under this drive are compared.
        motions = []
        for slides in list_coexisting_slides(motion, drive):
            try:
                candidate = self._solve_balance(drive, slides)
            except NotConverged:
                continue
            motions.append(self._add_stability(candidate, drive))
        output = self.modes.output
        motions.sort(key=lambda steady_motion: steady_motion.amplitude(output))
        stable_motions = [steady_motion for steady_motion in motions if steady_motion.stable]
        if not stable_motions:
            return StableMotion(motion, stability)

        sizes = ", ".join(format_length(state.amplitude(output), 3) for state in motions)
        note = (
            f"at this drive {len(motions)} steady motions exist (amplitudes {sizes}), "
            f"{len(stable_motions)} of them stable"
        )
        if len(stable_motions) > 1:
            note += (
                "; the stable motion of smallest amplitude is shown; accuracy.method = "
                '"march" gives the motion that is reached from rest'
            )
        return StableMotion(stable_motions[0], stable_motions[0], (note,))

    def _add_stability(self, motion, drive) -> SteadyMotion:
        """Return a steady motion with its Floquet multipliers, from the map of a period of the engine `hybrid`."""
        multipliers = self._period_map.find_multipliers(drive, motion.modal_state)
        return replace(motion, multipliers=multipliers)

    @cached_property
    def _period_map(self) -> PeriodMap:
        """Map of a period of this rig."""
        return PeriodMap(self.model, self.numerics, self.patch, self.say)

    def observe(self, drive, guess=None, *, needs_histories: bool = True) -> ObservedMotion:
        """Compute what sensors see of the steady motion under a drive, without errors.

        Parameters
        ----------
        drive : SineDrive
            Amplitude [m s-2] and angular frequency [rad/s].
        guess : SteadyMotion, optional
            Steady motion under a similar drive.
        needs_histories : bool
            Whether histories are requested; they are always returned.
        """
        motion = self._solve_balance(drive, guess)
        window = make_cycle_response(motion, self.modes, drive, BALANCE_SAMPLES_PER_CYCLE)
        peak = compute_peak(window.acceleration)
        return ObservedMotion(window, peak, motion.amplitude(self._measured_row), motion)

    @property
    def _measured_row(self) -> np.ndarray:
        """Participation (n,) of the point whose displacement is measured."""
        return self.modes.output if self.modes.gauge is None else self.modes.gauge

    def _compute_curve_measures(self, motion, drive) -> Values:
        """Return a dict of the measures of a point of a response curve."""
        response = make_cycle_response(motion, self.modes, drive, BALANCE_SAMPLES_PER_CYCLE)
        values = {
            COLUMN_MEASURES["amplitude"]: motion.amplitude(self._measured_row),
            COLUMN_MEASURES["acceleration_peak"]: compute_peak(response.acceleration),
            **make_acceleration_measures(*find_acceleration_harmonics(response, drive)),
        }
        return {name: value for name, value in values.items() if value is not None}

    def _compute_measures(
        self, motion, drive, samples: int = BALANCE_SAMPLES_PER_CYCLE
    ) -> tuple[Values, CycleRun]:
        """Compute the measures of a steady motion by name, and its cycle, from samples.

        `motion` is a solution of the balance under the sinusoidal `drive`, and `samples` the number of samples per
        cycle.
        """
        window = make_cycle_response(motion, self.modes, drive, samples)
        energies = find_cycle_energies(motion, self.modes)
        speed = np.arange(len(motion.modal))[:, None] * motion.omega * np.abs(motion.modal)
        energies |= {
            "stored": 0.0,
            "iterations": float(motion.iterations),
            "power": abs(energies["work_in"]),
            "peak_stored": self.modes.mass / 2 * float(np.sum(speed**2)),
        }
        top = motion.amplitude(self.modes.output)
        middle = (window.output.max() + window.output.min()) / 2
        extremes = np.array([[middle - top, middle + top]])
        run = CycleRun(window, extremes, energies, motion.find_reversals())
        evaluator = BalanceEvaluator(self.model, self.numerics, self.patch)
        return evaluator.evaluate_measures(run, drive), run

    def trace_curve(self, drive) -> ResponseCurve:
        """Compute the response curve over frequency by continuation through its folds."""
        first = SineDrive(drive.acceleration, 2 * np.pi * drive.low, drive.moving)
        branch = branches.trace_over_frequency(
            self.modes,
            first,
            self.group,
            (drive.low, drive.high),
            self.harmonics,
            self.tolerance,
        )
        points = [self._make_curve_point(point, first) for point in branch.points]
        return ResponseCurve(points, branch.folds, tuple(_note_end_of_branch(branch, drive.high)))

    def measure_curve_distance(self, first: CurvePoint, second: CurvePoint) -> float:
        """Return the arc length between two points of a response curve.

        The frequency is scaled by the width of the sweep.
        """
        return branches.measure_distance(first.guess, second.guess, self._sweep_width)

    def compute_point_between(
        self, first: CurvePoint, second: CurvePoint, fraction: float
    ) -> CurvePoint:
        """Compute the curve point at a fraction of the arc length between two points.

        The balance is solved in the hyperplane normal to the line between these points.

        Parameters
        ----------
        first, second : CurvePoint
            Neighbouring points of a branch.
        fraction : float
            Fraction of the arc length between the points, from the first one.
        """
        drive = replace(first.drive, omega=first.guess.omega)
        motion = branches.find_point_between(
            self.modes, drive, first.guess, second.guess, fraction, self._sweep_width
        )
        return self._make_curve_point(motion, drive)

    @property
    def _sweep_width(self) -> float:
        """Width of the swept frequency range [rad/s]."""
        drive = self.model.rig.drive.signal
        return 2 * np.pi * abs(drive.high - drive.low)

    def _make_curve_point(self, motion, drive) -> CurvePoint:
        """Convert a steady motion on a branch to a curve point with error estimates."""
        sine = SineDrive(motion.level, motion.omega, drive.moving)
        motion = self._add_stability(motion, sine)
        values = self._compute_curve_measures(motion, sine)
        errors = self._estimate_errors(values, motion, sine, self._compute_curve_measures)
        for name in errors:
            errors[name] += HARMONIC_ROUND_OFF * abs(values[name])
        if "acceleration_distortion" in errors:
            errors["acceleration_distortion"] += HARMONIC_ROUND_OFF
        return CurvePoint(
            sine,
            values,
            errors,
            "stable" if motion.stable else "unstable",
            float(np.abs(motion.multipliers).max(initial=0.0)),
            bool(motion.stable),
            motion,
        )


def _note_end_of_branch(branch: branches.Branch, last: float) -> list[str]:
    """Return a note if a branch ends before the last frequency [Hz] of the sweep, else an empty list."""
    if branch.ended == "end":
        return []
    frequencies = [point.omega / (2 * np.pi) for point in branch.points]
    reached = min(frequencies, key=lambda frequency: abs(frequency - last))
    return [
        f"the curve of steady motions reaches {format_quantity(reached, 'Hz', 4)} and not the end of the sweep at "
        f"{format_quantity(last, 'Hz', 4)}: {REASONS_OF_END[branch.ended]}; the largest motion is that of this part, so "
        "change drive.from or drive.to"
    ]
