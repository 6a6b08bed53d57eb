"""Power spectral density of evenly spaced heights and its dominant wavelength."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length

MIN_TAPERS = 3  # smallest number of averaged spectra; fewer are too noisy to show the dominant wave
# Largest number of averaged spectra; more blur the dominant wave and do not narrow the intervals.
MAX_TAPERS = 16
# Largest number of samples that are not trimmed to a length with a fast transform.
MAX_UNTRIMMED = 65_536
BLUR_FRACTION = 0.15  # half-width of the smoothing relative to the frequency of the dominant wave
BAND = (
    60e-6,
    110e-6,
)  # wavelengths [m] of `band_amplitude`, around the 80 um waves of the 1985 report


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided power spectral density (k,) [m3] at frequencies (k,) [1/m].

    Its integral over a range of frequencies is the mean square of those waves. tapers: independent
    spectra that are averaged, so that each value has 2 tapers degrees of freedom; length [m] of the
    trace.
    """

    frequency: np.ndarray
    density: np.ndarray
    tapers: int
    length: float

    @property
    def step(self) -> float:
        """Spacing of the frequencies [1/m]."""
        return float(self.frequency[1] - self.frequency[0])

    @cached_property
    def dominant_wavelength(self) -> float | None:
        """Wavelength [m] whose octave contains most of the mean square, or None for a flat trace.

        It starts at the largest frequency times density, among waves of which the trace holds at
        least two, and moves to the centroid of the density within the width of the tapers around
        it.
        """
        inside = self.frequency * self.length >= 2
        frequency = self.frequency[inside]
        density = self.density[inside]
        if not density.size or density.max() <= 0:
            return None
        start = frequency[int(np.argmax(frequency * density))]
        width = (self.tapers + 1) / 2 / self.length
        centre = start
        for _ in range(5):
            ends = [centre - 1.001 * width, centre + 1.001 * width]
            part = slice(*np.searchsorted(frequency, ends))
            centroid = float(frequency[part] @ density[part] / density[part].sum())
            centre = float(np.clip(centroid, start - width, start + width))
        return float(1 / centre)

    def power(self, low: float, high: float) -> float:
        """Integrate the mean square [m2] of the waves from `low` to `high` [m] long."""
        means = (self.density[1:] + self.density[:-1]) / 2
        total = np.concatenate([[0.0], np.cumsum(means * self.step)])
        ends = np.interp([1 / high, 1 / low], self.frequency, total)
        return float(ends[1] - ends[0])


def estimate_spectrum(z: np.ndarray, step: float, tapers: int | None = None) -> Spectrum:
    """Estimate the power spectral density of heights by the multitaper method.

    Method: Riedel and Sidorenko, IEEE Trans. Signal Process. 43, 188, 1995.

    Parameters
    ----------
    z : (n,) array [m]
        Evenly spaced heights; their mean is subtracted. Beyond 65536 samples up to 0.1 % are left
        out at the end.
    step : float [m]
    tapers : int, optional
        Spectra that are averaged; by default as many as smooth over 15 % of the dominant frequency
        to either side.

    Returns
    -------
    Spectrum
        A million samples take 0.3 s.
    """
    from scipy.fft import prev_fast_len, rfft

    n = z.size if z.size <= MAX_UNTRIMMED else prev_fast_len(z.size + 1, real=True) - 1
    z = z[:n]
    length = n * step
    transform = rfft(np.concatenate([[0.0], z - z.mean()]), 2 * (n + 1))
    density = _average_tapers(transform, n, step, min(MIN_TAPERS, max(n // 4, 1)))
    frequency = np.arange(1, density.size + 1) / ((n + 1) * step) / 2
    first = Spectrum(frozen_array(frequency), frozen_array(density), MIN_TAPERS, length)
    if tapers is None:
        wave = first.dominant_wavelength
        n_tapers = MIN_TAPERS if wave is None else np.floor(2 * BLUR_FRACTION * length / wave) - 1
        tapers = int(np.clip(n_tapers, MIN_TAPERS, MAX_TAPERS))
    if tapers == MIN_TAPERS:
        return first
    return Spectrum(
        first.frequency, frozen_array(_average_tapers(transform, n, step, tapers)), tapers, length
    )


def _average_tapers(transform, n: int, step: float, tapers: int) -> np.ndarray:
    """Average the densities of sine tapers at j = 1, 2, ... half-steps 1 / (2 (n + 1) step).

    The transform under taper k is half the difference of the transforms k half-steps below and
    above.
    """
    size = transform.size
    below = np.conj(transform[tapers:0:-1])
    above = np.conj(transform[-2 : -2 - tapers : -1])
    extended = np.concatenate([below, transform, above])
    total = np.zeros(2 * (size - 1))
    for k in range(1, tapers + 1):
        start = 1 + tapers
        part = (
            extended[start - k : start - k + size - 1] - extended[start + k : start + k + size - 1]
        )
        total += part.view(float) ** 2
    return (total[::2] + total[1::2]) * (step / (n + 1) / tapers)


def band_amplitude(spectrum: Spectrum, low: float, high: float) -> float:
    """Return the amplitude [m] of the sine that has the mean square of a wavelength band.

    Parameters
    ----------
    spectrum : Spectrum
    low, high : float [m]

    Returns
    -------
    float
    """
    return float(np.sqrt(2 * spectrum.power(low, high)))


def refuse_band(source: str, low: float, high: float, length: float, step: float) -> None:
    """Raise PatchfemError if a trace cannot show the waves from `low` to `high`.

    Parameters
    ----------
    source : str
        Name of the trace in the message.
    low, high : float [m]
    length, step : float [m]
        Of the trace and between its samples.
    """
    if not 0 < low < high:
        raise PatchfemError(
            f"{source}: a band from {format_length(low)} to {format_length(high)}; a band must be given from the "
            "shorter to the longer wavelength"
        )
    if 2 * high > length or low < 2 * step:
        raise PatchfemError(
            f"{source}: the trace, {format_length(length)} long with a step of {format_length(step)}, can show waves "
            f"of {format_length(2 * step)} to {format_length(length / 2)}, but not the whole band {format_length(low)} to "
            f"{format_length(high)}"
        )
