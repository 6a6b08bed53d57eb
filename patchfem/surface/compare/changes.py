"""Heights that noise does not explain: single ones, means over windows, shallow tracks."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from .statistics import (
    compute_threshold,
    estimate_correlation,
    estimate_one_sided_scale,
    make_polynomials,
)

# Sides in samples of the windows whose mean depth is tested, by number of axes
WINDOW_SIDES = {1: (1, 4, 16, 64), 2: (1, 3, 9, 25)}
# Length in samples of the smallest changed part of traces: an error of interpolation at a kink spreads over 7 samples,
# and one more on each side
MIN_CHANGED_TRACE_SAMPLES = 9
# Standard deviations to which a single depth counts in a mean over a window, by number of axes
MAX_DEPTH_DEVIATIONS = {1: 4.0, 2: 8.0}
# Fraction of the means above or below zero that are unchanged at least.
MIN_UNCHANGED_FRACTION = {1: 0.5, 2: 0.25}
N_TRACE_PARTS = 60  # parts of the trace whose means show a shallow track
MIN_SHALLOW_TRACK_PARTS = 3  # smallest number of parts in a shallow track
ADDED_DATUM_DEGREE = 3  # degree of the polynomial that a datum may add to shallow depths
# Smallest height of a shallow track in standard deviations; 2 % of random walks have a deeper one.
MIN_SHALLOW_TRACK_DEVIATIONS = 8.0


def find_changed(depth, noise) -> np.ndarray:
    """Find the points whose depth, alone or in means over windows, is larger than noise explains.

    Parameters
    ----------
    depth, noise : (n,) or (m, n) array [m]
        Depth and the standard deviation of an unworn one; NaN where unknown.

    Returns
    -------
    array
        Mask of the same shape.
    """
    known = np.isfinite(depth)
    relative = np.where(known, depth / noise, 0.0)
    changed = np.zeros(depth.shape, bool)
    windows = WINDOW_SIDES[depth.ndim]

    # Threshold in standard deviations, so high that noise rarely exceeds it anywhere in all windows
    limit = compute_threshold(len(windows) * known.sum())
    pull = MAX_DEPTH_DEVIATIONS[depth.ndim]
    remainder = np.clip(relative, -pull, pull)

    # Windows from single points to wide ones. Points that have changed already do not count in wider windows.
    for side in windows:
        if side > min(depth.shape) / 4:
            break
        use = known & ~changed
        weight = ndimage.uniform_filter(use.astype(float), side)
        values = relative if side == 1 else remainder
        # Mean over the window of the points that count
        mean = ndimage.uniform_filter(np.where(use, values, 0.0), side) / np.maximum(weight, 0.25)
        # Slow errors of the datum make means scatter more than those of white noise.
        fraction = MIN_UNCHANGED_FRACTION[depth.ndim]
        scatter = estimate_one_sided_scale(mean[use & (weight > 0.5)], fraction)
        scatter = max(scatter, side ** (-depth.ndim / 2))

        # All points of a window whose mean is too high have changed. Single points of scans count only in groups.
        high = (mean > limit * scatter) & (weight > 0.25)
        # Side in samples of the smallest group of points whose own depths, not means over windows, show a change
        spot = {1: 1, 2: 3}[depth.ndim]
        if side == 1:
            changed |= ndimage.binary_opening(high, np.ones((spot,) * depth.ndim))
        else:
            changed |= ndimage.binary_dilation(high, np.ones((side,) * depth.ndim))

    # A trace may have a track too shallow for any window. Groups of points too small for a change are left out.
    # Side in samples of the smallest changed part of scans. A smaller one may be an error of
    # interpolation.
    side = 4
    if depth.ndim == 1:
        places = np.flatnonzero(known)
        shallow = find_shallow_track(np.clip(depth, -pull * noise, pull * noise)[known])
        changed[places[shallow.samples]] = True
        changed = ndimage.binary_dilation(changed)
        side = MIN_CHANGED_TRACE_SAMPLES
    return ndimage.binary_opening(changed, np.ones((side,) * depth.ndim)) & known


class Boxes(NamedTuple):
    """Box functions over spans of the N_TRACE_PARTS parts of a trace, from which a polynomial datum is subtracted.

    - spans (k, 2): first part of each span, and the first one beyond it.
    - shapes (k, N_TRACE_PARTS): boxes over the spans without the datum, divided by their norms.
    - sizes (k,): these norms.
    - datum (N_TRACE_PARTS, j): orthonormal polynomials of the datum.
    """

    spans: np.ndarray
    shapes: np.ndarray
    sizes: np.ndarray
    datum: np.ndarray


@lru_cache(maxsize=2)
def make_boxes(degree: int, n_beside: int, n_inside: int) -> Boxes:
    """Return the shapes of worn tracks of every width and position in a trace of N_TRACE_PARTS equal parts.

    A shape is 1 inside the track and 0 beside it, less its least-squares polynomial, because the datum of a trace is fitted
    too.

    Parameters
    ----------
    degree : int
        Degree of the polynomial.
    n_beside, n_inside : int
        Smallest numbers of parts on either side of a track and inside it.
    """
    datum = make_polynomials(N_TRACE_PARTS, degree)
    spans = []
    for first in range(n_beside, N_TRACE_PARTS - n_beside):
        for stop in range(first + n_inside, N_TRACE_PARTS - n_beside + 1):
            spans.append((first, stop))
    spans = np.array(spans)
    parts = np.arange(N_TRACE_PARTS)
    shapes = ((parts >= spans[:, :1]) & (parts < spans[:, 1:])).astype(float)
    shapes -= shapes @ datum @ datum.T
    sizes = np.linalg.norm(shapes, axis=1)
    return Boxes(spans, shapes / sizes[:, None], sizes, datum)


class ShallowTrack(NamedTuple):
    """Samples of a track that is seen only in means of depths, and the mean depth [m] above which a track is found.

    `samples` is an empty slice if there is none. `limit` holds for a track over the middle third.
    """

    samples: slice
    limit: float


def find_shallow_track(depth) -> ShallowTrack:
    """Find a track in depths (n,) [m] of a trace by the means of its 60 parts.

    It is the likelihood ratio test of a box function that is added to a cubic datum.
    """
    if depth.size < 2 * N_TRACE_PARTS:
        return ShallowTrack(slice(0), MIN_SHALLOW_TRACK_DEVIATIONS * float(depth.std()))
    edges = np.linspace(0, depth.size, N_TRACE_PARTS + 1).astype(int)
    means = np.add.reduceat(depth, edges[:-1]) / np.diff(edges)
    # Smallest number of parts on either side of a shallow track
    boxes = make_boxes(ADDED_DATUM_DEGREE, 5, MIN_SHALLOW_TRACK_PARTS)
    means = means - boxes.datum @ (boxes.datum.T @ means)
    heights = boxes.shapes @ means
    best = int(np.argmax(heights))
    residual = means - heights[best] * boxes.shapes[best]
    freedom = N_TRACE_PARTS - ADDED_DATUM_DEGREE - 4
    spread = float(np.sqrt(residual @ residual / freedom * estimate_correlation(residual)))
    middle = (boxes.spans == (N_TRACE_PARTS // 3, 2 * N_TRACE_PARTS // 3)).all(axis=1)
    # A track of this depth is found although its own error may lower it by two deviations.
    limit = (MIN_SHALLOW_TRACK_DEVIATIONS + 2.0) * spread / float(boxes.sizes[middle][0])
    if heights[best] < MIN_SHALLOW_TRACK_DEVIATIONS * spread:
        return ShallowTrack(slice(0), limit)
    first, stop = boxes.spans[best]
    return ShallowTrack(slice(edges[first], edges[stop]), limit)


def find_detection_limit(depth, noise) -> float:
    """Return the smallest mean depth [m] at which a track in a trace, or a square worn area in a scan, is found.

    `depth` (n,) or (m, n) [m] are the computed depths, and `noise` are their standard deviations where nothing is worn.
    """
    if depth.ndim == 1:
        return find_shallow_track(depth).limit
    side = max(side for side in WINDOW_SIDES[2] if side <= max(min(depth.shape) / 4, 1))
    mean = ndimage.uniform_filter(
        np.clip(depth / noise, -MAX_DEPTH_DEVIATIONS[2], MAX_DEPTH_DEVIATIONS[2]), side
    )
    scatter = max(estimate_one_sided_scale(mean.ravel(), MIN_UNCHANGED_FRACTION[2]), 1 / side)
    threshold = compute_threshold(len(WINDOW_SIDES[2]) * depth.size)
    return float(threshold * scatter * np.median(noise))
