"""Spikes of an areal scan: single heights that stand far off all of their neighbours."""

import numpy as np

from .areal import Areal, fill_missing
from .profile import CHUNK, robust_deviation

# Thresholds in standard deviations; a high one separates a spike from a slope.
THRESHOLDS = (10.0, 40.0, 160.0)
# Largest number of points in a spike; larger groups are features of the surface.
MAX_SPIKE_POINTS = 12
# Number of heights from which the scatter about the medians is estimated.
N_SAMPLED_HEIGHTS = 100_000
WINDOW = 5  # number of points along each side of the window of a median


def find_scan_spikes(scan: Areal) -> np.ndarray:
    """Return a mask (m, n) of the spikes of a scan.

    A spike stands off the median of the 5 x 5 heights around it. It has at most twelve points, all
    of which stand off all of their neighbours.
    """
    known = ~scan.missing
    z = fill_missing(scan.z, scan.missing)
    scatter = _scatter_about_medians(z, known)
    if not scatter > 0:
        return np.zeros(z.shape, bool)
    return find_isolated(scan.z, _far_distances(z, known, THRESHOLDS[0] * scatter), scatter)


def find_isolated(z, distance, deviation: float) -> np.ndarray:
    """Find small groups of heights that stand out from all of their neighbours.

    Parameters
    ----------
    z : (m, n) array [m]
        Heights or depths, NaN where missing.
    distance : (m, n) array [m]
        Distance of each height from what it should be.
    deviation : float [m]
        Standard deviation of the distance of a good height.

    Returns
    -------
    (m, n) bool array
    """
    is_isolated = np.zeros(z.shape, bool)
    for threshold in THRESHOLDS:
        with np.errstate(invalid="ignore"):
            far = distance > threshold * deviation
        is_isolated |= _select_isolated(z, far, threshold * deviation)
    return is_isolated


def _median_distances(z, places) -> np.ndarray:
    """Return the distances of some heights from the median of their 5 x 5 neighbours."""
    windows = np.lib.stride_tricks.sliding_window_view(
        np.pad(z, WINDOW // 2, "symmetric"), (WINDOW, WINDOW)
    )
    out = np.empty(places.size)
    for start in range(0, places.size, CHUNK):
        part = slice(start, start + CHUNK)
        rows, columns = np.unravel_index(places[part], z.shape)
        medians = np.median(windows[rows, columns].reshape(-1, WINDOW**2), axis=1)
        out[part] = np.abs(z[rows, columns] - medians)
    return out


def _scatter_about_medians(z, known) -> float:
    """Estimate the standard deviation of known heights (m, n) from the medians around them.

    Heights that are the median, as most are on a smooth slope, say nothing about the scatter.
    """
    places = np.flatnonzero(known)
    distance = _median_distances(z, places[:: max(places.size // N_SAMPLED_HEIGHTS, 1)])
    return robust_deviation(distance[distance > 0]) if distance.any() else 0.0


def _far_distances(z, known, threshold: float) -> np.ndarray:
    """Return the deviations of heights (m, n) from their medians, with 0 for inconspicuous heights."""
    from scipy.ndimage import maximum_filter, minimum_filter

    span = np.maximum(z - minimum_filter(z, WINDOW), maximum_filter(z, WINDOW) - z)
    places = np.flatnonzero((span > threshold) & known)
    out = np.zeros(z.shape)
    out.ravel()[places] = _median_distances(z, places)
    return out


def _select_isolated(z, far, threshold: float) -> np.ndarray:
    """Select groups of deviating heights that differ from all of their neighbours."""
    from scipy.ndimage import find_objects, label

    groups, _ = label(far, np.ones((3, 3)))
    sizes = np.bincount(groups.ravel())
    out = np.zeros(far.shape, bool)
    for number, place in enumerate(find_objects(groups), 1):
        if sizes[number] > MAX_SPIKE_POINTS:
            continue
        around = tuple(slice(max(part.start - 1, 0), part.stop + 1) for part in place)
        is_member = groups[around] == number
        group = z[around][is_member]
        rim = z[around][~is_member & np.isfinite(z[around])]
        if not rim.size:
            continue
        if group.min() > rim.max() + threshold / 2 or group.max() < rim.min() - threshold / 2:
            out[around] |= is_member
    return out
