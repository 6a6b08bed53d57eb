"""Numeric keys with the ranges in which a fit varies them, as ``table.key=low..high``."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from .keys import quantities
from .keys.lookup import KeyDefinition, require_key, validate_value
from .keys.types import find_inner_table, find_quantity_kind, list_key_types
from .reader import read_set_value


@dataclass(frozen=True, slots=True)
class Range:
    """Scene key with a lower and an upper bound in SI units."""

    key: str
    low: float
    high: float
    kind: str | None

    @property
    def unit(self) -> str:
        """SI unit of the key, or "1" for a number without unit."""
        return quantities.find_si_unit(self.kind)

    def format_assignment(self, value: float) -> str:
        """Return the assignment that sets the key to a value in SI units."""
        text = quantities.format_si(value, self.kind) if self.kind else repr(float(value))
        return f"{self.key}={text}"


def read_ranges(texts: Iterable[str]) -> tuple[list[Range], list[str]]:
    """Read strings that hold one or more ``table.key=low..high``, separated by commas.

    Returns
    -------
    tuple
        The ranges, and the sentences about mistakes.
    """
    ranges = []
    mistakes = []
    for text in ",".join(texts).split(",") if texts else ():
        try:
            ranges.append(_read_range(text.strip()))
        except ValueError as error:
            mistakes.append(f"--free {error}")
    counts = Counter(item.key for item in ranges)
    mistakes += [f"--free {key}: is given twice" for key in counts if counts[key] > 1]
    if not ranges and not mistakes:
        mistakes.append(
            "--free: at least one table.key=low..high is needed, such as friction.static=0.1..0.6"
        )
    return ranges, mistakes


def _read_range(text: str) -> Range:
    key, equals, bounds = (part.strip() for part in text.partition("="))
    low, dots, high = (part.strip() for part in bounds.partition(".."))
    if not all((equals, dots, low, high)):
        raise ValueError(
            f"{text}: table.key=low..high is needed, such as friction.bond_length=0.2 um..20 um"
        )
    try:
        definition = _require_number_key(key)
        low_value = _read_number(definition, key, low)
        high_value = _read_number(definition, key, high)
        if not low_value < high_value:
            raise ValueError(f"the low bound {low} must lie below the high bound {high}")
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None
    return Range(key, low_value, high_value, find_quantity_kind(*definition))


def _require_number_key(key: str) -> KeyDefinition:
    """Find a key that holds one number; raise ValueError for any other key."""
    definition = require_key(key)
    types = list_key_types(*definition)
    if find_inner_table(*definition) is not None or tuple in types or float not in types:
        raise ValueError(
            "is not a number that can vary; only quantities and plain numbers can be free"
        )
    return definition


def _read_number(definition: KeyDefinition, key: str, text: str) -> float:
    """Convert the string of a value to SI units; raise ValueError if the key does not accept it."""
    written = read_set_value(key, text)
    if isinstance(written, int) and not isinstance(written, bool):
        written = float(written)
    value = validate_value(key, written).get(definition.name)
    if not isinstance(value, float) or not math.isfinite(value):
        raise ValueError(f"'{text}' is not a finite number")
    return value
