"""Cases drawn at chance: independent ones, or Sobol's that fill the space evenly."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from ...scene.axes import Axis, SampledRange
from .cases import Cases


def drawn(parts: Sequence[Axis | SampledRange], count: int, sobol: bool, seed: int) -> Cases:
    """`count` cases, the same for the same seed: between the ends of each span, evenly or evenly in its logarithm, and
    from the values of each list with equal chances.

    sobol: the scrambled sequence of Sobol (Owen 1995), best in powers of two, in place of independent draws.
    """
    shares = (
        _sobol(len(parts), count, seed)
        if sobol
        else np.random.default_rng(seed).random((count, len(parts)))
    )
    return Cases(
        tuple(map(_picked, parts, shares.T)),
        True,
        True,
    )


def _sobol(width: int, count: int, seed: int) -> np.ndarray:
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # on counts that are no power of two
        return qmc.Sobol(width, scramble=True, rng=np.random.default_rng(seed)).random(count)


def _picked(axis: Axis | SampledRange, shares: np.ndarray) -> Axis:
    if isinstance(axis, SampledRange):
        return axis.make_axis(shares.tolist())
    at = np.minimum((shares * len(axis.texts)).astype(int), len(axis.texts) - 1)
    return Axis(
        axis.key,
        tuple(axis.texts[one] for one in at),
        tuple(axis.values[one] for one in at),
        axis.unit,
    )
