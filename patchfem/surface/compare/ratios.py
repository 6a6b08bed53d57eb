"""Ratios of amplitudes and slopes of two surfaces, with the interval from a single pair."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ..areal import Areal, fill_missing, level_plane
from ..profile import Profile, level, resample_evenly
from ..quantity import LEVEL, SIDE, Quantity, make_unknown
from ..roughness.intervals import Intervals
from ..roughness.parameters import Heights
from ..roughness.spectrum import BAND, Spectrum, band_amplitude, estimate_spectrum, refuse_band
from .boxes import average_parts, part_edges

# Standard deviation of a ratio due to tip, interpolation and datum, in addition to the noise.
RATIO_ERROR = 0.004
MAX_MISSING = 1 / 3  # largest fraction of missing heights in a line of a scan
# Largest number of lines of a scan that are evaluated; more lines would
# nearly repeat their neighbours.
MAX_LINES = 256
N_PARTS = 6  # number of parts of a trace whose mean squares show the scatter along the trace


class Size(NamedTuple):
    """Amplitude in the band [m], rms slope [1], the degrees of freedom of each, and the spectrum."""

    amplitude: float
    slope: float
    freedom: tuple
    spectrum: Spectrum


def measure_size(trace: Profile, step: float, band: tuple = BAND) -> Size:
    """Measure the amplitude and the slope of a trace.

    Parameters
    ----------
    trace : Profile
    step : float
        Step [m] at which the trace is read; slopes compare at the same step only.
    band : tuple
        Shortest and longest wave [m] of the amplitude.

    Raises
    ------
    PatchfemError
        If the trace is too short or too coarse for the band.
    """
    z, step = resample(trace, step)
    refuse_band(trace.source, *band, step * (z.size - 1), step)
    return _measure_heights(z, step, band)


def _measure_heights(z, step: float, band: tuple) -> Size:
    """Measure the amplitude and the slope of levelled heights (n,) [m] with a sampling interval [m]."""
    spectrum = estimate_spectrum(z, step)
    freedom = (1.0, 1.0)
    if spectrum.density.any():
        intervals = Intervals(Heights(z, step), 1, spectrum, band)
        freedom = (intervals.freedom("band"), intervals.freedom("slope"))
    slope = float(np.sqrt(np.mean(np.diff(z) ** 2))) / step
    return Size(band_amplitude(spectrum, *band), slope, freedom, spectrum)


def resample(trace: Profile, step: float) -> tuple:
    """Resample a trace to a sampling interval [m], unless its present interval is larger, and level it.

    Returns the heights (n,) [m] and their step.
    """
    flat = level(resample_evenly(trace))
    if step < flat.step * 1.01:
        return flat.z, flat.step
    count = int(flat.length / step * (1 + 1e-9)) + 1
    x = flat.x[0] + step * np.arange(count)
    z = np.interp(x, flat.x, flat.z)
    return level(Profile(frozen_array(x), frozen_array(z), flat.source)).z, step


def fill_scan(scan: Areal) -> tuple:
    """Level a scan and fill its missing heights smoothly; return it with a mask (m, n) of these."""
    flat = level_plane(scan)
    return replace(flat, z=fill_missing(flat.z, flat.missing)), flat.missing


def measure_scan_size(scan: Areal, missing, direction: str, band: tuple = BAND) -> Size:
    """Measure amplitude and slope along the lines of a scan that run in one direction.

    Mean squares are averaged over the lines. Neighbouring lines are nearly equal, so the degrees of
    freedom of a line are multiplied by the number of independent lines.

    Parameters
    ----------
    scan : Areal
    missing : (m, n) bool array
        As `fill_scan` returns both.
    direction : str
        "x" for rows, "y" for columns.
    band : tuple
        Shortest and longest wave [m].

    Raises
    ------
    PatchfemError
        If every line lacks too many heights, or the lines cannot show the band.
    """
    z, x = (scan.z, scan.x) if direction == "x" else (scan.z.T, scan.y)
    missing = missing if direction == "x" else missing.T
    rows = np.flatnonzero(missing.mean(axis=1) <= MAX_MISSING)
    z = z[rows[np.linspace(0, rows.size - 1, min(rows.size, MAX_LINES)).astype(int)]]
    if not len(z):
        raise PatchfemError(
            f"{scan.source}: along {direction} every line of the scan lacks more than a third of its heights"
        )
    step = float(x[-1] - x[0]) / (x.size - 1)
    refuse_band(scan.source, *band, step * (x.size - 1), step)
    sizes = [_measure_heights(level(Profile(x, row, scan.source)).z, step, band) for row in z]
    squares = np.array([(size.amplitude**2, size.slope**2) for size in sizes])
    amplitude, slope = np.sqrt(squares.mean(axis=0))
    freedom = np.mean([size.freedom for size in sizes], axis=0)
    freedom = [float(each * _count_independent(part)) for each, part in zip(freedom, squares.T)]
    density = np.mean([size.spectrum.density for size in sizes], axis=0)
    spectrum = sizes[0].spectrum
    spectrum = Spectrum(spectrum.frequency, frozen_array(density), spectrum.tapers, spectrum.length)
    return Size(float(amplitude), float(slope), tuple(freedom), spectrum)


def _count_independent(values) -> float:
    """Estimate the number of independent values, n / (1 + 2 sum of correlations).

    The sum ends at the first zero.
    """
    deviation = values - values.mean()
    power = float(deviation @ deviation)
    if power == 0:
        return 1.0
    total = 1.0
    for lag in range(1, values.size):
        correlation = float(deviation[lag:] @ deviation[:-lag]) / power
        if correlation <= 0:
            break
        total += 2 * correlation
    return max(values.size / total, 1.0)


def divide_sizes(
    part: str, text: str, over: Size, under: Size, correlation: float = 0.0
) -> Quantity:
    """Divide the amplitudes or slopes of two traces.

    Mean squares of traces of different places are independent chi-squares, and the interval is that of
    F. Those of the same place vary together, and the interval is Pitman's for two correlated variances
    (Biometrika 31 (1939) 9), by Student's t with the smaller degrees of freedom.

    Parameters
    ----------
    part : str
        "amplitude" or "slope".
    text : str
        Definition of the ratio.
    over, under : Size
    correlation : float
        Correlation of the two traces.
    """
    from scipy.special import fdtri, stdtrit

    place = Size._fields.index(part)
    if under[place] <= 0:
        return make_unknown("1", text, f"the {part} before wear is zero")
    value = over[place] / under[place]
    first = over.freedom[place]
    second = under.freedom[place]
    tail_probability = (1 - LEVEL) / 2
    if correlation <= 0:
        low, high = (1 / fdtri(first, second, p) for p in (1 - tail_probability, tail_probability))
    else:
        freedom = max(min(first, second) - 1, 1.0)
        k = (
            2
            * (1 - min(correlation, 1.0) ** 2)
            * stdtrit(freedom, 1 - tail_probability) ** 2
            / freedom
        )
        high = 1 + k + np.sqrt(k * (2 + k))
        low = 1 / high
    return Quantity(value, value * float(np.sqrt(low)), value * float(np.sqrt(high)), "1", text)


def widen_ratio(ratio: Quantity, error: float) -> Quantity:
    """Widen the interval of a ratio by an additional standard deviation of its logarithm."""
    if ratio.value is None or ratio.value <= 0:
        return ratio
    limits = (max(ratio.low, 1e-300), ratio.high)
    below, above = (np.hypot(np.log(limit / ratio.value), SIDE * error) for limit in limits)
    return ratio._replace(
        low=ratio.value * float(np.exp(-below)), high=ratio.value * float(np.exp(above))
    )


def noise_fractions(sizes: tuple, noise: float, step: float, band: tuple) -> tuple:
    """Return the relative errors of amplitude and slope due to noise.

    Half of the mean square of white noise counts in the amplitude, as the noise of both traces differs,
    and all of it in the slope, from which interpolation between samples takes most.

    Parameters
    ----------
    sizes : tuple of Size
    noise : float
        Noise [m] of the difference of both traces.
    step : float
        Step [m] of the traces.
    band : tuple
        Shortest and longest wave [m].
    """
    amplitude = min(size.amplitude for size in sizes)
    slope = min(size.slope for size in sizes)
    in_band = noise**2 * 2 * step * (1 / band[0] - 1 / band[1])
    in_slope = noise**2 / step**2
    return (
        float(0.5 * in_band / max(amplitude**2, 1e-300)),
        float(in_slope / max(slope**2, 1e-300)),
    )


def estimate_freedom(trace: Profile, step: float, band: tuple = BAND) -> tuple:
    """Estimate the degrees of freedom of amplitude and slope from their scatter along a trace.

    The trace is read at a step [m] and cut into six parts. The scatter of six values is known to a
    third, so half of what they show counts.
    """
    z, step = resample(trace, step)
    in_band = np.fft.irfft(np.where(_is_in_band(z.size, step, band), np.fft.rfft(z), 0.0), z.size)
    edges = part_edges(z.size - 1, N_PARTS)
    freedom = []
    for values in (in_band[:-1], np.diff(z)):
        means = average_parts(values**2, edges)
        scatter = float(means.var(ddof=1)) / N_PARTS
        freedom.append(float(np.clip(means.mean() ** 2 / max(scatter, 1e-300), 2.0, 1e9)))
    return tuple(freedom)


def _is_in_band(count: int, step: float, band: tuple) -> np.ndarray:
    """Return which Fourier frequencies, for a number of samples, lie in the band."""
    frequency = np.fft.rfftfreq(count, step)
    return (frequency >= 1 / band[1]) & (frequency <= 1 / band[0])


def correlate_traces(first, second, step: float, band: tuple = BAND) -> tuple:
    """Return the correlations of two aligned traces in the band, and of their slopes.

    Parameters
    ----------
    first, second : (n,) array [m]
    step : float
        Step [m].
    band : tuple
        Shortest and longest wave [m].
    """
    window = np.hanning(first.size)
    is_inside = _is_in_band(first.size, step, band)
    waves = [np.fft.rfft((z - z.mean()) * window)[is_inside] for z in (first, second)]
    correlations = []
    for one, other in (waves, (np.diff(first), np.diff(second))):
        size = float(np.sqrt(np.vdot(one, one).real * np.vdot(other, other).real))
        value = np.vdot(one, other).real / size if size > 0 else 0.0
        correlations.append(float(np.clip(value, 0.0, 1.0)))
    return tuple(correlations)
