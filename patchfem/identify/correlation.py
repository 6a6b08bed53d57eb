"""How many independent rows a correlated residual amounts to."""

import numpy as np

FEWEST = 20  # rows, below which no correlation is told from chance
CHANCE = 2.0  # standard deviations of a correlation of independent rows, 1/sqrt(rows), that count as chance
ALIKE = 0.5  # correlation of one cycle with the next from which the cycles are taken as repeats


def effective_rows(residual) -> float:
    """Number of independent rows that tell as much as the rows of a residual (r,), in the order in which they were
    taken.

    n/tau with tau = 1 + 2 sum rho_k over the lags before the first without correlation, where neighbours correlate
    beyond chance (Geyer, Statistical Science 7, 473, 1992). Where the residual comes back at a later lag, as that of a
    law does which misses the same in every cycle, the m cycles count as m/(1 + (m - 1) rho). Between 1 and n; n where
    the rows are few or all 0.
    """
    r = np.asarray(residual, float)
    n = r.size
    r = r - r.mean()
    if n < FEWEST or not np.ptp(r) > 0:
        return float(n)
    rho = _correlations(r)
    if rho[1] <= CHANCE / np.sqrt(n):
        return float(n)
    # lag at which the correlation is lost; all of them sum to -1/2
    first = int(np.flatnonzero(rho[1:] <= 0)[0]) + 1
    tau = 1 + 2 * rho[1:first].sum()
    return float(np.clip(n / tau / _repeats(rho, first), 1.0, n))


def _correlations(r) -> np.ndarray:
    """Correlation at every lag (r,) by products over the number of all rows, which keeps the sum finite."""
    spectrum = np.fft.rfft(r, 2 * r.size)
    out = np.fft.irfft(spectrum * spectrum.conj())[: r.size]
    return out / out[0]


def _repeats(rho, first: int) -> float:
    """By how much repeated cycles tell less than as many others, 1 where nothing comes back.

    rho (n,); first: lag at which the correlation with the neighbours is lost.
    """
    n = rho.size
    lags = np.arange(first + 1, n // 2 + 1)
    if lags.size < 3:
        return 1.0
    again = rho[lags] / (1 - lags / n)  # by the rows that overlap
    top = int(np.argmax(again))
    if again[top] < ALIKE:
        return 1.0
    return 1 + (n / lags[top] - 1) * min(again[top], 1.0)
