"""Extrapolation of values on nested meshes to vanishing cell length, with error estimates.

In: values on two or more meshes, each with cells half as long as those of the previous one. Out: a
`Limit` with the error of the value on the finest mesh and of the extrapolated value.
"""

from math import inf
from typing import NamedTuple

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
    """Limit of a series of values on nested meshes, with error estimates.

    - value: value on the finest mesh.
    - error: half-width of an interval around `value` that contains the limit.
    - extrapolated: limit of the geometric series given by the last ratio of changes.
    - extrapolated_error: half-width of the interval around `extrapolated`.
    """

    value: float
    error: float
    extrapolated: float
    extrapolated_error: float


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
    values : sequence of float
        Values from the coarsest to the finest mesh, two or more.
    nested : bool
        Whether each mesh halves the cells of the previous one.
    has_same_gap : bool
        Whether the gap is the same on all meshes; the means of a measured profile over the cells are not.

    Returns
    -------
    Limit
    """
    finest = values[-1]
    last_change = finest - values[-2]
    previous_change = values[-2] - values[-3] if len(values) > 2 else 0.0
    last_size = abs(last_change)
    previous_size = abs(previous_change)
    ratio = inf if previous_change >= 0 else -inf
    if last_change != 0:
        ratio = previous_change / last_change

    # Irregular series, and those of two values, are not extrapolated.
    if not nested or not MIN_CONVERGING_RATIO_OF_CHANGES <= ratio <= MAX_REGULAR_RATIO_OF_CHANGES:
        largest_change = max(last_size, previous_size / MAX_RATIO_OF_CHANGES)
        if not nested and len(values) > 2:
            bounded_ratio = min(max(ratio, MIN_RATIO_OF_CHANGES), MAX_RATIO_OF_CHANGES_NOT_NESTED)
            largest_change = max(last_size, previous_size / MAX_RATIO_OF_CHANGES_NOT_NESTED)
            largest_change = largest_change / (bounded_ratio - 1)
        elif ratio > MAX_REGULAR_RATIO_OF_CHANGES:
            largest_change = max(
                last_size / (MAX_RATIO_OF_CHANGES - 1), previous_size / MAX_RATIO_OF_CHANGES**2 * 2
            )
        error = IRREGULAR_SERIES_ERROR_FACTOR * largest_change
        return Limit(finest, error, finest, error)

    # The error of the extrapolated value is its change due to the last refinement, but at least a
    # quarter of the remainder.
    remainder = last_change / (min(max(ratio, MIN_RATIO_OF_CHANGES), MAX_RATIO_OF_CHANGES) - 1)
    extrapolated = finest + remainder
    extrapolated_error = abs(remainder) / (4 if ratio >= MIN_EXPECTED_RATIO_OF_CHANGES else 2)
    if len(values) < 4:
        extrapolated_error = 2 * extrapolated_error
    else:
        change = abs(extrapolated - extrapolate_to_zero_cell_length(values[:-1]).extrapolated)
        extrapolated_error = max(extrapolated_error, change)
    if not has_same_gap:
        extrapolated_error = max(extrapolated_error, abs(remainder))
    return Limit(
        finest, REGULAR_SERIES_ERROR_FACTOR * abs(remainder), extrapolated, extrapolated_error
    )
