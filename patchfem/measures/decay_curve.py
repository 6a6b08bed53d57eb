"""Frequency and damping ratio of a decay against its amplitude, with 95 % intervals.

In: the half cycles of a decay, i.e. the motion from one reversal to the next. The reversals of a computed
motion follow from the cubics between samples (`locate_reversals`). The half cycles of a measured motion
follow from fitted sinusoids (`identify.half_cycles`). Out: a `DecayCurve`.

Half cycle k has a midpoint t_k and a peak-to-peak value S_k. Over 2 m + 1 half cycles, the slope of ln S_k
is the logarithmic decrement per half cycle, -pi zeta/(1 - zeta^2)^(1/2), and the slope of t_k is half a
period. Both are exact for viscous damping; otherwise they are mean values over the span. The error due to
noise decreases as m^(-3/2), and the error due to curvature increases as m^2. The span is therefore the
longest one whose slope agrees with those of all shorter spans (Lepski, 1991).
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..convergence import MAX_CONVERGENCE_ORDER, convergence_error
from ..core import max_abs
from ..motion_measures import find_reversal_steps
from .measures import ArrayPair

# Candidate spans of a fit: number of half cycles on either side of a point.
CANDIDATE_HALF_SPANS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)
# Number of half cycles on either side from whose third differences the noise is estimated.
NOISE_HALF_WIDTH_IN_HALF_CYCLES = 8
VALUE_ROUND_OFF = 1e-12  # Relative round-off error of a value.
# Smallest half cycle that is not attributed to round-off, relative to the largest one.
MIN_HALF_CYCLE_RATIO = 1e-9
CURVE_END_TOL = 1e-6  # Relative distance by which a curve is extrapolated beyond its ends.


class HalfCycles(NamedTuple):
    """Half cycles of a decaying motion, each from one reversal to the next.

    - middle (k,): time of the midpoint [s].
    - size (k,): distance between the two reversals [m].
    - middle_noise, size_noise (k,): standard deviations of both due to noise [s], [m]; 0 for a computed
      motion.
    """

    middle: np.ndarray
    size: np.ndarray
    middle_noise: np.ndarray
    size_noise: np.ndarray


class DecayCurve(NamedTuple):
    """Frequency and damping ratio of a decay as functions of its decreasing amplitude.

    - time (k,): time [s].
    - amplitude (k,): amplitude [m].
    - frequency (k,): frequency of the damped motion [Hz].
    - damping (k,): damping ratio [1].
    - frequency_error, damping_error (k,): half-widths of the 95 % intervals [Hz], [1].
    """

    time: np.ndarray
    amplitude: np.ndarray
    frequency: np.ndarray
    frequency_error: np.ndarray
    damping: np.ndarray
    damping_error: np.ndarray

    def select(self, selection) -> "DecayCurve":
        """Return the curve at the points of an index array or a mask."""
        return DecayCurve(*(column[selection] for column in self))

    def interpolate(self, name: str, amplitudes) -> np.ndarray:
        """Interpolate a column, such as "frequency", at amplitudes (k,) [m].

        It is linear in the logarithm of the amplitude, and NaN outside the range of the curve.
        """
        knots, indices = np.unique(np.log(self.amplitude), return_index=True)
        if not knots.size:
            return np.full(len(amplitudes), np.nan)
        x = np.log(amplitudes)
        inside = (x > knots[0] - CURVE_END_TOL) & (x < knots[-1] + CURVE_END_TOL)
        return np.where(inside, np.interp(x, knots, getattr(self, name)[indices]), np.nan)

    def add_change(self, coarse: "DecayCurve", reference: "DecayCurve") -> "DecayCurve":
        """Return the curve with larger errors, by the change from a coarser run to the run with which it is compared.

        `coarse` and `reference` are the curves of both runs. The error of a method of second order follows from their
        difference at the same amplitudes; it is infinite where either curve has no value.
        """
        errors = {}
        for name in ("frequency", "damping"):
            curves = [curve.interpolate(name, self.amplitude) for curve in (coarse, reference)]
            added = convergence_error(curves[0] - curves[1], order=MAX_CONVERGENCE_ORDER)
            error = getattr(self, f"{name}_error")
            errors[f"{name}_error"] = error + np.where(np.isnan(added), np.inf, added)
        return self._replace(**errors)


def locate_reversals(time, position, speed) -> ArrayPair:
    """Return the times (k,) [s] and positions (k,) [m] of the reversals of a motion.

    They are computed on the cubics through the samples on both sides.

    Parameters
    ----------
    time, position, speed : (n,)
        Samples of time [s], position [m] and speed [m/s] at any spacing, with at most one reversal
        between two samples.
    """
    # Largest speed at which a sample counts as a reversal, relative to the largest speed.
    speed = np.where(np.abs(speed) <= 1e-12 * max_abs(speed), 0.0, speed)
    resting_samples = np.flatnonzero(speed == 0)
    inside = find_reversal_steps(time, position, speed)
    step_times = time[inside.step] + inside.fraction * np.diff(time)[inside.step]
    times = np.concatenate([time[resting_samples], step_times])
    reversal_positions = np.concatenate([position[resting_samples], inside.position])
    order = np.lexsort((reversal_positions, times))
    # a reversal with a jump of the force has two samples at the same time
    min_interval = VALUE_ROUND_OFF * float(np.ptp(time))
    order = order[np.diff(times[order], prepend=-np.inf) > min_interval]
    return times[order], reversal_positions[order]


def measure_last_cycle_amplitude(time, position, speed, period: float) -> float | None:
    """Return half the peak-to-peak value [m] of the last whole cycle of a motion, which three turns bound.

    Motions between reversals that are smaller than a quarter of the range in the last period are attributed
    to a faster mode and ignored. The last turn may be such a ripple on the way to the next one; it counts if the half
    cycle before it has lasted at least three quarters as long as the previous one.

    Parameters
    ----------
    time, position, speed : (n,)
        Samples of time [s], position [m] and speed [m/s] at any spacing.
    period : float
        Period [s].

    Returns
    -------
    float or None
        Half the range in the last period if the motion is at rest there; None if it has too few turns.
    """
    # Round-off of a period by which a sample may lie before it.
    last_range = float(np.ptp(position[time >= time[-1] - period * (1 + 1e-9)]))
    if last_range <= MIN_HALF_CYCLE_RATIO * np.ptp(position):
        return last_range / 2
    times, places = locate_reversals(time, position, speed)
    turns = _find_last_turns(places, 0.25 * last_range)
    if len(turns) < 3:
        return None
    durations = -np.diff(times[turns])
    # A shorter half cycle ends at a ripple of a faster mode
    first = 0 if durations[0] >= 0.75 * durations[1] else 1
    if len(turns) < first + 3:
        return None
    return max_abs(np.diff(places[turns[first : first + 3]])) / 2


def _find_last_turns(places, ripple: float) -> list[int]:
    """Return the indices of the last four turns, the last one first, of reversals at `places` (k,) [m], or those that exist.

    Between successive turns, which are minima and maxima in turn, the motion exceeds the `ripple` [m].
    """
    turns = []
    low = high = places.size - 1
    for k in range(places.size - 1, -1, -1):
        if not turns:
            # The last turn is known once the motion before it exceeds the ripple.
            low = k if places[k] < places[low] else low
            high = k if places[k] > places[high] else high
            if places[high] - places[low] > ripple:
                turns = [max(low, high), min(low, high)]
        elif (places[k] - places[turns[-1]]) * (places[turns[-1]] - places[turns[-2]]) > 0:
            turns[-1] = k
        elif abs(places[k] - places[turns[-1]]) > ripple:
            if len(turns) == 4:
                break
            turns.append(k)
    return turns


def make_half_cycles(times, positions) -> HalfCycles:
    """Return the half cycles between the reversals of a computed decay.

    The sequence ends before the first half cycle that is not smaller than its predecessor, or that is
    within the round-off of the largest one.

    Parameters
    ----------
    times, positions : (k,)
        Reversals: times [s] and positions [m].
    """
    distances = np.abs(np.diff(positions))
    ends = np.flatnonzero(
        (np.diff(distances, prepend=np.inf) >= 0)
        | (distances <= MIN_HALF_CYCLE_RATIO * distances.max(initial=0.0))
    )
    count = int(ends[0]) if ends.size else distances.size
    no_noise = np.zeros(count)
    return HalfCycles((times[1:] + times[:-1])[:count] / 2, distances[:count], no_noise, no_noise)


def fit_decay_curve(half_cycles: HalfCycles) -> DecayCurve:
    """Compute frequency and damping ratio as functions of amplitude from half cycles.

    The curve of a computed decay has a point at each inner half cycle. That of a measured decay has points
    whose spans overlap by half. With fewer than three half cycles, the curve is empty.
    """
    if half_cycles.size.size < 3:
        return DecayCurve(*np.empty((6, 0)))

    # The slopes of ln S_k and of t_k give decrement and half period (module docstring).
    log_sizes = np.log(half_cycles.size)
    decrements = fit_slopes(
        log_sizes, _limit_noise(half_cycles.size_noise / half_cycles.size, log_sizes)
    )
    noise = _limit_noise(half_cycles.middle_noise, half_cycles.middle)
    half_periods = fit_slopes(half_cycles.middle, noise)

    # Points of noisy curves with the same data in their spans would repeat one another.
    selected = np.arange(half_periods.span.size)
    if noise.any():
        selected = _select_overlapping_spans(np.minimum(half_periods.span, decrements.span))
    half_periods = half_periods.select(selected)
    decrements = decrements.select(selected)

    # With delta = -d ln S/dk: zeta = delta/(pi^2 + delta^2)^(1/2), and its derivative is pi^2/(pi^2 + delta^2)^(3/2).
    decay_per_radian = np.hypot(np.pi, decrements.slope)
    curve = DecayCurve(
        time=half_cycles.middle[1 + selected],
        amplitude=np.exp(_smooth_values(log_sizes, 1 + selected, decrements.span)) / 2,
        frequency=0.5 / half_periods.slope,
        frequency_error=0.5 * half_periods.error / half_periods.slope**2,
        damping=-decrements.slope / decay_per_radian,
        damping_error=decrements.error * np.pi**2 / decay_per_radian**3,
    )

    return _add_damping_error(curve) if curve.time.size > 1 else curve


def _select_overlapping_spans(span) -> np.ndarray:
    """Return the indices of inner half cycles whose spans of lengths (n,) overlap by half."""
    selected = [0]
    while (next_index := selected[-1] + max(1, int(span[selected[-1]]))) < span.size:
        selected.append(next_index)
    return np.array(selected)


def _smooth_values(values, indices, span) -> np.ndarray:
    """Return the midpoint values of least-squares parabolas that are fitted over spans around each index.

    `values` (n,) are samples, `indices` (k,) those at the midpoints, and `span` (k,) the numbers of samples on either
    side.
    """
    smoothed = np.empty(indices.size)
    for m in np.unique(span):
        has_span = span == m
        weights = np.linalg.pinv(np.vander(np.arange(-m, m + 1), 3))[-1]
        windows = sliding_window_view(values, 2 * m + 1)
        smoothed[has_span] = windows[indices[has_span] - m] @ weights
    return smoothed


class Slopes(NamedTuple):
    """Slopes of a quantity per half cycle, with half-widths of 95 % intervals and with spans.

    All arrays are (k,).

    - slope: change per half cycle.
    - error: half-width of its 95 % interval.
    - span: number of half cycles on either side of the point.
    """

    slope: np.ndarray
    error: np.ndarray
    span: np.ndarray

    def select(self, selection) -> "Slopes":
        """Return the slopes at the points of an index array or a mask."""
        return Slopes(*(column[selection] for column in self))


def fit_slopes(values, noise) -> Slopes:
    """Fit the slope at each inner point over the longest span consistent with all shorter spans.

    The span is increased until the slope differs from that of a shorter span by more than the noise (Lepski,
    1991). The error is the sum of the noise and the bias due to curvature. The bias is estimated from the
    change to the next longer span, scaled by the squared ratio of the spans; near the ends, from the change
    from the next shorter span.

    Parameters
    ----------
    values : (n,) array
        Values at successive half cycles.
    noise : (n,) array
        Standard deviations of the values; 0 for a computed motion.

    Returns
    -------
    Slopes
        Slopes at the n - 2 inner points.
    """
    # Slopes of the least-squares lines over 2 m + 1 values and their standard deviations, one row for each span.
    count = values.size - 2
    spans = np.array([m for m in CANDIDATE_HALF_SPANS if 2 * m < values.size])
    # The last row is that of a span that exists nowhere. It follows the longest span and precedes the shortest one.
    slopes, noises = np.full((2, spans.size + 1, count), np.nan)
    for k, m in enumerate(spans):
        offsets = np.arange(-m, m + 1)
        weight = offsets / np.sum(offsets**2)
        inside = slice(m - 1, count - m + 1)
        slopes[k, inside] = np.correlate(values, weight, "valid")
        noises[k, inside] = np.sqrt(np.correlate(noise**2, weight**2, "valid"))

    # The noise of a difference of two nested fits has the difference of their variances.
    is_accepted = ~np.isnan(slopes)
    for k in range(1, spans.size):
        excess = np.sqrt(np.maximum(noises[:k] ** 2 - noises[k] ** 2, 0.0))
        # Largest difference between the slopes fitted over two spans, in standard deviations.
        limits = 2.0 * excess + VALUE_ROUND_OFF * np.abs(slopes[:k])
        differs = (np.abs(slopes[k] - slopes[:k]) > limits).any(axis=0)
        is_accepted[k] &= is_accepted[k - 1] & ~differs
    longest = is_accepted.sum(axis=0) - 1
    points = np.arange(count)
    slope = slopes[longest, points]
    spread = noises[longest, points]
    span = spans[longest]

    # Curvature biases the slope over 2 m + 1 values by b m^2 with a constant b. Between the longest accepted span m and
    # the next one n the slope therefore changes by b (n^2 - m^2), from which b m^2 follows.
    bias = np.abs(slopes[longest + 1, points] - slope)
    next_span = np.append(spans, 0)[longest + 1]
    bias /= np.where(spread > 0, (next_span / span) ** 2 - 1, 1.0)
    shorter_change = np.abs(slopes[longest - 1, points] - slope) - noises[longest - 1, points]
    bias = np.where(np.isnan(bias), np.maximum(shorter_change, 0.0), bias)
    # At the first and the last inner point, only the shortest span exists. There, the bias of values without
    # noise is estimated from the second difference.
    curvature = np.where(spread > 0, 0.0, np.abs(np.diff(values, 2)) / 2)
    bias = np.where(np.isnan(bias), curvature, bias)
    # Half-width of a 95 % interval in standard deviations; above 1.96, because the span of the fit
    # is chosen by means of the same data.
    error = 2.5 * spread + bias + VALUE_ROUND_OFF * np.abs(slope)
    return Slopes(slope, error, span)


def _add_damping_error(curve: DecayCurve) -> DecayCurve:
    """Add the error that the decay of the amplitude within a half cycle causes to the errors of a curve.

    Half the size of a half cycle is cosh(delta/2) times the amplitude at its midpoint, where delta is the
    logarithmic decrement per half cycle. The error is the change of the curve over this difference of
    amplitude.
    """
    delta = np.pi * curve.damping / np.sqrt(np.maximum(1 - curve.damping**2, VALUE_ROUND_OFF))
    decrement = np.abs(np.gradient(np.log(curve.amplitude)))
    min_decrement = np.maximum(np.abs(delta), VALUE_ROUND_OFF)
    fraction = delta**2 / 8 / np.maximum(decrement, min_decrement)
    errors = {}
    for name in ("frequency", "damping"):
        change = fraction * np.abs(np.gradient(getattr(curve, name)))
        errors[f"{name}_error"] = getattr(curve, f"{name}_error") + change
    return curve._replace(**errors)


def smooth_slopes(values, noise) -> np.ndarray:
    """Return the fitted slopes (n,) of values per half cycle; end values repeat their neighbours."""
    return np.pad(fit_slopes(values, noise).slope, 1, "edge")


def _limit_noise(noise, values) -> np.ndarray:
    """Return standard deviations (n,) that are at least an estimate from third differences.

    The third differences of a parabola vanish; those of white noise have 20 times its variance. Values without
    noise are not changed.
    """
    if not noise.any() or values.size < 4:
        return noise
    variance = np.diff(values, 3) ** 2 / 20
    middle = np.arange(values.size) - 1
    first = np.clip(middle - NOISE_HALF_WIDTH_IN_HALF_CYCLES, 0, variance.size)
    last = np.clip(middle + NOISE_HALF_WIDTH_IN_HALF_CYCLES, 0, variance.size)
    sums = np.concatenate([[0.0], np.cumsum(variance)])
    return np.sqrt(np.maximum(noise**2, (sums[last] - sums[first]) / np.maximum(last - first, 1)))
