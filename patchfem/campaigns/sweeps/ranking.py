"""Sensitivity of measures to the swept keys (Sobol indices), and quantiles of random cases.

The first-order index S_i = V(E(y | x_i))/V(y) is the fraction of the variance that a key explains
alone; the total index T_i = E(V(y | x_~i))/V(y) includes its interactions (Sobol 1993, Homma and
Saltelli 1996). On a grid both are means over the cases. For random cases a smooth surface is fitted
(`scipy.interpolate.RBFInterpolator`), whose indices `scipy.stats.sobol_indices` computes; intervals
come from surfaces that are fitted to one half of the cases and validated on the other.
"""

import warnings
from typing import NamedTuple

import numpy as np

from .sweep_table import SweepTable

# Measures for which the swept keys are ranked
RANKED_MEASURES = (
    "relative_displacement_amplitude",
    "loop_area",
    "equivalent_damping",
    "absolute_acceleration_peak",
    "friction_force_peak",
    "friction_ratio_peak",
    "onset_level",
    "pressure_peak",
    "contact_fraction",
    "normal_stiffness",
    "tangential_stiffness",
    "stick_fraction",
)
N_SOBOL_POINTS = 1024  # sample points on a surface, for an error of about SOBOL_INDEX_ERROR
SOBOL_INDEX_ERROR = 0.005  # sampling error of an index
# Smoothing parameters of a surface, from interpolation to nearly a plane.
SMOOTHING_PARAMETERS = (1e-8, 1e-4, 1e-2, 1.0)
# Smallest fraction of cases with a value. The others may be no random sample.
MIN_FRACTION_OF_KNOWN_CASES = 0.9
QUANTILE_PROBABILITIES = (0.05, 0.5, 0.95)
SPREAD_ROUND_OFF = 1e-9  # relative spread of values that differ by round-off only


class SobolIndex(NamedTuple):
    """Sobol indices of a key: fractions of the variance of a measure over a sweep.

    - key: swept key.
    - first: first-order index, the part that this key causes alone.
    - total: total index, the part that this key causes alone or together with others.
    - low, high: interval of the total index.
    """

    key: str
    first: float
    total: float
    low: float
    high: float


def rank_keys(table: SweepTable) -> dict[str, list[SobolIndex]]:
    """Compute the Sobol indices of the swept keys for each ranked measure of a table.

    A measure must vary by more than its error.

    Returns
    -------
    dict
        List of SobolIndex by measure, in decreasing order of the total index; {} if the cases are
        neither a grid nor random, or only one key varies.
    """
    varied = [axis for axis, key in enumerate(table.keys) if key.count > 1]
    if len(varied) < 2 or not (table.is_grid or table.is_random):
        return {}
    names = [name for name in RANKED_MEASURES if _varies(table, name)]
    columns = {name: table.measures[name].values for name in names}
    if table.is_grid:
        names = [name for name in names if np.isfinite(columns[name]).all()]
        grids = [columns[name].reshape(table.shape) for name in names]
        index_arrays = [compute_grid_indices(grid)[:, varied] for grid in grids]
    else:
        known = np.isfinite(list(columns.values())).all(axis=0) if columns else np.zeros(1, bool)
        # With fewer, half of the cases do not show the error of an index
        if known.sum() < 16 * len(varied):
            return {}
        from scipy.stats import rankdata

        # the ranks of the values, as fractions, are uniform in [0, 1]
        ranks = [rankdata(table.keys[axis].values)[known] for axis in varied]
        coordinates = (np.stack(ranks, axis=1) - 0.5) / len(table)
        values = np.stack([column[known] for column in columns.values()], axis=1)
        index_arrays = estimate_random_indices(coordinates, values)

    ranking = {}
    for name, array in zip(names, index_arrays):
        if array is not None:
            keys = [table.keys[axis].key for axis in varied]
            indices = [SobolIndex(key, *numbers) for key, numbers in zip(keys, array.T.tolist())]
            ranking[name] = sorted(indices, key=lambda index: -index.total)
    return ranking


def _varies(table: SweepTable, name: str) -> bool:
    """Return whether the measure `name` of a table varies by more than its errors and round-off."""
    column = table.measures.get(name)
    if column is None:
        return False
    known = np.isfinite(column.values)
    values = column.values[known]
    if known.mean() < MIN_FRACTION_OF_KNOWN_CASES:
        return False
    error = np.sqrt(np.mean(np.nan_to_num(column.errors[known]) ** 2.0))
    return bool(values.std() > max(SPREAD_ROUND_OFF * np.abs(values).max(), error))


def compute_grid_indices(values: np.ndarray) -> np.ndarray:
    """Return Sobol indices (4, keys) of values on a full grid with one axis per key.

    The rows are the first-order index, the total index, and the lower and upper limit of the latter, which are equal
    to it.
    """
    first = []
    total = []
    for axis in range(values.ndim):
        others = tuple(other for other in range(values.ndim) if other != axis)
        first.append(values.mean(axis=others).var() / values.var())
        total.append(values.var(axis=axis).mean() / values.var())
    return np.array([first, total, total, total])


def estimate_random_indices(coordinates: np.ndarray, values: np.ndarray) -> list[np.ndarray | None]:
    """Estimate the Sobol indices of measures from random cases.

    Parameters
    ----------
    coordinates : (n, keys) array
        Coordinates of the cases, uniform in [0, 1].
    values : (n, measures) array
        The measures of the cases.

    Returns
    -------
    list of (4, keys) array or None
        First and total index and the limits of the total index of each measure; None if no surface
        explains enough of its variance.
    """
    from scipy.interpolate import RBFInterpolator

    # The cases are divided into folds: each is predicted by a response surface through the others
    rng = np.random.default_rng(0)
    # Largest number of cases of a surface, whose equations are dense
    every = rng.permutation(len(coordinates))[:640]
    # Parts of the cases, each of which checks a surface through the others
    parts = np.array_split(every, 3)
    folds = [(np.setdiff1d(every, part), part) for part in parts]
    scaled = (values - values.mean(axis=0)) / values.std(axis=0)

    def fit(cases: np.ndarray, smoothing: float) -> RBFInterpolator:
        """Return the response surface through some of the cases, or near them with smoothing."""
        return RBFInterpolator(
            coordinates[cases], scaled[cases], kernel="cubic", smoothing=smoothing
        )

    def find_unexplained(smoothing: float) -> np.ndarray:
        """Return the fraction (measures,) of the variance that a surface with this smoothing leaves.

        It is the mean over the folds of the deviation from a surface through the cases of the other folds
        (cross-validation).
        """
        unexplained = []
        for others, fold in folds:
            deviation = fit(others, smoothing)(coordinates[fold]) - scaled[fold]
            unexplained.append(
                np.mean(deviation**2, axis=0)
                / np.maximum(scaled[fold].var(axis=0), SPREAD_ROUND_OFF)
            )
        return np.mean(unexplained, axis=0)

    # The smoothing is that with the smallest median over the measures (cross-validation).
    fractions = [find_unexplained(smoothing) for smoothing in SMOOTHING_PARAMETERS]
    best = int(np.argmin(np.median(fractions, axis=1)))
    unexplained = fractions[best]
    fitted = (every, *(others for others, _ in folds))
    surfaces = [fit(cases, SMOOTHING_PARAMETERS[best]) for cases in fitted]
    first, total = np.transpose([_compute_surface_indices(one) for one in surfaces], (1, 0, 2, 3))

    # Limits of the total index: the smallest and largest of all surfaces, widened by what they leave unexplained
    margin = unexplained[:, None] + SOBOL_INDEX_ERROR
    limits = [total.min(axis=0) - margin, total.max(axis=0) + margin]
    arrays = np.clip([first[0], total[0], *limits], 0.0, 1.0).transpose(1, 0, 2)
    # Fraction of the variance of the other half that a usable surface explains
    is_usable = unexplained < 1 - 0.5
    return [array if usable else None for array, usable in zip(arrays, is_usable)]


def _compute_surface_indices(surface) -> tuple[np.ndarray, np.ndarray]:
    """Return first-order and total Sobol indices (measures, keys) of a response surface.

    The surface is an interpolator of the measures over the unit cube of the keys.
    """
    from scipy.stats import sobol_indices, uniform

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        indices = sobol_indices(
            func=lambda points: surface(points.T).T,
            n=N_SOBOL_POINTS,
            dists=[uniform()] * surface.y.shape[1],
            rng=np.random.default_rng(1),
        )
    return np.atleast_2d(indices.first_order), np.atleast_2d(indices.total_order)


class Quantile(NamedTuple):
    """Quantile [SI] of random cases, and its 95 % interval, of which an end is NaN if too few cases bound it."""

    value: float
    low: float
    high: float


def compute_quantiles(table: SweepTable) -> dict[str, list[Quantile]]:
    """Return the quantiles of QUANTILE_PROBABILITIES of each ranked measure of a table of random cases.

    Measures of which fewer than 90 % of the cases have a settled value have none, because the others may be the extreme
    ones.
    """
    quantiles = {}
    settled = table.has_settled
    # Smallest number of cases for a statement about 90 % of them
    if not table.is_random or len(table) < 20:
        return {}
    for name in RANKED_MEASURES:
        if _varies(table, name):
            values = table.measures[name].values
            counts = np.isfinite(values) & settled
            if counts.mean() >= MIN_FRACTION_OF_KNOWN_CASES:
                quantiles[name] = [
                    _find_quantile(values[counts], one) for one in QUANTILE_PROBABILITIES
                ]
    return quantiles


def _find_quantile(values: np.ndarray, probability: float) -> Quantile:
    """Return a quantile of values (n,), with the interval that follows from the binomial distribution of their ranks."""
    from scipy.stats import quantile_test

    interval = quantile_test(values, p=probability).confidence_interval(0.95)
    value = np.quantile(values, probability)
    return Quantile(float(value), float(interval.low), float(interval.high))
