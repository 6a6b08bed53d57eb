"""Which heights of a map of depths changed: deeper, or higher, than noise by the mean of the depths around them."""

import numpy as np

from ..compare.section import sure_of

# heights along the sides of the squares: deep and narrow changes show in small ones
SIDES = (3, 9, 25, 63)
CLIPPED = 8.0  # limit of a height in standard deviations, so that a single outlier is no change
MIN_KNOWN = 0.25  # smallest fraction of valid heights in a square
MIN_QUIET = 50  # smallest number of unworn squares for an estimate of their scatter


def find_change(depth, used, noise: float) -> tuple:
    """Find the heights of a map of depths with material loss and those with material gain.

    Parameters
    ----------
    depth : (m, n) array [m]
        NaN where a height is missing.
    used : (m, n) bool array
        Heights that are unworn by their own depth; their squares give the scatter of a mean.
    noise : float
        Standard deviation [m] of an unworn depth.

    Returns
    -------
    worn, grown : (m, n) bool array
        Missing heights too, where those around them changed.
    """
    relative = np.clip(depth / noise, -CLIPPED, CLIPPED).astype(np.float32)
    worn, grown = (_find_beyond(relative, used, sign) for sign in (1.0, -1.0))
    return worn & ~grown, grown & ~worn


def _find_beyond(relative, used, sign: float) -> np.ndarray:
    """Find heights whose squares lie beyond the scatter of unworn squares, small squares first.

    Heights that changed by a smaller square do not count in a larger one, which would carry them
    into its neighbours.
    """
    sure = sure_of(relative.size)
    changed = np.zeros(relative.shape, bool)
    for side in SIDES:
        if side > min(relative.shape) // 3:
            break
        mean, known = mean_of_square(np.where(changed, np.nan, relative), side)
        quiet = (mean_of_square(np.where(used & ~changed, 1.0, 0.0), side)[0] > 0.5) & (
            known > MIN_KNOWN
        )
        if quiet.sum() < MIN_QUIET:
            break
        even = mean * np.sqrt(known)  # means of fewer heights scatter more
        scatter = max(1.4826 * float(np.median(np.abs(even[quiet]))), 1 / side)
        changed |= widen((known > MIN_KNOWN) & (sign * even > sure * scatter), side // 4)
    return changed


def hidden_depth(depth, used) -> float:
    """Return the mean depth [m] of wear over wide squares that noise and slow errors hide."""
    sides = [side for side in SIDES if side <= min(depth.shape) // 3]
    mean, known = mean_of_square(np.where(used, depth, np.nan), sides[-1])
    quiet = known > 0.5
    return sure_of(depth.size) * float(mean[quiet].std()) if quiet.any() else 0.0


def mean_of_square(values, side: int) -> tuple:
    """Return the mean of the known values (m, n) in the square around each place, and the known fraction."""
    from scipy.ndimage import uniform_filter

    known = np.isfinite(values)
    share = np.maximum(uniform_filter(known.astype(np.float32), side, mode="constant"), 1e-6)
    mean = (
        uniform_filter(np.where(known, values, 0.0).astype(np.float32), side, mode="constant")
        / share
    )
    return mean, share


def widen(mask, count: int) -> np.ndarray:
    """Widen a mask (m, n) by so many places on each side."""
    from scipy.ndimage import maximum_filter

    return maximum_filter(mask, 2 * count + 1) if count else mask
