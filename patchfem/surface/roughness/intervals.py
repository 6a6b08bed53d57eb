"""Interval (5 to 95 %) of a roughness parameter, from the spectrum of a single trace.

The interval holds the mean that the parameter has over all traces of this length on a surface with
Gaussian heights and the spectrum of this trace, in 90 of 100 traces:

- A mean square (Rq, Rdq, the amplitude of a band) is chi-square distributed about its mean with 2 L
  (int S)^2 / int S^2 degrees of freedom, for the density S over the length L.
- For the other parameters, traces are simulated with the spectrum and with random phases and
  heights. The parameter of the trace stands to its mean like those of the simulated traces to
  theirs: as a ratio, or as a difference.

Heights with a kurtosis above 3 scatter more; their intervals are wider by sqrt((kurtosis - 1) / 2),
which is exact for the mean square of independent heights. An interval holds neither for a surface
that differs from place to place nor for waves longer than the trace.

All but those of the dominant wavelength and of a band assume Gaussian heights. On lognormal heights
only 3 of 10 intervals of the kurtosis held the mean, and on a self-affine surface without a longest
wave 62 to 73 of 100 intervals of heights (tests/support/roughness_coverage.py). Such traces get no
such interval.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from .parameters import Heights, kurtosis, skewness
from .rows import Parameter
from .spectrum import BAND, Spectrum, chi_square_factor, estimate_spectrum

P_LOWER = 0.05  # probability of the lower bound
P_UPPER = 0.95  # probability of the upper bound
# Number of simulated traces, which determine the probability of a bound to 1.5 %.
N_SIMULATED_TRACES = 200
# Largest number of samples in a simulated trace, which keeps all of them below 10 MB.
MAX_SAMPLES = 2048
# Number of degrees of freedom that estimating the spectrum uses up, from coverage tests.
SPECTRUM_FREEDOM = 2.5
MAX_DEVIATIONS = 1.96  # largest skewness and kurtosis of Gaussian heights, in standard deviations
PEAK_FACTOR = 1.3  # scatter of the dominant wavelength relative to that of simulated traces
# Smallest number of dominant waves in a long trace; self-affine traces have 2.7 to 3.5.
MIN_WAVES = 4
# Smallest number of degrees of freedom of a long trace; self-affine traces have 6 to 11, others 16.
MIN_FREEDOM = 12.0
LATERAL = ("wave", "band")  # kinds of parameters whose intervals need no Gaussian heights
SIZES = (
    "power",
    "ratio",
    "extreme",
)  # kinds of parameters that grow with the length of a self-affine trace


class Intervals:
    """Confidence intervals of the roughness parameters of one trace.

    Parameters
    ----------
    heights : Heights
    degree : int or None
        Degree of the polynomial that was subtracted from the trace, and is from the simulated ones;
        None for none.
    spectrum : Spectrum, optional
        Spectrum of the heights, estimated if it is not given.
    band : tuple
        Shortest and longest wavelength [m] of the band.
    """

    def __init__(
        self,
        heights: Heights,
        degree: int | None,
        spectrum: Spectrum | None = None,
        band: tuple = BAND,
    ) -> None:
        self.heights = heights
        self.degree = degree
        self.band = band
        self.spectrum = estimate_spectrum(heights.z, heights.step) if spectrum is None else spectrum

    @cached_property
    def _traces(self) -> list[Heights]:
        return simulate_traces(self.spectrum, self.heights, self.degree)

    @cached_property
    def _height_widening(self) -> float:
        return _estimate_widening(self.heights)

    @cached_property
    def _slope_widening(self) -> float:
        return _estimate_widening(Heights(np.diff(self.heights.z), self.heights.step))

    def confidence_interval(
        self, row: Parameter, value: float | None
    ) -> tuple[float | None, float | None]:
        """Return the confidence bounds of a parameter, or (None, None) if they are unknown."""
        if value is None or not row.kind or not self.spectrum.density.any():
            return None, None
        if (self.is_uneven and row.kind not in LATERAL) or (self.is_short and row.kind in SIZES):
            return None, None
        if row.kind in ("power", "slope", "band"):
            freedom = self.freedom(row.kind)
            low, high = (np.sqrt(chi_square_factor(freedom, p)) for p in (P_UPPER, P_LOWER))
            return value * float(low), value * float(high)
        return self._simulated_interval(row, value)

    @cached_property
    def is_uneven(self) -> bool:
        """Whether skewness or kurtosis rule out Gaussian heights.

        Their standard deviations are sqrt(6 int |rho|^3 / L) and sqrt(24 int rho^4 / L), with the
        autocorrelation rho of the spectrum.
        """
        from scipy.fft import irfft

        rho = np.abs(irfft(np.concatenate([[0.0], self.spectrum.density])))
        rho /= rho[0]
        count = self.heights.z.size
        skewness_limit = MAX_DEVIATIONS * np.sqrt(6 * (rho**3).sum() / count)
        kurtosis_limit = MAX_DEVIATIONS * np.sqrt(24 * (rho**4).sum() / count)
        return (
            abs(skewness(self.heights)) > skewness_limit
            or kurtosis(self.heights) - 3 > kurtosis_limit
        )

    @cached_property
    def is_short(self) -> bool:
        """Whether the trace is too short for its longest waves."""
        wave = self.spectrum.dominant_wavelength
        if wave is None or wave * MIN_WAVES <= self.heights.length:
            return False
        return self.freedom("power") < MIN_FREEDOM

    def freedom(self, kind: str) -> float:
        """Return the degrees of freedom of the mean square "power", "slope" or "band"."""
        spectrum = self.spectrum
        density = spectrum.density_between(*self.band) if kind == "band" else spectrum.density
        if kind == "slope":
            density = density * np.sin(np.pi * spectrum.frequency * self.heights.step) ** 2
        if not density.any():
            return 1.0
        # Corrected for the scatter of the estimated density.
        squares = float(density @ density) / (1 + 1 / spectrum.tapers)
        total = 2 * spectrum.length * float(density.sum()) ** 2 * spectrum.step / squares
        widening = self._slope_widening if kind == "slope" else self._height_widening
        return max((total - SPECTRUM_FREEDOM) / widening**2, 1.0)

    def _simulated_interval(
        self, row: Parameter, value: float
    ) -> tuple[float | None, float | None]:
        simulated = [row.compute(trace) for trace in self._traces]
        values = np.array([number for number in simulated if number is not None])
        if values.size < N_SIMULATED_TRACES / 2:
            return None, None
        spread = self._height_widening
        if row.kind != "extreme":  # an extreme of a longer trace scatters hardly less
            spread *= np.sqrt(min(1.0, self._traces[0].length / self.heights.length))
        if row.kind == "wave":
            spread *= PEAK_FACTOR
        positive = values[values > 0]  # a simulated trace without peaks above its core has Rpk = 0
        if (
            row.kind in ("shift", "fraction")
            or value <= 0
            or positive.size < N_SIMULATED_TRACES / 2
        ):
            low, high = value - np.quantile(values - values.mean(), (P_UPPER, P_LOWER)) * spread
            bounds = {"shift": (-np.inf, np.inf), "fraction": (0.0, 1.0)}.get(
                row.kind, (0.0, np.inf)
            )
            return max(float(low), bounds[0]), min(float(high), bounds[1])
        low, high = value * np.exp(
            -np.quantile(np.log(positive / values.mean()), (P_UPPER, P_LOWER)) * spread
        )
        return float(low), float(high)


def _estimate_widening(heights: Heights) -> float:
    """Return the factor by which a kurtosis above 3 widens an interval."""
    fourth = kurtosis(heights)
    return 1.0 if fourth is None else float(np.sqrt(max(1.0, (fourth - 1) / 2)))


def simulate_traces(spectrum: Spectrum, heights: Heights, degree: int | None) -> list[Heights]:
    """Simulate Gaussian traces with a given spectrum; each call returns the same traces.

    They are as long as the trace where MAX_SAMPLES samples suffice, on its step or a multiple of it
    that resolves all waves but 1 % of the mean square by six samples. Each is cut from a period of
    twice its length.

    Parameters
    ----------
    spectrum : Spectrum
    heights : Heights
        Gives size, step and section.
    degree : int or None
        Degree of the polynomial that is subtracted from each; None for none.

    Returns
    -------
    list of Heights
        N_SIMULATED_TRACES traces.
    """
    from scipy.fft import irfft, next_fast_len, prev_fast_len

    total = np.cumsum(spectrum.density[::-1])[::-1]
    shortest = 1 / spectrum.frequency[np.flatnonzero(total >= 0.01 * total[0])[-1]]
    stride = max(1, int(shortest / (6 * heights.step)))
    section = 0 if heights.section is None else heights.section / heights.step
    if section:
        stride = min(stride, max(1, int(section) // 8))
    size = max(min(heights.z.size // stride, MAX_SAMPLES), 8, round(section / stride))
    if size == MAX_SAMPLES:  # the spectrum of each trace needs a length with a fast transform
        size = prev_fast_len(size + 1, real=True) - 1
    step = stride * heights.step
    period = next_fast_len(2 * size, real=True)
    frequency = np.arange(period // 2 + 1) / (period * step)
    density = np.interp(frequency, spectrum.frequency, spectrum.density, right=0.0)
    density[0] = 0.0
    deviation = np.sqrt(density / (period * step)) * period / 2
    numbers = np.random.default_rng(0).standard_normal((2, N_SIMULATED_TRACES, frequency.size))
    z = irfft(deviation * (numbers[0] + 1j * numbers[1]), period, axis=1)[:, :size]
    if degree is not None:
        base = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, size), degree))[0]
        z = z - (z @ base) @ base.T
    return [replace(heights, z=row, step=step) for row in z]
