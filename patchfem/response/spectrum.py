"""Harmonics and distortion of the last cycles, and readings of instruments.

In: a window of a run under a drive that ends as a sinusoid. Out: Fourier coefficients of motion,
acceleration and friction force, the distortion of the acceleration, and the acceleration that an
instrument indicates. An instrument evaluates the computed motion and does not change the model.
"""

import numpy as np

MIN_HARMONIC = 1e-4  # Smallest first harmonic [m s-2] of an output that counts as moving.
READINGS = ("peak", "fundamental", "rms", "lowpass")
N_FILTER_HARMONICS = 64  # Number of harmonics of the filtered signal.
N_FILTER_SAMPLES = 1024  # Number of samples per cycle of the filtered signal.
_GAUSS_RULE = np.polynomial.legendre.leggauss(4)
GAUSS_POINTS = (1 + _GAUSS_RULE[0]) / 2  # Positions of the Gauss points in a step of length 1.
GAUSS_WEIGHTS = _GAUSS_RULE[1] / 2  # Weights of the Gauss points in a step of length 1.


def harmonic_weights(time, omega: float) -> tuple:
    """Return the weights of values and rates in a Fourier coefficient of a piecewise cubic motion.

    With four Gauss points per step, the only error of the coefficient is that of the cubic: h^4/384 times
    the fourth derivative. Several motions use the same weights, whose computation takes most of the time.

    Parameters
    ----------
    time : (k,)
        Times of the samples [s], at any spacing.
    omega : float
        Angular frequency [rad/s].

    Returns
    -------
    tuple
        Weights of the values [1] and of the rates [s], (k,) each.
    """
    step = np.diff(time)
    uniform = step.size and np.ptp(step) <= 1e-15 * abs(time[-1])
    # for equal steps, the phase factors of the Gauss points are the same in each step
    length = step.mean(keepdims=True) if uniform else step
    s = GAUSS_POINTS[:, None]
    gauss = GAUSS_WEIGHTS[:, None] * np.exp(-1j * omega * s * length)
    phases = 2 / (time[-1] - time[0]) * step * np.exp(-1j * omega * time[:-1])
    value_weights = np.zeros(len(time), complex)
    value_weights[:-1] = (gauss * (1 - 3 * s**2 + 2 * s**3)).sum(axis=0) * phases
    value_weights[1:] += (gauss * (3 * s**2 - 2 * s**3)).sum(axis=0) * phases
    rate_weights = np.zeros(len(time), complex)
    rate_weights[:-1] = (gauss * (s - 2 * s**2 + s**3)).sum(axis=0) * step * phases
    rate_weights[1:] += (gauss * (s**3 - s**2)).sum(axis=0) * step * phases
    return value_weights, rate_weights


def motion_harmonic(time, value, rate, omega: float, weights: tuple | None = None) -> complex:
    """Return a Fourier coefficient of the piecewise cubic motion through samples.

    Parameters
    ----------
    time : (k,)
        Times [s], at any spacing.
    value, rate : (k,)
        Samples of the motion and its rate.
    omega : float
        Angular frequency [rad/s].
    weights : tuple, optional
        `harmonic_weights` of the same times and frequency.
    """
    value_weights, rate_weights = weights or harmonic_weights(time, omega)
    return complex(value_weights @ value + rate_weights @ rate)


def acceleration_harmonic(time, value, rate, omega: float) -> complex:
    """Return a Fourier coefficient [m s-2] of the acceleration from displacement and velocity.

    Integration by parts is used: the acceleration jumps due to friction, whereas displacement and velocity
    are continuous.

    Parameters
    ----------
    time, value, rate : (k,)
        Samples over whole cycles [s], [m], [m/s].
    omega : float
        Angular frequency [rad/s].
    """
    return _convert_to_acceleration(
        time, value, rate, omega, motion_harmonic(time, value, rate, omega)
    )


def _convert_to_acceleration(
    time, value, rate, omega: float, displacement_harmonic: complex
) -> complex:
    """Convert a Fourier coefficient of the displacement to that of the acceleration."""
    span = time[-1] - time[0]
    phase_factors = np.exp(-1j * omega * time[[0, -1]])
    boundary_term = (rate[-1] + 1j * omega * value[-1]) * phase_factors[1] - (
        rate[0] + 1j * omega * value[0]
    ) * phase_factors[0]
    return complex(2 / span * boundary_term - omega**2 * displacement_harmonic)


def odd_harmonics(window, drive) -> tuple:
    """Return the magnitudes [m s-2] of the first and third harmonic of the absolute acceleration.

    window: Response over complete cycles of a drive that ends as a sinusoid.
    """
    segment = [part for part in drive.segments if part.start < window.time[-1]][-1]
    motion = (window.time, window.output, window.output_rate)
    first = acceleration_harmonic(*motion, segment.omega)
    third = acceleration_harmonic(*motion, 3 * segment.omega)
    # the Fourier coefficient of a sin(omega (t - start) + phase) is -i a exp(i (phase - omega start))
    if drive.moving:
        first += (
            -1j * segment.amplitude * np.exp(1j * (segment.phase - segment.omega * segment.start))
        )
    return float(abs(first)), float(abs(third))


def harmonic_measures(first_harmonic: float, third_harmonic: float) -> dict:
    """Return fundamental [m s-2] and distortion [1] of the acceleration as a dict.

    The distortion is None if the output does not move.

    Parameters
    ----------
    first_harmonic, third_harmonic : float
        Magnitudes of the first and the third harmonic [m s-2].
    """
    is_moving = first_harmonic > MIN_HARMONIC
    return {
        "absolute_acceleration_fundamental": float(first_harmonic),
        "acceleration_distortion": third_harmonic / first_harmonic if is_moving else None,
    }


def friction_harmonic(window, modes, drive) -> complex:
    """Return the Fourier coefficient [N] of the friction force from the equations of motion.

    With equation 3.4, F1 = m sum_i s_i r_i / sum_i s_i^2, where r = -base a1 - (z'')1 - D (z')1 -
    omega^2 z1 and s_i is the participation factor of mode i for the relative displacement. The
    result includes impulses within a step, e.g. at the end of slip.

    Parameters
    ----------
    window : Response
        Complete cycles of a drive that ends as a sinusoid, without forces other than drive and friction.
    modes
        Modal basis with one interface.
    drive
    """
    segment = [part for part in drive.segments if part.start < window.time[-1]][-1]
    time = window.time
    omega = segment.omega
    weights = harmonic_weights(time, omega)
    motions = list(zip(window.modal.T, window.modal_rate.T))
    phase_factors = np.exp(-1j * omega * time[[0, -1]])
    displacement_harmonics = np.array(
        [motion_harmonic(time, z, v, omega, weights) for z, v in motions]
    )
    end_changes = (
        2
        / (time[-1] - time[0])
        * (window.modal[-1] * phase_factors[1] - window.modal[0] * phase_factors[0])
    )
    velocity_harmonics = end_changes + 1j * omega * displacement_harmonics
    acceleration_harmonics = np.array(
        [
            _convert_to_acceleration(time, z, v, omega, harmonic)
            for (z, v), harmonic in zip(motions, displacement_harmonics)
        ]
    )
    drive_harmonic = -1j * segment.amplitude * np.exp(1j * (segment.phase - omega * segment.start))
    residual = (
        -modes.base * drive_harmonic
        - acceleration_harmonics
        - modes.damping_matrix @ velocity_harmonics
        - modes.omega**2 * displacement_harmonics
    )
    return complex(modes.mass * (modes.slide @ residual) / (modes.slide @ modes.slide))


def read_instrument(
    window, drive, peak: float, kind: str = "peak", cutoff: float | None = None
) -> float:
    """Return the absolute acceleration [m s-2] that an instrument indicates for a window.

    Parameters
    ----------
    window : Response
        Complete cycles of the drive.
    drive : core.SineDrive
    peak : float
        Peak acceleration [m s-2].
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
        squared = window.acceleration**2
        return float(
            np.sqrt(
                np.sum(step * (squared[1:] + squared[:-1]) / 2) / (window.time[-1] - window.time[0])
            )
        )
    if kind == "fundamental":
        return abs(_acceleration_harmonic_n(window, drive, 1))
    if kind != "lowpass":
        raise ValueError(f"reading '{kind}' is not possible; use one of {', '.join(READINGS)}")
    n = np.arange(1, N_FILTER_HARMONICS + 1)
    s = 1j * n * drive.omega / (2 * np.pi * cutoff)
    filtered_harmonics = np.array([_acceleration_harmonic_n(window, drive, k) for k in n]) / (
        1 + np.sqrt(2) * s + s**2
    )
    spectrum = np.zeros(N_FILTER_SAMPLES // 2 + 1, complex)
    spectrum[1 : N_FILTER_HARMONICS + 1] = filtered_harmonics * N_FILTER_SAMPLES / 2
    return float(np.abs(np.fft.irfft(spectrum, N_FILTER_SAMPLES)).max())


def _acceleration_harmonic_n(window, drive, n: int) -> complex:
    """Return the complex n-th harmonic [m s-2] of the absolute acceleration at the sensor.

    Integration by parts avoids an error due to jumps of the acceleration.
    """
    displacement = window.extra.get("sensor", window.output)
    rate = window.extra.get("sensor_rate", window.output_rate)
    harmonic = acceleration_harmonic(window.time, displacement, rate, n * drive.omega)
    return harmonic - 1j * drive.acceleration if n == 1 and drive.moving else harmonic
