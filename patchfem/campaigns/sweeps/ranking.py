"""Sensitivity of a measure to the swept keys: Sobol indices.

The first-order index S_i = V(E(y | x_i))/V(y) is the fraction of the variance that a key explains
alone. The total index T_i = E(V(y | x_~i))/V(y) is the fraction to which the key contributes (Sobol
1993, Homma and Saltelli 1996). For a full grid of cases, both are computed from means over the cases.
For random cases, a smooth response surface is fitted (`scipy.interpolate.RBFInterpolator`), whose
indices are computed by `scipy.stats.sobol_indices`. Their intervals come from surfaces that are
fitted to one half of the cases and validated on the other.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

# Largest number of cases for a surface, whose system of equations is dense.
MAX_SURFACE_CASES = 640
# Number of sample points for the indices of a surface, for an accuracy of about 0.01.
N_SOBOL_POINTS = 1024
N_HALF_SURFACES = 6  # Number of surfaces that are fitted to random halves of the cases.
# Smoothing parameters of a surface, from interpolation to nearly a plane.
SMOOTHING_PARAMETERS = (1e-8, 1e-4, 1e-2, 1.0)
# Smallest number of cases per key for which surfaces through half of the cases reveal the error of an
# index.
MIN_CASES_PER_KEY = 16
INDEX_ERROR = 0.005  # Sampling error of an index for N_SOBOL_POINTS points.
# Smallest fraction of the variance of the validation cases that a usable surface explains.
MIN_EXPLAINED_FRACTION = 0.5


class SobolIndex(NamedTuple):
    """Sobol indices of a measure with respect to a swept key.

    first: first-order index; total: total index; low, high: limits of the total index.
    """

    key: str
    first: float
    total: float
    low: float
    high: float


def compute_sobol_indices(keys: Sequence[tuple], measures: dict, shape: tuple | None) -> dict:
    """Compute the Sobol indices of each measure that varies over the sweep.

    A measure without a value in more than a tenth of the cases is left out, because the remaining
    cases are no random sample.

    Parameters
    ----------
    keys : sequence of tuple
        (name, values (n,)) of each key.
    measures : dict
        Tuples (values (n,), errors (n,)) by name; NaN for a case without a value.
    shape : tuple or None
        Number of values of each key if the cases form a full grid, in which the last key varies
        fastest; None for random cases.

    Returns
    -------
    dict
        List of SobolIndex for each measure, in decreasing order of the total index.
    """
    coordinates = {}
    for name, values in keys:
        if np.unique(values).size > 1:
            coordinates[name] = np.asarray(values)
    varying_measures = {}
    for name, (values, errors) in measures.items():
        column = np.asarray(values, float)
        if _is_varying(column, np.asarray(errors, float)):
            varying_measures[name] = column
    if len(coordinates) < 2:
        return {}
    if shape is not None:
        axes = [axis for axis, (name, _) in enumerate(keys) if name in coordinates]
        indices = {}
        for name, values in varying_measures.items():
            if np.isfinite(values).all():
                grid = _compute_grid_indices(values.reshape(shape))
                indices[name] = _sort_by_total_index(
                    list(coordinates), [part[axes] for part in grid]
                )
        return indices
    fractions = np.stack(
        [_compute_rank_fractions(values) for values in coordinates.values()], axis=1
    )
    indices = {}
    for names, known in _group_by_known_cases(varying_measures):
        if known.sum() < MIN_CASES_PER_KEY * len(coordinates):
            continue
        columns = np.stack([varying_measures[name][known] for name in names], axis=1)
        for name, parts in zip(names, _estimate_random_indices(fractions[known], columns)):
            if parts is not None:
                indices[name] = _sort_by_total_index(list(coordinates), parts)
    return {name: indices[name] for name in varying_measures if name in indices}


def _group_by_known_cases(measures: dict) -> list:
    """Group the measures that have values in the same cases."""
    groups: dict = {}
    for name, values in measures.items():
        known = np.isfinite(values)
        names, _ = groups.setdefault(known.tobytes(), ([], known))
        names.append(name)
    return list(groups.values())


def _is_varying(values: np.ndarray, errors: np.ndarray) -> bool:
    """Return whether a measure varies over the cases by more than its errors and round-off."""
    known = np.isfinite(values)
    if known.mean() < 0.9:
        return False
    spread = np.std(values[known])
    error = np.sqrt(np.mean(np.nan_to_num(errors[known]) ** 2))
    return spread > 1e-9 * np.abs(values[known]).max(initial=0.0) and spread > error


def _compute_rank_fractions(values: np.ndarray) -> np.ndarray:
    """Return the rank of each value as a fraction in [0, 1]; equal values have their mean rank."""
    _, same, counts = np.unique(values, return_inverse=True, return_counts=True)
    return ((np.cumsum(counts) - counts / 2) / values.size)[same]


class _IndexArrays(NamedTuple):
    """First-order and total Sobol indices of all keys, with intervals of the total indices."""

    first: np.ndarray
    total: np.ndarray
    low: np.ndarray
    high: np.ndarray


def _compute_grid_indices(values: np.ndarray) -> _IndexArrays:
    """Return the Sobol indices of values on a full grid of cases."""
    first = []
    total = []
    for axis in range(values.ndim):
        others = tuple(other for other in range(values.ndim) if other != axis)
        first.append(values.mean(axis=others).var())
        total.append(values.var(axis=axis).mean())
    total = np.array(total) / values.var()
    return _IndexArrays(np.array(first) / values.var(), total, total, total)


def _estimate_random_indices(coordinates: np.ndarray, values: np.ndarray) -> list:
    """Estimate the Sobol indices of measures (columns) from random cases.

    Returns the indices of each measure; None if no surface explains enough of its variance.

    Parameters
    ----------
    coordinates : (n, keys) array
        Coordinates of the cases, uniform in [0, 1].
    values : (n, columns) array
    """
    rng = np.random.default_rng(0)
    if len(coordinates) > MAX_SURFACE_CASES:
        chosen = np.sort(rng.choice(len(coordinates), MAX_SURFACE_CASES, replace=False))
        coordinates = coordinates[chosen]
        values = values[chosen]
    scaled = (values - values.mean(axis=0)) / values.std(axis=0)
    orders = [rng.permutation(len(coordinates)) for _ in range(N_HALF_SURFACES)]
    half = len(coordinates) // 2
    medians = []
    for smoothing in SMOOTHING_PARAMETERS:
        medians.append(
            np.median(_unexplained_variance(coordinates, scaled, orders[0], half, smoothing))
        )
    smoothing = SMOOTHING_PARAMETERS[int(np.argmin(medians))]
    first, total = _compute_surface_indices(coordinates, scaled, smoothing)
    unexplained = []
    totals = [total]
    for order in orders:
        unexplained.append(_unexplained_variance(coordinates, scaled, order, half, smoothing))
        fitted = order[:half]
        totals.append(_compute_surface_indices(coordinates[fitted], scaled[fitted], smoothing)[1])
    mean_unexplained = np.mean(unexplained, axis=0)
    low = np.min(totals, axis=0) - mean_unexplained[:, None] - INDEX_ERROR
    high = np.max(totals, axis=0) + mean_unexplained[:, None] + INDEX_ERROR
    indices = []
    for k, parts in enumerate(zip(*np.clip([first, total, low, high], 0.0, 1.0))):
        is_explained = mean_unexplained[k] < 1 - MIN_EXPLAINED_FRACTION
        indices.append(_IndexArrays(*parts) if is_explained else None)
    return indices


def _fit_surface(coordinates: np.ndarray, values: np.ndarray, smoothing: float):
    """Fit a smooth response surface to values (n, columns) at coordinates (n, keys) in [0, 1]."""
    from scipy.interpolate import RBFInterpolator

    return RBFInterpolator(coordinates, values, kernel="cubic", smoothing=smoothing)


def _unexplained_variance(coordinates, values, order, half: int, smoothing: float) -> np.ndarray:
    """Return the fraction of the variance (columns,) that a surface leaves unexplained.

    The surface is fitted to the first half of the cases in the order `order` (n,), and validated on
    the others.
    """
    fitted = order[:half]
    others = order[half:]
    surface = _fit_surface(coordinates[fitted], values[fitted], smoothing)
    deviation = surface(coordinates[others]) - values[others]
    return np.mean(deviation**2, axis=0) / np.maximum(values[others].var(axis=0), 1e-30)


def _compute_surface_indices(
    coordinates: np.ndarray, values: np.ndarray, smoothing: float
) -> tuple:
    """Return first-order and total Sobol indices (columns, keys) of a fitted surface."""
    from scipy.stats import sobol_indices, uniform

    surface = _fit_surface(coordinates, values, smoothing)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        indices = sobol_indices(
            func=lambda x: surface(x.T).T,
            n=N_SOBOL_POINTS,
            dists=[uniform()] * coordinates.shape[1],
            rng=np.random.default_rng(1),
        )
    return np.atleast_2d(indices.first_order), np.atleast_2d(indices.total_order)


def _sort_by_total_index(names: list, indices: Sequence) -> list:
    """Return the Sobol indices of all keys in decreasing order of the total index."""
    by_key = [SobolIndex(name, *map(float, numbers)) for name, *numbers in zip(names, *indices)]
    return sorted(by_key, key=lambda index: -index.total)
