"""Header of a text file: names and units of columns, or size and units of a matrix.

A line above the first row of numbers is a comment (#, % or //) or text. A line that names x and z
with their units ends the head. Otherwise names and units may stand in lines of their own, and `#
Width: 12.34 um` or `pixel size = 0.5 um` describe a matrix of heights, as Gwyddion, SPIP, Attocube
and Nova write them, in English or in German.
"""

import re
from typing import NamedTuple

from ...core import PatchfemError
from ...inputs.cells import NUMBER_PATTERN
from .raw import shorten
from .units import parse_length_unit

# Largest number of characters in a line; a longer one cannot be a row of two to four columns.
MAX_LINE = 1000
MAX_LINES = 500  # largest number of lines in a head; instruments write fewer than 200
MAX_NAME = 80  # largest number of characters in the name of a column with its unit
MAX_COLUMNS = 4  # largest number of columns: x, y, z, and one with row numbers or flags of validity
HEADER_EXAMPLE = "write the header as `x [um],z [um]`"
DELIMITERS = (";", ",", "\t", "|")
COMMENT = ("#", "%", "//")
DECIMAL_COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
MISSING = re.compile(r"(?:[+-]?nan|\*+|bad)?", re.IGNORECASE)
NAMES = {
    "x": "x, x axis, x-achse, distance, position, lateral, lateral position, abstand, weg, strecke, position x",
    "y": "y, y axis, y-achse, position y",
    "z": "z, z axis, z-achse, height, heights, höhe, hoehe, profile, profil",
    "index": "index, no, no., nr, nr., number, nummer, sample, point, punkt, #",
    "valid": "valid, gültig",
}
ROLES = {name: role for role, names in NAMES.items() for name in names.split(", ")}
# Cells that stand for a column without a unit in a line of units.
NO_UNIT = ("", "-", "[-]", "1", "[1/0]")
_COLUMN = re.compile(r"(\w[\w .-]*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|[_/]\s*(\w+)|\s+in\s+(\w+))")
_CELL = re.compile(r"[^\s\[\](]+\s*(?:\[[^\]]*\]|\([^)]*\))|[^\W\d_]+\s+in\s+[^\W\d_]+|\S+")
_NUMERIC = re.compile(r"(?=[^0-9]*[0-9])[0-9+\-.,;|eE \t*naNbdBAD]+")
_VALUE = re.compile(
    r"\s*([+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?(?![0-9.,]))?\s*[\[(]?\s*([^\W\d_]*)"
)
_KEYS = {  # facts about a matrix, and the words for each of them before a colon or an equals sign
    "width": "width|breite|x[- ]length|x[- ]länge",
    "height": "height|höhe|y[- ]length|y[- ]länge",
    "columns": "x-pixels|nx|w",
    "rows": "y-pixels|ny|h",
    "step_x": "pixel[ _]size(?: x)?|pixelgröße(?: x)?|scale x|x[- ]step|step x|x[- ]spacing|spacing x|x-schrittweite",
    "step_y": "pixel[ _]size y|pixelgröße y|scale y|y[- ]step|step y|y[- ]spacing|spacing y|y-schrittweite",
    "lateral": "lateral units?|laterale einheit(?:en)?|x[- ]unit|unit x|x-einheit",
    "unit_y": "y[- ]unit|unit y|y-einheit",
    "value": "value units?|einheiten|wert-?einheit(?:en)?|z[- ]unit|unit (?:z|data)|z-einheit",
    "bit2nm": "bit2nm",
    "format": "file format",
    "scale": "scale data",
    "scaled": "datascaleneeded",
    "factor": r"height\s+conversion\s+factor",
}
_FACTS = {
    name: re.compile(
        rf"(?<![\w-])(?:{words})\s*(?:\(->\s*(?P<unit>\w+)\s*\))?\s*[:=：](?P<value>.*)",
        re.IGNORECASE,
    )
    for name, words in _KEYS.items()
}
# Number such as 1,234, which is ambiguous unless the words of the head are German.
_THOUSANDS = re.compile("[1-9][0-9]{0,2},[0-9]{3}")
_GERMAN = re.compile("breite|höhe|länge|größe|schritt", re.IGNORECASE)


class Line(NamedTuple):
    """Line in the header of a text file, with its comment sign removed."""

    number: int
    text: str
    is_comment: bool


class Cells(NamedTuple):
    """Cells in a line of a text file, with the delimiter that separates them."""

    cells: list
    delimiter: str | None


class Fact(NamedTuple):
    """Statement in a file header: a number or None, with its unit or word."""

    number: float | None = None
    word: str = ""


class Column(NamedTuple):
    """Role of a column in a text file ("x", "y", "z", ...) and its unit."""

    role: str
    unit: str | None


class ColumnNames(NamedTuple):
    """Names and units of the columns in a text file, with the line that states them."""

    number: int
    names: list
    units: list


class Head(NamedTuple):
    """Header of a text file, which consists of the lines above its numbers.

    lines: of `Line`; names: cells of the line that names x and z with their units, [] without such
    a line; row: cells of the first row of numbers, [] with one; delimiter: of either; number: lines
    above the rows; start: place of the rows in the text.
    """

    lines: list
    names: list
    row: list
    delimiter: str | None
    number: int
    start: int

    def column_names(self) -> ColumnNames:
        """Find the names of the columns, and their units if these are in a separate line."""
        if self.names:
            return ColumnNames(self.number, self.names, [])
        column_names = ColumnNames(0, [], [])
        for line in self.lines:
            cells, delimiter = split_cells(line.text)
            if len(cells) != len(self.row):
                continue
            is_unit = [parse_length_unit(cell) is not None for cell in cells]
            if any(is_unit) and all(
                cell in NO_UNIT for cell, known in zip(cells, is_unit) if not known
            ):
                column_names = column_names._replace(units=cells)
            elif has_column_names(cells) or not (
                line.is_comment or delimiter != self.delimiter or re.search(r"[:=：]", line.text)
            ):
                column_names = column_names._replace(number=line.number, names=cells)
        return column_names

    def facts(self, path) -> dict:
        """Return what the header states about a matrix of heights, such as its pixel size.

        Raises PatchfemError for 1,234, which may be a thousand or one, if no row has a decimal
        comma.
        """
        facts = {}
        has_comma = any("," in cell for cell in self.row)
        for line in self.lines:
            for name, pattern in _FACTS.items():
                match = pattern.search(line.text)
                if name in facts or not match:
                    continue
                number, word = _VALUE.match(match["value"]).groups()
                if (
                    _THOUSANDS.fullmatch(number or "")
                    and not has_comma
                    and not _GERMAN.search(match[0])
                ):
                    raise PatchfemError(
                        f"{path}:{line.number}: '{shorten(line.text)}': the comma in {number} may "
                        "be a decimal comma or a thousands separator; write a decimal point, or "
                        "leave out the comma"
                    )
                value = float(number.replace(",", ".")) if number else None
                facts[name] = Fact(value, match["unit"] or word)
        return facts


def read_head(path, text: str) -> Head:
    """Read the header of a text file; raise PatchfemError if no row of numbers follows it."""
    start = 0
    number = 0
    lines = []
    while start < len(text) and number < MAX_LINES:
        stop = text.find("\n", start)
        stop = len(text) if stop < 0 else stop
        line = text[start:stop].strip()
        number += 1
        is_comment = line.startswith(COMMENT)
        if len(line) > MAX_LINE and not is_comment and not _NUMERIC.fullmatch(line):
            raise PatchfemError(
                f"{path}:{number}: a line is {len(line)} characters long; two columns are needed, "
                f"{HEADER_EXAMPLE}"
            )
        plain = line[:MAX_LINE].lstrip("#%/").strip() if is_comment else line
        if len(plain) <= MAX_LINE:
            names = _find_names_with_units(plain, is_comment=is_comment)
            if names:
                return Head(lines, names, [], split_cells(plain).delimiter, number, stop + 1)
        if not is_comment and line.strip(" \t,;|"):
            cells, delimiter = split_cells(line)
            is_row = cells[0] and all(is_number(cell, delimiter) for cell in cells)
            if is_row and any(map(str.isdigit, line)):
                return Head(lines, [], cells, delimiter, number - 1, start)
        if plain:
            lines.append(Line(number, plain, is_comment))
        start = stop + 1
    if all(line.is_comment for line in lines):
        raise PatchfemError(f"{path}: no data, only comments")
    raise PatchfemError(
        f"{path}: no row of numbers in the first {number} lines; {HEADER_EXAMPLE} above rows of two "
        "numbers"
    )


def has_column_names(cells: list) -> bool:
    """Return whether cells of a line name the columns of a trace or a scan."""
    return len({parse_column(cell).role for cell in cells} & {"x", "y", "z", "index"}) > 1


def _find_names_with_units(line: str, *, is_comment: bool) -> list:
    """Return the cells of a line that names columns x and z with units, or [] for another line.

    Further words after the last column of a comment are left out.
    """
    cells = split_cells(line).cells
    if is_comment and len(cells) > 1:
        last = next(
            (k for k, cell in enumerate(cells) if k and parse_column(cell).unit is None), None
        )
        match = None if last is None else _COLUMN.match(cells[last][:MAX_NAME])
        if match and cells[last][match.end() :][:1].isspace():
            cells = [*cells[:last], match[0]]
    columns = [parse_column(cell) for cell in cells]
    with_units = {column.role for column in columns if column.unit is not None}
    count = sum(column.unit is not None for column in columns)
    if not 1 < count < 4 or len(cells) > MAX_COLUMNS:
        return []
    if any(column.unit is None and column.role not in ("index", "valid") for column in columns):
        return []
    return [] if is_comment and with_units.isdisjoint("xyz") else cells


def parse_column(cell: str) -> Column:
    """Parse the heading of a column with its unit, such as `x [um]`, `height (nm)` or `x in mm`."""
    match = _COLUMN.fullmatch(cell) if len(cell) <= MAX_NAME else None
    if match is None:
        name = cell.strip().lower()
        return Column(ROLES.get(name, name), None)
    name = match[1].strip().lower()
    unit = next((part.strip() for part in match.groups()[1:] if part is not None), None)
    return Column(ROLES.get(name, name), unit)


def split_cells(text: str) -> Cells:
    """Split a line at the delimiter that leaves only numbers, or at the first delimiter if there is none.

    So a decimal comma is not taken for a delimiter.
    """
    for delimiter in (*DELIMITERS, None):
        cells = strip_cells(text.split(delimiter))
        if len(cells) > 1 and all(is_number(cell, delimiter) for cell in cells):
            return Cells(cells, delimiter)
    delimiter = next((sign for sign in DELIMITERS if sign in text), None)
    return Cells(
        strip_cells(text.split(delimiter) if delimiter else _CELL.findall(text)), delimiter
    )


def strip_cells(cells: list) -> list:
    """Strip blanks around cells and remove empty cells at the end."""
    cells = [cell.strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def is_number(cell: str, delimiter: str | None) -> bool:
    """Return whether a cell of a text file is a number or a missing height."""
    if NUMBER_PATTERN.fullmatch(cell) or MISSING.fullmatch(cell):
        return True
    return delimiter != "," and DECIMAL_COMMA.fullmatch(cell) is not None
