"""Measures under a stationary random drive: root mean squares, spectra, frequency response.

In: the window of a run and its drive. Out: measures by name, each with its statistical scatter
(half-width of the 95 % interval by Student's t).

Spectra are averaged over half-overlapping segments of 1/16 of the record with a Hann window (Welch,
1967). The expected value of the estimate H1 = G_ax/G_aa is the Fourier transform of the impulse response
h(t) times the autocorrelation r(t) of the window (Bendat and Piersol, Random Data, ch. 9 and 11). The
transform of h r for a single mode is fitted to the largest peak, so that the window does not increase the
damping. The scatter of a mean square follows from parts of the record, that of the fit from the
jackknife.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import least_squares
from scipy.special import stdtrit

from ..core import max_abs
from .measures import Measures, Values
from .welch import CrossDensities, Segments, average_segments, transform_segments

SEGMENTS_PER_RECORD = 16  # Ratio of the record length to the segment length.
# Number of parts of the record for the estimate of the scatter; in the jackknife, groups of segments.
N_RECORD_PARTS = 10
# Half-width of the band in which a peak is fitted, in half-power widths and in spectral lines.
FIT_BAND_HALF_WIDTHS = 6.0, 8.0
# Smallest record length in decay times of the mode; parts of a shorter record are correlated.
MIN_RECORD_DECAY_TIMES = 50.0
MIN_SEGMENT_SAMPLES = 64  # Smallest number of samples of a segment.


class StationaryRecord(NamedTuple):
    """Equally spaced samples of drive and output under a random drive.

    - step: time step [s].
    - drive (k,): acceleration of the drive [m s-2].
    - displacement (k,): displacement of the output [m].
    - acceleration (k,): acceleration of the output [m s-2].
    """

    step: float
    drive: np.ndarray
    displacement: np.ndarray
    acceleration: np.ndarray


class Spectra(NamedTuple):
    """One-sided spectral densities over frequency, and the frequency response.

    - frequency (q,): [Hz].
    - drive, acceleration (q,): spectral densities of the drive and of the acceleration of the
      output [m2 s-3].
    - displacement (q,): spectral density of the displacement of the output [m2 Hz-1].
    - gain (q,): complex H1 estimate of displacement over drive [s2].
    - coherence (q,): coherence of displacement and drive [1].
    """

    frequency: np.ndarray
    drive: np.ndarray
    displacement: np.ndarray
    acceleration: np.ndarray
    gain: np.ndarray
    coherence: np.ndarray


def make_record(window, drive) -> StationaryRecord:
    """Return equally spaced samples of drive and output in a window.

    The displacement is interpolated by cubics through positions and rates.
    """
    is_new = np.append(True, np.diff(window.time) > 1e-9 * drive.time[1])
    time = window.time[is_new]
    step = float(drive.time[1])
    grid = time[0] + step * np.arange(int((time[-1] - time[0]) / step * (1 + 1e-12)))
    displacement = CubicHermiteSpline(time, window.output[is_new], window.output_rate[is_new])(grid)
    return StationaryRecord(
        step, drive.values(grid), displacement, np.interp(grid, time, window.acceleration[is_new])
    )


def random_response_measures(window, drive, *, has_friction: bool = False) -> Values:
    """Return the measures of the response to a stationary random drive, by name.

    Parameters
    ----------
    window : Response
        Record without its initial transient.
    drive
        Random drive with its `band` [Hz].
    has_friction : bool
        Whether the power of friction is one of the measures.
    """
    record = make_record(window, drive)
    measures = {}
    for name, values, samples in (
        ("relative_displacement_rms", window.output, record.displacement),
        ("absolute_acceleration_rms", window.acceleration, record.acceleration),
    ):
        measures[name] = compute_rms(window.time, values)
        measures[f"{name}_scatter"] = estimate_rms_scatter(samples)
    fit = fit_peak(record, drive.band)
    if fit is not None:
        for name, value, scatter in zip(("response_frequency", "response_damping"), *fit):
            measures |= {name: value, f"{name}_scatter": scatter}
    if has_friction and "ledger" in window.extra:
        measures["friction_power"], measures["friction_power_scatter"] = compute_mean_power(
            window.time, window.extra["ledger"][0]
        )
    return {name: float(value) for name, value in measures.items() if np.isfinite(value)}


def warn_if_short(measures: Measures, window) -> list[str]:
    """Return a list with a warning if the record is short relative to the decay time of the mode.

    Parameters
    ----------
    measures : dict
        Measure by name.
    window : Response
        Record without its initial transient.
    """
    names = "response_frequency", "response_damping"
    if any(name not in measures or not measures[name].value for name in names):
        return []
    frequency, zeta = (measures[name].value for name in names)
    span = window.span
    decay = 1 / (2 * np.pi * frequency * zeta)
    if span >= MIN_RECORD_DECAY_TIMES * decay:
        return []
    return [
        f"the response lasts only {span / decay:.2g} decay times of the mode at {frequency:.4g} Hz, too short for a "
        f"reliable scatter between random drives; set drive.duration = '{1.5 * MIN_RECORD_DECAY_TIMES * decay:.2g} s'"
    ]


def compute_rms(time, values) -> float:
    """Return the root mean square about the mean of samples (k,) at times (k,) [s].

    The trapezoidal rule is used.
    """
    span = time[-1] - time[0]
    mean = np.trapezoid(values, time) / span
    return float(np.sqrt(np.trapezoid((values - mean) ** 2, time) / span))


def estimate_rms_scatter(values) -> float:
    """Return the confidence half-width of the root mean square of equally spaced samples.

    The interval follows from the mean squares of N_RECORD_PARTS parts. It is computed for the logarithm of the
    mean square, because the distribution is skewed for few oscillations; its upper half is returned.
    """
    if values.size < N_RECORD_PARTS:
        return np.nan
    square = (values - values.mean()) ** 2
    parts = (
        square[: square.size // N_RECORD_PARTS * N_RECORD_PARTS]
        .reshape(N_RECORD_PARTS, -1)
        .mean(axis=1)
    )
    mean = square.mean()
    if not mean > 0:
        return 0.0
    return float(np.sqrt(mean) * np.expm1(_find_confidence_half_width(parts) / mean / 2))


def compute_mean_power(time, work) -> tuple[float, float]:
    """Return the mean power [W] and its confidence half-width [W] from the cumulative work.

    The half-width comes from the means over N_RECORD_PARTS parts of equal length.

    Parameters
    ----------
    time : (k,)
        Times [s].
    work : (k,)
        Work done since the start [J].
    """
    edges = np.linspace(time[0], time[-1], N_RECORD_PARTS + 1)
    parts = np.diff(np.interp(edges, time, work)) / np.diff(edges)
    return parts.mean(), _find_confidence_half_width(parts)


def _find_confidence_half_width(parts) -> float:
    """Return the half-width of the 95 % interval of the mean of N_RECORD_PARTS independent values, by Student's t."""
    return stdtrit(N_RECORD_PARTS - 1, 0.975) * parts.std(ddof=1) / np.sqrt(N_RECORD_PARTS)


def is_stationary(window, drive) -> bool:
    """Return whether the displacement scatters equally in both halves of a window.

    The standard deviations of both halves may differ by up to 4 standard errors of their difference.

    Parameters
    ----------
    window : Response
        Record without its initial transient.
    drive
        Random drive, whose time step is that of the samples.
    """
    displacement = make_record(window, drive).displacement
    half = displacement.size // 2
    first = displacement[:half]
    last = displacement[half:]
    # `estimate_rms_scatter` returns about 2 standard errors, so that 4 standard errors are accepted.
    return bool(
        abs(first.std() - last.std())
        <= 2 * np.hypot(estimate_rms_scatter(first), estimate_rms_scatter(last))
    )


def transform_record(record: StationaryRecord) -> Segments:
    """Return the Fourier transforms of drive, displacement and acceleration of a record, in overlapping segments."""
    size = max(
        min(MIN_SEGMENT_SAMPLES, record.displacement.size),
        2 * (record.displacement.size // (2 * SEGMENTS_PER_RECORD)),
    )
    return transform_segments(record.step, record[1:], size)


def compute_spectra(window, drive) -> Spectra:
    """Compute the spectral densities of a window under a random drive, up to twice the highest frequency of the drive."""
    frequency, (inputs, outputs, acceleration_transforms) = transform_record(
        make_record(window, drive)
    )
    low, high = drive.band
    in_range = (frequency > 0) & (frequency <= 2 * high)
    densities = CrossDensities(
        *(density[in_range] for density in average_segments(inputs, outputs))
    )
    acceleration_density = average_segments(inputs, acceleration_transforms).output[in_range]
    frequency = frequency[in_range]
    in_band = (frequency >= low) & (frequency <= high)
    gain = np.where(in_band, densities.cross / np.where(in_band, densities.input, np.inf), np.nan)
    coherence = np.where(in_band, densities.coherence(), np.nan)
    return Spectra(
        frequency, densities.input, densities.output, acceleration_density, gain, coherence
    )


def fit_peak(record: StationaryRecord, band: tuple[float, float]) -> tuple | None:
    """Fit natural frequency [Hz] and damping ratio to the largest peak of H1, with half-widths.

    Parameters
    ----------
    record : StationaryRecord
        Equally spaced samples of drive and output.
    band : tuple
        Lowest and highest frequency of the drive [Hz].

    Returns
    -------
    tuple or None
        (frequency, damping ratio), and the half-widths of both. None without a peak, i.e. if the maximum
        lies at an end of the band, if no mode fits, or if the record is too short.
    """
    if record.displacement.size < 2 * MIN_SEGMENT_SAMPLES:
        return None

    # A Hann window mixes lines within a distance of two, so that the ends of the band are left out.
    frequency, (drive_transforms, displacement_transforms, _) = transform_record(record)
    line = frequency[1]
    span = 1 / line
    inside = np.flatnonzero((frequency >= band[0] + 2 * line) & (frequency <= band[1] - 2 * line))
    if inside.size < 5 or len(drive_transforms) < N_RECORD_PARTS:
        return None

    # H1 = G_ax/G_aa, averaged over the segments.
    drive_powers = (np.abs(drive_transforms) ** 2)[:, inside]
    cross = (drive_transforms.conj() * displacement_transforms)[:, inside]
    f = frequency[inside]
    gain = cross.sum(axis=0) / drive_powers.sum(axis=0)
    peak = int(np.argmax(np.abs(gain)))
    if peak in (0, f.size - 1) or not np.abs(gain[peak]) > 0:
        return None

    # The initial damping follows from the half-power width 2 zeta f.
    is_low = np.abs(gain) < np.abs(gain[peak]) / np.sqrt(2)
    n_left = np.argmax(np.append(is_low[peak::-1], True))
    n_right = np.argmax(np.append(is_low[peak:], True))
    width = line * float(n_left + n_right)
    theta = np.log([2 * np.pi * f[peak], max(0.3 * width, 0.05 * line) / (2 * f[peak])])

    for _ in range(3):  # the fitted band is adapted to the width of the peak
        frequency_fit = np.exp(theta[0]) / (2 * np.pi)
        half_width = np.exp(theta.sum()) / (2 * np.pi)
        in_fit_band = np.abs(f - frequency_fit) <= max(
            FIT_BAND_HALF_WIDTHS[0] * half_width, FIT_BAND_HALF_WIDTHS[1] * line
        )
        theta = _fit_mode(f[in_fit_band], gain[in_fit_band], span, theta)
    if (
        in_fit_band.sum() < 5
        or not abs(f[peak] - np.exp(theta[0]) / (2 * np.pi)) < max(width, 2 * line)
        or theta[1] > 0
    ):
        return None

    # Jackknife: the fit is repeated without each group, and var = (g - 1)/g sum (theta_i - mean)^2.
    group_of_segment = np.arange(len(drive_transforms)) * N_RECORD_PARTS // len(drive_transforms)
    estimates = []
    for group in range(N_RECORD_PARTS):
        is_used = group_of_segment != group
        partial_gain = cross[is_used][:, in_fit_band].sum(axis=0) / drive_powers[is_used][
            :, in_fit_band
        ].sum(axis=0)
        estimates.append(np.exp(_fit_mode(f[in_fit_band], partial_gain, span, theta)))

    scale = np.array([1 / (2 * np.pi), 1.0])
    half_widths = np.sqrt((N_RECORD_PARTS - 1) * np.var(estimates, axis=0)) * stdtrit(
        N_RECORD_PARTS - 1, 0.975
    )
    return np.exp(theta) * scale, half_widths * scale


def _fit_mode(f, gain, span: float, theta) -> np.ndarray:
    """Fit the logarithms of natural frequency and damping ratio of one mode to H1.

    A complex constant represents the other modes.

    Parameters
    ----------
    f, gain : (q,)
        Frequencies [Hz] and H1 [s2].
    span : float
        Duration of a segment [s].
    theta : (2,)
        Initial guess.
    """
    target = np.concatenate([gain.real, gain.imag]) / max_abs(gain)
    constants = np.repeat(np.eye(2), f.size, axis=0)

    def compute_residual(theta):
        """Return the residual of a single mode with the logarithms `theta` of frequency and damping, relative to H1.

        The amplitude of the mode and a constant are those of least squares.
        """
        response = compute_expected_response(f, *np.exp(theta), span)
        basis, _ = np.linalg.qr(
            np.column_stack([np.concatenate([response.real, response.imag]), constants])
        )
        return basis @ (basis.T @ target) - target

    max_change = np.array([0.5, 7.0])
    bounds = theta - max_change, theta + max_change
    return least_squares(compute_residual, theta, bounds=bounds, xtol=1e-10, ftol=1e-10).x


def compute_expected_response(f, omega: float, zeta: float, span: float) -> np.ndarray:
    """Return the expected H1 estimate [s2] of a mode from Hann-windowed segments, in closed form.

    The result is int_0^span h(t) r(t) exp(-2 pi i f t) dt, where h is the impulse response of
    x'' + 2 zeta omega x' + omega^2 x = a, and r is the autocorrelation of the window.

    Parameters
    ----------
    f : (q,)
        Frequencies [Hz].
    omega, zeta : float
        Natural angular frequency [rad/s] and damping ratio.
    span : float
        Duration of a segment [s].
    """
    damped_omega = omega * np.sqrt(complex(1 - zeta * zeta))
    line_step = 2j * np.pi / span
    response = 0.0
    for pole, sign in (
        (-zeta * omega + 1j * damped_omega, 1),
        (-zeta * omega - 1j * damped_omega, -1),
    ):
        q = pole - 2j * np.pi * f
        # exp(s span) is the same at s = q and s = q +- turn, because exp(turn span) = 1
        late = np.exp(q * span) - 1
        ramp = sum(
            weight * (late / s - span) / (s * span)
            for weight, s in ((2 / 3, q), (1 / 6, q + line_step), (1 / 6, q - line_step))
        )
        response = response + sign * (
            ramp + late * (1 / (q + line_step) - 1 / (q - line_step)) / (4j * np.pi)
        )
    return response / (2j * damped_omega)
