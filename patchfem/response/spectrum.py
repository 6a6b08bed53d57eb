"""Harmonics of the drive in the motion of the last cycles, and the distortion that a gauge sees."""

import numpy as np

ROUND = 1e-12  # of the largest acceleration of the drive
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)


def motion_harmonic(time, value, rate, omega: float) -> complex:
    """First Fourier coefficient 2/T int y exp(-i omega t) dt of the cubics through samples and their rates.

    time: (k,) [s], as uneven as it likes; value, rate: (k,); omega [rad/s]. Four Gauss points a step, so that only the
    cubic is approximate, h^4/384 of the fourth derivative.
    """
    step, rise = np.diff(time), np.diff(value)
    p, q = rate[:-1] * step, rate[1:] * step
    mid, big, total = 3 * rise - 2 * p - q, p + q - 2 * rise, 0j
    for s, weight in zip((1 + POINTS) / 2, WEIGHTS / 2):
        y = value[:-1] + s * (p + s * (mid + s * big))
        total += np.sum(weight * step * y * np.exp(-1j * omega * (time[:-1] + s * step)))
    return complex(2 / (time[-1] - time[0]) * total)


def acceleration_harmonic(time, value, rate, omega: float) -> complex:
    """First Fourier coefficient of y'' [m s-2] from samples of y and y', by parts over whole cycles.

    The acceleration of a rubbing rig jumps, its motion does not, so nothing is lost at a jump. Arguments as
    `motion_harmonic`.
    """
    span, wave = time[-1] - time[0], np.exp(-1j * omega * time[[0, -1]])
    border = (rate[-1] + 1j * omega * value[-1]) * wave[1] - (rate[0] + 1j * omega * value[0]) * wave[0]
    return complex(2 / span * border - omega**2 * motion_harmonic(time, value, rate, omega))


def distortion(window, drive) -> float | None:
    """Third over first harmonic of the absolute acceleration at the output [1]; None for no acceleration at all.

    window: Response over whole cycles of a drive that ends as a sine.
    """
    last = [part for part in drive.segments if part.start < window.time[-1]][-1]
    first, third = (acceleration_harmonic(window.time, window.output, window.output_rate, n * last.omega)
                    for n in (1, 3))
    if drive.moving:  # the base: a sin(omega (t - start) + phase) has -i a exp(i (phase - omega start))
        first += -1j * last.amplitude * np.exp(1j * (last.phase - last.omega * last.start))
    return float(abs(third) / abs(first)) if abs(first) > 0 else None


def distorted(first, third, size):
    """Third over first harmonic of an acceleration (3.4); NaN where the first is round-off beside the drive's `size`.

    first, third: sizes of the harmonics [m s-2]; all of them numbers or (n,).
    """
    there = np.asarray(first) > ROUND * size
    return np.where(there, third / np.where(there, first, 1.0), np.nan)[()]


def friction_harmonic(window, modes, drive) -> complex:
    """First Fourier coefficient [N] of the friction of the one interface, from the balance of every coordinate.

    F1 = m sum_i s_i r_i / sum_i s_i^2 with r = -base a1 - (z'')1 - D (z')1 - omega^2 z1 (3.4) and slide s. It holds
    what acts within a step as a whole, the blow that ends a slide too. window: Response over whole cycles of a drive
    that ends as a sine, without forces beside drive and friction.
    """
    last = [part for part in drive.segments if part.start < window.time[-1]][-1]
    time, omega = window.time, last.omega
    wave = np.exp(-1j * omega * time[[0, -1]])
    first = np.array([motion_harmonic(time, z, v, omega) for z, v in zip(window.modal.T, window.modal_rate.T)])
    ends = 2 / (time[-1] - time[0]) * (window.modal[-1] * wave[1] - window.modal[0] * wave[0])
    rates = ends + 1j * omega * first
    gains = np.array([acceleration_harmonic(time, z, v, omega) for z, v in zip(window.modal.T, window.modal_rate.T)])
    push = -1j * last.amplitude * np.exp(1j * (last.phase - omega * last.start))
    rest = -modes.base * push - gains - modes.dampers @ rates - modes.omega**2 * first
    return complex(modes.mass * (modes.slide @ rest) / (modes.slide @ modes.slide))
