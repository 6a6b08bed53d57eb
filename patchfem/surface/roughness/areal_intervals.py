"""Intervals of those parameters of an areal scan that one scan allows."""

import numpy as np

from .areal import cosine_taper
from .intervals import HIGH, LOW, ODD

SPENT = 0.85  # share of the degrees of freedom that is left when the spectrum is estimated too (240 made scans)


def areal_intervals(flat: np.ndarray, values: dict) -> tuple:
    """Interval (low, high), 5 to 95 %, of each parameter that one scan of this size allows, (None, None) without one;
    and whether none has any because the heights are not Gaussian, as for traces.

    The scan counts as one of many with Gaussian heights and its own power spectrum (two-dimensional, under a cosine
    taper). Sq and Sa go by the degrees of freedom of its mean square, Ssk and Sku by their standard deviations
    sqrt(6 int rho^3 / area) and sqrt(24 int rho^4 / area), with the autocorrelation rho of that spectrum. A kurtosis
    above 3 makes them wider, as for traces. Sz, an extreme, has none.
    """
    from scipy.special import chdtri

    out = dict.fromkeys(values, (None, None))
    if values["Ssk"] is None:
        return out, False
    wider = max(1.0, (values["Sku"] - 1) / 2)
    shares, cubes, fourths, sizes = _scatter(np.nan_to_num(flat))
    if abs(values["Ssk"]) > ODD * np.sqrt(6 * sizes) or values["Sku"] - 3 > ODD * np.sqrt(24 * fourths):
        return out, True
    freedom = max(SPENT * 2 / shares / wider, 1.0)
    low, high = (float(np.sqrt(freedom / chdtri(freedom, 1 - p))) for p in (HIGH, LOW))
    for name in ("Sa", "Sq"):
        out[name] = values[name] * low, values[name] * high
    for name, share in (("Ssk", 6 * cubes), ("Sku", 24 * fourths)):
        reach = 1.6449 * float(np.sqrt(share * wider))
        out[name] = values[name] - reach, values[name] + reach
    return out, False


def _scatter(z: np.ndarray) -> tuple:
    """Relative variance of the mean square, and the means of rho^3, rho^4 and |rho|^3 over all lags of the scan."""
    from scipy.fft import fft2, irfft2, rfft2

    m, n = z.shape
    taper = cosine_taper(m, n)
    z = (z - z.mean()) * taper
    power = np.abs(fft2(z)) ** 2
    shares = float((power**2).sum() / power.sum() ** 2)  # 2 int S^2 / (int S)^2: a raw power's square is twice S^2
    both, shape = np.zeros((2, 2 * m, 2 * n)), (2 * m, 2 * n)
    for place, values in enumerate((z, taper)):
        both[place] = irfft2(np.abs(rfft2(values, shape)) ** 2, shape)
    rho, lags = both[0] / both[0, 0, 0], np.maximum(both[1] / both[1, 0, 0], 1e-3)
    near = lags > 0.1  # beyond, too few pairs are left to tell a correlation
    rho = np.where(near, rho / lags, 0.0)
    cubes, fourths, sizes = (float((power * lags).sum()) / (m * n) for power in (rho**3, rho**4, np.abs(rho) ** 3))
    return shares, abs(cubes), fourths, sizes
