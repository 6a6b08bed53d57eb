"""Spectrum of a trace: its density, and the waves that are too short for the elements."""

from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..formatting import format_length
from .areal import level
from .profile import Profile, resample_evenly

# Wavelengths [m] of `band_amplitude`: the 80 um waves of the 1985 report
WAVE_BAND = (60e-6, 110e-6)
MIN_ELEMENTS_PER_WAVE = 2  # number of elements per wave; nodes cannot represent a shorter wave
# Fraction of the rms height in waves that are too short for the elements,
# above which a warning is given.
MAX_LOST_FRACTION = 0.1
# Same fraction, below which the elements represent a trace
NEGLIGIBLE_LOST_FRACTION = MAX_LOST_FRACTION / 10
# Number of elements on a wave that a smooth curve through the nodes represents
ELEMENTS_PER_CURVED_WAVE = 4


class WaveSpectrum(NamedTuple):
    """Spectrum of a trace.

    - waves (n,): wavelengths [m], longest first. The first one is twice the length of the trace.
    - power (n,): mean square [m2] of each wave.
    """

    waves: np.ndarray
    power: np.ndarray

    @property
    def density(self) -> np.ndarray:
        """One-sided power spectral density (n,) [m3], smoothed."""
        from scipy.ndimage import uniform_filter1d

        # Number of neighbouring waves whose mean is the density at their middle
        return uniform_filter1d(self.power, 9, mode="nearest") * self.waves[0]

    def measure_band(self) -> float:
        """Return the amplitude [m] of a sine whose mean square is that of all waves with lengths in `WAVE_BAND`."""
        inside = (self.waves >= WAVE_BAND[0]) & (self.waves <= WAVE_BAND[1])
        return float(np.sqrt(2 * self.power[inside].sum()))

    def lost_fraction(self, length: float) -> float:
        """Return the fraction of the rms height in waves shorter than a given length [m]."""
        total = self.power.sum()
        lost = self.power[self.waves < length * (1 - 1e-9)].sum()
        return float(np.sqrt(lost / total)) if total > 0 else 0.0

    def element_length(self, kept: float) -> float:
        """Return the longest element [m] that resolves the fraction `kept` of the rms height."""
        lost = (
            np.cumsum(self.power[::-1])[::-1] / self.power.sum()
        )  # in this wave and all shorter ones
        needed = np.flatnonzero(lost > (1 - kept) ** 2)
        return float(self.waves[needed[-1]]) / MIN_ELEMENTS_PER_WAVE

    def shortest_resolved_wave(self, element: float, strain: float) -> float:
        """Return the shortest wave [m] on which the contact is at least one element long.

        The contact on a wave is that on a sine with the rms slope of this and all longer waves
        (Westergaard 1939): the fraction 2/pi asin sqrt(p/p*) of a wave touches under the mean pressure
        p, and p* = E* slope/sqrt(2) closes the wave.

        Parameters
        ----------
        element : float [m]
            Length of an element of the mesh.
        strain : float
            Mean pressure over combined modulus, p/E*.

        Returns
        -------
        float
            inf if no wave is resolved.
        """
        slope = np.sqrt(np.cumsum(self.power * (2 * np.pi / self.waves) ** 2))
        ratio = np.divide(np.sqrt(2) * strain, slope, out=np.ones(slope.size), where=slope > 0)
        touching = 2 / np.pi * np.arcsin(np.sqrt(np.minimum(ratio, 1.0)))
        is_resolved = (self.waves * touching >= element) & (
            self.waves >= MIN_ELEMENTS_PER_WAVE * element
        )
        return float(self.waves[is_resolved].min(initial=np.inf))


def wave_spectrum(profile: Profile, *, is_tapered: bool = False) -> WaveSpectrum:
    """Compute the spectrum of a levelled profile by a discrete cosine transform.

    A cosine transform continues the trace by its mirror image, without the jump between both ends that gives a Fourier
    series false short waves. The mean squares of all waves add up to that of the trace (trapezoidal rule). Uneven samples
    are first resampled.

    Parameters
    ----------
    profile : Profile
        Levelled trace.
    is_tapered : bool
        Whether heights are multiplied by the window of Hann, and the spectrum divided by its mean square of 3/8. This
        removes the kinks of the mirror image, so that a single wave stays sharp, but the ends of the trace count little.

    Raises
    ------
    PatchfemError
        If heights are missing.
    """
    from scipy.fft import dct

    if profile.missing.any():
        raise PatchfemError(
            f"{profile.source}: {profile.missing.sum()} heights are missing; clean the trace first"
        )
    z = level(resample_evenly(profile)).z
    count = z.size - 1
    if is_tapered:
        z = z * np.sqrt(8 / 3) * np.sin(np.pi * np.arange(z.size) / count) ** 2
    power = (dct(z, type=1) / count)[1:] ** 2 / 2
    power[-1] /= 2  # the transform counts the wave of two samples twice
    return WaveSpectrum(2 * profile.length / np.arange(1, count + 1), power)


def describe_lost_waves(profile: Profile, element: float) -> str | None:
    """Return a warning that elements [m] are too long to resolve a profile, or None if they are not."""
    spectrum = wave_spectrum(profile)
    length = MIN_ELEMENTS_PER_WAVE * element
    lost = spectrum.lost_fraction(length)
    if lost <= MAX_LOST_FRACTION:
        return None
    # A length that is rounded up would not suffice.
    sufficient = 0.99 * spectrum.element_length(1 - MAX_LOST_FRACTION)
    return (
        f"{profile.source} has {100 * lost:.0f} % of its rms height in waves shorter than "
        f"{MIN_ELEMENTS_PER_WAVE} elements ({format_length(length)}), which the mesh cannot resolve: add "
        "[contact.asperities], or set element_size = "
        f'"{format_length(sufficient, 3)}", which keeps {100 - 100 * MAX_LOST_FRACTION:g} % of the height'
    )
