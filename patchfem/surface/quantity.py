"""A measured number with its interval, or the reason why there is none.

The interval holds what it tells of in 95 of 100 cases where two surfaces are compared, and in 90 of 100, from 5 to
95 %, where the roughness of one is measured.
"""

from typing import NamedTuple

import numpy as np

LEVEL = 0.95
SIDE = 1.959964  # standard deviations to either side


class Quantity(NamedTuple):
    """Value and interval [SI], unit and definition; reason: why there is no value, or no interval of one; name: of a
    parameter of roughness."""

    value: float | None
    low: float | None
    high: float | None
    unit: str
    text: str
    reason: str = ""
    name: str = ""


def around(value: float, error: float, unit: str, text: str, least: float | None = None) -> Quantity:
    """A quantity from its value and standard deviation; least: what it cannot be below."""
    found = [float(value), float(value - SIDE * error), float(value + SIDE * error)]
    return Quantity(*(found if least is None else [max(one, least) for one in found]), unit, text)


def refused(unit: str, text: str, reason: str) -> Quantity:
    """No quantity, and why."""
    return Quantity(None, None, None, unit, text, reason)


class Mean(NamedTuple):
    """A number that several measurements have: mean and its interval; scatter: standard deviation of one; count: how
    many."""

    mean: Quantity
    scatter: float
    count: int


def mean_of(each: list, text: str) -> Mean | None:
    """Mean of quantities that have a value, None of less than two.

    Its 95 % interval is Student's t of their scatter, s t / sqrt(n), or that of their own intervals where this is
    wider: a few may agree by chance. Where no interval reaches below zero, that of the mean does not.
    """
    from scipy.special import stdtrit

    if len(each) < 2:
        return None
    values = np.array([one.value for one in each])
    own = np.array([(one.high - one.low) / 2 if one.high is not None else 0.0 for one in each])
    scatter, middle = float(values.std(ddof=1)), float(values.mean())
    side = max(float(stdtrit(values.size - 1, (1 + LEVEL) / 2)) * scatter, float(np.sqrt((own**2).mean())))
    side = side / np.sqrt(values.size)
    least = 0.0 if all(one.low is not None and one.low >= 0 for one in each) else -np.inf
    return Mean(Quantity(middle, float(max(middle - side, least)), float(middle + side), each[0].unit, text), scatter,
                values.size)
