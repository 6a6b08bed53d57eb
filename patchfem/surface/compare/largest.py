"""Largest worn depth without the noise that a largest value collects: parabolas as long as the depths allow."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..quantity import Quantity, around
from .section import Section

MAX_WINDOW = 1025  # samples of the longest window
N_PARTS = 8  # parts of a window, whose means the parabola must meet
MISFIT = 2.5  # standard deviations of a misfit that noise may have: 97 of 100 windows of noise alone fit
MAX_COUNTED = 3.0  # standard deviations that a height of a window counts with at most
MAX_SINGLE = 8.0  # standard deviations that no height of a window may have
BLUNT = 8.0  # standard deviations below the top within which a depth may be the largest
DOUBT = 3.0  # standard deviations that a depth loses in the choice of the largest
DOUBT_OF_FEW = 4.5  # the same for windows of a few heights
FEW_TAILS = 2.0  # variance of a few heights over that of normal noise
LONG = 64  # samples of a window that shows the slopes beside it by fewer
MIN_DEEP = 4.5  # standard deviations that the deepest place of a worn trace has


class _Windows(NamedTuple):
    """First sample and length (n,) of the window around each depth."""

    start: np.ndarray
    size: np.ndarray


def measure_largest(section: Section, text: str) -> Quantity:
    """Measure the largest worn depth.

    Depths are w + noise, and the largest of n of them is too large by about noise sqrt(2 log n). So
    each depth is read from the parabola through the longest window (5 to 1025 heights) around it that
    shows no misfit beyond the noise; where no window fits, it is the height itself. The excess that is
    left is that of the drawn errors in the same windows about depths whose scatter is that of the
    surface alone, and is taken off. The variance is that of the draws, of half of the excess, and of
    what a corner hides.
    """
    depth, noise = section.depth, section.noise
    if float((depth / noise).max()) <= MIN_DEEP:
        high = max(float(depth.max()), 0.0) + float(np.median(noise))
        return Quantity(0.0, 0.0, high, "m", text)
    windows = _fit_windows(depth, noise, section.correlation)
    smooth, deviation = np.empty(depth.size), np.empty(depth.size)
    for first, length, members, rows in _shared(windows, np.arange(depth.size)):
        smooth[members] = rows @ (_base(length).T @ depth[first : first + length])
        pull = (rows @ _base(length).T) * noise[first : first + length]
        deviation[members] = np.sqrt((pull**2).sum(axis=1) * _alike(length, section.correlation))
    doubt = np.where(windows.size < 2 * N_PARTS, DOUBT_OF_FEW, DOUBT) * deviation
    top = int(np.argmax(smooth - doubt))
    near = np.flatnonzero(smooth + BLUNT * deviation > smooth[top] - BLUNT * deviation[top])
    clean = _shrink(smooth, deviation, near)
    peaks = np.empty(len(section.draws))
    ranks = np.full(len(section.draws), -np.inf)
    for first, length, members, rows in _shared(windows, near):
        few = np.sqrt(FEW_TAILS) if length < 2 * N_PARTS else 1.0
        moved = few * section.draws[:, first : first + length] @ _base(length) @ rows.T
        rank = clean[members] + moved - doubt[members]
        best = np.argmax(rank, axis=1)
        here = rank[np.arange(len(rank)), best]
        better = here > ranks
        peaks[better] = (here + doubt[members][best])[better]
        ranks[better] = here[better]
    deepest = near[np.argmax(clean[near] - doubt[near])]
    excess = float(peaks.mean() - clean[deepest])
    part = slice(int(windows.start[top]), int(windows.start[top] + windows.size[top]))
    hidden = _hidden_by_corner(depth, part, float(np.median(noise)) * np.sqrt(section.correlation))
    error = float(np.sqrt(peaks.var() + excess**2 / 4 + hidden**2))
    return around(float(smooth[top] - excess), error, "m", text, 0.0)


def _shrink(smooth, deviation, near) -> np.ndarray:
    """Return the smooth depths (n,) with the scatter about their mean that the surface has without noise.

    Depths of a flat floor differ by noise alone and become equal, so that draws about them show the
    whole excess of a maximum; those of a round scar stay as they are.
    """
    variance = deviation**2
    seen = float(smooth[near].var())
    surface = max(seen - float(variance[near].mean()), 0.0)
    weight = 1 / (surface + variance[near])
    mean = float(weight @ smooth[near] / weight.sum())
    return mean + np.sqrt(surface / (surface + variance)) * (smooth - mean)


def _hidden_by_corner(depth, part: slice, noise: float) -> float:
    """Depth [m] that a corner may reach above the parabola of a window, 0 where the depth is round.

    Least squares leave a corner between slopes of s on either side by 3/16 s h above a parabola of half width h. The
    slopes are those of lines through the samples beside the window, as many or, of a long window, which may reach over
    most of a scar, a quarter of them; those of a parabola are as steep as it goes on, those of a corner 1/4 to 2/5 of
    that. A long window must show the difference beyond noise [m], three deviations of it.
    """
    length = part.stop - part.start
    many = length if length < LONG else length // 4
    if length < 5 or part.start < many or part.stop + many > depth.size:
        return 0.0
    at, away = np.arange(many) - (many - 1) / 2, (length + many) / 2
    rise = [float(at @ depth[begin : begin + many]) / float(at @ at) for begin in (part.start - many, part.stop)]
    slope = (rise[0] - rise[1]) / 2
    own = -2 * float(np.polyfit(np.arange(length), depth[part], 2)[0]) * away
    doubt = 3 * 27 * noise / length**1.5 if length >= LONG else 0.0  # 27: of both slopes correlation, for white noise
    if slope <= 0 or own - slope <= doubt:
        return 0.0
    return 3 / 16 * slope * length / 2 * float(np.clip(1.5 * (1 - slope / own), 0, 1))


def _shared(windows: _Windows, heights):
    """The windows of these heights: (first sample, length, heights read from it, their rows of its parabolas)."""
    start, size = windows
    order = heights[np.lexsort((start[heights], size[heights]))]
    ends = np.flatnonzero(np.diff(start[order]) | np.diff(size[order])) + 1
    for members in np.split(order, ends):
        first, length = int(start[members[0]]), int(size[members[0]])
        yield first, length, members, _base(length)[members - first]


def _alike(length: int, correlation: float) -> float:
    """Variance of a parabola's height over that of independent normal noise: a few heights show the tails of noise."""
    return max(correlation, FEW_TAILS) if length < 2 * N_PARTS else correlation


@lru_cache(maxsize=16)
def _base(length: int) -> np.ndarray:
    """Orthonormal parabolas (length, 3) over a window; (1, 1) for one height."""
    return np.linalg.qr(np.vander(np.linspace(-1, 1, length), 3))[0] if length > 1 else np.ones((1, 1))


def _fit_windows(depth, noise, correlation: float) -> _Windows:
    """First sample and length of the longest window around each depth that a parabola fits; 1 where none does.

    Of windows of a length, the one whose middle is neadepth is taken.
    """
    count, here = depth.size, np.arange(depth.size)
    start, size = here.copy(), np.ones(count, int)
    length = 5
    while length <= min(MAX_WINDOW, count):
        apart = max(length // N_PARTS, 1)
        first = np.arange(0, count - length + 1, apart)
        cut = (np.lib.stride_tricks.sliding_window_view(one, length)[first] for one in (depth, noise))
        good = first[_fits(*cut, correlation)]
        if not good.size:
            break
        after = np.searchsorted(good + length // 2, here).clip(1, max(good.size - 1, 1))
        pair = good[np.clip(np.stack([after - 1, after]), 0, good.size - 1)]
        away = np.abs(pair + length // 2 - here)
        neadepth = np.where(away[0] <= away[1], pair[0], pair[1])
        inside = away.min(axis=0) <= length // 4  # a corner beside the window would lift its outer heights
        start[inside], size[inside] = neadepth[inside], length
        length = 2 * length - 1
    half = (size + 1) // 2
    apart = np.maximum(half // N_PARTS, 1)
    return _Windows(np.clip((here - half // 2) // apart * apart, start, start + size - half), half)


def _fits(windows, noise, correlation: float) -> np.ndarray:
    """Whether a parabola leaves no more than noise (m, length) in each window (m, length)."""
    length = windows.shape[1]
    base = _base(length)
    left = windows - (windows @ base) @ base.T
    free = length - 3
    off = np.abs(left) / noise
    good = (np.minimum(off, MAX_COUNTED) ** 2).sum(axis=1) <= free + MISFIT * np.sqrt(2 * free * correlation)
    good &= off.max(axis=1) < MAX_SINGLE
    if length >= 2 * N_PARTS:
        edges = np.linspace(0, length, N_PARTS + 1).astype(int)[:-1]
        means = np.add.reduceat(left, edges, axis=1)
        expected = np.sqrt(np.add.reduceat(noise**2, edges, axis=1) * correlation)
        good &= (np.abs(means) <= MISFIT * expected).all(axis=1)
    return good
