"""Random cases of a sweep, either independent or from a Sobol sequence."""

import warnings
from collections.abc import Sequence

import numpy as np

from ...scene.assignments import Axis, Range
from .cases import Cases, take_values


def draw_cases(
    axes: Sequence[Axis | Range], count: int, seed: int, *, sobol: bool = False
) -> Cases:
    """Draw random cases from ranges and lists of values, reproducibly for a given seed.

    A range is sampled uniformly, either linearly or logarithmically. The values of a list have equal
    probabilities.

    Parameters
    ----------
    axes : sequence of Axis or Range
        Range or values of each key.
    count : int
        Number of cases.
    seed : int
        Seed of the generator, >= 0.
    sobol : bool
        Whether to use a scrambled Sobol sequence (Owen 1995) instead of independent samples. It is
        most uniform if `count` is a power of two.

    Returns
    -------
    Cases
    """
    if sobol:
        fractions = _draw_sobol_points(len(axes), count, seed)
    else:
        fractions = np.random.default_rng(seed).random((count, len(axes)))
    return Cases(tuple(map(_map_to_values, axes, fractions.T)), is_table=True, is_random=True)


def _draw_sobol_points(n_axes: int, count: int, seed: int) -> np.ndarray:
    """Return `count` points (count, n_axes) in [0, 1) of a Sobol sequence, scrambled by the seed."""
    from scipy.stats import qmc

    with warnings.catch_warnings():
        # SciPy warns if the number of points is not a power of two.
        warnings.simplefilter("ignore", UserWarning)
        return qmc.Sobol(n_axes, scramble=True, rng=np.random.default_rng(seed)).random(count)


def _map_to_values(axis: Axis | Range, fractions: np.ndarray) -> Axis:
    """Map uniform random fractions (n,) in [0, 1) to values of a swept key, an axis or a range."""
    if isinstance(axis, Range):
        return axis.make_axis(fractions.tolist())
    n_values = len(axis.texts)
    indices = np.minimum((fractions * n_values).astype(int), n_values - 1)
    return take_values(axis, indices)
