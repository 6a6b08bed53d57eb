"""Header of a text file: names and units of columns, or size and units of a matrix.

What stands above the first row of numbers is the header. A line of names with their units ends it; names and units may
also stand in a line each. The lines `# Width: 12.34 um`, `# Height: 8 um` and `# Value units: nm`, as Gwyddion writes
them, describe a matrix of heights, `# Lateral units: um` points, and `Length,1500.0 um` a scan of Dektak.
"""

import re
from collections.abc import Iterator
from itertools import chain, islice
from typing import NamedTuple

from ...core import PatchfemError
from ...inputs.tables import NUMBER_PATTERN
from .units import COORDINATES_BY_COLUMN_NAME, HEADER_EXAMPLE, parse_length_unit

# Largest number of characters in the name of a column with its unit
MAX_COLUMN_NAME_CHARACTERS = 80
# Signs at the start of a line of the header that is a comment
COMMENT_SIGNS = ("#", "%", "//")
# Pattern of a number with a decimal comma, such as -1,25e-6
DECIMAL_COMMA_PATTERN = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
# Cells that stand for a height that was not measured: nan with or without a sign, stars such as ***, bad, and an empty
# cell. Capital letters do not matter.
MISSING_HEIGHT_PATTERN = re.compile(r"(?:[+-]?nan|\*+|bad)?", re.IGNORECASE)
# Name and unit of a column: x [um], x (um), x_um, x/um, x in um, x um; a remark may follow.
_COLUMN_PATTERN = re.compile(
    r"([^\W\d][\w .-]*?)\s*(?:[\[(]([^\[\]()]*)[\])]|(?:[_/]|\s(?:in\s)?)\s*(\w+)(?=\s\s|$))"
)
# Pattern of a cell between blanks, with its unit
_CELL_PATTERN = re.compile(r"[^\s\[\](]+\s*(?:\[[^\]]*\]|\([^)]*\))|[^\W\d_]+\s+in\s+[^\W\d_]+|\S+")
# Pattern of a line that states the size or the units of a matrix
_MATRIX_FACT_PATTERN = re.compile(
    r"(?:(width|height|lateral units|value units)\s*:|(length),(?=\s*[0-9.]+ \w+$))\s*(.*)",
    re.IGNORECASE,
)


class Column(NamedTuple):
    """Column of the table, as the header names it.

    - coordinate: "x", "y" or "z", "index" for row numbers, an unknown name in lower case, or "" for a unit without a name.
    - unit: unit as written, or None if the header gives none.
    - name: text of the header.
    """

    coordinate: str
    unit: str | None = None
    name: str = ""


class Header(NamedTuple):
    """What stands above the numbers of a text file.

    - columns: columns that a line names, or [] without such a line.
    - facts: what is said of a matrix or of points, such as {"width": "4 um"}.
    - count: number of values in the first row, or of columns that a line names with their units.
    - number: number of the line of names, or of the first row.
    """

    columns: list[Column]
    facts: dict[str, str]
    count: int
    number: int


def read_header(path, lines: Iterator[tuple[int, str]]) -> tuple[Header, Iterator[tuple[int, str]]]:
    """Read the lines above the numbers of a text file.

    Parameters
    ----------
    path
        File, for messages.
    lines : iterator of (int, str)
        Line numbers and lines of the file.

    Returns
    -------
    header : Header
    lines : iterator of (int, str)
        Lines from the first row of numbers on.

    Raises
    ------
    PatchfemError
        If no row of numbers follows.
    """
    named: dict[int, tuple[int, list[Column]]] = {}  # lines of names by their number of cells
    facts = {}
    number = 0
    # Largest number of lines in a header; instruments write fewer than 200
    for number, line in islice(lines, 500):
        is_comment = line.lstrip().startswith(COMMENT_SIGNS)
        text = line.strip(" \n\t#%/") if is_comment else line.strip()
        cells, delimiter = split_cells(text)
        is_row = any(map(str.isdigit, text)) and all(is_number(cell, delimiter) for cell in cells)

        # A row of numbers ends the header. Its columns are those of the last line of as many names.
        start, columns = named.get(len(cells), (number, []))
        if is_row and cells[0] and not is_comment:
            return Header(columns, facts, len(cells), start), chain([(number, line)], lines)
        fact = _MATRIX_FACT_PATTERN.fullmatch(text[:MAX_COLUMN_NAME_CHARACTERS])
        if fact:
            facts[(fact[1] or fact[2]).lower()] = fact[3]
            continue

        parsed = [_parse_column(cell) for cell in cells]
        if any(column.coordinate for column in parsed):
            is_other = any(re.search("[:=]", column.name) for column in parsed)
            # Largest number of columns: x, y, z, and one with row numbers
            if not 1 < len(parsed) <= 4 or is_other:
                continue
            start = number
            columns = parsed
        else:
            # A line of units belongs to the names above it, or to x, (y,) z.
            columns = columns or list(map(Column, {2: "xz", 3: "xyz"}.get(len(parsed), "")))
            columns = [
                column._replace(unit=column.unit or unit.unit)
                for column, unit in zip(columns, parsed)
            ]
        named[len(cells)] = (start, columns)
        # Names of a comment count if one of them is known.
        is_known = not is_comment or any(column.coordinate in ("x", "y", "z") for column in columns)
        units = [column.unit for column in columns if column.coordinate != "index"]
        if is_known and len(units) > 1 and None not in units:
            return Header(columns, facts, len(cells), start), lines
    raise PatchfemError(
        f"{path}: no row of numbers in the first {number} lines; {HEADER_EXAMPLE} above rows of two "
        "numbers"
    )


def _parse_column(cell: str) -> Column:
    """Parse the cell with the heading of a column, such as `x [um]` or `x in mm`, or a unit alone.

    A word without brackets is a unit only behind a known name; `Length 5 mm` is a setting.
    """
    if cell in ("", "-", "[-]", "1") or parse_length_unit(cell):
        return Column("", cell if parse_length_unit(cell) else None, cell)
    match = _COLUMN_PATTERN.match(cell[:MAX_COLUMN_NAME_CHARACTERS])
    name, unit, word = match.groups() if match else (cell, None, None)
    coordinate = name.strip(" _").lower()
    if word is not None and coordinate in COORDINATES_BY_COLUMN_NAME and parse_length_unit(word):
        unit = word
    elif word is not None:
        coordinate = cell.lower()
    return Column(COORDINATES_BY_COLUMN_NAME.get(coordinate, coordinate), unit, cell)


def parse_fact(text: str) -> tuple[float | None, str | None]:
    """Return number and unit in the text of a fact such as `4.0 um`, or None for what is missing."""
    number, _, unit = text.strip().partition(" ")
    if not NUMBER_PATTERN.fullmatch(number):
        return None, text.strip() or None
    return float(number), unit.strip() or None


def split_cells(text: str) -> tuple[list[str], str | None]:
    """Split the text of a line into cells, and return these and the delimiter, which is None for blanks.

    It is the delimiter that leaves only numbers, or else the first one. So a decimal comma is not taken for a delimiter.
    """
    delimiters = (";", ",", "\t", "|", None)
    for delimiter in delimiters:
        cells = _strip_cells(text.split(delimiter))
        if len(cells) > 1 and all(is_number(cell, delimiter) for cell in cells):
            return cells, delimiter
    delimiter = next((sign for sign in delimiters[:-1] if sign in text), None)
    # Largest number of characters of a line in which names of columns are sought
    line = text[:1000]
    cells = text.split(delimiter) if delimiter else _CELL_PATTERN.findall(line)
    return _strip_cells(cells), delimiter


def _strip_cells(cells: list[str]) -> list[str]:
    """Strip blanks around cells and remove empty cells at the end."""
    cells = [cell.strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def is_number(cell: str, delimiter: str | None) -> bool:
    """Return whether a cell of a text file is a number or a missing height.

    A decimal comma is possible unless the delimiter is a comma.
    """
    if NUMBER_PATTERN.fullmatch(cell) or MISSING_HEIGHT_PATTERN.fullmatch(cell):
        return True
    return delimiter != "," and DECIMAL_COMMA_PATTERN.fullmatch(cell) is not None
