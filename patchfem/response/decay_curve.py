"""Frequency and damping ratio of a decay against its amplitude, with 95 % intervals.

In: the half cycles of a decay, i.e. the motion from one reversal to the next. The turning
points of a computed motion come from the cubic between samples (`locate_reversals`), the half cycles of a
measured one from a sinusoid fitted to each (`identify.half_cycles`). Out: a `DecayCurve`.

Half cycle k has a middle t_k and a size S_k. Over 2 m + 1 half cycles, the slope of ln S_k is
the logarithmic decrement of half a cycle, pi zeta/(1 - zeta^2)^(1/2), and the slope of t_k is
half a period. Both are exact for a viscous decay and any m, and are means over the span for any
other decay. The error due to noise falls with m^(-3/2), that due to the curvature grows with m^2:
the span is the longest one whose slope agrees with those of all shorter ones (Lepski, 1991).
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

# Numbers of half cycles on both sides of a point that are tried as spans of a fit.
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
MAX_SLOPE_DIFFERENCE = 2.0  # Largest difference of the slopes of two spans, in standard deviations.
# Standard deviations of a 95 % interval, widened because the data choose the span.
INTERVAL_DEVIATIONS = 2.5
# Number of half cycles on both sides whose third differences estimate the noise.
NOISE_HALF_WIDTH = 8
# Number of points on both sides over which the largest sampling error is taken.
SAMPLING_HALF_WIDTH = 4
N_NEWTON_STEPS = 3  # Number of Newton steps with which the time of a reversal is refined.
VALUE_ROUND_OFF = 1e-12  # Relative round-off error of a value.
# Ratio of the speed to the largest speed below which a sample is itself a reversal.
REST_SPEED_TOL = 1e-12
MIN_HALF_CYCLE = 1e-9  # A half cycle smaller than this fraction of the largest one is round-off.
STEP_END_TOL = 1e-9  # fraction of a step by which round-off may move a reversal outside the step
# Largest reversal, relative to the range in one period, that is attributed to a faster mode.
MAX_RIPPLE = 0.25
RANGE_TOL = 1e-6  # Relative distance beyond its end points up to which a curve is evaluated.


class HalfCycles(NamedTuple):
    """Half cycles of a decaying motion, each from a reversal to the next.

    - middle (k,): time of the middle [s].
    - size (k,): distance between the two reversals [m].
    - middle_noise, size_noise (k,): standard deviations of both by noise [s], [m]; 0 for a computed
      motion.
    """

    middle: np.ndarray
    size: np.ndarray
    middle_noise: np.ndarray
    size_noise: np.ndarray


class DecayCurve(NamedTuple):
    """Frequency and damping ratio of a decay against amplitude, from large to small amplitudes.

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

    def at(self, selection) -> "DecayCurve":
        """Return the points of the curve at given indices."""
        return DecayCurve(*(part[selection] for part in self))

    def interpolate(self, amplitudes) -> "DecayCurve":
        """Interpolate the curve at given amplitudes (k,) [m]; NaN outside its range.

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
        """Widen the errors of the curve by the error due to sampling the motion.

        The added error is the largest difference from the curve of
        `find_reversals_by_extrapolation` at the neighbouring points.
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

    def add_difference(self, first_curve: "DecayCurve", second_curve: "DecayCurve") -> "DecayCurve":
        """Widen the errors of the curve by the difference of two other curves.

        An error is infinite where either of these curves has no value.
        """

        def wider(name: str) -> np.ndarray:
            """Return the error of one column, widened by the difference of the two curves."""
            change = np.abs(getattr(first_curve, name) - getattr(second_curve, name))
            return getattr(self, f"{name}_error") + np.where(np.isnan(change), np.inf, change)

        return self._replace(frequency_error=wider("frequency"), damping_error=wider("damping"))


def locate_reversals(time, position, speed) -> tuple:
    """Return the times (k,) [s] and positions (k,) [m] at which a motion reverses.

    They are computed on the cubics through the samples on both sides.

    Parameters
    ----------
    time, position, speed : (n,)
        Samples of time [s], position [m] and speed [m/s] at any spacing, with every reversal at a
        sample or alone between two of them.
    """
    speed = np.where(np.abs(speed) <= REST_SPEED_TOL * np.abs(speed).max(initial=0.0), 0.0, speed)
    still = np.flatnonzero(speed == 0)
    k = np.flatnonzero(speed[:-1] * speed[1:] < 0)
    span = time[k + 1] - time[k]
    positions = (position[k], position[k + 1])
    speeds = speed[k] * span, speed[k + 1] * span
    fraction = _find_reversal_fraction(positions, speeds)
    times = np.concatenate([time[still], time[k] + fraction * span])
    reversal_positions = np.concatenate(
        [position[still], _evaluate_cubic(positions, speeds, fraction)]
    )
    order = np.lexsort((reversal_positions, times))
    # The samples before and after a jump of the force at a reversal have the same time.
    min_interval = VALUE_ROUND_OFF * float(np.ptp(time))
    order = order[np.diff(times[order], prepend=-np.inf) > min_interval]
    return times[order], reversal_positions[order]


def measure_last_cycle_amplitude(time, position, speed, period: float) -> float | None:
    """Return half the peak-to-peak value [m] of the last complete cycle of a motion.

    The cycle reaches from a reversal to the next but one. A reversal smaller than MAX_RIPPLE times
    the range in the last period belongs to a faster mode and is ignored.

    Parameters
    ----------
    time, position, speed : (n,)
        Samples, as in `locate_reversals`.
    period : float
        Period [s].

    Returns
    -------
    float or None
        Half the range in the last period if the motion is at rest there; None if it has fewer than
        three reversals.
    """
    last_range = float(np.ptp(position[time >= time[-1] - period * (1 + STEP_END_TOL)]))
    if last_range <= MIN_HALF_CYCLE * np.ptp(position):
        return last_range / 2
    # Going back from the end of the motion, the loop collects reversals and tracks the direction
    # and the farthest position since the last one.
    reversal_positions = []
    direction = 0
    farthest = float(position[-1])
    for reversal in locate_reversals(time, position, speed)[1][::-1].tolist():
        if direction == 0:
            if abs(reversal - farthest) > MAX_RIPPLE * last_range:
                direction = int(np.sign(reversal - farthest))
                farthest = reversal
        elif direction * (reversal - farthest) > 0:
            farthest = reversal
        elif direction * (farthest - reversal) > MAX_RIPPLE * last_range:
            reversal_positions.append(farthest)
            farthest = reversal
            direction = -direction
        if len(reversal_positions) == 3:
            return (
                max(
                    abs(reversal_positions[0] - reversal_positions[1]),
                    abs(reversal_positions[1] - reversal_positions[2]),
                )
                / 2
            )
    return None


def find_reversals_by_extrapolation(time, position, speed) -> tuple:
    """Find the reversals of a motion from cubics that are extrapolated from adjacent steps.

    The times between two samples are the means of the zeros of the speed on the extrapolated cubics
    of the steps before and after. If the force of a law reverses with the speed within less than a
    step, it does so at the reversal: each of these cubics contains the force on its own side,
    whereas the cubic between the two samples is distorted by the jump.

    Parameters
    ----------
    time, position, speed : (n,)
        Samples, as in `locate_reversals`.
    """
    times, positions = locate_reversals(time, position, speed)
    k = np.flatnonzero(speed[1:-2] * speed[2:-1] < 0) + 1
    fraction = speed[k] / (speed[k] - speed[k + 1])

    def find_zero(step, guess):
        """Find by Newton's method the time [s] of zero speed on the extrapolated cubic of a step.

        near: initial guess as a fraction of the step, outside 0 to 1.
        """
        span = time[step + 1] - time[step]
        a = position[step]
        b = position[step + 1]
        c = speed[step] * span
        d = speed[step + 1] * span
        two = 2 * (3 * (b - a) - 2 * c - d)
        three = 3 * (2 * (a - b) + c + d)
        for _ in range(N_NEWTON_STEPS):
            guess = guess - (c + guess * (two + guess * three)) / (two + 2 * guess * three)
        return time[step] + guess * span

    reversal_times = (find_zero(k - 1, 1 + fraction) + find_zero(k + 1, fraction - 1)) / 2
    # Round-off may move a reversal to the sample before it.
    is_inside = (reversal_times >= time[k]) & (reversal_times <= time[k + 1])
    times[np.searchsorted(times, time[k])[is_inside]] = reversal_times[is_inside]
    return times, positions


def make_half_cycles(times, positions, size=None) -> HalfCycles:
    """Return the half cycles between the reversals of a computed decaying motion.

    They end before the first half cycle that is not smaller than its predecessor or that is round-
    off of the largest.

    Parameters
    ----------
    times, positions : (k,)
        Reversals: times [s] and positions [m].
    size : (k - 1,), optional
        Sizes of the half cycles at another point of the structure [m]; None: distances of
        `positions`.
    """
    distances = np.abs(np.diff(positions))
    ends = np.flatnonzero(
        (np.diff(distances, prepend=np.inf) >= 0)
        | (distances <= MIN_HALF_CYCLE * distances.max(initial=0.0))
    )
    count = int(ends[0]) if ends.size else distances.size
    no_noise = np.zeros(count)
    return HalfCycles(
        (times[1:] + times[:-1])[:count] / 2,
        (distances if size is None else size)[:count],
        no_noise,
        no_noise,
    )


def fit_decay_curve(half_cycles: HalfCycles) -> DecayCurve:
    """Compute frequency and damping ratio against amplitude from half cycles of a decay.

    A computed decay has a point at each inner half cycle, a measured one at half cycles whose spans
    overlap by half. Fewer than three half cycles give no point.
    """
    if half_cycles.size.size < 3:
        return DecayCurve(*np.empty((6, 0)))
    log = np.log(half_cycles.size)
    fall = fit_slopes(log, _limit_noise(half_cycles.size_noise / half_cycles.size, log))
    noise = _limit_noise(half_cycles.middle_noise, half_cycles.middle)
    half = fit_slopes(half_cycles.middle, noise)
    selected = np.arange(half.span.size)
    if noise.any():
        selected = _overlap_spans(np.minimum(half.span, fall.span))
    half = half.at(selected)
    fall = fall.at(selected)
    decay_per_radian = np.hypot(np.pi, fall.slope)
    curve = DecayCurve(
        time=half_cycles.middle[1 + selected],
        amplitude=np.exp(_smooth_values(log, 1 + selected, fall.span)) / 2,
        frequency=0.5 / half.slope,
        frequency_error=0.5 * half.error / half.slope**2,
        damping=-fall.slope / decay_per_radian,
        damping_error=fall.error * np.pi**2 / decay_per_radian**3,
    )
    return _add_sampling_error(curve) if curve.time.size > 1 else curve


def _overlap_spans(span) -> np.ndarray:
    """Select inner half cycles such that the spans (n,) around them overlap by half."""
    out = [0]
    while (place := out[-1] + max(1, int(span[out[-1]]))) < span.size:
        out.append(place)
    return np.array(out)


def _smooth_values(values, indices, span) -> np.ndarray:
    """Fit parabolas to values over moving spans, and evaluate them at the midpoints."""
    out = np.empty(indices.size)
    for m in np.unique(span):
        has_span = span == m
        out[has_span] = sliding_window_view(values, 2 * m + 1)[
            indices[has_span] - m
        ] @ _parabola_weights(m)
    return out


class Slopes(NamedTuple):
    """Slopes of a quantity per half cycle, with confidence half-widths and fit spans.

    All are (k,); a span is its number of half cycles on either side.
    """

    slope: np.ndarray
    error: np.ndarray
    span: np.ndarray

    def at(self, selection) -> "Slopes":
        """Return the slopes at given indices."""
        return Slopes(*(part[selection] for part in self))


def fit_slopes(values, noise) -> Slopes:
    """Fit the slope at each inner point over the longest span consistent with shorter ones.

    Spans grow until the slope differs from that of a shorter span by more than the noise of both
    allows (Lepski, 1991). The error is the sum of two parts: the noise, and the bias of a mean. The
    bias is estimated from the change over the next longer span m', multiplied by (m/m')^2; near the
    ends, from the change over the next shorter span.

    Parameters
    ----------
    values : (n,) array
        Values at successive half cycles.
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
    # Change of the slope from the next shorter fit span to the current one, minus its noise.
    shorter_change = np.full(count, np.nan)
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
    """Widen the errors of a decay curve by the effect of damping within a half cycle.

    Half of a half cycle is cosh(delta/2) times the amplitude at its middle, where delta is the
    logarithmic decrement over half a cycle. The errors are the changes of the curve over this
    fraction of the amplitude.
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
    """Return the fitted slopes (n,) of values per half cycle; both ends repeat their neighbour."""
    slope = fit_slopes(values, noise).slope
    return np.concatenate([slope[:1], slope, slope[-1:]])


def _limit_noise(noise, values) -> np.ndarray:
    """Raise standard deviations (n,) to at least an estimate from third differences.

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
    """Return the weights (2 m + 1,) of the midpoint value of a least-squares parabola."""
    x = np.arange(-m, m + 1)
    if m <= 1:
        return (x == 0) * 1.0
    x2 = x**2
    return (np.sum(x2**2) - np.sum(x2) * x2) / (x.size * np.sum(x2**2) - np.sum(x2) ** 2)


def _interpolate_monotone(x, knots, values) -> np.ndarray:
    """Interpolate values (n,) at increasing knots (n,) to positions x (k,) by monotone cubics.

    Fritsch and Butland (1984); x is clipped to the range of the knots.
    """
    from scipy.interpolate import PchipInterpolator

    x = np.clip(x, knots[0], knots[-1])
    return PchipInterpolator(knots, values)(x) if knots.size > 1 else np.interp(x, knots, values)


def _evaluate_cubic(position, speed, fraction):
    """Evaluate Hermite cubics at given fractions (k,) of their steps.

    position, speed: values at both ends of the steps; the speeds are multiplied by the durations of
    the steps.
    """
    a, b = position
    c, d = speed
    s = fraction
    return a + s * (c + s * (3 * (b - a) - 2 * c - d + s * (2 * (a - b) + c + d)))


def _find_reversal_fraction(position, speed) -> np.ndarray:
    """Return the fraction (k,) of each step at which the position on a cubic reverses.

    The speeds at both ends have opposite signs.
    """
    a, b = position
    c, d = speed
    two = 2 * (3 * (b - a) - 2 * c - d)
    three = 3 * (2 * (a - b) + c + d)
    both = -(two + np.copysign(np.sqrt(np.maximum(two**2 - 4 * three * c, 0.0)), two)) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        first_root = c / both
        second_root = both / three
    return np.clip(
        np.where(np.abs(first_root - 0.5) <= 0.5 + STEP_END_TOL, first_root, second_root), 0.0, 1.0
    )
