"""Criteria for a steady motion: amplitudes per window, extrapolation, and remaining free motion.

In: amplitudes, phasors or extremes of the cycles of n motions. Out: their classes (transient,
steady, grows), extrapolated steady amplitudes with errors, and the remaining free motion.
"""

import numpy as np

from ..core import Outcome
from .measures import ArrayPair

CLASSES = Outcome.TRANSIENT, Outcome.STEADY, Outcome.GROWS
STEADY_CLASS = 1  # Index of Outcome.STEADY in CLASSES.
GROWS_CLASS = 2  # Index of Outcome.GROWS in CLASSES.
MIN_WINDOWS = 3  # Smallest number of windows for an estimate of the free motion.
# Largest speed at which an interface counts as stuck, relative to the largest speed in the run.
SLIP_SPEED_TOL = 1e-3
# Largest sine of the angle between two phasor differences that count as collinear.
COLLINEAR_SINE = 0.02
# Smallest decay of the slowest mode over a third of the run at which a persistent beat counts as periodic.
PERIODIC_TOL = 0.1


def classify(amplitudes, tolerance: float, floor: float = 0.0) -> Outcome:
    """Classify a motion as steady, growing or transient by the amplitudes of its windows.

    Parameters
    ----------
    amplitudes : (w,)
        Amplitudes of successive windows [m].
    tolerance : float
        Relative tolerance of the scene.
    floor : float
        Largest amplitude that is round-off [m].

    Returns
    -------
    Outcome
    """
    return CLASSES[classify_motions(np.asarray(amplitudes, float)[None], tolerance, floor)[0]]


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
        Indices of CLASSES.
    """
    classes = np.zeros(len(amplitudes), int)
    if amplitudes.shape[1] == 1:
        return classes
    change = np.abs(amplitudes[:, -1] - amplitudes[:, -2])
    scale = tolerance * np.abs(amplitudes[:, -1]) + floor
    if amplitudes.shape[1] == 2:
        classes[change <= scale] = STEADY_CLASS
        return classes
    remainder = np.abs(geometric_remainders(amplitudes[:, -3:]))
    has_limit = np.isfinite(remainder)
    is_increasing = _increases_steadily(amplitudes)
    is_growing = is_increasing & (change > 0.05 * scale)  # slower growth counts as steady
    classes[is_increasing & ~has_limit] = GROWS_CLASS
    classes[(change <= scale) & np.where(has_limit, remainder <= scale, ~is_growing)] = STEADY_CLASS
    return classes


def geometric_remainders(values):
    """Return the remaining sums of geometric series through three values (Aitken's method).

    The sum is the difference between the limit of the series and the last of three successive values
    (..., 3). It is NaN if the series does not converge. A beat is a series with a complex ratio.
    """
    previous_change = values[..., 1] - values[..., 0]
    change = values[..., 2] - values[..., 1]
    ratio = np.divide(
        change, previous_change, out=np.zeros_like(change), where=previous_change != 0
    )
    converges = np.abs(ratio) < 0.9995
    return np.where(converges, change * ratio / np.where(converges, 1 - ratio, 1.0), np.nan)[()]


def extrapolate_steady_amplitude(amplitudes, phasors) -> tuple[float | None, ...]:
    """Extrapolate the window amplitudes of a motion to its steady amplitude and error [m].

    Return (None, None) if no bounded limit can be estimated.
    """
    estimates = extrapolate_steady_amplitudes(
        np.asarray(amplitudes, float)[None], np.asarray(phasors, complex)[None]
    )
    return tuple(None if np.isnan(number) else float(number) for (number,) in estimates)


def extrapolate_steady_amplitudes(amplitudes, phasors) -> ArrayPair:
    """Extrapolate the window amplitudes of n motions to steady amplitudes and errors.

    In a linear rig, the remaining free motion is multiplied by a complex factor per window, and the phasors
    are extrapolated by Aitken's method. With friction, it follows a linear map of the plane, because
    amplitude and phase decay differently (`plane_map_remainders`). The limit of the map is preferred, and
    its distance from Aitken's limit is part of the error. The ratio of amplitude to |phasor| converges with
    the magnitude of the factor.

    The error contains the spread of the last estimates, times 6 for Aitken's method and times 2 for the
    map, and twice the remaining change of that ratio. If the error is as large as the extrapolated change,
    there is no estimate.

    Parameters
    ----------
    amplitudes, phasors : (n, w)
        Amplitudes [m] and phasors [m] of the last cycle of successive windows. A phasor is the Fourier
        coefficient of the motion at the drive frequency.

    Returns
    -------
    tuple
        Steady amplitudes and their errors (n,) [m]; NaN if no bounded limit can be estimated.
    """
    count, n_windows = amplitudes.shape
    if n_windows < 5:
        return np.full(count, np.nan), np.full(count, np.nan)
    magnitude = np.abs(phasors)
    is_moving = np.all(magnitude[:, -5:] > 0, axis=1)
    waveform = amplitudes[:, -2:] / np.where(magnitude[:, -2:] > 0, magnitude[:, -2:], 1.0)

    # The ratio of amplitude to |phasor| approaches its limit as the phasors do.
    previous_change = np.abs(phasors[:, -2] - phasors[:, -3])
    change = np.abs(phasors[:, -1] - phasors[:, -2])
    decay_factor = np.minimum(
        np.divide(change, previous_change, out=1.0 * (change > 0), where=previous_change > 0),
        0.9995,
    )
    waveform_change = (waveform[:, -1] - waveform[:, -2]) * decay_factor / (1 - decay_factor)

    aitken_limits = _extrapolate_magnitudes(phasors, geometric_remainders, 3, 3)
    map_limits = _extrapolate_magnitudes(phasors, plane_map_remainders, 4, 2)
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
    return np.where(is_known, value, np.nan), np.where(is_known, error, np.nan)


def _extrapolate_magnitudes(phasors, find_remainders, n_points: int, n_limits: int) -> np.ndarray:
    """Return the magnitudes (n, l) [m] of extrapolated phasors from the last windows.

    Column k follows from the `n_points` phasors that end k windows before the last one.
    """
    ends = phasors.shape[1] - np.arange(n_limits)
    limits = [
        phasors[:, end - 1] + find_remainders(phasors[:, end - n_points : end]) for end in ends
    ]
    return np.abs(np.stack(limits, axis=1))


def plane_map_remainders(p) -> np.ndarray:
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
    is_contraction = np.abs(area) > COLLINEAR_SINE * np.abs(d1) * np.abs(d2)
    area = np.where(is_contraction, area, 1.0)
    t = (d1.conj() * d3).imag / area
    q = (d2.conj() * d3).imag / area
    # both eigenvalues of the map must lie inside the unit circle
    is_contraction &= (np.abs(q) < 1) & (np.abs(t) < 1 + q)
    return np.where(
        is_contraction, ((t - q) * d3 - q * d2) / np.where(is_contraction, 1 - t + q, 1.0), np.nan
    )


def window_amplitude_means(extremes, window: int) -> ArrayPair:
    """Return the amplitude [m] of each window, and the mean amplitude [m] of its cycles.

    Parameters
    ----------
    extremes : (..., c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Number of cycles per window; an incomplete window at the start is ignored.

    Returns
    -------
    tuple
        Two arrays (..., w) [m].
    """
    cycle_extremes = np.asarray(extremes, float)
    count = cycle_extremes.shape[-2] // window
    windows = cycle_extremes[..., cycle_extremes.shape[-2] - count * window :, :].reshape(
        *cycle_extremes.shape[:-2], count, window, 2
    )
    low = windows[..., 0]
    high = windows[..., 1]
    return (high.max(axis=-1) - low.min(axis=-1)) / 2, (high.mean(axis=-1) - low.mean(axis=-1)) / 2


def remaining_free_motion(extremes, window: int, decay=0.0):
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
    extremes : (..., c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Number of cycles per window.
    decay : (...)
        Logarithmic decay of the slowest mode over a window [1].
    """
    amplitude, mean = window_amplitude_means(extremes, window)
    count = amplitude.shape[-1]
    if count < MIN_WINDOWS:
        return np.zeros(amplitude.shape[:-1])[()]

    n_third = max(1, count // 3)

    # A beat within a window: its excess is free motion unless it persists while the modes decay.
    excess = amplitude - mean
    previous_excess = excess[..., -2 * n_third : -n_third].max(axis=-1)
    last_excess = excess[..., -n_third:].max(axis=-1)
    decayed_fraction = 1 - np.exp(-np.asarray(decay) * n_third)
    persists = (decayed_fraction > PERIODIC_TOL) & (
        last_excess > (1 - decayed_fraction / 2) * previous_excess
    )

    # A beat over several windows: the last difference times its ratio to the one before.
    differences = np.abs(amplitude[..., :-1] - amplitude[..., -1:])
    previous_difference = differences[..., -2 * n_third : -n_third].max(axis=-1, initial=0.0)
    last_difference = differences[..., -n_third:].max(axis=-1)
    ratio = np.minimum(
        1.0,
        np.divide(
            last_difference,
            previous_difference,
            out=np.ones_like(last_difference),
            where=previous_difference > 0,
        ),
    )
    ratio = np.maximum(ratio, 1 - decayed_fraction)

    return (last_difference * ratio + np.where(persists, 0.0, excess[..., -1]))[()]


def beat_mean_amplitudes(extremes, window: int) -> ArrayPair:
    """Return the mean amplitudes [m] of motions with short beats, and their errors [m].

    The amplitude is the mean over the last third of the windows. The error is the sum of the largest
    deviation of a window from it, twice the difference between the two halves, and the squared beat
    amplitude divided by the amplitude.

    Parameters
    ----------
    extremes : (n, c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Number of cycles per window.

    Returns
    -------
    tuple
        Two arrays (n,); NaN if there is no estimate.
    """
    amplitude, mean = window_amplitude_means(extremes, window)
    n_third = amplitude.shape[1] // 3
    if n_third < 2:
        return np.full(len(mean), np.nan), np.full(len(mean), np.nan)
    last_means = mean[:, -n_third:]
    value = last_means.mean(axis=1)
    beat = (amplitude - mean)[:, -n_third:].max(axis=1)
    half_difference = np.abs(
        last_means[:, : n_third // 2].mean(axis=1) - last_means[:, n_third // 2 :].mean(axis=1)
    )
    error = (
        np.abs(last_means - value[:, None]).max(axis=1)
        + 2 * half_difference
        + beat**2 / np.maximum(value, 1e-300)
    )
    is_known = (error < np.abs(amplitude[:, -1] - value)) & (value > 0)
    return np.where(is_known, value, np.nan), np.where(is_known, error, np.nan)


def slip_period(time, rate) -> float:
    """Return the longest period [s] between the starts of the last slip intervals.

    The result is 0 if there are fewer than two slip intervals, or if the last one started more than 1.5
    times this period before the end, so that the interface sticks. The interface slips while its rate
    exceeds SLIP_SPEED_TOL times the largest rate. A motion without stick has two slip intervals per cycle.

    Parameters
    ----------
    time, rate : (k,)
        Times [s] and rates of the relative displacement [m/s].
    """
    rate = np.asarray(rate, float)
    direction = np.sign(rate) * (np.abs(rate) > SLIP_SPEED_TOL * np.abs(rate).max(initial=0.0))
    time = np.asarray(time, float)
    start_steps = np.flatnonzero((direction[1:] != 0) & (direction[1:] != direction[:-1]))
    # slip starts at the last sample of the preceding stick interval
    starts = time[start_steps + (direction[start_steps] != 0)]
    period = float(np.diff(starts[-4:]).max(initial=0.0))
    return period if starts.size and time[-1] - starts[-1] <= 1.5 * period else 0.0


def _increases_steadily(amplitudes) -> np.ndarray:
    """Return whether the amplitudes of the last windows (n, w) grow by similar increments."""
    steps = np.diff(amplitudes[:, -6:], axis=1)
    if amplitudes.shape[1] < 4:
        return np.zeros(len(amplitudes), bool)
    is_increasing = np.all(steps > 0, axis=1)
    ratios = steps[:, 1:] / np.where(steps[:, :-1] > 0, steps[:, :-1], 1.0)
    return is_increasing & np.all((ratios > 0.5) & (ratios < 3), axis=1)
