"""Whether a motion has settled: by its amplitude from window to window, and by what free motion is left in all of them.
"""

import numpy as np

from ..core import Outcome

LEAST = 3  # windows by which free motion is told
TELLS = 0.1  # share that the slowest mode must have lost over a third of the run for a beat that stays to be told


def classify(amplitudes, tolerance: float, floor: float = 0.0) -> Outcome:
    """Class of a motion by the amplitudes of successive windows: steady, transient or grows.

    floor [m]: a change that is none, a small share of what the drive itself moves.
    steady: the last change stays below the tolerance, and so does what a geometric tail would still add. Without a
    shrinking change the motion grows when it still rises; anything else is transient.
    """
    a = np.asarray(amplitudes, float)
    if a.size == 1:
        return Outcome.TRANSIENT
    change, scale = a[-1] - a[-2], tolerance * abs(a[-1]) + floor
    if a.size == 2:
        return Outcome.STEADY if abs(change) <= scale else Outcome.TRANSIENT
    rest = tail(a[-3:])
    rest = np.inf if rest is None else abs(rest)
    endless = not np.isfinite(rest) and _rises(a) and abs(change) > 0.05 * scale  # 0.05: slower is steady
    if abs(change) <= scale and (rest <= scale or not (np.isfinite(rest) or endless)):
        return Outcome.STEADY
    return Outcome.GROWS if _rises(a) and not np.isfinite(rest) else Outcome.TRANSIENT


def tail(three) -> complex | None:
    """Rest of a geometric series through three equally spaced values: what it still adds to the last one (Aitken).

    None where the changes do not shrink. Complex values carry a beat: its ratio is complex.
    """
    before, change = three[1] - three[0], three[2] - three[1]
    ratio = change / before if before != 0 else 0.0
    return change * ratio / (1 - ratio) if abs(ratio) < 0.9995 else None


def steady_amplitude(amplitudes, phasors) -> tuple:
    """Steady amplitude by extrapolation, and its error; (None, None) where no bounded tail can be seen.

    amplitudes, phasors: (w,) of the last cycle of successive windows; the phasor is the drive-frequency part of the
    motion. What is left of a decaying free motion turns and shrinks by one complex factor per window, so the phasors
    are extrapolated (Aitken). The waveform, amplitude over |phasor|, settles with the size of that factor. The error is
    six times the spread of the last estimates plus twice what the waveform still changes; where it is as large as what
    was added there is no estimate.
    """
    a, p = np.asarray(amplitudes, float), np.asarray(phasors, complex)
    if a.size < 5 or not np.all(np.abs(p[-5:]) > 0):
        return None, None
    shape = a[-2:] / np.abs(p[-2:])
    ends = []
    for k in range(3):
        rest = tail(p[p.size - 3 - k:p.size - k])
        if rest is None:
            return None, None
        ends.append(abs(p[p.size - 1 - k] + rest))
    before, change = abs(p[-2] - p[-3]), abs(p[-1] - p[-2])
    shrink = min(change / before, 0.9995) if before > 0 else 0.9995 * (change > 0)
    settle = (shape[-1] - shape[-2]) * shrink / (1 - shrink)
    value = ends[0] * (shape[-1] + settle)
    error = 6 * (max(ends) - min(ends)) * shape[-1] + 2 * abs(settle) * ends[0] + 1e-9 * value
    added = abs(value - a[-1])
    return (float(value), float(error)) if error < max(added, 1e-6 * value) and value < 20 * a[-1] else (None, None)


def windows_of(extremes, window: int) -> tuple:
    """Half peak-to-peak over windows of `window` cycles, and the mean of that of their cycles, (w,) [m] each.

    extremes: (c, 2) [m] of the output per cycle; a partial window at the head is left out.
    """
    count = len(extremes) // window
    cut = np.asarray(extremes, float)[len(extremes) - count * window:].reshape(count, window, 2)
    low, high = cut[:, :, 0], cut[:, :, 1]
    return (high.max(axis=1) - low.min(axis=1)) / 2, (high.mean(axis=1) - low.mean(axis=1)) / 2


def left_over(extremes, window: int, decay: float = 0.0) -> float:
    """How much of the amplitude of the last window [m] is free motion that will still go, by all windows of the run.

    A free motion beside the drive beats. Where the beat is short, cycles of one window differ: what the window's
    amplitude is above the mean of its cycles goes with the beat, unless it stays while even the slowest mode decays
    (a motion that repeats after several cycles). Where the beat is long, windows differ: their distance from the last
    one in the last third of the run, less what the third before shows that a third takes off. extremes: (c, 2) [m] per
    cycle; decay: of the slowest mode over a window [1].
    """
    amplitude, mean = windows_of(extremes, window)
    if amplitude.size < LEAST:
        return 0.0
    third = max(1, amplitude.size // 3)
    spread = amplitude - mean
    before, last = spread[-2 * third:-third].max(), spread[-third:].max()
    lost = 1 - np.exp(-decay * third)
    stays = lost > TELLS and last > (1 - lost / 2) * before
    away = np.abs(amplitude[:-1] - amplitude[-1])
    far, near = away[-2 * third:-third].max(initial=0.0), away[-third:].max()
    slow = near * min(1.0, near / far) if far > 0 else near
    return float(slow + (0.0 if stays else spread[-1]))


def mean_amplitude(extremes, window: int) -> tuple:
    """Steady amplitude [m] about which a short beat swings, and its error; (None, None) where there is no such beat.

    The mean of the cycles of the last third of the windows. The error is how far its windows lie from it, twice what
    its halves differ by, and the square of the beat over the amplitude.
    """
    amplitude, mean = windows_of(extremes, window)
    third = amplitude.size // 3
    if third < 2:
        return None, None
    ends, value = mean[-third:], float(mean[-third:].mean())
    beat = float((amplitude - mean)[-third:].max())
    error = float(np.abs(ends - value).max() + 2 * abs(ends[:third // 2].mean() - ends[third // 2:].mean())
                  + beat**2 / max(value, 1e-300))
    return (value, error) if error < abs(amplitude[-1] - value) and value > 0 else (None, None)


def _rises(a) -> bool:
    """Whether the last windows rise one after the other by like steps, as noise does not."""
    steps = np.diff(a[-6:])
    if a.size < 4 or steps.min() <= 0:
        return False
    ratios = steps[1:] / steps[:-1]
    return bool(np.all(ratios > 0.5) and np.all(ratios < 3))
