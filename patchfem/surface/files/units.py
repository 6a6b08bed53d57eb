"""Units of length and names of columns, as instruments and users write them."""

from ...inputs.units import UNIT_FACTORS, normalize_unit

LENGTH_UNITS = UNIT_FACTORS["length"]
LENGTH_UNIT_LIST = ", ".join(LENGTH_UNITS)
# Longer words for units of length, in lower case.
LENGTH_UNIT_WORDS = {
    **dict.fromkeys(("a", "å", "angstrom", "ångström"), 1e-10),
    **dict.fromkeys(("inch", "inches"), 0.0254),
    **dict.fromkeys(("micron", "microns", "mikron"), 1e-6),
    "mils": 25.4e-6,
    "pm": 1e-12,
    **{
        f"{prefix}met{ending}": factor
        for prefix, factor in (
            ("", 1.0),
            ("milli", 1e-3),
            ("micro", 1e-6),
            ("mikro", 1e-6),
            ("nano", 1e-9),
        )
        for ending in ("er", "re", "ers", "res")
    },
}
# Names of the columns of a table.
_COLUMN_NAMES = {
    "x": "x, x axis, x-achse, distance, position, lateral, lateral position, abstand, weg, strecke, position x",
    "y": "y, y axis, y-achse, position y",
    "z": "z, z axis, z-achse, height, heights, höhe, hoehe, profile, profil, raw",
    "index": "index, no, no., nr, nr., number, nummer, sample, point, punkt, #",
}
COORDINATES_BY_COLUMN_NAME = {
    name: coordinate for coordinate, names in _COLUMN_NAMES.items() for name in names.split(", ")
}

MISSING_UNITS_REMEDY = (
    'state the units of x and z by --units "mm,um" (in Python, by units=("mm", "um"))'
)
HEADER_EXAMPLE = "write the header as `x [um],z [um]`"
MISSING_SIZE_REMEDY = (
    "write `# Width: 1.2 mm` and `# Height: 0.8 mm` and `# Value units: um` above its rows"
)


def parse_length_unit(word: str) -> float | None:
    """Return the factor to metres of a word such as um, µm, [mm] or Mikrometer, or None for others."""
    word = normalize_unit(word.strip("[]() "))
    return LENGTH_UNITS.get(word) or LENGTH_UNIT_WORDS.get(word.lower())
