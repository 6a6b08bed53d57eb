"""Mean spacing of the hills and dales that are high and wide enough to count (ISO 4287, ISO 21920-2)."""

import numpy as np

from .parameters import Heights, peak_to_valley

HIGH = 0.10  # of Rz: a hill or dale below this does not count
WIDE = 0.01  # of the section: nor one narrower than this


def mean_spacing(heights: Heights) -> float | None:
    """RSm: mean length of a hill and its neighbouring dale [m], None where the trace holds none.

    The mean line cuts the trace into hills and dales. Those lower than 10 % of Rz or narrower than 1 % of the section
    do not count, and neighbours of one sign become one. Without a cut-off the height alone decides: a share of the
    trace's length would make the spacing one of the length. An element reaches from a
    rise through the mean line to the next rise, or from a fall to the next fall; the mean is over both kinds.
    """
    places = crossings(heights)
    if places.size < 3:
        return None
    spans = [part[-1] - part[0] for part in (places[::2], places[1::2]) if part.size > 1]
    count = sum(part.size - 1 for part in (places[::2], places[1::2]) if part.size > 1)
    return float(sum(spans)) / count


def crossings(heights: Heights) -> np.ndarray:
    """Places [m] from the first sample where a hill that counts ends and a dale that counts begins, or the reverse."""
    z, step = heights.z, heights.step
    rough = peak_to_valley(heights)
    if rough is None:
        rough = float(np.ptp(z))
    above = z > 0
    starts = np.flatnonzero(above[1:] != above[:-1])  # the last sample before each crossing
    if not starts.size or rough == 0:
        return np.empty(0)
    at = (starts + z[starts] / (z[starts] - z[starts + 1])) * step
    first = np.concatenate([[0], starts + 1])
    extent = np.maximum.reduceat(np.abs(z), first)
    width = np.diff(np.concatenate([[0.0], at, [(z.size - 1) * step]]))
    counts = (extent >= HIGH * rough) & (width >= WIDE * (heights.section or 0.0))
    counts[[0, -1]] = extent[[0, -1]] >= HIGH * rough  # cut off by the ends: their width is not known
    kept = np.flatnonzero(counts)
    signs = above[first[kept]]
    turns = np.flatnonzero(signs[1:] != signs[:-1]) + 1
    return at[kept[turns] - 1]  # a part begins at the crossing before it
