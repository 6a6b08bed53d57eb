"""Power spectral density of evenly spaced heights and its dominant wavelength."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import fft

from ...core import frozen_array

MIN_TAPERS = 3  # smallest number of averaged spectra; fewer are too noisy to show the dominant wave
# Largest number of averaged spectra; more blur the dominant wave and do not narrow the intervals.
MAX_TAPERS = 16
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

    def band_amplitude(self, low: float, high: float) -> float:
        """Return the amplitude [m] of the sine that has the mean square of the waves from `low` to `high` [m]."""
        steps = np.diff(self.frequency)
        total = np.cumsum(np.append(0.0, (self.density[1:] + self.density[:-1]) / 2 * steps))
        ends = np.interp([1 / high, 1 / low], self.frequency, total)
        return float(np.sqrt(2 * (ends[1] - ends[0])))


def estimate_spectrum(z: np.ndarray, step: float, tapers: int | None = None) -> Spectrum:
    """Estimate the power spectral density of heights with sine tapers.

    Method: Riedel and Sidorenko, IEEE Trans. Signal Process. 43, 188, 1995.

    Parameters
    ----------
    z : (n,) array [m]
        Evenly spaced heights; their mean is subtracted.
    step : float [m]
    tapers : int, optional
        Spectra that are averaged; by default as many as smooth over 15 % of the dominant frequency
        to either side.
    """
    z = z - z.mean()
    if tapers is not None:
        return _average_tapers(z, step, tapers)
    first = _average_tapers(z, step, min(MIN_TAPERS, max(z.size // 4, 1)))
    wave = first.dominant_wavelength
    if wave is None:
        return first
    n_tapers = np.floor(2 * BLUR_FRACTION * z.size * step / wave) - 1
    return _average_tapers(z, step, int(np.clip(n_tapers, MIN_TAPERS, MAX_TAPERS)))


def _average_tapers(z, step: float, tapers: int) -> Spectrum:
    """Return the mean of the spectra under the sine tapers 1, 2, ... of heights without their mean."""
    n = z.size
    places = np.arange(1, n + 1) / (n + 1)
    total = 0.0
    for k in range(1, tapers + 1):
        waves = fft.rfft(z * np.sin(np.pi * k * places), 2 * (n + 1))[1:]
        # Both sides of each frequency, and the sum (n + 1)/2 of the squares of a taper.
        total = total + np.abs(waves) ** 2 * 4 * step / (n + 1) / tapers
    frequency = fft.rfftfreq(2 * (n + 1), step)[1:]
    return Spectrum(frozen_array(frequency), frozen_array(total), tapers, n * step)
