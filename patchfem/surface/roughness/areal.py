"""Parameters of an areal scan (ISO 25178-2) beyond the distribution of its heights.

Missing heights give no point, no slope, no cell of the area and no pair of heights.
"""

from typing import NamedTuple

import numpy as np

from .parameters import compute_core, compute_moments

DECAY_LEVEL = 0.2  # autocorrelation at the autocorrelation length Sal (ISO 25178-3)
# Smallest autocorrelation length in raster steps; the raster does not resolve a shorter one.
MIN_LENGTH_STEPS = 2.0


# Unit and definition of the parameters of a scan.
AREAL = {
    "Sa": ("m", "mean of the absolute heights about the reference surface"),
    "Sq": ("m", "root mean square of the heights about the reference surface"),
    "Ssk": ("1", "skewness: mean cube of the heights over Sq^3"),
    "Sku": ("1", "kurtosis: mean fourth power of the heights over Sq^4, 3 for a Gaussian surface"),
    "Sp": ("m", "height of the highest point above the reference surface"),
    "Sv": ("m", "depth of the lowest point below the reference surface"),
    "Sz": ("m", "height from the lowest to the highest point"),
    "Sdq": ("1", "root mean square gradient, from the slopes along x and along y"),
    "Sdr": ("1", "developed area divided by projected area, minus one"),
    "Sal": ("m", "shortest distance at which the autocorrelation falls to 0.2"),
    "Str": ("1", "Sal divided by the longest distance at which it falls to 0.2; 1 if isotropic"),
    "Sk": ("m", "core height: drop of the line through the flattest 40 % of the Abbott curve"),
    "Spk": ("m", "reduced peak height: triangle on the base Smr1 with the volume above the core"),
    "Svk": (
        "m",
        "reduced valley depth: triangle on the base 1 - Smr2 with the volume below the core",
    ),
    "Smr1": ("1", "fraction of the area above the core"),
    "Smr2": ("1", "fraction of the area above the bottom of the core"),
}


class Lobe(NamedTuple):
    """Shortest and longest distance [m] over which the autocorrelation falls to 0.2."""

    shortest: float | None
    longest: float | None


def compute_areal_parameters(z, steps: tuple[float, float]) -> dict[str, float | str]:
    """Compute the parameters of a scan, by the names in AREAL; a code of the reason where there is none.

    Parameters
    ----------
    z : (m, n) array [m]
        Heights about the reference surface, NaN where missing.
    steps : tuple of float
        Spacings along y and along x [m].
    """
    heights = z[~np.isnan(z)]
    values = {f"S{name}": value for name, value in compute_moments(heights).items()}
    core = compute_core(heights)
    values |= {f"S{name.lower()}": value for name, value in core.items()}
    values |= {"Sp": float(heights.max()), "Sv": float(-heights.min())}
    values["Sz"] = float(np.ptp(heights))
    slopes = [np.diff(z, axis=axis) / step for axis, step in enumerate(steps)]
    values["Sdq"] = float(np.sqrt(sum(np.nanmean(slope**2) for slope in slopes)))
    values["Sdr"] = _compute_area_ratio(*(slope**2 for slope in slopes))

    lobe = Lobe(None, None)
    if values["Sq"] > 0:
        lobe = _measure_lobe(autocorrelation(z), steps)
    values |= {"Sal": lobe.shortest, "Str": "not_falling"}
    if lobe.shortest is None:
        values["Sal"] = "not_falling"
    elif lobe.shortest < MIN_LENGTH_STEPS * max(steps):
        values |= {"Sal": "too_short", "Str": "too_short"}
    elif lobe.longest is not None:
        values["Str"] = lobe.shortest / lobe.longest
    unknown = "flat" if values["Sq"] == 0 else "undetermined"
    return {name: unknown if values[name] is None else values[name] for name in AREAL}


def _compute_area_ratio(along_y, along_x) -> float:
    """Compute Sdr from squared slopes: cells of four heights are cut into triangles along either diagonal."""
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
