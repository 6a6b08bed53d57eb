"""Harmonics of the drive in the motion of the last cycles, the distortion that a gauge sees, and what an accelerometer
shows: a reading acts on what was computed and never on the model."""

import numpy as np

ROUND = 1e-12  # of the largest acceleration of the drive
FLOOR = 1e-4  # of a first harmonic [m s-2], below which the output stands still
READINGS = ("peak", "fundamental", "rms", "lowpass")
HARMONICS = 64  # that a low pass is taken of
SAMPLES = 1024  # of a cycle behind it
PLACES, WEIGHTS = np.polynomial.legendre.leggauss(4)
PLACES, WEIGHTS = (1 + PLACES) / 2, WEIGHTS / 2  # of a step


def waves(time, omega: float) -> list:
    """What `motion_harmonic` weighs the motion with at the Gauss points of the steps between samples (k,) [s]: weights
    (k - 1,) [s] and waves exp(-i omega t) (k - 1,), which take most of its time; omega [rad/s]."""
    step = np.diff(time)
    waves = np.exp(-1j * omega * time[:-1])
    # one wave, turned, serves all four points
    even = step.size and np.ptp(step) <= 1e-15 * abs(time[-1])
    turns = [np.exp(-1j * omega * s * (step.mean() if even else step)) for s in PLACES]
    return [(weight * step, waves * turn) for turn, weight in zip(turns, WEIGHTS)]


def motion_harmonic(time, value, rate, omega: float, known: list | None = None) -> complex:
    """First Fourier coefficient 2/T int y exp(-i omega t) dt of the cubics through samples and their rates.

    time: (k,) [s], as uneven as it likes; value, rate: (k,); omega [rad/s]. Four Gauss points a step, so that only the
    cubic is approximate, h^4/384 of the fourth derivative. known: the `waves` of these arguments.
    """
    step, rise = np.diff(time), np.diff(value)
    p, q = rate[:-1] * step, rate[1:] * step
    mid, big, total = 3 * rise - 2 * p - q, p + q - 2 * rise, 0j
    for s, (weight, wave) in zip(PLACES, waves(time, omega) if known is None else known):
        y = value[:-1] + s * (p + s * (mid + s * big))
        total += np.sum(weight * y * wave)
    return complex(2 / (time[-1] - time[0]) * total)


def acceleration_harmonic(time, value, rate, omega: float) -> complex:
    """First Fourier coefficient of y'' [m s-2] from samples of y and y', by parts over whole cycles.

    The acceleration of a rubbing rig jumps, its motion does not, so nothing is lost at a jump. Arguments as
    `motion_harmonic`.
    """
    return _by_parts(time, value, rate, omega, motion_harmonic(time, value, rate, omega))


def _by_parts(time, value, rate, omega: float, first: complex) -> complex:
    """`acceleration_harmonic` of a motion with this first Fourier coefficient."""
    span, wave = time[-1] - time[0], np.exp(-1j * omega * time[[0, -1]])
    border = (rate[-1] + 1j * omega * value[-1]) * wave[1] - (
        rate[0] + 1j * omega * value[0]
    ) * wave[0]
    return complex(2 / span * border - omega**2 * first)


def odd_harmonics(window, drive) -> tuple:
    """Sizes [m s-2] of the first and the third harmonic of the absolute acceleration at the output.

    window: Response over whole cycles of a drive that ends as a sine.
    """
    last = [part for part in drive.segments if part.start < window.time[-1]][-1]
    first, third = (
        acceleration_harmonic(window.time, window.output, window.output_rate, n * last.omega)
        for n in (1, 3)
    )
    # the base: a sin(omega (t - start) + phase) has -i a exp(i (phase - omega start))
    if drive.moving:
        first += -1j * last.amplitude * np.exp(1j * (last.phase - last.omega * last.start))
    return float(abs(first)), float(abs(third))


def wave_measures(first: float, third: float, size: float = 0.0) -> dict:
    """absolute_acceleration_fundamental [m s-2] and acceleration_distortion [1] by name, from the sizes of the first
    and the third harmonic; the latter None where `distorted` has no value; size: of the drive [m s-2]."""
    ratio = distorted(first, third, size)
    return {
        "absolute_acceleration_fundamental": float(first),
        "acceleration_distortion": None if np.isnan(ratio) else float(ratio),
    }


def distorted(first, third, size):
    """Third over first harmonic of an acceleration (3.4); NaN where it is a ratio of zeros: the first is 0 within its
    floor, or round-off beside the drive's `size`.

    first, third: sizes of the harmonics [m s-2]; all of them numbers or (n,).
    """
    there = np.asarray(first) > np.maximum(ROUND * np.asarray(size), FLOOR)
    return np.where(there, third / np.where(there, first, 1.0), np.nan)[()]


def friction_harmonic(window, modes, drive) -> complex:
    """First Fourier coefficient [N] of the friction of the one interface, from the balance of every coordinate.

    F1 = m sum_i s_i r_i / sum_i s_i^2 with r = -base a1 - (z'')1 - D (z')1 - omega^2 z1 (3.4) and slide s. It holds
    what acts within a step as a whole, the blow that ends a slide too. window: Response over whole cycles of a drive
    that ends as a sine, without forces beside drive and friction.
    """
    last = [part for part in drive.segments if part.start < window.time[-1]][-1]
    time, omega = window.time, last.omega
    known, motions = waves(time, omega), list(zip(window.modal.T, window.modal_rate.T))
    wave = np.exp(-1j * omega * time[[0, -1]])
    first = np.array([motion_harmonic(time, z, v, omega, known) for z, v in motions])
    ends = 2 / (time[-1] - time[0]) * (window.modal[-1] * wave[1] - window.modal[0] * wave[0])
    rates = ends + 1j * omega * first
    gains = np.array([_by_parts(time, z, v, omega, one) for (z, v), one in zip(motions, first)])
    push = -1j * last.amplitude * np.exp(1j * (last.phase - omega * last.start))
    rest = -modes.base * push - gains - modes.damping_matrix @ rates - modes.omega**2 * first
    return complex(modes.mass * (modes.slide @ rest) / (modes.slide @ modes.slide))


def reading(window, drive, peak: float, kind: str = "peak", cutoff: float | None = None) -> float:
    """Size [m s-2] of the absolute acceleration in a window, as an instrument shows it.

    window: Response over whole cycles of the drive, a core.SineDrive; peak: its largest size [m s-2]. kind: "peak" is
    that; "fundamental" is |a_1|, the amplitude at the drive's frequency; "rms" is sqrt(mean a^2); "lowpass" is the
    largest size behind a Butterworth low pass of second order, 1/(1 + sqrt2 s + s^2) with s = i f/cutoff, of the
    harmonics to HARMONICS; cutoff [Hz]. ValueError for a kind that is none of READINGS.
    """
    if kind == "peak":
        return peak
    if kind == "rms":
        step, square = np.diff(window.time), window.acceleration**2
        return float(
            np.sqrt(
                np.sum(step * (square[1:] + square[:-1]) / 2) / (window.time[-1] - window.time[0])
            )
        )
    if kind == "fundamental":
        return abs(_harmonic(window, drive, 1))
    if kind != "lowpass":
        raise ValueError(f"reading '{kind}' is not possible; use one of {', '.join(READINGS)}")
    n = np.arange(1, HARMONICS + 1)
    s = 1j * n * drive.omega / (2 * np.pi * cutoff)
    passed = np.array([_harmonic(window, drive, k) for k in n]) / (1 + np.sqrt(2) * s + s**2)
    spectrum = np.zeros(SAMPLES // 2 + 1, complex)
    spectrum[1 : HARMONICS + 1] = passed * SAMPLES / 2
    return float(np.abs(np.fft.irfft(spectrum, SAMPLES)).max())


def _harmonic(window, drive, n: int) -> complex:
    """Complex harmonic n [m s-2] of the absolute acceleration, from the motion by parts: nothing is lost at a jump."""
    place, rate = (
        window.extra.get(name, own)
        for name, own in (("sensor", window.output), ("sensor_rate", window.output_rate))
    )
    found = acceleration_harmonic(window.time, place, rate, n * drive.omega)
    return found - 1j * drive.acceleration if n == 1 and drive.moving else found
