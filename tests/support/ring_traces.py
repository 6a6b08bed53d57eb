"""Gaussian traces of an isotropic surface with a ring of wavelengths about 80 um and a self-affine part."""

import numpy as np

WAVE = 80e-6


def trace_density(frequency: np.ndarray, shortest: float = 8e-6) -> np.ndarray:
    """Return the one-sided spectral density (k,) of a trace at frequencies [1/m], up to a factor.

    It is that of the surface, integrated over the other direction. A ring exp(-(q - q0)^2 / 2 (q0 /
    4)^2) has 0.8 of the mean square; the other 0.2 belong to a spectrum that is flat below q0 and
    falls as q^(-3.6) above.
    """
    q0 = 1 / WAVE
    across = np.linspace(0, 1 / shortest, 2001)
    parts = []
    for kind in ("ring", "rest"):

        def surface_density(q, kind=kind):
            """Return the density of one part of the surface at wave numbers q [1/m]."""
            value = (
                np.exp(-(((q - q0) / (0.25 * q0)) ** 2) / 2)
                if kind == "ring"
                else np.maximum(q / q0, 1.0) ** -3.6
            )
            return np.where(q <= 1 / shortest, value, 0.0)

        line = np.array(
            [np.trapezoid(surface_density(np.hypot(f, across)), across) for f in frequency]
        )
        radial = np.trapezoid(surface_density(across) * across, across)
        parts.append(line / radial)
    return 0.8 * parts[0] + 0.2 * parts[1]


def draw_traces(count: int, length: float, step: float, rms: float, seed: int) -> np.ndarray:
    """Return independent traces (count, n) [m], each cut from a period of eight times its length."""
    n_points = round(length / step) + 1
    period = 8 * n_points
    frequency = np.arange(period // 2 + 1) / (period * step)
    coarse = np.linspace(0, frequency[-1], 1500)
    power = np.interp(frequency, coarse, trace_density(coarse))
    power[0] = 0.0
    deviation = np.sqrt(power / power.sum()) * rms * period / 2
    rng = np.random.default_rng(seed)
    out = np.empty((count, n_points))
    for k in range(count):
        numbers = rng.standard_normal((2, frequency.size))
        out[k] = np.fft.irfft(deviation * (numbers[0] + 1j * numbers[1]), period)[:n_points]
    return out
