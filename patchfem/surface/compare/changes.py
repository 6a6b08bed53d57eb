"""Heights of a trace that noise does not explain: single samples, running means, shallow tracks."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ..profile import find_runs
from .statistics import UNWORN_LIMIT, compute_threshold, estimate_correlation

WINDOWS = (1, 4, 16, 64)  # number of samples in the running means that are tested
MIN_RUN = (
    4  # samples of the shortest worn part; a single one may be an error of interpolation at a kink
)
MAX_PULL = 4.0  # standard deviations to which a single depth counts in a mean
MAX_SPECK_WIDTH = 50e-6  # largest width of a speck of dust [m]
MAX_SPECKS = 4  # number of specks above which they are worn or grown tops of the surface
SPECK_HEIGHT = 1.2  # smallest height of a speck relative to that of all unchanged heights
N_PARTS = 60  # number of parts of the trace whose means show a shallow track
FLANK_PARTS = 5  # smallest number of parts on either side of a shallow track
MIN_TRACK_PARTS = 3  # smallest number of parts in a shallow track
DATUM_DEGREE = 3  # degree of the polynomial that a datum may add to shallow depths
# Smallest height of a shallow track in standard deviations; 2 % of random walks have a deeper one.
MIN_STEP = 8.0


class ShallowTrack(NamedTuple):
    """Samples of a track that only means show, and the mean depth [m] from which on it is found.

    `samples` is empty if there is none. `limit` holds for a track over the middle third.
    """

    samples: slice
    limit: float


def find_changed(depth, noise) -> np.ndarray:
    """Return the samples (n,) bool whose depth, alone or in running means, noise does not explain."""
    relative = depth / noise
    quiet = relative[np.abs(relative) < UNWORN_LIMIT]
    correlation = estimate_correlation(quiet) if quiet.size > 50 else 1.0
    limit = compute_threshold(len(WINDOWS) * depth.size)
    changed = relative > limit
    remainder = np.clip(np.where(changed, 0.0, relative), -MAX_PULL, MAX_PULL)
    for window in WINDOWS[1:]:
        if window > depth.size / 4:
            break
        mean = ndimage.uniform_filter1d(remainder, window)
        is_high = mean > limit * np.sqrt(correlation / window)
        changed |= ndimage.binary_dilation(is_high, iterations=window // 2)
    changed[find_shallow_track(np.clip(depth, -MAX_PULL * noise, MAX_PULL * noise)).samples] = True
    grown = ndimage.binary_dilation(changed)
    return ndimage.binary_opening(np.pad(grown, MIN_RUN, "edge"), np.ones(MIN_RUN + 2))[
        MIN_RUN:-MIN_RUN
    ]


def find_specks(x, first, second, changed) -> np.ndarray:
    """Return the samples (n,) bool of specks of dust among changed heights of two aligned traces.

    A speck is narrow, and only one trace stands above the surface around it. In a scratch the second
    trace stands below it instead. Many such places are worn tops.

    Parameters
    ----------
    x, first, second : (n,) array [m]
    changed : (n,) bool array
        Worn or grown heights.
    """
    is_speck = np.zeros(x.size, bool)
    count = 0
    smooth = [z - ndimage.median_filter(z, min(x.size // 10, 401)) for z in (first, second)]
    levels = [SPECK_HEIGHT * z[~changed].max(initial=0.0) for z in smooth]
    for start, last in find_runs(changed):
        if x[last] - x[start] > MAX_SPECK_WIDTH:
            continue
        inside = slice(start, last + 1)
        margin = last - start + 3
        beside = np.r_[max(start - margin, 0) : start, last + 1 : min(last + 1 + margin, x.size)]
        level = np.median(second[beside]) if beside.size else 0.0
        tops = [z[inside].max() for z in smooth]
        highest = int(np.argmax(tops))
        rise = (first, second)[highest][inside].max() - level
        fall = level - (second, first)[highest][inside].min()
        if tops[highest] > levels[highest] and rise > 2 * fall:
            count += 1
            is_speck[max(start - 2, 0) : last + 3] = True
    return is_speck if count <= MAX_SPECKS else np.zeros(x.size, bool)


class _Boxes(NamedTuple):
    """Spans (k, 2) of parts, and unit boxes (k, N_PARTS) over them, free of a cubic datum."""

    spans: np.ndarray
    shapes: np.ndarray
    sizes: np.ndarray
    datum: np.ndarray


@lru_cache(maxsize=1)
def _make_boxes() -> _Boxes:
    datum = np.linalg.qr(np.vander(np.linspace(-1, 1, N_PARTS), DATUM_DEGREE + 1))[0]
    spans = []
    for first in range(FLANK_PARTS, N_PARTS - FLANK_PARTS):
        for stop in range(first + MIN_TRACK_PARTS, N_PARTS - FLANK_PARTS + 1):
            spans.append((first, stop))
    spans = np.array(spans)
    parts = np.arange(N_PARTS)
    shapes = ((parts >= spans[:, :1]) & (parts < spans[:, 1:])).astype(float)
    shapes -= shapes @ datum @ datum.T
    sizes = np.linalg.norm(shapes, axis=1)
    return _Boxes(spans, shapes / sizes[:, None], sizes, datum)


def find_shallow_track(depth) -> ShallowTrack:
    """Find a track in the means of 60 parts, by the likelihood ratio of a box beside a cubic datum."""
    edges = np.linspace(0, depth.size, N_PARTS + 1).astype(int)
    means = np.add.reduceat(depth, edges[:-1]) / np.diff(edges)
    boxes = _make_boxes()
    means = means - boxes.datum @ (boxes.datum.T @ means)
    heights = boxes.shapes @ means
    best = int(np.argmax(heights))
    residual = means - heights[best] * boxes.shapes[best]
    freedom = N_PARTS - DATUM_DEGREE - 4
    spread = float(np.sqrt(residual @ residual / freedom * estimate_correlation(residual)))
    middle = (boxes.spans == (N_PARTS // 3, 2 * N_PARTS // 3)).all(axis=1)
    limit = MIN_STEP * spread / float(boxes.sizes[middle][0])
    if heights[best] < MIN_STEP * spread:
        return ShallowTrack(slice(0), limit)
    first, stop = boxes.spans[best]
    return ShallowTrack(slice(edges[first], edges[stop]), limit)
