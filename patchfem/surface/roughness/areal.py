"""Parameters of an areal scan (ISO 25178-2) beyond the distribution of its heights.

Missing heights give no point, no slope, no cell of the area and no pair of heights.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...formatting import format_length
from .parameters import Heights

DECAY_LEVEL = 0.2  # autocorrelation at the autocorrelation length Sal (ISO 25178-3)
# Smallest autocorrelation length in raster steps; the raster does not resolve a shorter one.
MIN_LENGTH_STEPS = 2.0


class Lobe(NamedTuple):
    """Shortest and longest distance [m] over which the autocorrelation falls to 0.2."""

    shortest: float | None
    longest: float | None


@dataclass(frozen=True, eq=False)
class Surface:
    """Heights z (m, n) [m] of a scan about its reference surface, with the sample spacings [m]."""

    z: np.ndarray
    steps: tuple

    @cached_property
    def heights(self) -> Heights:
        """Measured heights as a flat array."""
        return Heights(self.z[~np.isnan(self.z)], min(self.steps))

    @cached_property
    def slopes(self) -> tuple:
        """Slopes between neighbouring points along y and along x; they are NaN where heights are missing."""
        return tuple(np.diff(self.z, axis=axis) / step for axis, step in enumerate(self.steps))

    @cached_property
    def lobe(self) -> Lobe:
        """Central lobe of the autocorrelation."""
        return (
            _measure_lobe(autocorrelation(self.z), self.steps)
            if self.heights.power > 0
            else Lobe(None, None)
        )


def rms_gradient(surface: Surface) -> float:
    """Compute Sdq, the root mean square gradient [1] of the slopes along x and along y."""
    return float(np.sqrt(sum(np.nanmean(slopes**2) for slopes in surface.slopes)))


def developed_area_ratio(surface: Surface) -> float:
    """Compute Sdr [1]: the area of the surface divided by that of its plane, minus one.

    Each cell of four heights is cut into two triangles, along either diagonal; its area is the mean
    of both.
    """
    along_y, along_x = (slopes**2 for slopes in surface.slopes)
    total = 0.0
    for left_or_right in (along_y[:, :-1], along_y[:, 1:]):
        for low_or_high in (along_x[:-1], along_x[1:]):
            square = left_or_right + low_or_high
            total = total + square / (1 + np.sqrt(1 + square))
    return float(np.nanmean(total / 4))


def autocorrelation(z: np.ndarray) -> np.ndarray:
    """Compute the autocorrelation of heights (m, n) for lags up to half of each side.

    Missing heights are NaN. Returns (2 (m // 2) + 1, 2 (n // 2) + 1) with the zero lag in the
    middle; each lag averages its measured pairs.
    """
    from scipy.fft import irfft2, next_fast_len, rfft2

    known = ~np.isnan(z)
    halves = [count // 2 for count in z.shape]
    shape = [next_fast_len(count + half + 1, real=True) for count, half in zip(z.shape, halves)]
    products, pairs = (
        irfft2(np.abs(rfft2(part, shape)) ** 2, shape)
        for part in (np.where(known, z, 0.0), known.astype(float))
    )
    mean = products / np.maximum(pairs, 0.5)
    rows, columns = (np.arange(-half, half + 1) for half in halves)
    return mean[np.ix_(rows, columns)] / mean[0, 0]


def _measure_lobe(rho, steps: tuple) -> Lobe:
    """Find the contour on which an autocorrelation falls to 0.2.

    The longest distance is None if the contour is open.
    """
    from contourpy import contour_generator

    y, x = (
        step * np.arange(-(count // 2), count // 2 + 1) for step, count in zip(steps, rho.shape)
    )
    shortest = []
    closed = []
    for line in contour_generator(x, y, rho).lines(DECAY_LEVEL):
        start = line[:-1]
        along = np.diff(line, axis=0)
        position = np.clip(-(start * along).sum(1) / np.maximum((along**2).sum(1), 1e-300), 0, 1)
        shortest.append(float(np.hypot(*(start + position[:, None] * along).T).min()))
        angle = np.unwrap(np.arctan2(line[:, 1], line[:, 0]))
        if abs(angle[-1] - angle[0]) > 6:  # the contour encircles the origin, by an angle of 2 pi
            closed.append((shortest[-1], float(np.hypot(*line.T).max())))
    return Lobe(min(shortest, default=None), min(closed)[1] if closed else None)


def autocorrelation_length(surface: Surface) -> float | None:
    """Compute Sal [m], or return None if it is below two steps or the autocorrelation never falls to 0.2."""
    length = surface.lobe.shortest
    return None if length is None or length < MIN_LENGTH_STEPS * max(surface.steps) else length


def aspect_ratio(surface: Surface) -> float | None:
    """Compute Str, the texture aspect ratio [1].

    None if the autocorrelation stays above 0.2 in some direction.
    """
    if autocorrelation_length(surface) is None or surface.lobe.longest is None:
        return None
    return surface.lobe.shortest / surface.lobe.longest


def missing_reason(surface: Surface, name: str) -> str:
    """State why an areal roughness parameter has no value."""
    shortest = surface.lobe.shortest
    if surface.heights.power == 0:
        return "the scan is flat"
    if name not in ("Sal", "Str"):
        return "the heights do not determine this parameter"
    if shortest is None:
        return "the autocorrelation stays above 0.2 over half of the scan"
    if shortest < MIN_LENGTH_STEPS * max(surface.steps):
        return "the autocorrelation falls to 0.2 within two steps"
    half = min(step * (count // 2) for step, count in zip(surface.steps, surface.z.shape))
    return (
        f"along some direction the autocorrelation stays above 0.2 over {format_length(half)}, so Str is "
        f"below {shortest / half:.2g}"
    )
