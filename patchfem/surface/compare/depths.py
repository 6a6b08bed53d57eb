"""Depths of a worn surface with their errors, and the areas, volumes and largest depths that follow.

A trace has depths along one axis, a scan along two; the mean section across a track of a scan is like a trace.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage, special

from ..quantity import SIDE, Quantity
from .fit import Fit
from .model import Model
from .raster import fill_gaps
from .records import name_quantity
from .statistics import UNWORN_LIMIT, estimate_correlation

N_TILES = {1: 40, 2: 8}  # number of tiles along each side, whose means show the errors of the datum
MIN_TILES = 6  # smallest number of tiles that show these errors
MIN_TILE_HEIGHTS = 5  # smallest number of unworn heights in such a tile
MODEL_ERROR = 0.004  # relative standard deviation of an area or volume due to tip and interpolation
MIN_WALL = 10.0  # second difference of the depth, in standard deviations, at a wall
# Error of the area at a wall relative to width times second difference: a jump between two samples is
# uniform over the step, and has two second differences.
WALL_ERROR = 0.2
EVEN_DEVIATION = 1 / np.sqrt(
    12
)  # standard deviation of a fraction that may be anything from 0 to 1
# Errors relative to those that the tiles show, which are few.
SCATTER_FACTOR = 1.3
MEDIAN_SIZE = {1: 5, 2: 3}  # side of the window whose median depths give the largest depth
MEDIAN_VARIANCE = 1.57  # variance of a median relative to that of a mean, of normal errors
MAX_NOISE_RATIO = 4.0  # noise relative to the median above which a depth cannot be the largest


@dataclass(frozen=True, eq=False)
class Depths:
    """Depths [m] of the known samples (n,) of a trace at x, or of all points (m, n) of a scan at y and x.

    - places: x, or y and x [m].
    - depth, noise: worn depth, filled where missing, and the standard deviation of an unworn one.
    - unworn, worn, grown, inside: masks; inside: the common part.
    - after: heights [m] of the second surface about a line or plane.
    - sizes, missing: length [m] or area [m2] of each height, and the part of it without a measured height.
    - variance: function of weights in the shape of the depths: variance of the weighted sum of depths.
    - drift: standard deviation [m] of the mean depth of an unworn tile.
    - correlation: number of neighbouring heights that share an error.
    - model_error: relative standard deviation of all depths due to gain, tip and interpolation.
    """

    places: tuple[np.ndarray, ...]
    depth: np.ndarray
    noise: np.ndarray
    unworn: np.ndarray
    worn: np.ndarray
    grown: np.ndarray
    inside: np.ndarray
    after: np.ndarray
    sizes: np.ndarray
    missing: np.ndarray
    variance: Callable[[np.ndarray], float]
    drift: float = 0.0
    correlation: float = 1.0
    model_error: float = MODEL_ERROR

    @property
    def x(self) -> np.ndarray:
        """Places [m] along x."""
        return self.places[-1]

    @property
    def noise_level(self) -> float:
        """Median standard deviation [m] of an unworn depth."""
        return float(np.nanmedian(self.noise))

    @property
    def size(self) -> float:
        """Length [m] or area [m2] of the common part."""
        return float(self.sizes[self.inside].sum())

    @property
    def level_error(self) -> float:
        """Standard deviation [m] of the mean depth of the common part."""
        return float(np.sqrt(self.variance(np.where(self.inside, self.sizes, 0.0))) / self.size)

    @cached_property
    def wall_errors(self) -> np.ndarray:
        """Standard deviation of area or volume at walls between two samples, where the depth jumps."""
        bend = np.abs(ndimage.laplace(self.depth, mode="nearest"))
        is_wall = bend > MIN_WALL * np.nan_to_num(self.noise, nan=np.inf)
        return np.where(is_wall, WALL_ERROR * self.sizes * bend, 0.0)

    def integrate(self, part, sign: float = 1.0) -> tuple[float, float]:
        """Integrate the depth over a mask; return the area [m2] or volume [m3] and its standard deviation."""
        weights = np.where(part, self.sizes, 0.0)
        value = sign * float((weights * self.depth).sum())
        # A missing height may be as deep as its neighbour, or not worn.
        gaps = EVEN_DEVIATION * float((self.missing * np.abs(self.depth))[part].sum())
        walls = self.wall_errors[part]
        error = SCATTER_FACTOR * np.sqrt(self.variance(weights) + walls @ walls)
        return value, float(np.sqrt(error**2 + gaps**2 + (self.model_error * value) ** 2))

    def measure_hidden(self) -> float:
        """Return the area or volume by which slight wear, within the noise, may lower the datum."""
        known = np.isfinite(self.noise)
        relative = self.depth[known] / self.noise[known]
        slight = (np.abs(relative) > UNWORN_LIMIT) & (np.abs(relative) < 2 * UNWORN_LIMIT)
        excess = max(float(np.sign(relative[slight]).sum()), 0.0) / max(self.unworn.sum(), 1)
        return excess * UNWORN_LIMIT * self.noise_level * self.size


def make_depths(model: Model, fit: Fit, gain_error: float = 0.0) -> Depths:
    """Return the depths of aligned surfaces, with the errors that the unworn heights show."""
    axes = model.own.axes
    heights = model.own.z[model.known]
    second = heights - fit.depth if model.sign > 0 else heights
    base = model.datum[: fit.jacobian.shape[1] - model.n_axes - 1]
    if model.n_axes == 1:
        known = model.known
        x = axes[0][known]
        step = float(model.own.steps[0])
        maps = {name: getattr(fit, name) for name in ("depth", "noise", "unworn", "worn", "grown")}
        sizes = np.gradient(x)
        missing = np.maximum(sizes - step, 0.0)
        inside = np.ones(x.size, bool)
        places = (x,)
        base = base[:, known]
    else:
        maps = {name: model.draw(getattr(fit, name)) for name in ("depth", "noise")}
        maps["depth"] = fill_gaps(maps["depth"])
        maps |= {
            name: model.draw(getattr(fit, name), False) for name in ("unworn", "worn", "grown")
        }
        second = fill_gaps(model.draw(second))
        sizes = np.full(model.known.shape, float(np.prod(model.own.steps)))
        missing = np.where(model.known, 0.0, sizes)
        # Holes of missing heights belong to the common part.
        closed = ndimage.binary_closing(np.pad(model.common, 8), np.ones((9, 9)))[8:-8, 8:-8]
        inside = closed | model.common
        places = tuple(axes)
    columns = base[: 1 + model.n_axes].reshape(1 + model.n_axes, -1).T
    first = second + maps["depth"]
    trend = columns @ np.linalg.lstsq(columns, first.ravel(), rcond=None)[0]
    relative = fit.depth[fit.unworn] / fit.noise[fit.unworn]
    variance, drift = estimate_variance(maps["depth"], maps["noise"], maps["unworn"], base)
    return Depths(
        places=places,
        **maps,
        inside=inside,
        after=second - trend.reshape(first.shape),
        sizes=sizes,
        missing=missing,
        variance=variance,
        drift=drift,
        correlation=estimate_correlation(relative) if model.n_axes == 1 else 1.0,
        model_error=float(np.hypot(MODEL_ERROR, gain_error)),
    )


def estimate_variance(depth, noise, unworn, base) -> tuple[Callable[[np.ndarray], float], float]:
    """Estimate the errors of sums of depths from the means of unworn heights in tiles about the datum.

    With white noise, the mean of c heights has the variance s^2/c; noise that neighbours share and slow errors of the
    instrument show as a larger s^2. The datum itself is uncertain too: a sum with weights w has the variance
    s^2 (m^T (B^T C B)^-1 m + w^T w), with the datum B and the counts C of the tiles, and the sum m of w times the datum.

    Parameters
    ----------
    depth, noise, unworn : (n,) or (m, n) array
        Depths and noise [m], and the mask of heights that are unworn.
    base : (k, n) or (k, m, n) array
        Functions of which the datum is a combination.

    Returns
    -------
    callable
        Variance of a weighted sum as a function of weights in the shape of the depths.
    float
        Standard deviation [m] of the mean of a tile.
    """
    numbers = np.zeros(depth.shape, int)
    n_tiles = N_TILES[depth.ndim]
    for axis, count in enumerate(depth.shape):
        along = np.arange(count) * n_tiles // count
        numbers = n_tiles * numbers + np.expand_dims(along, tuple({*range(depth.ndim)} - {axis}))
    which = numbers[unworn]
    counts = np.bincount(which, minlength=n_tiles**depth.ndim)
    is_full = counts >= MIN_TILE_HEIGHTS
    full = np.maximum(counts, 1)[is_full]
    means, *centers = (
        np.bincount(which, values[unworn], counts.size)[is_full] / full for values in (depth, *base)
    )
    centers = np.array(centers).T
    freedom = full.size - len(base)
    # The variance of a height by its noise, if a tile shared a single error, where tiles are few.
    variance = float(np.nanmedian(noise) ** 2 * depth.size / counts.size)
    normal = centers.T @ (centers * full[:, None])
    if full.size >= MIN_TILES:
        factors = np.linalg.lstsq(
            centers * np.sqrt(full)[:, None], means * np.sqrt(full), rcond=None
        )[0]
        residual = (means - centers @ factors) * np.sqrt(full)
        student = special.stdtrit(freedom, 0.975) / SIDE
        variance = float(
            residual @ residual / freedom * estimate_correlation(residual) * student**2
        )
    inverse = np.linalg.pinv(normal, rcond=1e-10, hermitian=True)
    flat = base.reshape(len(base), -1)

    def compute_variance(weights) -> float:
        moments = flat @ weights.ravel()
        return variance * float(moments @ inverse @ moments + (weights**2).sum())

    return compute_variance, float(np.sqrt(variance * len(full) / max(full.sum(), 1)))


def measure_largest(depths: Depths) -> tuple[Quantity, np.ndarray]:
    """Measure the largest depth of the worn parts without the bias of the maximum of noisy depths.

    The largest of n medians with normal errors is too large by about sigma sqrt(2 log n). The upper end of the
    interval contains every single depth, because a crest may be worn as deep, and both ends what the samples do not
    resolve: the part of the largest depth that every second sample does not show.

    Returns
    -------
    Quantity
        Largest depth [m].
    array
        Mask in the shape of the depths of the places that are as deep but for the noise.
    """
    noise = np.where(np.isfinite(depths.noise), depths.noise, depths.noise_level)
    is_sure = noise < MAX_NOISE_RATIO * depths.noise_level
    if (is_sure & depths.worn).any():
        is_sure &= depths.worn
    smooth = ndimage.median_filter(depths.depth, MEDIAN_SIZE[depths.depth.ndim])
    smooth = np.where(is_sure, smooth, -np.inf)
    depth = np.where(is_sure, depths.depth, -np.inf)

    top = np.unravel_index(np.argmax(smooth), smooth.shape)
    # Heights that share an error do not improve a median.
    n_heights = MEDIAN_SIZE[depths.depth.ndim] ** depths.depth.ndim
    sigma = float(noise[top])
    sigma *= min(np.sqrt(MEDIAN_VARIANCE * depths.correlation / n_heights), 1.0)
    near = smooth > smooth[top] - 2 * sigma
    bias = float(np.sqrt(2 * np.log(max(near.sum() / depths.correlation, 1.0))) / 2 * sigma)
    value = float(smooth[top]) - bias

    crest = float(depth.max())
    halves = np.meshgrid(*[(0, 1)] * depth.ndim)
    starts = np.array(halves).reshape(depth.ndim, -1).T
    coarser = np.mean(
        [depth[tuple(slice(start, None, 2) for start in part)].max() for part in starts]
    )
    unresolved = crest - float(coarser) if np.isfinite(coarser) else 0.0
    sigma = float(np.hypot(sigma, depths.level_error))
    scatter = np.hypot(SCATTER_FACTOR * sigma, depths.model_error * value)
    error = SIDE * float(scatter) + unresolved
    low = max(value - bias - error, 0.0)
    return name_quantity("worn_depth_max", value, low, max(crest, value) + error), near
