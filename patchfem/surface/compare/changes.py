"""Heights of a trace that noise does not explain: single samples, running means, shallow tracks."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ..profile import find_runs
from .statistics import compute_threshold, estimate_correlation, estimate_one_sided_scale

WINDOWS = (1, 4, 16, 64)  # number of samples in the running means that are tested
MIN_RUN = (
    4  # samples of the shortest worn part; a single one may be an error of interpolation at a kink
)
MAX_PULL = 4.0  # standard deviations to which a single depth counts in a mean
TOP_FRACTIONS = (0.05, 0.1, 0.2, 0.4)  # fractions of the heights that are tested as worn tops
MIN_TOP_DEVIATIONS = 6.0  # standard deviations of their mean depth above which tops are worn
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
    limit = compute_threshold(len(WINDOWS) * depth.size)
    changed = relative > limit
    remainder = np.clip(np.where(changed, 0.0, relative), -MAX_PULL, MAX_PULL)
    for window in WINDOWS[1:]:
        if window > depth.size / 4:
            break
        # Slow errors of the datum make means scatter more than those of white noise.
        mean = ndimage.uniform_filter1d(remainder, window)
        scatter = max(estimate_one_sided_scale(mean[~changed]), 1 / np.sqrt(window))
        changed |= ndimage.binary_dilation(mean > limit * scatter, iterations=window // 2)
    changed[find_shallow_track(np.clip(depth, -MAX_PULL * noise, MAX_PULL * noise)).samples] = True
    grown = ndimage.binary_dilation(changed)
    return ndimage.binary_opening(grown, np.ones(MIN_RUN + 2))


def find_changed_tops(heights, relative, correlation: float) -> np.ndarray:
    """Return the tops (n,) bool of a surface whose mean depth shows wear below the noise of a height.

    The mean over the tops must differ from that of the middle heights by more than the mean of the
    valleys does; an error of the gain of the instrument changes both alike.

    Parameters
    ----------
    heights : (n,) array [m]
        Means of both surfaces, whose noise is independent of that of the depth.
    relative : (n,) array
        Depth in standard deviations.
    correlation : float
        Number of neighbouring samples that share an error.
    """
    rank = np.argsort(np.argsort(heights)) / heights.size
    relative = np.clip(relative, -MAX_PULL, MAX_PULL)
    tops = np.zeros(heights.size, bool)
    highest = MIN_TOP_DEVIATIONS
    middle = relative[np.abs(rank - 0.5) < 0.1].mean()
    for fraction in TOP_FRACTIONS:
        is_top = rank > 1 - fraction
        rise = relative[is_top].mean() - middle
        fall = middle - relative[rank < fraction].mean()
        deviations = (rise - 2 * abs(fall)) * np.sqrt(is_top.sum() / correlation / 2)
        if deviations > highest:
            highest = deviations
            tops = is_top
    return tops


def find_specks(x, first, second, worn, grown) -> np.ndarray:
    """Return the samples (n,) bool of dust and of scratches that only the first trace has.

    Such places are narrow and few. Where depth is lost there, the first trace stands above the surface
    around it and above all its other heights; in a scratch, the second trace stands below instead. Many
    such places are worn or grown tops, and one directly beside a wide track is its ridge.

    Parameters
    ----------
    x, first, second : (n,) array [m]
    worn, grown : (n,) bool array
    """
    specks = np.zeros(x.size, bool)
    smooth = first - ndimage.median_filter(first, min(x.size // 10, 401))
    highest = SPECK_HEIGHT * smooth[~worn].max(initial=0.0)
    for changed, other, is_loss in ((worn, grown, True), (grown, worn, False)):
        found = []
        tracks = np.zeros(x.size + 2 * MIN_RUN, bool)
        for start, last in find_runs(other):
            if x[last] - x[start] > MAX_SPECK_WIDTH:
                tracks[start : last + 2 * MIN_RUN + 1] = True
        for start, last in find_runs(changed):
            is_ridge = tracks[start + MIN_RUN : last + MIN_RUN + 1].any()
            if x[last] - x[start] > MAX_SPECK_WIDTH or is_ridge:
                continue
            inside = slice(start, last + 1)
            margin = last - start + 3
            beside = np.r_[
                max(start - margin, 0) : start, last + 1 : min(last + 1 + margin, x.size)
            ]
            level = float(np.median(second[beside])) if beside.size else 0.0
            rise = first[inside].max() - level
            fall = level - second[inside].min()
            is_dust = smooth[inside].max() > highest and rise > 2 * fall
            if is_dust or not is_loss:
                found.append(slice(max(start - 2, 0), last + 3))
        for part in found if len(found) <= MAX_SPECKS else ():
            specks[part] = True
    return specks


class Boxes(NamedTuple):
    """Spans (k, 2) of parts, and unit boxes (k, N_PARTS) over them, free of the datum."""

    spans: np.ndarray
    shapes: np.ndarray
    sizes: np.ndarray
    datum: np.ndarray


@lru_cache(maxsize=2)
def make_boxes(degree: int, n_beside: int, n_inside: int) -> Boxes:
    """Return boxes with at least `n_inside` parts, and `n_beside` on each side, free of a polynomial datum."""
    datum = np.linalg.qr(np.vander(np.linspace(-1, 1, N_PARTS), degree + 1))[0]
    spans = []
    for first in range(n_beside, N_PARTS - n_beside):
        for stop in range(first + n_inside, N_PARTS - n_beside + 1):
            spans.append((first, stop))
    spans = np.array(spans)
    parts = np.arange(N_PARTS)
    shapes = ((parts >= spans[:, :1]) & (parts < spans[:, 1:])).astype(float)
    shapes -= shapes @ datum @ datum.T
    sizes = np.linalg.norm(shapes, axis=1)
    return Boxes(spans, shapes / sizes[:, None], sizes, datum)


def find_shallow_track(depth) -> ShallowTrack:
    """Find a track in the means of 60 parts, by the likelihood ratio of a box beside a cubic datum."""
    if depth.size < 2 * N_PARTS:
        return ShallowTrack(slice(0), MIN_STEP * float(depth.std()))
    edges = np.linspace(0, depth.size, N_PARTS + 1).astype(int)
    means = np.add.reduceat(depth, edges[:-1]) / np.diff(edges)
    boxes = make_boxes(DATUM_DEGREE, FLANK_PARTS, MIN_TRACK_PARTS)
    means = means - boxes.datum @ (boxes.datum.T @ means)
    heights = boxes.shapes @ means
    best = int(np.argmax(heights))
    residual = means - heights[best] * boxes.shapes[best]
    freedom = N_PARTS - DATUM_DEGREE - 4
    spread = float(np.sqrt(residual @ residual / freedom * estimate_correlation(residual)))
    middle = (boxes.spans == (N_PARTS // 3, 2 * N_PARTS // 3)).all(axis=1)
    # A track of this depth is found although its own error may lower it by two deviations.
    limit = (MIN_STEP + 2.0) * spread / float(boxes.sizes[middle][0])
    if heights[best] < MIN_STEP * spread:
        return ShallowTrack(slice(0), limit)
    first, stop = boxes.spans[best]
    return ShallowTrack(slice(edges[first], edges[stop]), limit)
