"""Depths of a worn surface on an even raster, with their errors."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

UNWORN_LIMIT = 2.5  # standard deviations within which a depth counts as unworn
MODEL_ERROR = 0.004  # relative standard deviation of an area or volume due to tip and interpolation
EVEN_DEVIATION = 1 / np.sqrt(
    12
)  # standard deviation of a fraction that may be anything from 0 to 1
# Errors relative to those that the tiles show, which are few.
SCATTER_FACTOR = 1.3


class DepthErrors(NamedTuple):
    """Errors that the unworn heights show.

    - variance: function of a mask, variance [m2] of the sum of its depths.
    - drift: root mean square [m] of the mean depths of unworn tiles about the datum, 0 if these are too few.
    - freedom: number of independent tiles, beyond those that determine the datum, that show the variance.
    - shared: number of neighbouring tiles that share an error, 1 without drift.
    - correlation: number of neighbouring heights that share an error.
    - model: relative standard deviation of all depths due to gain, tip and interpolation.
    """

    variance: Callable[[np.ndarray], float]
    drift: float = 0.0
    freedom: float = np.inf
    shared: float = 1.0
    correlation: float = 1.0
    model: float = MODEL_ERROR


@dataclass(frozen=True, eq=False)
class DepthMap:
    """Aligned traces at x (n,) [m] of the second one, or scans (m, n) at x (n,), y (m,) [m] of the first one.

    - before, after: heights [m] about the least-squares line or plane of the first surface, filled where missing.
    - depth, noise: worn depth and the standard deviation of an unworn one [m], filled where missing.
    - unworn, worn, grown: masks.
    - y: None for traces.
    - inside, missing: masks of the common part, and of its points without a depth.
    - cell: length [m] or area [m2] of a point.
    """

    x: np.ndarray
    before: np.ndarray
    after: np.ndarray
    depth: np.ndarray
    noise: np.ndarray
    unworn: np.ndarray
    worn: np.ndarray
    grown: np.ndarray
    y: np.ndarray | None = None
    inside: np.ndarray | None = None
    missing: np.ndarray | None = None
    cell: float = 0.0
    errors: DepthErrors | None = None

    @property
    def noise_level(self) -> float:
        """Median standard deviation [m] of an unworn depth."""
        return float(np.median(self.noise))

    @property
    def size(self) -> float:
        """Length [m] or area [m2] of the common part."""
        return float(self.inside.sum()) * self.cell

    @property
    def level_error(self) -> float:
        """Standard deviation [m] of the mean depth of the common part."""
        return float(np.sqrt(self.errors.variance(self.inside)) / self.inside.sum())

    def integrate(self, part, sign: float = 1.0) -> tuple[float, float]:
        """Integrate the depth over a mask; return the area [m2] or volume [m3] and its standard deviation."""
        value = sign * float(self.depth[part].sum()) * self.cell + 0.0  # no negative zero
        error = SCATTER_FACTOR * np.sqrt(self.errors.variance(part)) * self.cell
        # A missing height may be as deep as its neighbour, or not worn.
        gaps = EVEN_DEVIATION * float(np.abs(self.depth[part & self.missing]).sum()) * self.cell
        return value, float(np.sqrt(error**2 + gaps**2 + (self.errors.model * value) ** 2))

    def measure_hidden(self, covered) -> float:
        """Return the area or volume that slight wear, within the noise, may have beside what a mask covers.

        It lies there still, or has lowered the datum.
        """
        limit = 2 * UNWORN_LIMIT
        relative = np.clip(self.depth / self.noise, -limit, limit)
        beside = self.inside & ~covered & ~self.missing
        left = float((relative * self.noise)[beside].sum()) * self.cell
        slight = beside & (np.abs(relative) > UNWORN_LIMIT) & (np.abs(relative) < limit)
        excess = max(float(np.sign(relative[slight]).sum()), 0.0) / max(self.unworn.sum(), 1)
        return max(left, excess * UNWORN_LIMIT * self.noise_level * self.size)
