"""Harmonics of the motion of the last cycles, distortion, and instrument readings.

In: a window of a run under a drive that ends as a sinusoid. Out: Fourier coefficients of motion,
acceleration and friction; the distortion of the acceleration; and its reading by an instrument,
which acts on the computed motion and never on the model.
"""

import numpy as np

ACCELERATION_ROUND_OFF = 1e-12  # Round-off error relative to the largest acceleration of the drive.
MIN_HARMONIC = 1e-4  # Smallest first harmonic [m s-2]; below it the output is at rest.
READINGS = ("peak", "fundamental", "rms", "lowpass")
N_FILTER_HARMONICS = 64  # Number of harmonics that pass through the low-pass filter.
N_FILTER_SAMPLES = 1024  # Number of samples of a cycle after the filter.
_GAUSS_RULE = np.polynomial.legendre.leggauss(4)
GAUSS_POINTS = (1 + _GAUSS_RULE[0]) / 2  # Positions of the Gauss points in a step of length 1.
GAUSS_WEIGHTS = _GAUSS_RULE[1] / 2  # Weights of the Gauss points in a step of length 1.


def harmonic_weights(time, omega: float) -> list:
    """Return the Fourier weights of a motion at the Gauss points of its steps.

    `motion_harmonic` spends most of its time on them, so that several motions share them.

    Parameters
    ----------
    time : (k,)
        Times of the samples [s].
    omega : float
        Angular frequency [rad/s].

    Returns
    -------
    list
        Weights (k - 1,) [s] and waves exp(-i omega t) (k - 1,) of each of four Gauss points.
    """
    step = np.diff(time)
    waves = np.exp(-1j * omega * time[:-1])
    # At equal steps, one wave times a constant phase serves all four points.
    even = step.size and np.ptp(step) <= 1e-15 * abs(time[-1])
    turns = [np.exp(-1j * omega * s * (step.mean() if even else step)) for s in GAUSS_POINTS]
    return [(weight * step, waves * turn) for turn, weight in zip(turns, GAUSS_WEIGHTS)]


def motion_harmonic(time, value, rate, omega: float, known: list | None = None) -> complex:
    """Return a Fourier coefficient of the piecewise cubic motion through samples.

    Four Gauss points per step are used, so that only the cubic is approximate: h^4/384 of the
    fourth derivative.

    Parameters
    ----------
    time : (k,)
        Times [s], at any spacing.
    value, rate : (k,)
        Samples of y and its rate.
    omega : float
        Angular frequency [rad/s].
    known : list, optional
        `harmonic_weights` of the same times and frequency.
    """
    step = np.diff(time)
    rise = np.diff(value)
    p = rate[:-1] * step
    q = rate[1:] * step
    mid = 3 * rise - 2 * p - q
    big = p + q - 2 * rise
    total = 0j
    for s, (weight, wave) in zip(
        GAUSS_POINTS, harmonic_weights(time, omega) if known is None else known
    ):
        y = value[:-1] + s * (p + s * (mid + s * big))
        total += np.sum(weight * y * wave)
    return complex(2 / (time[-1] - time[0]) * total)


def acceleration_harmonic(time, value, rate, omega: float) -> complex:
    """Return a Fourier coefficient [m s-2] of the acceleration from displacement and velocity.

    The acceleration of a rig with friction jumps, but its motion does not, so that a jump causes no
    error.

    Parameters
    ----------
    time, value, rate : (k,)
        Samples over whole cycles [s], [m], [m/s].
    omega : float
        Angular frequency [rad/s].
    """
    return _integrate_by_parts(time, value, rate, omega, motion_harmonic(time, value, rate, omega))


def _integrate_by_parts(time, value, rate, omega: float, first: complex) -> complex:
    """Return the harmonic of the acceleration from that of the displacement."""
    span = time[-1] - time[0]
    wave = np.exp(-1j * omega * time[[0, -1]])
    border = (rate[-1] + 1j * omega * value[-1]) * wave[1] - (
        rate[0] + 1j * omega * value[0]
    ) * wave[0]
    return complex(2 / span * border - omega**2 * first)


def odd_harmonics(window, drive) -> tuple:
    """Return the magnitudes [m s-2] of the first and third harmonic of the acceleration.

    window: Response over complete cycles of a drive that ends as a sinusoid.
    """
    last = [part for part in drive.segments if part.start < window.time[-1]][-1]
    first, third = (
        acceleration_harmonic(window.time, window.output, window.output_rate, n * last.omega)
        for n in (1, 3)
    )
    # The Fourier coefficient of the base, a sin(omega (t - start) + phase), is -i a exp(i (phase -
    # omega start)).
    if drive.moving:
        first += -1j * last.amplitude * np.exp(1j * (last.phase - last.omega * last.start))
    return float(abs(first)), float(abs(third))


def harmonic_measures(
    first_harmonic: float, third_harmonic: float, drive_acceleration: float = 0.0
) -> dict:
    """Return fundamental [m s-2] and distortion [1] of the acceleration as a dict.

    Parameters
    ----------
    first_harmonic, third_harmonic : float
        Magnitudes of the first and the third harmonic [m s-2].
    drive_acceleration : float
        Acceleration of the drive [m s-2]; the distortion is None if `distortion_ratio` has no value.
    """
    ratio = distortion_ratio(first_harmonic, third_harmonic, drive_acceleration)
    return {
        "absolute_acceleration_fundamental": float(first_harmonic),
        "acceleration_distortion": None if np.isnan(ratio) else float(ratio),
    }


def distortion_ratio(first_harmonic, third_harmonic, drive_acceleration):
    """Return the ratio of the third to the first harmonic of an acceleration.

    It is NaN if the first harmonic is below its floor or the round-off of the drive.

    Parameters
    ----------
    first_harmonic, third_harmonic : float or (n,)
        Magnitudes of the harmonics [m s-2].
    drive_acceleration : float or (n,)
        Acceleration of the drive [m s-2].
    """
    there = np.asarray(first_harmonic) > np.maximum(
        ACCELERATION_ROUND_OFF * np.asarray(drive_acceleration), MIN_HARMONIC
    )
    return np.where(there, third_harmonic / np.where(there, first_harmonic, 1.0), np.nan)[()]


def friction_harmonic(window, modes, drive) -> complex:
    """Return the Fourier coefficient [N] of the friction force from the equation of motion.

    F1 = m sum_i s_i r_i / sum_i s_i^2, where r = -base a1 - (z'')1 - D (z')1 - omega^2 z1 (3.4) and
    s_i is the participation of the slide. It contains impulses within a step, such as the one that
    ends a slip.

    Parameters
    ----------
    window : Response
        Whole cycles of a drive that ends as a sinusoid, with no other forces than drive and friction.
    modes
        Modal basis with one interface.
    drive
    """
    last = [part for part in drive.segments if part.start < window.time[-1]][-1]
    time = window.time
    omega = last.omega
    known = harmonic_weights(time, omega)
    motions = list(zip(window.modal.T, window.modal_rate.T))
    wave = np.exp(-1j * omega * time[[0, -1]])
    first = np.array([motion_harmonic(time, z, v, omega, known) for z, v in motions])
    ends = 2 / (time[-1] - time[0]) * (window.modal[-1] * wave[1] - window.modal[0] * wave[0])
    rates = ends + 1j * omega * first
    gains = np.array(
        [_integrate_by_parts(time, z, v, omega, one) for (z, v), one in zip(motions, first)]
    )
    push = -1j * last.amplitude * np.exp(1j * (last.phase - omega * last.start))
    rest = -modes.base * push - gains - modes.damping_matrix @ rates - modes.omega**2 * first
    return complex(modes.mass * (modes.slide @ rest) / (modes.slide @ modes.slide))


def read_instrument(
    window, drive, peak: float, kind: str = "peak", cutoff: float | None = None
) -> float:
    """Return the absolute acceleration [m s-2] of a window as its sensor measures it.

    Parameters
    ----------
    window : Response
        Whole cycles of the drive.
    drive : core.SineDrive
    peak : float
        Largest acceleration [m s-2].
    kind : str
        "peak": `peak`; "fundamental": |a_1|, the amplitude at the drive frequency; "rms": sqrt(mean
        a^2); "lowpass": largest acceleration after a Butterworth low-pass filter of second order,
        1/(1 + sqrt2 s + s^2) with s = i f/cutoff, for N_FILTER_HARMONICS harmonics.
    cutoff : float, optional
        Cutoff frequency of the filter [Hz].

    Raises
    ------
    ValueError
        If the kind is not in READINGS.
    """
    if kind == "peak":
        return peak
    if kind == "rms":
        step = np.diff(window.time)
        square = window.acceleration**2
        return float(
            np.sqrt(
                np.sum(step * (square[1:] + square[:-1]) / 2) / (window.time[-1] - window.time[0])
            )
        )
    if kind == "fundamental":
        return abs(_acceleration_harmonic_n(window, drive, 1))
    if kind != "lowpass":
        raise ValueError(f"reading '{kind}' is not possible; use one of {', '.join(READINGS)}")
    n = np.arange(1, N_FILTER_HARMONICS + 1)
    s = 1j * n * drive.omega / (2 * np.pi * cutoff)
    passed = np.array([_acceleration_harmonic_n(window, drive, k) for k in n]) / (
        1 + np.sqrt(2) * s + s**2
    )
    spectrum = np.zeros(N_FILTER_SAMPLES // 2 + 1, complex)
    spectrum[1 : N_FILTER_HARMONICS + 1] = passed * N_FILTER_SAMPLES / 2
    return float(np.abs(np.fft.irfft(spectrum, N_FILTER_SAMPLES)).max())


def _acceleration_harmonic_n(window, drive, n: int) -> complex:
    """Return the complex n-th harmonic [m s-2] of the absolute acceleration.

    Integration by parts is used, so that a jump of the acceleration causes no error.
    """
    place, rate = (
        window.extra.get(name, own)
        for name, own in (("sensor", window.output), ("sensor_rate", window.output_rate))
    )
    found = acceleration_harmonic(window.time, place, rate, n * drive.omega)
    return found - 1j * drive.acceleration if n == 1 and drive.moving else found
