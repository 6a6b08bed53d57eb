"""Robust statistics of depths, of which some are worn: scale, mode, correlation, thresholds."""

from itertools import pairwise, product

import numpy as np
from scipy import fft, ndimage, special

from ..profile import robust_deviation

# Fraction of unworn surfaces in which noise alone is reported as wear.
FALSE_POSITIVE_RATE = 1e-3
# Mean square of normal values of variance one that lie within UNWORN_LIMIT_DEVIATIONS.
UNWORN_VARIANCE_RATIO = 0.911
MIN_DIVISOR = 1e-300  # keeps divisions by zero noise finite
# Side of a surface relative to the deviation of the Gaussian of its long waves
SIDE_OVER_LONG_WAVE_GAUSSIAN = 40


def estimate_one_sided_scale(depth, fraction: float = 0.5) -> float:
    """Estimate the noise of depths from the side of zero that wear (or growth) does not touch.

    Parameters
    ----------
    depth : (n,) array
        Depths about the unworn surface.
    fraction : float, optional
        More than this fraction of the depths on the smaller side must be unchanged.

    Returns
    -------
    float
        Standard deviation [m]: the quantile `fraction` of the sizes on the side where it is smaller, divided by that of
        the sizes of normal values of variance one.
    """
    halves = (depth[depth > 0], depth[depth < 0])
    # Smallest number of depths on one side of zero that shows their scale
    sides = [np.abs(side) for side in halves if side.size >= 20]
    if not sides:
        return max(robust_deviation(depth), MIN_DIVISOR) if depth.size else MIN_DIVISOR
    smallest = min(float(np.quantile(side, fraction)) for side in sides)
    return max(smallest / float(special.ndtri(0.5 + fraction / 2)), MIN_DIVISOR)


def solve_biweight_step(depth, jacobian, sigma: float, excluded=None) -> np.ndarray:
    """Compute the change (k,) of parameters that reduces depths (n,) [m] by one weighted least-squares step.

    The weights are those of Tukey's biweight.

    Parameters
    ----------
    depth : (n,) array [m]
        Depths at the present parameters.
    jacobian : (n, k) array
        Derivative of the depth by each parameter.
    sigma : float
        Scale of the depths [m].
    excluded : (n,) bool array, optional
        Depths without weight.
    """
    # Tuning constant of Tukey's biweight, 95 % efficient for normal noise
    root = np.clip(1 - (depth / (4.685 * sigma)) ** 2, 0.0, None)
    if excluded is not None:
        root = np.where(excluded, 0.0, root)
    scale = np.sqrt((jacobian**2).mean(axis=0)) + MIN_DIVISOR
    step = np.linalg.lstsq(jacobian / scale * root[:, None], -depth * root, rcond=1e-10)[0]
    return step / scale


def make_polynomials(count: int, degree: int) -> np.ndarray:
    """Return orthonormal columns (count, degree + 1) that span the polynomials up to a degree at even places."""
    return np.linalg.qr(np.vander(np.linspace(-1, 1, count), degree + 1))[0]


def find_mode(values) -> float:
    """Return the mode of values: the mean of the shortest interval that contains 30 % of them."""
    ordered = np.sort(values)
    # Fraction of the values in the shortest interval, whose mean is the mode
    count = max(int(0.3 * ordered.size), 2)
    if ordered.size <= count:
        return float(ordered.mean())
    start = int(np.argmin(ordered[count - 1 :] - ordered[: ordered.size - count + 1]))
    return float(ordered[start : start + count].mean())


def estimate_correlation(values) -> float:
    """Estimate the number of neighbouring values that share an error, from their autocorrelation."""
    values = values - values.mean()
    power = np.abs(np.fft.rfft(values, 2 * values.size)) ** 2
    products = np.fft.irfft(power)[: max(values.size // 3, 2)]
    if not products[0] > 0:
        return 1.0
    pairs = values.size - np.arange(products.size)
    rho = products / products[0] * values.size / pairs
    # The sum ends where the correlation is within its own scatter.
    is_noise = rho < 2 / np.sqrt(pairs)
    stop = int(np.argmax(is_noise)) if is_noise.any() else rho.size
    return float(1 + 2 * rho[1:stop].sum())


def compute_threshold(n_tests: float) -> float:
    """Return how many standard deviations a value must exceed so that noise does so in 1 of 1000 sets of `n_tests` tests."""
    return float(-special.ndtri(FALSE_POSITIVE_RATE / max(n_tests, 1)))


def smooth(z, deviations) -> np.ndarray:
    """Return the Gaussian mean line or surface of heights z (n,) or (m, n) without gaps.

    The heights are continued by their mirror image at the borders. `deviations` are the standard deviations of the
    weights in samples, one for each axis or a single one for all axes.
    """
    spectrum = fft.dctn(z)
    for axis, deviation in enumerate(np.broadcast_to(deviations, z.ndim)):
        count = z.shape[axis]
        factor = np.exp(-((np.pi * deviation / count * np.arange(count)) ** 2) / 2)
        spectrum *= factor.reshape([-1 if k == axis else 1 for k in range(z.ndim)])
    return fft.idctn(spectrum)


def remove_long_waves(z, part: float = SIDE_OVER_LONG_WAVE_GAUSSIAN) -> np.ndarray:
    """Subtract the Gaussian mean line or surface from heights z (n,) or (m, n) without gaps.

    The Gaussian has a standard deviation of the length of the surface along each axis divided by `part`.
    """
    return z - smooth(z, np.array(z.shape) / part)


def subtract_local_level(values, mask) -> np.ndarray:
    """Subtract the Gaussian mean of the values in a mask from values (n,) or (m, n), both without gaps.

    This removes a slow drift. The result is NaN where less than a fifth of the neighbours are in the mask.
    """
    deviations = np.array(values.shape) / SIDE_OVER_LONG_WAVE_GAUSSIAN
    weight = smooth(mask.astype(float), deviations)
    level = smooth(np.where(mask, values, 0.0), deviations) / np.maximum(weight, MIN_DIVISOR)
    # Smallest weight of the neighbours in the mask that determines the level beside a height
    return np.where(weight > 0.2, values - level, np.nan)


def find_mirror_finish(surfaces) -> dict[str, float]:
    """Return {"rq": rms height, "noise": standard deviation} [m] of the first surface that is hardly rougher than its noise.

    The dict is empty if all are rougher. `surfaces` are arrays of heights (n,) or (m, n) [m], whose noise is white.
    """
    for z in surfaces:
        noise = robust_deviation(np.diff(z, 2)) / np.sqrt(6)
        height = robust_deviation(remove_long_waves(z))
        # Short waves relative to the noise, below which no place can be found
        if height <= 1.5 * noise:
            return {"rq": float(height), "noise": float(noise)}
    return {}


def split_tiles(shape: tuple[int, ...], count: int) -> list[tuple[slice, ...]]:
    """Return the slices of the tiles into which an array of a shape is cut, `count` along each axis."""
    edges = [np.linspace(0, size, count + 1).astype(int) for size in shape]
    return [tuple(slice(*side) for side in sides) for sides in product(*map(pairwise, edges))]


def find_box(mask) -> tuple[slice, ...]:
    """Return the slices of the smallest box that contains all true points of a mask."""
    return ndimage.find_objects(mask.astype(np.int8))[0]


def subtract_plane(z, columns, use=None) -> np.ndarray:
    """Subtract a least-squares combination of columns from heights.

    Parameters
    ----------
    z : (n,) or (m, n) array [m]
        Heights.
    columns : (k, n) or (k, m, n) array
        Functions that are combined.
    use : array of bool, optional
        Mask of the heights that the combination fits; all of them by default.
    """
    use = np.ones(z.shape, bool) if use is None else use
    factors = np.linalg.lstsq(columns[:, use].T, z[use], rcond=None)[0]
    return z - np.tensordot(factors, columns, 1)
