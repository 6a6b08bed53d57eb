"""Extrapolation of values on nested meshes to vanishing cell length, with error estimates.

In: values on two or more meshes, each with cells half as long as those of the previous one. Out: a
`Limit` with the error of the value on the finest mesh and of the extrapolated value.
"""

from typing import NamedTuple

import numpy as np

# Upper bound of the ratio of successive changes in the extrapolation; it is about that of second
# order.
MAX_RATIO = 4.0
# The same bound for meshes that are not nested.
MAX_RATIO_NOT_NESTED = 2.5
# Smallest ratio of successive changes of a series that converges at its expected order.
MIN_REGULAR_RATIO = 2.6
# Largest ratio of successive changes of a regular series; above it the last change is small by
# chance.
MAX_REGULAR_RATIO = 6.0
MIN_RATIO = 1.6  # Lower bound of the ratio of successive changes in the extrapolation.
# Smallest ratio of successive changes of a convergent series.
MIN_CONVERGING_RATIO = 1.3
# Ratio of error to remainder for a regular series. With this value the interval misses the limit in
# less than 2 of 100 random scenes.
REGULAR_ERROR_FACTOR = 1.8
IRREGULAR_ERROR_FACTOR = 2.0  # Ratio of error to the largest change for an irregular series.


class Limit(NamedTuple):
    """Limit of a series of values on nested meshes, with error estimates.

    - value: value on the finest mesh.
    - error: half-width of an interval around `value` that contains the limit.
    - extrapolated: limit of the geometric series given by the last ratio of changes.
    - extrapolated_error: half-width of the interval around `extrapolated`.
    """

    value: np.ndarray
    error: np.ndarray
    extrapolated: np.ndarray
    extrapolated_error: np.ndarray


def extrapolate_to_zero_cell_length(values, nested: bool = True) -> Limit:
    """Extrapolate values on successively refined meshes to vanishing cell length.

    Three values give a ratio of successive changes. It is regular between MIN_CONVERGING_RATIO and
    MAX_REGULAR_RATIO. The value is then extrapolated by the remainder of the geometric series, and the error
    of the value on the finest mesh is REGULAR_ERROR_FACTOR times this remainder. The error of the
    extrapolated value is a quarter of the remainder, half of it if the ratio is below MIN_REGULAR_RATIO; it
    is at least the change of the extrapolated value by the last refinement, and doubled if this is unknown.

    If the ratio is irregular, nothing is extrapolated, and the error is IRREGULAR_ERROR_FACTOR times the last
    change, or a fraction of the change before if that is larger. With two values the error is twice their
    change. For meshes that are not nested the order is limited to log2(2.5), and no value is
    extrapolated.

    Parameters
    ----------
    values : (n, ...)
        Values of one or many series, from the coarsest to the finest mesh.
    nested : bool
        Whether each mesh halves the cells of the previous one.

    Returns
    -------
    Limit
    """
    values = np.asarray(values, float)
    finest = values[-1]
    last_change = values[-1] - values[-2]
    last_size = np.abs(last_change)
    if len(values) < 3:
        return Limit(
            finest, IRREGULAR_ERROR_FACTOR * last_size, finest, IRREGULAR_ERROR_FACTOR * last_size
        )
    previous_change = values[-2] - values[-3]
    previous_size = np.abs(previous_change)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = np.where(
            last_change != 0,
            previous_change / last_change,
            np.where(previous_change >= 0, np.inf, -np.inf),
        )
    if not nested:
        largest_change = np.maximum(last_size, previous_size / MAX_RATIO_NOT_NESTED)
        remainder = largest_change / (np.clip(ratio, MIN_RATIO, MAX_RATIO_NOT_NESTED) - 1)
        error = IRREGULAR_ERROR_FACTOR * remainder
        return Limit(finest, error, finest, error)
    remainder = last_change / (np.clip(ratio, MIN_RATIO, MAX_RATIO) - 1)
    irregular_error = IRREGULAR_ERROR_FACTOR * np.where(
        ratio > MAX_REGULAR_RATIO,
        np.maximum(last_size / (MAX_RATIO - 1), previous_size / MAX_RATIO**2 * 2),
        np.maximum(last_size, previous_size / MAX_RATIO),
    )
    # The error of the extrapolated value is its change due to the last refinement, but at least a
    # quarter of the remainder.
    extrapolated = finest + remainder
    extrapolated_error = np.abs(remainder) / np.where(ratio >= MIN_REGULAR_RATIO, 4, 2)
    if len(values) < 4:
        extrapolated_error = 2 * extrapolated_error
    else:
        change = np.abs(extrapolated - extrapolate_to_zero_cell_length(values[:-1]).extrapolated)
        extrapolated_error = np.maximum(extrapolated_error, change)
    is_regular = (ratio >= MIN_CONVERGING_RATIO) & (ratio <= MAX_REGULAR_RATIO)
    return Limit(
        finest,
        np.where(is_regular, REGULAR_ERROR_FACTOR * np.abs(remainder), irregular_error),
        np.where(is_regular, extrapolated, finest),
        np.where(is_regular, extrapolated_error, irregular_error),
    )
