"""Depths of a worn surface on an even raster, with their errors."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .statistics import remove_long_waves, subtract_local_level

UNWORN_LIMIT_DEVIATIONS = 2.5  # standard deviations within which a depth counts as unworn
# Errors relative to those that the tiles show, which are few.
FEW_TILES_ERROR_FACTOR = 1.3


class DepthErrors(NamedTuple):
    """Errors that the unworn heights show.

    - variance: function of a mask, variance [m2] of the sum of its depths.
    - drift: root mean square [m] of the mean depths of unworn tiles about the datum, 0 if these are too few.
    - freedom: degrees of freedom of the variance: number of independent tiles less the terms of the datum.
    - correlation: number of neighbouring heights that share an error.
    - gain: standard deviation of the gain of the instrument, which is a relative error of every depth.
    """

    variance: Callable[[np.ndarray], float]
    drift: float = 0.0
    freedom: float = np.inf
    correlation: float = 1.0
    gain: float = 0.0


class PointMasks(NamedTuple):
    """Masks (n,) or (m, n) of the points of aligned surfaces.

    - unworn, worn, grown: points by their depth.
    - inside, missing: common part, and its points without a depth.
    """

    unworn: np.ndarray
    worn: np.ndarray
    grown: np.ndarray
    inside: np.ndarray
    missing: np.ndarray


@dataclass(frozen=True, eq=False)
class DepthMap:
    """Aligned traces at x (n,) [m] of the second one, or scans (m, n) at x (n,), y (m,) [m] of the first one.

    - y: None for traces.
    - before: heights [m] of the first surface about its least-squares line or plane, filled where missing.
    - depth, noise: worn depth and the standard deviation of an unworn one [m], filled where missing.
    - masks: worn points, and others.
    - cell: length [m] or area [m2] of a point.
    - errors: errors that the unworn heights show.
    """

    x: np.ndarray
    y: np.ndarray | None
    before: np.ndarray
    depth: np.ndarray
    noise: np.ndarray
    masks: PointMasks
    cell: float
    errors: DepthErrors

    @property
    def heights(self) -> tuple[np.ndarray, np.ndarray]:
        """Heights [m] of the first and of the second surface about the line or plane of the first one."""
        return self.before, self.before - self.depth

    @property
    def noise_level(self) -> float:
        """Median standard deviation [m] of an unworn depth."""
        return float(np.median(self.noise))

    @property
    def size(self) -> float:
        """Length [m] or area [m2] of the common part."""
        return float(self.masks.inside.sum()) * self.cell

    @property
    def level_error(self) -> float:
        """Standard deviation [m] of the mean depth of the common part."""
        return float(np.sqrt(self.errors.variance(self.masks.inside)) / self.masks.inside.sum())

    @cached_property
    def scatter(self) -> float:
        """Standard deviation [m] of worn depths about the mean of the worn depths around them."""
        beside = subtract_local_level(self.depth, self.masks.worn)[self.masks.worn]
        known = beside[np.isfinite(beside)]
        return float(known.std()) if known.size else 0.0

    @cached_property
    def step_variance(self) -> np.ndarray:
        """Variance (n,) or (m, n) [m2] of the depth over the cell of a point, which is known at its middle only.

        Between two points, the depth may fall anywhere from one value to the other.
        """
        steps = [
            np.diff(self.depth, axis=k, append=np.take(self.depth, [-1], k))
            for k in range(self.depth.ndim)
        ]
        # Variance of an even distribution
        return 1 / 12 * sum(step**2 for step in steps)

    def integrate(self, part, sign: float = 1.0) -> tuple[float, float]:
        """Integrate the depth over a mask, and return area [m2] or volume [m3] and its standard deviation.

        `part` is the mask. With the sign -1 grown material counts as positive.
        """
        value = sign * float(self.depth[part].sum()) * self.cell + 0.0  # no negative zero
        error = FEW_TILES_ERROR_FACTOR * np.sqrt(self.errors.variance(part))
        # The line over a gap misses the tops in it, which are worn deeper, and its valleys.
        gaps = self.scatter * float((part & self.masks.missing).sum())
        sampling = np.sqrt(self.step_variance[part].sum())
        return value, self.cell * float(np.sqrt(error**2 + gaps**2 + sampling**2))

    def measure_hidden(self, covered) -> float:
        """Return the area [m2] or volume [m3] of wear that may be hidden by the noise, outside the mask `covered`.

        It is the net loss of the depths there, plus the loss by which slight wear everywhere would have lowered the
        datum; the valleys, which wear last, then seem to stand above it.
        """
        limit = 2 * UNWORN_LIMIT_DEVIATIONS
        relative = np.clip(self.depth / self.noise, -limit, limit)
        beside = self.masks.inside & ~covered & ~self.masks.missing
        loss_beside = max(float((relative * self.noise)[beside].sum()) * self.cell, 0.0)
        height = remove_long_waves(sum(self.heights))
        valleys = relative[self.masks.unworn & (height < np.median(height))]
        lowered = max(-float(np.median(valleys)), 0.0) if valleys.size else 0.0
        return loss_beside + lowered * self.noise_level * self.size
