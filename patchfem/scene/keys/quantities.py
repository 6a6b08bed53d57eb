"""Conversion of quantities ``"<number> <unit>"`` in a scene to SI and back; units are never guessed.

The kind of a quantity follows from the key, so `g` is standard gravity in an acceleration and a gram in a mass.
"""

from __future__ import annotations

import math
import re
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal
from functools import cache, lru_cache

_POUND_FORCE = 4.4482216152605  # one pound-force in N, exact: 0.45359237 kg times standard gravity

# Factors to SI by unit for each kind of quantity; the first unit of each kind is its SI unit.
UNIT_FACTORS: dict[str, dict[str, float]] = {
    "length": {
        "m": 1.0,
        "km": 1e3,
        "cm": 1e-2,
        "mm": 1e-3,
        "um": 1e-6,
        "nm": 1e-9,
        "in": 0.0254,
        "ft": 0.3048,
        "mil": 25.4e-6,
    },
    "area": {"m^2": 1.0, "cm^2": 1e-4, "mm^2": 1e-6, "um^2": 1e-12, "in^2": 6.4516e-4},
    "force": {"N": 1.0, "kN": 1e3, "lbf": _POUND_FORCE, "kgf": 9.80665},
    "moment": {
        "N m": 1.0,
        "N mm": 1e-3,
        "kN m": 1e3,
        "lbf in": 0.1129848290276167,
        "lbf ft": 1.3558179483314003,
    },
    "mass": {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "lb": 0.45359237},
    "density": {"kg/m^3": 1.0, "g/cm^3": 1e3, "lb/in^3": 27679.90471020312},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "acceleration": {
        "m/s^2": 1.0,
        "mm/s^2": 1e-3,
        "g": 9.80665,
        "in/s^2": 0.0254,
        "ft/s^2": 0.3048,
    },
    "acceleration spectrum": {"m^2/s^3": 1.0, "(m/s^2)^2/Hz": 1.0, "g^2/Hz": 9.80665**2},
    "velocity": {
        "m/s": 1.0,
        "cm/s": 1e-2,
        "mm/s": 1e-3,
        "um/s": 1e-6,
        "nm/s": 1e-9,
        "in/s": 0.0254,
    },
    "pressure": {
        "Pa": 1.0,
        "kPa": 1e3,
        "MPa": 1e6,
        "GPa": 1e9,
        "psi": 6894.757293168362,
        "ksi": 6894757.293168361,
        "Msi": 6894757293.168362,
    },
    "angle": {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": math.pi / 180.0},
    "temperature": {"K": 1.0},
    "stiffness": {
        "N/m": 1.0,
        "kN/m": 1e3,
        "MN/m": 1e6,
        "N/mm": 1e3,
        "kN/mm": 1e6,
        "N/um": 1e6,
        "lbf/in": 175.1268352464764,
    },
    "rotational stiffness": {
        "N m/rad": 1.0,
        "N mm/rad": 1e-3,
        "kN m/rad": 1e3,
        "lbf in/rad": 0.1129848290276167,
    },
    "foundation stiffness": {
        "Pa/m": 1.0,
        "MPa/m": 1e6,
        "GPa/m": 1e9,
        "MPa/mm": 1e9,
        "MPa/um": 1e12,
        "GPa/mm": 1e12,
    },
    "damping": {"N s/m": 1.0, "N s/mm": 1e3, "kN s/m": 1e3, "lbf s/in": 175.1268352464764},
    "cubic stiffness": {"N/m^3": 1.0, "kN/m^3": 1e3, "MN/m^3": 1e6, "N/mm^3": 1e9},
    "wear coefficient": {
        "m^2/N": 1.0,
        "mm^2/N": 1e-6,
        "mm^3/(N m)": 1e-9,
        "mm^3/Nm": 1e-9,
        "mm3/Nm": 1e-9,
        "mm^3/N/m": 1e-9,
        "1/Pa": 1.0,
        "1/MPa": 1e-6,
    },
    "sweep rate": {"Hz/s": 1.0, "Hz/min": 1.0 / 60.0, "kHz/s": 1e3},
    "logarithmic sweep rate": {
        "oct/s": 1.0,
        "oct/min": 1.0 / 60.0,
        "dec/min": math.log2(10.0) / 60.0,
    },
    "participation": {"rad/m": 1.0, "rad/mm": 1e3},
    "areal density": {"1/m^2": 1.0, "1/cm^2": 1e4, "1/mm^2": 1e6, "1/um^2": 1e12},
    "curvature": {"1/m": 1.0, "1/mm": 1e3, "1/um": 1e6},
}

# Example of each kind of quantity for messages and the schema.
EXAMPLE_QUANTITIES: dict[str, str] = {
    "length": "12.7 mm",
    "area": "161 mm^2",
    "force": "26 lbf",
    "moment": "0.05 N m",
    "mass": "0.884 kg",
    "density": "4370 kg/m^3",
    "time": "2 s",
    "frequency": "143 Hz",
    "acceleration": "5 g",
    "acceleration spectrum": "0.01 g^2/Hz",
    "velocity": "5 mm/s",
    "pressure": "121 GPa",
    "angle": "0.1 mrad",
    "temperature": "293.15 K",
    "stiffness": "5e6 N/m",
    "rotational stiffness": "1e4 N m/rad",
    "foundation stiffness": "1e13 Pa/m",
    "damping": "10 N s/m",
    "cubic stiffness": "1e12 N/m^3",
    "wear coefficient": "1e-14 m^2/N",
    "sweep rate": "0.5 Hz/s",
    "logarithmic sweep rate": "1 oct/min",
    "participation": "2 rad/m",
    "areal density": "1e10 1/m^2",
    "curvature": "0.05 1/um",
}

# Regular expression of a number.
NUMBER_PATTERN = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_QUANTITY_PATTERN = re.compile(rf"({NUMBER_PATTERN})[ \t]+(\S.*)")
PERCENTAGE_PATTERN = rf"\s*({NUMBER_PATTERN})[ \t]*%\s*"
_BARE_NUMBER_PATTERN = re.compile(NUMBER_PATTERN)
_JOINED_UNIT_PATTERN = re.compile(rf"({NUMBER_PATTERN})([^\s0-9.,#+±-].*)")
_DECIMAL_COMMA_PATTERN = re.compile(r"[+-]?[0-9]+,[0-9]+")
# Largest length of a quantity; a longer string is refused without being parsed.
_MAX_CHARACTERS = 100
_MAX_SHOWN_CHARACTERS = 60  # largest length of a wrong quantity in a message
# Decimal context that holds all digits of the product of a value and a factor.
_EXACT_CONTEXT = Context(prec=2 * _MAX_CHARACTERS, Emax=MAX_EMAX, Emin=MIN_EMIN)


def parse_quantity(text: object, kind: str) -> float:
    """Return the SI value of a quantity ``"<number> <unit>"``, correctly rounded.

    Raises ValueError, with the kind and an example, for a bare number, an unknown or ambiguous unit, a unit of another kind,
    anything but one number and one unit, and a value that is not finite.
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


def read_percentage(value: object) -> object:
    """Return a percentage such as "0.2 %" as a number, correctly rounded, and any other value unchanged."""
    is_short = isinstance(value, str) and len(value) <= _MAX_CHARACTERS
    match = re.fullmatch(PERCENTAGE_PATTERN, value) if is_short else None
    return _multiply(match[1], 0.01, "") if match else value


def split_quantity(text: str) -> tuple[str, str]:
    """Return number and unit, as written, of a quantity that `parse_quantity` accepts."""
    return _QUANTITY_PATTERN.fullmatch(text).groups()


def find_si_unit(kind: str | None) -> str:
    """Return the SI unit of a kind of quantity, or "1" for None, which stands for a number without unit."""
    return next(iter(UNIT_FACTORS[kind])) if kind else "1"


def format_si(value: float, kind: str) -> str:
    """Return a value with its SI unit, as ``"0.0127 m"``; `parse_quantity` gives back the same float."""
    return f"{float(value)!r} {find_si_unit(kind)}"


def describe_requirement(kind: str) -> str:
    """Return what a key with this kind of quantity requires, with an example, as the end of a message."""
    return f"{_add_article(kind)} with its unit is needed, such as '{EXAMPLE_QUANTITIES[kind]}'"


def _multiply(number: str, factor: float, kind: str) -> float:
    """Return number times factor; raise ValueError if the product is out of range."""
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
    return Decimal(repr(factor))


@lru_cache(256)
def normalize_unit(unit: str) -> str:
    """Return a unit as spelled in UNIT_FACTORS: u for micro, ^ for powers, one blank in a product."""
    for sign, letter in (("µ", "u"), ("μ", "u"), ("²", "^2"), ("³", "^3"), ("·", " ")):
        unit = unit.replace(sign, letter)
    return " ".join(unit.split())


def _describe_non_text(value: object, kind: str) -> str:
    """Return the message about a value that is not a string."""
    reason = "not a quantity"
    if isinstance(value, bool):
        reason = f"{str(value).lower()} is not a quantity"
    elif isinstance(value, int | float):
        reason = "a bare number without a unit"
    return f"{reason}; {describe_requirement(kind)}"


def _describe_malformed_text(words: str, kind: str) -> str:
    """Return the message about a string that does not consist of a number, a blank and a unit."""
    displayed_text = (
        words if len(words) <= _MAX_SHOWN_CHARACTERS else f"{words[: _MAX_SHOWN_CHARACTERS - 3]}..."
    )
    glued = _JOINED_UNIT_PATTERN.fullmatch(words)
    if _BARE_NUMBER_PATTERN.fullmatch(words):
        reason = f"'{displayed_text}' is a bare number without a unit"
    elif any(sign in words for sign in ("±", "+/-", "+-")):
        reason = f"'{displayed_text}' has a tolerance: give only the nominal value"
    elif _DECIMAL_COMMA_PATTERN.match(words):
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
    """Return the message about a unit that does not belong to this kind of quantity."""
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
    return ("an " if kind[0] in "aeiou" else "a ") + kind


def _list_units(kind: str) -> str:
    return ", ".join(UNIT_FACTORS[kind])
