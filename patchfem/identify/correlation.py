"""Number of independent rows of a residual whose neighbouring rows are correlated."""

import numpy as np

MIN_ROWS = 20  # smallest number of rows whose correlation can be distinguished from chance
# standard deviations 1/sqrt(rows) of the correlation of independent rows; a smaller correlation is attributed to chance
CHANCE_CORRELATION_FACTOR = 2.0
# correlation of the residuals of successive cycles, above which the cycles count as repetitions of one error
MIN_CYCLE_CORRELATION = 0.5


def estimate_effective_rows(residual) -> float:
    """Estimate the number of independent residuals that are equivalent to correlated ones.

    The number is n/tau with tau = 1 + 2 sum rho_k over the lags k before the first one without
    correlation (Geyer, Statistical Science 7, 473, 1992). If the correlation returns at a later lag,
    because a law has the same error in each of m cycles, these count as m/(1 + (m - 1) rho).

    Parameters
    ----------
    residual : (n,) array_like
        Rows in the order in which they were measured.

    Returns
    -------
    float
        Between 1 and n; n if there are few rows, or if neighbours are not correlated.
    """
    r = np.asarray(residual, float)
    n = r.size
    r = r - r.mean()
    if n < MIN_ROWS or not np.ptp(r) > 0:
        return float(n)
    rho = _compute_autocorrelation(r)
    if rho[1] <= CHANCE_CORRELATION_FACTOR / np.sqrt(n):
        return float(n)
    # there is such a lag, because the correlations at all lags sum to -1/2
    first_lag = int(np.flatnonzero(rho[1:] <= 0)[0]) + 1
    tau = 1 + 2 * rho[1:first_lag].sum()
    return float(np.clip(n / tau / _compute_repetition_factor(rho, first_lag), 1.0, n))


def _compute_autocorrelation(r) -> np.ndarray:
    """Compute the autocorrelation (n,) of a residual at every lag from 0 to n - 1.

    The residual r has the mean 0. All products are divided by n, so that the sum over the lags stays finite.
    """
    spectrum = np.fft.rfft(r, 2 * r.size)
    products = np.fft.irfft(spectrum * spectrum.conj())[: r.size]
    return products / products[0]


def _compute_repetition_factor(rho, first_lag: int) -> float:
    """Return the factor by which repeated cycles carry less information than independent ones.

    `rho` (n,) is the autocorrelation, and `first_lag` is the first lag without correlation of neighbours.
    """
    n = rho.size
    lags = np.arange(first_lag + 1, n // 2 + 1)
    if lags.size < 3:
        return 1.0
    # at a given lag there are only n - lag products
    correlation = rho[lags] / (1 - lags / n)
    best = int(np.argmax(correlation))
    if correlation[best] < MIN_CYCLE_CORRELATION:
        return 1.0
    n_cycles = n / lags[best]
    return 1 + (n_cycles - 1) * min(correlation[best], 1.0)
