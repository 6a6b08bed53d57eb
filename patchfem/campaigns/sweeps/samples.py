"""Random cases of a sweep: independent ones, or points of a Sobol sequence."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from ...scene.axes import Axis, SampledRange
from .cases import Cases


def draw_cases(
    parts: Sequence[Axis | SampledRange], count: int, seed: int, *, sobol: bool = False
) -> Cases:
    """Draw random cases from ranges and lists of values, reproducibly for a given seed.

    A range is sampled uniformly between its ends, or uniformly in its logarithm; the values of a
    list are equally likely.

    Parameters
    ----------
    parts : sequence of Axis or SampledRange
    count : int
        Number of cases.
    seed : int
    sobol : bool
        Whether to use the scrambled sequence of Sobol (Owen 1995), which covers the space best if
        `count` is a power of two, in place of independent samples.

    Returns
    -------
    Cases
    """
    if sobol:
        fractions = _sobol_points(len(parts), count, seed)
    else:
        fractions = np.random.default_rng(seed).random((count, len(parts)))
    return Cases(tuple(map(_select_values, parts, fractions.T)), rows=True, drawn=True)


def _sobol_points(width: int, count: int, seed: int) -> np.ndarray:
    """Return `count` points (count, width) of a scrambled Sobol sequence."""
    from scipy.stats import qmc

    with warnings.catch_warnings():
        # SciPy warns of counts that are no power of two.
        warnings.simplefilter("ignore", UserWarning)
        return qmc.Sobol(width, scramble=True, rng=np.random.default_rng(seed)).random(count)


def _select_values(axis: Axis | SampledRange, fractions: np.ndarray) -> Axis:
    """Return the values of a key that correspond to uniform random numbers (n,)."""
    if isinstance(axis, SampledRange):
        return axis.make_axis(fractions.tolist())
    n_values = len(axis.texts)
    places = np.minimum((fractions * n_values).astype(int), n_values - 1)
    texts = tuple(axis.texts[place] for place in places)
    values = tuple(axis.values[place] for place in places)
    return Axis(axis.key, texts, values, axis.unit)
