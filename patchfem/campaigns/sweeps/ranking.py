"""Influence of the inputs of a sweep: Sobol indices of the variance of a measure.

The first-order index S_i = V(E(y | x_i))/V(y) is the fraction of the variance that a key explains
alone, the total index T_i = E(V(y | x_~i))/V(y) the fraction to which it contributes (Sobol 1993,
Homma and Saltelli 1996). On a grid both are means over its cases. For random cases they are those
of a smooth surface through the cases (`scipy.interpolate.RBFInterpolator`), computed by
`scipy.stats.sobol_indices`; surfaces through halves of the cases, each compared with the other
half, give the interval.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

# Largest number of cases that a surface interpolates, because its equations are dense.
MAX_SURFACE_CASES = 640
# Number of points of a Sobol sequence per key, which give an index to about 0.01.
N_SOBOL_POINTS = 1024
N_HALF_SURFACES = 6  # Number of surfaces that are fitted to half of the cases each.
# Smoothing parameters of a surface, from interpolation to almost a plane.
SMOOTHING_PARAMETERS = (1e-8, 1e-4, 1e-2, 1.0)
# Smallest number of cases per key; with fewer, half-sample surfaces do not show the error of an
# index.
MIN_CASES_PER_KEY = 16
INDEX_ERROR = 0.005  # Error of an index due to the finite number N_SOBOL_POINTS.
# Smallest fraction of the variance that a surface has to explain in cases not used for its fit.
MIN_EXPLAINED_FRACTION = 0.5


class SobolIndex(NamedTuple):
    """Sobol indices of a key for a measure of the sweep.

    first: first-order index; total: total index; low, high: interval of the total index.
    """

    key: str
    first: float
    total: float
    low: float
    high: float


def compute_sobol_indices(keys: Sequence[tuple], measures: dict, shape: tuple | None) -> dict:
    """Compute the Sobol indices of each varying measure, if the cases determine them.

    A measure that a tenth of the cases lack is left out, because the other cases are not a random
    sample.
    sample.

    Parameters
    ----------
    keys : sequence of tuple
        (name, values (n,)) of each key.
    measures : dict
        By name (values (n,), errors (n,)); NaN if a case has none.
    shape : tuple or None
        Numbers of values of the keys if the cases are all their combinations, the last key fastest;
        None for random cases.

    Returns
    -------
    dict
        By measure a list of SobolIndex, the largest total first.
    """
    levels = {}
    for name, values in keys:
        if np.unique(values).size > 1:
            levels[name] = np.asarray(values)
    changing = {}
    for name, (values, errors) in measures.items():
        column = np.asarray(values, float)
        if _is_varying(column, np.asarray(errors, float)):
            changing[name] = column
    if len(levels) < 2:
        return {}
    if shape is not None:
        axes = [axis for axis, (name, _) in enumerate(keys) if name in levels]
        indices = {}
        for name, values in changing.items():
            if np.isfinite(values).all():
                grid = _compute_grid_indices(values.reshape(shape))
                indices[name] = _sort_by_total(list(levels), [part[axes] for part in grid])
        return indices
    fractions = np.stack([_compute_rank_fractions(values) for values in levels.values()], axis=1)
    indices = {}
    for names, known in _group_by_known_cases(changing):
        if known.sum() < MIN_CASES_PER_KEY * len(levels):
            continue
        columns = np.stack([changing[name][known] for name in names], axis=1)
        for name, parts in zip(names, _estimate_random_indices(fractions[known], columns)):
            if parts is not None:
                indices[name] = _sort_by_total(list(levels), parts)
    return {name: indices[name] for name in changing if name in indices}


def _group_by_known_cases(changing: dict) -> list:
    """Group measures by the mask (n,) of the cases in which they have a value."""
    groups: dict = {}
    for name, values in changing.items():
        known = np.isfinite(values)
        names, _ = groups.setdefault(known.tobytes(), ([], known))
        names.append(name)
    return list(groups.values())


def _is_varying(values: np.ndarray, errors: np.ndarray) -> bool:
    """Return whether a measure varies over the cases by more than errors and round-off."""
    known = np.isfinite(values)
    if known.mean() < 0.9:
        return False
    spread = np.std(values[known])
    error = np.sqrt(np.mean(np.nan_to_num(errors[known]) ** 2))
    return spread > 1e-9 * np.abs(values[known]).max(initial=0.0) and spread > error


def _compute_rank_fractions(values: np.ndarray) -> np.ndarray:
    """Return the fraction of the cases below each value, which is uniform between 0 and 1."""
    _, same, counts = np.unique(values, return_inverse=True, return_counts=True)
    return ((np.cumsum(counts) - counts / 2) / values.size)[same]


class _Indices(NamedTuple):
    """First-order and total Sobol indices of all keys, with intervals of the total."""

    first: np.ndarray
    total: np.ndarray
    low: np.ndarray
    high: np.ndarray


def _compute_grid_indices(values: np.ndarray) -> _Indices:
    """Return the Sobol indices of values on a full grid of cases."""
    first = []
    total = []
    for axis in range(values.ndim):
        others = tuple(other for other in range(values.ndim) if other != axis)
        first.append(values.mean(axis=others).var())
        total.append(values.var(axis=axis).mean())
    total = np.array(total) / values.var()
    return _Indices(np.array(first) / values.var(), total, total, total)


def _estimate_random_indices(levels: np.ndarray, values: np.ndarray) -> list:
    """Estimate the Sobol indices of measures (columns) from random cases.

    The result has one _Indices per column; None if no surface explains it well enough.

    Parameters
    ----------
    levels : (n, keys) array
        Uniform coordinates of the cases.
    values : (n, columns) array
    """
    rng = np.random.default_rng(0)
    if len(levels) > MAX_SURFACE_CASES:
        chosen = np.sort(rng.choice(len(levels), MAX_SURFACE_CASES, replace=False))
        levels = levels[chosen]
        values = values[chosen]
    scaled = (values - values.mean(axis=0)) / values.std(axis=0)
    orders = [rng.permutation(len(levels)) for _ in range(N_HALF_SURFACES)]
    half = len(levels) // 2
    medians = []
    for smoothing in SMOOTHING_PARAMETERS:
        medians.append(np.median(_unexplained_variance(levels, scaled, orders[0], half, smoothing)))
    smoothing = SMOOTHING_PARAMETERS[int(np.argmin(medians))]
    first, total = _compute_surface_indices(levels, scaled, smoothing)
    unexplained = []
    totals = [total]
    for order in orders:
        unexplained.append(_unexplained_variance(levels, scaled, order, half, smoothing))
        fitted = order[:half]
        totals.append(_compute_surface_indices(levels[fitted], scaled[fitted], smoothing)[1])
    missing = np.mean(unexplained, axis=0)
    low = np.min(totals, axis=0) - missing[:, None] - INDEX_ERROR
    high = np.max(totals, axis=0) + missing[:, None] + INDEX_ERROR
    indices = []
    for k, parts in enumerate(zip(*np.clip([first, total, low, high], 0.0, 1.0))):
        is_explained = missing[k] < 1 - MIN_EXPLAINED_FRACTION
        indices.append(_Indices(*parts) if is_explained else None)
    return indices


def _fit_surface(levels: np.ndarray, values: np.ndarray, smoothing: float):
    """Fit a smooth surface to values (n, columns) at uniform coordinates (n, keys)."""
    from scipy.interpolate import RBFInterpolator

    return RBFInterpolator(levels, values, kernel="cubic", smoothing=smoothing)


def _unexplained_variance(levels, values, order, half: int, smoothing: float) -> np.ndarray:
    """Return the fraction of the variance (columns,) that a surface does not explain.

    The surface goes through the first half of the cases in an order (n,), and is compared with the
    others.
    """
    fitted = order[:half]
    others = order[half:]
    surface = _fit_surface(levels[fitted], values[fitted], smoothing)
    deviation = surface(levels[others]) - values[others]
    return np.mean(deviation**2, axis=0) / np.maximum(values[others].var(axis=0), 1e-30)


def _compute_surface_indices(levels: np.ndarray, values: np.ndarray, smoothing: float) -> tuple:
    """Return first-order and total Sobol indices of a fitted surface, (columns, keys) each."""
    from scipy.stats import sobol_indices, uniform

    surface = _fit_surface(levels, values, smoothing)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        indices = sobol_indices(
            func=lambda x: surface(x.T).T,
            n=N_SOBOL_POINTS,
            dists=[uniform()] * levels.shape[1],
            rng=np.random.default_rng(1),
        )
    return np.atleast_2d(indices.first_order), np.atleast_2d(indices.total_order)


def _sort_by_total(names: list, indices: Sequence) -> list:
    """Return the Sobol indices of all keys, sorted by decreasing total index."""
    by_key = [SobolIndex(name, *map(float, numbers)) for name, *numbers in zip(names, *indices)]
    return sorted(by_key, key=lambda index: -index.total)
