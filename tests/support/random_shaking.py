"""Motions of an oscillator under random records, from their lines by its transfer function, and how often the scatter
that is printed for them holds the closed form.

    python tests/support/random_shaking.py 20000 200

prints, for each of CASES, the share of so many seeds from the first on whose interval of 95 % holds the truth, the mean
and the median half-width relative to it, and the CPU seconds of a reading.
"""

import sys
from time import process_time
from types import SimpleNamespace

import numpy as np
from vibration_forms import shaken_rms

from patchfem.response import stationary
from patchfem.structure.noise import noise

CASES = ((100.0, 0.02, 10.0), (100.0, 0.005, 30.0), (40.0, 0.05, 20.0))  # frequency [Hz], damping ratio, duration [s]
NAMES = ("relative_displacement_rms", "absolute_acceleration_rms", "response_frequency", "response_damping")
LEVEL = 1.0  # m^2/s^3


def band_of(frequency: float) -> tuple:
    return 0.2 * frequency, 3 * frequency


def shaken(frequency: float, damping: float, duration: float, seed: int) -> tuple:
    """(window, drive): the steady motion of an oscillator under a record, whose lines are those of the drive."""
    low, high = band_of(frequency)
    drive = noise((low, high), (LEVEL, LEVEL), duration, seed, 1 / frequency)
    f, omega = np.arange(drive.time.size // 2 + 1) / drive.duration, 2 * np.pi * frequency
    lines = np.fft.rfft(drive.value[:-1]) * np.sinc(f * drive.time[1])**2 * ((f >= low - 1e-9) & (f <= high + 1e-9))
    s = 2j * np.pi * f
    place = -lines / (omega**2 + s * s + 2 * damping * omega * s)
    motion = [np.fft.irfft(one, drive.time.size - 1) for one in (
        place, s * place, -(omega**2 + 2 * damping * omega * s) * place)]
    return SimpleNamespace(extra={}, **dict(zip(("time", "output", "output_rate", "acceleration"),
                                      (drive.time[:-1], *motion)))), drive


def held(frequency: float, damping: float, duration: float, seed: int) -> list:
    """Of each of NAMES (value, half-width) over its truth."""
    found = stationary.measures(*shaken(frequency, damping, duration, seed))
    truth = (*shaken_rms(2 * np.pi * frequency, damping, LEVEL, band_of(frequency)), frequency, damping)
    return [(found[name] / true, found[f"{name}_scatter"] / true) for name, true in zip(NAMES, truth)]


if __name__ == "__main__":
    first, count = map(int, sys.argv[1:])
    for case in CASES:
        begin = process_time()
        rows = np.array([held(*case, seed) for seed in range(first, first + count)])
        spent = (process_time() - begin) / count
        print(f"{case[0]:g} Hz, {case[1]:g}, {case[2]:g} s: {spent:.3f} s a record")
        for name, (value, width) in zip(NAMES, np.moveaxis(rows, 0, -1)):
            print(f"  {name:<28} {np.mean(np.abs(value - 1) <= width):.3f} of {count}; mean {value.mean():.4f}, "
                  f"half-width {np.median(width):.4f}")
