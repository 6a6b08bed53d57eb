"""Responses of known modes: to a sum of sines from rest in closed form, and as free decays."""

from __future__ import annotations

import numpy as np

STEP, SAMPLES = 1 / 2000, 4096
OMEGA, ZETA, RESIDUE = (
    2 * np.pi * np.array([143.0, 260.0]),
    np.array([0.004, 0.01]),
    np.array([1.2, 0.6]),
)
TIME = STEP * np.arange(SAMPLES)


def driven_response(quantity: str) -> tuple:
    """Return (input, response) of the modes from rest to sines with random phases.

    The sines are at all lines of the record up to 730 Hz. The steady response is a sum over the
    lines; the transient is the free decay that cancels its initial displacement and velocity.
    """
    lines = 2j * np.pi * np.fft.rfftfreq(SAMPLES, STEP)
    spectrum = np.zeros(lines.size, complex)
    count = np.arange(5, 1500)
    spectrum[count] = (
        np.exp(2j * np.pi * np.random.default_rng(1).random(count.size)) * SAMPLES / 80
    )
    total = np.zeros(SAMPLES)
    power = {"displacement": 0, "velocity": 1, "acceleration": 2}[quantity]
    for w, z, a in zip(OMEGA, ZETA, RESIDUE):
        steady = spectrum * a / (w * w + lines**2 + 2 * z * w * lines)
        displacement = np.fft.irfft(steady, SAMPLES)[0]
        speed = np.fft.irfft(lines * steady, SAMPLES)[0]
        pole = complex(-z * w, w * np.sqrt(1 - z * z))
        # The transient is Re(start exp(pole t)) with this start.
        start = complex(-displacement, (speed - pole.real * displacement) / pole.imag)
        total += np.fft.irfft(lines**power * steady, SAMPLES) + np.real(
            pole**power * start * np.exp(pole * TIME)
        )
    return np.fft.irfft(spectrum, SAMPLES), total


def free_decay(amplitudes=(0.3, 0.2), omega=OMEGA, zeta=ZETA) -> tuple:
    """Return (time, displacement) of modes released from rest, those of this module by default."""
    time = TIME[:3000]
    return time, 0.01 + sum(
        a * np.exp(-z * w * time) * np.cos(w * np.sqrt(1 - z * z) * time + k)
        for k, (w, z, a) in enumerate(zip(omega, zeta, amplitudes))
    )
