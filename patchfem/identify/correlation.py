"""Effective number of independent rows of a correlated residual."""

import numpy as np

MIN_CORRELATED_ROWS = 20  # smallest number of rows for a significant correlation
# Largest correlation that is attributed to chance, in standard deviations 1/sqrt(rows) of independent rows.
CHANCE_CORRELATION_FACTOR = 2.0
# Smallest correlation between cycles at which they count as repetitions of the same error.
MIN_CYCLE_CORRELATION = 0.5


def estimate_effective_rows(residual) -> float:
    """Estimate the effective number of independent rows of a residual.

    The number is n/tau, with tau = 1 + 2 sum rho_k over the lags k up to the first zero of the correlation
    (Geyer, Statistical Science 7, 473, 1992). If m cycles have the same error, so that the correlation rho at
    a later lag is large, they count as m/(1 + (m - 1) rho) cycles.

    Parameters
    ----------
    residual : (n,) array_like
        Rows in the order of measurement.

    Returns
    -------
    float
        Number between 1 and n; n for few rows, or if neighbouring rows are not correlated.
    """
    r = np.asarray(residual, float)
    n = r.size
    r = r - r.mean()
    if n < MIN_CORRELATED_ROWS or not np.ptp(r) > 0:
        return float(n)
    rho = _compute_autocorrelation(r)
    if rho[1] <= CHANCE_CORRELATION_FACTOR / np.sqrt(n):
        return float(n)
    # a lag without correlation exists, because the sum over all lags is -1/2
    first_lag = int(np.flatnonzero(rho[1:] <= 0)[0]) + 1
    tau = 1 + 2 * rho[1:first_lag].sum()
    return float(np.clip(n / tau / _compute_repetition_factor(rho, first_lag), 1.0, n))


def _compute_autocorrelation(r) -> np.ndarray:
    """Return the autocorrelation (n,) of a residual for the lags 0 to n - 1.

    The residual r must have a mean of 0. All lags are divided by n (biased estimate), which limits their sum.
    """
    spectrum = np.fft.rfft(r, 2 * r.size)
    products = np.fft.irfft(spectrum * spectrum.conj())[: r.size]
    return products / products[0]


def _compute_repetition_factor(rho, first_lag: int) -> float:
    """Return the ratio of the number of cycles to the number of independent cycles.

    `rho` (n,) is the autocorrelation, `first_lag` the first lag without correlation.
    """
    n = rho.size
    lags = np.arange(first_lag + 1, n // 2 + 1)
    if lags.size < 3:
        return 1.0
    # unbiased estimate: there are n - lag products at each lag
    correlation = rho[lags] / (1 - lags / n)
    best = int(np.argmax(correlation))
    if correlation[best] < MIN_CYCLE_CORRELATION:
        return 1.0
    n_cycles = n / lags[best]
    return 1 + (n_cycles - 1) * min(correlation[best], 1.0)
