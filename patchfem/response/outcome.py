"""Outcome of a coupled run, and the estimate of its steady amplitude.

In: a Solution with the amplitudes and extremes of its cycles, its measures, the tolerance and
the drive. Out: the outcome (`judge_outcome`), the steady amplitude with its error as a measure, and
warnings. The kind of drive decides what steady means; `settling` has the criteria for many
motions at once.
"""

from dataclasses import replace

import numpy as np

from ..core import Measure, Outcome
from ..structure import drive_sizes
from . import stationary
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

# Fraction of the tolerance; if the amplitude will still change by more, the page states the steady
# estimate.
ESTIMATE_TOL = 0.02
NOT_SETTLED_WARNING = "the interface sticks, but the amplitude has not settled"
OPEN_LOOP = "the friction loop of the last cycle does not close"
# Safety factor on the cycles that the decay needs, because the last amplitudes may beat.
CYCLES_SAFETY_FACTOR = 1.5
MAX_PROPOSED_CYCLES = 1e6  # Largest number of cycles that a message proposes.
# Ratio of the change of the amplitude to the displacement a/omega^2 of the drive below which it is round-off.
AMPLITUDE_ROUND_OFF = 1e-12


def judge_outcome(
    raw, measures: dict, tolerance: float, drive, level_cycles: float = 0.0, slowest: float = 0.0
) -> tuple:
    """Classify the motion of a run, and add the steady amplitude to its measures.

    - Periodic drive, and the last level of a drive in levels: the amplitudes of successive windows
      decide (`classify_periodic`), and the free motion that remains in them (`remaining_free_motion`). A motion that is
      steady to the tolerance, but will still change by more than ESTIMATE_TOL of it, has a steady estimate
      as well. If a bounded motion is known to exist (`raw.bounded`), an increasing amplitude is not
      GROWS.
    - Release or step: steady once it is at rest, to the floor of its amplitude; else the same
      amplitudes decide, but a release grows only if a mode gains energy.
    - Sweep or recorded signal: it changes until the end, so the outcome is TRANSIENT without a
      steady estimate, unless the interface sticks.
    - Random drive: DONE if both halves of the record have the same mean square.

    A motion whose midpoint drifts is not steady (`is_drifting`), nor is a stuck interface whose
    friction force still increases.

    Parameters
    ----------
    raw : Solution
    measures : dict
        Measures by name.
    tolerance : float
        Relative tolerance of the scene.
    drive
    level_cycles : float
        Cycles of each level; 0 without levels.
    slowest : float
        Rate at which the slowest mode decays [1/s]; negative if a mode gains energy.
    """
    if (
        raw.outcome is Outcome.STUCK
        and not hasattr(drive, "band")
        and is_still_loading(raw.window, drive.period, tolerance)
    ):
        return Outcome.TRANSIENT, measures
    if raw.outcome is not None:
        return raw.outcome, measures
    if hasattr(drive, "band"):
        is_stationary = stationary.is_steady(raw.window, drive)
        return Outcome.DONE if is_stationary else Outcome.TRANSIENT, measures
    if not drive.segments and drive_sizes.count_repeat_cycles(drive) is None:
        return Outcome.TRANSIENT, measures
    # several tones, of which each window contains whole beats
    floor = (
        AMPLITUDE_ROUND_OFF
        * drive_sizes.find_max_acceleration(drive)
        / drive_sizes.find_drive_omega(drive) ** 2
    )
    if not drive.segments and not drive_sizes.is_periodic(drive):
        outcome = classify(raw.amplitudes, tolerance, floor)
        return outcome, remove_errors(measures) if outcome is Outcome.GROWS else measures
    amplitudes = raw.amplitudes
    extremes = raw.extremes
    window = max(1, round((raw.window.time[-1] - raw.window.time[0]) / drive.period))
    if level_cycles:
        amplitudes = amplitudes[-max(1, int(level_cycles / window)) :]
        extremes = None if extremes is None else extremes[-int(level_cycles) :]
    if not drive_sizes.is_periodic(drive):
        outcome = Outcome.STEADY
        if amplitudes[-1] > max(floor, measures["relative_displacement_amplitude"].floor):
            outcome = classify(amplitudes, tolerance, floor)
            drift = _midpoint_drift(extremes, window)
            outcome = _reject_drifting(outcome, measures, tolerance, drift)
        if outcome is Outcome.GROWS and not drive.segments[-1].constant and slowest >= 0:
            outcome = Outcome.TRANSIENT
        return outcome, remove_errors(measures) if outcome is Outcome.GROWS else measures
    number, steady, error = (
        one[0]
        for one in classify_periodic(
            np.asarray(amplitudes, float)[None],
            None if extremes is None else np.asarray(extremes)[None],
            window,
            [np.array([np.nan if one is None else one]) for one in raw.steady],
            (tolerance, floor, max(slowest, 0.0) * window * drive.period),
            raw.bounded,
        )
    )
    outcome = _reject_drifting(CLASSES[number], measures, tolerance)
    if outcome is Outcome.GROWS:
        return outcome, remove_errors(measures)
    base = measures["relative_displacement_amplitude"]
    if not np.isnan(steady) and (
        outcome is Outcome.TRANSIENT or is_still_changing(steady, error, base.value, tolerance)
    ):
        total = steady_estimate_error(steady, error, base.value, base.error or 0.0)
        measures = measures | {
            "relative_displacement_amplitude_steady": Measure(
                float(steady), "m", float(total), base.floor
            )
        }
    return outcome, measures


def is_drifting(drift, error, amplitude, tolerance, floor) -> np.ndarray:
    """Return whether the midpoint of a motion moves by more than the tolerance in a cycle.

    Parameters
    ----------
    drift, error : float or (n,)
        Motion of the midpoint per cycle and its error [m].
    amplitude : float or (n,)
        Amplitude [m], of which the tolerance is a fraction.
    tolerance : float
    floor : float or (n,)
        Smallest drift that counts [m].
    """
    return np.abs(drift) > tolerance * np.abs(amplitude) + error + floor


def _midpoint_drift(extremes, window: int) -> float:
    """Return the displacement per cycle [m] of the midpoint of the motion in the last windows.

    It is inf if they are not known. For a belt, a window contains whole stick-slip cycles, whereas
    a cycle of the drive does not. extremes: (c, 2) [m] per cycle.
    """
    if extremes is None or len(extremes) < 2 * window:
        return np.inf
    part = np.asarray(extremes)[-2 * window :].reshape(2, window, 2)
    middle = (part[..., 0].min(axis=1) + part[..., 1].max(axis=1)) / 2
    return float(middle[1] - middle[0]) / window


def _reject_drifting(
    outcome: Outcome, measures: dict, tolerance: float, window_drift: float = np.inf
) -> Outcome:
    """Return TRANSIENT instead of STEADY if the midpoint of the motion drifts.

    It must move both from cycle to cycle (`drift_per_cycle`) and from window to window (`middle`
    [m] per cycle).
    """
    drift = measures.get("drift_per_cycle")
    amplitude = measures["relative_displacement_amplitude"]
    if outcome is not Outcome.STEADY or drift is None or drift.value is None:
        return outcome
    moves = is_drifting(
        min(abs(drift.value), abs(window_drift)),
        drift.error or 0.0,
        amplitude.value,
        tolerance,
        drift.floor,
    )
    return Outcome.TRANSIENT if moves else outcome


def remove_errors(measures: dict) -> dict:
    """Remove the errors of the measures of a growing motion, whose later values differ anyway."""
    return {name: replace(one, error=None) for name, one in measures.items()}


def classify_periodic(
    amplitudes, extremes, window: int, steady, limits: tuple, bounded=False
) -> tuple:
    """Classify motions under periodic drives and estimate their steady amplitudes.

    A motion is steady only if the change to its steady estimate and the free motion that remains in
    it are both within the tolerance: near a maximum of its beat the amplitude hardly changes from
    window to window, although it is far from steady.

    Parameters
    ----------
    amplitudes : (n, w)
        Amplitudes of successive windows [m].
    extremes : (n, c, 2) or None
        Smallest and largest output of each cycle [m]; None if not known.
    window : int
        Cycles of a window.
    steady : tuple
        Values and errors (n,) [m] of `settling.extrapolate_steady_amplitudes`; NaN for none.
    limits : tuple
        Tolerance, floor [m], and decay of the slowest mode over a window [1]; numbers or (n,).
    bounded : bool or (n,)
        Whether a bounded motion is known to exist (see `Solution`).

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
    classes = np.where((classes == GROWS_CLASS) & bounded, 0, classes)
    change = np.abs(np.where(np.isnan(value), last, value) - last)
    classes = np.where((classes == STEADY_CLASS) & (change > allowed), 0, classes)
    if extremes is not None:
        free_motion = remaining_free_motion(extremes, window, decay)
        classes = np.where((classes != GROWS_CLASS) & (free_motion > allowed), 0, classes)
        is_unknown = np.isnan(value)
        mean, mean_error = beat_mean_amplitudes(extremes, window)
        value = np.where(is_unknown, mean, value)
        error = np.where(is_unknown, mean_error, error)
        # Without a visible transient, the steady amplitude is the mean over the cycles of the last
        # window.
        is_unknown = np.isnan(value) & (classes == STEADY_CLASS)
        value = np.where(is_unknown, window_amplitude_means(extremes, window)[1][:, -1], value)
        error = np.where(is_unknown, free_motion + np.abs(last - value), error)
    return classes, value, error


def is_still_changing(steady, error, amplitude, tolerance) -> np.ndarray:
    """Return whether a motion will still change noticeably although it meets the tolerance.

    The limit is the fraction ESTIMATE_TOL of the tolerance.

    Parameters
    ----------
    steady, error : float or (n,)
        Steady estimate and its error [m].
    amplitude : float or (n,)
        Amplitude of the last cycles [m].
    tolerance : float
    """
    return np.abs(steady - amplitude) + error > ESTIMATE_TOL * tolerance * np.abs(amplitude)


def steady_estimate_error(steady, error, amplitude, amplitude_error):
    """Return the error of a steady amplitude [m], including that of the computed amplitude.

    Parameters
    ----------
    steady, error : float or (n,)
        Steady estimate and its error by extrapolation [m].
    amplitude, amplitude_error : float or (n,)
        Amplitude of the last cycles and its error [m], which is scaled by the ratio of both
        amplitudes.
    """
    return error + amplitude_error * steady / np.maximum(np.abs(amplitude), 1e-300)


def is_still_loading(window, period: float, tolerance: float) -> bool:
    """Return whether the friction force of a sticking interface still increases, as on a belt.

    The mean of the last cycle must exceed that of the first by more than the tolerance times the
    largest force. In a window of one cycle, the force must increase throughout.

    Parameters
    ----------
    window : Response
    period : float
        Period of the drive [s].
    tolerance : float
    """
    time = window.time
    forces = np.column_stack(
        [
            window.extra.get("forces", window.force),
            window.extra.get("lateral_forces", np.zeros((window.time.size, 0))),
        ]
    )
    largest_force = np.abs(forces).max(axis=0)
    if time[-1] - time[0] < 1.5 * period:
        size = np.abs(forces)
        rises = np.all(np.diff(size, axis=0) >= -1e-9 * largest_force, axis=0)
        return bool(np.any(rises & (size[-1] - size[0] > tolerance * largest_force)))
    # Without this factor, round-off at the end of a cycle would leave out a step.
    near = period * (1 + 1e-9)
    first = time <= time[0] + near
    last = time >= time[-1] - near
    means = [
        np.abs(np.trapezoid(forces[part], time[part], axis=0)) / period for part in (first, last)
    ]
    return bool(np.any(means[1] - means[0] > tolerance * largest_force))


def check_piece_length(
    outcome: Outcome | None, max_displacement: float, length: float
) -> Outcome | None:
    """Return LEAVES_CONTACT if the displacement exceeds the piece length, else the outcome.

    From that instant on nothing overlaps, so this outcome replaces any later one: steady, growing,
    or at the stop of the flexure, which would have ended the run earlier if it were nearer. A
    motion that grows without having passed the end of the piece remains GROWS. NOT_CONVERGED is
    kept, because its slide means nothing.

    Parameters
    ----------
    outcome : Outcome or None
    max_displacement : float
        Largest |slide| of the run [m].
    length : float
        Length of the piece [m].
    """
    if max_displacement > length and outcome is not Outcome.NOT_CONVERGED:
        return Outcome.LEAVES_CONTACT
    return outcome


def warn_if_ringing(raw, measures: dict, limits: tuple, drive, cycles: float) -> list:
    """Return a warning, as a list, if the interface sticks but the amplitude still decays.

    The warning states by how much the amplitude of the last window will change, and after how many
    cycles a free motion with the slowest decay is below the tolerance.

    Parameters
    ----------
    raw : Solution
    measures : dict
    limits : tuple
        Tolerance, and rate at which the slowest mode decays [1/s].
    drive
    cycles : float
        Cycles of the run.
    """
    tolerance, slowest = limits
    amplitude = measures["relative_displacement_amplitude"]
    if raw.outcome is not Outcome.STUCK or raw.extremes is None:
        return []
    if not drive_sizes.is_periodic(drive) or not amplitude.value:
        return []
    window = max(1, round((raw.window.time[-1] - raw.window.time[0]) / drive.period))
    decay = slowest * drive.period
    free_vibration = float(remaining_ringing(np.asarray(raw.extremes), window, decay))
    sizes = (amplitude.value, amplitude.floor)
    return warn_of_ringing(free_vibration, sizes, (tolerance, decay), cycles)


def remaining_ringing(extremes, window: int, decay):
    """Return the part [m] of the amplitude that is free vibration while the interface sticks.

    It is `remaining_free_motion`, but not less than the change of the last window.

    Parameters
    ----------
    extremes : (..., c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Cycles of a window.
    decay : (...)
        Decay of the slowest mode over a cycle [1].
    """
    ends = window_amplitude_means(extremes, window)[0]
    free_motion = remaining_free_motion(extremes, window, np.maximum(decay, 0.0) * window)
    if ends.shape[-1] < 2:
        return free_motion
    return np.maximum(free_motion, np.abs(ends[..., -1] - ends[..., -2]))


def warn_of_ringing(free_vibration: float, sizes: tuple, limits: tuple, cycles: float) -> list:
    """Return a warning, as a list, on the free vibration of a sticking interface.

    Parameters
    ----------
    free_vibration : float
        Free vibration in the amplitude [m] (see `remaining_ringing`).
    sizes : tuple
        Amplitude and its floor [m].
    limits : tuple
        Tolerance, and decay of the slowest mode over a cycle [1].
    cycles : float
        Cycles of the run.
    """
    amplitude, floor = sizes
    tolerance, decay = limits
    if not free_vibration > tolerance * amplitude + floor:
        return []
    ratio = free_vibration / amplitude
    more_cycles = np.log(ratio / tolerance) / decay if decay > 0 else np.inf
    remedy = 'set accuracy.method = "harmonic" for the steady motion'
    if more_cycles < MAX_PROPOSED_CYCLES:
        proposed = float(f"{cycles + CYCLES_SAFETY_FACTOR * more_cycles:.2g}")
        remedy = f"set drive.cycles = {proposed:g}"
    return [
        f"{NOT_SETTLED_WARNING}: by up to {100 * free_vibration / amplitude:.2g} % (limit "
        f"{100 * tolerance:g} %) it is free vibration that will decay, so "
        f"relative_displacement_amplitude is that of a transient; {remedy}"
    ]


def note_on_changing_drive(outcome: Outcome, drive) -> list:
    """Return a note, as a list, on measures under a drive that changes until the end.

    The list is empty for other drives.
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


def estimate_steady(drive, amplitudes, phasors) -> tuple:
    """Return the steady amplitude [m] and its error; (None, None) without a periodic drive.

    A released or struck rig comes to rest, so its amplitudes are not extrapolated. Under a drive
    that is not sinusoidal the motion may have no first harmonic, so the amplitudes are extrapolated
    instead of the phasors.

    Parameters
    ----------
    drive
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
