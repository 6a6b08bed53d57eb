"""The even heights that all parameters of a trace are read from, with what several of them share: moments, the spacing
of hills and dales (ISO 4287, ISO 21920-2), the Abbott curve, its core (ISO 13565-2, ISO 21920-2) and its volumes
(ISO 25178-2)."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

HIGH = 0.10  # of Rz: a hill or dale below this does not count
WIDE = 0.01  # of the section: nor one narrower than this
CENTRE = 0.40  # share of the length under the secant of the core


@dataclass(frozen=True, eq=False)
class Heights:
    """Heights z (n,) [m] about their mean line, every `step` [m]: the primary or the roughness profile.

    section: length [m] over which a peak, a valley or a spacing is looked for, the cut-off; None: the whole trace.
    level: height [m] above the mean line at which a material ratio is read; ratios: the two material ratios [1] whose
    heights are set side by side.
    """

    z: np.ndarray
    step: float
    section: float | None = None
    level: float = 0.0
    ratios: tuple = (0.1, 0.9)

    @property
    def length(self) -> float:
        """Length [m] of the trace, a step for each sample."""
        return self.z.size * self.step

    @cached_property
    def sections(self) -> np.ndarray:
        """The whole sections (k, samples) [m] from the start of the trace; what is left at its end belongs to none."""
        if self.section is None:
            return self.z[None, :]
        size = round(self.section / self.step)
        count = self.z.size // size
        return self.z[:count * size].reshape(count, size)

    @cached_property
    def ordered(self) -> np.ndarray:
        """The heights from the highest to the lowest (n,) [m]."""
        return np.sort(self.z)[::-1]

    @cached_property
    def power(self) -> float:
        """Mean square [m2]."""
        return float(self.z @ self.z) / self.z.size

    @cached_property
    def core(self) -> "Core | None":
        """The core of its Abbott curve, worked out once for its five parameters; None for a flat trace."""
        return core(self)


def root_mean_square(heights: Heights) -> float:
    """Rq: root mean square of the heights [m]."""
    return float(np.sqrt(heights.power))


def moment(heights: Heights, order: int) -> float | None:
    """Mean 3rd or 4th power of the heights over that of their root mean square [1], None for a flat trace."""
    rms = np.sqrt(heights.power)
    if rms == 0:
        return None
    unit = heights.z / rms
    square = unit * unit
    return float((square @ unit if order == 3 else square @ square) / unit.size)


def of_sections(heights: Heights, size) -> float | None:
    """Mean over the sections of size((k, samples) [m]) -> (k,), None where the trace is shorter than one."""
    return float(size(heights.sections).mean()) if len(heights.sections) else None


def peak_to_valley(heights: Heights) -> float | None:
    """Rz: from the deepest valley to the highest peak [m], mean over the sections."""
    return of_sections(heights, lambda z: z.max(axis=1) - z.min(axis=1))


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


def mean_element(heights: Heights) -> float | None:
    """Rc: mean height of the elements of `mean_spacing` from dale to hill [m], None where the trace holds none."""
    places = crossings(heights)
    if places.size < 3:
        return None
    parts = np.maximum.reduceat(np.abs(heights.z), np.floor(places / heights.step).astype(int) + 1)[:-1]
    return float((parts[1:] + parts[:-1]).mean())


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


def height_at(heights: Heights, ratio: float) -> float:
    """Height [m] that this share [1] of the length lies above."""
    return float(np.interp(ratio, _ratios(heights.z.size), heights.ordered))


def material_ratio(heights: Heights) -> float:
    """Rmr(c): share [1] of the length that lies above the height c, `level`."""
    return _ratio_at(heights.ordered, heights.level)


def ratio_heights(heights: Heights) -> float:
    """Rdc: height [m] between two material ratios, `ratios`."""
    first, second = (height_at(heights, one) for one in heights.ratios)
    return first - second


def volume(heights: Heights, ratio: float, material: bool) -> float:
    """Volume of the material above, or of the void below, the height of a material ratio, per area [m3/m2]."""
    off = heights.ordered - height_at(heights, ratio)
    return float(np.maximum(off if material else -off, 0.0).mean())


def _ratio_at(z, level: float) -> float:
    """Share of the length that lies above a height, straight between samples."""
    n = z.size
    k = int(np.searchsorted(-z, -level))
    if k in (0, n):
        return k / n
    return float((k - 0.5 + (z[k - 1] - level) / (z[k - 1] - z[k] if z[k - 1] > z[k] else 1.0)) / n)
