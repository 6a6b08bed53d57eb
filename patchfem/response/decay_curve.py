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

SPANS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)  # half swings m on both sides of a point
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
            return DecayCurve(*np.full((6, len(amplitudes)), np.nan))._replace(amplitude=np.asarray(amplitudes))
        own, first = np.unique(np.log(self.amplitude), return_index=True)
        x = np.log(amplitudes)
        found = self.at(first)
        inside = (x > own[0] - CLOSE) & (x < own[-1] + CLOSE)
        out = {name: np.interp(x, own, getattr(found, name)) for name in DecayCurve._fields}
        for name in ("frequency", "damping"):
            straight, out[name] = out[name], _by_cubics(x, own, getattr(found, name))
            out[f"{name}_error"] = out[f"{name}_error"] + np.abs(out[name] - straight)
        return DecayCurve(**{name: np.where(inside, part, np.nan) for name, part in out.items()})._replace(
            amplitude=np.asarray(amplitudes))

    def unsampled(self, other: "DecayCurve") -> "DecayCurve":
        """The curve with what its samples leave open in its errors, where coarser runs have as many: what the curve of
        `turns_from_outside` differs by, at most, at the points around."""
        beside, out = other.over(self.amplitude), {}
        for name in ("frequency", "damping"):
            change = np.nan_to_num(np.abs(getattr(self, name) - getattr(beside, name)))
            out[f"{name}_error"] = getattr(self, f"{name}_error") + (sliding_window_view(
                np.pad(change, NEAR), 2 * NEAR + 1).max(axis=1) if change.size else 0.0)
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
    apart = ROUND * float(np.ptp(time))  # a force that jumps at a turn has samples on both sides of it
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
    found, way, far = [], 0, float(place[-1])  # turns from the end on; the farthest place since the last of them
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
    between = (at >= time[k]) & (at <= time[k + 1])  # round-off may lay a turn at the sample before it
    times[np.searchsorted(times, time[k])[between]] = at[between]
    return times, places


def of_turns(times, places, size=None) -> HalfSwings:
    """Half swings between the turns (k,) [s], (k,) [m] of a computed motion, as far as each is smaller than the one
    before and no round-off of the first; size (k - 1,) [m]: theirs at another point than the places."""
    own = np.abs(np.diff(places))
    ends = np.flatnonzero((np.diff(own, prepend=np.inf) >= 0) | (own <= FAINT * own.max(initial=0.0)))
    count = int(ends[0]) if ends.size else own.size
    still = np.zeros(count)
    return HalfSwings((times[1:] + times[:-1])[:count] / 2, (own if size is None else size)[:count], still, still)


def curve_of(swings: HalfSwings) -> DecayCurve:
    """Frequency and damping over the amplitude, at points whose spans overlap by half, of a computed motion at every
    half swing; without a point where there are fewer than three half swings."""
    count, log = swings.size.size, np.log(swings.size)
    noise = _at_least(swings.size_noise / swings.size, log)
    wide = _at_least(swings.middle_noise, swings.middle)
    if not (noise.any() or wide.any()):
        return _of_computed(swings.middle, log) if count > 2 else DecayCurve(*np.empty((6, 0)))
    out, k = [], 1
    while k < count - 1:
        fall, fall_error, span = _slope(log, noise, k)
        half, half_error, other = _slope(swings.middle, wide, k)
        out.append(_point(swings.middle[k], _level(log, k, span), (half, half_error), (fall, fall_error)))
        k += max(1, min(span, other)) if wide.any() else 1
    found = DecayCurve(*(np.array(part) for part in zip(*out))) if out else DecayCurve(*np.empty((6, 0)))
    return _between_turns(found) if found.time.size > 1 else found


def _of_computed(middle, log) -> DecayCurve:
    """The curve at every inner half swing (k,) of a motion without noise, of all at once: a fraction of a second for
    25 000 half swings, where one after the other takes ten."""
    fall, fall_error, span = _slopes(log)
    half, half_error, _ = _slopes(middle)
    size = np.empty(span.size)
    for m in np.unique(span):
        at = np.flatnonzero(span == m)
        size[at] = sliding_window_view(log, 2 * m + 1)[at + 1 - m] @ _parabola(m)
    found = DecayCurve(*_point(middle[1:-1], size, (half, half_error), (fall, fall_error)))
    return _between_turns(found) if found.time.size > 1 else found


def _point(middle, size, half, fall) -> tuple:
    """A point of a DecayCurve, numbers or (k,): middle [s], size [1], logarithm of the half swing; half [s] and fall
    [1], slopes of middle and size, each with its error."""
    tilt = np.hypot(np.pi, fall[0])
    return (middle, np.exp(size) / 2, 0.5 / half[0], 0.5 * half[1] / half[0]**2, -fall[0] / tilt,
            fall[1] * np.pi**2 / tilt**3)


def _slopes(values) -> tuple:
    """(slopes, half-widths, spans) (n - 2,) of `_slope` at all inner places of values (n,) without noise."""
    count = values.size - 2
    slope, before, change, span = np.empty(count), np.empty(count), np.full(count, np.nan), np.ones(count, int)
    alive, tried = np.ones(count, bool), []
    for m in SPANS:
        if 2 * m >= values.size or not alive.any():
            break
        one, x = np.full(count, np.nan), np.arange(-m, m + 1)
        one[m - 1:count - m + 1] = np.correlate(values, x / (x @ x), "valid")
        reached = alive & ~np.isnan(one)
        close = reached & np.all([np.abs(one - other) <= ROUND * np.abs(other) for other in tried] or [reached], axis=0)
        change[reached & ~close] = np.abs(one - slope)[reached & ~close]
        ended = alive & ~reached & (span > 1)
        change[ended] = np.abs(slope - before)[ended]
        before[close], slope[close], span[close] = slope[close], one[close], m
        alive, tried = close, [*tried, one]
    ended = alive & (span > 1)
    change[ended] = np.abs(slope - before)[ended]
    ends = (span == 1) & np.isnan(change)
    change[ends] = np.abs(np.diff(values, 2))[ends] / 2
    return slope, change + ROUND * np.abs(slope), span


def _between_turns(found: DecayCurve) -> DecayCurve:
    """The curve with what it changes over delta^2/8 of its amplitude: half a half swing is cosh(delta/2) times the
    amplitude in its middle, delta the decrement of half a cycle."""
    delta = np.pi * found.damping / np.sqrt(np.maximum(1 - found.damping**2, ROUND))
    share = delta**2 / 8 / np.maximum(np.abs(np.gradient(np.log(found.amplitude))), np.maximum(np.abs(delta), ROUND))
    return found._replace(**{f"{name}_error": getattr(found, f"{name}_error") + share * np.abs(np.gradient(
        getattr(found, name))) for name in ("frequency", "damping")})


def smoothed(values, noise) -> np.ndarray:
    """Slopes (n,) per half swing of values (n,) with standard deviations (n,); at both ends that of the neighbour."""
    inner = [_slope(values, noise, k)[0] for k in range(1, values.size - 1)]
    return np.array([inner[0], *inner, inner[-1]])


def _slope(values, noise, k: int) -> tuple:
    """(slope per half swing, half-width of its interval, span m) at place k of values (n,) with standard deviations
    (n,)."""
    room, found = min(k, values.size - 1 - k), []
    for m in SPANS:
        if m > room:
            break
        part, x = slice(k - m, k + m + 1), np.arange(-m, m + 1)
        weight = x / (x @ x)
        slope, spread = float(weight @ values[part]), float(np.sqrt(weight**2 @ noise[part]**2))
        if any(abs(slope - one) > APART * np.sqrt(max(wide**2 - spread**2, 0.0)) + ROUND * abs(one)
               for one, wide, _ in found):
            break
        found.append((slope, spread, m))
    slope, spread, m = found[-1]
    return slope, SURE * spread + _bend(values, k, room, found) + ROUND * abs(slope), m


def _bend(values, k: int, room: int, found: list) -> float:
    """What the slope of the last span found may be off by as it is a mean: its change over the next longer span, of
    whose bias it has a share (m/m')^2, less what noise makes of it; at the ends, over the shorter one."""
    slope, spread, m = found[-1]
    wider = next((one for one in SPANS if m < one <= room), 0)
    if wider:
        x = np.arange(-wider, wider + 1)
        change = abs(float(x @ values[k - wider:k + wider + 1]) / float(x @ x) - slope)
        return change / ((wider / m)**2 - 1) if spread else change
    if len(found) > 1:
        return max(abs(slope - found[-2][0]) - found[-2][1], 0.0)
    low = values[max(k - 1, 0):k + 2]
    return abs(float(low[2] - 2 * low[1] + low[0])) / 2 if not spread else 0.0


def _at_least(noise, values) -> np.ndarray:
    """Standard deviations (n,), not below what third differences of values (n,) show, of which a parabola has none, and
    white noise 20 times its variance; of values without noise 0."""
    if not noise.any() or values.size < 4:
        return noise
    seen = np.diff(values, 3)**2 / 20
    low, high = (np.clip(np.arange(values.size) - 1 + side, 0, seen.size) for side in (-BESIDE, BESIDE))
    whole = np.concatenate([[0.0], np.cumsum(seen)])
    return np.sqrt(np.maximum(noise**2, (whole[high] - whole[low]) / np.maximum(high - low, 1)))


def _level(log, k: int, m: int) -> float:
    """The parabola over a span at its middle."""
    return float(_parabola(m) @ log[k - m:k + m + 1])


def _parabola(m: int) -> np.ndarray:
    """Weights (2 m + 1,) of values by which the parabola through them, of least squares, has its middle."""
    x = np.arange(-m, m + 1)
    x2, n = x**2, x.size
    return (np.sum(x2**2) - np.sum(x2) * x2) / (n * np.sum(x2**2) - np.sum(x2)**2) if m > 1 else (x == 0) * 1.0


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
