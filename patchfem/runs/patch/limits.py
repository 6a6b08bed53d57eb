"""Extrapolation of values on nested meshes to vanishing cell length, with error estimates.

In: values on two or more meshes, each with cells half as long as those of the previous one. Out: a
`Limit` with the error of the value on the finest mesh and of the extrapolated value.
"""

from typing import NamedTuple

import numpy as np

# Upper bound of the ratio of successive changes in the extrapolation; it is about that of second
# order.
MAX_RATIO_OF_CHANGES = 4.0
# The same bound for meshes that are not nested.
MAX_RATIO_OF_CHANGES_NOT_NESTED = 2.5
# Smallest ratio of successive changes of a series that converges at its expected order.
MIN_EXPECTED_RATIO_OF_CHANGES = 2.6
# Largest ratio of successive changes of a regular series; above it the last change is small by
# chance.
MAX_REGULAR_RATIO_OF_CHANGES = 6.0
MIN_RATIO_OF_CHANGES = 1.6  # Lower bound of the ratio of successive changes in the extrapolation.
# Smallest ratio of successive changes of a convergent series.
MIN_CONVERGING_RATIO_OF_CHANGES = 1.3
# Ratio of error to remainder for a regular series. With this value the interval misses the limit in
# less than 2 of 100 random scenes.
REGULAR_SERIES_ERROR_FACTOR = 1.8
IRREGULAR_SERIES_ERROR_FACTOR = 2.0  # Ratio of error to the largest change for an irregular series.


class Limit(NamedTuple):
    """Limits of series of values on nested meshes, with error estimates; arrays of the shape of the values of one mesh.

    - value: value on the finest mesh.
    - error: half-width of an interval around `value` that contains the limit.
    - extrapolated: limit of the geometric series given by the last ratio of changes.
    - extrapolated_error: half-width of the interval around `extrapolated`.
    """

    value: np.ndarray
    error: np.ndarray
    extrapolated: np.ndarray
    extrapolated_error: np.ndarray


def extrapolate_to_zero_cell_length(
    values, nested: bool = True, *, has_same_gap: bool = True
) -> Limit:
    """Extrapolate values on successively refined meshes to vanishing cell length.

    Three values give a ratio of successive changes. It is regular between MIN_CONVERGING_RATIO_OF_CHANGES and
    MAX_REGULAR_RATIO_OF_CHANGES. The value is then extrapolated by the remainder of the geometric series, and the error
    of the value on the finest mesh is REGULAR_SERIES_ERROR_FACTOR times this remainder. The error of the
    extrapolated value is a quarter of the remainder, half of it if the ratio is below MIN_EXPECTED_RATIO_OF_CHANGES; it
    is at least the change of the extrapolated value by the last refinement, and doubled if this is unknown. It is the whole
    remainder if each mesh has another gap, because the changes then do not become a geometric series.

    If the ratio is irregular, nothing is extrapolated, and the error is IRREGULAR_SERIES_ERROR_FACTOR times the last
    change, or a fraction of the change before if that is larger. With two values the error is twice their
    change. For meshes that are not nested the order is limited to log2(2.5), and no value is
    extrapolated.

    Parameters
    ----------
    values : (l, ...) array_like
        Values from the coarsest to the finest of l >= 2 meshes.
    nested : bool
        Whether each mesh halves the cells of the previous one.
    has_same_gap : bool
        Whether the gap is the same on all meshes; the means of a measured profile over the cells are not.

    Returns
    -------
    Limit
    """
    values = np.asarray(values, float)
    finest = values[-1]
    last_change = finest - values[-2]
    previous_change = values[-2] - values[-3] if len(values) > 2 else np.zeros_like(finest)
    last_size = np.abs(last_change)
    previous_size = np.abs(previous_change)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(last_change != 0, previous_change / last_change, np.inf)
    ratio = np.where((last_change == 0) & (previous_change < 0), -np.inf, ratio)

    # Irregular series, and those of two values, are not extrapolated.
    largest_change = np.maximum(last_size, previous_size / MAX_RATIO_OF_CHANGES)
    if nested:
        by_chance = np.maximum(
            last_size / (MAX_RATIO_OF_CHANGES - 1), previous_size / MAX_RATIO_OF_CHANGES**2 * 2
        )
        largest_change = np.where(ratio > MAX_REGULAR_RATIO_OF_CHANGES, by_chance, largest_change)
    elif len(values) > 2:
        bounded_ratio = np.clip(ratio, MIN_RATIO_OF_CHANGES, MAX_RATIO_OF_CHANGES_NOT_NESTED)
        largest_change = np.maximum(last_size, previous_size / MAX_RATIO_OF_CHANGES_NOT_NESTED)
        largest_change = largest_change / (bounded_ratio - 1)
    irregular_error = IRREGULAR_SERIES_ERROR_FACTOR * largest_change
    is_regular = (ratio >= MIN_CONVERGING_RATIO_OF_CHANGES) & (
        ratio <= MAX_REGULAR_RATIO_OF_CHANGES
    )
    if not (nested and is_regular.any()):
        return Limit(finest, irregular_error, finest, irregular_error)

    # The error of the extrapolated value is its change due to the last refinement, but at least a
    # quarter of the remainder.
    remainder = last_change / (np.clip(ratio, MIN_RATIO_OF_CHANGES, MAX_RATIO_OF_CHANGES) - 1)
    extrapolated = np.where(is_regular, finest + remainder, finest)
    size = np.abs(remainder)
    extrapolated_error = size / np.where(ratio >= MIN_EXPECTED_RATIO_OF_CHANGES, 4, 2)
    if len(values) < 4:
        extrapolated_error = 2 * extrapolated_error
    else:
        before = extrapolate_to_zero_cell_length(values[-4:-1]).extrapolated
        extrapolated_error = np.maximum(extrapolated_error, np.abs(extrapolated - before))
    if not has_same_gap:
        extrapolated_error = np.maximum(extrapolated_error, size)
    return Limit(
        finest,
        np.where(is_regular, REGULAR_SERIES_ERROR_FACTOR * size, irregular_error),
        extrapolated,
        np.where(is_regular, extrapolated_error, irregular_error),
    )
