"""Gaussian filters of traces (ISO 16610-21) and of areal scans (ISO 16610-61)."""

from dataclasses import replace

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal
from ..profile import Profile, level, resample_evenly

# Width of the weights relative to the cut-off; a wave of the cut-off keeps half its height.
ALPHA = np.sqrt(np.log(2) / np.pi)
# Half-length of the weights relative to the cut-off; 1.5e-10 of their sum lies beyond.
REACH_FACTOR = 1.25
MIN_CUTOFF_STEPS = 4  # smallest cut-off in steps; the samples do not resolve a shorter one


def filter_trace(profile: Profile, cutoff: float) -> tuple[Profile, Profile]:
    """Split a trace at a cut-off [m] into waviness and roughness.

    The trace is resampled at equal steps and levelled. The mean line is its convolution with the weights
    exp(-pi (x / (alpha cutoff))^2), alpha = sqrt(ln 2 / pi); half a cut-off is trimmed at each end.
    Raises PatchfemError if the cut-off is shorter than four steps or as long as the trace.
    """
    flat = level(resample_evenly(profile))
    step = flat.step
    kept = _trim(profile.source, cutoff, flat.x, "trace")
    line = mean_line(flat.z, cutoff / step)
    x = frozen_array(flat.x[kept])
    waviness = replace(flat, x=x, z=frozen_array(line[kept]))
    roughness = replace(flat, x=x, z=frozen_array((flat.z - line)[kept]))
    return waviness, roughness


def filter_scan(scan: Areal, cutoff: float) -> tuple[Areal, Areal]:
    """Split a levelled scan at a nesting index [m] into its long and its short waves.

    Half a cut-off is trimmed at each border. Missing heights have no weight and stay missing.
    Raises PatchfemError if the cut-off is shorter than four steps or as long as the shorter side.
    1000 x 1000 heights take 0.4 s.
    """
    axes = (scan.y, scan.x)
    _trim(scan.source, cutoff, min(axes, key=np.ptp), "shorter side")
    rows, columns = (_trim(scan.source, cutoff, axis, "shorter side") for axis in axes)
    cutoffs = tuple(cutoff * (axis.size - 1) / float(axis[-1] - axis[0]) for axis in axes)
    waves = mean_surface(scan.z, cutoffs)
    inner = replace(scan, x=frozen_array(scan.x[columns]), y=frozen_array(scan.y[rows]))
    long_waves = replace(inner, z=frozen_array(waves[rows, columns]))
    short_waves = replace(inner, z=frozen_array((scan.z - waves)[rows, columns]))
    return long_waves, short_waves


def _trim(source: str, cutoff: float, axis: np.ndarray, name: str) -> slice:
    """Return the samples of an axis that are far enough from both ends for a filter."""
    length = float(axis[-1] - axis[0])
    step = length / (axis.size - 1)
    if not np.isfinite(cutoff) or cutoff < MIN_CUTOFF_STEPS * step * (1 - 1e-9):
        raise PatchfemError(
            f"{source}: a cut-off of {format_length(cutoff)} is shorter than {MIN_CUTOFF_STEPS} steps of "
            f"{format_length(step)}; for this trace the cut-off must be at least "
            f"{format_length(MIN_CUTOFF_STEPS * step)}"
        )
    edge = int(np.ceil(cutoff / 2 / step * (1 - 1e-9)))
    if 2 * edge > axis.size - 2:
        raise PatchfemError(
            f"{source}: the {name} is {format_length(length)} long; half a cut-off of {format_length(cutoff)} is "
            f"trimmed at each end, so the cut-off must be shorter than the {name}"
        )
    return slice(edge, axis.size - edge)


def mean_surface(z: np.ndarray, cutoffs: tuple) -> np.ndarray:
    """Compute the Gaussian mean surface (m, n) of heights z (m, n); missing heights are NaN in both.

    Cut-offs in steps along y and x.
    """
    known = ~np.isnan(z)
    sums = []
    for values in (np.where(known, z, 0.0), known.astype(float)):
        for axis, cutoff in enumerate(cutoffs):
            _, weight = _gaussian_weights(cutoff, z.shape[axis])
            values = _convolve(values, weight, axis)
        sums.append(values)
    return np.divide(*sums, out=np.full(z.shape, np.nan), where=known)


def mean_line(z: np.ndarray, cutoff: float, *, tilted: bool = False) -> np.ndarray:
    """Compute the Gaussian mean line (n,) of equally spaced heights z (n,).

    Parameters
    ----------
    z : (n,) array [m]
    cutoff : float
        Cut-off in steps.
    tilted : bool
        Whether the weights that an end cuts off fit a straight line (ISO 16610-28, first moment),
        not a constant.

    Returns
    -------
    (n,) array [m]
        A million samples take 0.2 s.
    """
    offsets, weight = _gaussian_weights(cutoff, z.size)
    ones = np.ones(z.size)
    sum_w = _convolve(ones, weight)
    sum_wz = _convolve(z, weight)
    if not tilted:
        return sum_wz / sum_w
    sum_wt = _convolve(ones, -offsets * weight)  # a convolution reverses the weights
    sum_wtt = _convolve(ones, offsets**2 * weight)
    sum_wtz = _convolve(z, -offsets * weight)
    return (sum_wz * sum_wtt - sum_wtz * sum_wt) / (sum_w * sum_wtt - sum_wt**2)


def _convolve(values, weights, axis: int = 0) -> np.ndarray:
    """Convolve values with centred weights (2 k + 1,) along an axis, zero beyond the ends."""
    from scipy.fft import irfft, next_fast_len, rfft

    count = values.shape[axis]
    size = next_fast_len(count + weights.size - 1, real=True)
    spectrum = rfft(np.moveaxis(values, axis, -1), size) * rfft(weights, size)
    first = weights.size // 2
    return np.moveaxis(irfft(spectrum, size)[..., first : first + count], -1, axis)


def _gaussian_weights(cutoff: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return offsets and Gaussian weights for a cut-off in steps, over `count` samples at most."""
    half = min(int(np.ceil(REACH_FACTOR * cutoff)), count - 1)
    offsets = np.arange(-half, half + 1.0)
    return offsets, np.exp(-np.pi * (offsets / (ALPHA * cutoff)) ** 2)
