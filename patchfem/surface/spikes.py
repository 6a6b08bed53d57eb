"""Spikes of an areal scan: single heights that stand far off all around them."""

import numpy as np

from .areal import Areal, filled

SPIKE, WIDEST = (10.0, 40.0, 160.0), 12  # scatters off the medians of 5 x 5 heights; heights of a spike at most
SOME, CHUNK = 100_000, 1 << 17  # heights whose scatter about medians is taken; medians at a time


def spikes_of(scan: Areal) -> np.ndarray:
    """Spikes of a scan, (m, n) bool: single heights that stand far off the median of 5 x 5 around them.

    A spike is twelve heights at most, all of which stand off all of its neighbours; more are a feature of the surface.
    """
    missing = scan.missing
    scale, off = _off_median(filled(scan.z, missing), ~missing)
    spikes = np.zeros(off.shape, bool)
    for least in SPIKE if scale > 0 else ():  # a steep place would join a spike to its neighbours at the lowest
        with np.errstate(invalid="ignore"):
            spikes |= apart(scan.z, off > least * scale, least * scale)
    return spikes


def _off_median(z, known) -> tuple:
    """(scatter of the known heights (m, n) about the medians of 5 x 5 around them, how far each stands off its own (m,
    n)), 0 where that is less than the least spike: half of its neighbours would be as far below or above it. Heights
    that are the median, as most are on a smooth slope, tell nothing of the scatter."""
    from scipy.ndimage import maximum_filter, minimum_filter

    around = np.lib.stride_tricks.sliding_window_view(np.pad(z, 2, "symmetric"), (5, 5))

    def distance(places) -> np.ndarray:
        rows, columns = np.unravel_index(places, z.shape)
        parts = [slice(k, k + CHUNK) for k in range(0, places.size, CHUNK)]
        return np.concatenate([np.abs(z[rows[one], columns[one]] - np.median(
            around[rows[one], columns[one]].reshape(-1, 25), axis=1)) for one in parts] or [np.zeros(0)])

    there = np.flatnonzero(known)
    off = distance(there[::max(there.size // SOME, 1)])
    scale = 1.4826 * float(np.median(off[off > 0])) if off.any() else 0.0
    far = np.maximum(z - minimum_filter(z, 5), maximum_filter(z, 5) - z) > SPIKE[0] * scale
    out, places = np.zeros(z.shape), np.flatnonzero(far & known)
    out.ravel()[places] = distance(places)
    return scale, out


def apart(z, far, least: float) -> np.ndarray:
    """Which far heights (m, n) bool of z (m, n) [m] belong to a small group that stands off all of its neighbours by
    half of a least height [m], as no slope does."""
    from scipy.ndimage import find_objects, label

    names, _ = label(far, np.ones((3, 3)))
    out, sizes = np.zeros(far.shape, bool), np.bincount(names.ravel())
    for name, place in enumerate(find_objects(names), 1):
        if sizes[name] > WIDEST:
            continue
        wide = tuple(slice(max(one.start - 1, 0), one.stop + 1) for one in place)
        own = names[wide] == name
        rim, top = z[wide][~own & np.isfinite(z[wide])], z[wide][own]
        if rim.size and (top.min() > rim.max() + least / 2 or top.max() < rim.min() - least / 2):
            out[wide] |= own
    return out
