"""Two areal scans of the same region: the place of the second one on the first, and the depth between.

A point p of the first scan is at c + R(rotation) (p - c) + shift on the second one, with the middle c
of the first. The depth there is z1 + plane - z2.
"""

from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ..areal import Areal, fill_nearest
from ..profile import robust_deviation
from .search import correlate, find_datum, whiten
from .statistics import (
    compute_threshold,
    estimate_one_sided_scale,
    remove_long_waves,
    solve_biweight_step,
)

SEARCH_PIXELS = 96  # points along the longer side of the images that are correlated
ANGLES = np.radians(
    np.arange(-6, 6.1, 0.5)
)  # rotations that the search tries, and the same turned by 180 degrees
WAVES_PER_SIDE = (
    20  # side of a scan relative to the deviation of the Gaussian that removes long waves
)
MIN_OVERLAP = 0.3  # smallest common region relative to the smaller scan
BORDER_POINTS = (
    3  # distance from the border of a scan, in points, from which on its spline is accurate
)
KINK_POINTS = 5  # side of the square over which an error of interpolation at a kink spreads
N_TILES = 8  # number of tiles along each side, whose modes span the planes
SQUARES = (1, 3, 9, 25)  # sides of the squares whose mean depth is tested
UNCHANGED_FRACTION = 0.25  # fraction of the squares above or below zero that are unchanged at least
MAX_PULL = 8.0  # standard deviations to which a single depth counts in a mean
REFINE_WIDTHS = (
    4,
    3,
    2,
    1,
    0,
    0,
    0,
    0,
)  # deviations of the Gaussians that smooth both scans in turn


class ScanPlace(NamedTuple):
    """Shift along x and y [m], rotation [rad], and the significance of the correlation there."""

    shift_x: float
    shift_y: float
    rotation: float
    significance: float


def find_scan_place(before: Areal, after: Areal) -> ScanPlace:
    """Find the place of the second scan by the whitened correlation of the valleys of small images."""
    pixel = (
        max(np.ptp(before.x), np.ptp(before.y), np.ptp(after.x), np.ptp(after.y)) / SEARCH_PIXELS
    )
    first, second = (_make_image(scan, pixel) for scan in (before, after))
    best = ScanPlace(0.0, 0.0, 0.0, -np.inf)
    for angle in np.concatenate((ANGLES, ANGLES + np.pi)):
        # Turning the image of the second scan back by its rotation; row numbers increase with y.
        turned = ndimage.rotate(second, np.degrees(angle), reshape=False, order=1)
        significance = correlate(first, turned, MIN_OVERLAP)
        at = np.unravel_index(np.argmax(significance), significance.shape)
        if significance[at] > best.significance:
            lag = [k if k < n / 2 else k - n for k, n in zip(at, significance.shape)]
            shapes = (first.shape, second.shape)
            found = (float(angle), float(significance[at]))
            best = _locate(before, after, pixel, shapes, lag, *found)
    return best


def _make_image(scan: Areal, pixel: float) -> np.ndarray:
    """Return the whitened valleys of a scan on square pixels [m]."""
    steps = np.array([np.diff(scan.y).mean(), np.diff(scan.x).mean()])
    z = ndimage.gaussian_filter(fill_nearest(scan.z), 0.4 * pixel / steps)
    z = remove_long_waves(ndimage.zoom(z, np.minimum(steps / pixel, 1.0), order=1), 12)
    z = np.clip(z, -3 * z.std(), np.median(z))
    return whiten(z - z.mean())


def _locate(before, after, pixel, shapes, lag, angle: float, significance: float) -> ScanPlace:
    """Return the place that belongs to a lag (rows, columns) of the turned second image."""
    middles = [np.array([scan.y.mean(), scan.x.mean()]) for scan in (before, after)]
    centers = [(np.array(shape) - 1) / 2 for shape in shapes]
    # The middle of the second image lies at this place of the first scan.
    place = middles[0] + (centers[1] + lag - centers[0]) * pixel
    cos = np.cos(angle)
    sin = np.sin(angle)
    dy, dx = place - middles[0]
    shift_x = middles[1][1] - middles[0][1] - (cos * dx - sin * dy)
    shift_y = middles[1][0] - middles[0][0] - (sin * dx + cos * dy)
    return ScanPlace(float(shift_x), float(shift_y), angle, significance)


class ScanModel:
    """Depth of the second scan below the first as a function of [shift x, y, rotation, plane (3)].

    It holds each `stride`-th point of the first scan. Depths are flat arrays (n,) of the points in
    `known`, which both scans show at the first state.
    """

    def __init__(self, before: Areal, after: Areal, state, stride: int = 1):
        """Choose the common points at a state."""
        self.x = before.x[::stride]
        self.y = before.y[::stride]
        self.z = before.z[::stride, ::stride]
        self.shape = self.z.shape
        self.steps = np.array([np.diff(after.y).mean(), np.diff(after.x).mean()])
        self.start = np.array([after.y[0], after.x[0]])
        filled = fill_nearest(after.z)
        self.spline = ndimage.spline_filter(filled)
        self.gradient = [g / step for g, step in zip(np.gradient(filled), self.steps)]
        self.middle = np.array([before.y.mean(), before.x.mean()])
        self.points = (
            np.array(np.meshgrid(self.y, self.x, indexing="ij")) - self.middle[:, None, None]
        )
        half = np.array([np.ptp(before.y), np.ptp(before.x)]) / 2
        v, u = self.points / half[:, None, None]
        self.plane = np.array([np.ones(u.shape), u, v])
        self.keep_common(state, np.isfinite(after.z))

    def keep_common(self, state, is_measured) -> None:
        """Keep the points that both scans show at a state; `common` has those at the border of the second one too."""
        pixels = self._map_pixels(state)
        weights = ndimage.map_coordinates(is_measured.astype(float), pixels, order=1, cval=0.0)
        self.common = np.isfinite(self.z) & (weights > 0.99)
        # The spline has larger errors of interpolation at its border.
        last = np.array(is_measured.shape)[:, None, None] - 1 - BORDER_POINTS
        self.known = self.common & ((pixels >= BORDER_POINTS) & (pixels <= last)).all(axis=0)

    def _map_pixels(self, state) -> np.ndarray:
        """Return the rows and columns (2, m, n) of the points in the second scan."""
        cos = np.cos(state[2])
        sin = np.sin(state[2])
        dy, dx = self.points
        turned = np.array([sin * dx + cos * dy + state[1], cos * dx - sin * dy + state[0]])
        return (turned + (self.middle - self.start)[:, None, None]) / self.steps[:, None, None]

    def compute_map(self, state) -> np.ndarray:
        """Return the depth (m, n) [m]; NaN where it is unknown."""
        depth = np.full(self.shape, np.nan)
        depth[self.known] = self.compute_depth(state)
        return depth

    def compute_depth(self, state) -> np.ndarray:
        """Return the depth (n,) [m] of the known points."""
        pixels = self._map_pixels(state)[:, self.known]
        # The coefficients of a spline are those of a mirrored border.
        second = ndimage.map_coordinates(self.spline, pixels, prefilter=False, mode="mirror")
        return self.z[self.known] + state[3:] @ self.plane[:, self.known] - second

    def compute_jacobian(self, state) -> np.ndarray:
        """Return the derivative (n, 6) of the depth by the state."""
        pixels = self._map_pixels(state)[:, self.known]
        gy, gx = (
            ndimage.map_coordinates(g, pixels, order=1, mode="nearest") for g in self.gradient
        )
        dy, dx = self.points[:, self.known]
        cos = np.cos(state[2])
        sin = np.sin(state[2])
        turn = gx * (-sin * dx - cos * dy) + gy * (cos * dx - sin * dy)
        return np.column_stack((-gx, -gy, -turn, *self.plane[:, self.known]))

    def compute_noise_terms(self, jacobian) -> np.ndarray:
        """Return terms (n, 3) of the variance: of the instrument, of positions on slopes, at kinks."""
        slopes = jacobian[:, 0] ** 2 + jacobian[:, 1] ** 2
        return np.column_stack((np.ones(len(jacobian)), slopes, self.kinks[self.known] ** 2))

    def find_changed(self, depth, noise) -> np.ndarray:
        """Return the points (n,) bool whose mean depth over a square noise does not explain."""
        relative = np.full(self.shape, np.nan)
        relative[self.known] = depth / noise
        return find_changed_points(relative, self.known).points[self.known]

    def refine_place(self, state) -> np.ndarray:
        """Improve shift and rotation by biweight steps on the short waves, smoothed less and less."""
        state = np.array(state, float)
        for width in REFINE_WIDTHS:
            depth = self._remove_waves(self.compute_depth(state), width)
            jacobian = np.column_stack(
                [
                    self._remove_waves(column, width)
                    for column in self.compute_jacobian(state)[:, :3].T
                ]
            )
            sigma = max(robust_deviation(depth), 1e-15)
            state[:3] += solve_biweight_step(depth, jacobian, sigma)
        return state

    def _remove_waves(self, values, width: float) -> np.ndarray:
        image = np.full(self.shape, np.nan)
        image[self.known] = values
        smooth = ndimage.gaussian_filter(fill_nearest(image), width)
        return remove_long_waves(smooth, WAVES_PER_SIDE)[self.known]

    @cached_property
    def kinks(self) -> np.ndarray:
        """Largest second difference (m, n) [m] of the first scan near each point."""
        bend = np.abs(ndimage.laplace(fill_nearest(self.z)))
        return ndimage.maximum_filter(bend, KINK_POINTS)

    @cached_property
    def tiles(self) -> list[tuple[slice, slice]]:
        """Tiles of the map, row by row."""
        rows, columns = (np.linspace(0, n, N_TILES + 1).astype(int) for n in self.shape)
        tiles = []
        for top, bottom in pairwise(rows):
            tiles += [(slice(top, bottom), slice(*ends)) for ends in pairwise(columns)]
        return tiles

    def find_plane(self, state) -> np.ndarray:
        """Return the state with the plane on which the unworn heights lie."""
        numbers = np.full(self.shape, -1)
        numbers[self.known] = np.arange(self.known.sum())
        tiles = [numbers[tile] for tile in self.tiles]
        tiles = [tile[tile >= 0] for tile in tiles]
        base = self.plane[:, self.known].T
        state = state.copy()
        state[3:] += find_datum(base, self.compute_depth(state), tiles, [])
        return state


class ChangedPoints(NamedTuple):
    """Changed points (m, n) bool, and the mean depth, in standard deviations, from which on a large square is found."""

    points: np.ndarray
    limit: float


def find_changed_points(relative, known) -> ChangedPoints:
    """Find the points whose mean relative depth over squares exceeds their scatter.

    Parameters
    ----------
    relative : (m, n) array
        Depth in standard deviations.
    known : (m, n) bool array
        Points whose depth is known.
    """
    limit = compute_threshold(len(SQUARES) * relative.size)
    single = np.where(known, relative, 0.0)
    remainder = np.clip(single, -MAX_PULL, MAX_PULL)
    changed = np.zeros(relative.shape, bool)
    for side in SQUARES:
        if side > min(relative.shape) / 4:
            break
        use = known & ~changed
        weight = ndimage.uniform_filter(use.astype(float), side)
        values = single if side == 1 else remainder
        mean = ndimage.uniform_filter(np.where(use, values, 0.0), side) / np.maximum(weight, 0.25)
        scatter = estimate_one_sided_scale(mean[use & (weight > 0.5)], UNCHANGED_FRACTION)
        scatter = max(scatter, 1 / side)
        high = (mean > limit * scatter) & (weight > 0.25)
        lowest = limit * scatter
        if side == 1:
            changed |= ndimage.binary_opening(high, np.ones((3, 3)))
        else:
            changed |= ndimage.binary_dilation(high, np.ones((side, side)))
    points = ndimage.binary_opening(changed, np.ones((4, 4))) & known
    return ChangedPoints(points, float(lowest))
