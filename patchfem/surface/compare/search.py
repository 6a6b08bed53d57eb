"""Search for the shift of a second trace by correlation with the first one.

All valleys are correlated, or separate parts of the trace.

The largest correlation is compared with that of random traces of the same spectrum. Parts are correlated
one by one because a track, a scratch or a step disturbs only the parts that it crosses.
"""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ..profile import Profile, resample_evenly
from ..roughness.filter import mean_line
from .boxes import running_mean
from .robust import SEED

MAX_SAMPLES = 8192  # largest number of samples in the search; longer traces are averaged
# Smallest number of samples of a trace, or of a part of it, for a useful correlation.
MIN_SAMPLES = 16
MIN_OVERLAP = 0.5  # smallest fraction of the shorter trace that must overlap the other one
# Longest wave in the search as a fraction of the shorter trace; longer waves
# and the tilt are filtered out.
MAX_WAVE = 0.25
N_RANDOM = 100  # number of random traces, whose correlations are due to chance
# Smallest clearance above the correlations of random traces, in standard deviations; 1 of 1000
# unrelated pairs has a larger one.
MIN_CLEARANCE = 5.0
# Smallest difference of Fisher's z between the best and the second-best shift; 150
# related pairs had 0.64 or more.
MIN_LEAD = 0.3
# Largest correlation of the second-best shift; only periodic surfaces have a larger one.
MAX_SECOND = 0.97
N_PARTS = 12  # number of parts of the first trace that are correlated one by one
N_BEST_PARTS = 4  # number of parts with the largest correlations, which give the score of a shift
# Largest correlation that is credited to a part, because no single part proves a match.
MAX_CORRELATION = 0.999


class Chance(NamedTuple):
    """Mean and standard deviation of the largest Fisher's z of random traces."""

    mean: float
    scatter: float

    def clearance(self, z: float) -> float:
        """Return the distance of a Fisher's z from the mean, in standard deviations."""
        return float((z - self.mean) / max(self.scatter, 1e-12))


class Match(NamedTuple):
    """Shift at which two traces agree best.

    - shift: a place at x of the first trace is at x + shift [m] of the second one.
    - correlation, second: correlation at this shift, and the largest one at another shift.
    - chance: correlations of random traces.
    - clearance: distance of the correlation from their mean in their standard deviations.
    """

    shift: float
    correlation: float
    second: float
    chance: Chance
    clearance: float

    @property
    def is_ambiguous(self) -> bool:
        """Whether another shift fits nearly as well, as on a turned surface."""
        lead = fisher_z(self.correlation) - fisher_z(self.second)
        return self.second > MAX_SECOND or lead < MIN_LEAD

    @property
    def is_significant(self) -> bool:
        """Whether the correlation is too large to be due to chance."""
        return self.clearance > MIN_CLEARANCE


class Resampled(NamedTuple):
    """Two traces with a common constant sampling interval, from which the long waves are subtracted.

    first, second: (n,), (m,) heights [m]; step [m]; start: x of the first sample of the second trace
    less that of the first [m].
    """

    first: np.ndarray
    second: np.ndarray
    step: float
    start: float


def search_shift(before: Profile, after: Profile) -> Match:
    """Search for the shift at which the valleys of two traces correlate best.

    Long waves are filtered off, and heights above the median are clipped, as wear removes them. Random
    traces have the spectrum of the first trace and random phases.

    Raises
    ------
    PatchfemError
        If a trace has fewer than 16 samples.
    """
    first, second, step, start = resample_both(before, after)
    search = _ValleySearch(first.size, _cut_to_valleys(second))
    best = search.find_best(_cut_to_valleys(first))
    chance = _draw_chance(
        first, lambda z: fisher_z(search.find_best(_cut_to_valleys(z)).correlation)
    )
    clearance = chance.clearance(fisher_z(best.correlation))
    return Match(start + best.lag * step, best.correlation, best.second, chance, clearance)


def search_shift_in_parts(before: Profile, after: Profile) -> Match | None:
    """Search for the shift at which separate parts of two traces agree best.

    Each of 12 parts is laid on the second trace at every shift. The score of a shift is the mean of
    Fisher's z of the four parts that correlate best; its tanh is the correlation of the match.

    Returns
    -------
    Match or None
        None for traces of less than 192 samples.
    """
    first, second, step, start = resample_both(before, after)
    size = first.size // N_PARTS
    if size < MIN_SAMPLES or second.size < size:
        return None
    lags = _overlapping_lags(first.size, second.size)
    search = _PartSearch(second, size, lags)
    scores = search.scores(first)
    best = int(np.argmax(scores))
    others = scores[abs(lags - lags[best]) > decorrelation_lag(first)]
    chance = _draw_chance(first, lambda z: search.scores(z).max())
    return Match(
        shift=start + float(lags[best]) * step,
        correlation=float(np.tanh(scores[best])),
        second=float(np.tanh(others.max(initial=0.0))),
        chance=chance,
        clearance=chance.clearance(scores[best]),
    )


def resample_both(before: Profile, after: Profile) -> Resampled:
    """Resample two traces to a common constant sampling interval and subtract their long waves.

    Raises
    ------
    PatchfemError
        If a trace has fewer than 16 samples.
    """
    traces = (resample_evenly(before), resample_evenly(after))
    if min(trace.x.size for trace in traces) < MIN_SAMPLES:
        raise PatchfemError(
            f"{before.source}, {after.source}: at least {MIN_SAMPLES} samples are needed to compare two traces"
        )
    steps = [trace.step for trace in traces]
    step = max(max(trace.length for trace in traces) / MAX_SAMPLES, *steps)
    heights = [_resample(trace, step) for trace in traces]
    cutoff = MAX_WAVE * min(z.size for z in heights)
    first, second = (z - mean_line(z, cutoff, tilted=True) for z in heights)
    return Resampled(first, second, step, float(traces[1].x[0] - traces[0].x[0]))


def decorrelation_lag(z) -> int:
    """Return the lag, in samples, at which the autocorrelation of a trace first falls to zero."""
    zeros = np.flatnonzero(_autocorrelate(z - z.mean())[: z.size] <= 0)
    return int(zeros[0]) if zeros.size else z.size // 2


def find_period(before: Profile, after: Profile) -> float:
    """Find the lag [m] at which the first trace is most similar to itself."""
    first, _, step, _ = resample_both(before, after)
    correlation = _autocorrelate(first)[: first.size // 2]
    start = min(decorrelation_lag(first), correlation.size - 1)
    return float(start + np.argmax(correlation[start:])) * step


def fisher_z(correlation):
    """Return Fisher's z of a correlation, whose scatter does not depend on the correlation."""
    return np.arctanh(np.clip(correlation, -1 + 1e-12, 1 - 1e-12))


def _autocorrelate(z) -> np.ndarray:
    """Return the sums of products of the values at each lag."""
    return np.fft.irfft(np.abs(np.fft.rfft(z, 2 * z.size)) ** 2)


def _overlapping_lags(count: int, other: int) -> np.ndarray:
    """Return the lags at which traces of two lengths in samples overlap enough."""
    lags = np.arange(1 - count, other)
    common = np.minimum(count, other - lags) - np.maximum(0, -lags)
    return lags[common >= MIN_OVERLAP * min(count, other)]


def _resample(trace: Profile, step: float) -> np.ndarray:
    """Return the heights at a constant sampling interval; means if it is coarser than that of the trace."""
    count = int(trace.length / step * (1 + 1e-9)) + 1
    z = running_mean(trace.z, max(1, round(step / trace.step)))
    return np.interp(trace.x[0] + step * np.arange(count), trace.x, z)


def _cut_to_valleys(z) -> np.ndarray:
    """Clip heights above the median, and subtract the mean."""
    valleys = np.minimum(z - np.median(z), 0.0)
    return valleys - valleys.mean()


def _draw_chance(first, best_score) -> Chance:
    """Return mean and standard deviation of the best scores of random traces that have the spectrum of `first`."""
    random = np.random.default_rng(SEED)
    z = np.array([best_score(_randomize_phases(first, random)) for _ in range(N_RANDOM)])
    return Chance(float(z.mean()), float(z.std(ddof=1)))


def _randomize_phases(z, random) -> np.ndarray:
    """Return a random trace (n,) with the spectrum of a trace."""
    transform = np.fft.rfft(z - z.mean())
    phases = np.exp(2j * np.pi * random.uniform(size=transform.size))
    return np.fft.irfft(np.abs(transform) * phases, z.size)


class _BestLag(NamedTuple):
    """Lag and value of the largest correlation, and the largest correlation outside that peak."""

    lag: int
    correlation: float
    second: float


class _ValleySearch:
    """Correlations of a fixed trace with others at all lags with enough overlap, computed by FFT."""

    def __init__(self, count: int, fixed):
        from scipy.fft import next_fast_len, rfft

        self.fixed = fixed
        self.size = next_fast_len(count + fixed.size, real=True)
        self.transform = rfft(fixed, self.size)
        self.lags = _overlapping_lags(count, fixed.size)
        self.power = self._correlate(np.ones(count), rfft(fixed**2, self.size))

    def _correlate(self, moved, transform) -> np.ndarray:
        """Return the sum of moved[i] fixed[i + lag] over i for each lag."""
        from scipy.fft import irfft, rfft

        sums = irfft(transform * np.conj(rfft(moved, self.size)), self.size)
        return sums[self.lags % self.size]

    def find_best(self, moved) -> _BestLag:
        """Find the lag of the largest correlation of a trace."""
        from scipy.fft import rfft

        own_power = self._correlate(moved**2, rfft(np.ones(self.fixed.size), self.size))
        product = np.maximum(own_power, 0.0) * np.maximum(self.power, 0.0)
        is_large = product > 1e-20 * product.max(initial=0.0)
        correlation = np.zeros(self.lags.size)
        sums = self._correlate(moved, self.transform)
        np.divide(sums, np.sqrt(product), out=correlation, where=is_large)
        best = int(np.argmax(correlation))
        zeros = np.flatnonzero(correlation <= 0)
        below = zeros[zeros < best]
        above = zeros[zeros > best]
        second = -1.0
        if below.size:
            second = correlation[: below[-1]].max(initial=second)
        if above.size:
            second = correlation[above[0] :].max(initial=second)
        limited = [float(np.clip(value, -1.0, 1.0)) for value in (correlation[best], second)]
        return _BestLag(int(self.lags[best]), *limited)


class _PartSearch:
    """Scores of the parts of a trace against a fixed trace at the lags, computed by FFT."""

    def __init__(self, fixed, size: int, lags):
        from scipy.fft import next_fast_len, rfft

        self.size = size
        self.lags = lags
        self.length = next_fast_len(fixed.size + size, real=True)
        self.transform = rfft(fixed, self.length)
        sums = [np.concatenate([[0.0], np.cumsum(z)]) for z in (fixed, fixed**2)]
        mean, square = ((cumulated[size:] - cumulated[:-size]) / size for cumulated in sums)
        self.power = size * np.maximum(square - mean**2, 1e-12 * max(float(fixed.var()), 1e-300))

    def scores(self, moved) -> np.ndarray:
        """Return the score of a trace, cut into parts, at each lag."""
        from scipy.fft import irfft, rfft

        size = self.size
        count = self.power.size
        parts = moved[: N_PARTS * size].reshape(N_PARTS, size)
        parts = parts - parts.mean(axis=1, keepdims=True)
        own_power = np.maximum((parts**2).sum(axis=1), 1e-300)
        products = self.transform * np.conj(rfft(parts, self.length, axis=1))
        sums = irfft(products, self.length, axis=1)[:, :count]
        correlation = sums / np.sqrt(own_power[:, None] * self.power)
        places = self.lags + size * np.arange(N_PARTS)[:, None]
        is_inside = (places >= 0) & (places < count)
        values = np.take_along_axis(correlation, np.clip(places, 0, count - 1), axis=1)
        z = fisher_z(np.clip(np.where(is_inside, values, 0.0), 0.0, MAX_CORRELATION))
        best = N_PARTS - N_BEST_PARTS
        return np.partition(z, best, axis=0)[best:].mean(axis=0)
