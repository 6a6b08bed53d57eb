"""Edges and floor of what wore, in a line of depths below an unworn surface."""

import numpy as np

from .quantity import SIDE

CHANCE = 1e-3  # of traces in which noise alone is taken for worn
MEANS = (1, 4, 16, 64)  # neighbours
DEEP, LEAST, MOST = 10.0, 12, 400  # noises at which a flank of the wear ends; samples of it to either side
ABOVE = 3.0  # noises above the trace before from which a height is pile-up
CLEARLY = 12.0  # noises squared that a step leaves less than a flank from zero, to be taken
FLOOR = 5  # parts of a track, the deepest of which is its floor


def sure_of(count: int, looks: int = len(MEANS)) -> float:
    """Deviations that normal noise exceeds, in one of so many looks at each of so many heights, in 1 of 1000 traces
    (Bonferroni)."""
    from scipy.special import ndtri

    return float(-ndtri(CHANCE / max(count * looks, 1)))


def edge(rest, noise: float, together: float):
    """(edge, lowest, highest) index of the first worn height, None without one."""
    worn, sure = None, sure_of(rest.size)
    for many in MEANS:
        if many > rest.size:
            break
        mean = np.convolve(rest, np.full(many, 1 / many), "valid")
        deep = np.flatnonzero(mean > sure * noise * np.sqrt((together if many > 1 else 1.0) / many))
        if deep.size and (worn is None or deep[0] + many - 1 < worn):
            worn = int(deep[0] + many - 1)
    return None if worn is None else edge_near(rest, worn, noise, together)


def edge_near(rest, worn: int, noise: float, together: float) -> tuple:
    """(edge, lowest, highest) index of the first worn height beside one that is worn (`extent_of`).

    The flank begins at zero, unless one that begins with a step fits clearly better: a step is free to stand within a
    flank that begins at zero, which draws the edge into the track. What stands above the trace before, as pile-up
    beside a track does, is unworn: it counts with the noise alone, and no flank begins there but for the error of its
    first height.
    """
    deep = np.flatnonzero(rest[worn:] > DEEP * noise)
    reach = int(np.clip(deep[0] if deep.size else MOST, LEAST, MOST))
    low, high = max(worn - 2 * reach, 0), min(worn + reach, rest.size)
    part = rest[low:high]
    unworn = np.concatenate([[0.0], np.cumsum(np.where(part > -ABOVE * noise, part**2, noise**2))])
    sums = np.full((2, max(part.size - 3, 1)), np.inf)
    for k in range(sums.shape[1]):
        sums[:, k] = unworn[k] + _left(part[k:], noise * np.sqrt(together), k < worn - low)
    sums = sums[int(sums[1].min() < sums[0].min() - CLEARLY * noise**2 * together)]
    near = np.flatnonzero(sums <= sums.min() + 1.5 * SIDE**2 * noise**2 * together)
    best = low + int(np.argmin(sums))
    return best, max(low + int(near[0]) - 1, 0), min(low + int(near[-1]) + 1, rest.size - 1)


def foot(rest, worn: int, noise: float):
    """(edge, lowest, highest) index of the foot of a shallow flank in depths (n,) that end in the middle of a track;
    None where the track begins with a step.

    The depth is zero up to the foot and b t + c t^2 from there to the middle, or a step and then the same depth. The
    foot is that of the least sum of squares; every foot within 5.8 noise^2 of it is in the interval. worn: first index
    that the means show as worn; noise [m] of a depth, times the root of how many neighbours err alike.
    """
    apart = max(rest.size // 500, 1)
    places = np.arange(max(2 * worn - rest.size, 0), worn + (rest.size - worn) // 2, apart)
    square, step = np.cumsum(np.concatenate([[0.0], rest**2])), np.inf
    sums = np.full(places.size, np.inf)
    for at, k in enumerate(places):
        flank = rest[k:]
        t = np.arange(1, flank.size + 1) / flank.size
        base = np.column_stack([t, t * t])
        shape = np.linalg.solve(base.T @ base, base.T @ flank)
        if shape[0] < 0:  # rises out of the surface
            shape = np.array([0.0, max(float(base[:, 1] @ flank) / float(base[:, 1] @ base[:, 1]), 0.0)])
        sums[at] = square[k] + float(((flank - base @ shape) ** 2).sum())
        step = min(step, square[k] + float(((flank - flank.mean()) ** 2).sum()))
    if step < sums.min():
        return None
    near = places[sums <= sums.min() + 1.5 * SIDE**2 * noise**2]
    return int(places[int(np.argmin(sums))]), max(int(near[0]) - apart, 0), min(int(near[-1]) + apart, rest.size - 1)


def _left(flank, noise: float, before: bool) -> tuple:
    """Sums of squares that flanks from zero and from a step leave of depths (n,) [m]; noise [m] of their mean times
    sqrt(n); before: no step up begins there.

    A flank from zero begins at its first height, at the last unworn one, or half-way, and rises out of the surface: one
    that would dip above it first is c t^2.
    """
    n, square = flank.size, float(flank @ flank)
    base = np.vander(np.arange(n) / n, 3)
    shape = np.linalg.lstsq(base, flank, rcond=None)[0]
    left = flank - base @ shape
    smooth = []
    for t in ((np.arange(n) + off) / n for off in (0.0, 0.5, 1.0)):
        t2 = t * t
        (a, b, c), p, q = (float(t @ t), float(t @ t2), float(t2 @ t2)), float(flank @ t), float(flank @ t2)
        rise = (c * p - b * q) / (a * c - b * b)
        smooth.append(square - (rise * p + (q - b * rise) / c * q if rise >= 0 else max(q, 0.0)**2 / c))
    above = before and shape[2] < -3 * noise / np.sqrt(n)
    return min(smooth), np.inf if above else float(left @ left)


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
