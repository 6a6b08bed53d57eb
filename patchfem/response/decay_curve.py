"""Frequency and damping ratio of a decay against its amplitude, with 95 % intervals.

In: the half swings of a decay, i.e. the motion from one turning point to the next. The turning
points of a computed motion come from the cubic between samples (`find_turning_points`), the half swings of a
measured one from a sine fitted to each (`identify.half_cycles`). Out: a `DecayCurve`.

Half swing k has a middle t_k and a size S_k. Over 2 m + 1 half swings, the slope of ln S_k is
the logarithmic decrement of half a cycle, pi zeta/(1 - zeta^2)^(1/2), and the slope of t_k is
half a period. Both are exact for a viscous decay and any m, and are means over the span for any
other decay. The error due to noise falls with m^(-3/2), that due to the curvature grows with m^2:
the span is the longest one whose slope agrees with those of all shorter ones (Lepski, 1991).
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

# numbers m of half swings on both sides of a point that are tried as spans
SPAN_LENGTHS = (
    1,
    2,
    3,
    4,
    6,
    8,
    12,
    16,
    24,
    32,
    48,
    64,
    96,
    128,
    192,
    256,
)
MAX_SLOPE_DIFFERENCE = 2.0  # standard deviations by which the slopes of two spans may differ
INTERVAL_DEVIATIONS = (
    2.5  # standard deviations of a 95 % interval, widened because the span is chosen by the data
)
NOISE_HALF_WIDTH = 8  # half swings on both sides whose third differences estimate the noise
SAMPLING_HALF_WIDTH = 4  # points on both sides over which the largest sampling error is taken
N_NEWTON_STEPS = 3  # Newton steps to a turning point
VALUE_ROUND_OFF = 1e-12  # round-off of a value, relative
REST_SPEED_TOL = 1e-12  # relative to the largest speed; a slower sample is a turning point itself
MIN_HALF_SWING = 1e-9  # relative to the largest half swing; a smaller one is round-off
STEP_END_TOL = (
    1e-9  # fraction of a step by which round-off may move a turning point outside the step
)
# relative to the range in one period; a smaller reversal is attributed to a faster mode
MAX_WIGGLE = 0.25
RANGE_TOL = 1e-6  # relative; a curve is evaluated this far beyond its end points


class HalfSwings(NamedTuple):
    """Half swings of a decay, each from one turning point to the next.

    - middle (k,): time of the middle [s].
    - size (k,): distance between the two turning points [m].
    - middle_noise, size_noise (k,): standard deviations of both by noise [s], [m]; 0 for a computed
      motion.
    """

    middle: np.ndarray
    size: np.ndarray
    middle_noise: np.ndarray
    size_noise: np.ndarray


class DecayCurve(NamedTuple):
    """Frequency and damping ratio of a decay against amplitude, largest amplitude first.

    - time (k,): [s].
    - amplitude (k,): [m].
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

    def at(self, pick) -> "DecayCurve":
        """Return the points of the curve that indices, a slice or booleans select."""
        return DecayCurve(*(part[pick] for part in self))

    def interpolate(self, amplitudes) -> "DecayCurve":
        """Return the curve at other amplitudes (k,) [m]; NaN outside its range.

        Monotone cubics over the logarithm of the amplitude are used. Their difference from linear
        interpolation is added to the errors.
        """
        if not self.amplitude.size:
            return DecayCurve(*np.full((6, len(amplitudes)), np.nan))._replace(
                amplitude=np.asarray(amplitudes)
            )
        knots, first = np.unique(np.log(self.amplitude), return_index=True)
        x = np.log(amplitudes)
        curve = self.at(first)
        inside = (x > knots[0] - RANGE_TOL) & (x < knots[-1] + RANGE_TOL)
        out = {name: np.interp(x, knots, getattr(curve, name)) for name in DecayCurve._fields}
        for name in ("frequency", "damping"):
            linear = out[name]
            out[name] = _interpolate_monotone(x, knots, getattr(curve, name))
            out[f"{name}_error"] = out[f"{name}_error"] + np.abs(out[name] - linear)
        return DecayCurve(
            **{name: np.where(inside, part, np.nan) for name, part in out.items()}
        )._replace(amplitude=np.asarray(amplitudes))

    def add_sampling_error(self, other: "DecayCurve") -> "DecayCurve":
        """Return the curve with the sampling error added to its errors.

        The error is the largest difference from the curve of `find_turning_points_outside` at the points
        around.
        """
        if not self.amplitude.size:
            return self
        outside = other.interpolate(self.amplitude)
        out = {}
        for name in ("frequency", "damping"):
            change = np.nan_to_num(np.abs(getattr(self, name) - getattr(outside, name)))
            padded = np.pad(change, SAMPLING_HALF_WIDTH)
            around = sliding_window_view(padded, 2 * SAMPLING_HALF_WIDTH + 1)
            out[f"{name}_error"] = getattr(self, f"{name}_error") + around.max(axis=1)
        return self._replace(**out)

    def add_difference(self, one: "DecayCurve", other: "DecayCurve") -> "DecayCurve":
        """Return the curve with the difference of two other curves added to its errors.

        An error is infinite where one of both curves has no value.
        """

        def wider(name: str) -> np.ndarray:
            """Return the error of a field with the difference of both curves added."""
            change = np.abs(getattr(one, name) - getattr(other, name))
            return getattr(self, f"{name}_error") + np.where(np.isnan(change), np.inf, change)

        return self._replace(frequency_error=wider("frequency"), damping_error=wider("damping"))


def find_turning_points(time, place, speed) -> tuple:
    """Return the times (k,) [s] and positions (k,) [m] of the turning points of a motion.

    The cubic through the samples on both sides is used.

    Parameters
    ----------
    time, place, speed : (n,)
        Samples of time [s], position [m] and speed [m/s] at any spacing, with every turning point
        at a sample or alone between two of them.
    """
    speed = np.where(np.abs(speed) <= REST_SPEED_TOL * np.abs(speed).max(initial=0.0), 0.0, speed)
    still = np.flatnonzero(speed == 0)
    k = np.flatnonzero(speed[:-1] * speed[1:] < 0)
    span = time[k + 1] - time[k]
    places = (place[k], place[k + 1])
    speeds = speed[k] * span, speed[k + 1] * span
    share = _find_turning_fraction(places, speeds)
    times = np.concatenate([time[still], time[k] + share * span])
    found = np.concatenate([place[still], _evaluate_cubic(places, speeds, share)])
    order = np.lexsort((found, times))
    # the samples before and after a jump of the force at a turning point have the same time
    apart = VALUE_ROUND_OFF * float(np.ptp(time))
    order = order[np.diff(times[order], prepend=-np.inf) > apart]
    return times[order], found[order]


def measure_last_swing(time, place, speed, period: float) -> float | None:
    """Return half the peak-to-peak value [m] of the last whole cycle of a motion.

    The cycle reaches from a turning point to the next but one. A smaller reversal than MAX_WIGGLE of
    the range in the last period is that of a faster mode and is ignored.

    Parameters
    ----------
    time, place, speed : (n,)
        Samples, as in `find_turning_points`.
    period : float
        Period [s].

    Returns
    -------
    float or None
        Half the range in the last period if the motion is at rest there; None if it has fewer than
        three turning points.
    """
    late = float(np.ptp(place[time >= time[-1] - period * (1 + STEP_END_TOL)]))
    if late <= MIN_HALF_SWING * np.ptp(place):
        return late / 2
    # turning points from the end of the motion; direction; farthest position since the last turning
    # point
    found = []
    way = 0
    far = float(place[-1])
    for at in find_turning_points(time, place, speed)[1][::-1].tolist():
        if way == 0:
            way = int(np.sign(at - far)) if abs(at - far) > MAX_WIGGLE * late else 0
            far = at if way else far
        elif way * (at - far) > 0:
            far = at
        elif way * (far - at) > MAX_WIGGLE * late:
            found.append(far)
            far = at
            way = -way
        if len(found) == 3:
            return max(abs(found[0] - found[1]), abs(found[1] - found[2])) / 2
    return None


def find_turning_points_outside(time, place, speed) -> tuple:
    """Return the turning points as `find_turning_points` does, from the cubics of the neighbouring steps.

    The times between two samples are the means of the zeros of the speed on the continued cubics of
    the steps before and after. If the force of a law reverses with the speed within less than a
    step, it does so at the turning point: each of these cubics contains the force on its own side,
    whereas the cubic between the two samples is distorted by the jump.

    Parameters
    ----------
    time, place, speed : (n,)
        Samples, as in `find_turning_points`.
    """
    times, places = find_turning_points(time, place, speed)
    k = np.flatnonzero(speed[1:-2] * speed[2:-1] < 0) + 1
    share = speed[k] / (speed[k] - speed[k + 1])

    def find_zero(step, near):
        """Find the time [s] of zero speed on the continued cubic of a step by Newton's method.

        near: initial guess as a fraction of the step, outside 0 to 1.
        """
        span = time[step + 1] - time[step]
        a = place[step]
        b = place[step + 1]
        c = speed[step] * span
        d = speed[step + 1] * span
        two = 2 * (3 * (b - a) - 2 * c - d)
        three = 3 * (2 * (a - b) + c + d)
        for _ in range(N_NEWTON_STEPS):
            near = near - (c + near * (two + near * three)) / (two + 2 * near * three)
        return time[step] + near * span

    at = (find_zero(k - 1, 1 + share) + find_zero(k + 1, share - 1)) / 2
    # round-off may move a turning point to the sample before it
    between = (at >= time[k]) & (at <= time[k + 1])
    times[np.searchsorted(times, time[k])[between]] = at[between]
    return times, places


def half_swings_between(times, places, size=None) -> HalfSwings:
    """Return the half swings between the turning points of a computed motion.

    They end before the first one that is not smaller than its predecessor or that is round-off of
    the largest.

    Parameters
    ----------
    times, places : (k,)
        Turning points: times [s] and positions [m].
    size : (k - 1,), optional
        Sizes of the half swings at another point of the structure [m]; None: distances of `places`.
    """
    own = np.abs(np.diff(places))
    ends = np.flatnonzero(
        (np.diff(own, prepend=np.inf) >= 0) | (own <= MIN_HALF_SWING * own.max(initial=0.0))
    )
    count = int(ends[0]) if ends.size else own.size
    still = np.zeros(count)
    return HalfSwings(
        (times[1:] + times[:-1])[:count] / 2, (own if size is None else size)[:count], still, still
    )


def compute_swing_curve(swings: HalfSwings) -> DecayCurve:
    """Return frequency and damping ratio against amplitude from the half swings of a decay.

    A computed decay has a point at each inner half swing, a measured one at half swings whose spans
    overlap by half. Fewer than three half swings give no point.
    """
    if swings.size.size < 3:
        return DecayCurve(*np.empty((6, 0)))
    log = np.log(swings.size)
    fall = fit_slopes(log, _limit_noise(swings.size_noise / swings.size, log))
    noise = _limit_noise(swings.middle_noise, swings.middle)
    half = fit_slopes(swings.middle, noise)
    at = np.arange(half.span.size)
    if noise.any():
        at = _overlap_spans(np.minimum(half.span, fall.span))
    half = half.at(at)
    fall = fall.at(at)
    tilt = np.hypot(np.pi, fall.slope)
    found = DecayCurve(
        time=swings.middle[1 + at],
        amplitude=np.exp(_smooth_values(log, 1 + at, fall.span)) / 2,
        frequency=0.5 / half.slope,
        frequency_error=0.5 * half.error / half.slope**2,
        damping=-fall.slope / tilt,
        damping_error=fall.error * np.pi**2 / tilt**3,
    )
    return _add_sampling_error(found) if found.time.size > 1 else found


def _overlap_spans(span) -> np.ndarray:
    """Choose inner half swings so that the spans (n,) around them overlap by half."""
    out = [0]
    while (place := out[-1] + max(1, int(span[out[-1]]))) < span.size:
        out.append(place)
    return np.array(out)


def _smooth_values(values, places, span) -> np.ndarray:
    """Evaluate at each index the least-squares parabola over the span around it."""
    out = np.empty(places.size)
    for m in np.unique(span):
        here = span == m
        out[here] = sliding_window_view(values, 2 * m + 1)[places[here] - m] @ _parabola_weights(m)
    return out


class Slopes(NamedTuple):
    """Slopes (k,) per half swing, the half-widths of their intervals, and their spans m."""

    slope: np.ndarray
    error: np.ndarray
    span: np.ndarray

    def at(self, pick) -> "Slopes":
        """Return the slopes that indices, a slice or booleans select."""
        return Slopes(*(part[pick] for part in self))


def fit_slopes(values, noise) -> Slopes:
    """Fit the slope at each inner point over the longest span that agrees with all shorter ones.

    Spans grow until the slope differs from that of a shorter span by more than the noise of both
    allows (Lepski, 1991). The error is the sum of two parts: the noise, and the bias of a mean. The
    bias is estimated from the change over the next longer span m', multiplied by (m/m')^2; near the
    ends, from the change over the next shorter span.

    Parameters
    ----------
    values : (n,) array
        Values at the half swings.
    noise : (n,) array
        Their standard deviations; 0 for a computed motion.

    Returns
    -------
    Slopes
        At the n - 2 inner points.
    """
    count = values.size - 2
    slope = np.empty(count)
    spread = np.zeros(count)
    bias = np.full(count, np.nan)
    shorter_change = np.full(count, np.nan)  # change over the next shorter span, minus its noise
    span = np.zeros(count, int)
    grows = np.ones(count, bool)
    tried: list = []
    for m in SPAN_LENGTHS:
        if 2 * m >= values.size or not grows.any():
            break
        weight = np.arange(-m, m + 1) / np.sum(np.arange(-m, m + 1) ** 2)
        inside = slice(m - 1, count - m + 1)
        wide, wide_spread = np.full((2, count), np.nan)
        wide[inside] = np.correlate(values, weight, "valid")
        wide_spread[inside] = np.sqrt(np.correlate(noise**2, weight**2, "valid"))
        reached = grows & ~np.isnan(wide)
        agrees = reached.copy()
        for other, other_spread in tried:
            excess = np.sqrt(np.maximum(other_spread**2 - wide_spread**2, 0.0))
            limit = MAX_SLOPE_DIFFERENCE * excess + VALUE_ROUND_OFF * np.abs(other)
            agrees &= ~(np.abs(wide - other) > limit)
        change = np.abs(wide - slope)
        ends = reached & ~agrees
        bias[ends] = change[ends]
        is_longer = agrees & (span > 0)
        shorter_change[is_longer] = np.maximum(change - spread, 0.0)[is_longer]
        still = ends & (spread > 0)
        bias[still] /= (m / span[still]) ** 2 - 1
        slope[agrees] = wide[agrees]
        spread[agrees] = wide_spread[agrees]
        span[agrees] = m
        grows = agrees
        tried.append((wide, wide_spread))
    at_end = np.isnan(bias)
    bias[at_end] = shorter_change[at_end]
    # Only the shortest span fits at the first and the last inner point. There the second difference
    # estimates the bias if the values have no noise.
    only = np.isnan(bias)
    bend = np.abs(np.diff(values, 2)) / 2
    bias[only] = np.where(spread > 0, 0.0, bend)[only]
    return Slopes(
        slope, INTERVAL_DEVIATIONS * spread + bias + VALUE_ROUND_OFF * np.abs(slope), span
    )


def _add_sampling_error(curve: DecayCurve) -> DecayCurve:
    """Add the errors that follow from amplitudes that are too large by the fraction delta^2/8.

    Half of a half swing is cosh(delta/2) times the amplitude at its middle, where delta is the
    decrement of half a cycle. The errors are the changes of the curve over this fraction of the
    amplitude.
    """
    delta = np.pi * curve.damping / np.sqrt(np.maximum(1 - curve.damping**2, VALUE_ROUND_OFF))
    decrement = np.abs(np.gradient(np.log(curve.amplitude)))
    min_decrement = np.maximum(np.abs(delta), VALUE_ROUND_OFF)
    fraction = delta**2 / 8 / np.maximum(decrement, min_decrement)
    out = {}
    for name in ("frequency", "damping"):
        change = fraction * np.abs(np.gradient(getattr(curve, name)))
        out[f"{name}_error"] = getattr(curve, f"{name}_error") + change
    return curve._replace(**out)


def smooth_slopes(values, noise) -> np.ndarray:
    """Return the slopes (n,) of values (n,) per half swing; both ends repeat their neighbour."""
    slope = fit_slopes(values, noise).slope
    return np.concatenate([slope[:1], slope, slope[-1:]])


def _limit_noise(noise, values) -> np.ndarray:
    """Return standard deviations (n,) that are not below those estimated from third differences.

    Third differences of a parabola vanish, those of white noise have 20 times its variance. Values
    without noise keep 0.
    """
    if not noise.any() or values.size < 4:
        return noise
    variance = np.diff(values, 3) ** 2 / 20
    middle = np.arange(values.size) - 1
    low = np.clip(middle - NOISE_HALF_WIDTH, 0, variance.size)
    high = np.clip(middle + NOISE_HALF_WIDTH, 0, variance.size)
    sums = np.concatenate([[0.0], np.cumsum(variance)])
    return np.sqrt(np.maximum(noise**2, (sums[high] - sums[low]) / np.maximum(high - low, 1)))


def _parabola_weights(m: int) -> np.ndarray:
    """Return the weights (2 m + 1,) for the midpoint value of a least-squares parabola."""
    x = np.arange(-m, m + 1)
    if m <= 1:
        return (x == 0) * 1.0
    x2 = x**2
    return (np.sum(x2**2) - np.sum(x2) * x2) / (x.size * np.sum(x2**2) - np.sum(x2) ** 2)


def _interpolate_monotone(x, own, values) -> np.ndarray:
    """Interpolate values (n,) at increasing positions own (n,) to x (k,) by monotone cubics.

    Fritsch and Butland (1984); x is clipped to the range of `own`.
    """
    from scipy.interpolate import PchipInterpolator

    x = np.clip(x, own[0], own[-1])
    return PchipInterpolator(own, values)(x) if own.size > 1 else np.interp(x, own, values)


def _evaluate_cubic(place, speed, share):
    """Return positions (k,) at the fractions `share` (k,) of steps, on cubics.

    place, speed: positions and speeds at both ends of the steps; the speeds are multiplied by the
    durations of the steps.
    """
    (a, b), (c, d), s = place, speed, share
    return a + s * (c + s * (3 * (b - a) - 2 * c - d + s * (2 * (a - b) + c + d)))


def _find_turning_fraction(place, speed) -> np.ndarray:
    """Return the fraction (k,) of the step at which the cubics have a turning point.

    The speeds at both ends have opposite signs.
    """
    (a, b), (c, d) = place, speed
    two = 2 * (3 * (b - a) - 2 * c - d)
    three = 3 * (2 * (a - b) + c + d)
    both = -(two + np.copysign(np.sqrt(np.maximum(two**2 - 4 * three * c, 0.0)), two)) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        near = c / both
        far = both / three
    return np.clip(np.where(np.abs(near - 0.5) <= 0.5 + STEP_END_TOL, near, far), 0.0, 1.0)
