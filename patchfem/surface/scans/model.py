"""Model of a second scan: where places of the first scan lie on it, and how its datum differs.

A place p of the first scan, from the middle of that scan, lies in the second one at R(angle) p + shift,
from the same point, with R anticlockwise. The depth of the second scan below the first one there is

    w(p) = z_before(p) - z_after(R p + shift) + offset + slope_x u + slope_y v,

with u and v from -1 to 1 over the first scan.
"""

from copy import copy
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ..areal import Areal, filled

MIN_HEIGHTS = 400  # fewer common heights are no comparison
N_POINTS = 60_000  # heights of a fit: a shift is known to a few thousandths of a pixel then
N_TILES = 8  # tiles along each side, whose modes give the starts of a fit
MIN_TILE = 12  # heights of such a tile
ROUNDING = 1e-9  # of the scatter of the heights: smaller differences are rounding
SLOPE_NOISE = 0.05  # noise over signal that a slope of the first scan may have
MAX_SMOOTHING = 8.0  # pixels: largest standard deviation of the Gaussian that gives slopes
MIN_SMOOTHING = 0.7  # pixels: the same, smallest
LONG_WAVES = (
    0.05  # of the shorter side: standard deviation of the Gauss filter whose mean gives no slope
)
MAX_STEP = 4.0  # pixels that a step of the fit may move a place
RIM = 2  # pixels at the border of a scan where cubic interpolation is inaccurate
CHUNK = 1 << 20  # heights of a map that are read at a time
SEED = 2


class Parameter(IntEnum):
    """Positions of the parameters in a state; slopes are heights [m] at the edges of the first scan."""

    OFFSET = 0
    SLOPE_X = 1
    SLOPE_Y = 2
    ANGLE = 3
    SHIFT_X = 4
    SHIFT_Y = 5


PLANE = (Parameter.OFFSET, Parameter.SLOPE_X, Parameter.SLOPE_Y)
PLACE = (Parameter.ANGLE, Parameter.SHIFT_X, Parameter.SHIFT_Y)
ALL = (*PLANE, *PLACE)


class Raster(NamedTuple):
    """Heights z (m, n) [m], NaN where none was measured, at x (n,) and y (m,) [m]."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Middle (x, y) [m]."""
        return np.array([self.x[0] + self.x[-1], self.y[0] + self.y[-1]]) / 2

    @property
    def half(self) -> np.ndarray:
        """Half of the sides (x, y) [m]."""
        return np.array([np.ptp(self.x), np.ptp(self.y)]) / 2

    @property
    def steps(self) -> np.ndarray:
        """Distances of columns and of rows [m]."""
        return np.array([np.ptp(self.x) / (self.x.size - 1), np.ptp(self.y) / (self.y.size - 1)])


def raster_of(scan: Areal) -> Raster:
    """Return the heights of a scan about their mean."""
    return Raster(scan.x, scan.y, scan.z - np.nanmean(scan.z))


def rotation(angle: float) -> np.ndarray:
    """Return the matrix (2, 2) of a rotation, anticlockwise > 0."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


class ScanModel:
    """Depth of a second scan below a first one, at some heights of the first, as a function of a state (6,)."""

    shifts = ()  # the fit to images knows the place; least trimmed squares move the plane alone

    def __init__(self, before: Raster, after: Raster, n_points: int = N_POINTS):
        from scipy.ndimage import binary_erosion, gaussian_filter, spline_filter

        self.before = before
        self.after = after
        missing = np.isnan(after.z)
        self.spline = spline_filter(filled(after.z, missing), 3)
        self.known = (~missing).astype(np.float32)
        for edge in (np.s_[:RIM], np.s_[-RIM:], np.s_[:, :RIM], np.s_[:, -RIM:]):
            self.known[edge] = 0.0
        self.is_cut = False
        self.least = max(ROUNDING * float(np.nanstd(before.z)), 1e-300)
        rows, columns = np.nonzero(binary_erosion(~np.isnan(before.z)))
        chosen = np.random.default_rng(SEED).permutation(rows.size)[:n_points]
        self.rows, self.columns = rows[chosen], columns[chosen]
        z = filled(before.z, np.isnan(before.z))
        self.short_waves = z - gaussian_filter(z, LONG_WAVES * min(z.shape), truncate=3.0)
        self._take_slopes(MIN_SMOOTHING)

    @property
    def at(self) -> np.ndarray:
        """Places (k, 2) [m] of the heights from the middle of the first scan."""
        x, y = self.before.x - self.before.middle[0], self.before.y - self.before.middle[1]
        return np.column_stack([x[self.columns], y[self.rows]])

    @property
    def reach(self) -> float:
        """Half of the diagonal of the first scan [m]."""
        return float(np.hypot(*self.before.half))

    def _take_slopes(self, sigma: float) -> None:
        """Take slopes of the first scan, without its long waves, from Gaussian derivatives over `sigma` pixels.

        Smooth wear and slow errors of a scan have long waves and would move the place by their slopes.
        """
        from scipy.ndimage import gaussian_filter

        z = self.short_waves
        parts = [
            gaussian_filter(z, sigma, order)[self.rows, self.columns] for order in ((0, 1), (1, 0))
        ]
        self.slopes = np.column_stack(parts) / self.before.steps

    def smooth_slope(self, scale: float) -> None:
        """Take slopes so smooth that the noise [m] of the heights leaves little in them.

        A slope between noisy neighbours errs together with their heights and makes the steps of the
        fit too short. The variance of a Gaussian derivative of white noise of variance 1 is
        1 / (8 pi sigma^4).
        """
        steep = float(np.sqrt((self.slopes**2).mean())) * float(self.before.steps.mean())
        sigma = np.sqrt(scale / (np.sqrt(8 * np.pi) * SLOPE_NOISE * max(steep, 1e-300)))
        self._take_slopes(float(np.clip(sigma, MIN_SMOOTHING, MAX_SMOOTHING)))

    def places(self, at, state) -> np.ndarray:
        """Return rows and columns (2, k) in the second scan of places (k, 2) [m] from the middle of the first."""
        x, y = (
            at @ rotation(state[Parameter.ANGLE]).T
            + state[[Parameter.SHIFT_X, Parameter.SHIFT_Y]]
            + self.before.middle
        ).T
        rows = np.interp(y, self.after.y, np.arange(self.after.y.size), -9.0, -9.0)
        return np.array(
            [rows, np.interp(x, self.after.x, np.arange(self.after.x.size), -9.0, -9.0)]
        )

    def overlap(self, places) -> np.ndarray:
        """Return whether all four neighbours of a place in the second scan are known."""
        from scipy.ndimage import map_coordinates

        return map_coordinates(self.known, places, order=1, mode="constant", cval=0.0) > 0.999

    def read(self, places) -> np.ndarray:
        """Return the heights [m] of the second scan at places (2, k)."""
        from scipy.ndimage import map_coordinates

        return map_coordinates(self.spline, places, order=3, prefilter=False, mode="mirror")

    def linearize(self, state) -> tuple:
        """Return the depth (k,) [m] and its Jacobian (k, 6) at the heights that lie on the second scan."""
        at, slopes, z = self.at, self.slopes, self.before.z[self.rows, self.columns]
        places = self.places(at, state)
        if not self.is_cut:
            inside = self.overlap(places)
            at, slopes, z, places = at[inside], slopes[inside], z[inside], places[:, inside]
        along = at / self.before.half
        depth = z - self.read(places)
        depth += state[0] + along @ state[1:3]
        by_angle = slopes[:, 0] * at[:, 1] - slopes[:, 1] * at[:, 0]
        by_shift = -slopes @ rotation(state[Parameter.ANGLE]).T
        return depth, np.column_stack([np.ones(depth.size), along, by_angle, by_shift])

    def limit(self, step, free) -> np.ndarray:
        """Limit a step of the fit to a few pixels."""
        most = MAX_STEP * float(self.before.steps.max())
        bounds = {
            Parameter.ANGLE: most / self.reach,
            Parameter.SHIFT_X: most,
            Parameter.SHIFT_Y: most,
        }
        bound = np.array([bounds.get(k, np.inf) for k in free])
        return np.clip(step, -bound, bound)

    def tolerances(self, scale: float) -> np.ndarray:
        """Return the changes (6,) of the parameters that change the depth by `scale` [m]."""
        moved = scale / max(float(np.sqrt((self.slopes**2).mean())), 1e-12)
        return np.array([scale, scale, scale, moved / self.reach, moved, moved])

    def blocks(self, count: int) -> list:
        """Return the blocks of heights whose modes give the starts of a fit: tiles of the first scan."""
        part = np.clip(((self.at / self.before.half + 1) / 2 * N_TILES).astype(int), 0, N_TILES - 1)
        tile = part[:, 0] + N_TILES * part[:, 1]
        order = np.argsort(tile, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(tile[order])) + 1)
        return [part for part in parts if part.size >= MIN_TILE]

    def cut(self, state) -> "ScanModel":
        """Return the model of the heights that lie on the second scan in a state, of these alone."""
        out = copy(self)
        inside = self.overlap(self.places(self.at, state))
        if inside.sum() < MIN_HEIGHTS:
            raise PatchfemError("hardly any heights of the two scans coincide")
        out.rows, out.columns, out.slopes = (
            self.rows[inside],
            self.columns[inside],
            self.slopes[inside],
        )
        out.is_cut = True
        return out

    def thinned(self, count: int) -> "ScanModel":
        """Return the model with about so many heights; they are in random order."""
        out = copy(self)
        out.rows, out.columns, out.slopes = (
            self.rows[:count],
            self.columns[:count],
            self.slopes[:count],
        )
        return out

    def map_depth(self, state) -> np.ndarray:
        """Return the depth (m, n) [m] at all heights of the first scan, NaN where one is missing."""
        out = np.empty(self.before.z.shape)
        for part, at in self._parts():
            places = self.places(at, state)
            inside = self.overlap(places)
            height = np.full(len(at), np.nan)
            height[inside] = self.read(places[:, inside])
            out[part] = self.before.z[part] - height.reshape(out[part].shape)
        return out + self.plane_map(state)

    def map_overlap(self, state) -> np.ndarray:
        """Return whether each place (m, n) of the first scan lies within the second one, measured or not."""
        out = np.empty(self.before.z.shape, bool)
        for part, at in self._parts():
            out[part] = (self.places(at, state) >= 0).all(axis=0).reshape(out[part].shape)
        return out

    def _parts(self):
        """Yield rows of the first scan as a slice, and their places (k, 2) [m] from its middle."""
        x, y = self.before.x - self.before.middle[0], self.before.y - self.before.middle[1]
        count = max(CHUNK // x.size, 1)
        for first in range(0, y.size, count):
            part = slice(first, first + count)
            yield part, np.stack(np.broadcast_arrays(x, y[part, None]), axis=-1).reshape(-1, 2)

    def plane_map(self, state) -> np.ndarray:
        """Return the plane (m, n) [m] of a state."""
        u = (self.before.x - self.before.middle[0]) / self.before.half[0]
        v = (self.before.y - self.before.middle[1]) / self.before.half[1]
        return state[0] + state[1] * u + state[2] * v[:, None]
