"""Power spectral density of an even trace with its 95 % band, dominant wavelength, height of a band of wavelengths."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ..profile import Profile, even, level

TAPERS = 3  # of the first look, and the fewest
MOST = 16
WHOLE = 1 << 16  # samples up to which none is left out for a fast transform
BLUR = 0.15  # half-width of the smoothing over the frequency of the dominant wave
BAND = (60e-6, 110e-6)  # [m] the waves of 80 um of the report


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided power spectral density (k,) [m3] at frequencies (k,) [1/m], from one step above zero to two samples.

    Its integral over a range of frequencies is the mean square of those waves. tapers: spectra of independent error
    that are averaged, so that each value has 2 tapers degrees of freedom; length [m] of the trace.
    """

    frequency: np.ndarray
    density: np.ndarray
    tapers: int
    length: float

    @property
    def step(self) -> float:
        """Distance of two frequencies [1/m]."""
        return float(self.frequency[1] - self.frequency[0])

    def band(self, share: float = 0.95) -> tuple:
        """Lower and upper bound (k,) [m3] between which the true density lies with this probability, by chi-square."""
        from scipy.special import chdtri

        freedom = 2 * self.tapers
        low, high = (freedom / chdtri(freedom, 1 - p) for p in ((1 + share) / 2, (1 - share) / 2))
        return self.density * low, self.density * high

    @cached_property
    def dominant(self) -> float | None:
        """Wavelength [m] at which an octave of frequencies holds most height, None for a flat trace.

        It starts at the largest frequency times density, among waves of which the trace holds two at least, and moves
        to the middle of the density within the width of the tapers around it, so that a sine is found at its own wave.
        """
        inside = self.frequency * self.length >= 2
        f, density = self.frequency[inside], self.density[inside]
        if not density.size or density.max() <= 0:
            return None
        start = at = f[int(np.argmax(f * density))]
        width = (self.tapers + 1) / 2 / self.length
        for _ in range(5):
            part = slice(*np.searchsorted(f, [at - 1.001 * width, at + 1.001 * width]))
            moved = float(f[part] @ density[part] / density[part].sum())
            at = float(np.clip(moved, start - width, start + width))
        return float(1 / at)

    def power(self, low: float, high: float) -> float:
        """Mean square [m2] of the waves from `low` to `high` [m] long, the density straight between frequencies."""
        total = np.concatenate([[0.0], np.cumsum((self.density[1:] + self.density[:-1]) / 2 * self.step)])
        ends = np.interp([1 / high, 1 / low], self.frequency, total)
        return float(ends[1] - ends[0])

    def within(self, low: float, high: float) -> np.ndarray:
        """Density (k,) [m3] of the waves from `low` to `high` [m] alone."""
        return np.where((self.frequency >= 1 / high) & (self.frequency <= 1 / low), self.density, 0.0)


def spectrum_of(z: np.ndarray, step: float, tapers: int | None = None) -> Spectrum:
    """Density of even heights z (n,) [m] about their mean, by sine tapers (Riedel and Sidorenko, IEEE 1995).

    tapers: how many spectra are averaged. None: as many as smooth over 15 % of the frequency of the dominant wave to
    either side, found in a first look, between 3 and 16. All tapers come from one transform: that of taper k at a
    frequency is half the difference of the transforms k half-steps below and above it. A trace of more than 65536
    samples loses up to 0.1 % of them at its end, to a length with a fast transform. A million samples: 0.3 s.
    """
    from scipy.fft import prev_fast_len, rfft

    n = z.size if z.size <= WHOLE else prev_fast_len(z.size + 1, real=True) - 1
    z = z[:n]
    length, half = n * step, (n + 1) * step
    transform = rfft(np.concatenate([[0.0], z - z.mean()]), 2 * (n + 1))
    found = _averaged(transform, n, step, min(TAPERS, max(n // 4, 1)))
    look = Spectrum(np.arange(1, found.size + 1) / half / 2, found, TAPERS, length)
    if tapers is None:
        wave = look.dominant
        tapers = TAPERS if wave is None else int(np.clip(np.floor(2 * BLUR * length / wave) - 1, TAPERS, MOST))
    if tapers != TAPERS:
        found = _averaged(transform, n, step, tapers)
    return Spectrum(frozen_array(look.frequency), frozen_array(found), tapers, length)


def _averaged(transform, n: int, step: float, tapers: int) -> np.ndarray:
    """Mean density at j = 1, 2, ... half-steps 1/(2 (n + 1) step) up to the last."""
    size = transform.size
    wide = np.concatenate([np.conj(transform[tapers:0:-1]), transform, np.conj(transform[-2:-2 - tapers:-1])])
    part, total = np.empty(size - 1, complex), np.zeros(2 * (size - 1))
    squares = part.view(float)
    for k in range(1, tapers + 1):
        first = 1 + tapers
        np.subtract(wide[first - k:first - k + size - 1], wide[first + k:first + k + size - 1], out=part)
        np.multiply(squares, squares, out=squares)
        total += squares
    return (total[::2] + total[1::2]) * (step / (n + 1) / tapers)


def spectrum(profile: Profile, tapers: int | None = None) -> Spectrum:
    """Spectrum of a trace on an even step, less its least-squares line (`spectrum_of`)."""
    flat = level(even(profile))
    return spectrum_of(flat.z, flat.length / (flat.x.size - 1), tapers)


def band_amplitude(profile: Profile, low: float = BAND[0], high: float = BAND[1]) -> float:
    """Amplitude [m] of the sine that has the mean square of the waves from `low` to `high` [m] long: sqrt(2 power).

    PatchfemError for a band that is empty, or that the trace or its step is too coarse for.
    """
    flat = level(even(profile))
    step = flat.length / (flat.x.size - 1)
    refuse_band(flat.source, low, high, flat.length, step)
    return amplitude_of(spectrum_of(flat.z, step), low, high)


def amplitude_of(found: Spectrum, low: float, high: float) -> float:
    """Amplitude [m] of the sine with the mean square of a band of a spectrum."""
    return float(np.sqrt(2 * found.power(low, high)))


def refuse_band(source: str, low: float, high: float, length: float, step: float) -> None:
    """PatchfemError where a trace cannot show waves from `low` to `high` [m]."""
    if not 0 < low < high:
        raise PatchfemError(f"{source}: a band from {say(low)} to {say(high)}; a band must be given from the shorter "
                            "to the longer wavelength")
    if 2 * high > length or low < 2 * step:
        raise PatchfemError(f"{source}: the trace, {say(length)} long with a step of {say(step)}, can show waves of "
                            f"{say(2 * step)} to {say(length / 2)}, but not the whole band {say(low)} to {say(high)}")
