"""Steady motion of a rig by shooting with the map of a period of the engine `event_driven`.

In: a Model, its Numerics and its Patch. Out: the Solution under a sine (`event_driven.periodic`) with its regime, Floquet
multipliers and stability, and the largest motion of a response curve over frequency, by continuation through its folds
where it may have some (`event_driven.periodic_curves`).
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from time import process_time

import numpy as np

from .... import kernel_cache
from ....core import NotConverged, Outcome, PatchfemError, SineDrive, max_abs
from ....event_driven import cases, periodic
from ....event_driven.laws import is_rigid, masing
from ....event_driven.periodic_curves import (
    MotionCurve,
    PathPoint,
    PathSettings,
    measure_distance,
)
from ....event_driven.records import Face, Probe, Setting, Status, Window
from ....formatting import format_length
from ....measures.measures import Values
from ....measures.rows import AMPLITUDE, select_names
from ....measures.spectrum import make_acceleration_measures
from ....structure.response import compute_receptance
from ...results.result import SteadyData
from ..engines import enlarge_event_driven_steps, estimate_event_driven_errors, may_fold
from ..evaluation import Solution, SteadyPart
from ..event_to_event import LumpedEvaluator
from ..joints import make_joints
from .curves import (
    COLUMN_MEASURES,
    SENSED_COLUMNS,
    CurvePoint,
    ObservedMotion,
    ResponseCurve,
    describe_instability,
    estimate_point_errors,
    note_end_of_curve,
    sample_adaptively,
)
from .estimates import PeakEstimate
from .peaks import solve_peak

N_SWEEP_POINTS = 121  # Number of points of a response curve before its refinement.

# Cycles from rest within which a lifted mass leaves its grooves, if it leaves them at all.
N_CYCLES_IN_GROOVES = 30
RTOL = 1e-11  # tolerance of a step, so that the change over a period is far below the motion
STEPS_ERROR = 100.0  # error of a periodic motion that is due to its steps, relative to RTOL
N_CYCLES = 2.0  # computed cycles of a periodic motion, so that each stick is complete
# Relative distance from its friction limit at which an interface slips as a whole
FULL_SLIP_TOL = 1e-9
# Steps along a response curve over frequency
FREQUENCY_PATH = PathSettings(first_step=0.0125, max_step=0.05)
# Weakest and strongest drive between which the motions are followed that coexist under a drive, relative to it, and the
# steps along this curve
WEAK_DRIVE = 1e-2
MAX_LEVEL_RATIO = 10.0
LEVEL_PATH = PathSettings(first_step=0.005, max_step=0.05)


class ShootingFinder:
    """Solver for steady motions of a rig by shooting: Newton's method for the state that returns after one period."""

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        self.model = model
        self.modes = model.rig.modes
        self.patch = patch
        self.frames = frames
        self.numerics = replace(
            numerics, cycles=N_CYCLES, window=1, local=RTOL, steps=cases.MIN_STEPS, whole=True
        )
        self.draws_curve = numerics.whole
        kernel_cache.report_compilation_to(say)
        self.joints = make_joints(model, self.numerics, patch)
        self.may_fold = may_fold(model)

        # The neighbours of a curve of Iwan's law are the better starts; undamped, its motion may have no bound.
        laws = [law for law, _ in self.joints.laws]
        have_elements = all(law.law == "masing" for law in laws)
        is_odd = all(
            law.law in ("masing", "coulomb") and not load.varies for law, load in self.joints.laws
        )
        self.odd_laws = laws if is_odd and not model.rig.springs.is_nonlinear else ()
        is_smooth = have_elements and any(masing.has_power_law(law) for law in laws)
        self.follows_curve = self.may_fold or (
            self.draws_curve and is_smooth and self._max_growth_rate < 0
        )
        self.evaluator = LumpedEvaluator(model, self.numerics, patch, self.joints)
        # Width of the last peak that was estimated [rad/s], in which the curve falls to 0.9 of its height
        self.estimated_width = np.inf

    def make_case(self, drive) -> cases.Case:
        """Return the inputs of the engine for one period from rest under a sine."""
        schedule = cases.Schedule(1.0, 1, np.zeros(0), np.inf)
        rig = self.model.rig
        return cases.make_rig_case(rig, self.joints.laws, schedule, signal=drive, rtol=RTOL)

    def _vary(self, drive: SineDrive, make_drive: Callable[[float], SineDrive]):
        """Return a function of a parameter that returns the case of its drive, with the arrays of that of another drive.

        Under a load that oscillates each case has arrays of its own, because the longest step depends on both periods.
        """
        case = self.make_case(drive)
        if case.rig.faces[:, Face.SWING].any():
            return lambda parameter: self.make_case(make_drive(parameter))
        step_ratio = case.rig.settings[Setting.LONGEST_STEP] / case.rig.settings[Setting.PERIOD]

        def make_case(parameter: float) -> cases.Case:
            """Return the case of a period under the drive of a parameter."""
            sine = make_drive(parameter)
            settings = case.rig.settings.copy()
            settings[[Setting.OMEGA, Setting.PERIOD]] = sine.omega, sine.period
            settings[Setting.LONGEST_STEP] = step_ratio * sine.period
            tones = np.array([[sine.acceleration, sine.omega, 0.0]])
            rig = case.rig._replace(settings=settings, tones=tones)
            return replace(case, rig=rig, ends=np.array([sine.period]))

        return make_case

    def find_periodic_motion(
        self, drive, guess=None, *, needs_stability: bool = True
    ) -> periodic.PeriodicMotion:
        """Find the periodic motion under sinusoidal drive, from rest or from a similar motion.

        Parameters
        ----------
        drive : SineDrive
            Amplitude [m s-2] and angular frequency [rad/s].
        guess : periodic.Start, optional
            Start of a similar motion.
        needs_stability : bool
            Whether multipliers and errors are needed. Without them a change over a period of MAX_KINKED_CHANGE counts as
            none, and a motion that is found from a guess takes a few periods.

        Raises
        ------
        NotConverged
            If no motion is found that repeats after each cycle.
        """
        # A damped motion whose stability does not matter follows from its guess in a few periods; any other is searched.
        case = self.make_case(drive)
        is_undamped = self._max_growth_rate * drive.period > -periodic.UNDAMPED_TOL
        if guess is None or needs_stability or is_undamped:
            motion = periodic.find_periodic_motion(
                case,
                start=None if guess is None else guess.state,
                n_first=periodic.N_FIRST_CYCLES if guess is None else 1,
                has_kinks=self.joints.has_kinks,
                is_undamped=is_undamped,
                odd_laws=() if guess is None or self.draws_curve else self.odd_laws,
            )
        else:
            motion = periodic.follow_periodic_motion(case, guess, self.odd_laws)
        if motion.grows:
            return motion

        # The motion must repeat, as closely as its caller needs it.
        tolerance = motion.tolerance
        if not needs_stability:
            tolerance = max(tolerance, periodic.MAX_KINKED_CHANGE)
        if motion.run.status != Status.DONE or not motion.change <= tolerance:
            raise NotConverged(
                f"no periodic motion was found: the motion still changes by {motion.change:.2g} of its amplitude from "
                'one cycle to the next; use accuracy.method = "auto"'
            )
        return motion

    def compute_steady_motion(self, drive, guess=None) -> Solution:
        """Compute the steady motion under sinusoidal drive, from rest or from a similar motion.

        If the lifted mass leaves its grooves, there is no steady motion. The Solution is then that of the motion that
        leaves them.
        """
        begin = process_time()
        # A run from rest shows whether the lifted mass leaves its grooves; then no motion is steady.
        run = self._leave_grooves(drive)
        if run is not None:
            solution = self.evaluator.make_solution(run, process_time() - begin, drive)
            errors = {name: RTOL * abs(value) for name, value in solution.values.items()}
            data = SteadyData("leaves its grooves", np.zeros(0))
            return replace(solution, steady=SteadyPart(data, errors))

        # The periodic motion is run once more from its state, for histories and frames.
        motion, notes = self._find_stable_motion(drive, guess)
        state = None if motion.grows else motion.run.final
        cycles = periodic.N_GROWTH_CYCLES if motion.grows else N_CYCLES
        run = self.evaluator.resume(drive, cycles, state, self.frames)
        is_stuck = self.evaluator.is_stuck(run)
        solution = self.evaluator.make_solution(run, process_time() - begin, drive)
        values = dict(solution.values)

        # The errors are those of the steps, which a run with larger ones shows, and of the fixed point.
        coarse = LumpedEvaluator(
            self.model, enlarge_event_driven_steps(self.numerics), self.patch, self.joints
        )
        coarse_run = coarse.resume(drive, run.cycles_done, state, 0)
        coarse_values = coarse.evaluate_measures(coarse_run, drive)
        step_errors = estimate_event_driven_errors(values, coarse_values, RTOL)
        relative = find_relative_error(motion)
        errors = {}
        for name, value in values.items():
            errors[name] = step_errors.get(name, RTOL * abs(value)) + relative * abs(value)

        # A periodic motion does not drift. Friction works what it dissipates, which is nothing where no element slips.
        dissipated = values.get("energy_dissipated")
        values["drift_per_cycle"] = errors["drift_per_cycle"] = 0.0
        if is_stuck and dissipated is not None:
            values |= {"friction_work": dissipated, "loop_area": dissipated / run.cycles_done}
            if not dissipated:
                errors |= dict.fromkeys(("friction_work", "energy_dissipated", "loop_area"), 0.0)

        # An unstable motion is no result, because a rig would not stay in it.
        regime = self._name_regime(motion, is_stuck=is_stuck)
        message = run.message
        outcome = Outcome.STUCK if is_stuck else run.outcome or Outcome.STEADY
        if motion.grows:
            outcome = Outcome.GROWS
        elif max_abs(run.extremes) > self.model.rig.springs.travel:
            outcome = Outcome.EXCEEDS_TRAVEL
        if not (is_stuck or motion.grows or motion.is_stable):
            outcome = Outcome.NOT_CONVERGED
            regime = f"{regime}, unstable"
            message = describe_instability(motion.multipliers)
        data = SteadyData(regime, motion.multipliers, motion.change)
        run = replace(run, outcome=outcome, message=message)
        steady = SteadyPart(data, errors, notes)
        return replace(solution, values=values, run=run, steady=steady)

    def compute_point_values(self, point: CurvePoint) -> Values:
        """Return the measures of the steady motion at a curve point by name; {} if there is none."""
        motion = point.guess.motion if isinstance(point.guess, PathPoint) else point.guess
        if motion is None:
            try:
                return self.compute_steady_motion(point.drive).values
            except NotConverged:
                return {}
        # Sums over a run grow with its cycles.
        sums = dict.fromkeys(select_names("run"), N_CYCLES)
        values = motion.run.values.items()
        return {name: sums.get(name, 1.0) * value for name, value in values if np.isfinite(value)}

    def _find_stable_motion(self, drive, guess) -> tuple[periodic.PeriodicMotion, tuple[str, ...]]:
        """Return a periodic motion, and notes on others under the same drive.

        An unstable motion is not seen in a test. Where the curve of the motions may have folds, all of them are then
        compared, and the smallest stable one is returned, or the first one if there is none.

        Parameters
        ----------
        drive : SineDrive
            Amplitude [m s-2] and angular frequency [rad/s].
        guess : PeriodicMotion, PathPoint or None
            Similar motion, or the point of a response curve that has this drive.
        """
        # A point of a response curve has its periodic motion already; else it is found from the guess.
        if isinstance(guess, PathPoint):
            motion = guess.motion
        else:
            try:
                motion = self.find_periodic_motion(drive, guess and guess.start)
            except NotConverged:
                motion = None
                if not self.may_fold:
                    # A neighbour of a point of a curve may be too far away as a start.
                    if guess is None:
                        raise
                    motion = self.find_periodic_motion(drive)
        if not self.may_fold or (motion is not None and (motion.is_stable or motion.grows)):
            return motion, ()

        # All motions under the drive; without them the one that was found remains.
        try:
            motions = self._list_coexisting_motions(drive)
        except NotConverged:
            if motion is None:
                raise
            motions = [motion]

        # Without a stable motion there is nothing to compare.
        stable_motions = [other for other in motions if other.is_stable]
        if not stable_motions:
            motions = motions if motion is None else [motion]
            if not motions:
                raise NotConverged(
                    "no periodic motion was found, neither from rest nor from weaker drives; use accuracy.method = "
                    '"march"'
                )
            return motions[0], ()

        amplitudes = [other.run.values[AMPLITUDE] for other in motions]
        sizes = ", ".join(format_length(amplitude, 3) for amplitude in amplitudes)
        note = (
            f"at this drive {len(motions)} steady motions exist (amplitudes {sizes}), "
            f"{len(stable_motions)} of them stable"
        )
        if len(stable_motions) > 1:
            note += (
                "; the stable motion of smallest amplitude is shown; accuracy.method = "
                '"march" gives the motion that is reached from rest'
            )
        return stable_motions[0], (note,)

    def _list_coexisting_motions(self, drive) -> list[periodic.PeriodicMotion]:
        """Return the periodic motions under a drive in increasing amplitude.

        The curve of the motions over the drive level begins near rest and passes the level once for each of them, through
        its folds up to MAX_LEVEL_RATIO of the level.
        """
        level = drive.acceleration
        weak = replace(drive, acceleration=WEAK_DRIVE * level)
        start = self.find_periodic_motion(weak).run.final
        equations = MotionCurve(
            self._vary(weak, lambda level: replace(drive, acceleration=level)),
            start,
            weak.acceleration,
            has_kinks=self.joints.has_kinks,
        )
        path = equations.follow((0.0, MAX_LEVEL_RATIO * level), LEVEL_PATH)
        motions = [point.motion for point in equations.list_crossings(path, level)]
        return sorted(motions, key=lambda motion: motion.run.values[AMPLITUDE])

    def _leave_grooves(self, drive):
        """Return the run from rest in which the lifted mass leaves the grooves, or None if it stays in them."""
        if self.model.grooves is None or not self.model.grooves.lifted_mass:
            return None
        run = self.evaluator.resume(drive, N_CYCLES_IN_GROOVES, None, 0)
        return run if run.outcome is Outcome.LEAVES_GROOVES else None

    def _name_regime(self, motion, *, is_stuck: bool) -> str:
        """Return the name of the regime of a periodic motion, such as "stuck", "2 stops" per period or "partial slip"."""
        if motion.grows:
            return "unbounded"
        if is_stuck:
            return "stuck"
        laws = [law for law, _ in self.joints.laws]
        faces = motion.run.record.faces[: len(laws)]
        if laws and all(law.law == "masing" for law in laws):
            limits = np.array([law.numbers[2] for law in laws])
            forces = motion.run.record.get_face_extremes(Probe.FORCE)[: len(laws)]
            slides = (np.abs(forces).max(axis=1) >= limits * (1 - FULL_SLIP_TOL)).all()
            return "slides" if slides else "partial slip"
        if self.may_fold:
            return "slides" if laws else "no friction"
        if not any(is_rigid(law.law) for law in laws):
            return "sliding"
        lasts = faces[:, Window.STUCK] > periodic.MIN_STOP * motion.period
        n_stops = int((faces[:, Window.STARTS] * lasts).max())
        return f"{n_stops} stop{'s' * (n_stops != 1)}" if n_stops else "sliding"

    def compute_curve_point(self, drive, guess=None, *, needs_stability: bool = True) -> CurvePoint:
        """Compute one point of a response curve, starting from a neighbouring motion or from rest.

        Without friction it has a closed form, except for an undamped resonance.

        Parameters
        ----------
        drive : SineDrive
            Drive of the point.
        guess : periodic.Start, optional
            Start of a neighbouring motion; from rest by default.
        needs_stability : bool
            Whether the multipliers and the errors of the motion are needed.
        """
        # Two motions need no search: that of a linear rig, and that of a mass that leaves its grooves.
        is_linear = not (self.joints.laws or self.model.rig.springs.is_nonlinear)
        point = self._compute_linear_point(drive) if is_linear else None
        if point is not None:
            return point
        if self._leave_grooves(drive) is not None:
            regime = "leaves its grooves"
            return CurvePoint(drive, {}, {}, regime, np.nan, False)

        # A neighbour beyond a jump of the curve may be too far away as a start.
        try:
            motion = self.find_periodic_motion(drive, guess, needs_stability=needs_stability)
        except NotConverged:
            if guess is None:
                raise
            motion = self.find_periodic_motion(drive, needs_stability=needs_stability)
        if motion.grows:
            return CurvePoint(drive, {}, {}, "unbounded", 1.0, False)

        # An interface sticks if it slips by no more than the tolerance.
        slips = np.ptp(motion.run.record.get_face_extremes(Probe.SLIP), axis=1)
        slips = slips[: len(self.joints.laws)]
        is_stuck = bool((slips <= self.joints.stick_tolerance).all()) and not self.evaluator.creeps
        regime = self._name_regime(motion, is_stuck=is_stuck)
        is_stable = is_stuck or motion.is_stable
        if not is_stable:
            regime = f"{regime}, unstable"
        return _make_curve_point(drive, motion, regime, motion, is_stable=is_stable)

    def observe(self, drive, guess=None, *, needs_histories: bool = True) -> ObservedMotion | None:
        """Compute what sensors see of the periodic motion under a drive, without errors; None if it is unbounded.

        Parameters
        ----------
        drive : SineDrive
            Amplitude [m s-2] and angular frequency [rad/s].
        guess : PeriodicMotion, optional
            Similar motion.
        needs_histories : bool
            Whether the histories of a cycle are needed.
        """
        start = guess and guess.start
        point = self.compute_curve_point(drive, start, needs_stability=False)
        if not point.values:
            return None
        window = None
        if needs_histories:
            # The closed form of a linear rig has no state from which a cycle starts.
            motion = point.guess if self.joints.laws else self.find_periodic_motion(drive)
            window = self.evaluator.resume(drive, N_CYCLES, motion.run.final, 0).window
        sensed = [point.values.get(COLUMN_MEASURES[name]) for name in SENSED_COLUMNS]
        amplitude, peak, fundamental = sensed
        return ObservedMotion(window, peak, amplitude, point.guess, fundamental)

    def _compute_linear_point(self, drive) -> CurvePoint | None:
        """Return the point of a response curve of a linear rig in closed form, or None at an undamped resonance."""
        modes = self.modes
        try:
            rows = [modes.displacement_point, modes.output]
            receptance = compute_receptance(modes, drive.omega, rows, modes.base)
        except PatchfemError:
            return None
        at_gauge, at_output = receptance[0, :, 0] * modes.mass
        acceleration = drive.acceleration * float(abs(drive.moving + drive.omega**2 * at_output))
        values = {
            COLUMN_MEASURES["amplitude"]: drive.acceleration * float(abs(at_gauge)),
            COLUMN_MEASURES["acceleration_peak"]: acceleration,
            **make_acceleration_measures(acceleration, 0.0),
        }
        values = {name: value for name, value in values.items() if value is not None}
        multiplier = float(np.exp(self._max_growth_rate * drive.period))
        errors = estimate_point_errors(values)
        return CurvePoint(drive, values, errors, "sliding", multiplier, True)

    @cached_property
    def _max_growth_rate(self) -> float:
        """Largest growth rate [1/s] of the free motions without friction; negative if all of them decay."""
        n = self.modes.omega.size
        state = np.block(
            [
                [np.zeros((n, n)), np.eye(n)],
                [-np.diag(self.modes.omega**2), -self.modes.damping_matrix],
            ]
        )
        return float(np.linalg.eigvals(state).real.max())

    def trace_curve(self, drive) -> ResponseCurve:
        """Compute the response curve over frequency, by continuation if it may have folds or if Iwan's law is drawn.

        Other curves, and those of Iwan's law that are not followed to their end, start with N_SWEEP_POINTS frequencies and
        the natural frequencies. Each point starts from the motion at the previous one. The curve is refined by
        `sample_adaptively`.
        """
        if self.follows_curve:
            curve = self._follow_curve(drive)
            if self.may_fold or not curve.notes:
                return curve
            # A curve without folds that was not followed to its end is sampled, and refined by its frequencies.
            self.follows_curve = False
        if not self.draws_curve:
            try:
                points = self._estimate_peaks(drive)
            except NotConverged:
                points = []
            if points:
                return ResponseCurve(points)

        def sample(frequency, before):
            """Return the amplitude [m] at a frequency [Hz], and the curve point.

            `before` is the pair that this function returned for the frequency before, or None.
            """
            sine = SineDrive(drive.acceleration, 2 * np.pi * frequency, drive.moving)
            guess = before and before[1].guess
            point = self.compute_curve_point(sine, guess and guess.start)
            return point.values.get(COLUMN_MEASURES["amplitude"], np.nan), point

        frequencies = choose_start_frequencies(self.modes, drive)
        samples = sample_adaptively(sample, frequencies)
        return ResponseCurve([point for _, point in samples])

    def _estimate_peaks(self, drive) -> list[CurvePoint]:
        """Return a few points near the high maxima of a response curve; [] if its harmonics are not balanced."""
        if not self.odd_laws or self._max_growth_rate >= 0:
            return []
        omega = 2 * np.pi * np.sort(choose_start_frequencies(self.modes, drive))
        estimate = PeakEstimate(self, drive, omega)
        points = estimate.find_points()
        self.estimated_width = estimate.width
        return points

    def _follow_curve(self, drive) -> ResponseCurve:
        """Compute the response curve over frequency by continuation along its arc length, through its folds."""
        first = SineDrive(drive.acceleration, 2 * np.pi * drive.low, drive.moving)
        motion, _ = self._find_stable_motion(first, None)
        if motion.grows:
            raise NotConverged(
                "accuracy.method: the motion at the first frequency of the sweep grows for ever; change drive.from"
            )
        self._equations = MotionCurve(
            self._vary(first, lambda omega: replace(first, omega=omega)),
            motion.run.final,
            first.omega,
            has_kinks=self.joints.has_kinks,
        )
        ends = 2 * np.pi * np.array([drive.low, drive.high])
        bounds = (float(ends.min()), float(ends.max()))
        path = self._equations.follow(bounds, FREQUENCY_PATH, forward=drive.high > drive.low)
        points = [self._describe_path_point(point) for point in path.points]
        folds = np.array([path.folds, path.fold_errors]) / (2 * np.pi)
        return ResponseCurve(
            points, folds, tuple(note_end_of_curve(points, path.ended, drive.high))
        )

    def _describe_path_point(self, point: PathPoint) -> CurvePoint:
        """Return the CurvePoint of a point that the continuation has found."""
        signal = self.model.rig.drive.signal
        motion = point.motion
        regime = "stable" if motion.is_stable else "unstable"
        if not self.may_fold:
            name = self._name_regime(motion, is_stuck=False)
            regime = name if motion.is_stable else f"{name}, unstable"
        drive = SineDrive(signal.acceleration, float(point.w[-1]), signal.moving)
        return _make_curve_point(drive, motion, regime, point, is_stable=motion.is_stable)

    def _sweep_width(self) -> float:
        """Return the width of the swept frequency range [rad/s]."""
        drive = self.model.rig.drive.signal
        return 2 * np.pi * abs(drive.high - drive.low)

    def measure_curve_distance(self, first: CurvePoint, second: CurvePoint) -> float:
        """Return the distance between two points of a response curve: its scaled arc length, or [rad/s] if it is sampled."""
        if self.follows_curve:
            return measure_distance(first.guess, second.guess, self._sweep_width())
        return abs(second.drive.omega - first.drive.omega)

    def measure_missing_ends(self, points: list[CurvePoint]) -> tuple[float, float]:
        """Return the distances [rad/s] of the first and the last point of a curve from the ends of the sweep."""
        if self.follows_curve:
            return 0.0, 0.0
        drive = self.model.rig.drive.signal
        ends = 2 * np.pi * np.array([drive.low, drive.high])
        first, last = np.abs(ends - [points[k].drive.omega for k in (0, -1)])
        return float(first), float(last)

    def compute_point_between(
        self, first: CurvePoint, second: CurvePoint, fraction: float
    ) -> CurvePoint:
        """Compute the curve point at a fraction of the distance between two points.

        Parameters
        ----------
        first, second : CurvePoint
            Neighbouring points of the curve.
        fraction : float
            Fraction of the distance between the points, from the first one.
        """
        if self.follows_curve:
            point = self._equations.find_between(
                first.guess, second.guess, fraction, self._sweep_width()
            )
            if point is None:
                raise NotConverged(
                    "accuracy.method: no steady motion was found between two neighbouring points of the curve; "
                    'use accuracy.method = "march"'
                )
            return self._describe_path_point(point)
        omega = first.drive.omega + fraction * (second.drive.omega - first.drive.omega)
        sine = replace(first.drive, omega=omega)
        guesses = [point.guess.start for point in (first, second) if point.guess is not None]
        guess = guesses[0].interpolate(guesses[-1], fraction) if guesses else None
        return self.compute_curve_point(sine, guess, needs_stability=self.draws_curve)


def choose_start_frequencies(modes, drive) -> np.ndarray:
    """Return the frequencies [Hz] of a response curve before its refinement.

    They are N_SWEEP_POINTS frequencies over the range, and the natural frequencies in it, where a
    peak may be narrower than the spacing.
    """
    space = np.geomspace if drive.logarithmic else np.linspace
    ends = sorted((drive.low, drive.high))
    natural = modes.omega / (2 * np.pi)
    natural = natural[(natural > ends[0]) & (natural < ends[1])]
    frequencies = np.union1d(space(*ends, N_SWEEP_POINTS), natural)
    frequencies = frequencies[np.append(True, np.diff(frequencies) > 1e-9 * frequencies[1:])]
    return frequencies if drive.low < drive.high else frequencies[::-1]


def _make_curve_point(
    drive: SineDrive, motion: periodic.PeriodicMotion, regime: str, guess, *, is_stable: bool
) -> CurvePoint:
    """Return the point of a response curve with a periodic motion.

    Parameters
    ----------
    drive : SineDrive
    motion : PeriodicMotion
    regime : str
        Its name.
    guess : PeriodicMotion or PathPoint
        Guess for the motion at a neighbouring drive.
    is_stable : bool
        Whether the motion is stable or sticks.
    """
    values = {name: motion.run.values[name] for name in COLUMN_MEASURES.values()}
    values = {name: value for name, value in values.items() if np.isfinite(value)}
    sizes = np.abs(motion.multipliers)
    return CurvePoint(
        drive=drive,
        values=values,
        errors=estimate_point_errors(values, find_relative_error(motion)),
        regime=regime,
        multiplier=float(sizes.max()) if sizes.size else np.nan,
        stable=is_stable,
        guess=guess,
    )


def find_relative_error(motion: periodic.PeriodicMotion) -> float:
    """Return the error of a periodic motion relative to its size [1].

    It is the error of the fixed point of the map of a period, plus that of the time steps within the period.
    """
    return motion.error + STEPS_ERROR * RTOL


def solve_steady_motion(model, numerics, patch, frames: int = 0, say=None) -> Solution:
    """Compute the steady motion under a sine, or the largest one over a sweep.

    The drive of the largest motion is `Solution.drive`.

    Parameters
    ----------
    model : Model
        Rig, drive and friction laws.
    numerics : Numerics
        Settings of the run, from which the finder makes its own.
    patch : Patch or None
        None under [normal] and between masses.
    frames : int
        Number of snapshots of the interface in a cycle.
    say : callable, optional
        Callback for a line of text.

    Returns
    -------
    Solution
    """
    finder = ShootingFinder(model, numerics, patch, frames, say)
    drive = model.rig.drive.signal
    if isinstance(drive, SineDrive):
        return finder.compute_steady_motion(drive)
    return solve_peak(finder.trace_curve(drive), finder)
