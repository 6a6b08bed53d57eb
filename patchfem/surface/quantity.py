"""Measured quantity with its interval, or the reason why there is none.

The interval holds in 95 of 100 cases where two surfaces are compared, and in 90 of 100, from 5 to
95 %, where the roughness of one is measured.
"""

import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple

CONFIDENCE_LEVEL = 0.95  # probability that the interval of a comparison contains the true value
# Half-width of a normal interval of CONFIDENCE_LEVEL, in standard deviations
HALF_WIDTH_95 = 1.959964


class Quantity(NamedTuple):
    """Value of a measured quantity with interval, unit and definition.

    - value: value, or None if it is not known.
    - low, high: ends of the interval of probability CONFIDENCE_LEVEL, or None if it is not known.
    - unit: SI unit, such as "m".
    - text: definition.
    - reason: code of the reason why there is no value, or no interval.
    - name: name of a parameter of roughness.
    """

    value: float | None
    low: float | None
    high: float | None
    unit: str
    text: str
    reason: str = ""
    name: str = ""


@cache
def read_definitions(section: str) -> dict[str, list[str]]:
    """Return the unit and the definition of each quantity of a section of definitions.toml, by name."""
    text = Path(__file__).with_name("definitions.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)[section]
