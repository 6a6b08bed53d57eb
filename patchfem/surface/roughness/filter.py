"""Gaussian filters of traces (ISO 16610-21) and of areal scans (ISO 16610-61)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import fft

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal, level
from ..profile import Profile, measure_step, resample_evenly

MIN_CUTOFF_STEPS = 4  # smallest cut-off in steps; the samples do not resolve a shorter one


def filter_surface(surface: Profile | Areal, cutoff: float) -> tuple[Profile | Areal, ...]:
    """Split a trace or a levelled scan at a cut-off [m] into its long waves (waviness) and its short waves (roughness).

    A trace is resampled at equal steps and levelled. The mean line or surface is its convolution with the weights
    exp(-pi (x / (alpha cutoff))^2), alpha = sqrt(ln 2 / pi), along each axis; half a cut-off is trimmed at each end or
    border. Missing heights of a scan have no weight and stay missing. Raises PatchfemError if the cut-off is shorter than
    four steps or as long as a side. 1000 x 1000 heights take 0.4 s.

    Parameters
    ----------
    surface : Profile or Areal
        Trace or scan.
    cutoff : float
        Cut-off [m].

    Returns
    -------
    tuple of Profile or Areal
        Waviness and roughness.
    """
    is_scan = isinstance(surface, Areal)
    surface = surface if is_scan else level(resample_evenly(surface))
    axes = {"y": surface.y, "x": surface.x} if is_scan else {"x": surface.x}
    kept_slices = []
    cutoffs = []
    for name, axis in axes.items():
        step = measure_step(axis)
        if not np.isfinite(cutoff) or cutoff < MIN_CUTOFF_STEPS * step * (1 - 1e-9):
            raise PatchfemError(
                f"{surface.source}: a cut-off of {format_length(cutoff)} is shorter than {MIN_CUTOFF_STEPS} steps of "
                f"{format_length(step)}"
            )
        # Half a cut-off from an end, 0.4 % of the weights are cut off.
        edge = int(np.ceil(cutoff / 2 / step * (1 - 1e-9)))
        if 2 * edge > axis.size - 2:
            raise PatchfemError(
                f"{surface.source}: half a cut-off of {format_length(cutoff)} is trimmed at each end, so that it must be "
                f"shorter than the length along {name}, {format_length(axis[-1] - axis[0])}"
            )
        kept_slices.append(slice(edge, axis.size - edge))
        cutoffs.append(cutoff / step)

    waves = mean_surface(surface.z, cutoffs)
    inside = tuple(kept_slices)
    places = {name: frozen_array(axes[name][part]) for name, part in zip(axes, kept_slices)}
    return tuple(
        replace(surface, **places, z=frozen_array(z[inside])) for z in (waves, surface.z - waves)
    )


def mean_surface(z: np.ndarray, cutoffs: Sequence[float]) -> np.ndarray:
    """Compute the Gaussian mean line (n,) or surface (m, n) of heights z of this shape.

    Missing heights are NaN in both. The `cutoffs` are in steps along each axis. A million heights take 0.2 s.
    """
    known = ~np.isnan(z)
    sums = []
    for values in (np.where(known, z, 0.0), known.astype(float)):
        for axis, cutoff in enumerate(cutoffs):
            weight = _gaussian_weights(cutoff, z.shape[axis])[1]
            values = np.moveaxis(_convolve(np.moveaxis(values, axis, -1), weight), -1, axis)
        sums.append(values)
    return np.divide(*sums, out=np.full(z.shape, np.nan), where=known)


def mean_line(z: np.ndarray, cutoff: float) -> np.ndarray:
    """Compute the mean line (n,) of equally spaced heights z (n,) that follows slopes up to its ends.

    The weights that an end cuts off fit a straight line, not a constant (ISO 16610-28, first moment). The `cutoff` is
    in steps.
    """
    offsets, weight = _gaussian_weights(cutoff, z.size)
    # A convolution reverses the weights.
    kernels = (weight, -offsets * weight, offsets**2 * weight)
    ones = np.ones(z.size)
    sum_w, sum_wt, sum_wtt = [_convolve(ones, kernel) for kernel in kernels]
    sum_wz, sum_wtz = [_convolve(z, kernel) for kernel in kernels[:2]]
    return (sum_wz * sum_wtt - sum_wtz * sum_wt) / (sum_w * sum_wtt - sum_wt**2)


def _convolve(z, weight) -> np.ndarray:
    """Return the convolution of heights (..., n), zero beyond their ends, with weights (2 k + 1,) along the last axis."""
    half = weight.size // 2
    count = fft.next_fast_len(z.shape[-1] + 2 * half, real=True)
    sums = fft.irfft(fft.rfft(z, count) * fft.rfft(weight, count), count)
    return sums[..., half : half + z.shape[-1]]


def _gaussian_weights(cutoff: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return offsets and Gaussian weights for a `cutoff` in steps, over `count` samples at most."""
    # Half-length of the weights relative to the cut-off; 1.5e-10 of their sum lies beyond.
    half = min(int(np.ceil(1.25 * cutoff)), count - 1)
    offsets = np.arange(-half, half + 1.0)
    # A wave of the cut-off keeps half its height
    return offsets, np.exp(-np.pi * (offsets / (np.sqrt(np.log(2) / np.pi) * cutoff)) ** 2)
