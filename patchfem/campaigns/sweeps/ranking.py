"""Which input of a sweep matters how much: shares of the variance of a measure, by Sobol's indices.

The first-order share S_i = V(E(y | x_i))/V(y) is what a key explains alone, the total share T_i = E(V(y | x_~i))/V(y)
what it takes part in (Sobol 1993, Homma and Saltelli 1996). On a grid both are means over its cases. Of drawn cases
they are those of a smooth surface through the cases (`scipy.interpolate.RBFInterpolator`), by
`scipy.stats.sobol_indices`; surfaces through halves of the cases, each held against the other half, give the interval.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

MOST = 640  # cases that a surface is laid through: its equations are dense
POINTS = 1024  # of a key in Sobol's sequence: shares to some 0.01
HALVES = 6  # surfaces through half of the cases
SMOOTH = (1e-8, 1e-4, 1e-2, 1.0)  # of a surface, from through its cases to near a plane
LEAST = 16  # cases per key, below which halves of them tell nothing
CLOSE = 0.005  # of a share by POINTS
TOLD = 0.5  # of the variance, which a surface has to explain in cases that it has not seen


class Share(NamedTuple):
    """Shares of one key in the variance of a measure: of the first order and total, and the interval of the total."""

    key: str
    first: float
    total: float
    low: float
    high: float


def ranking(keys: Sequence[tuple], measures: dict, shape: tuple | None) -> dict:
    """{measure: [Share], the largest total first} of the measures that change, where the cases tell it.

    keys: (name, values (n,)); measures: {name: (values (n,), errors (n,))}, NaN where a case has none; shape: numbers
    of values of the keys where the cases are all their combinations, the last key fastest, None for drawn ones. A
    measure that a tenth of the cases lacks is left out: those that have it are no fair draw.
    """
    moving = [(name, np.asarray(values)) for name, values in keys if np.unique(values).size > 1]
    changing = {
        name: np.asarray(values, float)
        for name, (values, errors) in measures.items()
        if _changes(np.asarray(values, float), np.asarray(errors, float))
    }
    if len(moving) < 2 or not changing:
        return {}
    names = [name for name, _ in moving]
    if shape is not None:
        whole = {name: values for name, values in changing.items() if np.isfinite(values).all()}
        found = {name: _of_grid(values.reshape(shape)) for name, values in whole.items()}
        along = [place for place, (name, _) in enumerate(keys) if name in names]
        return {
            name: _sorted(names, [one[along] for one in shares]) for name, shares in found.items()
        }
    levels = np.stack([_level(values) for _, values in moving], axis=1)
    out = {}
    for there in {
        np.isfinite(values).tobytes(): np.isfinite(values) for values in changing.values()
    }.values():
        alike = [
            name for name, values in changing.items() if np.array_equal(np.isfinite(values), there)
        ]
        if there.sum() < LEAST * len(moving):
            continue
        found = _of_draw(levels[there], np.stack([changing[name][there] for name in alike], axis=1))
        out |= {
            name: _sorted(names, shares) for name, shares in zip(alike, found) if shares is not None
        }
    return {name: out[name] for name in changing if name in out}


def _changes(values: np.ndarray, errors: np.ndarray) -> bool:
    """Whether a measure of most cases changes by more than its errors and round-off."""
    there = np.isfinite(values)
    if there.mean() < 0.9:
        return False
    spread = np.std(values[there])
    return spread > 1e-9 * np.abs(values[there]).max(initial=0.0) and spread > np.sqrt(
        np.mean(np.nan_to_num(errors[there]) ** 2)
    )


def _level(values: np.ndarray) -> np.ndarray:
    """The share of the cases below each value, so that each key is drawn evenly between 0 and 1."""
    _, same, counts = np.unique(values, return_inverse=True, return_counts=True)
    return ((np.cumsum(counts) - counts / 2) / values.size)[same]


def _of_grid(values: np.ndarray) -> tuple:
    """(first, total, low, high), each (keys,), of a full grid of values."""
    axes, whole = range(values.ndim), values.var()
    first = (
        np.array(
            [values.mean(axis=tuple(other for other in axes if other != one)).var() for one in axes]
        )
        / whole
    )
    total = np.array([values.var(axis=one).mean() for one in axes]) / whole
    return first, total, total, total


def _of_draw(levels: np.ndarray, values: np.ndarray) -> list:
    """(first, total, low, high), each (keys,), of each column of values at `levels` (n, keys); None where a surface
    does not explain enough of it."""
    rng = np.random.default_rng(0)
    if len(levels) > MOST:
        some = np.sort(rng.choice(len(levels), MOST, replace=False))
        levels, values = levels[some], values[some]
    scaled = (values - values.mean(axis=0)) / values.std(axis=0)
    halves = [rng.permutation(len(levels)) for _ in range(HALVES)]
    half = len(levels) // 2
    smooth = min(
        SMOOTH, key=lambda one: np.median(_unexplained(levels, scaled, halves[0], half, one))
    )
    left = np.mean([_unexplained(levels, scaled, order, half, smooth) for order in halves], axis=0)
    first, total = _indices(levels, scaled, smooth)
    others = np.stack(
        [
            total,
            *(_indices(levels[order[:half]], scaled[order[:half]], smooth)[1] for order in halves),
        ]
    )
    low, high = (
        others.min(axis=0) - left[:, None] - CLOSE,
        others.max(axis=0) + left[:, None] + CLOSE,
    )
    parts = [np.clip(one, 0.0, 1.0) for one in (first, total, low, high)]
    return [
        tuple(part[k] for part in parts) if left[k] < 1 - TOLD else None
        for k in range(values.shape[1])
    ]


def _surface(levels: np.ndarray, values: np.ndarray, smooth: float):
    from scipy.interpolate import RBFInterpolator

    return RBFInterpolator(levels, values, kernel="cubic", smoothing=smooth)


def _unexplained(levels, values, order, half: int, smooth: float) -> np.ndarray:
    """Share of the variance (columns,) of half of the cases that a surface through the other half leaves."""
    seen, rest = order[:half], order[half:]
    off = _surface(levels[seen], values[seen], smooth)(levels[rest]) - values[rest]
    return np.mean(off**2, axis=0) / np.maximum(values[rest].var(axis=0), 1e-30)


def _indices(levels: np.ndarray, values: np.ndarray, smooth: float) -> tuple:
    """(first, total), each (columns, keys), of a surface through the cases."""
    from scipy.stats import sobol_indices, uniform

    surface = _surface(levels, values, smooth)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        found = sobol_indices(
            func=lambda x: surface(x.T).T,
            n=POINTS,
            dists=[uniform()] * levels.shape[1],
            rng=np.random.default_rng(1),
        )
    return tuple(np.atleast_2d(one) for one in (found.first_order, found.total_order))


def _sorted(names: list, shares: Sequence) -> list:
    return sorted(
        (Share(name, *map(float, numbers)) for name, *numbers in zip(names, *shares)),
        key=lambda one: -one.total,
    )
