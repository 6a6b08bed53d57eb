"""Detection of worn and grown heights in a depth map by averages over growing squares."""

import numpy as np

from ..compare.robust import MAX_OUTLIER
from ..compare.section import noise_threshold
from ..profile import robust_deviation

# Sides of the squares in heights; small squares show narrow deep wear, large ones wide wear.
SQUARE_SIDES = (3, 9, 25, 63)
MIN_MEASURED = 0.25  # smallest fraction of measured heights in a square whose mean is tested
MIN_UNWORN_SQUARES = 50  # smallest number of squares that determines the scatter of a mean


def find_change(depth, unworn, noise: float) -> tuple:
    """Return masks of the points that lost and that gained material.

    Parameters
    ----------
    depth : (m, n) array [m]
        Worn depth, NaN where a height is missing.
    unworn : (m, n) bool array
        Heights that agree with the plane; the scatter of their means is the reference.
    noise : float
        Standard deviation [m] of an unworn depth.

    Returns
    -------
    worn, grown : (m, n) bool array
        Missing heights are included where the squares around them changed.
    """
    # Without a limit, a single outlier would pass for wear.
    relative = np.clip(depth / noise, -MAX_OUTLIER, MAX_OUTLIER).astype(np.float32)
    worn = _find_deep_squares(relative, unworn)
    grown = _find_deep_squares(-relative, unworn)
    return worn & ~grown, grown & ~worn


def _find_deep_squares(relative, unworn) -> np.ndarray:
    """Find squares of points that are deeper than the scatter of unworn squares.

    A height that a smaller square shows is left out of larger squares, which would spread its depth
    over unworn neighbours.
    """
    threshold = noise_threshold(relative.size)
    changed = np.zeros(relative.shape, bool)
    for side in SQUARE_SIDES:
        if side > min(relative.shape) // 3:
            break
        mean, measured = mean_of_square(np.where(changed, np.nan, relative), side)
        unworn_fraction, _ = mean_of_square(np.where(unworn & ~changed, 1.0, 0.0), side)
        is_tested = measured > MIN_MEASURED
        reference = is_tested & (unworn_fraction > 0.5)
        if reference.sum() < MIN_UNWORN_SQUARES:
            break
        mean = mean * np.sqrt(measured)  # a mean of fewer heights scatters more
        scatter = max(robust_deviation(mean[reference]), 1 / side)
        changed |= widen(is_tested & (mean > threshold * scatter), side // 4)
    return changed


def detection_limit(depth, unworn) -> float:
    """Return the mean depth [m] below which wear over the widest square is not detected."""
    side = max(side for side in SQUARE_SIDES if side <= min(depth.shape) // 3)
    mean, measured = mean_of_square(np.where(unworn, depth, np.nan), side)
    reference = mean[measured > 0.5]
    return noise_threshold(depth.size) * float(reference.std()) if reference.size else 0.0


def mean_of_square(values, side: int) -> tuple:
    """Return the mean of the measured values in a square around each point."""
    from scipy.ndimage import uniform_filter

    measured = np.isfinite(values)
    fraction = uniform_filter(measured.astype(np.float32), side, mode="constant")
    fraction = np.maximum(fraction, 1e-6)
    filled = np.where(measured, values, 0.0).astype(np.float32)
    return uniform_filter(filled, side, mode="constant") / fraction, fraction


def widen(mask, count: int) -> np.ndarray:
    """Dilate a mask (m, n) by a number of points."""
    from scipy.ndimage import maximum_filter

    return maximum_filter(mask, 2 * count + 1) if count else mask
