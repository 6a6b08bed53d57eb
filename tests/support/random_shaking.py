"""Oscillators under random records, computed from spectral lines, to test the scatter stated for random response."""

from types import SimpleNamespace

import numpy as np
from vibration_forms import shaken_rms

from patchfem.measures import stationary
from patchfem.structure.noise import draw_random_record

# Frequency [Hz], damping ratio, duration [s].
CASES = ((100.0, 0.02, 10.0), (100.0, 0.005, 30.0), (40.0, 0.05, 20.0))
NAMES = (
    "relative_displacement_rms",
    "absolute_acceleration_rms",
    "response_frequency",
    "response_damping",
)
LEVEL = 1.0  # Spectral density of the acceleration [m^2/s^3].


def excitation_band(frequency: float) -> tuple:
    """Return the frequency band of the excitation [Hz]."""
    return 0.2 * frequency, 3 * frequency


def simulate_random_response(frequency: float, damping: float, duration: float, seed: int) -> tuple:
    """Return (window, drive): the steady motion of an oscillator under a record with the spectral lines of the drive."""
    low, high = excitation_band(frequency)
    drive = draw_random_record((low, high), (LEVEL, LEVEL), duration, seed, 1 / frequency)
    f = np.arange(drive.time.size // 2 + 1) / drive.duration
    omega = 2 * np.pi * frequency
    lines = (
        np.fft.rfft(drive.value[:-1])
        * np.sinc(f * drive.time[1]) ** 2
        * ((f >= low - 1e-9) & (f <= high + 1e-9))
    )
    s = 2j * np.pi * f
    displacement = -lines / (omega**2 + s * s + 2 * damping * omega * s)
    motion = [
        np.fft.irfft(spectrum, drive.time.size - 1)
        for spectrum in (
            displacement,
            s * displacement,
            -(omega**2 + 2 * damping * omega * s) * displacement,
        )
    ]
    return SimpleNamespace(
        extra={},
        **dict(zip(("time", "output", "output_rate", "acceleration"), (drive.time[:-1], *motion))),
    ), drive


def normalized_measures(frequency: float, damping: float, duration: float, seed: int) -> list:
    """Return for each of NAMES the value and its half-width, divided by the true value."""
    found = stationary.random_response_measures(
        *simulate_random_response(frequency, damping, duration, seed)
    )
    truth = (
        *shaken_rms(2 * np.pi * frequency, damping, LEVEL, excitation_band(frequency)),
        frequency,
        damping,
    )
    return [
        (found[name] / true_value, found[f"{name}_scatter"] / true_value)
        for name, true_value in zip(NAMES, truth)
    ]
