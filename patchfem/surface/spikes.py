"""Spikes of an areal scan: single heights that stand far off all of their neighbours."""

import numpy as np

from .areal import Areal, filled
from .profile import MAD_TO_DEVIATION

THRESHOLDS = (10.0, 40.0, 160.0)  # standard deviations; at the lowest a slope may join spikes
MAX_SPIKE_POINTS = 12  # larger groups of points are features of the surface
N_SAMPLED = 100_000  # heights whose scatter about the medians is measured; more do not change it
CHUNK = 131_072  # medians computed at a time, which limits the memory
WINDOW = 5  # points along each side of a median


def spikes_of(scan: Areal) -> np.ndarray:
    """Find the spikes of a scan, (m, n) bool.

    A spike stands off the median of the 5 x 5 heights around it. It has at most twelve points, all
    of which stand off all of their neighbours.
    """
    known = ~scan.missing
    z = filled(scan.z, scan.missing)
    scatter = _scatter_about_medians(z, known)
    spikes = np.zeros(z.shape, bool)
    if not scatter > 0:
        return spikes
    distance = _far_distances(z, known, THRESHOLDS[0] * scatter)
    for threshold in THRESHOLDS:
        with np.errstate(invalid="ignore"):
            spikes |= apart(scan.z, distance > threshold * scatter, threshold * scatter)
    return spikes


def _median_distances(z, places) -> np.ndarray:
    """Return |height - median of 5 x 5| at places (k,) of the flat heights z (m, n)."""
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
    """Estimate the standard deviation of known heights (m, n) about the medians around them.

    Heights that are the median, as most are on a smooth slope, say nothing about the scatter.
    """
    places = np.flatnonzero(known)
    distance = _median_distances(z, places[:: max(places.size // N_SAMPLED, 1)])
    return MAD_TO_DEVIATION * float(np.median(distance[distance > 0])) if distance.any() else 0.0


def _far_distances(z, known, threshold: float) -> np.ndarray:
    """Return how far heights (m, n) stand off their medians, 0 if all neighbours are near."""
    from scipy.ndimage import maximum_filter, minimum_filter

    span = np.maximum(z - minimum_filter(z, WINDOW), maximum_filter(z, WINDOW) - z)
    places = np.flatnonzero((span > threshold) & known)
    out = np.zeros(z.shape)
    out.ravel()[places] = _median_distances(z, places)
    return out


def apart(z, far, threshold: float) -> np.ndarray:
    """Select the far heights that form small groups off all of their neighbours, as no slope does.

    Parameters
    ----------
    z : (m, n) array [m]
    far : (m, n) bool array
    threshold : float [m]
        A group stands off its neighbours by half of it.

    Returns
    -------
    (m, n) bool array
    """
    from scipy.ndimage import find_objects, label

    groups, _ = label(far, np.ones((3, 3)))
    sizes = np.bincount(groups.ravel())
    out = np.zeros(far.shape, bool)
    for number, place in enumerate(find_objects(groups), 1):
        if sizes[number] > MAX_SPIKE_POINTS:
            continue
        around = tuple(slice(max(part.start - 1, 0), part.stop + 1) for part in place)
        own = groups[around] == number
        group = z[around][own]
        rim = z[around][~own & np.isfinite(z[around])]
        if not rim.size:
            continue
        if group.min() > rim.max() + threshold / 2 or group.max() < rim.min() - threshold / 2:
            out[around] |= own
    return out
