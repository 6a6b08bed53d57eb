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

MAX_SURFACE_CASES = (
    640  # number of cases that a surface interpolates, because its equations are dense
)
N_SOBOL_POINTS = 1024  # points of a Sobol sequence per key, which give an index to about 0.01
N_HALF_SURFACES = 6  # number of surfaces through half of the cases
SMOOTHINGS = (1e-8, 1e-4, 1e-2, 1.0)  # smoothing of a surface, from interpolation to almost a plane
MIN_CASES_PER_KEY = 16  # cases per key; with fewer, surfaces through half of the cases do not show the error of an index
INDEX_ERROR = 0.005  # error of an index due to the finite number N_SOBOL_POINTS
# fraction of the variance that a surface has to explain in cases that it was not fitted to
MIN_EXPLAINED_FRACTION = 0.5


class SobolIndex(NamedTuple):
    """Sobol indices of one key for a measure.

    first: first-order index; total: total index; low, high: interval of the total index.
    """

    key: str
    first: float
    total: float
    low: float
    high: float


def compute_sobol_indices(keys: Sequence[tuple], measures: dict, shape: tuple | None) -> dict:
    """Compute the Sobol indices of each measure that changes, if the cases determine them.

    A measure that a tenth of the cases lack is left out, because the other cases are not a random
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
    moving = [(name, np.asarray(values)) for name, values in keys if np.unique(values).size > 1]
    changing = {
        name: np.asarray(values, float)
        for name, (values, errors) in measures.items()
        if _is_varying(np.asarray(values, float), np.asarray(errors, float))
    }
    if len(moving) < 2 or not changing:
        return {}
    names = [name for name, _ in moving]
    if shape is not None:
        whole = {name: values for name, values in changing.items() if np.isfinite(values).all()}
        found = {name: _grid_indices(values.reshape(shape)) for name, values in whole.items()}
        along = [place for place, (name, _) in enumerate(keys) if name in names]
        return {
            name: _sort_shares(names, [share[along] for share in shares])
            for name, shares in found.items()
        }
    levels = np.stack([_rank_fraction(values) for _, values in moving], axis=1)
    out = {}
    for there in {
        np.isfinite(values).tobytes(): np.isfinite(values) for values in changing.values()
    }.values():
        alike = [
            name for name, values in changing.items() if np.array_equal(np.isfinite(values), there)
        ]
        if there.sum() < MIN_CASES_PER_KEY * len(moving):
            continue
        found = _random_indices(
            levels[there], np.stack([changing[name][there] for name in alike], axis=1)
        )
        out |= {
            name: _sort_shares(names, shares)
            for name, shares in zip(alike, found)
            if shares is not None
        }
    return {name: out[name] for name in changing if name in out}


def _is_varying(values: np.ndarray, errors: np.ndarray) -> bool:
    """Return whether most cases have a measure that varies by more than its errors and round-off."""
    there = np.isfinite(values)
    if there.mean() < 0.9:
        return False
    spread = np.std(values[there])
    return spread > 1e-9 * np.abs(values[there]).max(initial=0.0) and spread > np.sqrt(
        np.mean(np.nan_to_num(errors[there]) ** 2)
    )


def _rank_fraction(values: np.ndarray) -> np.ndarray:
    """Return the fraction of the cases below each value, which is uniform between 0 and 1."""
    _, same, counts = np.unique(values, return_inverse=True, return_counts=True)
    return ((np.cumsum(counts) - counts / 2) / values.size)[same]


def _grid_indices(values: np.ndarray) -> tuple:
    """Return first-order and total Sobol indices and the interval of the total, (keys,) each, on a full grid."""
    axes = range(values.ndim)
    whole = values.var()
    first = (
        np.array(
            [values.mean(axis=tuple(other for other in axes if other != one)).var() for one in axes]
        )
        / whole
    )
    total = np.array([values.var(axis=one).mean() for one in axes]) / whole
    return first, total, total, total


def _random_indices(levels: np.ndarray, values: np.ndarray) -> list:
    """Return the Sobol indices of each column of values from random cases.

    One entry per column: (first, total, low, high), (keys,) each; None if no surface explains it well enough.

    Parameters
    ----------
    levels : (n, keys) array
        Uniform coordinates of the cases.
    values : (n, columns) array
    """
    rng = np.random.default_rng(0)
    if len(levels) > MAX_SURFACE_CASES:
        some = np.sort(rng.choice(len(levels), MAX_SURFACE_CASES, replace=False))
        levels = levels[some]
        values = values[some]
    scaled = (values - values.mean(axis=0)) / values.std(axis=0)
    halves = [rng.permutation(len(levels)) for _ in range(N_HALF_SURFACES)]
    half = len(levels) // 2
    smooth = min(
        SMOOTHINGS,
        key=lambda one: np.median(_unexplained_variance(levels, scaled, halves[0], half, one)),
    )
    left = np.mean(
        [_unexplained_variance(levels, scaled, order, half, smooth) for order in halves], axis=0
    )
    first, total = _surface_indices(levels, scaled, smooth)
    others = np.stack(
        [
            total,
            *(
                _surface_indices(levels[order[:half]], scaled[order[:half]], smooth)[1]
                for order in halves
            ),
        ]
    )
    low = others.min(axis=0) - left[:, None] - INDEX_ERROR
    high = others.max(axis=0) + left[:, None] + INDEX_ERROR
    parts = [np.clip(one, 0.0, 1.0) for one in (first, total, low, high)]
    return [
        tuple(part[k] for part in parts) if left[k] < 1 - MIN_EXPLAINED_FRACTION else None
        for k in range(values.shape[1])
    ]


def _fit_surface(levels: np.ndarray, values: np.ndarray, smooth: float):
    """Return a smooth surface through values (n, columns) at levels (n, keys)."""
    from scipy.interpolate import RBFInterpolator

    return RBFInterpolator(levels, values, kernel="cubic", smoothing=smooth)


def _unexplained_variance(levels, values, order, half: int, smooth: float) -> np.ndarray:
    """Return the fraction of the variance (columns,) that a surface does not explain.

    The surface goes through the first half of the cases in an order (n,), and is compared with the
    others.
    """
    seen = order[:half]
    rest = order[half:]
    off = _fit_surface(levels[seen], values[seen], smooth)(levels[rest]) - values[rest]
    return np.mean(off**2, axis=0) / np.maximum(values[rest].var(axis=0), 1e-30)


def _surface_indices(levels: np.ndarray, values: np.ndarray, smooth: float) -> tuple:
    """Return first-order and total Sobol indices, (columns, keys) each, of a surface through cases."""
    from scipy.stats import sobol_indices, uniform

    surface = _fit_surface(levels, values, smooth)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        found = sobol_indices(
            func=lambda x: surface(x.T).T,
            n=N_SOBOL_POINTS,
            dists=[uniform()] * levels.shape[1],
            rng=np.random.default_rng(1),
        )
    return tuple(np.atleast_2d(one) for one in (found.first_order, found.total_order))


def _sort_shares(names: list, shares: Sequence) -> list:
    """Return the SobolIndex of each key, the largest total first."""
    return sorted(
        (SobolIndex(name, *map(float, numbers)) for name, *numbers in zip(names, *shares)),
        key=lambda one: -one.total,
    )
