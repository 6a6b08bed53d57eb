"""Depths of aligned surfaces, their errors from the means of unworn tiles, and the largest depth."""

from itertools import product
from typing import NamedTuple

import numpy as np
from scipy import ndimage, special

from ..quantity import HALF_WIDTH_95, Quantity
from .changes import WINDOW_SIDES
from .depth_map import (
    FEW_TILES_ERROR_FACTOR,
    UNWORN_LIMIT_DEVIATIONS,
    DepthErrors,
    DepthMap,
    PointMasks,
)
from .fit import Fit
from .model import Model
from .raster import fill_gaps
from .records import name_quantity
from .statistics import MIN_DIVISOR, estimate_correlation, find_box, split_tiles, subtract_plane

# Number of tiles along each side, whose means show the errors of the datum
N_DATUM_ERROR_TILES = {1: 40, 2: 8}
# Smallest number of independent tiles, as the correlation of few tiles is uncertain
MIN_INDEPENDENT_TILES = 3.0
# Distance from the largest mean, in its standard deviations, within which other means are counted as equally deep
NEAR_DEVIATIONS = 2.0


def make_depths(model: Model, fit: Fit, gain_error: float = 0.0) -> DepthMap:
    """Return the depths of aligned surfaces over the part that both show, with the errors of the unworn heights.

    Parameters
    ----------
    model : Model
        Common points of both surfaces, at the place of the fit.
    fit : Fit
        Depths at the known points of the model.
    gain_error : float, optional
        Standard deviation of the gain of the instrument.

    Returns
    -------
    DepthMap
    """
    box = find_box(model.common)
    terms = [
        k - model.n_axes - 1
        for k in fit.free
        if model.n_axes < k <= model.n_axes + len(model.datum)
    ]

    depth = fill_gaps(model.draw(fit.depth))[box]
    noise = model.draw(fit.noise)[box]
    noise = np.where(np.isnan(noise), np.median(fit.noise), noise)
    unworn, worn, grown = (
        model.draw(mask, False)[box] for mask in (fit.unworn, fit.worn, fit.grown)
    )
    first = fill_gaps(model.sampled.z)[box]
    if model.n_axes == 1:
        # The sampled heights are those of the second trace, with its gain.
        first = first / (1 + fit.state[-1]) + depth
    base = model.datum[(terms, *box)]
    before = subtract_plane(first, base[: 1 + model.n_axes])

    # An error of the gain moves the heights of the second surface that stand out of the datum.
    shifts = [gain_error * (subtract_plane(before, base, unworn) - depth)]
    if model.n_axes == 1:
        shifts.append(_bend_datum(depth, unworn, base))
    errors = estimate_errors(depth, noise, unworn, base, shifts)

    # Holes of missing heights belong to the common part.
    inside = ndimage.binary_fill_holes(model.common[box])
    axes = [axis[part] for axis, part in zip(model.sampled.axes, box)]
    return DepthMap(
        x=axes[-1],
        y=axes[0] if model.n_axes > 1 else None,
        before=before,
        depth=depth,
        noise=noise,
        masks=PointMasks(unworn, worn, grown, inside, inside & ~model.known[box]),
        cell=float(np.prod(model.sampled.steps)),
        errors=errors._replace(gain=gain_error),
    )


def make_section(x, depth, sigma: float, worn, missing) -> DepthMap:
    """Return the DepthMap of a trace whose depths are measured below a straight datum, without a first surface.

    Parameters
    ----------
    x, depth : (n,) array [m]
        Places, and depths below the datum.
    sigma : float
        Noise of every depth [m].
    worn, missing : (n,) bool array
        Worn points, and points that were not measured.

    Returns
    -------
    DepthMap
    """
    noise = np.full(depth.size, sigma)
    nothing = np.zeros(depth.size, bool)
    unworn = (np.abs(depth) < UNWORN_LIMIT_DEVIATIONS * sigma) & ~worn
    # The errors are those of the unworn heights about their line.
    base = np.array([np.ones(depth.size), np.linspace(-1, 1, depth.size)])
    return DepthMap(
        x=x,
        y=None,
        before=0.0 * depth,
        depth=depth,
        noise=noise,
        masks=PointMasks(unworn, worn, nothing, ~nothing, missing),
        cell=float(np.diff(x).mean()),
        errors=estimate_errors(depth, noise, unworn, base),
    )


def estimate_errors(depth, noise, unworn, base, shifts=()) -> DepthErrors:
    """Estimate the errors of sums of depths from the means of unworn heights in tiles about the datum.

    With white noise, the mean of c heights has the variance s^2/c; noise that neighbours share and slow errors of the
    instrument show as a larger s^2. The datum itself is uncertain too: a sum of w depths has the variance
    s^2 (m^T (B^T C B)^-1 m + w), with the datum B and the counts C of the tiles, and the sum m of the datum.

    Parameters
    ----------
    depth, noise, unworn : (n,) or (m, n) array
        Depths and noise [m], and the mask of heights that are unworn.
    base : (k, n) or (k, m, n) array
        Functions of which the datum is a combination.
    shifts : sequence of (n,) or (m, n) array, optional
        Changes of the depths by one standard deviation of other errors [m].

    Returns
    -------
    DepthErrors
        Its `variance` is a function of a mask.
    """
    # Count of unworn heights in each tile, and the means of their depths and of the functions of the datum there.
    tiles = []
    for tile in split_tiles(depth.shape, N_DATUM_ERROR_TILES[depth.ndim]):
        use = unworn[tile]
        # Smallest number of unworn heights in a tile that shows the errors of the datum
        if use.sum() >= 5:
            parts = [values[tile][use].mean() for values in (depth, *base)]
            tiles.append((use.sum(), *parts))
    counts, means, *centers = np.array(tiles).T if tiles else np.zeros((2 + len(base), 1))
    # Rows are weighted by the root of the count, because the variance of a mean falls with it.
    root = np.sqrt(counts)
    centers = np.array(centers).T * root[:, None]
    # Where tiles are few, a tile may share a single error.
    variance = float(
        np.median(noise) ** 2 * depth.size / N_DATUM_ERROR_TILES[depth.ndim] ** depth.ndim
    )
    freedom = MIN_INDEPENDENT_TILES
    drift = 0.0
    # Smallest number of tiles that show the errors of the datum
    if counts.size >= 6:
        # The scatter of the means about the datum that fits them best gives s^2.
        fitted = np.linalg.lstsq(centers, means * root, rcond=None)[0]
        residual = means * root - centers @ fitted
        # A slow drift makes neighbouring tiles share their errors, so that fewer of them are independent.
        shared = estimate_correlation(residual)
        freedom = max(counts.size / shared - len(base), MIN_INDEPENDENT_TILES)
        student = special.stdtrit(freedom, 0.975) / HALF_WIDTH_95
        scatter = residual @ residual / (counts.size - len(base))
        drift = float(np.sqrt(scatter / counts.mean()))
        variance = float(scatter * shared * student**2)
    # Covariance of the coefficients of the datum for s = 1.
    inverse = np.linalg.pinv(centers.T @ centers, rcond=1e-10, hermitian=True)

    def compute_variance(part) -> float:
        """Return the variance [m2] of the sum of the depths in a mask `part`."""
        moments = base[:, part].sum(axis=1)
        white = variance * float(moments @ inverse @ moments + part.sum())
        return white + sum(float(shift[part].sum()) ** 2 for shift in shifts)

    correlation = estimate_correlation((depth / noise)[unworn]) if depth.ndim == 1 else 1.0
    return DepthErrors(compute_variance, drift, freedom, correlation)


def _bend_datum(depth, unworn, base) -> np.ndarray:
    """Return by how much [m] the datum (n,) of a trace would change with two more polynomial terms.

    With a slow drift, this is the error of the datum in a wide track, which the scatter of the flanks does not show. The
    part of its square that noise without a drift would give is subtracted.

    `depth` and `unworn` (n,) are the depths [m] and the mask of the unworn ones, which determine the datum. `base` (k,
    n) are the functions of which it is a combination.
    """
    x = np.linspace(-1, 1, depth.size)
    bent = np.vstack((base, x ** len(base), x ** (len(base) + 1)))
    remainders = [subtract_plane(depth, columns, unworn) for columns in (base, bent)]

    # Chi square of both terms, which is 2 on average for noise alone
    squares = [float((remainder[unworn] ** 2).sum()) for remainder in remainders]
    correlation = estimate_correlation(remainders[1][unworn])
    noise_square = correlation * squares[1] / max(unworn.sum() - len(bent), 1) + MIN_DIVISOR
    chi_square = (squares[0] - squares[1]) / noise_square
    return np.sqrt(max(1 - 2 / max(chi_square, 2.0), 0.0)) * (remainders[0] - remainders[1])


class Extreme(NamedTuple):
    """Largest mean depth over all windows of one size, and the number of windows that differ from it by noise alone.

    - value: largest mean [m]; sigma: its standard deviation [m].
    - at: index of the middle of its window.
    - n_places: number of independent windows whose mean is as large, but for the noise.
    """

    value: float
    sigma: float
    at: tuple[int, ...]
    n_places: float

    def find_noise(self, probability: float, n_places: float) -> float:
        """Return the quantile [m] of the largest noise in the means of `n_places` windows of equal depth."""
        return self.sigma * float(special.ndtri(probability ** (1 / n_places)))


def _find_extreme(depth, noise, side: int, correlation: float) -> Extreme:
    """Return the largest mean of depths over windows of a side.

    Parameters
    ----------
    depth, noise : (n,) or (m, n) array [m]
        Depths, at most 0 where they cannot be the largest, and the standard deviation of an unworn one.
    side : int
        Side of the window in samples.
    correlation : float
        Number of neighbouring depths that share an error.
    """
    means = ndimage.uniform_filter(depth, side)
    at = np.unravel_index(np.argmax(means), means.shape)
    # Heights that share an error do not improve a mean.
    n_shared = max(side**depth.ndim, correlation)
    square = float(ndimage.uniform_filter(noise**2, side)[at])
    sigma = float(np.sqrt(square * correlation / n_shared))

    # Of n independent normal values about one level, n Q(t - NEAR_DEVIATIONS) are within NEAR_DEVIATIONS of the largest,
    # where Q is the upper tail and t the median of the largest value.
    n_near = float((means > means[at] - NEAR_DEVIATIONS * sigma).sum()) / n_shared
    # Number of numbers of equally deep places that are compared with what is seen
    counts = np.geomspace(1.0, means.size, 200)
    largest = special.ndtri(0.5 ** (1 / counts))
    n_expected = counts * special.ndtr(NEAR_DEVIATIONS - largest)
    n_places = float(np.interp(n_near, n_expected, counts))
    return Extreme(float(means[at]), sigma, tuple(map(int, at)), n_places)


def measure_largest(depths: DepthMap) -> tuple[Quantity, np.ndarray]:
    """Measure the largest depth of the worn parts without the bias of the maximum of noisy depths.

    No mean over a window is above the largest depth, so that the lower end is the highest one of several sides of
    windows: where a bottom is smooth, wide windows average the noise. The upper end is that of single depths, because a
    crest may be worn as deep, with what the samples do not resolve of a crest: the part of the largest depth that every
    second sample does not show. What noise alone adds to the largest of many depths is subtracted.

    Parameters
    ----------
    depths : DepthMap
        Depths of aligned surfaces.

    Returns
    -------
    Quantity
        Largest depth [m].
    array
        Mask in the shape of the depths of the places that are as deep but for the noise.
    """
    n_axes = depths.depth.ndim
    # Noise relative to the median above which a depth cannot be the largest
    is_sure = depths.noise < 4.0 * depths.noise_level
    if (is_sure & depths.masks.worn).any():
        is_sure &= depths.masks.worn
    depth = np.where(is_sure, depths.depth, np.minimum(depths.depth, 0.0))
    correlation = depths.errors.correlation
    sides = WINDOW_SIDES[n_axes]
    single = _find_extreme(depth, depths.noise, 1, correlation)

    # Medians over 5 samples, or 3 x 3, leave single outliers out, and scatter a little more than means.
    medians = ndimage.median_filter(depth, {1: 5, 2: 3}[n_axes])
    # Variance of the median of normal errors relative to that of their mean, pi/2
    noise = np.sqrt(1.57) * depths.noise
    wide = [_find_extreme(medians, noise, side, correlation) for side in sides[1:]]
    # The best one of several windows is chosen, as if there were as many times more places.
    lowest = [each.value - each.find_noise(0.975, len(wide) * each.n_places) for each in wide]
    best = wide[int(np.argmax(lowest))]
    value = best.value - best.find_noise(0.5, best.n_places)

    # The datum has an error at the deepest place, which is that of the mean depth of a tile around it.
    tile = np.zeros(depth.shape, bool)
    halves = [size // (2 * N_DATUM_ERROR_TILES[n_axes]) for size in depth.shape]
    tile[tuple(slice(max(k - half, 0), k + half + 1) for k, half in zip(best.at, halves))] = True
    level = FEW_TILES_ERROR_FACTOR * np.sqrt(depths.errors.variance(tile)) / tile.sum()
    common = HALF_WIDTH_95 * float(np.hypot(level, depths.errors.gain * value))
    low = value - float(np.hypot(common, value - max(lowest)))

    # Where the bottom is not flat, fewer samples are as deep as the deepest than lie near it, but at least the root of their
    # number.
    crest = single.value - single.find_noise(0.5, single.n_places)
    noise_above = single.value - single.find_noise(0.025, np.sqrt(single.n_places)) - crest
    high = max(crest + float(np.hypot(common, noise_above)), value + common)
    every_second = product((slice(0, None, 2), slice(1, None, 2)), repeat=n_axes)
    high += single.value - float(np.mean([depth[part].max() for part in every_second]))
    # A missing height may be as much deeper than the line over its gap as worn depths scatter about those beside them.
    gaps = depths.masks.missing & ndimage.binary_dilation(depths.masks.worn)
    if gaps.any():
        high = max(high, float(depths.depth[gaps].max()) + HALF_WIDTH_95 * depths.scatter)
    near = medians > value - NEAR_DEVIATIONS * best.sigma
    near[best.at] = True
    return name_quantity("worn_depth_max", value, max(low, 0.0), high), near
