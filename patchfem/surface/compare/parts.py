"""The same place found part by part: a track, a scratch or a step spoils the parts that it crosses, and no others."""

import numpy as np

from ..profile import Profile
from .place import CHANCE, SEED, Match, fisher, prepared, shuffled, within

PARTS, BEST = 12, 4  # of the first trace, and how many of them count: those that agree best
FEWEST = 16  # samples of a part
MOST = 0.999  # likeness of a part that counts: one part alone proves no place


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
    search = _Search(second, size, lags)
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


class _Search:
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
