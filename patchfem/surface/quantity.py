"""Measured quantity with its interval, or the reason why there is none.

The interval holds in 95 of 100 cases where two surfaces are compared, and in 90 of 100, from 5 to
95 %, where the roughness of one is measured.
"""

from typing import NamedTuple

import numpy as np

LEVEL = 0.95  # probability that the interval of a comparison contains the true value
SIDE = 1.959964  # half-width of a normal interval of LEVEL, in standard deviations


class Quantity(NamedTuple):
    """Value of a measured quantity with interval, unit and definition.

    reason: why there is no value, or no interval; name: of a parameter of roughness.
    """

    value: float | None
    low: float | None
    high: float | None
    unit: str
    text: str
    reason: str = ""
    name: str = ""


class Mean(NamedTuple):
    """Mean of a quantity over several measurements, with their scatter."""

    mean: Quantity
    scatter: float
    count: int


def average_quantities(quantities: list[Quantity], text: str) -> Mean | None:
    """Average a quantity over the measurements that have a value, or return None if fewer than two have one.

    The 95 % interval s t / sqrt(n) comes from their scatter by Student's t, or from their own
    intervals if these give a wider one, because a few values may agree by chance. It does not
    extend below zero if none of theirs does.
    """
    from scipy.special import stdtrit

    count = len(quantities)
    if count < 2:
        return None
    values = np.array([quantity.value for quantity in quantities])
    errors = np.array(
        [
            0.0 if quantity.high is None else (quantity.high - quantity.low) / 2
            for quantity in quantities
        ]
    )
    scatter = float(values.std(ddof=1))
    mean = float(values.mean())
    student = float(stdtrit(count - 1, (1 + LEVEL) / 2))
    error = max(student * scatter, float(np.sqrt((errors**2).mean()))) / np.sqrt(count)
    is_positive = all(quantity.low is not None and quantity.low >= 0 for quantity in quantities)
    low = max(mean - error, 0.0) if is_positive else mean - error
    return Mean(
        Quantity(mean, float(low), float(mean + error), quantities[0].unit, text), scatter, count
    )
