"""Intervals of those parameters of an areal scan that a single scan allows."""

from typing import NamedTuple

import numpy as np

from .intervals import MAX_DEVIATIONS, P_LOWER, P_UPPER
from .spectrum import chi_square_factor

# Fraction of the degrees of freedom that is left after estimating the spectrum, from 240 scans.
SPENT_FRACTION = 0.85
NORMAL_QUANTILE_95 = 1.6449  # standard deviations at the 95 % quantile of a normal distribution
# Smallest number of pairs of heights at a lag relative to lag zero; lags with fewer
# are not used for the correlation.
MIN_PAIRS = 0.1


class ScanIntervals(NamedTuple):
    """Bounds of the areal roughness parameters of one scan."""

    bounds: dict
    is_uneven: bool


def scan_intervals(z: np.ndarray, values: dict) -> ScanIntervals:
    """Compute the intervals, 5 to 95 %, of Sa, Sq, Ssk and Sku that one scan allows.

    The scan counts as one of many with Gaussian heights and its own power spectrum. Sq and Sa go by
    the degrees of freedom of its mean square, Ssk and Sku by their standard deviations sqrt(6 int
    rho^3 / area) and sqrt(24 int rho^4 / area), with the autocorrelation rho of that spectrum. A
    kurtosis above 3 makes them wider.
    """
    if values["Ssk"] is None:
        return ScanIntervals({}, is_uneven=False)
    scatter = _estimate_scatter(np.nan_to_num(z))
    limits = MAX_DEVIATIONS * np.sqrt([6 * scatter.absolute_cubes, 24 * scatter.fourths])
    if abs(values["Ssk"]) > limits[0] or values["Sku"] - 3 > limits[1]:
        return ScanIntervals({}, is_uneven=True)
    widening = max(1.0, (values["Sku"] - 1) / 2)
    freedom = max(SPENT_FRACTION * 2 / scatter.variance / widening, 1.0)
    low, high = (float(np.sqrt(chi_square_factor(freedom, p))) for p in (P_UPPER, P_LOWER))
    bounds = {name: (values[name] * low, values[name] * high) for name in ("Sa", "Sq")}
    for name, variance in (("Ssk", 6 * scatter.cubes), ("Sku", 24 * scatter.fourths)):
        reach = NORMAL_QUANTILE_95 * float(np.sqrt(variance * widening))
        bounds[name] = (values[name] - reach, values[name] + reach)
    return ScanIntervals(bounds, is_uneven=False)


class MomentScatter(NamedTuple):
    """Statistical scatter of the mean square and higher moments of a scan."""

    variance: float
    cubes: float
    fourths: float
    absolute_cubes: float


def _estimate_scatter(z: np.ndarray) -> MomentScatter:
    """Estimate the scatter of the moments from the power spectrum under a cosine taper."""
    from scipy.fft import fft2, irfft2, rfft2

    m, n = z.shape
    shape = (2 * m, 2 * n)
    taper = np.outer(*(np.sin(np.pi * (np.arange(count) + 0.5) / count) for count in z.shape))
    z = (z - z.mean()) * taper
    power = np.abs(fft2(z)) ** 2
    products, pairs = (irfft2(np.abs(rfft2(part, shape)) ** 2, shape) for part in (z, taper))
    lags = np.maximum(pairs / pairs[0, 0], 1e-3)
    rho = np.where(lags > MIN_PAIRS, products / products[0, 0] / lags, 0.0)
    cubes, fourths, absolute_cubes = (
        float((part * lags).sum()) / (m * n) for part in (rho**3, rho**4, np.abs(rho**3))
    )
    variance = float((power**2).sum() / power.sum() ** 2)
    return MomentScatter(variance, abs(cubes), fourths, absolute_cubes)
