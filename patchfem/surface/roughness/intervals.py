"""Interval of a parameter that one trace of its length allows: 5 to 95 %, from the spectrum of the trace itself.

The interval holds the mean that the parameter has over all traces of this length on a surface with Gaussian heights
and the spectrum of this trace, in 90 of 100 traces. Two ways lead to it:

- A mean square (Rq, Rdq, the height of a band) is chi-square distributed about its mean. Its degrees of freedom are
  those of the spectrum, 2 L (int S)^2 / int S^2, over the length L.
- For the others, `COUNT` traces are made with the spectrum and with random phases and heights. The parameter of the
  trace stands to its mean like those of the made traces to theirs: as a ratio, or as a difference.

Heights (slopes, for Rdq) with a kurtosis above 3 scatter more. Their intervals are wider by sqrt((kurtosis - 1) / 2),
which is exact for the mean square of independent heights. What a trace cannot tell is not in the interval: a surface
that differs from place to place, waves longer than the trace.

All but those of the dominant wavelength and of a band count on Gaussian heights. On lognormal heights 3 of 10 intervals
of the kurtosis held the mean, on Gaussian heights cut at half a deviation 2 of 10 of the core. A trace whose skewness
or kurtosis tells such heights has no such interval. On a self-affine surface without a longest wave 62 to 73 of 100
intervals of heights held the mean; a trace hardly longer than its strongest waves has none of those either
(tests/support/roughness_coverage.py).
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from .parameters import Heights, moment
from .rows import Parameter
from .spectrum import BAND, Spectrum, spectrum_of

LOW, HIGH = 0.05, 0.95
COUNT = 200  # made traces
SAMPLES = 2048  # of a made trace, at most
FINE, SHORT = 6, 0.01  # a made trace has 6 samples on the waves above this share of the mean square
FLOOR = 1.0  # degrees of freedom, at least
SPENT = 2.5  # degrees of freedom for a spectrum that is estimated too: without it the intervals hold 87 of 100
ODD = 1.96  # standard deviations of Gaussian traces beyond which a skewness or a kurtosis is not theirs
LATERAL = ("wave", "band")  # kinds whose intervals hold whatever the heights
SIZES = ("power", "ratio", "extreme")  # kinds whose values grow with the trace where its waves are as long as it
WAVES, FEW = 4, 12.0  # self-affine traces have 2.7 to 3.5 waves and 6 to 11 degrees of freedom, all others above 16
PEAK = 1.3  # the peak of a spectrum scatters more than in traces made with this very peak (test_intervals)


class Intervals:
    """Intervals of the parameters of one trace; its spectrum and the made traces are worked out when first wanted."""

    def __init__(self, heights: Heights, degree: int | None, found: Spectrum | None = None, band: tuple = BAND):
        """degree: of the polynomial that made traces are rid of, as the trace was, None: of none, as the roughness
        profile; band: wavelengths [m]."""
        self.heights, self.degree, self.band = heights, degree, band
        self.spectrum = spectrum_of(heights.z, heights.step) if found is None else found
        self._made = None

    @cached_property
    def _wider(self) -> tuple:
        """Factors of the intervals of heights and of slopes for what scatters more than Gaussian ones."""
        found = [moment(one, 4) for one in (self.heights, Heights(np.diff(self.heights.z), self.heights.step))]
        return tuple(1.0 if high is None else float(np.sqrt(max(1.0, (high - 1) / 2))) for high in found)

    def of(self, row: Parameter, value: float | None) -> tuple:
        """Interval (low, high) of the value of a row, (None, None) where there is none."""
        if value is None or not row.kind or not self.spectrum.density.any() or (
                self.uneven and row.kind not in LATERAL) or (self.long and row.kind in SIZES):
            return None, None
        if row.kind in ("power", "slope", "band"):
            return self._by_freedom(row.kind, value)
        return self._by_traces(row, value)

    @cached_property
    def uneven(self) -> bool:
        """Whether the heights are not Gaussian: their skewness lies ODD standard deviations of Gaussian traces from 0,
        or their kurtosis as many above 3.

        Those deviations are sqrt(6 int |rho|^3 / L) and sqrt(24 int rho^4 / L), with the autocorrelation rho of the
        spectrum.
        """
        from scipy.fft import irfft

        rho = np.abs(irfft(np.concatenate([[0.0], self.spectrum.density])))
        rho /= rho[0]
        skewness, kurtosis = (moment(self.heights, order) for order in (3, 4))
        return (abs(skewness) > ODD * np.sqrt(6 * (rho**3).sum() / self.heights.z.size)
                or kurtosis - 3 > ODD * np.sqrt(24 * (rho**4).sum() / self.heights.z.size))

    @cached_property
    def long(self) -> bool:
        """Whether fewer than WAVES of the strongest waves fit the trace, and its mean square has few degrees of
        freedom: then longer traces are higher."""
        wave = self.spectrum.dominant
        return wave is not None and wave * WAVES > self.heights.length and self.freedom("power") < FEW

    def freedom(self, kind: str) -> float:
        """Degrees of freedom of the mean square of the heights ("power"), of the slopes or of the band."""
        found = self.spectrum
        density = found.within(*self.band) if kind == "band" else found.density
        if kind == "slope":
            density = density * np.sin(np.pi * found.frequency * self.heights.step) ** 2
        if not density.any():
            return FLOOR
        squares = float(density @ density) / (1 + 1 / found.tapers)  # a density of 2 tapers scatters by 1 / tapers
        whole = 2 * found.length * float(density.sum()) ** 2 * found.step / squares
        return max((whole - SPENT) / self._wider[kind == "slope"] ** 2, FLOOR)

    def _by_freedom(self, kind: str, value: float) -> tuple:
        from scipy.special import chdtri

        freedom = self.freedom(kind)
        return tuple(value * float(np.sqrt(freedom / chdtri(freedom, 1 - p))) for p in (HIGH, LOW))

    def _by_traces(self, row: Parameter, value: float) -> tuple:
        if self._made is None:
            self._made = made_traces(self.spectrum, self.heights, self.degree)
        found = [row.of(one) for one in self._made]
        values = np.array([one for one in found if one is not None])
        if values.size < COUNT / 2:
            return None, None
        spread = self._wider[0]
        if row.kind != "extreme":  # an extreme of a longer trace scatters hardly less
            spread *= np.sqrt(min(1.0, self._made[0].length / self.heights.length))
        if row.kind == "wave":
            spread *= PEAK
        mean, positive = values.mean(), values[values > 0]  # a made trace without peaks above its core has Rpk = 0
        if row.kind in ("shift", "share") or value <= 0 or positive.size < COUNT / 2:
            low, high = value - np.quantile(values - mean, (HIGH, LOW)) * spread
            return (float(low) if row.kind == "shift" else max(float(low), 0.0),
                    min(float(high), 1.0) if row.kind == "share" else float(high))
        low, high = value * np.exp(-np.quantile(np.log(positive / mean), (HIGH, LOW)) * spread)
        return float(low), float(high)


def made_traces(found: Spectrum, heights: Heights, degree: int | None, seed: int = 0) -> list:
    """COUNT traces with a spectrum, as Heights; same seed, same heights.

    They are as long as the trace where SAMPLES samples suffice, and stand on its step or a multiple of it that still
    puts FINE samples on a wave. Each is cut from a period of twice its length.
    """
    from scipy.fft import irfft, next_fast_len, prev_fast_len

    total = np.cumsum(found.density[::-1])[::-1]
    shortest = 1 / found.frequency[np.flatnonzero(total >= SHORT * total[0])[-1]]
    every = max(1, int(shortest / (FINE * heights.step)))
    if heights.section is not None:
        every = min(every, max(1, int(heights.section / heights.step) // 8))
    step = every * heights.step
    size = max(min(heights.z.size // every, SAMPLES), 8)
    if heights.section is not None:
        size = max(size, round(heights.section / step))
    if size == SAMPLES:  # the spectrum of each wants a length with a fast transform
        size = prev_fast_len(size + 1, real=True) - 1
    period = next_fast_len(2 * size, real=True)
    frequency = np.arange(period // 2 + 1) / (period * step)
    density = np.interp(frequency, found.frequency, found.density, right=0.0)
    density[0] = 0.0
    deviation = np.sqrt(density / (period * step)) * period / 2
    numbers = np.random.default_rng(seed).standard_normal((2, COUNT, frequency.size))
    z = irfft(deviation * (numbers[0] + 1j * numbers[1]), period, axis=1)[:, :size]
    if degree is not None:
        base = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, size), degree))[0]
        z = z - (z @ base) @ base.T
    return [replace(heights, z=row, step=step) for row in z]
