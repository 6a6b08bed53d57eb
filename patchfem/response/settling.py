"""Criteria of a steady motion, from its amplitude per window and the remaining free motion.

In: amplitudes, phasors or extremes of the cycles of many motions. Out: their classes
(transient, steady, grows), steady amplitudes by extrapolation with errors, and the free motion
that remains. `outcome` applies them.
"""

import numpy as np

from ..core import Outcome

CLASSES = Outcome.TRANSIENT, Outcome.STEADY, Outcome.GROWS
STEADY_CLASS = 1  # Index of Outcome.STEADY in CLASSES.
GROWS_CLASS = 2  # Index of Outcome.GROWS in CLASSES.
MIN_WINDOWS = 3  # Smallest number of windows from which free motion is estimated.
# Ratio of the speed to the largest speed in a run above which an interface slips.
SLIP_SPEED_TOL = 1e-3
# Sine of the angle between phasor differences below which they lie along one line.
COLLINEAR_SINE = 0.02
# Fraction that the slowest mode must lose over a third of the run before a remaining beat counts as
# periodic.
PERIODIC_TOL = 0.1


def classify(amplitudes, tolerance: float, floor: float = 0.0) -> Outcome:
    """Classify a motion as steady, growing or transient by the amplitudes of its windows.

    Parameters
    ----------
    amplitudes : (w,)
        [m].
    tolerance : float
    floor : float
        Amplitude up to which a motion is round-off [m].

    Returns
    -------
    Outcome
    """
    return CLASSES[classify_motions(np.asarray(amplitudes, float)[None], tolerance, floor)[0]]


def classify_motions(a, tolerance: float, floor=0.0) -> np.ndarray:
    """Classify motions by the amplitudes of successive windows.

    STEADY_CLASS: the last change and the remaining sum of a geometric series are both below the
    tolerance. GROWS_CLASS: the changes do not shrink and the amplitude still increases. Anything else is
    transient.

    Parameters
    ----------
    a : (n, w)
        Amplitudes of successive windows [m].
    tolerance : float
    floor : float or (n,)
        Smallest change that counts [m], a small fraction of the displacement by the drive alone.

    Returns
    -------
    (n,) array
        Indices of CLASSES.
    """
    out = np.zeros(len(a), int)
    if a.shape[1] == 1:
        return out
    change = np.abs(a[:, -1] - a[:, -2])
    scale = tolerance * np.abs(a[:, -1]) + floor
    if a.shape[1] == 2:
        out[change <= scale] = STEADY_CLASS
        return out
    rest = np.abs(geometric_remainders(a[:, -3:]))
    ends = np.isfinite(rest)
    rises = _increases_steadily(a)
    endless = rises & (change > 0.05 * scale)  # Growth below 0.05 of the limit counts as steady.
    out[rises & ~ends] = GROWS_CLASS
    out[(change <= scale) & np.where(ends, rest <= scale, ~endless)] = STEADY_CLASS
    return out


def geometric_remainder(three) -> complex | None:
    """Return the sum of the remaining terms of a geometric series through three values, or None.

    See `geometric_remainders`.
    """
    rest = geometric_remainders(np.asarray(three) + 0.0)
    return None if np.isnan(rest) else rest


def geometric_remainders(three):
    """Return the sums of the remaining terms of geometric series (Aitken's method).

    It is what the series still adds to the last of three equally spaced values (..., 3), and NaN if
    the changes do not shrink. A beat is a series of complex values with a complex ratio.
    """
    before = three[..., 1] - three[..., 0]
    change = three[..., 2] - three[..., 1]
    ratio = np.divide(change, before, out=np.zeros_like(change), where=before != 0)
    shrinks = np.abs(ratio) < 0.9995
    return np.where(shrinks, change * ratio / np.where(shrinks, 1 - ratio, 1.0), np.nan)[()]


def extrapolate_steady_amplitude(amplitudes, phasors) -> tuple:
    """Extrapolate the amplitudes of windows to the steady amplitude [m] and its error [m].

    (None, None) if no bounded limit can be estimated.
    """
    estimates = extrapolate_steady_amplitudes(
        np.asarray(amplitudes, float)[None], np.asarray(phasors, complex)[None]
    )
    return tuple(None if np.isnan(number) else float(number) for (number,) in estimates)


def extrapolate_steady_amplitudes(a, p) -> tuple:
    """Extrapolate the amplitudes of windows to steady amplitudes and errors for n motions.

    In a linear rig the remaining free motion is multiplied by one complex factor per window, so
    that Aitken's method extrapolates the phasors. Friction acts differently on changes of the
    amplitude and of the phase, so that the remaining motion follows a linear map of the plane
    (`plane_map_remainders`). The limit by the map is used if it exists, and its distance from Aitken's limit
    is part of the error. The waveform, amplitude over |phasor|, converges with the magnitude of the
    factor.

    The error contains the spread of the last estimates, six times for Aitken's and twice for those
    by the map, and twice the remaining change of the waveform. If it is as large as the
    extrapolated change, there is no estimate.

    Parameters
    ----------
    a, p : (n, w)
        Amplitudes [m] and phasors [m] of the last cycle of successive windows; a phasor is the part
        of the motion at the drive frequency.

    Returns
    -------
    tuple
        Steady amplitudes and their errors (n,) [m]; NaN if no bounded limit can be estimated.
    """
    count, w = a.shape
    if w < 5:
        return np.full(count, np.nan), np.full(count, np.nan)
    size = np.abs(p)
    moves = np.all(size[:, -5:] > 0, axis=1)
    shape = a[:, -2:] / np.where(size[:, -2:] > 0, size[:, -2:], 1.0)
    ends = np.stack(
        [np.abs(p[:, w - 1 - k] + geometric_remainders(p[:, w - 3 - k : w - k])) for k in range(3)],
        axis=1,
    )
    before = np.abs(p[:, -2] - p[:, -3])
    change = np.abs(p[:, -1] - p[:, -2])
    shrink = np.minimum(np.divide(change, before, out=1.0 * (change > 0), where=before > 0), 0.9995)
    settle = (shape[:, -1] - shape[:, -2]) * shrink / (1 - shrink)
    plane = np.stack(
        [np.abs(p[:, w - 1 - k] + plane_map_remainders(p[:, w - 4 - k : w - k])) for k in range(2)],
        axis=1,
    )
    turns = ~np.isnan(plane).any(axis=1)
    end = np.where(turns, plane[:, 0], ends[:, 0])
    spread = np.where(
        turns,
        2 * np.abs(plane[:, 0] - plane[:, 1]) + np.abs(plane[:, 0] - ends[:, 0]),
        6 * (ends.max(axis=1) - ends.min(axis=1)),
    )
    value = end * (shape[:, -1] + settle)
    error = spread * shape[:, -1] + 2 * np.abs(settle) * end + 1e-9 * value
    added = np.abs(value - a[:, -1])
    known = moves & (error < np.maximum(added, 1e-6 * value)) & (value < 20 * a[:, -1])
    return np.where(known, value, np.nan), np.where(known, error, np.nan)


def plane_map_remainders(p) -> np.ndarray:
    """Sum the remaining differences (n,) of points that a linear map of the plane generates.

    By the Cayley-Hamilton theorem d3 = t d2 - q d1, with the trace t and the determinant q of the
    map; the sum of all further differences is ((t - q) d3 - q d2)/(1 - t + q). NaN if all
    differences lie along one line or if the map does not shrink them. p: points of the complex
    plane (n, 4).
    """
    d1, d2, d3 = np.diff(np.asarray(p, complex), axis=1).T
    area = (d1.conj() * d2).imag
    known = np.abs(area) > COLLINEAR_SINE * np.abs(d1) * np.abs(d2)
    area = np.where(known, area, 1.0)
    t = (d1.conj() * d3).imag / area
    q = (d2.conj() * d3).imag / area
    # Both eigenvalues of the map lie inside the unit circle.
    known &= (np.abs(q) < 1) & (np.abs(t) < 1 + q)
    return np.where(known, ((t - q) * d3 - q * d2) / np.where(known, 1 - t + q, 1.0), np.nan)


def window_amplitude_means(extremes, window: int) -> tuple:
    """Return the amplitude [m] of each window, and the mean amplitude [m] of its cycles.

    Parameters
    ----------
    extremes : (..., c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Cycles of a window; a partial window at the start is left out.

    Returns
    -------
    tuple
        Two arrays (..., w) [m].
    """
    given = np.asarray(extremes, float)
    count = given.shape[-2] // window
    cut = given[..., given.shape[-2] - count * window :, :].reshape(
        *given.shape[:-2], count, window, 2
    )
    low = cut[..., 0]
    high = cut[..., 1]
    return (high.max(axis=-1) - low.min(axis=-1)) / 2, (high.mean(axis=-1) - low.mean(axis=-1)) / 2


def remaining_free_motion(extremes, window: int, decay=0.0):
    """Return the decaying free motion [m] that the last window still contains.

    A free motion at a frequency near that of the drive beats. If the beat is short, the cycles of
    one window differ: the excess of the amplitude of the window over the mean of its cycles
    vanishes with the beat, unless it remains while even the slowest mode decays (a motion that
    repeats after several cycles). If the beat is long, the windows differ: their largest distance
    from the last one in the last third of the run is taken, reduced by the ratio to the same
    distance in the third before, but by no more than the slowest mode surely loses in a third,
    because a motion may first decay fast and leave a part that decays slowly.

    Parameters
    ----------
    extremes : (..., c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Cycles of a window.
    decay : (...)
        Decay of the slowest mode over a window [1].
    """
    amplitude, mean = window_amplitude_means(extremes, window)
    count = amplitude.shape[-1]
    if count < MIN_WINDOWS:
        return np.zeros(amplitude.shape[:-1])[()]
    third = max(1, count // 3)
    spread = amplitude - mean
    before = spread[..., -2 * third : -third].max(axis=-1)
    last = spread[..., -third:].max(axis=-1)
    lost = 1 - np.exp(-np.asarray(decay) * third)
    stays = (lost > PERIODIC_TOL) & (last > (1 - lost / 2) * before)
    away = np.abs(amplitude[..., :-1] - amplitude[..., -1:])
    far = away[..., -2 * third : -third].max(axis=-1, initial=0.0)
    near = away[..., -third:].max(axis=-1)
    share = np.minimum(1.0, np.divide(near, far, out=np.ones_like(near), where=far > 0))
    share = np.maximum(share, 1 - lost)
    return (near * share + np.where(stays, 0.0, spread[..., -1]))[()]


def beat_mean_amplitudes(extremes, window: int) -> tuple:
    """Return the steady amplitudes around which a short beat oscillates, and their errors [m].

    The amplitude is the mean over the cycles of the last third of the windows. The error is the sum
    of three parts: the largest distance of these windows from the mean, twice the difference
    between their halves, and the square of the beat over the amplitude.

    Parameters
    ----------
    extremes : (n, c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Cycles of a window.

    Returns
    -------
    tuple
        Two arrays (n,); NaN if there is no estimate.
    """
    amplitude, mean = window_amplitude_means(extremes, window)
    third = amplitude.shape[1] // 3
    if third < 2:
        return np.full(len(mean), np.nan), np.full(len(mean), np.nan)
    ends = mean[:, -third:]
    value = mean[:, -third:].mean(axis=1)
    beat = (amplitude - mean)[:, -third:].max(axis=1)
    halves = np.abs(ends[:, : third // 2].mean(axis=1) - ends[:, third // 2 :].mean(axis=1))
    error = (
        np.abs(ends - value[:, None]).max(axis=1) + 2 * halves + beat**2 / np.maximum(value, 1e-300)
    )
    known = (error < np.abs(amplitude[:, -1] - value)) & (value > 0)
    return np.where(known, value, np.nan), np.where(known, error, np.nan)


def slip_period(time, rate) -> float:
    """Return the longest time [s] between the starts of the last slip intervals.

    It is 0 if there are fewer than two slips, or if the last one is more than 1.5 times this long
    ago, because the interface then sticks. The interface slips while its rate exceeds SLIP_SPEED_TOL of the
    largest. A motion without stick has two slips per cycle, from one reversal to the next.

    Parameters
    ----------
    time, rate : (k,)
        Times [s] and rates of the slide [m/s].
    """
    rate = np.asarray(rate, float)
    way = np.sign(rate) * (np.abs(rate) > SLIP_SPEED_TOL * np.abs(rate).max(initial=0.0))
    time = np.asarray(time, float)
    begins = np.flatnonzero((way[1:] != 0) & (way[1:] != way[:-1]))
    # The slip after a stick interval starts at the last sample of this interval.
    starts = time[begins + (way[begins] != 0)]
    longest = float(np.diff(starts[-4:]).max(initial=0.0))
    return longest if starts.size and time[-1] - starts[-1] <= 1.5 * longest else 0.0


def _increases_steadily(a) -> np.ndarray:
    """Return whether the amplitudes of the last windows (n, w) grow by similar increments."""
    steps = np.diff(a[:, -6:], axis=1)
    if a.shape[1] < 4:
        return np.zeros(len(a), bool)
    rise = np.all(steps > 0, axis=1)
    ratios = steps[:, 1:] / np.where(steps[:, :-1] > 0, steps[:, :-1], 1.0)
    return rise & np.all((ratios > 0.5) & (ratios < 3), axis=1)
