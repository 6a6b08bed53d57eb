"""Units of length as files, instruments and users write them."""

import math

UNITS = {
    "m": 1.0,
    "km": 1e3,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "nm": 1e-9,
    "in": 0.0254,
    "ft": 0.3048,
    "mil": 25.4e-6,
}
SYNONYMS = {
    "pm": 1e-12,
    "å": 1e-10,
    "angstrom": 1e-10,
    "ångström": 1e-10,
    "mils": 25.4e-6,
    "inch": 0.0254,
    "inches": 0.0254,
    "micron": 1e-6,
    "microns": 1e-6,
    "mikron": 1e-6,
}
PREFIXES = {"": 1.0, "milli": 1e-3, "micro": 1e-6, "mikro": 1e-6, "nano": 1e-9}
METRE_NAMES = ("meter", "meters", "metre", "metres")
SYNONYMS |= {prefix + metre: factor for prefix, factor in PREFIXES.items() for metre in METRE_NAMES}
UNIT_LIST = ", ".join(UNITS)
GIVE_UNITS = 'state the units of x and z by --units "mm,um" (in Python, by units=("mm", "um"))'
GIVE_PIXEL_SIZE = 'give the pixel size in place of the unit of x, as in --units "0.8 um,um"'
UNITS_IGNORED = "the file states its own units; the units that you gave are ignored"


def parse_length_unit(word: str) -> float | None:
    """Return the factor to metres of a unit such as um, µm, [mm] or Mikrometer, or None for other text."""
    word = word.strip().strip("[]()").strip().replace("µ", "u").replace("μ", "u")
    return UNITS.get(word) or SYNONYMS.get(word.lower())


def parse_pixel_size(word: str) -> float | None:
    """Return the pixel size [m] from a text such as 0.8 um, or None for any other text."""
    number, _, unit = word.strip().partition(" ")
    try:
        size = float(number) * (parse_length_unit(unit) or math.nan)
    except ValueError:
        return None
    return size if 0 < size < math.inf else None
