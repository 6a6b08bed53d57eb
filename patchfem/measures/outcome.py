"""Outcome and steady amplitude of a coupled run.

In: a Solution with the extremes and phasors of its cycles, its measures, the tolerance and the
drive. Out: the outcome (`judge_outcome`), the steady amplitude as a measure, and warnings. The
definition of a steady motion depends on the kind of drive. `settling` has the criteria.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .. import structure
from ..core import Measure, Outcome, compute_allowed_error
from . import stationary
from .measures import Measures
from .rows import AMPLITUDE, STEADY_AMPLITUDE
from .settling import (
    MOTION_CLASSES,
    MotionEnds,
    classify_motions,
    estimate_ringing,
    join_cycles,
    judge_motions,
    measure_windows,
    select_reported,
)

OPEN_LOOP_MESSAGE = "the friction loop of the last cycle does not close"
# Round-off error of an amplitude, relative to the displacement a/omega^2 of the drive.
AMPLITUDE_ROUND_OFF = 1e-12


def judge_outcome(
    solution,
    measures: Measures,
    limits: tuple[float, float],
    drive,
    level_cycles: float = 0.0,
    repeat: float | None = 1.0,
) -> tuple[Outcome, Measures]:
    """Classify the motion of a run, and estimate the amplitude at which it becomes steady.

    - Periodic drive, or last level of a drive in levels: the outcome follows from the amplitudes of
      successive windows, their steady estimate and the remaining free motion (`settling.judge_motions`). If a
      steady motion will still change, the steady estimate is returned (`settling.select_reported`). If the load has
      another period than the drive, the cycles of their common period count as one; without a common period in
      the window, no motion is steady.
    - Release or step: STEADY if the amplitude is below its floor, i.e. at rest; otherwise as above,
      but a release grows only if a mode gains energy.
    - Sweep or recorded signal: TRANSIENT without a steady estimate, unless the interface sticks.
    - Random drive: DONE if both halves of the record have the same mean square.

    A motion whose midpoint drifts is not steady (`is_drifting`), nor is a stuck interface whose
    friction force still increases, or above which the rig still vibrates freely.

    Parameters
    ----------
    solution : Solution
        Extremes and phasors of the cycles, and the window.
    measures : dict
        Measures by name; they are not changed.
    limits : tuple
        Relative tolerance of the scene, and smallest decay rate of a mode [1/s]; negative if a mode gains energy.
    drive
        Drive of the last cycles.
    level_cycles : float
        Number of cycles per level; 0 without levels.
    repeat : float, optional
        Number of cycles after which drive and load repeat (`Rig.count_repeat_cycles`).

    Returns
    -------
    outcome : Outcome
    steady : dict
        The measure relative_displacement_amplitude_steady [m] by its name; {} if it is not reported.
    """
    known = _find_outcome_without_cycles(solution, measures, limits, drive, level_cycles)
    if known is not None:
        return known, {}

    # The levels before the last one have other amplitudes.
    last_level = slice(-int(level_cycles), None) if level_cycles else slice(None)
    cycles = _Cycles(
        np.asarray(solution.extremes, float)[last_level],
        solution.phasors[last_level] if structure.drive_sizes.is_sinusoidal(drive) else None,
        structure.drive_sizes.count_cycles(solution.window.time, drive),
        AMPLITUDE_ROUND_OFF * _find_displacement_scale(drive),
    )
    if not structure.drive_sizes.is_periodic(drive):
        return _judge_aperiodic_motion(cycles, measures, limits, drive), {}

    # Without a common period of drive and load in the window, no motion is steady.
    count = int(repeat or 1)
    tolerance, min_decay_rate = limits
    if cycles.window % count:
        outcome = cycles.classify(tolerance)
        return Outcome.TRANSIENT if outcome is Outcome.STEADY else outcome, {}
    decay = max(min_decay_rate, 0.0) * cycles.window * drive.period
    classes, steady = cycles.judge(count, tolerance, decay)
    outcome = MOTION_CLASSES[classes[0]]

    # For several tones, the drift from cycle to cycle is part of their beat.
    drift = np.inf if count == 1 else cycles.find_drift()
    if outcome is Outcome.STEADY and _has_drift(measures, tolerance, drift):
        outcome = Outcome.TRANSIENT
    if not level_cycles and find_ringing(solution, measures, limits, drive) > 0:
        outcome = Outcome.TRANSIENT

    amplitude = measures[AMPLITUDE]
    error = amplitude.error or 0.0
    steady = select_reported(steady, np.array([outcome]), amplitude.value, error, tolerance)
    if np.isnan(steady).any():
        return outcome, {}
    value, error = steady[:, 0].tolist()
    return outcome, {STEADY_AMPLITUDE: Measure(value, "m", error, amplitude.floor)}


def _find_outcome_without_cycles(
    solution, measures: Measures, limits: tuple[float, float], drive, level_cycles: float
) -> Outcome | None:
    """Return the outcome of a motion that follows without a comparison of its cycles; None for other motions.

    The parameters are those of `judge_outcome`: a Solution, its measures by name, the tolerance and the smallest decay rate
    [1/s], the drive, and the number of cycles per level.
    """
    is_random = hasattr(drive, "band")
    is_stuck = solution.outcome is Outcome.STUCK and not is_random
    if is_stuck and is_still_loading(solution.window, drive.period, limits[0]):
        return Outcome.TRANSIENT

    # An outcome that the engine knows is final, unless the rig still vibrates above its stuck interfaces.
    is_ringing = not level_cycles and find_ringing(solution, measures, limits, drive) > 0
    if solution.outcome is not None and not is_ringing:
        return solution.outcome

    # These drives have no cycles that could be compared.
    if is_random:
        is_stationary = stationary.is_stationary(solution.window, drive)
        return Outcome.DONE if is_stationary else Outcome.TRANSIENT
    if not drive.segments and structure.drive_sizes.count_repeat_cycles(drive) is None:
        return Outcome.TRANSIENT
    return None


class _Cycles(NamedTuple):
    """Cycles of a motion by which its outcome is judged.

    - extremes (k, 2): smallest and largest output of each cycle [m].
    - phasors (k,): first harmonic of the output in each cycle [m]; None under another drive than a sine.
    - window: number of cycles of a window.
    - floor: amplitude that is round-off [m].
    """

    extremes: np.ndarray
    phasors: np.ndarray | None
    window: int
    floor: float

    def classify(self, tolerance: float) -> Outcome:
        """Return the outcome that follows from the amplitudes of the windows alone."""
        amplitude = measure_windows(self.extremes, self.window).amplitude
        return MOTION_CLASSES[classify_motions(amplitude[None], tolerance, self.floor)[0]]

    def find_drift(self) -> float:
        """Return the drift of the midpoint [m] per cycle, from window to window."""
        return measure_windows(self.extremes, self.window).find_drift(self.window)

    def judge(self, count: int, tolerance: float, decay: float) -> MotionEnds:
        """Return the class of the motion and its steady amplitude, as arrays over one motion.

        Parameters
        ----------
        count : int
            Number of cycles in the common period of drive and load, which alone can be compared.
        tolerance : float
            Relative tolerance of the scene.
        decay : float
            Logarithmic decay of the slowest mode over a window [1].
        """
        # A motion under another drive than a sine may have no first harmonic.
        phasors = np.ptp(self.extremes, axis=1) / 2 if self.phasors is None else self.phasors
        extremes, phasors = join_cycles(self.extremes, phasors, count)
        n_windows = self.window // count
        return judge_motions(extremes[None], phasors[None], n_windows, tolerance, self.floor, decay)


def _find_displacement_scale(drive) -> float:
    """Return the displacement a/omega^2 [m] of a drive with its largest acceleration a."""
    largest = structure.drive_sizes.find_max_acceleration(drive)
    return largest / structure.drive_sizes.find_drive_omega(drive) ** 2


def _judge_aperiodic_motion(
    cycles: _Cycles, measures: Measures, limits: tuple[float, float], drive
) -> Outcome:
    """Return the outcome of a motion after a release or a step, or under tones without a common period.

    Parameters
    ----------
    cycles : _Cycles
        Cycles of the motion.
    measures : dict
        Measure by name.
    limits : tuple
        Relative tolerance, and smallest decay rate of a mode [1/s].
    drive
        Drive of the last cycles.
    """
    tolerance, min_decay_rate = limits
    amplitude = measure_windows(cycles.extremes, cycles.window).amplitude
    if drive.segments and not amplitude[-1] > max(cycles.floor, measures[AMPLITUDE].floor):
        return Outcome.STEADY
    outcome = cycles.classify(tolerance)
    if outcome is Outcome.STEADY and drive.segments:
        if _has_drift(measures, tolerance, cycles.find_drift()):
            return Outcome.TRANSIENT

    # A released motion grows only if a mode gains energy. Under a step it may grow.
    is_released = drive.segments and not drive.segments[-1].constant
    if outcome is Outcome.GROWS and is_released and min_decay_rate >= 0:
        return Outcome.TRANSIENT
    return outcome


def is_drifting(drift, error, amplitude, tolerance, floor) -> np.ndarray:
    """Return whether the midpoint of a motion drifts by more than the tolerance per cycle.

    Parameters
    ----------
    drift, error : float or (n,)
        Drift of the midpoint per cycle and its error [m].
    amplitude : float or (n,)
        Amplitude to which the tolerance refers [m].
    tolerance : float
        Relative tolerance of the scene.
    floor : float or (n,)
        Largest drift that is round-off [m].
    """
    return np.abs(drift) > tolerance * np.abs(amplitude) + error + floor


def _has_drift(measures: Measures, tolerance: float, window_drift: float) -> bool:
    """Return whether the midpoint of the motion moves on from cycle to cycle.

    It does if both the drift from cycle to cycle (`drift_per_cycle`) and the drift from window to window
    (`window_drift`, [m] per cycle) exceed the relative tolerance of the run. On a belt, a window contains complete
    stick-slip cycles, whereas a cycle of the drive does not.
    """
    drift = measures.get("drift_per_cycle")
    if drift is None or drift.value is None:
        return False
    value = min(abs(drift.value), abs(window_drift))
    size = measures[AMPLITUDE].value
    return bool(is_drifting(value, drift.error or 0.0, size, tolerance, drift.floor))


def remove_errors(measures: Measures) -> Measures:
    """Return the measures by name with their values, but without errors, because these are unknown."""
    return {name: replace(measure, error=None) for name, measure in measures.items()}


def is_still_loading(window, period: float, tolerance: float) -> bool:
    """Return whether the friction force of a stuck interface still increases, as on a belt.

    The mean force of the last cycle must exceed that of the first by more than the tolerance times the
    largest force. In a window of one cycle, the force must increase monotonically.

    Parameters
    ----------
    window : Response
        Last cycles of the motion.
    period : float
        Period of the drive [s].
    tolerance : float
        Relative tolerance of the scene.
    """
    time = window.time
    forces = window.forces
    magnitude = np.abs(forces)
    largest_force = magnitude.max(axis=0)
    if time[-1] - time[0] < 1.5 * period:
        is_increasing = np.all(np.diff(magnitude, axis=0) >= -1e-9 * largest_force, axis=0)
        return bool(
            np.any(is_increasing & (magnitude[-1] - magnitude[0] > tolerance * largest_force))
        )
    # The factor includes a step that ends at the end of a cycle except for round-off.
    near = period * (1 + 1e-9)
    first, last = (
        np.abs(np.trapezoid(forces[is_inside], time[is_inside], axis=0)) / period
        for is_inside in (time <= time[0] + near, time >= time[-1] - near)
    )
    return bool(np.any(last - first > tolerance * largest_force))


def find_ringing(solution, measures: Measures, limits: tuple[float, float], drive) -> float:
    """Return the free vibration [m] of a rig whose interfaces stick under a periodic drive; 0 if none is visible.

    Parameters
    ----------
    solution : Solution
        Outcome, extremes of the cycles and window.
    measures : dict
        Measure by name.
    limits : tuple
        Tolerance, and decay rate of the slowest mode [1/s].
    drive
        Drive of the last cycles.
    """
    tolerance, min_decay_rate = limits
    amplitude = measures[AMPLITUDE]
    if solution.outcome is not Outcome.STUCK or solution.extremes is None:
        return 0.0
    if not structure.drive_sizes.is_periodic(drive) or not amplitude.value:
        return 0.0
    window = structure.drive_sizes.count_cycles(solution.window.time, drive)
    decay = min_decay_rate * drive.period * window
    ringing = float(estimate_ringing(measure_windows(solution.extremes, window), decay))
    sizes = (amplitude.value, amplitude.error or 0.0, amplitude.floor)
    return ringing if is_ringing_visible(ringing, *sizes, tolerance) else 0.0


def is_ringing_visible(ringing, amplitude, error, floor, tolerance):
    """Return whether a free vibration exceeds what the tolerance and the numerical error of the amplitude allow.

    Parameters
    ----------
    ringing, amplitude, error, floor, tolerance : float or (n,)
        Free vibration, amplitude with its error and floor [m], and relative tolerance.
    """
    return ringing > compute_allowed_error(tolerance, amplitude, floor) + error


def describe_ringing(ratio: float, limits: tuple[float, float], cycles: float) -> str:
    """Return a warning that a sticking interface still vibrates freely, with the cycles after which this has decayed.

    Parameters
    ----------
    ratio : float
        Free vibration relative to the amplitude.
    limits : tuple
        Tolerance, and logarithmic decay of the slowest mode over a cycle [1].
    cycles : float
        Number of cycles of the run.
    """
    tolerance, decay = limits
    # The free vibration of a run from rest begins as large as the steady motion and decays at least as fast as
    # the slowest mode. A beat that is longer than the run hides part of it in the amplitudes of the cycles.
    ratio = max(ratio, np.exp(-max(decay, 0.0) * cycles))
    more_cycles = np.log(ratio / tolerance) / decay if decay > 0 else np.inf
    advice = 'set accuracy.method = "harmonic" for the steady motion'
    # Largest number of cycles that a message proposes.
    if more_cycles < 1e6:
        # The last amplitudes may contain a beat, hence the factor 1.5
        proposed = float(f"{cycles + 1.5 * more_cycles:.2g}")
        advice = f"set drive.cycles = {proposed:g}"
    return (
        f"the interface sticks, but the amplitude has not settled: by up to {100 * ratio:.2g} % (limit "
        f"{100 * tolerance:g} %) it is free vibration that will decay, so "
        f"relative_displacement_amplitude and loop_area are those of a transient; {advice}"
    )


def note_on_changing_drive(outcome: Outcome, drive) -> list[str]:
    """Return a list with a note if the drive changes until the end of the run.

    The list is empty for all other drives.
    """
    if (
        outcome is not Outcome.TRANSIENT
        or drive.segments
        or structure.drive_sizes.count_repeat_cycles(drive) is not None
    ):
        return []
    return [
        "the drive changes until the end of the run, so the motion cannot become steady; the measures are those of "
        "the last cycles, and result.nc contains the whole motion"
    ]
