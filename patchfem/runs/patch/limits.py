"""Limits of values on nested meshes, and their errors, by geometric extrapolation.

In: values on two or more meshes, each with cells half as long as the previous one. Out: a
`Limit` with the error of the finest value and of the extrapolated one.
"""

from typing import NamedTuple

import numpy as np

MAX_RATIO = 4.0  # ratio of successive changes at second order, the largest that is used
MAX_RATIO_NOT_NESTED = 2.5  # largest ratio that is used for meshes that are not nested
REGULAR = (2.6, 6.0)  # range of ratios in which a series converges with its order
SLOWEST = 1.6  # smallest ratio from which the remainder is computed
GROWING = 1.3  # series with smaller ratios do not converge yet
# error over the remainder, for a steady ratio; the interval fails in less than 2 of 100 random
# scenes
STEADY_FACTOR = 1.8
UNSTEADY_FACTOR = 2.0  # error over the largest change, for a series without a steady ratio


class Limit(NamedTuple):
    """Limit of series of values on nested meshes, (...) each.

    - value: value on the finest mesh.
    - error: half-width of an interval around `value` that contains the limit.
    - extrapolated: limit by the last ratio of the changes.
    - left: half-width around `extrapolated`.
    """

    value: np.ndarray
    error: np.ndarray
    extrapolated: np.ndarray
    left: np.ndarray


def extrapolate(values, nested: bool = True) -> Limit:
    """Return the limits of series of two or more values on meshes of successively halved cells.

    Three values give a ratio of successive changes. If it is steady, the remainder of the geometric
    series is the error of the finest value. With two values the error is twice their change. For
    meshes that are not nested the order is at most log2(2.5), and nothing is extrapolated.

    Parameters
    ----------
    values : (n, ...)
        Values, coarse to fine, of one or many series.
    nested : bool
        Whether each mesh halves the cells of the previous one.
    """
    values = np.asarray(values, float)
    last = values[-1] - values[-2]
    size = np.abs(values[-1] - values[-2])
    if len(values) < 3:
        return Limit(values[-1], UNSTEADY_FACTOR * size, values[-1], UNSTEADY_FACTOR * size)
    before = values[-2] - values[-3]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = np.where(last != 0, before / last, np.where(before >= 0, np.inf, -np.inf))
    if not nested:
        rest = np.maximum(size, np.abs(before) / MAX_RATIO_NOT_NESTED) / (
            np.clip(ratio, SLOWEST, MAX_RATIO_NOT_NESTED) - 1
        )
        return Limit(values[-1], UNSTEADY_FACTOR * rest, values[-1], UNSTEADY_FACTOR * rest)
    rest = last / (np.clip(ratio, SLOWEST, MAX_RATIO) - 1)
    # above the largest regular ratio, the last change is small by chance
    wild = UNSTEADY_FACTOR * np.where(
        ratio > REGULAR[1],
        np.maximum(size / (MAX_RATIO - 1), np.abs(before) / MAX_RATIO**2 * 2),
        np.maximum(size, np.abs(before) / MAX_RATIO),
    )
    falls = (ratio >= GROWING) & (ratio <= REGULAR[1])
    return Limit(
        values[-1],
        np.where(falls, STEADY_FACTOR * np.abs(rest), wild),
        np.where(falls, values[-1] + rest, values[-1]),
        np.where(falls, _extrapolated_half_width(values, rest, ratio), wild),
    )


def _extrapolated_half_width(values, rest, ratio) -> np.ndarray:
    """Return the half-width around the extrapolated value.

    It is the change of the extrapolated value by the last mesh, and at least a quarter of the
    remainder.
    """
    least = np.abs(rest) / np.where(ratio >= REGULAR[0], 4, 2)
    if len(values) < 4:
        return 2 * least
    return np.maximum(least, np.abs(values[-1] + rest - extrapolate(values[:-1]).extrapolated))
