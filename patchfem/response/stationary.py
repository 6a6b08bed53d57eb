"""Measures under a stationary random drive: root mean squares, spectra, frequency response.

In: the window of a run and its drive. Out: measures by name, each with its scatter between
records (half-width of the 95 % interval by Student's t).

Segments of 1/16 of the record overlap by half and have Hann's window (Welch, 1967). The
expected value of their H1 = G_ax/G_aa is the transform of the response h(t) times the
correlation r(t) of the window (Bendat and Piersol, Random Data, ch. 9 and 11). Therefore h r of
a mode is fitted to the largest peak, so that the window does not widen it. The scatter of a
mean square is estimated from parts of the record, that of the fit by leaving out parts
(jackknife).
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import least_squares
from scipy.special import stdtrit

from .welch import CrossDensities, Segments, average_segments, transform_segments

SEGMENTS_PER_RECORD = 16  # Ratio of the record length to the segment length.
# Number of parts of the record from which the scatter is estimated; they are groups of segments,
# each left out once.
N_GROUPS = 10
FIT_BAND = 6.0, 8.0  # Half-width of the band of a fit, in half-power widths and in spectral lines.
# Smallest length of a record in decay times of the mode; the parts of a shorter one are correlated.
MIN_DECAY_TIMES = 50.0
MIN_SEGMENT_SAMPLES = 64  # Smallest number of samples of a segment.


class Record(NamedTuple):
    """Equally spaced samples of drive and output under a random drive.

    - step: time step [s].
    - drive (k,): acceleration of the drive [m s-2].
    - place (k,): displacement of the output [m].
    - acceleration (k,): acceleration of the output [m s-2].
    """

    step: float
    drive: np.ndarray
    place: np.ndarray
    acceleration: np.ndarray


class Spectra(NamedTuple):
    """One-sided spectral densities over frequency, and the frequency response.

    - frequency (q,): [Hz].
    - drive, acceleration (q,): spectral densities of the drive and of the acceleration of the
      output [m2 s-3].
    - place (q,): spectral density of the displacement of the output [m2 Hz-1].
    - gain (q,): complex H1 of the displacement over the drive [s2].
    - coherence (q,): of displacement and drive [1].
    """

    frequency: np.ndarray
    drive: np.ndarray
    place: np.ndarray
    acceleration: np.ndarray
    gain: np.ndarray
    coherence: np.ndarray


def make_record(window, drive) -> Record:
    """Sample the drive and output of a window at the sampling rate of its drive.

    The displacement comes from cubics through positions and rates.
    """
    kept = np.append(True, np.diff(window.time) > 1e-9 * drive.time[1])
    time = window.time[kept]
    step = float(drive.time[1])
    grid = time[0] + step * np.arange(int((time[-1] - time[0]) / step * (1 + 1e-12)))
    place = CubicHermiteSpline(time, window.output[kept], window.output_rate[kept])(grid)
    return Record(step, drive.values(grid), place, np.interp(grid, time, window.acceleration[kept]))


def random_response_measures(window, drive) -> dict:
    """Return the measures of the response to a stationary random drive as a dict."""
    record = make_record(window, drive)
    out = {}
    for name, values, even in (
        ("relative_displacement_rms", window.output, record.place),
        ("absolute_acceleration_rms", window.acceleration, record.acceleration),
    ):
        out[name] = compute_rms(window.time, values)
        out[f"{name}_scatter"] = rms_scatter(even)
    found = fit_peak(record, drive.band)
    if found is not None:
        for name, value, scatter in zip(("response_frequency", "response_damping"), *found):
            out |= {name: value, f"{name}_scatter": scatter}
    if "ledger" in window.extra:
        out["friction_power"], out["friction_power_scatter"] = mean_power(
            window.time, window.extra["ledger"][0]
        )
    return {name: float(value) for name, value in out.items() if np.isfinite(value)}


def warn_if_short(measures: dict, window) -> list:
    """Return a warning, as a list, if a record is short compared with the decay of its mode.

    Parameters
    ----------
    measures : dict
        Measure by name.
    window : Response
    """
    names = "response_frequency", "response_damping"
    if any(name not in measures or not measures[name].value for name in names):
        return []
    at, zeta = (measures[name].value for name in names)
    span = float(window.time[-1] - window.time[0])
    decay = 1 / (2 * np.pi * at * zeta)
    if span >= MIN_DECAY_TIMES * decay:
        return []
    return [
        f"the response lasts only {span / decay:.2g} decay times of the mode at {at:.4g} Hz, too short for a "
        f"reliable scatter between random drives; set drive.duration = '{1.5 * MIN_DECAY_TIMES * decay:.2g} s'"
    ]


def compute_rms(time, values) -> float:
    """Return the root mean square about the mean of samples (k,) at times (k,) [s].

    The trapezoidal rule is used.
    """
    span = time[-1] - time[0]
    mean = np.trapezoid(values, time) / span
    return float(np.sqrt(np.trapezoid((values - mean) ** 2, time) / span))


def rms_scatter(values) -> float:
    """Return the confidence half-width of the root mean square of equally spaced samples.

    It comes from the mean squares of N_GROUPS parts. The interval is one of the logarithm of the mean
    square, because few oscillations have a skewed distribution; its upper half counts.
    """
    if values.size < N_GROUPS:
        return np.nan
    square = (values - values.mean()) ** 2
    parts = square[: square.size // N_GROUPS * N_GROUPS].reshape(N_GROUPS, -1).mean(axis=1)
    mean = square.mean()
    if not mean > 0:
        return 0.0
    share = stdtrit(N_GROUPS - 1, 0.975) * parts.std(ddof=1) / np.sqrt(N_GROUPS) / mean
    return float(np.sqrt(mean) * np.expm1(share / 2))


def mean_power(time, work) -> tuple:
    """Return the mean power [W] and its confidence half-width [W] from cumulative work.

    The half-width comes from the means over N_GROUPS parts of equal length.

    Parameters
    ----------
    time : (k,)
        Times [s].
    work : (k,)
        Work done since the start [J].
    """
    edges = np.linspace(time[0], time[-1], N_GROUPS + 1)
    parts = np.diff(np.interp(edges, time, work)) / np.diff(edges)
    return parts.mean(), stdtrit(N_GROUPS - 1, 0.975) * parts.std(ddof=1) / np.sqrt(N_GROUPS)


def is_steady(window, drive) -> bool:
    """Return whether both halves of a window have the same root mean square within scatter."""
    place = make_record(window, drive).place
    half = place.size // 2
    first = place[:half]
    last = place[half:]
    # The half-widths are 2 standard errors, so a difference of up to 4 standard errors is accepted.
    return bool(
        abs(first.std() - last.std()) <= 2 * np.hypot(rms_scatter(first), rms_scatter(last))
    )


def transform_record(record: Record) -> Segments:
    """Transform drive, displacement and acceleration in overlapping segments of a record."""
    size = max(
        min(MIN_SEGMENT_SAMPLES, record.place.size),
        2 * (record.place.size // (2 * SEGMENTS_PER_RECORD)),
    )
    return transform_segments(record.step, record[1:], size)


def compute_spectra(window, drive) -> Spectra:
    """Compute the spectra of a window, up to twice the highest frequency of the drive."""
    frequency, (push, place, acceleration) = transform_record(make_record(window, drive))
    low, high = drive.band
    shown = (frequency > 0) & (frequency <= 2 * high)
    found = CrossDensities(*(part[shown] for part in average_segments(push, place)))
    far = average_segments(push, acceleration).output[shown]
    frequency = frequency[shown]
    driven = (frequency >= low) & (frequency <= high)
    gain = np.where(driven, found.cross / np.where(driven, found.input, np.inf), np.nan)
    coherence = np.where(driven, found.coherence(), np.nan)
    return Spectra(frequency, found.input, found.output, far, gain, coherence)


def fit_peak(record: Record, band: tuple) -> tuple | None:
    """Fit natural frequency [Hz] and damping ratio to the largest peak of H1, with half-widths.

    Parameters
    ----------
    record : Record
    band : tuple
        Lowest and highest frequency of the drive [Hz].

    Returns
    -------
    tuple or None
        (frequency, damping ratio) and the half-widths of both. None if the band contains no peak:
        the largest value is at an end of the band, no mode fits, or the record is too short.
    """
    if record.place.size < 2 * MIN_SEGMENT_SAMPLES:
        return None
    frequency, (push, place, _) = transform_record(record)
    span = 1 / (frequency[1])
    line = frequency[1]
    inside = np.flatnonzero((frequency >= band[0] + 2 * line) & (frequency <= band[1] - 2 * line))
    if inside.size < 5 or len(push) < N_GROUPS:
        return None
    own = (np.abs(push) ** 2)[:, inside]
    cross = (push.conj() * place)[:, inside]
    f = frequency[inside]
    gain = cross.sum(axis=0) / own.sum(axis=0)
    top = int(np.argmax(np.abs(gain)))
    if top in (0, f.size - 1) or not np.abs(gain[top]) > 0:
        return None
    high = np.flatnonzero(np.abs(gain) < np.abs(gain[top]) / np.sqrt(2))
    left = high[high < top].max(initial=0)
    right = high[high > top].min(initial=f.size - 1)
    width = float(f[right] - f[left])
    theta = np.log([2 * np.pi * f[top], max(0.3 * width, 0.05 * line) / (2 * f[top])])
    for _ in range(3):  # The band of the fit follows the width of the peak.
        at = np.exp(theta[0]) / (2 * np.pi)
        half = np.exp(theta.sum()) / (2 * np.pi)
        near = np.abs(f - at) <= max(FIT_BAND[0] * half, FIT_BAND[1] * line)
        theta = _fit_mode(f[near], gain[near], span, theta)
    if (
        near.sum() < 5
        or not abs(f[top] - np.exp(theta[0]) / (2 * np.pi)) < max(width, 2 * line)
        or theta[1] > 0
    ):
        return None
    which = np.arange(len(push)) * N_GROUPS // len(push)
    others = []
    for group in range(N_GROUPS):
        left_in = which != group
        part = cross[left_in][:, near].sum(axis=0) / own[left_in][:, near].sum(axis=0)
        others.append(np.exp(_fit_mode(f[near], part, span, theta)))
    scale = np.array([1 / (2 * np.pi), 1.0])
    spread = np.sqrt((N_GROUPS - 1) * np.var(others, axis=0)) * stdtrit(N_GROUPS - 1, 0.975)
    return np.exp(theta) * scale, spread * scale


def _fit_mode(f, gain, span: float, theta) -> np.ndarray:
    """Fit natural frequency and damping ratio of the mode that reproduces H1.

    A complex constant is fitted as well, for the other modes.

    Parameters
    ----------
    f, gain : (q,)
        Frequencies [Hz] and H1 [s2].
    span : float
        Duration of a segment [s].
    theta : (2,)
        Initial guess.
    """
    size = np.abs(gain).max()

    def compute_residual(theta):
        """Return the relative residual of H1 after a linear least-squares fit."""
        response = expected_response(f, *np.exp(theta), span)
        columns = np.stack([response, np.ones(f.size, complex), 1j * np.ones(f.size)], axis=1)
        design = np.concatenate([columns.real, columns.imag])
        norms = np.linalg.norm(design, axis=0)
        target = np.concatenate([gain.real, gain.imag]) / size
        return design / norms @ np.linalg.lstsq(design / norms, target, rcond=1e-12)[0] - target

    reach = np.array([0.5, 7.0])
    return least_squares(
        compute_residual, theta, bounds=(theta - reach, theta + reach), xtol=1e-10, ftol=1e-10
    ).x


def expected_response(f, omega: float, zeta: float, span: float) -> np.ndarray:
    """Return the H1 estimate [s2] that Hann-windowed segments give for a mode, in closed form.

    int_0^span h(t) r(t) exp(-2 pi i f t) dt, where h is the response of x'' + 2 zeta omega x' +
    omega^2 x = a and r the correlation of the window.

    Parameters
    ----------
    f : (q,)
        Frequencies [Hz].
    omega, zeta : float
        Natural angular frequency [rad/s] and damping ratio.
    span : float
        Duration of a segment [s].
    """
    own = omega * np.sqrt(complex(1 - zeta * zeta))
    turn = 2j * np.pi / span
    out = 0.0
    for pole, sign in ((-zeta * omega + 1j * own, 1), (-zeta * omega - 1j * own, -1)):
        q = pole - 2j * np.pi * f
        # Since exp(turn span) = 1, the result is the same at q +- turn.
        late = np.exp(q * span) - 1
        ramp = sum(
            share * (late / s - span) / (s * span)
            for share, s in ((2 / 3, q), (1 / 6, q + turn), (1 / 6, q - turn))
        )
        out = out + sign * (ramp + late * (1 / (q + turn) - 1 / (q - turn)) / (4j * np.pi))
    return out / (2j * own)
