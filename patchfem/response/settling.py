"""Whether a motion has settled: by its amplitude from window to window, and by what free motion is left in all of them."""

import numpy as np

from ..core import Outcome

CLASSES = Outcome.TRANSIENT, Outcome.STEADY, Outcome.GROWS
STEADY, GROWS = 1, 2  # their places
LEAST = 3  # windows by which free motion is told
MOVES = 1e-3  # of the largest speed in a run, above which an interface slips
# sine of the angle between differences of phasors, below which they lie along one line
TURNS = 0.02
TELLS = 0.1  # share that the slowest mode must have lost over a third of the run for a beat that stays to be told


def classify(amplitudes, tolerance: float, floor: float = 0.0) -> Outcome:
    """Class of a motion by the amplitudes (w,) of successive windows, as `classes` has it of many motions."""
    return CLASSES[classes(np.asarray(amplitudes, float)[None], tolerance, floor)[0]]


def classes(a, tolerance: float, floor=0.0) -> np.ndarray:
    """Class of motions by the amplitudes (n, w) [m] of successive windows: (n,) numbers of CLASSES.

    floor [m], or (n,): a change that is none, a small share of what the drive itself moves.
    steady: the last change stays below the tolerance, and so does what a geometric tail would still add. Without a
    shrinking change the motion grows when it still rises; anything else is transient.
    """
    out = np.zeros(len(a), int)
    if a.shape[1] == 1:
        return out
    change, scale = np.abs(a[:, -1] - a[:, -2]), tolerance * np.abs(a[:, -1]) + floor
    if a.shape[1] == 2:
        out[change <= scale] = STEADY
        return out
    rest = np.abs(tails(a[:, -3:]))
    ends, rises = np.isfinite(rest), _rises(a)
    endless = rises & (change > 0.05 * scale)  # 0.05: slower is steady
    out[rises & ~ends] = GROWS
    out[(change <= scale) & np.where(ends, rest <= scale, ~endless)] = STEADY
    return out


def tail(three) -> complex | None:
    """Rest of a geometric series through three equally spaced values, as `tails` has it; None where it has none."""
    rest = tails(np.asarray(three) + 0.0)
    return None if np.isnan(rest) else rest


def tails(three):
    """Rest of geometric series through three equally spaced values (..., 3): what they still add to the last (Aitken).

    NaN where the changes do not shrink. Complex values carry a beat: its ratio is complex.
    """
    before, change = three[..., 1] - three[..., 0], three[..., 2] - three[..., 1]
    ratio = np.divide(change, before, out=np.zeros_like(change), where=before != 0)
    shrinks = np.abs(ratio) < 0.9995
    return np.where(shrinks, change * ratio / np.where(shrinks, 1 - ratio, 1.0), np.nan)[()]


def steady_amplitude(amplitudes, phasors) -> tuple:
    """Steady amplitude of one motion by extrapolation, and its error, as `steady_amplitudes` has them of many.

    (None, None) where no bounded tail can be seen.
    """
    return _one(
        steady_amplitudes(np.asarray(amplitudes, float)[None], np.asarray(phasors, complex)[None])
    )


def steady_amplitudes(a, p) -> tuple:
    """Steady amplitudes by extrapolation, and their errors, (n,) [m] each; NaN where no bounded tail can be seen.

    amplitudes, phasors: (n, w) of the last cycle of successive windows; the phasor is the drive-frequency part of the
    motion. What is left of the free motion of a linear rig turns and shrinks by one complex factor per window, so the
    phasors are extrapolated (Aitken). Friction resists a change of the amplitude otherwise than one of the phase, so
    that what is left moves by a map of the plane (`plane_tails`): its end is taken where it is known, and how far the
    two lie apart is part of the error. The waveform, amplitude over |phasor|, settles with the size of the factor. The
    error is besides the spread of the last estimates, six times of Aitken's and twice of the plane's, plus twice what
    the waveform still changes; where it is as large as what was added there is no estimate.
    """
    count, w = a.shape
    if w < 5:
        return np.full(count, np.nan), np.full(count, np.nan)
    size = np.abs(p)
    moves = np.all(size[:, -5:] > 0, axis=1)
    shape = a[:, -2:] / np.where(size[:, -2:] > 0, size[:, -2:], 1.0)
    ends = np.stack(
        [np.abs(p[:, w - 1 - k] + tails(p[:, w - 3 - k : w - k])) for k in range(3)], axis=1
    )
    before, change = np.abs(p[:, -2] - p[:, -3]), np.abs(p[:, -1] - p[:, -2])
    shrink = np.minimum(np.divide(change, before, out=1.0 * (change > 0), where=before > 0), 0.9995)
    settle = (shape[:, -1] - shape[:, -2]) * shrink / (1 - shrink)
    plane = np.stack(
        [np.abs(p[:, w - 1 - k] + plane_tails(p[:, w - 4 - k : w - k])) for k in range(2)], axis=1
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


def plane_tails(p) -> np.ndarray:
    """What points of the complex plane (n, 4) still add to the last if one linear map of the plane takes each of their
    differences to the next, (n,); NaN where the differences all lie along one line or the map does not shrink them.

    d3 = t d2 - q d1 by Cayley and Hamilton, with the trace t and the determinant q of the map; the sum of all that
    follow is ((t - q) d3 - q d2)/(1 - t + q).
    """
    d1, d2, d3 = np.diff(np.asarray(p, complex), axis=1).T
    area = (d1.conj() * d2).imag
    known = np.abs(area) > TURNS * np.abs(d1) * np.abs(d2)
    area = np.where(known, area, 1.0)
    t, q = (d1.conj() * d3).imag / area, (d2.conj() * d3).imag / area
    # both its multipliers are within the unit circle
    known &= (np.abs(q) < 1) & (np.abs(t) < 1 + q)
    return np.where(known, ((t - q) * d3 - q * d2) / np.where(known, 1 - t + q, 1.0), np.nan)


def _one(found: tuple) -> tuple:
    """Value and error (1,) of one motion as floats; None where they are NaN."""
    return tuple(None if np.isnan(one[0]) else float(one[0]) for one in found)


def windows_of(extremes, window: int) -> tuple:
    """Half peak-to-peak over windows of `window` cycles, and the mean of that of their cycles, (..., w) [m] each.

    extremes: (..., c, 2) [m] of the output per cycle; a partial window at the head is left out.
    """
    given = np.asarray(extremes, float)
    count = given.shape[-2] // window
    cut = given[..., given.shape[-2] - count * window :, :].reshape(
        *given.shape[:-2], count, window, 2
    )
    low, high = cut[..., 0], cut[..., 1]
    return (high.max(axis=-1) - low.min(axis=-1)) / 2, (high.mean(axis=-1) - low.mean(axis=-1)) / 2


def left_over(extremes, window: int, decay=0.0):
    """How much of the amplitude of the last window [m] is free motion that will still go, by all windows of the run.

    A free motion beside the drive beats. Where the beat is short, cycles of one window differ: what the window's
    amplitude is above the mean of its cycles goes with the beat, unless it stays while even the slowest mode decays
    (a motion that repeats after several cycles). Where the beat is long, windows differ: their distance from the last
    one in the last third of the run, less what the third before shows that a third takes off, but no more than the
    slowest mode surely loses in it: a ring-up ends fast and leaves what goes slowly. extremes: (..., c, 2) [m] per
    cycle; decay (...): of the slowest mode over a window [1].
    """
    amplitude, mean = windows_of(extremes, window)
    count = amplitude.shape[-1]
    if count < LEAST:
        return np.zeros(amplitude.shape[:-1])[()]
    third = max(1, count // 3)
    spread = amplitude - mean
    before, last = spread[..., -2 * third : -third].max(axis=-1), spread[..., -third:].max(axis=-1)
    lost = 1 - np.exp(-np.asarray(decay) * third)
    stays = (lost > TELLS) & (last > (1 - lost / 2) * before)
    away = np.abs(amplitude[..., :-1] - amplitude[..., -1:])
    far, near = (
        away[..., -2 * third : -third].max(axis=-1, initial=0.0),
        away[..., -third:].max(axis=-1),
    )
    share = np.minimum(1.0, np.divide(near, far, out=np.ones_like(near), where=far > 0))
    share = np.maximum(share, 1 - lost)
    return (near * share + np.where(stays, 0.0, spread[..., -1]))[()]


def mean_amplitudes(extremes, window: int) -> tuple:
    """Steady amplitudes [m] about which a short beat swings, and their errors, (n,) each; NaN where there is none.

    The mean of the cycles of the last third of the windows. The error is how far its windows lie from it, twice what
    its halves differ by, and the square of the beat over the amplitude. extremes: (n, c, 2) [m].
    """
    amplitude, mean = windows_of(extremes, window)
    third = amplitude.shape[1] // 3
    if third < 2:
        return np.full(len(mean), np.nan), np.full(len(mean), np.nan)
    ends, value = mean[:, -third:], mean[:, -third:].mean(axis=1)
    beat = (amplitude - mean)[:, -third:].max(axis=1)
    halves = np.abs(ends[:, : third // 2].mean(axis=1) - ends[:, third // 2 :].mean(axis=1))
    error = (
        np.abs(ends - value[:, None]).max(axis=1) + 2 * halves + beat**2 / np.maximum(value, 1e-300)
    )
    known = (error < np.abs(amplitude[:, -1] - value)) & (value > 0)
    return np.where(known, value, np.nan), np.where(known, error, np.nan)


def slip_period(time, rate) -> float:
    """Longest time [s] from the start of one slip to that of the next, of the last three of a run; 0 where there are
    fewer than two slips, or where the last one is further back than half as much again: it came to hold.

    time (k,) [s]; rate (k,) [m/s] of the slide; it slips where that is above MOVES of the largest. A motion that never
    holds has two slips a cycle, from one turn to the next.
    """
    rate = np.asarray(rate, float)
    way = np.sign(rate) * (np.abs(rate) > MOVES * np.abs(rate).max(initial=0.0))
    time = np.asarray(time, float)
    begins = np.flatnonzero((way[1:] != 0) & (way[1:] != way[:-1]))
    # what holds starts at its last sample without a slip
    starts = time[begins + (way[begins] != 0)]
    longest = float(np.diff(starts[-4:]).max(initial=0.0))
    return longest if starts.size and time[-1] - starts[-1] <= 1.5 * longest else 0.0


def _rises(a) -> np.ndarray:
    """Whether the last windows (n, w) rise one after the other by like steps, as noise does not, (n,)."""
    steps = np.diff(a[:, -6:], axis=1)
    if a.shape[1] < 4:
        return np.zeros(len(a), bool)
    rise = np.all(steps > 0, axis=1)
    ratios = steps[:, 1:] / np.where(steps[:, :-1] > 0, steps[:, :-1], 1.0)
    return rise & np.all((ratios > 0.5) & (ratios < 3), axis=1)
