"""A measured number with its interval, or the reason why there is none.

The interval holds what it tells of in 95 of 100 cases where two surfaces are compared, and in 90 of 100, from 5 to
95 %, where the roughness of one is measured.
"""

from typing import NamedTuple

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
