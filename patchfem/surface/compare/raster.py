"""Surfaces on an even raster of one axis (traces) or two axes (areal scans), in which both look alike."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, max_abs
from ..areal import Areal, fill_nearest, find_scan_spikes
from ..profile import MAX_TRACE_SAMPLES, Profile, remove_spikes

MIN_TRACE_HEIGHTS = 40  # smallest number of heights of a trace that is compared
MIN_SCAN_SIDE = 16  # smallest number of points along each side of a scan
# Largest distance from even places, in steps, of a trace that is not resampled
MAX_SAMPLE_UNEVENNESS = 0.1


class Raster(NamedTuple):
    """Surface on even steps, of d = 1 axis (trace) or d = 2 axes (scan, y before x).

    - z (n,) or (m, n): heights [m], NaN where missing.
    - origin (d,): first position [m] along each axis.
    - steps (d,): step [m] along each axis.
    """

    z: np.ndarray
    origin: np.ndarray
    steps: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Place (d,) [m] of the middle."""
        return self.origin + self.steps * (np.array(self.z.shape) - 1) / 2

    @property
    def lengths(self) -> np.ndarray:
        """Length (d,) [m] along each axis."""
        return self.steps * (np.array(self.z.shape) - 1)

    @property
    def axes(self) -> list[np.ndarray]:
        """Places [m] along each axis."""
        return [
            start + step * np.arange(count)
            for start, step, count in zip(self.origin, self.steps, self.z.shape)
        ]

    def mirror(self) -> "Raster":
        """Return the surface measured against the direction of x, over the same range."""
        return self._replace(z=self.z[..., ::-1])


def fill_gaps(z) -> np.ndarray:
    """Fill missing heights z of a trace (n,) by straight lines, of a scan (m, n) by the nearest one."""
    missing = np.isnan(z)
    if z.ndim > 1 or not missing.any():
        return fill_nearest(z)
    places = np.arange(z.size)
    return np.interp(places, places[~missing], z[~missing])


def clean_surface(surface: Profile | Areal, *, keep_spikes: bool = False) -> Profile | Areal:
    """Mark spikes, dust and saturated heights of a surface as missing.

    With `keep_spikes` they stay, and the surface is only checked. Raises PatchfemError if too few heights are left.
    """
    if isinstance(surface, Areal):
        if min(surface.z.shape) < MIN_SCAN_SIDE:
            rows, columns = surface.z.shape
            raise PatchfemError(
                f"compare: {surface.source}: {rows} x {columns} heights; a comparison of scans needs at least "
                f"{MIN_SCAN_SIDE} along each side"
            )
        is_bad = find_scan_spikes(surface)
    else:
        is_bad = remove_spikes(surface).missing
    is_bad = is_bad | _find_saturated(surface.z)
    z = surface.z if keep_spikes else np.where(is_bad, np.nan, surface.z)
    count = np.isfinite(z).sum()
    if count < MIN_TRACE_HEIGHTS:
        raise PatchfemError(
            f"compare: {surface.source}: {count} heights; a comparison needs at least {MIN_TRACE_HEIGHTS}"
        )
    return replace(surface, z=z)


def _find_saturated(z) -> np.ndarray:
    """Return a mask of the heights z at the end of the range of the instrument, far from all others."""
    levels = np.unique(z[~np.isnan(z)])
    is_saturated = np.zeros(z.shape, bool)
    if levels.size < 4:
        return is_saturated
    span = np.ptp(levels[1:-1]) / 2
    for extreme, nearest in (levels[:2], levels[:-3:-1]):
        is_extreme = z == extreme
        if is_extreme.sum() > 1 and abs(extreme - nearest) > span:
            is_saturated |= is_extreme
    return is_saturated


def make_raster(surface: Profile | Areal) -> Raster:
    """Return a surface on an even raster; an uneven trace is resampled at the 10th percentile of its steps."""
    if isinstance(surface, Areal):
        axes = (surface.y, surface.x)
        origin = np.array([axis[0] for axis in axes])
        return Raster(surface.z, origin, np.array([np.diff(axis).mean() for axis in axes]))

    # The raster has the mean step of an even trace, and finer steps for an uneven one, whose heights are interpolated.
    known = ~surface.missing
    x = surface.x[known]
    distances = np.diff(x)
    median = float(np.median(distances))
    step = np.ptp(x) / round(np.ptp(x) / median)
    places = (x - x[0]) / step
    if max_abs(places - np.rint(places)) > MAX_SAMPLE_UNEVENNESS:
        step = max(float(np.percentile(distances, 10)), np.ptp(x) / MAX_TRACE_SAMPLES)
    grid = x[0] + step * np.arange(int(np.ptp(x) / step * (1 + 1e-9)) + 1)
    z = np.interp(grid, x, surface.z[known])
    # Points within a wide gap of the trace are missing, unless they are next to a measured height.
    after = np.clip(np.searchsorted(x, grid), 1, x.size - 1)
    nearest = np.minimum(np.abs(grid - x[after - 1]), np.abs(x[after] - grid))
    # Distance of two samples, in median steps, above which heights are missing
    is_missing = (distances[after - 1] > 2.5 * median) & (nearest > MAX_SAMPLE_UNEVENNESS * step)
    return Raster(np.where(is_missing, np.nan, z), x[:1], np.array([step]))
