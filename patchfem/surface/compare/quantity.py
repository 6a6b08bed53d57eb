"""A measured number with the interval that holds it in 95 of 100 cases, or the reason why there is none."""

from typing import NamedTuple

LEVEL = 0.95
SIDE = 1.959964  # standard deviations to either side


class Quantity(NamedTuple):
    """Value and interval [SI], unit and definition; reason: why there is no value."""

    value: float | None
    low: float | None
    high: float | None
    unit: str
    text: str
    reason: str = ""


def around(value: float, error: float, unit: str, text: str, least: float | None = None) -> Quantity:
    """A quantity from its value and standard deviation; least: what it cannot be below."""
    found = [float(value), float(value - SIDE * error), float(value + SIDE * error)]
    return Quantity(*(found if least is None else [max(one, least) for one in found]), unit, text)


def refused(unit: str, text: str, reason: str) -> Quantity:
    """No quantity, and why."""
    return Quantity(None, None, None, unit, text, reason)
