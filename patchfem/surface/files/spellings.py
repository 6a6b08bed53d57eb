"""Units and names of columns, as files and users write them."""

import math
import re

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
UNIT_LIST = ", ".join(UNITS)
# Longer words for units of length, in lower case.
UNIT_WORDS = {
    **dict.fromkeys(("a", "å", "angstrom", "ångström"), 1e-10),
    **dict.fromkeys(("inch", "inches"), 0.0254),
    **dict.fromkeys(("micron", "microns", "mikron"), 1e-6),
    "mils": 25.4e-6,
    "pm": 1e-12,
}
_METRE = re.compile("(|milli|micro|mikro|nano)met(?:er|re)s?")
_PREFIXES = {"": 1.0, "milli": 1e-3, "micro": 1e-6, "mikro": 1e-6, "nano": 1e-9}

# Names of the columns of a table.
_COLUMN_NAMES = {
    "x": "x, x axis, x-achse, distance, position, lateral, lateral position, abstand, weg, strecke, position x",
    "y": "y, y axis, y-achse, position y",
    "z": "z, z axis, z-achse, height, heights, höhe, hoehe, profile, profil, raw",
    "index": "index, no, no., nr, nr., number, nummer, sample, point, punkt, #",
}
ROLES = {name: role for role, names in _COLUMN_NAMES.items() for name in names.split(", ")}
# Cells that stand for a column without a unit in a line of units.
NO_UNIT = ("", "-", "[-]", "1")
MISSING = re.compile(r"(?:[+-]?nan|\*+|bad)?", re.IGNORECASE)  # height that was not measured

GIVE_UNITS = 'state the units of x and z by --units "mm,um" (in Python, by units=("mm", "um"))'
GIVE_PIXEL_SIZE = 'give the pixel size in place of the unit of x, as in --units "0.8 um,um"'
HEADER_EXAMPLE = "write the header as `x [um],z [um]`"
SCAN_HEADER_EXAMPLE = "write the header as `x [um],y [um],z [um]`"
SIZE_LINES = "`# Width: 1.2 mm` and `# Height: 0.8 mm`"


def parse_length_unit(word: str) -> float | None:
    """Return the factor to metres of a unit such as um, µm, [mm] or Mikrometer, or None for other text."""
    word = word.strip().strip("[]()").strip().replace("µ", "u").replace("μ", "u")
    metre = _METRE.fullmatch(word.lower())
    if metre:
        return _PREFIXES[metre[1]]
    return UNITS.get(word) or UNIT_WORDS.get(word.lower())


def parse_pixel_size(word: str) -> float | None:
    """Return the pixel size [m] from a text such as 0.8 um, or None for any other text."""
    number, _, unit = word.strip().partition(" ")
    try:
        size = float(number) * (parse_length_unit(unit) or math.nan)
    except ValueError:
        return None
    return size if 0 < size < math.inf else None


def shorten(text, length: int = 40) -> str:
    """Make a text from a file, or the message of a library, printable and at most 40 characters long."""
    text = " ".join(str(text).split())
    if not text.isprintable():
        text = text.encode("unicode_escape").decode()
    return text if len(text) <= length else f"{text[: length - 3]}..."
