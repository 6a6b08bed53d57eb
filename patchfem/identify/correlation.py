"""Number of independent rows of a residual whose neighbouring rows are correlated."""

import numpy as np

MIN_ROWS = 20  # number of rows; with fewer, correlation cannot be distinguished from chance
CHANCE_CORRELATION_FACTOR = 2.0  # standard deviations 1/sqrt(rows); a smaller correlation is chance
MIN_REPEAT_CORRELATION = 0.5  # correlation of one cycle with the next; cycles with more are repeats


def estimate_effective_rows(residual) -> float:
    """Return the number of independent rows that contain as much information as a residual.

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
    """Compute the autocorrelation (n,) of r at each lag.

    All products are divided by n, so that the sum over the lags stays finite.
    """
    spectrum = np.fft.rfft(r, 2 * r.size)
    products = np.fft.irfft(spectrum * spectrum.conj())[: r.size]
    return products / products[0]


def _compute_repetition_factor(rho, first_lag: int) -> float:
    """Return the factor by which repeated cycles contain less information than independent ones.

    `first_lag` is the first lag without correlation of neighbours.
    """
    n = rho.size
    lags = np.arange(first_lag + 1, n // 2 + 1)
    if lags.size < 3:
        return 1.0
    # at a given lag there are only n - lag products
    correlation = rho[lags] / (1 - lags / n)
    best = int(np.argmax(correlation))
    if correlation[best] < MIN_REPEAT_CORRELATION:
        return 1.0
    n_cycles = n / lags[best]
    return 1 + (n_cycles - 1) * min(correlation[best], 1.0)
