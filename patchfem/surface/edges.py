"""Edges and floor of what wore, in a line of depths below an unworn surface."""

import numpy as np

from .quantity import SIDE

SURE = 5.0  # noises of a mean of neighbours from which they are worn: chance brings it in 1 of 1000 traces
MEANS = (1, 4, 16, 64)  # neighbours
DEEP, LEAST, MOST = 10.0, 12, 400  # noises at which a flank of the wear ends; samples of it to either side
FLOOR = 5  # parts of a track, the deepest of which is its floor


def edge(rest, noise: float, together: float):
    """(edge, lowest, highest) index of the first worn height, None without one."""
    worn = None
    for many in MEANS:
        if many > rest.size:
            break
        mean = np.convolve(rest, np.full(many, 1 / many), "valid")
        deep = np.flatnonzero(mean > SURE * noise * np.sqrt((together if many > 1 else 1.0) / many))
        if deep.size and (worn is None or deep[0] + many - 1 < worn):
            worn = int(deep[0] + many - 1)
    return None if worn is None else edge_near(rest, worn, noise, together)


def edge_near(rest, worn: int, noise: float, together: float) -> tuple:
    """(edge, lowest, highest) index of the first worn height beside one that is worn (`extent_of`).

    What stands above the trace before, as pile-up beside a track does, is unworn: it counts with the noise alone, and
    no flank begins there but for the error of its first height.
    """
    deep = np.flatnonzero(rest[worn:] > DEEP * noise)
    reach = int(np.clip(deep[0] if deep.size else MOST, LEAST, MOST))
    low, high = max(worn - 2 * reach, 0), min(worn + reach, rest.size)
    part, sums = rest[low:high], []
    unworn = np.concatenate([[0.0], np.cumsum(np.where(part > 0, part**2, noise**2))])
    for k in range(part.size - 3):
        base = np.vander(np.arange(part.size - k) / part.size, 3)
        shape = np.linalg.lstsq(base, part[k:], rcond=None)[0]
        left = part[k:] - base @ shape
        above = shape[2] < -3 * noise * np.sqrt(together / left.size) and k < worn - low
        sums.append(np.inf if above else float(unworn[k] + left @ left))
    sums = np.array(sums)
    near = np.flatnonzero(sums <= sums.min() + 1.5 * SIDE**2 * noise**2 * together)
    best = low + int(np.argmin(sums))
    return best, max(low + int(near[0]) - 1, 0), min(low + int(near[-1]) + 1, rest.size - 1)


def floor_of(x, depth, track: tuple, noise: float) -> tuple:
    """(floor [m], samples (bool) of the deepest fifth) of a track in depths (n,) [m] at x (n,) [m].

    track: (begin, width) [m]; noise [m] of a depth. The floor is the highest depth of the parabola through a fifth of
    the width: the mean over all fifths that noise alone may make less deep than the deepest.
    """
    start, width = track
    places = np.linspace(start, start + (1 - 1 / FLOOR) * width, 8 * FLOOR)
    parts = [(x >= place) & (x <= place + width / FLOOR) for place in places]
    means = np.array([float(depth[one].mean()) if one.sum() > 3 else 0.0 for one in parts])
    near = means.max() - 2 * noise / np.sqrt(max(parts[0].sum(), 1))
    tops = [_vertex(depth[one]) for one, mean in zip(parts, means) if mean >= near and one.sum() > 3]
    return float(np.mean(tops or [means.max()])), parts[int(np.argmax(means))]


def _vertex(depth) -> float:
    """Highest depth of the parabola through depths (n,) within them."""
    shape = np.polyfit(np.linspace(-1, 1, depth.size), depth, 2)
    return float(np.polyval(shape, np.clip(-shape[1] / (2 * shape[0]) if shape[0] < 0 else 0.0, -1, 1)))
