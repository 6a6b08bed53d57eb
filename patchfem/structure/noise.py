"""A stationary random drive: a record of one-sided spectral density G(f), straight between its rows, from a seed.

a(t) = sum_k A_k cos 2 pi f_k t + B_k sin 2 pi f_k t with f_k = k/T and A_k, B_k normal of variance G(f_k)/T: Gaussian,
of length T and without a spectrum outside the band (Shinozuka and Deodatis 1991, with random amplitudes, so that the
powers of records scatter as those of a shaker do). A straight line between rows h apart takes sinc^2(f h) of a line,
which is put back.
"""

from dataclasses import dataclass

import numpy as np

from ..core import PatchfemError
from .drive_sizes import DriveKeys
from .drives import Recorded

ROWS = 8  # of the record in a period of its highest frequency
FEWEST = 8  # lines of the record


@dataclass(frozen=True, eq=False, slots=True)
class Random(Recorded):
    """A Recorded that is stationary; band: its lowest and its highest frequency [Hz]."""

    band: tuple = (0.0, 0.0)

    @property
    def max_frequency_ratio(self) -> float:
        """Highest frequency over that of the cycle."""
        return max(1.0, self.band[1] * self.period)


def random_record(frequency, level, duration: float, seed: int, period: float) -> Random:
    """A record of at least `duration` [s] with the density level (k,) [m2 s-3] at frequency (k,) [Hz], straight between
    them in logarithms; seed: of the record; period [s]: what counts as a cycle.

    PatchfemError where fewer than FEWEST lines 1/duration apart lie in the band.
    """
    low, high = float(frequency[0]), float(frequency[-1])
    count = int(np.ceil(duration * ROWS * high))
    step = duration / count
    lines = np.arange(int(np.ceil(low * duration - 1e-9)), int(high * duration + 1e-9) + 1)
    if lines.size < FEWEST:
        raise PatchfemError(
            f"{duration:g} s are too short for a band of {high - low:g} Hz, which then has only "
            f"{lines.size} spectral lines; at least {FEWEST / (high - low):.3g} s are "
            "needed",
            "drive.duration",
        )
    f = np.clip(lines / duration, low, high)
    density = np.exp(np.interp(np.log(f), np.log(frequency), np.log(level)))
    a, b = np.random.default_rng(seed).standard_normal((2, lines.size)) * np.sqrt(
        density / duration
    )
    transform = np.zeros(count // 2 + 1, complex)
    transform[lines] = (a - 1j * b) * (count / 2) / np.sinc(f * step) ** 2
    value = np.fft.irfft(transform, count)
    return Random(step * np.arange(count + 1), np.append(value, value[0]), period, band=(low, high))


def _random(asked: DriveKeys) -> Random:
    keys = asked.keys
    frequency, level = (
        asked.read() if keys.file is not None else ((keys.from_, keys.to), (keys.spectrum,) * 2)
    )
    frequency, level = cut_spectrum(
        np.array(frequency, float), np.array(level, float), keys.from_, keys.to
    )
    duration = keys.duration if keys.duration is not None else keys.cycles * asked.period
    return random_record(frequency, level, duration, keys.seed or 0, asked.period)


def cut_spectrum(frequency, level, low: float | None, high: float | None) -> tuple:
    """The part of a spectrum (k,) [Hz], (k,) between low and high [Hz], its own ends where None; PatchfemError where
    these lie outside it."""
    low, high = (
        own if end is None else end for own, end in ((frequency[0], low), (frequency[-1], high))
    )
    if low < frequency[0] or high > frequency[-1]:
        raise PatchfemError(
            f"{low:g} to {high:g} Hz reach beyond the spectrum, which is given only from "
            f"{frequency[0]:g} to {frequency[-1]:g} "
            "Hz",
            "drive.from" if low < frequency[0] else "drive.to",
        )
    inner = frequency[(frequency > low) & (frequency < high)]
    places = np.array([low, *inner, high])
    return places, np.exp(np.interp(np.log(places), np.log(frequency), np.log(level)))


BUILDERS = {"random": _random}
