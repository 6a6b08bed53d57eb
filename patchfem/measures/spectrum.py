"""Harmonics and distortion of the last cycles, and readings of instruments.

In: a window of a run under a drive that ends as a sinusoid. Out: Fourier coefficients of motion,
acceleration and friction force, the distortion of the acceleration, and the acceleration that an
instrument indicates. An instrument evaluates the computed motion and does not change the model.
"""

import numpy as np

from ..core import max_abs
from .measures import Values

N_FILTER_HARMONICS = 64  # Number of harmonics of the filtered signal.
N_FILTER_SAMPLES = 1024  # Number of samples per cycle of the filtered signal.
_GAUSS_RULE = np.polynomial.legendre.leggauss(4)
STEP_GAUSS_POINTS = (1 + _GAUSS_RULE[0]) / 2  # Positions of the Gauss points in a step of length 1.
STEP_GAUSS_WEIGHTS = _GAUSS_RULE[1] / 2  # Weights of the Gauss points in a step of length 1.


def compute_motion_harmonic(time, value, rate, omega: float) -> complex:
    """Return the Fourier coefficient of the piecewise cubic motion through samples.

    With four Gauss points per step, the only error of the coefficient is that of the cubic: h^4/384 times
    the fourth derivative.

    Parameters
    ----------
    time : (k,)
        Times [s], at any spacing.
    value, rate : (k,)
        Samples of a motion and of its rate.
    omega : float
        Angular frequency [rad/s].
    """
    step = np.diff(time)
    rise = np.diff(value)
    # The cubic of a step is its chord plus s (1 - s) (a (1 - s) + b s), with the excess slopes a and b of its ends.
    first_excess = rate[:-1] * step - rise
    last_excess = rise - rate[1:] * step
    s = STEP_GAUSS_POINTS[:, None]
    motion = value[:-1] + s * (rise + (1 - s) * ((1 - s) * first_excess + s * last_excess))
    phases = np.exp(-1j * omega * (time[:-1] + s * step))
    return 2 / (time[-1] - time[0]) * np.sum(STEP_GAUSS_WEIGHTS @ (motion * phases) * step)


def differentiate_harmonic(harmonic, values, time, omega: float):
    """Return the Fourier coefficient of the derivative of a motion by integration by parts.

    The derivative may jump, whereas the motion is continuous.

    Parameters
    ----------
    harmonic : complex
        Coefficient of the motion.
    values : (k,)
        Samples of the motion.
    time : (k,)
        Times over whole cycles [s].
    omega : float
        Angular frequency [rad/s].
    """
    first, last = np.exp(-1j * omega * time[[0, -1]])
    change = values[-1] * last - values[0] * first
    return 2 / (time[-1] - time[0]) * change + 1j * omega * harmonic


def compute_acceleration_harmonic(time, value, rate, omega: float):
    """Return the Fourier coefficient [m s-2] of the acceleration from displacement and velocity.

    Parameters
    ----------
    time : (k,)
        Times over whole cycles [s].
    value, rate : (k,)
        Displacements [m] and velocities [m/s].
    omega : float
        Angular frequency [rad/s].
    """
    velocity = differentiate_harmonic(
        compute_motion_harmonic(time, value, rate, omega), value, time, omega
    )
    return differentiate_harmonic(velocity, rate, time, omega)


def compute_absolute_harmonic(window, drive, n: int) -> complex:
    """Return the n-th harmonic [m s-2] of the absolute acceleration at the sensor.

    Parameters
    ----------
    window : Response
        Complete cycles of a drive that ends as a sinusoid.
    drive
        Its last segment is the sinusoid.
    n : int
        Number of the harmonic, from 1.
    """
    segment = [part for part in drive.segments if part.start < window.time[-1]][-1]
    displacement = window.extra.get("sensor", window.output)
    rate = window.extra.get("sensor_rate", window.output_rate)
    harmonic = compute_acceleration_harmonic(window.time, displacement, rate, n * segment.omega)
    if n == 1 and drive.moving:
        # The acceleration a sin(omega (t - start) + phase) of the base is added.
        phase = segment.phase - segment.omega * segment.start
        harmonic -= 1j * segment.amplitude * np.exp(1j * phase)
    return harmonic


def find_acceleration_harmonics(window, drive) -> tuple[float, float]:
    """Return the magnitudes [m s-2] of the first and third harmonic of the absolute acceleration.

    `window` is a `Response` over complete cycles of a drive that ends as a sinusoid.
    """
    first, third = (float(abs(compute_absolute_harmonic(window, drive, n))) for n in (1, 3))
    return first, third


def make_acceleration_measures(first_harmonic: float, third_harmonic: float) -> Values:
    """Return fundamental [m s-2] and distortion [1] of the acceleration as a dict.

    The distortion is None if the output does not move.

    Parameters
    ----------
    first_harmonic, third_harmonic : float
        Magnitudes of the first and the third harmonic [m s-2].
    """
    # Smallest first harmonic [m s-2] of an output that counts as moving.
    is_moving = first_harmonic > 1e-4
    return {
        "absolute_acceleration_fundamental": float(first_harmonic),
        "acceleration_distortion": third_harmonic / first_harmonic if is_moving else None,
    }


def read_instrument(
    window, drive, peak: float, kind: str = "peak", cutoff: float | None = None
) -> float:
    """Return the absolute acceleration [m s-2] that an instrument indicates for a window.

    Parameters
    ----------
    window : Response
        Complete cycles of the drive.
    drive : core.SineDrive
        Amplitude [m s-2] and angular frequency [rad/s].
    peak : float
        Peak acceleration [m s-2].
    kind : str
        "peak": `peak`; "fundamental": |a_1|, the amplitude at the drive frequency; "rms": sqrt(mean
        a^2); "lowpass": largest acceleration after a Butterworth low-pass filter of second order,
        1/(1 + sqrt2 s + s^2) with s = i f/cutoff, for N_FILTER_HARMONICS harmonics.
    cutoff : float, optional
        Cutoff frequency of the filter [Hz].
    """
    if kind == "peak":
        return peak
    if kind == "rms":
        span = window.span
        return float(np.sqrt(np.trapezoid(window.acceleration**2, window.time) / span))
    if kind == "fundamental":
        return abs(compute_absolute_harmonic(window, drive, 1))
    n = np.arange(1, N_FILTER_HARMONICS + 1)
    s = 1j * n * drive.omega / (2 * np.pi * cutoff)
    filtered_harmonics = np.array([compute_absolute_harmonic(window, drive, k) for k in n]) / (
        1 + np.sqrt(2) * s + s**2
    )
    spectrum = np.zeros(N_FILTER_SAMPLES // 2 + 1, complex)
    spectrum[1 : N_FILTER_HARMONICS + 1] = filtered_harmonics * N_FILTER_SAMPLES / 2
    return max_abs(np.fft.irfft(spectrum, N_FILTER_SAMPLES))
