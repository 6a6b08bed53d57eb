"""Frequency and damping of a decay over its amplitude with intervals, from its half swings, computed or measured.

A computed motion has its turns by the cubic between samples (`turns`), a measured one its half swings by a sine fitted
to each (`identify.swings`). Half swing k has a middle t_k and a size S_k, from turn to turn. Over 2 m + 1 of them the
slope of ln S_k tells the logarithmic decrement of half a cycle, pi zeta/(1 - zeta^2)^(1/2), the slope of t_k half a
period. Of a viscous decay both are exact for any m, of any other they are means over the span. What noise leaves falls
with m^(-3/2), what the bend leaves grows with m^2: the span is the longest whose value those of all shorter ones allow
(Lepski 1991).
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

# half swings m on both sides of a point
SPANS = (
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
APART = 2.0  # standard deviations by which the values of two spans may differ
SURE = 2.5  # standard deviations of an interval of 95 %, with what choosing the span adds
BESIDE = 8  # half swings on both sides whose third differences show noise
NEAR = 4  # points on both sides that show what samples leave open
NEWTON = 3  # steps to a turn
ROUND = 1e-12  # of a value, what round-off leaves
REST = 1e-12  # of the largest speed, one below which a sample is a turn itself
FAINT = 1e-9  # of the largest half swing, one below which is round-off
EDGE = 1e-9  # of a step, by which round-off may lay a turn outside it
WIGGLE = 0.25  # of the range of a motion in a period, a way back below which another mode makes it
CLOSE = 1e-6  # of an amplitude, by which a curve reaches beyond its ends


class HalfSwings(NamedTuple):
    """Half swings of a decay: middle (k,) [s], size (k,) [m], from one turn to the next, and the standard deviations
    (k,) that noise leaves in both, 0 of a computed motion."""

    middle: np.ndarray
    size: np.ndarray
    middle_noise: np.ndarray
    size_noise: np.ndarray


class DecayCurve(NamedTuple):
    """Of a decay, largest amplitude first: time (k,) [s], amplitude (k,) [m], frequency (k,) [Hz] as it is seen and
    damping ratio (k,) [1], each with the half-width (k,) of its interval of 95 %."""

    time: np.ndarray
    amplitude: np.ndarray
    frequency: np.ndarray
    frequency_error: np.ndarray
    damping: np.ndarray
    damping_error: np.ndarray

    def at(self, pick) -> "DecayCurve":
        """Some of its points."""
        return DecayCurve(*(part[pick] for part in self))

    def over(self, amplitudes) -> "DecayCurve":
        """The curve at other amplitudes (k,) [m], by cubics over their logarithms, with what straight lines change in
        its errors; NaN outside it."""
        if not self.amplitude.size:
            return DecayCurve(*np.full((6, len(amplitudes)), np.nan))._replace(
                amplitude=np.asarray(amplitudes)
            )
        own, first = np.unique(np.log(self.amplitude), return_index=True)
        x = np.log(amplitudes)
        found = self.at(first)
        inside = (x > own[0] - CLOSE) & (x < own[-1] + CLOSE)
        out = {name: np.interp(x, own, getattr(found, name)) for name in DecayCurve._fields}
        for name in ("frequency", "damping"):
            straight, out[name] = out[name], _by_cubics(x, own, getattr(found, name))
            out[f"{name}_error"] = out[f"{name}_error"] + np.abs(out[name] - straight)
        return DecayCurve(
            **{name: np.where(inside, part, np.nan) for name, part in out.items()}
        )._replace(amplitude=np.asarray(amplitudes))

    def unsampled(self, other: "DecayCurve") -> "DecayCurve":
        """The curve with what its samples leave open in its errors, where coarser runs have as many: what the curve of
        `turns_from_outside` differs by, at most, at the points around."""
        beside, out = other.over(self.amplitude), {}
        for name in ("frequency", "damping"):
            change = np.nan_to_num(np.abs(getattr(self, name) - getattr(beside, name)))
            out[f"{name}_error"] = getattr(self, f"{name}_error") + (
                sliding_window_view(np.pad(change, NEAR), 2 * NEAR + 1).max(axis=1)
                if change.size
                else 0.0
            )
        return self._replace(**out)

    def widened(self, one: "DecayCurve", other: "DecayCurve") -> "DecayCurve":
        """The curve with what two curves at its amplitudes differ by in its errors; infinite where one has no value."""

        def wider(name: str) -> np.ndarray:
            change = np.abs(getattr(one, name) - getattr(other, name))
            return getattr(self, f"{name}_error") + np.where(np.isnan(change), np.inf, change)

        return self._replace(frequency_error=wider("frequency"), damping_error=wider("damping"))


def turns(time, place, speed) -> tuple:
    """(times (k,) [s], places (k,) [m]) where a motion turns, by the cubic between the samples on both sides.

    time, place [m], speed [m/s]: (n,) of samples, however far apart, where each turn lies between two or at one.
    """
    speed = np.where(np.abs(speed) <= REST * np.abs(speed).max(initial=0.0), 0.0, speed)
    still, k = np.flatnonzero(speed == 0), np.flatnonzero(speed[:-1] * speed[1:] < 0)
    span, places = time[k + 1] - time[k], (place[k], place[k + 1])
    speeds = speed[k] * span, speed[k + 1] * span
    share = _zero(places, speeds)
    times = np.concatenate([time[still], time[k] + share * span])
    found = np.concatenate([place[still], _cubic(places, speeds, share)])
    order = np.lexsort((found, times))
    # a force that jumps at a turn has samples on both sides of it
    apart = ROUND * float(np.ptp(time))
    order = order[np.diff(times[order], prepend=-np.inf) > apart]
    return times[order], found[order]


def last_swing(time, place, speed, period: float) -> float | None:
    """Half the peak-to-peak [m] of the last whole cycle of a motion, from one turn to the next but one; half its range
    in the last period where it rests, None where it has fewer than three turns.

    time, place [m], speed [m/s]: (n,) as of `turns`; period [s]. A way back of less than WIGGLE of its range in the
    last period is no turn but that of a faster mode beside it.
    """
    late = float(np.ptp(place[time >= time[-1] - period * (1 + EDGE)]))
    if late <= FAINT * np.ptp(place):
        return late / 2
    # turns from the end on; the farthest place since the last of them
    found, way, far = (
        [],
        0,
        float(place[-1]),
    )
    for at in turns(time, place, speed)[1][::-1].tolist():
        if way == 0:
            way = int(np.sign(at - far)) if abs(at - far) > WIGGLE * late else 0
            far = at if way else far
        elif way * (at - far) > 0:
            far = at
        elif way * (far - at) > WIGGLE * late:
            found.append(far)
            far, way = at, -way
        if len(found) == 3:
            return max(abs(found[0] - found[1]), abs(found[1] - found[2])) / 2
    return None


def turns_from_outside(time, place, speed) -> tuple:
    """`turns`, those between samples by the cubics of the steps before and after, continued, in the middle of both.

    A law that turns its force with the speed in less than a step does so at the turn: both cubics know the force
    beside it, where the cubic between both samples is bent by its jump.
    """
    times, places = turns(time, place, speed)
    k = np.flatnonzero(speed[1:-2] * speed[2:-1] < 0) + 1
    share = speed[k] / (speed[k] - speed[k + 1])

    def found(step, near):
        span = time[step + 1] - time[step]
        a, b, c, d = place[step], place[step + 1], speed[step] * span, speed[step + 1] * span
        two, three = 2 * (3 * (b - a) - 2 * c - d), 3 * (2 * (a - b) + c + d)
        for _ in range(NEWTON):
            near = near - (c + near * (two + near * three)) / (two + 2 * near * three)
        return time[step] + near * span

    at = (found(k - 1, 1 + share) + found(k + 1, share - 1)) / 2
    # round-off may lay a turn at the sample before it
    between = (at >= time[k]) & (at <= time[k + 1])
    times[np.searchsorted(times, time[k])[between]] = at[between]
    return times, places


def of_turns(times, places, size=None) -> HalfSwings:
    """Half swings between the turns (k,) [s], (k,) [m] of a computed motion, as far as each is smaller than the one
    before and no round-off of the first; size (k - 1,) [m]: theirs at another point than the places."""
    own = np.abs(np.diff(places))
    ends = np.flatnonzero(
        (np.diff(own, prepend=np.inf) >= 0) | (own <= FAINT * own.max(initial=0.0))
    )
    count = int(ends[0]) if ends.size else own.size
    still = np.zeros(count)
    return HalfSwings(
        (times[1:] + times[:-1])[:count] / 2, (own if size is None else size)[:count], still, still
    )


def curve_of(swings: HalfSwings) -> DecayCurve:
    """Return frequency and damping against amplitude from the half swings of a decay.

    A computed decay has a point at each inner half swing, a measured one at half swings whose spans
    overlap by half. Fewer than three half swings give no point.
    """
    if swings.size.size < 3:
        return DecayCurve(*np.empty((6, 0)))
    log = np.log(swings.size)
    fall = fit_slopes(log, _at_least(swings.size_noise / swings.size, log))
    noise = _at_least(swings.middle_noise, swings.middle)
    half = fit_slopes(swings.middle, noise)
    at = np.arange(half.span.size)
    if noise.any():
        at = _overlap_by_half(np.minimum(half.span, fall.span))
    half, fall = half.at(at), fall.at(at)
    tilt = np.hypot(np.pi, fall.slope)
    found = DecayCurve(
        time=swings.middle[1 + at],
        amplitude=np.exp(_smooth_levels(log, 1 + at, fall.span)) / 2,
        frequency=0.5 / half.slope,
        frequency_error=0.5 * half.error / half.slope**2,
        damping=-fall.slope / tilt,
        damping_error=fall.error * np.pi**2 / tilt**3,
    )
    return _between_turns(found) if found.time.size > 1 else found


def _overlap_by_half(span) -> np.ndarray:
    """Choose inner places (n,) so that the spans about them overlap by half."""
    out = [0]
    while (place := out[-1] + max(1, int(span[out[-1]]))) < span.size:
        out.append(place)
    return np.array(out)


def _smooth_levels(values, places, span) -> np.ndarray:
    """Return the least-squares parabola over the span about each place, at the place."""
    out = np.empty(places.size)
    for m in np.unique(span):
        here = span == m
        out[here] = sliding_window_view(values, 2 * m + 1)[places[here] - m] @ _parabola(m)
    return out


class Slopes(NamedTuple):
    """Slopes (k,) per half swing, the half-widths of their intervals, and their spans."""

    slope: np.ndarray
    error: np.ndarray
    span: np.ndarray

    def at(self, pick) -> "Slopes":
        """Return some of the slopes."""
        return Slopes(*(part[pick] for part in self))


def fit_slopes(values, noise) -> Slopes:
    """Fit the slope at each inner place of a series, over the longest span that all shorter ones allow.

    A span ends before one whose slope differs from that of a shorter one by more than the noise of both
    allows (Lepski 1991). The error is that by noise, and what the slope may be off by as it is a mean:
    its change over the next longer span m', of whose bias it has the share (m/m')^2; at the ends, its
    change over the next shorter one.

    Parameters
    ----------
    values : (n,) array
        Values at the half swings.
    noise : (n,) array
        Their standard deviations; 0 for a computed motion.

    Returns
    -------
    Slopes
        At the n - 2 inner places.
    """
    count = values.size - 2
    slope = np.empty(count)
    spread = np.zeros(count)
    bias = np.full(count, np.nan)
    shorter_change = np.full(count, np.nan)  # Change over the next shorter span, less its noise.
    span = np.zeros(count, int)
    grows = np.ones(count, bool)
    tried: list = []
    for m in SPANS:
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
            limit = APART * excess + ROUND * np.abs(other)
            agrees &= ~(np.abs(wide - other) > limit)
        change = np.abs(wide - slope)
        ends = reached & ~agrees
        bias[ends] = change[ends]
        is_longer = agrees & (span > 0)
        shorter_change[is_longer] = np.maximum(change - spread, 0.0)[is_longer]
        still = ends & (spread > 0)
        bias[still] /= (m / span[still]) ** 2 - 1
        slope[agrees], spread[agrees], span[agrees] = wide[agrees], wide_spread[agrees], m
        grows = agrees
        tried.append((wide, wide_spread))
    at_end = np.isnan(bias)
    bias[at_end] = shorter_change[at_end]
    # Next to an end there is no other span; the second difference tells of the bend if nothing is noisy.
    only = np.isnan(bias)
    bend = np.abs(np.diff(values, 2)) / 2
    bias[only] = np.where(spread > 0, 0.0, bend)[only]
    return Slopes(slope, SURE * spread + bias + ROUND * np.abs(slope), span)


def _between_turns(found: DecayCurve) -> DecayCurve:
    """The curve with what it changes over delta^2/8 of its amplitude: half a half swing is cosh(delta/2) times the
    amplitude in its middle, delta the decrement of half a cycle."""
    delta = np.pi * found.damping / np.sqrt(np.maximum(1 - found.damping**2, ROUND))
    share = (
        delta**2
        / 8
        / np.maximum(np.abs(np.gradient(np.log(found.amplitude))), np.maximum(np.abs(delta), ROUND))
    )
    return found._replace(
        **{
            f"{name}_error": getattr(found, f"{name}_error")
            + share * np.abs(np.gradient(getattr(found, name)))
            for name in ("frequency", "damping")
        }
    )


def smooth_slopes(values, noise) -> np.ndarray:
    """Return the slopes (n,) per half swing of values (n,); at both ends that of the neighbour."""
    slope = fit_slopes(values, noise).slope
    return np.concatenate([slope[:1], slope, slope[-1:]])


def _at_least(noise, values) -> np.ndarray:
    """Standard deviations (n,), not below what third differences of values (n,) show, of which a parabola has none, and
    white noise 20 times its variance; of values without noise 0."""
    if not noise.any() or values.size < 4:
        return noise
    seen = np.diff(values, 3) ** 2 / 20
    low, high = (
        np.clip(np.arange(values.size) - 1 + side, 0, seen.size) for side in (-BESIDE, BESIDE)
    )
    whole = np.concatenate([[0.0], np.cumsum(seen)])
    return np.sqrt(np.maximum(noise**2, (whole[high] - whole[low]) / np.maximum(high - low, 1)))


def _parabola(m: int) -> np.ndarray:
    """Weights (2 m + 1,) of values by which the parabola through them, of least squares, has its middle."""
    x = np.arange(-m, m + 1)
    x2, n = x**2, x.size
    return (
        (np.sum(x2**2) - np.sum(x2) * x2) / (n * np.sum(x2**2) - np.sum(x2) ** 2)
        if m > 1
        else (x == 0) * 1.0
    )


def _by_cubics(x, own, values) -> np.ndarray:
    """Values (n,) at rising places own (n,) read at others x (k,), inside them, by cubics that rise and fall with the
    values (Fritsch and Butland 1984)."""
    from scipy.interpolate import PchipInterpolator

    x = np.clip(x, own[0], own[-1])
    return PchipInterpolator(own, values)(x) if own.size > 1 else np.interp(x, own, values)


def _cubic(place, speed, share):
    """Places (k,) at a share (k,) of the step by the cubics of both ends; speed over the step."""
    (a, b), (c, d), s = place, speed, share
    return a + s * (c + s * (3 * (b - a) - 2 * c - d + s * (2 * (a - b) + c + d)))


def _zero(place, speed) -> np.ndarray:
    """Share (k,) of the step where the cubics turn; their speeds at both ends have opposite signs."""
    (a, b), (c, d) = place, speed
    two, three = 2 * (3 * (b - a) - 2 * c - d), 3 * (2 * (a - b) + c + d)
    both = -(two + np.copysign(np.sqrt(np.maximum(two**2 - 4 * three * c, 0.0)), two)) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        near, far = c / both, both / three
    return np.clip(np.where(np.abs(near - 0.5) <= 0.5 + EDGE, near, far), 0.0, 1.0)
