"""Machined surfaces for `scan_pairs`: six finishes, as areal heights of unit deviation."""

from typing import NamedTuple

import numpy as np
from scipy.fft import fftfreq, irfft2, rfft2, rfftfreq

FINISHES = ("self-affine", "ground", "honed", "turned", "plateau-honed", "peened")


class Finish(NamedTuple):
    """Parameters of a finish; lengths in points of the surface grid."""

    name: str
    hurst: float  # Hurst exponent of the self-affine part.
    rolloff: float  # Wavelength above which the spectrum is flat.
    cutoff: float  # Wavelength below which the surface is smooth.
    angle: float  # Angle between the lay and x [rad].
    crossing: float  # Half the angle between the two lays of honing [rad].
    elongation: float  # Elongation of the lay: length along it / length across it.
    period: float  # Feed of turning, radius of the dimples, or distance between deep grooves.


def draw_finish(random) -> Finish:
    """Draw a finish and its parameters."""
    return Finish(
        name=FINISHES[random.integers(len(FINISHES))],
        hurst=random.uniform(0.3, 0.95),
        rolloff=random.uniform(30, 160),
        cutoff=random.uniform(5, 12),
        angle=random.uniform(0, np.pi),
        crossing=random.uniform(0.25, 0.75),
        elongation=random.uniform(10, 40),
        period=random.uniform(14, 45),
    )


def draw_surface(random, shape: tuple, finish: Finish) -> np.ndarray:
    """Draw heights (n, m) of zero mean and unit deviation; two calls give two places of similar surfaces."""
    if finish.name == "ground":
        heights = _draw_spectral(random, shape, finish, finish.angle)
    elif finish.name == "honed":
        heights = _draw_cross_lay(random, shape, finish)
    elif finish.name == "turned":
        heights = _draw_turned(random, shape, finish)
    elif finish.name == "plateau-honed":
        heights = _draw_plateau(random, shape, finish)
    elif finish.name == "peened":
        heights = _draw_peened(random, shape, finish)
    else:
        heights = _draw_spectral(random, shape, finish)
    heights = heights - heights.mean()
    return heights / heights.std()


def _draw_spectral(random, shape: tuple, finish: Finish, angle: float | None = None) -> np.ndarray:
    """Draw Gaussian heights with a self-affine spectrum, elongated along a lay at `angle` if given."""
    ky = fftfreq(shape[0])[:, None]
    kx = rfftfreq(shape[1])[None, :]
    k = np.hypot(kx, ky)
    if angle is not None:
        along = np.cos(angle) * kx + np.sin(angle) * ky
        across = np.cos(angle) * ky - np.sin(angle) * kx
        k = np.hypot(across, finish.elongation * along)
    amplitude = np.maximum(k, 1 / finish.rolloff) ** (-1 - finish.hurst)
    amplitude *= np.exp(-((finish.cutoff * np.hypot(kx, ky)) ** 2) / 4)
    amplitude[0, 0] = 0.0
    heights = irfft2(amplitude * rfft2(random.normal(size=shape)), shape)
    return heights / heights.std()


def _draw_cross_lay(random, shape: tuple, finish: Finish) -> np.ndarray:
    """Draw two crossing lays."""
    lays = [
        _draw_spectral(random, shape, finish, finish.angle + side * finish.crossing)
        for side in (-1, 1)
    ]
    return lays[0] + lays[1]


def _draw_turned(random, shape: tuple, finish: Finish) -> np.ndarray:
    """Draw cusped feed marks on circles about a distant centre, over a fine random surface."""
    distance = random.uniform(2, 10) * max(shape)
    y, x = np.indices(shape)
    r = np.hypot(x - distance * np.cos(finish.angle), y - distance * np.sin(finish.angle))
    first_revolution = np.floor(r.min() / finish.period)
    revolution = r / finish.period - first_revolution
    # Each revolution of the tool is a little higher or lower.
    depths = random.normal(size=int(revolution.max()) + 2)
    cusps = 4 * (np.mod(revolution, 1.0) - 0.5) ** 2 + 0.08 * depths[revolution.astype(int)]
    return cusps / cusps.std() + random.uniform(0.15, 0.4) * _draw_spectral(random, shape, finish)


def _draw_plateau(random, shape: tuple, finish: Finish) -> np.ndarray:
    """Draw a fine plateau with deep crossing grooves (negative skewness)."""
    y, x = np.indices(shape)
    grooves = np.zeros(shape)
    for side in (-1, 1):
        angle = finish.angle + side * finish.crossing
        across = np.cos(angle) * y - np.sin(angle) * x
        positions = np.arange(across.min() - 20, across.max() + 20)
        profile = np.zeros(positions.size)
        for groove_position in random.uniform(
            positions[0], positions[-1], int(positions.size / (2 * finish.period)) + 1
        ):
            depth = random.exponential(1.0) + 0.3
            half = random.uniform(3, 8)
            profile = np.maximum(
                profile, depth * np.maximum(1 - np.abs(positions - groove_position) / half, 0)
            )
        grooves = np.maximum(grooves, np.interp(across, positions, profile))
    return -grooves + random.uniform(0.08, 0.2) * _draw_spectral(random, shape, finish)


def _draw_peened(random, shape: tuple, finish: Finish) -> np.ndarray:
    """Draw overlapping round dimples."""
    heights = np.zeros(shape)
    count = int(3.0 * heights.size / (np.pi * finish.period**2))
    for _ in range(count):
        radius = finish.period * random.uniform(0.6, 1.2)
        i = random.uniform(0, shape[0])
        j = random.uniform(0, shape[1])
        rows = slice(max(int(i - radius), 0), int(i + radius) + 2)
        columns = slice(max(int(j - radius), 0), int(j + radius) + 2)
        block = heights[rows, columns]
        y, x = np.ogrid[
            rows.start : rows.start + block.shape[0], columns.start : columns.start + block.shape[1]
        ]
        dimple = ((y - i) ** 2 + (x - j) ** 2) / radius**2 - 1
        np.minimum(
            block, dimple * (radius / finish.period) ** 2 * random.uniform(0.6, 1.0), out=block
        )
    return heights / heights.std() + random.uniform(0.05, 0.2) * _draw_spectral(
        random, shape, finish
    )
