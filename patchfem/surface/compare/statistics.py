"""Robust statistics of depths, of which some are worn: scale, mode, correlation, thresholds."""

import numpy as np

from ..profile import MAD_TO_DEVIATION, robust_deviation

UNWORN_LIMIT = 2.5  # standard deviations within which a depth counts as unworn
BIWEIGHT = 4.685  # tuning constant of Tukey's biweight; 95 % efficient for normal noise
BIWEIGHT_SLOPE = 0.8  # mean derivative of its score for normal noise
MODE_FRACTION = 0.3  # fraction of the values in the shortest interval, whose mean is the mode
MIN_SIDE = 20  # smallest number of depths on one side of zero that shows their scale
# Fraction of unworn surfaces in which noise alone is reported as wear.
FALSE_POSITIVE_RATE = 1e-3
# Mean square of normal values of variance one that lie within UNWORN_LIMIT.
TRUNCATED_VARIANCE = 0.911
TINY = 1e-300  # keeps divisions by zero noise finite


def estimate_one_sided_scale(depth) -> float:
    """Estimate the noise of depths from the side of zero that wear (or growth) does not touch."""
    sides = [np.abs(side) for side in (depth[depth > 0], depth[depth < 0]) if side.size >= MIN_SIDE]
    if not sides:
        return max(robust_deviation(depth), TINY) if depth.size else TINY
    return max(MAD_TO_DEVIATION * min(float(np.median(side)) for side in sides), TINY)


def solve_biweight_step(depth, jacobian, sigma: float, excluded=None) -> np.ndarray:
    """Compute the change of parameters (k,) that moves depths (n,) towards zero, by Tukey's biweight.

    Parameters
    ----------
    depth : (n,) array [m]
    jacobian : (n, k) array
        Derivative of the depth by each parameter.
    sigma : float
        Scale of the depths [m].
    excluded : (n,) bool array, optional
        Depths without weight.
    """
    root = np.clip(1 - (depth / (BIWEIGHT * sigma)) ** 2, 0.0, None)
    if excluded is not None:
        root = np.where(excluded, 0.0, root)
    scale = np.sqrt((jacobian**2).mean(axis=0)) + TINY
    step = np.linalg.lstsq(jacobian / scale * root[:, None], -depth * root, rcond=1e-10)[0]
    return step / scale


def find_mode(values) -> float:
    """Return the mean of the shortest interval that contains 30 % of the values."""
    ordered = np.sort(values)
    count = max(int(MODE_FRACTION * ordered.size), 2)
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
    """Return the number of standard deviations that noise exceeds in 1 of 1000 sets of tests."""
    from scipy.special import ndtri

    return float(-ndtri(FALSE_POSITIVE_RATE / max(n_tests, 1)))
