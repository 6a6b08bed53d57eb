"""The largest worn depth without the noise that a largest value collects: parabolas as long as the depths allow."""

from functools import lru_cache

import numpy as np

from .registration import Registration

LONGEST = 1025  # samples of a window
PARTS = 8  # of a window, whose means the parabola must meet
ALIKE = 2.5  # deviations that a misfit of noise may have: 97 of 100 windows of noise alone fit
CAPPED, TAIL = 3.0, 8.0  # deviations that a height of a window counts with at most, and that none may have
FEW_TAILS = 2.0  # variance of a few heights, over that of normal noise
LONG = 64  # samples of a window that shows the slopes beside it by fewer
BLUNT = 8.0  # noises below the top within which a depth may be the largest
DOUBT = 3.0  # deviations that a depth loses in the choice of the largest: a sharper window must show it clearly
SHORT = 4.5  # the same for a few heights
DRAWS = 300


def largest(found: Registration, together: float) -> tuple:
    """(value, standard deviation) [m] of the largest worn depth w of a registration.

    Depths are w + noise, and the largest of n of them is too large by about noise * sqrt(2 log n); the noise is that of
    each height (`Registration.scatter`), larger on steep flanks, with tails. So each depth is read from the parabola
    through the longest window (5 to 1025 heights) around it that shows no misfit beyond the noise, neither in its mean
    square, in which a single height counts three deviations at most, nor in the means of its eight parts; where no
    window fits, it is the height itself. What is left of the excess is the mean one of `DRAWS` draws of the noise
    through the same windows, and is taken off. The deviation has that of the draws, that excess, which the draws see by
    half for a flat floor, what a corner hides (`_corner`), and what the registration leaves open. together: how many
    neighbouring heights err alike (`registration.together`).
    """
    rest, noise = np.asarray(found.rest), found.scatter
    start, size = _windows(rest, noise, together)
    smooth, deviation = np.empty(rest.size), np.empty(rest.size)
    for first, length, members, rows in _shared(start, size, np.arange(rest.size)):
        smooth[members] = rows @ (_base(length).T @ rest[first:first + length])
        pull = (rows @ _base(length).T) * noise[first:first + length]
        deviation[members] = np.sqrt((pull**2).sum(axis=1) * _alike(length, together))
    doubt = np.where(size < 2 * PARTS, SHORT, DOUBT) * deviation
    top = int(np.argmax(smooth - doubt))
    near = np.flatnonzero(smooth + BLUNT * deviation > smooth[top] - BLUNT * deviation[top])
    low, high = int(start[near].min()), int((start + size)[near].max())
    drawn = noise[low:high] * np.random.default_rng(0).standard_normal((DRAWS, high - low))
    peaks, ranks = np.empty(DRAWS), np.full(DRAWS, -np.inf)
    for first, length, members, rows in _shared(start, size, near):
        moved = np.sqrt(_alike(length, together)) * drawn[:, first - low:first - low + length] @ _base(length) @ rows.T
        rank = smooth[members] + moved - doubt[members]
        best = np.argmax(rank, axis=1)
        here = rank[np.arange(DRAWS), best]
        better = here > ranks
        peaks[better] = (here + doubt[members][best])[better]
        ranks[better] = here[better]
    excess = float(peaks.mean() - smooth[top])
    part = slice(int(start[top]), int(start[top] + size[top]))
    base = _base(int(size[top]))
    pull = base[top - part.start] @ (base.T @ found.gradient[part])
    hidden = _corner(rest, part, found.noise * np.sqrt(together))
    return float(smooth[top] - excess), float(np.sqrt(peaks.var() + excess**2 / 4 + hidden**2 + found.error(pull) ** 2))


def _corner(rest, part: slice, noise: float) -> float:
    """Depth [m] that a corner may reach above the parabola of a window, 0 where the depth is round.

    Least squares leave a corner between slopes of s on either side by 3/16 s h above a parabola of half width h. The
    slopes are those of lines through the samples beside the window, as many or, of a long window, which may reach over
    most of a scar, a quarter of them; those of a parabola are as steep as it goes on, those of a corner 1/4 to 2/5 of
    that. A long window must show the difference beyond noise [m], three deviations of it.
    """
    length = part.stop - part.start
    many = length if length < LONG else length // 4
    if length < 5 or part.start < many or part.stop + many > rest.size:
        return 0.0
    at, away = np.arange(many) - (many - 1) / 2, (length + many) / 2
    rise = [float(at @ rest[begin:begin + many]) / float(at @ at) for begin in (part.start - many, part.stop)]
    slope = (rise[0] - rise[1]) / 2
    own = -2 * float(np.polyfit(np.arange(length), rest[part], 2)[0]) * away
    doubt = 3 * 27 * noise / length**1.5 if length >= LONG else 0.0  # 27: of both slopes together, for white noise
    if slope <= 0 or own - slope <= doubt:
        return 0.0
    return 3 / 16 * slope * length / 2 * float(np.clip(1.5 * (1 - slope / own), 0, 1))


def _shared(start, size, heights):
    """The windows of these heights: (first sample, length, heights read from it, their rows of its parabolas)."""
    order = heights[np.lexsort((start[heights], size[heights]))]
    ends = np.flatnonzero(np.diff(start[order]) | np.diff(size[order])) + 1
    for members in np.split(order, ends):
        first, length = int(start[members[0]]), int(size[members[0]])
        yield first, length, members, _base(length)[members - first]


def _alike(length: int, together: float) -> float:
    """Variance of a parabola's height over that of independent normal noise: a few heights show the tails of noise."""
    return max(together, FEW_TAILS) if length < 2 * PARTS else together


@lru_cache(maxsize=16)
def _base(length: int) -> np.ndarray:
    """Orthonormal parabolas (length, 3) over a window; (1, 1) for one height."""
    return np.linalg.qr(np.vander(np.linspace(-1, 1, length), 3))[0] if length > 1 else np.ones((1, 1))


def _windows(rest, noise, together: float) -> tuple:
    """First sample and length of the longest window around each depth that a parabola fits; 1 where none does.

    Of windows of a length, the one whose middle is nearest is taken.
    """
    count, here = rest.size, np.arange(rest.size)
    start, size = here.copy(), np.ones(count, int)
    length = 5
    while length <= min(LONGEST, count):
        apart = max(length // PARTS, 1)
        first = np.arange(0, count - length + 1, apart)
        cut = (np.lib.stride_tricks.sliding_window_view(one, length)[first] for one in (rest, noise))
        good = first[_fits(*cut, together)]
        if not good.size:
            break
        after = np.searchsorted(good + length // 2, here).clip(1, max(good.size - 1, 1))
        pair = good[np.clip(np.stack([after - 1, after]), 0, good.size - 1)]
        away = np.abs(pair + length // 2 - here)
        nearest = np.where(away[0] <= away[1], pair[0], pair[1])
        inside = away.min(axis=0) <= length // 4  # a corner beside the window would lift its outer heights
        start[inside], size[inside] = nearest[inside], length
        length = 2 * length - 1
    half = (size + 1) // 2
    apart = np.maximum(half // PARTS, 1)
    return np.clip((here - half // 2) // apart * apart, start, start + size - half), half


def _fits(windows, noise, together: float) -> np.ndarray:
    """Whether a parabola leaves no more than noise (m, length) in each window (m, length)."""
    length = windows.shape[1]
    base = _base(length)
    left = windows - (windows @ base) @ base.T
    free = length - 3
    off = np.abs(left) / noise
    good = (np.minimum(off, CAPPED)**2).sum(axis=1) <= free + ALIKE * np.sqrt(2 * free * together)
    good &= off.max(axis=1) < TAIL
    if length >= 2 * PARTS:
        edges = np.linspace(0, length, PARTS + 1).astype(int)[:-1]
        means = np.add.reduceat(left, edges, axis=1)
        expected = np.sqrt(np.add.reduceat(noise**2, edges, axis=1) * together)
        good &= (np.abs(means) <= ALIKE * expected).all(axis=1)
    return good
