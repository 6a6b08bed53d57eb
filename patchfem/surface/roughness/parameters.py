"""Quantities of an evenly sampled profile that several roughness parameters share.

These are the moments, the spacing of hills and dales (ISO 21920-2), the Abbott curve, its core (ISO
13565-2) and its volumes (ISO 25178-2).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

# Smallest number of samples in a trace; fewer give neither a spectrum nor a curvature.
MIN_SAMPLES = 16
# Largest heights of a straight line after levelling, relative to its heights before.
ROUND_OFF = 1e-12
# Smallest height of hills and dales that count, as a fraction of Rz (ISO 21920-2).
MIN_HEIGHT_FRACTION = 0.10
# Smallest width of hills and dales that count, as a fraction of the section.
MIN_WIDTH_FRACTION = 0.01
CORE_FRACTION = 0.40  # fraction of the length under the secant of the core (ISO 13565-2)


@dataclass(frozen=True, eq=False)
class Heights:
    """Equally spaced heights z (n,) [m] of a trace about its mean line.

    section: length [m] over which peaks, valleys and spacings are looked for, which is the cut-off;
    None for the whole trace.
    """

    z: np.ndarray
    step: float
    section: float | None = None

    @property
    def length(self) -> float:
        """Length [m] of the trace, one step for each sample."""
        return self.z.size * self.step

    @cached_property
    def sections(self) -> np.ndarray:
        """Heights (k, samples) [m] of the sections that lie wholly in the trace, from its start.

        The remainder at the end is left out.
        """
        if self.section is None:
            return self.z[None, :]
        size = round(self.section / self.step)
        count = self.z.size // size
        return self.z[: count * size].reshape(count, size)

    @cached_property
    def descending(self) -> np.ndarray:
        """Heights (n,) [m] from the highest to the lowest."""
        return np.sort(self.z)[::-1]

    @cached_property
    def power(self) -> float:
        """Mean square of the heights [m2]."""
        return float(self.z @ self.z) / self.z.size

    @cached_property
    def core(self) -> "Core | None":
        """Core of the Abbott curve, or None for a flat trace."""
        return fit_core(self)


def root_mean_square(heights: Heights) -> float:
    """Compute Rq, the root mean square of the heights [m]."""
    return float(np.sqrt(heights.power))


def mean_absolute(heights: Heights) -> float:
    """Compute Ra, the mean of the absolute heights [m]."""
    return float(np.abs(heights.z).mean())


def total_height(heights: Heights) -> float:
    """Compute Rt, the distance from the lowest to the highest sample [m]."""
    return float(np.ptp(heights.z))


def skewness(heights: Heights) -> float | None:
    """Compute the mean cube of the heights over Rq^3 [1], or return None for a flat trace."""
    return _moment(heights, 3)


def kurtosis(heights: Heights) -> float | None:
    """Compute the mean fourth power of the heights over Rq^4 [1], or return None for a flat trace."""
    return _moment(heights, 4)


def _moment(heights: Heights, order: int) -> float | None:
    rms = np.sqrt(heights.power)
    if rms == 0:
        return None
    unit = heights.z / rms
    square = unit * unit
    return float(square @ (unit if order == 3 else square)) / unit.size


def rms_slope(heights: Heights) -> float:
    """Compute Rdq, the root mean square of the slope between neighbouring samples [1]."""
    rise = np.diff(heights.z)
    return float(np.sqrt(rise @ rise / rise.size) / heights.step)


def mean_over_sections(heights: Heights, size: Callable) -> float | None:
    """Return the mean of a parameter over the sections of a trace.

    `size` maps the heights (k, samples) [m] of the sections to k values. The result is None if the
    trace is shorter than one section.
    """
    return float(size(heights.sections).mean()) if len(heights.sections) else None


def peak_to_valley(heights: Heights) -> float | None:
    """Compute Rz, the mean height [m] of the sections from the lowest to the highest sample."""
    return mean_over_sections(heights, lambda z: np.ptp(z, axis=1))


def mean_spacing(heights: Heights) -> float | None:
    """Compute RSm, the mean length of an element: a hill with its neighbouring dale [m].

    An element reaches from a rise through the mean line to the next rise, or from a fall to the
    next fall; the mean is over both kinds. None if the trace holds no element.
    """
    places = find_crossings(heights)
    if places.size < 3:
        return None
    spans = np.concatenate([np.diff(places[::2]), np.diff(places[1::2])])
    return float(spans.sum()) / spans.size


def mean_element_height(heights: Heights) -> float | None:
    """Compute Rc, the mean height [m] of the elements of `mean_spacing`, or return None if there are none."""
    places = find_crossings(heights)
    if places.size < 3:
        return None
    starts = np.floor(places / heights.step).astype(int) + 1
    parts = np.maximum.reduceat(np.abs(heights.z), starts)[:-1]
    return float((parts[1:] + parts[:-1]).mean())


def find_crossings(heights: Heights) -> np.ndarray:
    """Find the positions [m] where a hill ends and a dale begins, or the reverse.

    The mean line cuts the trace into hills and dales. Those lower than 10 % of Rz or narrower than
    1 % of the section do not count, and neighbours of one sign become one. Without a section the
    height alone decides.
    """
    z = heights.z
    rough = peak_to_valley(heights)
    if rough is None:
        rough = total_height(heights)
    above = z > 0
    starts = np.flatnonzero(above[1:] != above[:-1])  # the last sample before each crossing
    if not starts.size or rough == 0:
        return np.empty(0)
    places = (starts + z[starts] / (z[starts] - z[starts + 1])) * heights.step
    first = np.concatenate([[0], starts + 1])
    extent = np.maximum.reduceat(np.abs(z), first)
    width = np.diff(np.concatenate([[0.0], places, [(z.size - 1) * heights.step]]))
    width[[0, -1]] = np.inf  # the ends of the trace cut these two, so their width is unknown
    is_high = extent >= MIN_HEIGHT_FRACTION * rough
    is_wide = width >= MIN_WIDTH_FRACTION * (heights.section or 0.0)
    kept = np.flatnonzero(is_high & is_wide)
    signs = above[first[kept]]
    changes = np.flatnonzero(signs[1:] != signs[:-1]) + 1
    return places[kept[changes] - 1]  # a hill or dale begins at the crossing before it


class Core(NamedTuple):
    """Core of an Abbott curve: Rk, Rpk, Rvk [m], material ratios Mr1 and Mr2 [1], top [m]."""

    height: float
    peak_height: float
    valley_depth: float
    first_ratio: float
    second_ratio: float
    top: float


def abbott_curve(heights: Heights, count: int = 501) -> tuple[np.ndarray, np.ndarray]:
    """Compute the Abbott curve: material ratio (count,) from 0 to 1 and height (count,) [m]."""
    ratio = np.linspace(0.0, 1.0, count)
    return ratio, np.interp(ratio, _material_ratios(heights.z.size), heights.descending)


def _material_ratios(count: int) -> np.ndarray:
    return (np.arange(count) + 0.5) / count


def fit_core(heights: Heights) -> Core | None:
    """Fit the straight core line of the Abbott curve (ISO 13565-2), or return None for a flat trace.

    The line is the least-squares line of that 40 % of the curve whose secant falls least (the first
    such part). It falls by Rk from ratio 0 to ratio 1. Rpk and Rvk are the heights of triangles
    with the areas of the peaks above and the valleys below. The second filter stage of ISO 13565-1
    is not used.
    """
    z = heights.descending
    n = z.size
    if n < 5 or z[0] == z[-1]:
        return None
    size = max(round(CORE_FRACTION * n), 2)
    start = int(np.argmin(z[: n - size + 1] - z[size - 1 :]))
    part = z[start : start + size]
    ratio = _material_ratios(n)[start : start + size]
    centred = ratio - ratio.mean()
    slope = float(centred @ (part - part.mean()) / (centred @ centred))
    top = float(part.mean() - slope * ratio.mean())
    bottom = top + slope
    first = _ratio_above(z, top)
    second = _ratio_above(z, bottom)
    peaks = 2 * float(np.maximum(z - top, 0.0).sum()) / n
    valleys = 2 * float(np.maximum(bottom - z, 0.0).sum()) / n
    return Core(
        height=-slope,
        peak_height=peaks / first if first > 0 else 0.0,
        valley_depth=valleys / (1 - second) if second < 1 else 0.0,
        first_ratio=first,
        second_ratio=second,
        top=top,
    )


def _ratio_above(z, level: float) -> float:
    """Return the fraction of a trace that lies above a level."""
    n = z.size
    k = int(np.searchsorted(-z, -level))
    if k in (0, n):
        return k / n
    fall = z[k - 1] - z[k]
    return float((k - 0.5 + (z[k - 1] - level) / (fall if fall > 0 else 1.0)) / n)


def material_volume(heights: Heights, ratio: float) -> float:
    """Compute the volume of material above the height of a material ratio, per area [m3/m2]."""
    return float(np.maximum(heights.descending - _height_at(heights, ratio), 0.0).mean())


def void_volume(heights: Heights, ratio: float) -> float:
    """Compute the volume of void below the height of a material ratio, per area [m3/m2]."""
    return float(np.maximum(_height_at(heights, ratio) - heights.descending, 0.0).mean())


def _height_at(heights: Heights, ratio: float) -> float:
    return float(np.interp(ratio, _material_ratios(heights.z.size), heights.descending))
