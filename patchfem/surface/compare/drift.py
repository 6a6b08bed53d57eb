"""Drift of a datum: what slow errors of the instrument add to the depth, beside and across the worn parts.

The depth of unworn heights is the datum, whose form the fit takes out, plus a drift and noise. Means
over parts of the trace show the drift as a Gaussian process. Its prediction at all parts is the best
linear unbiased one (universal kriging; Matheron, Les Cahiers du Centre de Morphologie Mathematique 5,
1971): it follows the drift where heights are unworn, and runs on into worn parts as far as the drift is
correlated. Smoothness, range and size of the drift are not known. Each of a grid of Matern covariances
counts with its restricted likelihood (Handcock and Stein, Technometrics 35 (1993) 403).
"""

from typing import NamedTuple

import numpy as np

from .boxes import N_PARTS, split_edges

RANGES = np.geomspace(0.03, 1.0, 6)  # correlation lengths of a drift over the length of the trace
RATIOS = np.geomspace(0.1, 1e5, 13)  # variances of a drift over the variance of a mean of noise
# twice the smoothness of the Matern covariances, the one with a closed form each
ROOTS = (
    1.0,
    3.0,
    5.0,
)
MIN_HEIGHTS = 4  # heights of a part, on average
MIN_KNOWN = 0.5  # fraction of unworn heights from which the mean of a part counts
MIN_PARTS = 8  # parts whose means count; with fewer ones every part that has an unworn height does
MIN_WEIGHT = 1e-4  # posterior weight below which a covariance is left out
# part of the variance that is added to the diagonal of a covariance before it is factored
JITTER = 1e-8


class Parts(NamedTuple):
    """Parts of a trace.

    edges: (k + 1,) first sample of each part, and the number of samples; unworn: (n,) bool array of the
    heights that count; known: (k,) bool array of the parts that count; count: (k,) heights that count.
    """

    edges: np.ndarray
    unworn: np.ndarray
    known: np.ndarray
    count: np.ndarray

    @property
    def middles(self) -> np.ndarray:
        """Middles (k,) of the parts, as fractions of the trace."""
        return (self.edges[1:] + self.edges[:-1]) / 2 / self.edges[-1]

    def average(self, values) -> np.ndarray:
        """Average values (..., n) over the unworn heights of each part that counts."""
        sums = np.add.reduceat(np.where(self.unworn, values, 0.0), self.edges[:-1], axis=-1)
        return sums[..., self.known] / self.count[self.known]

    def spread(self, values) -> np.ndarray:
        """Interpolate values (..., k) at the middles to all heights (..., n)."""
        place = (np.arange(self.edges[-1]) + 0.5) / self.edges[-1]
        after = np.clip(np.searchsorted(self.middles, place), 1, self.middles.size - 1)
        width = self.middles[after] - self.middles[after - 1]
        share = np.clip((place - self.middles[after - 1]) / width, 0.0, 1.0)
        return values[..., after - 1] * (1 - share) + values[..., after] * share


class Drift(NamedTuple):
    """Linear prediction of a drift, and drawn drifts.

    parts: `Parts`; smoother: (k, known) matrix from the means of the parts that count to the drift and
    datum of all parts; draws: (draws, k) array [m] of drifts that are as large as those of the trace.
    """

    parts: Parts
    smoother: np.ndarray
    draws: np.ndarray

    def remove(self, values) -> np.ndarray:
        """Subtract from values (..., n) the drift that their own means show."""
        return values - self.parts.spread(self.parts.average(values) @ self.smoother.T)


class _Covariance(NamedTuple):
    """Covariance of a drift with its posterior weight; variance [m2] is that of a mean of noise times freedom."""

    root: float
    range: float
    ratio: float
    logarithm: float
    variance: float


def split_parts(unworn) -> Parts:
    """Split a trace into parts; those with enough unworn heights (n,) bool count."""
    n_parts = int(np.clip(unworn.size // MIN_HEIGHTS, 3, N_PARTS))
    edges = split_edges(unworn.size, n_parts)
    count = np.add.reduceat(unworn.astype(float), edges[:-1])
    known = count >= MIN_KNOWN * np.diff(edges)
    if known.sum() < MIN_PARTS:
        known = count > 0
    return Parts(edges, unworn, known, count)


def model_drift(depth, unworn, degree: int, n_draws: int, random) -> Drift | None:
    """Model the drift of the datum as seen in the depth at unworn samples.

    Parameters
    ----------
    depth : (n,) array [m]
    unworn : (n,) bool array
        Heights that count.
    degree : int
        Degree of the datum, a polynomial.
    n_draws : int
    random : numpy.random.Generator

    Returns
    -------
    Drift or None
        None where too few parts count to know anything of a drift.
    """
    parts = split_parts(unworn)
    freedom = int(parts.known.sum()) - degree - 1
    if freedom < 1:
        return None
    place = (np.arange(depth.size) + 0.5) / depth.size
    centres = parts.average(place)
    noise = float(parts.count[parts.known].mean()) / parts.count[parts.known]
    covariances = _fit_covariances(centres, parts.average(depth), noise, degree)
    weights = np.exp([one.logarithm for one in covariances])
    weights = weights / weights.sum()
    smoother = np.zeros((parts.middles.size, centres.size))
    for covariance, weight in zip(covariances, weights):
        if weight > MIN_WEIGHT:
            smoother += weight * _predict(covariance, centres, parts.middles, noise, degree)
    smoother /= weights[weights > MIN_WEIGHT].sum()
    chosen = random.choice(weights.size, n_draws, p=weights)
    draws = np.zeros((n_draws, parts.middles.size))
    for at in np.unique(chosen):
        rows = np.flatnonzero(chosen == at)
        draws[rows] = _draw_drift(covariances[at], parts.middles, freedom, rows.size, random)
    return Drift(parts, smoother, draws)


def _matern(distance, root: float, length: float) -> np.ndarray:
    """Return the Matern correlation of smoothness root / 2 at distances, both as fractions of the trace."""
    scaled = np.sqrt(root) * distance / length
    polynomial = {1.0: 1.0, 3.0: 1 + scaled, 5.0: 1 + scaled + scaled**2 / 3}[root]
    return polynomial * np.exp(-scaled)


def _datum(place, degree: int) -> np.ndarray:
    """Return the columns (m, degree + 1) of the datum at places (m,) from 0 to 1."""
    return np.vander(2 * place - 1, degree + 1)


def _distances(one, other) -> np.ndarray:
    return np.abs(one[:, None] - other)


def _fit_covariances(centres, means, noise, degree: int) -> list:
    """Fit the variance of each covariance of the grid to the means (k,) of parts by restricted likelihood.

    noise: (k,) variance of each mean over their mean. The logarithms of the weights are less that of the
    largest. No drift at all counts once for each smoothness and range, as every other ratio does.
    """
    forms = _datum(centres, degree)
    scale = 1 / np.sqrt(noise)
    freedom = centres.size - forms.shape[1]
    found = []
    for root in ROOTS:
        for length in RANGES:
            correlation = _matern(_distances(centres, centres), root, length)
            powers, modes = np.linalg.eigh(scale[:, None] * correlation * scale)
            values = modes.T @ (scale * means)
            columns = modes.T @ (scale[:, None] * forms)
            for ratio in (0.0, *RATIOS):
                precision = 1 / (1 + ratio * np.maximum(powers, 0.0))
                normal = columns.T @ (precision[:, None] * columns)
                right = columns.T @ (precision * values)
                left = float(values @ (precision * values) - right @ np.linalg.solve(normal, right))
                left = max(left, 1e-300)
                determinants = np.log(precision).sum() - np.linalg.slogdet(normal)[1]
                logarithm = float(determinants - freedom * np.log(left)) / 2
                found.append(_Covariance(root, float(length), ratio, logarithm, left))
    largest = max(one.logarithm for one in found)
    return [one._replace(logarithm=one.logarithm - largest) for one in found]


def _predict(covariance: _Covariance, centres, places, noise, degree: int) -> np.ndarray:
    """Return the matrix (m, k) of universal kriging from means (k,) at centres to datum and drift at places (m,)."""
    root, length, ratio = covariance[:3]
    forms = _datum(centres, degree)
    total = ratio * _matern(_distances(centres, centres), root, length) + np.diag(noise)
    between = ratio * _matern(_distances(places, centres), root, length)
    precision = np.linalg.inv(total)
    datum = np.linalg.solve(forms.T @ precision @ forms, forms.T @ precision)
    residual = np.eye(centres.size) - forms @ datum
    return _datum(places, degree) @ datum + between @ precision @ residual


def _draw_drift(covariance: _Covariance, places, freedom: int, count: int, random) -> np.ndarray:
    """Draw drifts (count, m) [m] at places (m,), with variances from their posterior (scaled inverse chi-squared)."""
    root, length, ratio = covariance[:3]
    correlation = _matern(_distances(places, places), root, length)
    factor = np.linalg.cholesky(correlation + JITTER * np.eye(places.size))
    variance = ratio * covariance.variance / random.chisquare(freedom, count)
    return np.sqrt(variance)[:, None] * (random.standard_normal((count, places.size)) @ factor.T)
