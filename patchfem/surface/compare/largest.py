"""Largest worn depth, smoothed by parabolas so that the noise does not enlarge it."""

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..quantity import Quantity, make_quantity
from .boxes import part_edges
from .robust import MAX_NOISE, MAX_OUTLIER
from .section import Section

MIN_WINDOW = 5  # number of samples in the shortest window
MAX_WINDOW = 1025  # number of samples in the longest window
N_PARTS = 8  # number of parts of a window; the parabola must also fit the mean of each part
# Largest misfit in standard deviations, for which the parabola fits
# 97 % of the windows of pure noise.
MAX_MISFIT = 2.5
# Number of standard deviations subtracted from each depth when the largest depth is selected; errors of
# interpolation at walls reach five of them.
PENALTY = 5.0


class _Windows(NamedTuple):
    """First sample and length (n,) of the window around each depth."""

    start: np.ndarray
    size: np.ndarray


class _Group(NamedTuple):
    """Samples of a window, and the depths evaluated from its parabola with their rows of coefficients."""

    samples: slice
    members: np.ndarray
    rows: np.ndarray

    @property
    def length(self) -> int:
        """Number of samples."""
        return self.samples.stop - self.samples.start


def measure_largest_depth(section: Section, text: str) -> Quantity:
    """Measure the largest worn depth.

    Depths are w + noise, and the largest of n of them is too large by about noise sqrt(2 log n). So each
    depth is read from the parabola through the longest window (5 to 1025 heights) around it that shows no
    misfit beyond the noise; where no window fits, it is the height itself. The remaining excess is that
    of the drawn errors in the same windows about depths whose scatter is that of the surface alone, and
    is subtracted. The variance is that of the draws and of half of the excess. The upper end contains every depth,
    because a crest to which no parabola fits may be worn as deep as its uncertain height.

    Parameters
    ----------
    section : Section
    text : str
        Definition of the quantity.
    """
    depth = section.depth
    noise = section.noise
    windows = _fit_windows(depth, noise, section.correlation)
    smooth = np.empty(depth.size)
    deviation = np.empty(depth.size)
    for group in _group_by_window(windows, np.arange(depth.size)):
        base = _parabolas(group.length)
        smooth[group.members] = group.rows @ (base.T @ depth[group.samples])
        influence = (group.rows @ base.T) * noise[group.samples]
        variance = (influence**2).sum(axis=1) * section.correlation
        deviation[group.members] = np.sqrt(variance)
    penalty = PENALTY * deviation
    top = int(np.argmax(smooth - penalty))
    lowest = smooth[top] - MAX_OUTLIER * deviation[top]
    near = np.flatnonzero(smooth + MAX_OUTLIER * deviation > lowest)
    clean = _shrink_scatter(smooth, deviation, near)
    peaks = _draw_peaks(section, list(_group_by_window(windows, near)), clean, penalty)
    deepest = near[np.argmax(clean[near] - penalty[near])]
    excess = float(peaks.mean() - clean[deepest])
    error = float(np.sqrt(peaks.var() + excess**2 / 4))
    largest = make_quantity(float(smooth[top] - excess), error, "m", text, 0.0)
    return largest._replace(high=max(largest.high, float(smooth.max())))


def _draw_peaks(section: Section, groups: list, clean, penalty) -> np.ndarray:
    """Return the largest depth (draws,) [m] in each draw of the errors."""
    n_draws = len(section.draws)
    peaks = np.empty(n_draws)
    best_ranks = np.full(n_draws, -np.inf)
    for group in groups:
        errors = section.draws[:, group.samples] @ _parabolas(group.length) @ group.rows.T
        ranks = clean[group.members] + errors - penalty[group.members]
        best = np.argmax(ranks, axis=1)
        rank = ranks[np.arange(n_draws), best]
        is_better = rank > best_ranks
        peaks[is_better] = (rank + penalty[group.members][best])[is_better]
        best_ranks[is_better] = rank[is_better]
    return peaks


def _shrink_scatter(smooth, deviation, near) -> np.ndarray:
    """Shrink smooth depths (n,) to their mean by the fraction of their scatter that is noise.

    Depths of a flat floor, which differ by noise alone, become equal, so that draws about them show the
    whole bias of a maximum. Those of a round scar hardly change.
    """
    variance = deviation**2
    total = float(smooth[near].var())
    surface = max(total - float(variance[near].mean()), 0.0)
    weight = 1 / (surface + variance[near])
    mean = float(weight @ smooth[near] / weight.sum())
    return mean + np.sqrt(surface / (surface + variance)) * (smooth - mean)


def _group_by_window(windows: _Windows, depths) -> Iterator[_Group]:
    """Group depths (indices) by the window from which they are evaluated."""
    start, size = windows
    order = depths[np.lexsort((start[depths], size[depths]))]
    ends = np.flatnonzero(np.diff(start[order]) | np.diff(size[order])) + 1
    for members in np.split(order, ends):
        first = int(start[members[0]])
        length = int(size[members[0]])
        yield _Group(slice(first, first + length), members, _parabolas(length)[members - first])


@lru_cache(maxsize=16)
def _parabolas(length: int) -> np.ndarray:
    """Return orthonormal parabolas (length, 3) over a window; (1, 1) for a single height."""
    if length == 1:
        return np.ones((1, 1))
    return np.linalg.qr(np.vander(np.linspace(-1, 1, length), 3))[0]


def _fit_windows(depth, noise, correlation: float) -> _Windows:
    """Find the longest window around each depth to which a parabola fits; it may be a single sample.

    Of the windows of a length, the one with the nearest middle is taken. A depth is read from the half
    of the window around it.
    """
    here = np.arange(depth.size)
    start = here.copy()
    size = np.ones(depth.size, int)
    length = MIN_WINDOW
    while length <= min(MAX_WINDOW, depth.size):
        first = np.arange(0, depth.size - length + 1, max(length // N_PARTS, 1))
        views = [np.lib.stride_tricks.sliding_window_view(z, length)[first] for z in (depth, noise)]
        fitting = first[_fits_parabola(*views, correlation)]
        if not fitting.size:
            break
        after = np.searchsorted(fitting + length // 2, here).clip(1, max(fitting.size - 1, 1))
        pair = fitting[np.clip(np.stack([after - 1, after]), 0, fitting.size - 1)]
        distance = np.abs(pair + length // 2 - here)
        nearest = np.where(distance[0] <= distance[1], pair[0], pair[1])
        # A corner next to the window would raise its outer heights.
        is_inside = distance.min(axis=0) <= length // 4
        start[is_inside] = nearest[is_inside]
        size[is_inside] = length
        length = 2 * length - 1
    half = (size + 1) // 2
    spacing = np.maximum(half // N_PARTS, 1)
    first = (here - half // 2) // spacing * spacing
    return _Windows(np.clip(first, start, start + size - half), half)


def _fits_parabola(windows, noise, correlation: float) -> np.ndarray:
    """Return for which windows (m, length) a parabola fits the depths to within the noise (m, length)."""
    length = windows.shape[1]
    base = _parabolas(length)
    residual = windows - (windows @ base) @ base.T
    freedom = length - 3
    relative = np.abs(residual) / noise
    # An error of interpolation at a kink is larger than normal noise; it does not end a window.
    chi_squared = (np.minimum(relative, MAX_NOISE) ** 2).sum(axis=1)
    fits = chi_squared <= freedom + MAX_MISFIT * np.sqrt(2 * freedom * correlation)
    fits &= relative.max(axis=1) < MAX_OUTLIER
    if length >= 2 * N_PARTS:
        edges = part_edges(length, N_PARTS)[:-1]
        sums = np.add.reduceat(residual, edges, axis=1)
        expected = np.sqrt(np.add.reduceat(noise**2, edges, axis=1) * correlation)
        fits &= (np.abs(sums) <= MAX_MISFIT * expected).all(axis=1)
    return fits
