"""Conversion of quantities ``"<number> <unit>"`` in a scene to SI and back; units are never guessed.

The kind of a quantity follows from the key, so `g` is standard gravity in an acceleration and a gram in a mass.
"""

from __future__ import annotations

import math
import re
import tomllib
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal
from functools import cache, lru_cache
from pathlib import Path

from .values import TomlValue

# Tables of units.toml by kind of quantity: the factors of its units, and an example
_KINDS = tomllib.loads(Path(__file__).with_name("units.toml").read_text(encoding="utf-8"))
# Factors to SI by unit for each kind of quantity; the first unit of each kind is its SI unit.
UNIT_FACTORS: dict[str, dict[str, float]] = {kind: row["units"] for kind, row in _KINDS.items()}
# Example of each kind of quantity for messages and the schema.
EXAMPLE_QUANTITIES: dict[str, str] = {kind: row["example"] for kind, row in _KINDS.items()}
# Regular expression of a number.
NUMBER_PATTERN = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_QUANTITY_PATTERN = re.compile(rf"({NUMBER_PATTERN})[ \t]+(\S.*)")
PERCENTAGE_PATTERN = rf"\s*({NUMBER_PATTERN})[ \t]*%\s*"
_JOINED_UNIT_PATTERN = re.compile(rf"({NUMBER_PATTERN})([^\s0-9.,#+±-].*)")
# Largest length of a quantity; a longer string is refused without being parsed.
_MAX_CHARACTERS = 100
_MAX_SHOWN_CHARACTERS = 60  # largest length of a wrong quantity in a message
MAX_RANGE_VALUES = (
    1000  # largest number of values of a range in a scene, far more than a test has levels
)
# Decimal context that holds all digits of the product of a value and a factor.
_EXACT_CONTEXT = Context(prec=2 * _MAX_CHARACTERS, Emax=MAX_EMAX, Emin=MIN_EMIN)


def parse_quantity(text: TomlValue, kind: str) -> float:
    """Return the SI value of a text ``"<number> <unit>"``, correctly rounded.

    Raises ValueError, with the kind and an example, for a bare number, an unknown or ambiguous unit, a unit of another
    kind, anything but one number and one unit, and a value that is not finite.

    `kind` is the kind of quantity, such as "length", a key of UNIT_FACTORS.
    """
    if not isinstance(text, str):
        raise ValueError(_describe_non_text(text, kind))
    words = text.strip()
    match = _QUANTITY_PATTERN.fullmatch(words) if len(words) <= _MAX_CHARACTERS else None
    if match is None:
        raise ValueError(_describe_malformed_text(words, kind))
    number, unit = match.groups()
    factor = UNIT_FACTORS[kind].get(normalize_unit(unit))
    if factor is None:
        raise ValueError(_describe_wrong_unit(number, unit, kind))
    try:
        return _multiply(number, factor, kind)
    except ValueError as error:
        raise ValueError(f"'{words}' is {error}; {describe_requirement(kind)}") from None


def read_percentage(value: TomlValue) -> TomlValue:
    """Return a percentage such as "0.2 %" as a number, correctly rounded, and any other value unchanged."""
    is_short = isinstance(value, str) and len(value) <= _MAX_CHARACTERS
    match = re.fullmatch(PERCENTAGE_PATTERN, value) if is_short else None
    return _multiply(match[1], 0.01, "") if match else value


def split_quantity(text: str) -> tuple[str, str]:
    """Return number and unit, as written, of a `text` that `parse_quantity` accepts."""
    return _QUANTITY_PATTERN.fullmatch(text).groups()


def find_si_unit(kind: str | None) -> str:
    """Return the SI unit of a kind of quantity, or "1" for None, which stands for a number without unit."""
    return next(iter(UNIT_FACTORS[kind])) if kind else "1"


def format_si(value: float, kind: str) -> str:
    """Return a value with its SI unit, as ``"0.0127 m"``; `parse_quantity` gives back the same float.

    `kind` is the kind of quantity, such as "length".
    """
    return f"{float(value)!r} {find_si_unit(kind)}"


def spread_range(text: str, kind: str) -> list[str]:
    """Return the values of a range with equal steps, such as "2 g..6 g:5", with their SI units.

    `kind` is the kind of quantity. ValueError is raised if the number of values is missing or an end is no quantity.
    """
    ends, _, count = text.rpartition(":")
    if not count.strip().isdigit() or not 2 <= int(count) <= MAX_RANGE_VALUES:
        raise ValueError(
            f"{text}: give the number of values after a colon, from 2 to {MAX_RANGE_VALUES}, such as :9"
        )
    low, high = (parse_quantity(end.strip(), kind) for end in ends.split("..", 1))
    parts = (k / (int(count) - 1) for k in range(int(count)))
    return [format_si(low * (1 - part) + high * part, kind) for part in parts]


def describe_requirement(kind: str) -> str:
    """Return what a key with this kind of quantity requires, with an example, as the end of a message."""
    return f"{_add_article(kind)} with its unit is needed, such as '{EXAMPLE_QUANTITIES[kind]}'"


def _multiply(number: str, factor: float, kind: str) -> float:
    """Return number times factor, correctly rounded.

    ValueError is raised if it is out of range. The lower limit depends on the `kind` of quantity: a temperature is not
    below 0 K.
    """
    rounded = float(number)
    if rounded == 0.0:
        if re.search("[1-9]", re.split("[eE]", number)[0]):
            raise ValueError("too small for a floating-point number")
        return 0.0
    if math.isinf(rounded) or math.isinf(rounded * factor):
        raise ValueError("too large for a finite number")
    value = rounded
    if factor != 1.0:
        value = float(_EXACT_CONTEXT.multiply(Decimal(number), _exact_factor(factor)))
    if value == 0.0:
        raise ValueError("too small for a floating-point number")
    if kind == "temperature" and value < 0.0:
        raise ValueError("below 0 K")
    return value


@cache
def _exact_factor(factor: float) -> Decimal:
    """Return the decimal number that a unit factor such as 0.0254 is written as."""
    return Decimal(repr(factor))


@lru_cache(256)
def normalize_unit(unit: str) -> str:
    """Return a unit as spelled in UNIT_FACTORS: u for micro, ^ for powers, one blank in a product."""
    for sign, letter in (("µ", "u"), ("μ", "u"), ("²", "^2"), ("³", "^3"), ("·", " ")):
        unit = unit.replace(sign, letter)
    return " ".join(unit.split())


def _describe_non_text(value: TomlValue, kind: str) -> str:
    """Return the message about a value that is not a string where a `kind` of quantity is needed."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    reason = "a bare number without a unit" if is_number else "not a quantity"
    return f"{reason}; {describe_requirement(kind)}"


def _describe_malformed_text(words: str, kind: str) -> str:
    """Return the message about a text that does not consist of a number, a blank and a unit.

    `words` is the text, and `kind` is the kind of quantity that is needed.
    """
    displayed_text = (
        words if len(words) <= _MAX_SHOWN_CHARACTERS else f"{words[: _MAX_SHOWN_CHARACTERS - 3]}..."
    )

    # The first cause that fits is named.
    glued = _JOINED_UNIT_PATTERN.fullmatch(words)
    if re.fullmatch(NUMBER_PATTERN, words):
        reason = f"'{displayed_text}' is a bare number without a unit"
    elif any(sign in words for sign in ("±", "+/-", "+-")):
        reason = f"'{displayed_text}' has a tolerance: give only the nominal value"
    elif re.match(r"[+-]?[0-9]+,[0-9]+", words):
        reason = f"'{displayed_text}' has a comma: use a point as the decimal separator"
    elif "#" in words:
        reason = f"'{displayed_text}': '#' is ambiguous, write the name of the unit ({_list_units(kind)})"
    elif re.match(r"[+-]?(nan|inf)", words, re.IGNORECASE):
        reason = f"'{displayed_text}' is not a finite number"
    elif glued and normalize_unit(glued[2]) in UNIT_FACTORS[kind]:
        reason = f"'{displayed_text}' lacks the space between number and unit: write '{glued[1]} {glued[2]}'"
    else:
        reason = (
            f"'{displayed_text}' does not consist of one number and one unit ({_list_units(kind)})"
        )

    return f"{reason}; {describe_requirement(kind)}"


def _describe_wrong_unit(number: str, unit: str, kind: str) -> str:
    """Return the message about a unit, behind a `number`, that does not belong to this kind of quantity."""
    plain = normalize_unit(unit)
    advice = f"use one of {_list_units(kind)}, such as '{EXAMPLE_QUANTITIES[kind]}'"
    other_kinds = [other for other, units in UNIT_FACTORS.items() if plain in units]
    if "±" in unit or "+/-" in unit:
        return f"'{number} {unit}' has a tolerance: give only the nominal value; {describe_requirement(kind)}"
    if kind == "force" and plain in ("lb", "lbs", "#"):
        return f"'{unit}' is ambiguous for a force; did you mean 'lbf'? {advice}"
    if kind == "temperature" and plain.lstrip("°").removeprefix("deg") in ("C", "F"):
        return f"'{unit}' is refused, because temperatures must be absolute; write 20 degC as '293.15 K'"
    if other_kinds:
        units_of = f"'{unit}' is a unit of {' or '.join(other_kinds)}"
        return f"{units_of}, but {_add_article(kind)} is needed; {advice}"
    if plain.count("/") and " " in plain.split("/", 1)[1] and "(" not in plain:
        return f"'{unit}' is ambiguous: put the denominator in brackets; {advice}"
    return f"unknown unit '{unit}' for {_add_article(kind)}; {advice}"


def _add_article(kind: str) -> str:
    """Return the name of a kind of quantity with "a" or "an" before it."""
    return ("an " if kind[0] in "aeiou" else "a ") + kind


def _list_units(kind: str) -> str:
    """Return the units of a kind of quantity as text for a message."""
    return ", ".join(UNIT_FACTORS[kind])
