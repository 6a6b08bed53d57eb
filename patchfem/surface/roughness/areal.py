"""Parameters of an areal scan (ISO 25178-2) beyond the distribution of its heights.

Missing heights give no point, no slope, no cell of the area and no pair of heights.
"""

import numpy as np

from ..quantity import read_definitions
from .parameters import compute_core, compute_moments

AUTOCORRELATION_AT_SAL = 0.2  # autocorrelation at the autocorrelation length Sal (ISO 25178-3)
N_AUTOCORRELATION_DIRECTIONS = 360  # number of directions in which the autocorrelation is followed
# Unit and definition of each parameter of a scan, by name
AREAL_DEFINITIONS = read_definitions("areal")


def compute_areal_parameters(z, steps: tuple[float, float]) -> dict[str, float | str]:
    """Compute the parameters of a scan, by the names in AREAL_DEFINITIONS; a code of the reason where there is none.

    Parameters
    ----------
    z : (m, n) array [m]
        Heights about the reference surface, NaN where missing.
    steps : tuple of float
        Spacings along y and along x [m].

    Returns
    -------
    dict
        Value, or code of the reason why there is none, by name.
    """

    # Parameters of the distribution of heights: Sa, Sq, Ssk, Sku, and those of the core
    heights = z[~np.isnan(z)]
    distribution = compute_moments(heights) | compute_core(heights)
    values = {f"S{name.lower()}": value for name, value in distribution.items()}
    values |= {"Sp": float(heights.max()), "Sv": float(-heights.min())}
    values["Sz"] = values["Sp"] + values["Sv"]

    # Slopes of the sides of each cell of the raster.
    slopes = [np.diff(z, axis=axis) / step for axis, step in enumerate(steps)]
    values["Sdq"] = float(np.sqrt(sum(np.nanmean(slope**2) for slope in slopes)))
    values["Sdr"] = _compute_area_ratio(*(slope**2 for slope in slopes))

    # Sal is the shortest distance at which the autocorrelation falls to 0.2, Str its ratio to the longest one
    values |= {"Sal": "not_falling", "Str": "not_falling"}
    distances = np.full(1, np.inf)
    if values["Sq"] > 0:
        distances = _find_decay_lengths(autocorrelation(z), steps)
    shortest = float(distances.min())
    # Smallest autocorrelation length in raster steps; the raster does not resolve a shorter one.
    if shortest < 2.0 * max(steps):
        values |= {"Sal": "unresolved", "Str": "unresolved"}
    elif np.isfinite(shortest):
        values["Sal"] = shortest
        if np.isfinite(distances).all():
            values["Str"] = shortest / float(distances.max())
    unknown = "flat" if values["Sq"] == 0 else "undetermined"
    return {name: unknown if values[name] is None else values[name] for name in AREAL_DEFINITIONS}


def _compute_area_ratio(along_y, along_x) -> float:
    """Compute Sdr, the relative area beyond the projected one [1], from squared slopes of a scan (m, n).

    `along_y` (m - 1, n) and `along_x` (m, n - 1) are the squared slopes. Cells of four heights are cut into triangles
    along either diagonal.
    """
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
    from scipy import fft

    known = ~np.isnan(z)
    halves = [count // 2 for count in z.shape]
    shape = [fft.next_fast_len(count + half + 1, real=True) for count, half in zip(z.shape, halves)]
    products, pairs = (
        fft.irfft2(np.abs(fft.rfft2(part, shape)) ** 2, shape)
        for part in (np.where(known, z, 0.0), known.astype(float))
    )
    mean = products / np.maximum(pairs, 0.5)
    rows, columns = (np.arange(-half, half + 1) for half in halves)
    return mean[np.ix_(rows, columns)] / mean[0, 0]


def _find_decay_lengths(rho, steps: tuple[float, float]) -> np.ndarray:
    """Return the distance [m] at which an autocorrelation falls to 0.2 in each direction, or inf if never.

    `rho` is the autocorrelation, with the zero lag in the middle, and `steps` [m] are its steps along y and x.
    """
    from scipy import ndimage

    sizes = (np.array(rho.shape) // 2) * steps
    # Number of points on a ray per raster step
    radius = np.arange(0.0, float(np.hypot(*sizes)), min(steps) / 4)
    angle = np.linspace(0.0, np.pi, N_AUTOCORRELATION_DIRECTIONS, endpoint=False)
    rays = np.array([np.sin(angle), np.cos(angle)])[..., None] * radius
    pixels = rays / np.reshape(steps, (2, 1, 1)) + np.reshape(rho.shape, (2, 1, 1)) // 2
    along = ndimage.map_coordinates(rho, pixels, order=1, cval=np.nan)
    is_low = along < AUTOCORRELATION_AT_SAL
    first = is_low.argmax(axis=1)
    rows = np.arange(N_AUTOCORRELATION_DIRECTIONS)
    last_high, first_low = along[rows, first - 1], along[rows, first]
    part = (last_high - AUTOCORRELATION_AT_SAL) / (last_high - first_low)
    return np.where(is_low.any(axis=1), (first - 1 + part) * radius[1], np.inf)
