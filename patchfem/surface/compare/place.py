"""Whether two traces run over the same place: their valleys against those of traces made by chance, or part by part.

A track, a scratch or a step spoils the parts that it crosses, and no others.
"""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ..profile import Profile, even
from ..roughness.filter import mean_line

COARSE = 1 << 13  # samples of a trace in the search
OVERLAP = 0.5  # of the shorter trace, at least, lies on the other one
LONGEST = 0.25  # of the trace: longer waves, tilt among them, do not count in the search
CHANCE = 100  # made traces
CLEAR = 5.0  # standard deviations above the made traces: chance reaches it in about one of a thousand pairs
APART = 0.3  # of Fisher's z between the best and the second best shift; 150 made pairs had 0.64 at least
TWIN = 0.97  # correlation of the second best shift from which the surface is periodic
SEED = 1985
PARTS, BEST = 12, 4  # of the first trace, and how many of them count: those that agree best
FEWEST = 16  # samples of a part
MOST = 0.999  # likeness of a part that counts: one part alone proves no place


class Match(NamedTuple):
    """Where the valleys of two traces agree best.

    shift [m]: a place at x of the one stands at x + shift of the other; likeness: correlation there; second: the best
    correlation at another shift, beyond the next one without correlation; chance: mean and
    scatter of the best correlation of made traces, as Fisher's z; clear: how many scatters the likeness lies above it.
    """

    shift: float
    likeness: float
    second: float
    chance: tuple
    clear: float

    @property
    def repeats(self) -> bool:
        """Whether another shift fits nearly as well, as on a turned surface."""
        return self.second > TWIN or fisher(self.likeness) - fisher(self.second) < APART


def matched(before: Profile, after: Profile) -> Match:
    """Search the shift at which the valleys of both traces agree best, and how clearly it stands out.

    Waves longer than a quarter of the shorter trace are filtered off both and what lies above the median is cut off, as
    wear does. Every shift with half of the shorter trace in common is tried. The same search with `CHANCE` traces that
    have the spectrum of the first one and random phases tells what chance brings; a surface that repeats itself, such
    as a turned one, shows in the second best shift. PatchfemError for fewer than 16 samples.
    """
    first, second, step, start = prepared(before, after)
    search = _Search(first.size, _valleys(second))
    lag, likeness, second = search.best(_valleys(first))
    random = np.random.default_rng(SEED)
    found = np.array([search.best(_valleys(shuffled(first, random)))[1] for _ in range(CHANCE)])
    z = fisher(found)
    clear = (fisher(likeness) - z.mean()) / z.std(ddof=1)
    return Match(start + lag * step, likeness, second, (float(z.mean()), float(z.std(ddof=1))),
                 float(clear))


def prepared(before: Profile, after: Profile) -> tuple:
    """Heights (n,) [m] of both traces at one even step without their long waves, that step, and the shift of the first
    samples [m]. PatchfemError for fewer than 16 samples."""
    one, other = even(before), even(after)
    if min(one.x.size, other.x.size) < 16:
        raise PatchfemError(f"{one.source}, {other.source}: at least 16 samples are needed to compare two traces")
    step = max(max(one.length, other.length) / COARSE, *(each.length / (each.x.size - 1) for each in (one, other)))
    first, second = (_read(each, step) for each in (one, other))
    cutoff = LONGEST * min(first.size, second.size)
    first, second = (z - mean_line(z, cutoff, tilted=True) for z in (first, second))
    return first, second, step, float(other.x[0] - one.x[0])


def within(count: int, other: int) -> np.ndarray:
    """Lags at which two traces of so many samples have enough in common."""
    lags = np.arange(1 - count, other)
    common = np.minimum(count, other - lags) - np.maximum(0, -lags)
    return lags[common >= OVERLAP * min(count, other)]


def fisher(likeness):
    """Fisher's z of a correlation: its scatter does not depend on it."""
    return np.arctanh(np.clip(likeness, -1 + 1e-12, 1 - 1e-12))


def _read(trace: Profile, step: float) -> np.ndarray:
    """Heights at an even step, each the mean of the trace over it where it is coarser than the samples."""
    count = int(trace.length / step * (1 + 1e-9)) + 1
    own = trace.length / (trace.x.size - 1)
    many = max(1, round(step / own))
    z = np.convolve(np.pad(trace.z, (many // 2, many - 1 - many // 2), "edge"), np.full(many, 1 / many), "valid")
    return np.interp(trace.x[0] + step * np.arange(count), trace.x, z)


def _valleys(z) -> np.ndarray:
    low = np.minimum(z - np.median(z), 0.0)
    return low - low.mean()


def shuffled(z, random) -> np.ndarray:
    transform = np.fft.rfft(z - z.mean())
    return np.fft.irfft(np.abs(transform) * np.exp(2j * np.pi * random.uniform(size=transform.size)), z.size)


class _Search:
    """Correlation of one trace with others of a length at all lags with enough in common, by transforms."""

    def __init__(self, count: int, fixed):
        from scipy.fft import next_fast_len, rfft

        self.count, self.fixed = count, fixed
        self.size = next_fast_len(count + fixed.size, real=True)
        self.transform, self.squares = rfft(fixed, self.size), rfft(fixed**2, self.size)
        self.lags = within(count, fixed.size)
        self.power = self._through(np.ones(count), self.squares)

    def _through(self, moved, transform):
        """Sum of moved[i] fixed[i + lag] at the lags."""
        from scipy.fft import irfft, rfft

        whole = irfft(transform * np.conj(rfft(moved, self.size)), self.size)
        return whole[self.lags % self.size]

    def best(self, moved) -> tuple:
        """Lag of the largest correlation, that, and the largest one beyond the next lags without correlation."""
        from scipy.fft import rfft

        own = self._through(moved**2, rfft(np.ones(self.fixed.size), self.size))
        product = np.maximum(own, 0.0) * np.maximum(self.power, 0.0)
        worth = product > 1e-20 * product.max(initial=0.0)
        found = np.zeros(self.lags.size)
        np.divide(self._through(moved, self.transform), np.sqrt(product), out=found, where=worth)
        at = int(np.argmax(found))
        none = np.flatnonzero(found <= 0)
        low, high = none[none < at], none[none > at]
        beyond = np.concatenate([found[:low[-1]] if low.size else [], found[high[0]:] if high.size else []])
        return (int(self.lags[at]), float(np.clip(found[at], -1.0, 1.0)),
                float(np.clip(beyond.max(initial=-1.0), -1.0, 1.0)))


def matched_in_parts(before: Profile, after: Profile) -> Match | None:
    """Search the shift at which single parts of both traces agree best; None for traces of less than 192 samples.

    Traces are read as in `matched`, but nothing is cut off. The first is cut into 12 parts, each is laid on the second
    at every shift, both less their means there, and the mean of Fisher's z of the four likest parts is the score; its
    tanh stands for the likeness. Chance is told as in `matched`, by the same search with traces of the same spectrum.
    """
    first, second, step, start = prepared(before, after)
    size = first.size // PARTS
    if size < FEWEST or second.size < size:
        return None
    lags = within(first.size, second.size)
    search = _PartSearch(second, size, lags)
    score = search.scores(first)
    at, apart = int(np.argmax(score)), alone(first)
    beyond = score[abs(lags - lags[at]) > apart]
    random = np.random.default_rng(SEED)
    found = np.array([search.scores(shuffled(first, random)).max() for _ in range(CHANCE)])
    clear = (score[at] - found.mean()) / max(float(found.std(ddof=1)), 1e-12)
    return Match(start + float(lags[at]) * step, float(np.tanh(score[at])), float(np.tanh(beyond.max(initial=0.0))),
                 (float(found.mean()), float(found.std(ddof=1))), float(clear))


def alone(first) -> int:
    """Samples beyond which a trace is no longer like itself: to the first zero of its correlation."""
    power = np.abs(np.fft.rfft(first - first.mean(), 2 * first.size)) ** 2
    none = np.flatnonzero(np.fft.irfft(power)[:first.size] <= 0)
    return int(none[0]) if none.size else first.size // 2


class _PartSearch:
    """Scores of the parts of a trace on a fixed one at the lags, by transforms."""

    def __init__(self, fixed, size: int, lags):
        from scipy.fft import next_fast_len, rfft

        self.fixed, self.size, self.lags = fixed, size, lags
        self.length = next_fast_len(fixed.size + size, real=True)
        self.transform = rfft(fixed, self.length)
        sums = [np.concatenate([[0.0], np.cumsum(z)]) for z in (fixed, fixed**2)]
        mean, square = ((one[size:] - one[:-size]) / size for one in sums)
        self.power = size * np.maximum(square - mean**2, 1e-12 * max(float(fixed.var()), 1e-300))

    def scores(self, moved) -> np.ndarray:
        """Score at each lag of a trace cut into parts."""
        from scipy.fft import irfft, rfft

        size, many = self.size, self.power.size
        parts = moved[:PARTS * size].reshape(PARTS, size)
        parts = parts - parts.mean(axis=1, keepdims=True)
        own = np.maximum((parts**2).sum(axis=1), 1e-300)
        product = irfft(self.transform * np.conj(rfft(parts, self.length, axis=1)), self.length, axis=1)[:, :many]
        likeness = product / np.sqrt(own[:, None] * self.power)
        place = self.lags + size * np.arange(PARTS)[:, None]
        there = (place >= 0) & (place < many)
        z = np.where(there, np.take_along_axis(likeness, np.clip(place, 0, many - 1), axis=1), 0.0)
        z = fisher(np.clip(z, 0.0, MOST))
        return np.partition(z, PARTS - BEST, axis=0)[PARTS - BEST:].mean(axis=0)
