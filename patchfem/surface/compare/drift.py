"""Drift of the datum of an instrument, predicted from unworn parts (universal kriging).

The depth of an unworn height is the datum (a polynomial) plus a drift (a Gaussian process) plus noise.
Means over parts of the trace show the drift, and its best linear unbiased prediction extends it into
worn parts (Matheron, Les Cahiers du Centre de Morphologie Mathematique 5, 1971). The covariance of the
drift is not known: each of a grid of Matern covariances is weighted by its restricted likelihood
(Handcock and Stein, Technometrics 35 (1993) 403).
"""

from typing import NamedTuple

import numpy as np

from .boxes import N_PARTS, part_edges

# Correlation lengths of a drift relative to the length of the trace.
RANGES = np.geomspace(0.03, 1.0, 6)
# Variances of a drift relative to the variance of the mean of a part.
RATIOS = np.geomspace(0.1, 1e5, 13)
# Twice the smoothness nu of the Matern covariances; these three have a closed form.
TWICE_SMOOTHNESS = (
    1.0,
    3.0,
    5.0,
)
# Smallest mean number of heights in a part; short traces are split into fewer parts.
MIN_HEIGHTS = 4
MIN_KNOWN = 0.5  # smallest fraction of unworn heights in a part that is used
# Smallest number of parts with enough unworn heights; with fewer, all parts
# with an unworn height are used.
MIN_PARTS = 8
MIN_WEIGHT = 1e-4  # smallest posterior weight of a covariance that enters the prediction
# Fraction of the variance that is added to the diagonal before the Cholesky factorization.
JITTER = 1e-8


class Parts(NamedTuple):
    """Parts of a trace in which the unworn heights are averaged.

    - edges: first sample of each part, and the number of samples, (k + 1,) int.
    - unworn: heights that are averaged, (n,) bool.
    - known: parts that have enough of these heights, (k,) bool.
    - count: number of these heights, (k,).
    """

    edges: np.ndarray
    unworn: np.ndarray
    known: np.ndarray
    count: np.ndarray

    @property
    def middles(self) -> np.ndarray:
        """Centres (k,) of the parts, as fractions of the trace."""
        return (self.edges[1:] + self.edges[:-1]) / 2 / self.edges[-1]

    def average(self, values) -> np.ndarray:
        """Average values (..., n) over the unworn heights of each known part."""
        sums = np.add.reduceat(np.where(self.unworn, values, 0.0), self.edges[:-1], axis=-1)
        return sums[..., self.known] / self.count[self.known]

    def interpolate(self, values) -> np.ndarray:
        """Interpolate values (..., k) at the centres of the parts to all heights (..., n)."""
        place = (np.arange(self.edges[-1]) + 0.5) / self.edges[-1]
        after = np.clip(np.searchsorted(self.middles, place), 1, self.middles.size - 1)
        width = self.middles[after] - self.middles[after - 1]
        weight = np.clip((place - self.middles[after - 1]) / width, 0.0, 1.0)
        return values[..., after - 1] * (1 - weight) + values[..., after] * weight


class Drift(NamedTuple):
    """Linear prediction of a drift, and random drifts.

    - smoother: matrix from the means of the known parts to datum and drift of all parts, (k,
      known).
    - draws: random drifts with the posterior covariance of that of the trace, (draws, k) [m].
    """

    parts: Parts
    smoother: np.ndarray
    draws: np.ndarray

    def remove(self, values) -> np.ndarray:
        """Subtract datum and drift, predicted from the means of the parts, from values (..., n)."""
        return values - self.parts.interpolate(self.parts.average(values) @ self.smoother.T)


class _Covariance(NamedTuple):
    """Matern covariance of a drift.

    root: twice its smoothness; range: correlation length / length of the trace; ratio: variance of the
    drift / that of a mean; logarithm: of its posterior weight; variance [m2]: of a mean, times the
    degrees of freedom.
    """

    root: float
    range: float
    ratio: float
    logarithm: float
    variance: float


def split_parts(unworn) -> Parts:
    """Split a trace into parts, and find those with enough unworn heights."""
    n_parts = int(np.clip(unworn.size // MIN_HEIGHTS, 3, N_PARTS))
    edges = part_edges(unworn.size, n_parts)
    count = np.add.reduceat(unworn.astype(float), edges[:-1])
    known = count >= MIN_KNOWN * np.diff(edges)
    if known.sum() < MIN_PARTS:
        known = count > 0
    return Parts(edges, unworn, known, count)


def model_drift(depth, unworn, degree: int, n_draws: int, random) -> Drift | None:
    """Fit a Gaussian process to the drift of the datum that the unworn heights show.

    Parameters
    ----------
    depth : (n,) array [m]
    unworn : (n,) bool array
        Heights at a distance from worn ones.
    degree : int
        Degree of the datum, a polynomial.
    n_draws : int
        Number of random drifts.
    random : numpy.random.Generator

    Returns
    -------
    Drift or None
        None if too few parts have unworn heights.
    """
    parts = split_parts(unworn)
    freedom = int(parts.known.sum()) - degree - 1
    if freedom < 1:
        return None
    place = (np.arange(depth.size) + 0.5) / depth.size
    centres = parts.average(place)
    noise = float(parts.count[parts.known].mean()) / parts.count[parts.known]
    covariances = _fit_covariances(centres, parts.average(depth), noise, degree)
    weights = np.exp([covariance.logarithm for covariance in covariances])
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
    """Return the Matern correlation of smoothness root / 2 at distances relative to the trace length."""
    scaled = np.sqrt(root) * distance / length
    polynomial = {1.0: 1.0, 3.0: 1 + scaled, 5.0: 1 + scaled + scaled**2 / 3}[root]
    return polynomial * np.exp(-scaled)


def _evaluate_datum(place, degree: int) -> np.ndarray:
    """Return the polynomials (m, degree + 1) that describe the datum at positions (m,) from 0 to 1."""
    return np.vander(2 * place - 1, degree + 1)


def _distances(places, other) -> np.ndarray:
    return np.abs(places[:, None] - other)


def _fit_covariances(centres, means, noise, degree: int) -> list:
    """Fit the variance of each covariance of the grid by restricted maximum likelihood.

    The logarithms of the weights are relative to the largest one. No drift (ratio 0) counts once for
    each smoothness and range, as any other ratio does.

    Parameters
    ----------
    centres, means : (k,) array
        Centre, as a fraction of the trace, and mean [m] of each known part.
    noise : (k,) array
        Variance of each mean / their average variance.
    degree : int
        Degree of the datum.
    """
    forms = _evaluate_datum(centres, degree)
    scale = 1 / np.sqrt(noise)
    freedom = centres.size - forms.shape[1]
    covariances = []
    for root in TWICE_SMOOTHNESS:
        for length in RANGES:
            correlation = _matern(_distances(centres, centres), root, length)
            powers, modes = np.linalg.eigh(scale[:, None] * correlation * scale)
            values = modes.T @ (scale * means)
            columns = modes.T @ (scale[:, None] * forms)
            for ratio in (0.0, *RATIOS):
                precision = 1 / (1 + ratio * np.maximum(powers, 0.0))
                normal = columns.T @ (precision[:, None] * columns)
                right = columns.T @ (precision * values)
                residual = float(
                    values @ (precision * values) - right @ np.linalg.solve(normal, right)
                )
                residual = max(residual, 1e-300)
                determinants = np.log(precision).sum() - np.linalg.slogdet(normal)[1]
                logarithm = float(determinants - freedom * np.log(residual)) / 2
                covariances.append(_Covariance(root, float(length), ratio, logarithm, residual))
    largest = max(covariance.logarithm for covariance in covariances)
    return [
        covariance._replace(logarithm=covariance.logarithm - largest) for covariance in covariances
    ]


def _predict(covariance: _Covariance, centres, places, noise, degree: int) -> np.ndarray:
    """Return the kriging matrix (m, k) that maps part means at (k,) to datum and drift at (m,)."""
    root, length, ratio = covariance[:3]
    forms = _evaluate_datum(centres, degree)
    total = ratio * _matern(_distances(centres, centres), root, length) + np.diag(noise)
    between = ratio * _matern(_distances(places, centres), root, length)
    precision = np.linalg.inv(total)
    datum = np.linalg.solve(forms.T @ precision @ forms, forms.T @ precision)
    residual = np.eye(centres.size) - forms @ datum
    return _evaluate_datum(places, degree) @ datum + between @ precision @ residual


def _draw_drift(covariance: _Covariance, places, freedom: int, count: int, random) -> np.ndarray:
    """Draw random drifts (count, m) [m] at positions (m,); the variance is scaled inverse chi-squared."""
    root, length, ratio = covariance[:3]
    correlation = _matern(_distances(places, places), root, length)
    factor = np.linalg.cholesky(correlation + JITTER * np.eye(places.size))
    variance = ratio * covariance.variance / random.chisquare(freedom, count)
    return np.sqrt(variance)[:, None] * (random.standard_normal((count, places.size)) @ factor.T)
