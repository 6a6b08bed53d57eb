"""Abbott curve of a trace and the core, peaks and valleys read off it (ISO 13565-2, ISO 21920-2)."""

from typing import NamedTuple

import numpy as np

from .parameters import Heights

CENTRE = 0.40  # share of the length under the secant of the core


class Core(NamedTuple):
    """Core height Rk, reduced peak height Rpk and reduced valley depth Rvk [m], and the material ratios Mr1 and Mr2 [1]
    between which the core lies; slope [m] and top [m]: the straight line of the core, top - slope ratio."""

    core: float
    peaks: float
    valleys: float
    first: float
    second: float
    top: float


def abbott(heights: Heights, count: int = 501) -> tuple:
    """Abbott curve: material ratio (count,) [1] from 0 to 1 and the height (count,) [m] that it is reached at."""
    ratio = np.linspace(0.0, 1.0, count)
    return ratio, np.interp(ratio, _ratios(heights.z.size), heights.ordered)


def _ratios(count: int) -> np.ndarray:
    return (np.arange(count) + 0.5) / count


def core(heights: Heights) -> Core | None:
    """Core of a trace, None for a flat one.

    The straight line of the core is the least-squares line of the heights in that 40 % of the Abbott curve whose secant
    falls least (the first such part). It runs from the top at ratio 0 to the bottom at ratio 1, and their distance is
    Rk. Rpk is twice the area of the peaks above the top over Mr1, Rvk twice that of the valleys below the bottom over
    1 - Mr2: triangles of equal area. The trace is filtered like that of the other parameters, without the second stage
    of ISO 13565-1.
    """
    z = heights.ordered
    n = z.size
    size = max(round(CENTRE * n), 2)
    if n < 5 or z[0] == z[-1]:
        return None
    falls = z[:n - size + 1] - z[size - 1:]
    start = int(np.argmin(falls))
    t = _ratios(n)[start:start + size]
    middle, part = t.mean(), z[start:start + size]
    slope = float((t - middle) @ (part - part.mean()) / ((t - middle) @ (t - middle)))
    top = float(part.mean() - slope * middle)
    bottom = top + slope
    first, second = (_ratio_at(z, level) for level in (top, bottom))
    above = z[:np.searchsorted(-z, -top)]
    below = z[np.searchsorted(-z, -bottom, "right"):]
    peaks = 2 * float((above - top).sum()) / n / first if first > 0 else 0.0
    valleys = 2 * float((bottom - below).sum()) / n / (1 - second) if second < 1 else 0.0
    return Core(-slope, peaks, valleys, first, second, top)


def _ratio_at(z, level: float) -> float:
    """Share of the length that lies above a height, straight between samples."""
    n = z.size
    k = int(np.searchsorted(-z, -level))
    if k in (0, n):
        return k / n
    return float((k - 0.5 + (z[k - 1] - level) / (z[k - 1] - z[k] if z[k - 1] > z[k] else 1.0)) / n)


def core_of(heights: Heights) -> Core | None:
    """`core` of a record, worked out once for its five parameters and kept with it."""
    if "core" not in heights.kept:
        heights.kept["core"] = core(heights)
    return heights.kept["core"]
