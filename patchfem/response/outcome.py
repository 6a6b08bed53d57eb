"""Outcome and steady amplitude of a coupled run.

In: a Solution with the amplitudes and extremes of its cycles, its measures, the tolerance and the
drive. Out: the outcome (`judge_outcome`), the steady amplitude as a measure, and warnings. The
definition of a steady motion depends on the kind of drive. `settling` has the vectorized criteria.
"""

from dataclasses import replace

import numpy as np

from ..core import Measure, Outcome, compute_allowed_error
from ..structure import drive_sizes
from . import stationary
from .measures import Measures
from .rows import AMPLITUDE, STEADY_AMPLITUDE
from .settling import (
    CLASSES,
    GROWS_CLASS,
    STEADY_CLASS,
    beat_mean_amplitudes,
    classify,
    classify_motions,
    extrapolate_steady_amplitude,
    remaining_free_motion,
    window_amplitude_means,
)

# Smallest remaining change of the amplitude, as a fraction of the tolerance, at which the steady estimate is
# reported.
ESTIMATE_TOL = 0.02
OPEN_LOOP = "the friction loop of the last cycle does not close"
# Safety factor for the proposed number of cycles of a decay, because the last amplitudes may
# contain a beat.
CYCLES_SAFETY_FACTOR = 1.5
MAX_PROPOSED_CYCLES = 1e6  # Largest number of cycles that a message proposes.
# Round-off error of an amplitude, relative to the displacement a/omega^2 of the drive.
AMPLITUDE_ROUND_OFF = 1e-12


def judge_outcome(
    solution,
    measures: Measures,
    tolerance: float,
    drive,
    level_cycles: float = 0.0,
    min_decay_rate: float = 0.0,
) -> tuple[Outcome, Measures]:
    """Classify the motion of a run, and estimate the amplitude at which it becomes steady.

    - Periodic drive, or last level of a drive in levels: the outcome follows from the amplitudes of
      successive windows (`classify_periodic`) and the remaining free motion (`remaining_free_motion`). If a
      steady motion will still change by more than ESTIMATE_TOL times the tolerance, the steady estimate is
      returned.
    - Release or step: STEADY if the amplitude is below its floor, i.e. at rest; otherwise as above,
      but a release grows only if a mode gains energy.
    - Sweep or recorded signal: TRANSIENT without a steady estimate, unless the interface sticks.
    - Random drive: DONE if both halves of the record have the same mean square.

    A motion whose midpoint drifts is not steady (`is_drifting`), nor is a stuck interface whose
    friction force still increases, or above which the rig still vibrates freely.

    Parameters
    ----------
    solution : Solution
        Amplitudes and extremes of the cycles, and the window.
    measures : dict
        Measures by name; they are not changed.
    tolerance : float
        Relative tolerance of the scene.
    drive
        Drive of the last cycles.
    level_cycles : float
        Number of cycles per level; 0 without levels.
    min_decay_rate : float
        Smallest decay rate of a mode [1/s]; negative if a mode gains energy.

    Returns
    -------
    outcome : Outcome
    steady : dict
        The measure relative_displacement_amplitude_steady [m] by its name; {} if it is not reported.
    """
    limits = (tolerance, min_decay_rate)
    is_random = hasattr(drive, "band")
    is_stuck = solution.outcome is Outcome.STUCK and not is_random
    if is_stuck and is_still_loading(solution.window, drive.period, tolerance):
        return Outcome.TRANSIENT, {}

    # An outcome that the engine knows is final, unless the rig still vibrates above its stuck interfaces.
    is_ringing = not level_cycles and find_ringing(solution, measures, limits, drive) > 0
    if solution.outcome is not None and not is_ringing:
        return solution.outcome, {}

    # These drives have no cycles that could be compared.
    if is_random:
        is_stationary = stationary.is_stationary(solution.window, drive)
        return Outcome.DONE if is_stationary else Outcome.TRANSIENT, {}
    if not drive.segments and drive_sizes.count_repeat_cycles(drive) is None:
        return Outcome.TRANSIENT, {}

    # For several tones, each window contains whole beats.
    scale = drive_sizes.find_max_acceleration(drive) / drive_sizes.find_drive_omega(drive) ** 2
    floor = AMPLITUDE_ROUND_OFF * scale
    is_periodic = drive_sizes.is_periodic(drive)
    if not drive.segments and not is_periodic:
        return classify(solution.amplitudes, tolerance, floor), {}

    # The levels before the last one have other amplitudes.
    window = _count_window_cycles(solution, drive)
    if level_cycles:
        extremes = solution.extremes
        solution = replace(
            solution,
            amplitudes=solution.amplitudes[-max(1, int(level_cycles / window)) :],
            extremes=None if extremes is None else extremes[-int(level_cycles) :],
        )
    if not is_periodic:
        return _judge_release(solution, measures, drive, limits, floor), {}
    outcome, steady = _judge_periodic(solution, measures, drive, limits, floor)
    if is_ringing:
        outcome = Outcome.TRANSIENT
    if outcome is Outcome.GROWS or np.isnan(steady.value):
        return outcome, {}

    # The steady estimate is reported only where the amplitude will still change.
    base = measures[AMPLITUDE]
    estimate = (steady.value, steady.error, base.value)
    if outcome is not Outcome.TRANSIENT and not is_still_changing(*estimate, tolerance):
        return outcome, {}
    total = steady_estimate_error(*estimate, base.error or 0.0)
    return outcome, {STEADY_AMPLITUDE: replace(steady, error=float(total))}


def _judge_release(
    solution, measures: Measures, drive, limits: tuple[float, float], floor: float
) -> Outcome:
    """Classify a motion after a release or a step.

    Parameters
    ----------
    solution : Solution
        Amplitudes and extremes of the cycles.
    measures : dict
        Measures by name.
    drive
        Drive with segments.
    limits : tuple of float
        Relative tolerance, and smallest decay rate of a mode [1/s].
    floor : float
        Round-off of the amplitude [m].
    """
    tolerance, min_decay_rate = limits
    if not solution.amplitudes[-1] > max(floor, measures[AMPLITUDE].floor):
        return Outcome.STEADY

    drift = _midpoint_drift(solution.extremes, _count_window_cycles(solution, drive))
    outcome = classify(solution.amplitudes, tolerance, floor)
    outcome = _reject_drifting(outcome, measures, tolerance, drift)
    # Under a step or if a mode gains energy, the motion may grow.
    if outcome is Outcome.GROWS and not drive.segments[-1].constant and min_decay_rate >= 0:
        return Outcome.TRANSIENT
    return outcome


def _judge_periodic(
    solution, measures: Measures, drive, limits: tuple[float, float], floor: float
) -> tuple[Outcome, Measure]:
    """Classify a motion under a periodic drive; return also the steady estimate of its amplitude, NaN if there is none.

    Parameters
    ----------
    solution : Solution
        Amplitudes and extremes of the cycles, and steady estimate with its error.
    measures : dict
        Measures by name.
    drive
        Periodic drive.
    limits : tuple of float
        Relative tolerance, and smallest decay rate of a mode [1/s].
    floor : float
        Round-off of the amplitude [m].
    """
    tolerance, min_decay_rate = limits
    window = _count_window_cycles(solution, drive)
    extremes = solution.extremes
    # The criteria are vectorized over cases, of which there is one.
    number, steady, error = (
        one[0]
        for one in classify_periodic(
            np.asarray(solution.amplitudes, float)[None],
            None if extremes is None else np.asarray(extremes)[None],
            window,
            [np.array([np.nan if one is None else one]) for one in solution.steady],
            (tolerance, floor, max(min_decay_rate, 0.0) * window * drive.period),
        )
    )
    outcome = _reject_drifting(CLASSES[number], measures, tolerance)
    return outcome, Measure(float(steady), "m", float(error), measures[AMPLITUDE].floor)


def _count_window_cycles(solution, drive) -> int:
    """Return the number of cycles in the window of a run."""
    time = solution.window.time
    return max(1, round((time[-1] - time[0]) / drive.period))


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


def _midpoint_drift(extremes, window: int) -> float:
    """Return the drift per cycle [m] of the midpoint of the motion between the last windows.

    On a belt, a window contains complete stick-slip cycles, whereas a cycle of the drive does not. The
    result is inf with fewer than two windows.

    Parameters
    ----------
    extremes : (c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Number of cycles per window.
    """
    if extremes is None or len(extremes) < 2 * window:
        return np.inf
    windows = np.asarray(extremes)[-2 * window :].reshape(2, window, 2)
    midpoints = (windows[..., 0].min(axis=1) + windows[..., 1].max(axis=1)) / 2
    return float(midpoints[1] - midpoints[0]) / window


def _reject_drifting(
    outcome: Outcome, measures: Measures, tolerance: float, window_drift: float = np.inf
) -> Outcome:
    """Return TRANSIENT instead of STEADY if the midpoint of the motion drifts.

    It drifts if both the drift from cycle to cycle (`drift_per_cycle`) and the drift from window to window
    (`window_drift`, [m] per cycle) exceed the tolerance.
    """
    drift = measures.get("drift_per_cycle")
    amplitude = measures[AMPLITUDE]
    if outcome is not Outcome.STEADY or drift is None or drift.value is None:
        return outcome
    drifts = is_drifting(
        min(abs(drift.value), abs(window_drift)),
        drift.error or 0.0,
        amplitude.value,
        tolerance,
        drift.floor,
    )
    return Outcome.TRANSIENT if drifts else outcome


def remove_errors(measures: Measures) -> Measures:
    """Return the measures by name with their values, but without errors, because these are unknown."""
    return {name: replace(measure, error=None) for name, measure in measures.items()}


def classify_periodic(
    amplitudes, extremes, window: int, steady, limits
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Classify n motions under periodic drives, and estimate their steady amplitudes.

    A motion is steady only if both the difference from its steady estimate and the remaining free motion are
    within the tolerance. The change from window to window alone is no criterion, because it is small near the
    maximum of a beat.

    Parameters
    ----------
    amplitudes : (n, w)
        Amplitudes of successive windows [m].
    extremes : (n, c, 2) or None
        Smallest and largest output of each cycle [m]; None if unknown.
    window : int
        Number of cycles per window.
    steady : tuple
        Values and errors (n,) [m] of `settling.extrapolate_steady_amplitudes`; NaN for none.
    limits : tuple
        Tolerance, floor [m], and logarithmic decay of the slowest mode over a window [1]; numbers or (n,).

    Returns
    -------
    tuple
        Indices of CLASSES, steady amplitudes [m] and their errors [m], (n,) each.
    """
    tolerance, floor, decay = limits
    value, error = steady
    last = amplitudes[:, -1]
    allowed = tolerance * last + floor
    classes = classify_motions(amplitudes, tolerance, floor)
    change = np.abs(np.where(np.isnan(value), last, value) - last)
    classes = np.where((classes == STEADY_CLASS) & (change > allowed), 0, classes)
    if extremes is not None:
        free_motion = remaining_free_motion(extremes, window, decay)
        classes = np.where((classes != GROWS_CLASS) & (free_motion > allowed), 0, classes)
        is_unknown = np.isnan(value)
        mean, mean_error = beat_mean_amplitudes(extremes, window)
        value = np.where(is_unknown, mean, value)
        error = np.where(is_unknown, mean_error, error)
        # without a visible transient, the steady amplitude is the mean over the cycles of the last window
        is_unknown = np.isnan(value) & (classes == STEADY_CLASS)
        value = np.where(is_unknown, window_amplitude_means(extremes, window)[1][:, -1], value)
        error = np.where(is_unknown, free_motion + np.abs(last - value), error)
    return classes, value, error


def is_still_changing(steady, error, amplitude, tolerance) -> np.ndarray:
    """Return whether a motion that counts as steady will still change noticeably.

    The limit is ESTIMATE_TOL times the tolerance.

    Parameters
    ----------
    steady, error : float or (n,)
        Steady amplitude and its error [m].
    amplitude : float or (n,)
        Amplitude of the last cycles [m].
    tolerance : float
        Relative tolerance of the scene.
    """
    return np.abs(steady - amplitude) + error > ESTIMATE_TOL * tolerance * np.abs(amplitude)


def steady_estimate_error(steady, error, amplitude, amplitude_error):
    """Return the error of a steady amplitude [m], including that of the computed amplitude.

    Parameters
    ----------
    steady, error : float or (n,)
        Steady amplitude and its error by extrapolation [m].
    amplitude, amplitude_error : float or (n,)
        Amplitude of the last cycles and its error [m]; the relative error is the same for the steady
        amplitude.
    """
    return error + amplitude_error * steady / np.maximum(np.abs(amplitude), 1e-300)


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
    first = time <= time[0] + near
    last = time >= time[-1] - near
    first_mean = np.abs(np.trapezoid(forces[first], time[first], axis=0)) / period
    last_mean = np.abs(np.trapezoid(forces[last], time[last], axis=0)) / period
    return bool(np.any(last_mean - first_mean > tolerance * largest_force))


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
    if not drive_sizes.is_periodic(drive) or not amplitude.value:
        return 0.0
    window = _count_window_cycles(solution, drive)
    decay = min_decay_rate * drive.period
    ringing = float(remaining_ringing(np.asarray(solution.extremes), window, decay))
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


def remaining_ringing(extremes, window: int, decay):
    """Return the part of the amplitude [m] that is free vibration while the interface sticks.

    The result is `remaining_free_motion`, but at least the change of the amplitude in the last window.

    Parameters
    ----------
    extremes : (..., c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Number of cycles per window.
    decay : (...)
        Logarithmic decay of the slowest mode over a cycle [1].
    """
    amplitudes = window_amplitude_means(extremes, window)[0]
    free_motion = remaining_free_motion(extremes, window, np.maximum(decay, 0.0) * window)
    if amplitudes.shape[-1] < 2:
        return free_motion
    return np.maximum(free_motion, np.abs(amplitudes[..., -1] - amplitudes[..., -2]))


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
    if more_cycles < MAX_PROPOSED_CYCLES:
        proposed = float(f"{cycles + CYCLES_SAFETY_FACTOR * more_cycles:.2g}")
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
        or drive_sizes.count_repeat_cycles(drive) is not None
    ):
        return []
    return [
        "the drive changes until the end of the run, so the motion cannot become steady; the measures are those of "
        "the last cycles, and result.nc contains the whole motion"
    ]


def estimate_steady(drive, amplitudes, phasors) -> tuple[float | None, ...]:
    """Return the steady amplitude [m] and its error; (None, None) without a periodic drive.

    The amplitudes of a released or struck rig are not extrapolated, because it comes to rest. Under a drive
    that is not sinusoidal, the amplitudes are extrapolated instead of the phasors, because the motion may
    have no first harmonic.

    Parameters
    ----------
    drive
        Drive of the last cycles.
    amplitudes : (w,)
        Amplitudes of successive windows [m].
    phasors : (w,)
        First harmonics of the output in these windows [m].
    """
    if not drive_sizes.is_periodic(drive):
        return None, None
    return extrapolate_steady_amplitude(
        amplitudes, phasors if drive_sizes.is_sinusoidal(drive) else amplitudes
    )
