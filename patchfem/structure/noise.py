"""Stationary random drive signal: a record with a given one-sided spectral density G(f).

a(t) = sum_k A_k cos 2 pi f_k t + B_k sin 2 pi f_k t, with f_k = k/T and with A_k and B_k normally
distributed of variance G(f_k)/T. The record is Gaussian, has the length T, and has no power outside the
band (Shinozuka and Deodatis 1991, with random amplitudes, so that the powers of records scatter as those
of a shaker do). Linear interpolation between rows h apart multiplies a line at f by sinc^2(f h), which is
compensated.
"""

import numpy as np

from ..core import PatchfemError, array_dataclass
from .drive_sizes import DriveKeys
from .drives import RecordedDrive

# Smallest number of spectral lines of a record; the values of a record with fewer are not Gaussian
MIN_SPECTRAL_LINES = 8
# Tolerance on the number of the spectral line at each end of the band, in line spacings
SPECTRAL_LINE_TOL = 1e-9


@array_dataclass
class RandomRecord(RecordedDrive):
    """Sampled record of a stationary random drive signal.

    - band: lowest and highest frequency [Hz].
    """

    band: tuple[float, float] = (0.0, 0.0)
    find_line_loss = None  # `draw_random_record` chooses the rows

    @property
    def max_frequency_ratio(self) -> float:
        """Ratio of the highest frequency to the frequency of the drive cycle."""
        return max(1.0, self.band[1] * self.period)


def draw_random_record(
    frequency,
    density,
    duration: float,
    seed: int,
    period: float,
    band: tuple[float | None, float | None] = (None, None),
) -> RandomRecord:
    """Draw a random record with a given spectral density.

    Parameters
    ----------
    frequency : (k,) array_like
        Frequencies [Hz].
    density : (k,) array_like
        One-sided spectral density [m2 s-3] at these frequencies; it is interpolated in logarithms.
    duration : float
        Length [s] of the record.
    seed : int
        Seed of the random numbers.
    period : float
        Duration [s] of a cycle of the drive.
    band : tuple of float or None
        Lowest and highest frequency [Hz] of the record, or None for an end of the spectrum.

    Returns
    -------
    RandomRecord

    Raises
    ------
    PatchfemError
        If the band reaches beyond the spectrum, or has fewer than `MIN_SPECTRAL_LINES` lines, 1/duration apart.
    """
    ends = [float(frequency[0]), float(frequency[-1])]
    low, high = (end if limit is None else limit for limit, end in zip(band, ends))
    if low < ends[0] or high > ends[1]:
        raise PatchfemError(
            f"{low:g} to {high:g} Hz reach beyond the spectrum, which is given only from {ends[0]:g} to {ends[1]:g} Hz",
            "drive.from" if low < ends[0] else "drive.to",
        )

    # Spectral lines in the band.
    # Number of rows of the record per period of the highest frequency
    n_rows = int(np.ceil(duration * 8 * high))
    step = duration / n_rows
    first_line = int(np.ceil(low * duration - SPECTRAL_LINE_TOL))
    lines = np.arange(first_line, int(high * duration + SPECTRAL_LINE_TOL) + 1)
    if lines.size < MIN_SPECTRAL_LINES:
        raise PatchfemError(
            f"{duration:g} s are too short for a band of {high - low:g} Hz, which then has only "
            f"{lines.size} spectral lines; at least {MIN_SPECTRAL_LINES / (high - low):.3g} s are "
            "needed",
            "drive.duration",
        )

    # Amplitudes A_k and B_k of variance G(f_k)/T; the sinc compensates the interpolation between rows.
    f = np.clip(lines / duration, low, high)
    line_density = np.exp(np.interp(np.log(f), np.log(frequency), np.log(density)))
    normal = np.random.default_rng(seed).standard_normal((2, lines.size))
    cosine, sine = normal * np.sqrt(line_density / duration)
    transform = np.zeros(n_rows // 2 + 1, complex)
    transform[lines] = (cosine - 1j * sine) * (n_rows / 2) / np.sinc(f * step) ** 2
    value = np.fft.irfft(transform, n_rows)
    time = step * np.arange(n_rows + 1)
    return RandomRecord(time, np.append(value, value[0]), period, band=(low, high))


def _build_random(drive: DriveKeys) -> RandomRecord:
    """Build the drive signal for waveform "random"."""
    keys = drive.keys
    if keys.file is not None:
        frequency, density = drive.read_file()
    else:
        frequency = (keys.from_, keys.to)
        density = (keys.spectrum, keys.spectrum)
    duration = keys.duration if keys.duration is not None else keys.cycles * drive.period
    band = (keys.from_, keys.to)
    return draw_random_record(frequency, density, duration, keys.seed or 0, drive.period, band)


# Function that builds the signal of the waveform of this module
DRIVE_BUILDERS = {"random": _build_random}
