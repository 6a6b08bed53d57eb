"""Criteria for the end of n motions: steady, transient or growing, steady amplitude, and remaining free motion.

In: extremes and phasors of the cycles of n motions. Out: `MotionEnds` (`judge_motions`), with the classes of the motions and
their extrapolated steady amplitudes with errors. Runs and sweeps use the same criteria.
"""

from typing import NamedTuple

import numpy as np

from ..core import Outcome, max_abs

MOTION_CLASSES = Outcome.TRANSIENT, Outcome.STEADY, Outcome.GROWS
STEADY_CLASS = 1  # Index of Outcome.STEADY in MOTION_CLASSES.
GROWS_CLASS = 2  # Index of Outcome.GROWS in MOTION_CLASSES.


class MotionEnds(NamedTuple):
    """How n motions under periodic drives end.

    - classes (n,): indices of MOTION_CLASSES.
    - steady (2, n): steady amplitudes and their errors [m], or NaN if unknown.
    """

    classes: np.ndarray
    steady: np.ndarray


def judge_motions(extremes, phasors, window: int, tolerance, floor, decay) -> MotionEnds:
    """Classify n motions under periodic drives, and estimate their steady amplitudes.

    A motion is steady only if both the difference from its steady estimate and the remaining free motion are
    within the tolerance. The change from window to window alone is no criterion, because it is small near the
    maximum of a beat.

    Parameters
    ----------
    extremes : (n, c, 2)
        Smallest and largest output of each cycle [m].
    phasors : (n, c)
        Fourier coefficient of the output at the drive frequency in each cycle [m].
    window : int
        Number of cycles per window.
    tolerance : float or (n,)
        Relative tolerance of the scene.
    floor : float or (n,)
        Amplitude that is round-off [m].
    decay : float or (n,)
        Logarithmic decay of the slowest mode over a window [1].
    """
    windows = measure_windows(extremes, window)
    amplitude = windows.amplitude
    last = amplitude[:, -1]
    allowed = tolerance * last + floor

    # The last cycles of five windows are extrapolated to infinite time, if they lie in the second half of the run: the
    # motion before them may decay in another way.
    steady = np.full((2, last.size), np.nan)
    first = 4 * window
    is_long = phasors.shape[1] > 2 * first
    if is_long:
        ends = slice(-1 - first, None, window)
        steady = extrapolate_steady_amplitudes(
            np.ptp(extremes[:, ends], axis=2) / 2, phasors[:, ends]
        )

    classes = classify_motions(amplitude, tolerance, floor)
    change = np.abs(np.where(np.isnan(steady[0]), last, steady[0]) - last)
    classes[(classes == STEADY_CLASS) & (change > allowed)] = 0
    free_motion = estimate_free_motion(windows, decay)
    classes[(classes != GROWS_CLASS) & (free_motion > allowed)] = 0

    # Without a visible transient, the steady amplitude is the mean over the cycles of the last window.
    steady = np.where(np.isnan(steady), average_beats(windows), steady)
    mean = windows.cycle_amplitude[:, -1]
    means = np.stack([mean, free_motion + np.abs(last - mean)])
    is_filled = np.isnan(steady) & (classes == STEADY_CLASS) & is_long
    return MotionEnds(classes, np.where(is_filled, means, steady))


def select_reported(steady, outcomes, amplitude, amplitude_error, tolerance) -> np.ndarray:
    """Return the steady amplitudes that are measures of n motions, with the errors of the computed amplitudes added.

    They are those of transient motions, and of steady motions whose amplitude will still change by more than
    0.02 times the tolerance. The relative error of the computed amplitude is also that of the
    steady one.

    Parameters
    ----------
    steady : (2, n)
        Steady amplitudes and their errors [m].
    outcomes : (n,)
        Outcomes of the motions.
    amplitude, amplitude_error : (n,)
        Amplitudes of the last cycles and their errors [m].
    tolerance : float or (n,)
        Relative tolerance of the scene.

    Returns
    -------
    (2, n) array
        Amplitudes and their errors [m], or NaN where they are no measures.
    """
    value, error = steady
    change = np.abs(value - amplitude) + error
    is_changing = change > 0.02 * tolerance * np.abs(amplitude)
    is_reported = (outcomes == Outcome.TRANSIENT) | ((outcomes == Outcome.STEADY) & is_changing)
    total = error + amplitude_error * value / np.maximum(np.abs(amplitude), 1e-300)
    return np.where(is_reported, [value, total], np.nan)


def classify_motions(amplitudes, tolerance: float, floor=0.0) -> np.ndarray:
    """Classify n motions by the amplitudes of successive windows.

    A motion is steady if both the last change and the remaining sum of a geometric series are below the
    tolerance. It grows if the amplitude increases by steps that do not decrease. Any other motion is
    transient.

    Parameters
    ----------
    amplitudes : (n, w)
        Amplitudes of successive windows [m].
    tolerance : float
        Relative tolerance of the scene.
    floor : float or (n,)
        Largest change that is round-off [m].

    Returns
    -------
    (n,) array
        Indices of MOTION_CLASSES.
    """
    classes = np.zeros(len(amplitudes), int)
    if amplitudes.shape[1] == 1:
        return classes
    change = np.abs(amplitudes[:, -1] - amplitudes[:, -2])
    scale = tolerance * np.abs(amplitudes[:, -1]) + floor
    remainder = np.full(change.shape, np.nan)
    if amplitudes.shape[1] > 2:
        remainder = np.abs(sum_geometric_remainders(amplitudes[:, -3:]))
    has_limit = np.isfinite(remainder)
    is_increasing = _increases_steadily(amplitudes)
    is_growing = is_increasing & (change > 0.05 * scale)  # slower growth counts as steady
    classes[is_increasing & ~has_limit] = GROWS_CLASS
    classes[(change <= scale) & np.where(has_limit, remainder <= scale, ~is_growing)] = STEADY_CLASS
    return classes


def sum_geometric_remainders(values):
    """Return what is left of geometric series through three successive values (..., 3), by Aitken's method.

    It is the difference between the limit of the series and the last value, or NaN if the series does not converge. A beat
    is a series with a complex ratio.
    """
    previous_change = values[..., 1] - values[..., 0]
    change = values[..., 2] - values[..., 1]
    ratio = np.divide(
        change, previous_change, out=np.zeros_like(change), where=previous_change != 0
    )
    converges = np.abs(ratio) < 0.9995
    return np.where(converges, change * ratio / np.where(converges, 1 - ratio, 1.0), np.nan)[()]


def extrapolate_steady_amplitudes(amplitudes, phasors) -> np.ndarray:
    """Extrapolate the window amplitudes of n motions to steady amplitudes and errors.

    In a linear rig, the remaining free motion is multiplied by a complex factor per window, and the phasors
    are extrapolated by Aitken's method. With friction, it follows a linear map of the plane, because
    amplitude and phase decay differently (`sum_plane_map_remainders`). The limit of the map is preferred, and
    its distance from Aitken's limit is part of the error. The ratio of amplitude to |phasor| converges with
    the magnitude of the factor.

    The error contains the spread of the last estimates, times 6 for Aitken's method and times 2 for the
    map, and twice the remaining change of that ratio. If the error is as large as the extrapolated change,
    there is no estimate.

    Parameters
    ----------
    amplitudes, phasors : (n, 5)
        Amplitudes [m] and phasors [m] of the last cycle of the last windows. A phasor is the Fourier
        coefficient of the motion at the drive frequency.

    Returns
    -------
    (2, n) array
        Steady amplitudes and their errors [m], or NaN if no bounded limit can be estimated.
    """
    magnitude = np.abs(phasors)
    is_moving = np.all(magnitude > 0, axis=1)
    waveform = amplitudes[:, -2:] / np.where(magnitude[:, -2:] > 0, magnitude[:, -2:], 1.0)

    # The ratio of amplitude to |phasor| approaches its limit as the phasors do.
    previous_change = np.abs(phasors[:, -2] - phasors[:, -3])
    change = np.abs(phasors[:, -1] - phasors[:, -2])
    decay_factor = np.minimum(
        np.divide(change, previous_change, out=1.0 * (change > 0), where=previous_change > 0),
        0.9995,
    )
    waveform_change = (waveform[:, -1] - waveform[:, -2]) * decay_factor / (1 - decay_factor)

    aitken_limits = _extrapolate_magnitudes(phasors, sum_geometric_remainders, 3, 3)
    map_limits = _extrapolate_magnitudes(phasors, sum_plane_map_remainders, 4, 2)
    has_map_limit = ~np.isnan(map_limits).any(axis=1)
    limit = np.where(has_map_limit, map_limits[:, 0], aitken_limits[:, 0])
    spread = np.where(
        has_map_limit,
        2 * np.abs(map_limits[:, 0] - map_limits[:, 1])
        + np.abs(map_limits[:, 0] - aitken_limits[:, 0]),
        6 * (aitken_limits.max(axis=1) - aitken_limits.min(axis=1)),
    )

    # With w = amplitude/|phasor|: value = limit w, error = spread w + 2 |dw| limit.
    value = limit * (waveform[:, -1] + waveform_change)
    error = spread * waveform[:, -1] + 2 * np.abs(waveform_change) * limit + 1e-9 * value
    is_known = (
        is_moving
        & (error < np.maximum(np.abs(value - amplitudes[:, -1]), 1e-6 * value))
        & (value < 20 * amplitudes[:, -1])
    )
    return np.where(is_known, [value, error], np.nan)


def _extrapolate_magnitudes(phasors, find_remainders, n_points: int, n_limits: int) -> np.ndarray:
    """Return the magnitudes (n, l) [m] of extrapolated phasors from the last windows.

    Column k follows from the `n_points` phasors that end k windows before the last one. `phasors` (n, k) [m] are the
    complex amplitudes of successive windows, and `n_limits` is the number l of limits. `find_remainders` is a function
    of the last phasors (n, p) that returns the difference (n,) from each to its limit.
    """
    ends = phasors.shape[1] - np.arange(n_limits)
    limits = [
        phasors[:, end - 1] + find_remainders(phasors[:, end - n_points : end]) for end in ends
    ]
    return np.abs(np.stack(limits, axis=1))


def sum_plane_map_remainders(p) -> np.ndarray:
    """Return the remaining sums (n,) of point sequences that follow a linear map of the plane.

    By the Cayley-Hamilton theorem, successive differences satisfy d3 = t d2 - q d1, with the trace t and the
    determinant q of the map. The sum of all further differences is ((t - q) d3 - q d2)/(1 - t + q). It is NaN
    if the differences are collinear or the map is not a contraction.

    Parameters
    ----------
    p : (n, 4)
        Successive points in the complex plane.
    """
    d1, d2, d3 = np.diff(np.asarray(p, complex), axis=1).T
    area = (d1.conj() * d2).imag
    # Largest sine of the angle between two phasor differences that count as collinear.
    is_contraction = np.abs(area) > 0.02 * np.abs(d1) * np.abs(d2)
    area = np.where(is_contraction, area, 1.0)
    t = (d1.conj() * d3).imag / area
    q = (d2.conj() * d3).imag / area
    # both eigenvalues of the map must lie inside the unit circle
    is_contraction &= (np.abs(q) < 1) & (np.abs(t) < 1 + q)
    return np.where(
        is_contraction, ((t - q) * d3 - q * d2) / np.where(is_contraction, 1 - t + q, 1.0), np.nan
    )


class Windows(NamedTuple):
    """Ranges of the output in successive windows, oldest first, (..., w) each.

    - low, high: smallest and largest output in each window [m].
    - cycle_amplitude: mean amplitude of the cycles of each window [m].
    """

    low: np.ndarray
    high: np.ndarray
    cycle_amplitude: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """Half the peak-to-peak output (..., w) [m]."""
        return (self.high - self.low) / 2

    @property
    def excess(self) -> np.ndarray:
        """Amplitude of each window minus the mean amplitude of its cycles (..., w) [m], which a beat makes positive."""
        return self.amplitude - self.cycle_amplitude

    def find_drift(self, window: int):
        """Return the drift per cycle [m] of the midpoint between the last two windows of `window` cycles.

        The result is inf with fewer than two windows.
        """
        if self.low.shape[-1] < 2:
            return np.inf
        return (np.diff(self.low + self.high)[..., -1] / 2 / window)[()]


def measure_windows(extremes, window: int) -> Windows:
    """Return the ranges of the output in windows that end at the last cycle.

    Parameters
    ----------
    extremes : (..., c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Number of cycles per window. An incomplete window at the start is ignored, unless it is the only one.
    """
    extremes = np.asarray(extremes, float)
    n_cycles = extremes.shape[-2]
    size = min(window, n_cycles)
    first = n_cycles % size
    low, high = (extremes[..., first:, side] for side in (0, 1))
    low, high = (side.reshape(*side.shape[:-1], -1, size) for side in (low, high))
    return Windows(low.min(axis=-1), high.max(axis=-1), (high - low).mean(axis=-1) / 2)


def join_cycles(extremes, phasors, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Join every `count` successive cycles of a motion into one, up to the last cycle.

    Parameters
    ----------
    extremes : (c, 2)
        Smallest and largest output of each cycle [m].
    phasors : (c,)
        Fourier coefficient of the output in each cycle [m].
    count : int
        Number of cycles after which drive and load repeat.

    Returns
    -------
    tuple of ndarray
        Extremes (c // count, 2) and phasors (c // count,) of the joined cycles.
    """
    first = len(phasors) % count
    low, high = extremes[first:].reshape(-1, count, 2).T
    joined = np.stack([low.min(axis=0), high.max(axis=0)], axis=-1)
    return joined, phasors[first + count - 1 :: count]


def estimate_free_motion(windows: Windows, decay):
    """Return the amplitude [m] of the decaying free motion that remains in the last window.

    A free motion near the drive frequency causes a beat. If the beat is shorter than a window, the amplitude
    of the window exceeds the mean amplitude of its cycles. This excess is free motion, unless it persists
    while the slowest mode decays; then the motion is periodic over several cycles.

    If the beat is longer, the amplitudes of the windows differ. The free motion is then their largest
    difference from the last window in the last third of the run, times its ratio to the same difference in
    the preceding third. The ratio is at least the decay factor of the slowest mode over a third, because a
    slow decay may follow a fast one.

    Parameters
    ----------
    windows : Windows
        Ranges of the output.
    decay : (...)
        Logarithmic decay of the slowest mode over a window [1].
    """
    amplitude = windows.amplitude
    count = amplitude.shape[-1]
    # Smallest number of windows for an estimate of the free motion.
    if count < 3:
        return np.zeros(amplitude.shape[:-1])[()]

    n_third = max(1, count // 3)
    last = slice(-n_third, None)
    previous = slice(-2 * n_third, -n_third)

    # A beat within a window: its excess is free motion unless it persists while the modes decay.
    excess = windows.excess
    decayed_fraction = 1 - np.exp(-np.asarray(decay) * n_third)
    least_excess = (1 - decayed_fraction / 2) * excess[..., previous].max(axis=-1)
    # Smallest decay of the slowest mode over a third of the run at which a persistent beat counts
    # as periodic.
    persists = (decayed_fraction > 0.1) & (excess[..., last].max(axis=-1) > least_excess)

    # A beat over several windows: the last difference times its ratio to the one before.
    differences = np.abs(amplitude[..., :-1] - amplitude[..., -1:])
    previous_difference = differences[..., previous].max(axis=-1, initial=0.0)
    last_difference = differences[..., last].max(axis=-1)
    ratio = np.divide(
        last_difference,
        previous_difference,
        out=np.ones_like(last_difference),
        where=previous_difference > 0,
    )
    ratio = np.maximum(np.minimum(ratio, 1.0), 1 - decayed_fraction)

    return (last_difference * ratio + np.where(persists, 0.0, excess[..., -1]))[()]


def estimate_ringing(windows: Windows, decay):
    """Return the part of the amplitude [m] that is free vibration while the interface sticks.

    The result is `estimate_free_motion`, but at least the change of the amplitude in the last window.

    Parameters
    ----------
    windows : Windows
        Ranges of the output.
    decay : (...)
        Logarithmic decay of the slowest mode over a window [1]. A negative one counts as 0.
    """
    change = np.abs(np.diff(windows.amplitude[..., -2:])).sum(axis=-1)
    return np.maximum(estimate_free_motion(windows, np.maximum(decay, 0.0)), change)


def average_beats(windows: Windows) -> np.ndarray:
    """Return the mean amplitudes [m] of motions with short beats, and their errors [m].

    The amplitude is the mean over the last third of the windows. The error is the sum of the largest
    deviation of a window from it, twice the difference between the two halves, and the squared beat
    amplitude divided by the amplitude.

    Parameters
    ----------
    windows : Windows
        Ranges of the output of n motions.

    Returns
    -------
    (2, n) array
        Amplitudes and their errors, or NaN if there is no estimate.
    """
    count, n_windows = windows.low.shape
    n_third = n_windows // 3
    if n_third < 2:
        return np.full((2, count), np.nan)
    means = windows.cycle_amplitude[:, -n_third:]
    value = means.mean(axis=1)
    beat = windows.excess[:, -n_third:].max(axis=1)
    first, second = (half.mean(axis=1) for half in np.split(means, [n_third // 2], axis=1))
    error = np.abs(means - value[:, None]).max(axis=1) + 2 * np.abs(first - second)
    error += beat**2 / np.maximum(value, 1e-300)
    is_known = (error < np.abs(windows.amplitude[:, -1] - value)) & (value > 0)
    return np.where(is_known, [value, error], np.nan)


def find_slip_period(time, rate) -> float:
    """Return the longest period [s] between the starts of the last slip intervals.

    The result is 0 if there are fewer than two slip intervals, or if the last one started more than 1.5
    times this period before the end, so that the interface sticks. The interface slips while its rate
    exceeds a thousandth of the largest rate. A motion without stick has two slip intervals per cycle.

    Parameters
    ----------
    time, rate : (k,)
        Times [s] and rates of the relative displacement [m/s].
    """
    rate = np.asarray(rate, float)
    direction = np.sign(rate) * (np.abs(rate) > 1e-3 * max_abs(rate))
    time = np.asarray(time, float)
    start_steps = np.flatnonzero((direction[1:] != 0) & (direction[1:] != direction[:-1]))
    # slip starts at the last sample of the preceding stick interval
    starts = time[start_steps + (direction[start_steps] != 0)]
    period = float(np.diff(starts[-4:]).max(initial=0.0))
    return period if starts.size and time[-1] - starts[-1] <= 1.5 * period else 0.0


def _increases_steadily(amplitudes) -> np.ndarray:
    """Return whether the amplitudes of the last windows (n, w) grow by similar increments."""
    steps = np.diff(amplitudes[:, -6:], axis=1)
    before = steps[:, :-1]
    after = steps[:, 1:]
    is_similar = (before > 0) & (after > 0.5 * before) & (after < 3 * before)
    return is_similar.all(axis=1) & (amplitudes.shape[1] > 3)
