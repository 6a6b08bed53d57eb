"""Depth of a second scan below a first one as a function of rotation, shift and plane.

A point p of the first scan, measured from the middle of that scan, lies in the second scan at
R(angle) p + shift, measured from the same point; R turns anticlockwise. The depth there is

    w(p) = z_before(p) - z_after(R p + shift) + offset + slope_x u + slope_y v,

with u and v from -1 to 1 over the first scan.
"""

from copy import copy
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ..areal import Areal, fill_missing
from ..compare.model import MAX_STEP, SLOPE_NOISE

MIN_HEIGHTS = 400  # smallest number of common heights; fewer do not determine the alignment
# Number of heights in a fit, enough to determine a shift to a few thousandths of a pixel.
N_POINTS = 60_000
N_TILES = 8  # number of tiles along each side, whose modes are the starting points of a robust fit
MIN_TILE_HEIGHTS = 12  # smallest number of heights in a tile; the mode of fewer is too uncertain
ROUND_OFF = 1e-9  # fraction of the scatter of the heights; smaller differences are round-off
# Standard deviation in pixels of the narrowest Gaussian filter that gives slopes.
MIN_SMOOTHING = 0.7
# Standard deviation in pixels of the widest Gaussian filter with which slopes are computed.
MAX_SMOOTHING = 8.0
# Width, as a fraction of the shorter side, of the Gaussian filter that gives the long waves; these
# are subtracted before slopes are computed.
LONG_WAVES = 0.05
BORDER = 2  # width in pixels of the border of a scan, where cubic interpolation is inaccurate
# Number of heights of a depth map that are computed at a time, which limits the memory.
BLOCK = 1 << 20


class Parameter(IntEnum):
    """Indices of the alignment parameters of two scans: rotation, shift and plane."""

    OFFSET = 0
    SLOPE_X = 1
    SLOPE_Y = 2
    ANGLE = 3
    SHIFT_X = 4
    SHIFT_Y = 5


PLANE = (Parameter.OFFSET, Parameter.SLOPE_X, Parameter.SLOPE_Y)
PLACE_PARAMETERS = (Parameter.ANGLE, Parameter.SHIFT_X, Parameter.SHIFT_Y)
ALL = (*PLANE, *PLACE_PARAMETERS)


class Raster(NamedTuple):
    """Heights z (m, n) [m] of a scan on a regular grid."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Middle (x, y) [m]."""
        return np.array([self.x[0] + self.x[-1], self.y[0] + self.y[-1]]) / 2

    @property
    def half(self) -> np.ndarray:
        """Half lengths of the sides along x and y [m]."""
        return np.array([np.ptp(self.x), np.ptp(self.y)]) / 2

    @property
    def steps(self) -> np.ndarray:
        """Distances between neighbouring columns and between neighbouring rows [m]."""
        return np.array([np.ptp(self.x) / (self.x.size - 1), np.ptp(self.y) / (self.y.size - 1)])


def make_raster(scan: Areal) -> Raster:
    """Return a scan on a regular grid, with heights about their mean."""
    return Raster(scan.x, scan.y, scan.z - np.nanmean(scan.z))


def rotation(angle: float) -> np.ndarray:
    """Return the matrix (2, 2) of an anticlockwise rotation by an angle [rad]."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


class _Linearized(NamedTuple):
    """Depth (k,) [m] between two scans after subtraction of the plane, and its Jacobian (k, 6).

    place: rotation [rad] and shifts [m] of the second scan.
    """

    place: tuple
    difference: np.ndarray
    jacobian: np.ndarray


class ScanModel:
    """Depth of a second scan below a first one, as a function of the alignment.

    Parameters
    ----------
    before, after : Raster
    n_points : int
        Size of the sample.
    """

    # The robust fit of the plane keeps the position, which the fit to images determined.
    shifts = ()

    def __init__(self, before: Raster, after: Raster, n_points: int = N_POINTS):
        from scipy.ndimage import binary_erosion, gaussian_filter, spline_filter

        self.before = before
        self.after = after
        missing = np.isnan(after.z)
        self.spline = spline_filter(fill_missing(after.z, missing), 3)
        self.known = np.zeros(missing.shape, np.float32)
        inner = (slice(BORDER, -BORDER),) * 2
        self.known[inner] = ~missing[inner]
        self.is_cut = False
        self.min_scale = max(ROUND_OFF * float(np.nanstd(before.z)), 1e-300)
        missing = np.isnan(before.z)
        rows, columns = np.nonzero(binary_erosion(~missing))
        chosen = np.random.default_rng(2).permutation(rows.size)[:n_points]
        self.rows = rows[chosen]
        self.columns = columns[chosen]
        z = fill_missing(before.z, missing)
        self.short_waves = z - gaussian_filter(z, LONG_WAVES * min(z.shape), truncate=3.0)
        self._compute_slopes(MIN_SMOOTHING)

    @property
    def at(self) -> np.ndarray:
        """Points (k, 2) [m] of the sample, relative to the middle of the first scan."""
        x = self.before.x - self.before.middle[0]
        y = self.before.y - self.before.middle[1]
        return np.column_stack([x[self.columns], y[self.rows]])

    @property
    def reach(self) -> float:
        """Half of the diagonal of the first scan [m]."""
        return float(np.hypot(*self.before.half))

    def _compute_slopes(self, sigma: float) -> None:
        """Compute slopes of the short waves of the first scan by Gaussian derivatives.

        Smooth wear and slow errors of an instrument have long waves, whose slopes would shift the
        position. sigma: standard deviation of the Gaussian in pixels.
        """
        from scipy.ndimage import gaussian_filter

        parts = [
            gaussian_filter(self.short_waves, sigma, order)[self.rows, self.columns]
            for order in ((0, 1), (1, 0))
        ]
        self.slopes = np.column_stack(parts) / self.before.steps
        self._linearized = None

    def smooth_slope(self, scale: float) -> None:
        """Smooth the slopes until the noise [m] of the heights contributes little to them.

        Noise in the slopes correlates with noise in the depth and shortens the steps of the fit.
        The variance of a Gaussian derivative of white noise of variance 1 is 1 / (8 pi sigma^4).
        """
        slope = float(np.sqrt((self.slopes**2).mean())) * float(self.before.steps.mean())
        sigma = np.sqrt(scale / (np.sqrt(8 * np.pi) * SLOPE_NOISE * max(slope, 1e-300)))
        self._compute_slopes(float(np.clip(sigma, MIN_SMOOTHING, MAX_SMOOTHING)))

    def places(self, at, state) -> np.ndarray:
        """Return the rows and columns (2, k) in the second scan of points (k, 2) of the first scan.

        The points are in metres, relative to the middle of the first scan.
        """
        shift = state[[Parameter.SHIFT_X, Parameter.SHIFT_Y]]
        x, y = (at @ rotation(state[Parameter.ANGLE]).T + shift + self.before.middle).T
        pairs = ((y, self.after.y), (x, self.after.x))
        return np.array(
            [np.interp(where, axis, np.arange(axis.size), -9.0, -9.0) for where, axis in pairs]
        )

    def overlap(self, places) -> np.ndarray:
        """Return a mask of positions at which the second scan can be interpolated."""
        from scipy.ndimage import map_coordinates

        return map_coordinates(self.known, places, order=1, mode="constant", cval=0.0) > 0.999

    def read(self, places) -> np.ndarray:
        """Interpolate the heights [m] of the second scan."""
        from scipy.ndimage import map_coordinates

        return map_coordinates(self.spline, places, order=3, prefilter=False, mode="mirror")

    def linearize(self, state) -> tuple:
        """Return the depth (k,) [m] and its Jacobian (k, 6) at the sampled heights in the overlap.

        A fit of the plane alone calls this many times with the same position of the second scan, so the
        heights that were read there are kept.
        """
        place = tuple(state[3:])
        if self._linearized is None or self._linearized.place != place:
            self._linearized = self._linearize_place(state, place)
        _, difference, jacobian = self._linearized
        return difference + (state[0] + jacobian[:, 1:3] @ state[1:3]), jacobian

    def _linearize_place(self, state, place: tuple) -> "_Linearized":
        """Interpolate the second scan for given parameters, with the Jacobian."""
        at = self.at
        slopes = self.slopes
        z = self.before.z[self.rows, self.columns]
        places = self.places(at, state)
        if not self.is_cut:
            inside = self.overlap(places)
            at = at[inside]
            slopes = slopes[inside]
            z = z[inside]
            places = places[:, inside]
        along = at / self.before.half
        difference = z - self.read(places)
        by_angle = slopes[:, 0] * at[:, 1] - slopes[:, 1] * at[:, 0]
        by_shift = -slopes @ rotation(state[Parameter.ANGLE]).T
        jacobian = np.column_stack([np.ones(difference.size), along, by_angle, by_shift])
        return _Linearized(place, difference, jacobian)

    def limit_step(self, step, free) -> np.ndarray:
        """Limit a step of the fit to a displacement of a few pixels."""
        shift = MAX_STEP * float(self.before.steps.max())
        bound = np.array([np.inf, np.inf, np.inf, shift / self.reach, shift, shift])[list(free)]
        return np.clip(step, -bound, bound)

    def tolerances(self, scale: float) -> np.ndarray:
        """Return the parameter changes (6,) that change the depth by a given amount."""
        shift = scale / max(float(np.sqrt((self.slopes**2).mean())), 1e-12)
        return np.array([scale, scale, scale, shift / self.reach, shift, shift])

    def blocks(self, count: int) -> list:
        """Return the sampled heights of each tile, from which fits start."""
        part = np.clip(((self.at / self.before.half + 1) / 2 * N_TILES).astype(int), 0, N_TILES - 1)
        tile = part[:, 0] + N_TILES * part[:, 1]
        order = np.argsort(tile, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(tile[order])) + 1)
        return [part for part in parts if part.size >= MIN_TILE_HEIGHTS]

    def _select(self, chosen) -> "ScanModel":
        """Return the model restricted to some of its sampled heights."""
        out = copy(self)
        out.rows = self.rows[chosen]
        out.columns = self.columns[chosen]
        out.slopes = self.slopes[chosen]
        out._linearized = None
        return out

    def cut(self, state) -> "ScanModel":
        """Return the model restricted to heights that overlap the second scan."""
        inside = self.overlap(self.places(self.at, state))
        if inside.sum() < MIN_HEIGHTS:
            raise PatchfemError("hardly any heights of the two scans coincide")
        out = self._select(inside)
        out.is_cut = True
        return out

    def thin(self, count: int) -> "ScanModel":
        """Return the model restricted to a random subset of heights."""
        return self._select(slice(count))

    def map_depth(self, state) -> np.ndarray:
        """Compute the depth (m, n) [m] at all points of the first scan."""
        out = np.empty(self.before.z.shape)
        for part, at in self._parts():
            places = self.places(at, state)
            inside = self.overlap(places)
            height = np.full(len(at), np.nan)
            height[inside] = self.read(places[:, inside])
            out[part] = self.before.z[part] - height.reshape(out[part].shape)
        return out + self.plane_map(state)

    def map_overlap(self, state) -> np.ndarray:
        """Return a mask (m, n) of the points of the first scan that lie within the second."""
        out = np.empty(self.before.z.shape, bool)
        for part, at in self._parts():
            out[part] = (self.places(at, state) >= 0).all(axis=0).reshape(out[part].shape)
        return out

    def _parts(self):
        """Yield slices of rows of the first scan and their points (k, 2) [m] relative to its middle."""
        x = self.before.x - self.before.middle[0]
        y = self.before.y - self.before.middle[1]
        count = max(BLOCK // x.size, 1)
        for first in range(0, y.size, count):
            part = slice(first, first + count)
            yield part, np.stack(np.broadcast_arrays(x, y[part, None]), axis=-1).reshape(-1, 2)

    def plane_map(self, state) -> np.ndarray:
        """Compute the plane (m, n) [m] that the alignment parameters describe."""
        u = (self.before.x - self.before.middle[0]) / self.before.half[0]
        v = (self.before.y - self.before.middle[1]) / self.before.half[1]
        return state[0] + state[1] * u + state[2] * v[:, None]
