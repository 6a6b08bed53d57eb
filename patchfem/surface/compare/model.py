"""Depth of the second surface below the first one, as a function of place and datum.

A point p of the sampled surface, which is the second trace or the first scan, lies at c + M (p - c) + shift on the
other one, where c is the middle of the sampled one; M stretches a trace or rotates a scan. The depth there is z1 +
datum - z2, with a straight or parabolic datum of traces and a plane of scans. With another gain 1 + e of the
instrument, it is (z1 + e z1 + datum - z2)/(1 + e), with the waves of z1 about its plane in the term e z1. The state is
[shift (d), turn, datum (k), e], axes in the order y, x.
"""

from functools import cached_property
from itertools import combinations

import numpy as np
from scipy import ndimage

from ..profile import robust_deviation
from .changes import find_changed
from .place import Place, make_matrix
from .raster import Raster, fill_gaps
from .statistics import (
    find_box,
    find_mode,
    smooth,
    solve_biweight_step,
    split_tiles,
    subtract_plane,
)
from .tops import find_worn_tops

# Distance from the border of a surface from which on its spline is accurate
INACCURATE_BORDER_SAMPLES = 3
# Standard deviations in samples of the Gaussians that smooth both surfaces, one for each step that refines the place
REFINING_GAUSSIAN_SAMPLES = (16, 8, 4, 3, 2, 1, 0, 0, 0)
MAX_GAIN_CHANGE = 0.3  # largest change of the gain of an instrument


class Model:
    """Model of the depth between two surfaces as a function of position, datum and gain, for least squares.

    The depth is the difference of both heights at the points of one of them, the sampled surface: the first of two scans,
    the second of two traces. The other surface is interpolated by a spline. `known` selects the n points at which both
    surfaces have heights in the initial position.

    Most methods take a `state` with all parameters: d shifts [m] and a turn (rotation [rad] of scans, stretch of traces)
    of the second surface, then k factors [m] of the datum, a line, parabola or plane, and last the change of the gain
    [1]. Before the gain is fitted, `max_gain_change` bounds this change.
    """

    def __init__(self, sampled: Raster, other: Raster, place: Place, stride: int = 1):
        """Select the points that both surfaces have in common in an initial position.

        Parameters
        ----------
        sampled : Raster
            Surface at whose points depths are computed.
        other : Raster
            Surface that is interpolated.
        place : Place
            Initial position of the second surface.
        stride : int
            Of the sampled points only every `stride`-th one along each axis is used.
        """
        every = (..., *(slice(None, None, stride),) * sampled.z.ndim)
        self.sampled = Raster(sampled.z[every], sampled.origin, sampled.steps * stride)
        self.n_axes = sampled.z.ndim
        # Heights are known along the sampled surface: the depth is sampled minus other for scans, the reverse for traces.
        self.sign = 1.0 if self.n_axes > 1 else -1.0
        self.other = other
        filled = fill_gaps(other.z)
        self.spline = ndimage.spline_filter(filled)
        self.gradient = [
            np.gradient(filled, step, axis=axis) for axis, step in enumerate(other.steps)
        ]
        # Number of samples over which an error of interpolation at a kink spreads
        self.bend = ndimage.maximum_filter(np.abs(ndimage.laplace(filled)), 7)

        self.middle = self._shape(sampled.middle)
        points = np.array(np.meshgrid(*sampled.axes, indexing="ij")) - self.middle
        unit = points / self._shape(sampled.lengths / 2)
        columns = np.array([np.ones(sampled.z.shape), *unit[::-1]])
        bend = unit**2 if self.n_axes == 1 else unit[:0]
        self.points = points[every]
        self.datum = np.concatenate((columns, bend))[every]
        # The gain belongs to the first surface, as a track of the second one would be its own gain.
        if self.n_axes > 1:
            self.waves = subtract_plane(fill_gaps(sampled.z), columns)[every[1:]]
        else:
            line = np.array([np.ones(filled.size), np.linspace(-1, 1, filled.size)])
            self.waves = ndimage.spline_filter(subtract_plane(filled, line))
        self.start = np.concatenate((place.shift, [place.turn], np.zeros(len(self.datum) + 1)))
        self.max_gain_change = MAX_GAIN_CHANGE
        self.keep_common(self.start)

    def _shape(self, values) -> np.ndarray:
        """Return values (d,), one for each axis, in a shape that broadcasts with points (d, ...)."""
        return np.reshape(values, (-1,) + (1,) * self.n_axes)

    def keep_common(self, state) -> None:
        """Set the masks of the points that both surfaces show at a state.

        `common` has all of them, and `known` those that are not near the border of the other surface, where the spline
        is inaccurate.
        """
        pixels = self._map_pixels(state)
        measured = np.isfinite(self.other.z).astype(float)
        weights = ndimage.map_coordinates(measured, pixels, order=1, cval=0.0)
        # Weight of measured neighbours of a point whose height is known
        self.common = np.isfinite(self.sampled.z) & (weights > 0.99)
        last = self._shape(self.other.z.shape) - 1 - INACCURATE_BORDER_SAMPLES
        self.known = self.common & ((pixels >= INACCURATE_BORDER_SAMPLES) & (pixels <= last)).all(
            axis=0
        )

    def _map_pixels(self, state) -> np.ndarray:
        """Return the positions (d, ...) of the sampled points on the other surface at a state, in steps of its raster."""
        turned = np.tensordot(make_matrix(state[self.n_axes], self.n_axes), self.points, 1)
        start = self.middle + self._shape(state[: self.n_axes] - self.other.origin)
        return (turned + start) / self._shape(self.other.steps)

    def compute_depth(self, state) -> np.ndarray:
        """Return the depth (n,) [m] of the second surface below the datum at the n known points.

        `state` (k,) has the shifts [m], the turn [rad], the factors of the datum, and the change of the gain.
        """
        pixels = self._map_pixels(state)[:, self.known]
        # The coefficients of a spline are those of a mirrored border.
        other = ndimage.map_coordinates(self.spline, pixels, prefilter=False, mode="mirror")
        datum = state[self.n_axes + 1 : -1] @ self.datum[:, self.known]
        depth = self.sign * (self.sampled.z[self.known] - other) + datum
        return (depth + state[-1] * self._get_waves(pixels)) / (1 + state[-1])

    def _get_waves(self, pixels) -> np.ndarray:
        """Return the heights (n,) [m] of the first surface about its plane at the known points.

        `pixels` (d, n) are the places of these points on the other surface.
        """
        if self.n_axes > 1:
            return self.waves[self.known]
        return ndimage.map_coordinates(self.waves, pixels, prefilter=False, mode="mirror")

    def compute_jacobian(self, state) -> np.ndarray:
        """Return the derivative (n, d + 2 + k) of the depth by the numbers of a state."""
        pixels = self._map_pixels(state)[:, self.known]
        slopes = np.array(
            [
                ndimage.map_coordinates(part, pixels, order=1, mode="nearest")
                for part in self.gradient
            ]
        )
        # A rotation turns further by a right angle; a stretch moves points along themselves.
        turn = state[self.n_axes]
        if self.n_axes > 1:
            further = make_matrix(turn + np.pi / 2, self.n_axes)
        else:
            further = np.eye(1)
        moved = (slopes * (further @ self.points[:, self.known])).sum(axis=0)
        place = -self.sign * np.vstack((slopes, moved))
        return np.vstack((place, self.datum[:, self.known], self._get_waves(pixels))).T

    def compute_noise_terms(self, state, jacobian) -> np.ndarray:
        """Return terms (n, 3) of the variance of depths: instrument, positions on slopes, kinks.

        Each is multiplied by a factor that is fitted. The `jacobian` is that of the depth at this state.
        """
        slopes = (jacobian[:, : self.n_axes] ** 2).sum(axis=1)
        pixels = self._map_pixels(state)[:, self.known]
        kinks = ndimage.map_coordinates(self.bend, pixels, order=0, mode="nearest")
        return np.column_stack((np.ones(slopes.size), slopes, kinks**2))

    def draw(self, values, fill=np.nan) -> np.ndarray:
        """Return values (n,) of the known points as a map of the sampled surface; its other points get `fill`."""
        image = np.full(self.sampled.z.shape, fill, dtype=np.asarray(values).dtype)
        image[self.known] = values
        return image

    def find_changed(self, depth, noise) -> np.ndarray:
        """Return a mask (n,) of points whose positive depth (n,) [m] exceeds what noise (n,) [m] explains."""
        return find_changed(self.draw(depth), self.draw(noise))[self.known]

    def find_worn(self, depth, noise) -> np.ndarray:
        """Return a mask (n,) of the worn points, which includes narrow or hardly worn tops.

        `depth` and `noise` (n,) [m] are the depths and the standard deviation of an unworn one.
        """
        worn = self.find_changed(depth, noise)
        height = (self.sampled.z[self.known] - self.sign * depth / 2) / np.median(noise)
        relative = self.draw(np.where(worn, 0.0, depth / noise), 0.0)
        tops = find_worn_tops(relative, fill_gaps(self.draw(height)), self.max_gain_change)
        return worn | tops[self.known]

    def refine_place(self) -> np.ndarray:
        """Return the state at which the short waves of both surfaces agree best.

        It is found by robust (biweight) Gauss-Newton steps on both surfaces, which are smoothed less and less.
        """
        state = self.start.copy()
        place = slice(0, self.n_axes + 1)
        for width in REFINING_GAUSSIAN_SAMPLES:
            if 2 * width > self.smoothing.max():
                continue
            depth = self._filter(self.compute_depth(state), width)
            columns = self.compute_jacobian(state)[:, place].T
            jacobian = np.column_stack([self._filter(column, width) for column in columns])
            sigma = max(robust_deviation(depth), 1e-15)
            state[place] += solve_biweight_step(depth, jacobian, sigma)
        return state

    @cached_property
    def smoothing(self) -> np.ndarray:
        """Standard deviations (d,), in samples, of the Gaussian that removes the long waves when the position is refined."""
        sizes = np.array(self.sampled.z.shape) / {1: 100, 2: 20}[self.n_axes]
        # Smallest standard deviation, in samples of a trace, of the Gaussian whose longer waves are
        # not used to refine the place
        return np.maximum(sizes, 10.0) if self.n_axes == 1 else sizes

    def _filter(self, values, width: float) -> np.ndarray:
        """Return values (n,) smoothed by a Gaussian and without their long waves.

        `width` is the standard deviation of the Gaussian in samples.
        """
        image = fill_gaps(self.draw(values))
        return (smooth(image, width) - smooth(image, np.hypot(self.smoothing, width)))[self.known]

    def find_datum(self, state, n_terms: int) -> np.ndarray:
        """Return a copy of a state whose first `n_terms` factors of the datum put it through the unworn heights.

        `state` is that of `compute_depth`.
        """
        numbers = self.draw(np.arange(self.known.sum()), -1)[find_box(self.known)]
        # The modes of tiles span the datums
        parts = [numbers[part] for part in split_tiles(numbers.shape, {1: 20, 2: 8}[self.n_axes])]
        # Smallest number of known heights in a tile
        tiles = [part[part >= 0] for part in parts if (part >= 0).sum() >= 4]
        ends = [tiles[0], tiles[-1]] if self.n_axes == 1 else []
        state = state.copy()
        base = self.datum[:n_terms, self.known].T
        first = self.n_axes + 1
        state[first : first + n_terms] += find_datum(base, self.compute_depth(state), tiles, ends)
        return state


def find_datum(base, depth, tiles: list, ends: list) -> np.ndarray:
    """Return the factors (k,) of the datum on which the unworn heights lie.

    Each trial datum passes through the most frequent depths of k tiles, and is improved by concentration steps of least
    trimmed squares (Rousseeuw and Van Driessen 1999). Of the trials with the smallest residuals that one is chosen which
    agrees with many heights, also at an end that may be unworn, and which few heights exceed, as wear does not raise a
    surface.

    Parameters
    ----------
    base : (n, k) array
        Functions of which the datum is a combination.
    depth : (n,) array [m]
        Depths without the datum.
    tiles, ends : list
        Indices of the heights of each tile, and of each end that may be unworn.
    """
    random = np.random.default_rng(0)

    # Candidates: the datums through the most frequent depths (modes) of k tiles, of at most 3000 subsets of tiles
    modes = np.array([find_mode(depth[tile]) for tile in tiles])
    centers = np.array([base[tile].mean(axis=0) for tile in tiles])
    subsets = np.array(list(combinations(range(len(tiles)), base.shape[1])))
    subsets = subsets[random.permutation(len(subsets))[:3000]]
    # Smallest determinant of the mean datum functions of some tiles. Below it these tiles do not determine a datum.
    subsets = subsets[np.abs(np.linalg.det(centers[subsets])) > 1e-3]
    datums = np.linalg.solve(centers[subsets], -modes[subsets][..., None])[..., 0]

    # Their scale is the distance within which a fifth of some heights lie
    # Number of heights from which the datum is found
    thin = np.arange(0, depth.size, max(depth.size // 2000, 1))
    few_base = base[thin]
    few = depth[thin]
    # A quarter of the heights shows which datums are worth improving.
    scales = _scale_datums(datums, few_base[::4], few[::4])
    # Number of datums that are improved by concentration steps
    datums = datums[np.argsort(scales)[:150]]
    # Concentration step: a least-squares fit to the fifth of the heights that are nearest to the datum
    for _ in range(2):
        residual = np.abs(few + datums @ few_base.T)
        nearest = np.argpartition(residual, few.size // 5, axis=1)[:, : few.size // 5]
        rows = few_base[nearest]
        normal = np.einsum("kni,knj->kij", rows, rows)
        right = -np.einsum("kni,kn->ki", rows, few[nearest])
        datums = np.linalg.solve(normal, right[..., None])[..., 0]

    # Of the datums with a small scale the best one is taken: with an unworn end, few heights above it, and many on it
    scales = _scale_datums(datums, few_base, few)
    # Scale of a datum, the distance within which a fifth of the depths lie, relative to the
    # smallest one. Datums of larger scale are not compared.
    near = np.flatnonzero(scales <= 4.0 * scales.min())
    relative = (few + datums[near] @ few_base.T) / max(scales.min(), 1e-15)
    # Distance of a height from a datum, relative to the smallest scale, within which it agrees with the datum
    agrees = np.abs(relative) < 5.0
    has_end = np.zeros(near.size, bool)
    for end in ends:
        at_end = agrees[:, np.isin(thin, end)]
        # Fraction of the heights at an end that agree, if the end is unworn
        has_end |= at_end.sum(axis=1) > 0.7 * at_end.shape[1]
    # Distance of a height above a datum, relative to the smallest scale, from which on it has grown
    grown = np.round((relative < -10.0).mean(axis=1), 1)
    return datums[near[np.lexsort((-agrees.mean(axis=1), grown, ~has_end))[0]]]


def _scale_datums(datums, base, depth) -> np.ndarray:
    """Return for each datum the distance (k,) [m] from it within which a fifth of the depths lie.

    `datums` (k, j) are factors of the functions in the columns of `base` (n, j), and `depth` (n,) [m] are depths
    without datum.
    """
    return np.quantile(np.abs(depth + datums @ base.T), 0.2, axis=1)
