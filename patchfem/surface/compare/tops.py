"""Tops of a surface, which wear touches first: worn ones of any width, and those that would be worn in a track."""

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ..profile import find_runs
from .changes import MIN_CHANGED_TRACE_SAMPLES, WINDOW_SIDES
from .depth_map import UNWORN_LIMIT_DEVIATIONS, DepthMap
from .statistics import compute_threshold, remove_long_waves

# Ratio of worn tops to filled valleys, or of lost to grown material, above which it is wear. Its reverse shows growth.
LOSS_TO_GROWTH_RATIO = 3.0
N_HEIGHT_CLASSES = 10  # number of classes of heights whose depths are compared
N_TOP_CLASSES = 6  # number of the highest classes


def find_worn_tops(relative, height, max_gain_change: float) -> np.ndarray:
    """Find the worn tops of a surface: single ones of any width, and tops that wear lowered slightly on all of it.

    Single tops count as worn if there are clearly more of them than of filled valleys. Valleys are the control: wear
    fills none, whereas an error of interpolation between the samples lowers tops and raises valleys alike. A drift of
    the instrument is too slow for both.

    Parameters
    ----------
    relative : (n,) or (m, n) array
        Depth in standard deviations, 0 where unknown.
    height : (n,) or (m, n) array
        Mean height of both surfaces in standard deviations, whose noise does not depend on that of the depth; no gaps.
    max_gain_change : float
        Largest change of the gain of the instrument that both surfaces may still have.

    Returns
    -------
    array
        Mask of the same shape: which heights belong to worn tops.
    """
    height = remove_long_waves(height)
    is_high = height > np.median(height)

    # Single tops and valleys whose depth is beyond the largest one that noise alone reaches. The opening removes spikes.
    limit = compute_threshold(len(WINDOW_SIDES[height.ndim]) * height.size)
    # Smallest side of a worn top, in samples; a spike is narrower
    square = np.ones((2,) * height.ndim)
    worn = ndimage.binary_opening((relative > limit) & is_high, square)
    filled = ndimage.binary_opening((relative < -limit) & ~is_high, square)
    # Smallest number of worn tops that are no specks of dust on the first surface
    if ndimage.label(worn)[1] < max(3, LOSS_TO_GROWTH_RATIO * ndimage.label(filled)[1]):
        worn[:] = False

    # Slight wear of all tops shows in the medians of classes of heights.
    known = np.flatnonzero(relative)
    is_lowered = _find_lowered_tops(relative.flat[known], height.flat[known], max_gain_change)
    worn.flat[known[is_lowered]] = True
    return worn


def _find_lowered_tops(relative, height, max_gain_change: float) -> np.ndarray:
    """Return a mask (n,) of heights in those classes of equal height that wear lowered, even slightly.

    Parameters
    ----------
    relative, height : (n,) array
        Depth and height in standard deviations.
    max_gain_change : float
        Largest change of the gain that both surfaces may still have.

    Returns
    -------
    (n,) bool array
        Empty unless the highest classes are deeper than the valleys by more than another gain explains.
    """
    is_worn = np.zeros(height.size, bool)
    if height.size < N_HEIGHT_CLASSES * MIN_CHANGED_TRACE_SAMPLES:
        return is_worn
    classes = np.array_split(np.argsort(height), N_HEIGHT_CLASSES)
    rise, above = (_subtract_valleys(values, classes) for values in (relative, height))
    # Smallest rise of the median depth from valleys to tops: 3.5 of its standard deviations, and .2 of those of a depth
    scatter = 3.5 / np.sqrt(len(classes[0]))
    gained = max_gain_change * np.median(above[-N_TOP_CLASSES:])
    limit = 0.2 + scatter + gained
    if np.median(rise[-N_TOP_CLASSES:]) > limit:
        for part, step in zip(classes, rise):
            is_worn[part] = step > limit
    return is_worn


def _subtract_valleys(values, classes: list[np.ndarray]) -> np.ndarray:
    """Return the median (k,) of values (n,) in each class of heights, minus that of the lowest classes (valleys).

    `classes` are the indices of the values in each class, the lowest one first.
    """
    medians = np.array([np.median(values[part]) for part in classes])
    # The lowest classes wear last
    return medians - np.median(medians[:3])


class Tops(NamedTuple):
    """Tops of a surface (n,).

    - places (k,): samples of their highest points.
    - depths (k,): depths there in standard deviations.
    - is_high (n,): which heights belong to tops.
    """

    places: np.ndarray
    depths: np.ndarray
    is_high: np.ndarray


def find_tops(depths: DepthMap) -> Tops:
    """Find the tops of a trace that are not worn, although they are high enough to be worn in a track.

    They are higher than the lowest quarter of the worn heights.
    """
    height = remove_long_waves(depths.before)
    relative = depths.depth / depths.noise
    is_deep = depths.masks.worn & (relative > UNWORN_LIMIT_DEVIATIONS)
    if not is_deep.any():
        return Tops(np.zeros(0, int), np.zeros(0), is_deep)
    # Quantile of the worn heights above which a height is a top
    is_high = height > np.quantile(height[is_deep], 0.25)
    runs = find_runs(is_high)
    tops = np.array([first + int(np.argmax(height[first : last + 1])) for first, last in runs], int)
    tops = tops[~depths.masks.missing[tops] & ~depths.masks.worn[tops]]
    # A top is a few samples wide, whose noise is partly independent.
    # Number of samples whose mean depth shows whether a top is worn
    return Tops(tops, ndimage.uniform_filter1d(relative, 3)[tops], is_high)
