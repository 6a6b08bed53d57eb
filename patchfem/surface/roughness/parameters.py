"""Parameters of height and slope of an even trace, and the record that all of a trace's parameters are read from."""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np


@dataclass(frozen=True, eq=False)
class Heights:
    """Heights z (n,) [m] about their mean line, every `step` [m]: the primary or the roughness profile.

    section: length [m] over which a peak, a valley or a spacing is looked for, the cut-off; None: the whole trace.
    kept: results that several parameters share.
    """

    z: np.ndarray
    step: float
    section: float | None = None
    kept: dict = field(default_factory=dict)

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


def mean_deviation(heights: Heights) -> float:
    """Ra: mean of the absolute heights [m]."""
    return float(np.abs(heights.z).mean())


def root_mean_square(heights: Heights) -> float:
    """Rq: root mean square of the heights [m]."""
    return float(np.sqrt(heights.power))


def skewness(heights: Heights) -> float | None:
    """Rsk: mean cube of the heights over Rq^3; below zero where valleys are deeper than peaks are high."""
    return _moment(heights, 3)


def kurtosis(heights: Heights) -> float | None:
    """Rku: mean fourth power of the heights over Rq^4; 3 for a Gaussian surface."""
    return _moment(heights, 4)


def _moment(heights: Heights, order: int) -> float | None:
    rms = np.sqrt(heights.power)
    if rms == 0:
        return None
    unit = heights.z / rms
    square = unit * unit
    return float((square @ unit if order == 3 else square @ square) / unit.size)


def peak(heights: Heights) -> float | None:
    """Rp: height of the highest peak above the mean line [m], mean over the sections."""
    return _of_sections(heights, lambda z: z.max(axis=1))


def valley(heights: Heights) -> float | None:
    """Rv: depth of the deepest valley below the mean line [m], mean over the sections."""
    return _of_sections(heights, lambda z: -z.min(axis=1))


def peak_to_valley(heights: Heights) -> float | None:
    """Rz: from the deepest valley to the highest peak [m], mean over the sections."""
    return _of_sections(heights, lambda z: z.max(axis=1) - z.min(axis=1))


def _of_sections(heights: Heights, size) -> float | None:
    return float(size(heights.sections).mean()) if len(heights.sections) else None


def total_height(heights: Heights) -> float:
    """Rt: from the deepest valley to the highest peak of the whole trace [m]."""
    return float(heights.z.max() - heights.z.min())


def slope(heights: Heights) -> float:
    """Rdq: root mean square of the slope between neighbouring samples (two points, not seven)."""
    rise = np.diff(heights.z)
    return float(np.sqrt(rise @ rise / rise.size) / heights.step)


def five_sections(heights: Heights) -> float:
    """Height between peak and valley [m], mean over five equal parts of the trace, as DIN 4768 had it."""
    edges = np.linspace(0, heights.z.size, 6).astype(int)
    return float(np.mean([np.ptp(heights.z[a:b]) for a, b in pairwise(edges)]))


def largest_deviation(heights: Heights) -> float:
    """Largest distance of the trace from its mean line [m], to either side."""
    return float(np.abs(heights.z).max())
