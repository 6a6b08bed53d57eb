"""Header of a text file: names and units of columns, or size and units of a matrix.

What stands above the first row of numbers is the header. A line of names with their units ends it; names and units may
also stand in a line each. The lines `# Width: 12.34 um`, `# Height: 8 um` and `# Value units: nm`, as Gwyddion writes
them, describe a matrix of heights, `# Lateral units: um` points, and `Length,1500.0 um` a scan of Dektak.
"""

import re
from collections.abc import Iterator
from itertools import chain
from typing import NamedTuple

from ...core import PatchfemError
from ...inputs.tables import NUMBER_PATTERN
from .spellings import HEADER_EXAMPLE, MISSING, NO_UNIT, ROLES, parse_length_unit, shorten

MAX_LINE = 1000  # largest number of characters of a line in which names of columns are sought
MAX_LINES = 500  # largest number of lines in a header; instruments write fewer than 200
MAX_NAME = 80  # largest number of characters in the name of a column with its unit
MAX_COLUMNS = 4  # largest number of columns: x, y, z, and one with row numbers
DELIMITERS = (";", ",", "\t", "|")
COMMENT = ("#", "%", "//")
DECIMAL_COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
# Name and unit of a column: x [um], x (um), x_um, x/um, x in um, x um.
_COLUMN = re.compile(
    r"([^\W\d][\w .-]*?)(?:\s*\[([^\[\]]*)\]|\s*\(([^()]*)\)|\s*[_/]\s*(\w+)|\s+in\s+(\w+)|\s+(\w+))"
)
# Two blanks or more before a remark, behind a unit in brackets or not before one.
_REMARK = re.compile(r"(?<=[\])])\s{2,}|\s{2,}(?![\s\[(])")
_CELL = re.compile(r"[^\s\[\](]+\s*(?:\[[^\]]*\]|\([^)]*\))|[^\W\d_]+\s+in\s+[^\W\d_]+|\S+")
_FACT = re.compile(
    r"(?:(width|height|lateral units|value units)\s*:|(length),(?=\s*[0-9.]+ \w+$))\s*(.*)",
    re.IGNORECASE,
)


class Column(NamedTuple):
    """Role of a column ("x", "y", "z", "index", an unknown name, or "" of a unit alone), its unit and its text."""

    role: str
    unit: str | None = None
    name: str = ""


class Header(NamedTuple):
    """What stands above the numbers of a text file.

    columns: those that a line names, [] without one; facts: what is said of a matrix or of points, such as {"width":
    "4 um"}; count: numbers in the first row, or columns that a line names with their units; number: of the line of
    names, or of the first row.
    """

    columns: list[Column]
    facts: dict[str, str]
    count: int
    number: int


def read_header(path, lines: Iterator[tuple[int, str]]) -> tuple[Header, Iterator[tuple[int, str]]]:
    """Read the lines above the numbers; returns the header, and the lines from the first row of numbers on.

    Raises PatchfemError if no row of numbers follows.
    """
    named: dict[int, tuple[int, list[Column]]] = {}  # lines by their number of cells
    units: dict[int, list[Column]] = {}
    facts = {}
    number = 0
    for number, raw_line in lines:
        line = raw_line.strip()
        is_comment = line.startswith(COMMENT)
        text = line.lstrip("#%/").strip() if is_comment else line
        cells, delimiter = split_cells(text)
        count = len(cells)
        is_row = any(map(str.isdigit, text)) and all(is_number(cell, delimiter) for cell in cells)
        if is_row and cells[0] and not is_comment:
            start, columns = named.get(count, (number, []))
            columns = _join(columns or _name_columns(count, units), units.get(count))
            return Header(columns, facts, count, start), chain([(number, raw_line)], lines)
        fact = _FACT.fullmatch(text[:MAX_NAME])
        if fact:
            facts[(fact[1] or fact[2]).lower()] = fact[3]
            continue

        columns = [parse_column(cell) for cell in cells]
        if columns and not any(column.role for column in columns):
            units[count] = columns
        elif _are_names(columns):
            named[count] = (number, columns)
        start, columns = named.get(count, (number, []))
        columns = _join(columns, units.get(count))
        # Names of a comment count if one of them is known.
        is_known = not is_comment or any(column.role in ("x", "y", "z") for column in columns)
        if is_known and _have_units(columns):
            return Header(columns, facts, count, start), lines
        if number == MAX_LINES:
            break
    raise PatchfemError(
        f"{path}: no row of numbers in the first {number} lines; {HEADER_EXAMPLE} above rows of two "
        "numbers"
    )


def _are_names(columns: list[Column]) -> bool:
    """Return whether a line names columns: two of them are known, or it is a short line without signs of other text."""
    n_known = len({column.role for column in columns} & {"x", "y", "z", "index"})
    is_other = any(re.search("[:=]", column.name) for column in columns)
    return n_known > 1 or (1 < len(columns) <= MAX_COLUMNS and not is_other)


def _have_units(columns: list[Column]) -> bool:
    """Return whether at least two columns have units, and all others but row numbers."""
    with_unit = [column for column in columns if column.unit is not None]
    others = {column.role for column in columns if column.unit is None}
    return 1 < len(with_unit) and len(columns) <= MAX_COLUMNS and others <= {"index"}


def _name_columns(count: int, units: dict) -> list[Column]:
    """Return the columns of a file that states their units alone, [] without them."""
    roles = {2: "xz", 3: "xyz"}.get(count, "") if count in units else ""
    return [Column(role) for role in roles]


def _join(columns: list[Column], units: list[Column] | None) -> list[Column]:
    """Return columns with the units of a line of their own, where they have none."""
    if units is None:
        return columns
    return [
        column if column.unit is not None else column._replace(unit=unit.unit)
        for column, unit in zip(columns, units)
    ]


def parse_column(cell: str) -> Column:
    """Parse the heading of a column with its unit, such as `x [um]`, `height (nm)` or `x in mm`, or a unit alone.

    Words behind two blanks are a remark, unless they are a unit in brackets.
    """
    cell = _REMARK.split(cell, maxsplit=1)[0]
    if cell in NO_UNIT or parse_length_unit(cell):
        return Column("", None if cell in NO_UNIT else cell, cell)
    match = _COLUMN.fullmatch(cell) if len(cell) <= MAX_NAME else None
    if match and match[6] and not (match[1].lower() in ROLES and parse_length_unit(match[6])):
        match = None  # a second word is a unit only behind a known name; `Length 5 mm` is a setting
    parts = match.groups()[1:] if match else ()
    unit = next((part.strip() for part in parts if part is not None), None)
    name = (match[1] if match else cell).strip(" _").lower()
    return Column(ROLES.get(name, name), unit, cell)


def parse_fact(path, text: str) -> tuple[float | None, str | None]:
    """Return the number and the unit of a fact such as `4.0 um`; None for what is missing."""
    if "," in text:
        raise PatchfemError(
            f"{path}: '{shorten(text)}': the comma may be a decimal comma or a thousands separator; write a decimal "
            "point, or leave out the comma"
        )
    number, _, unit = text.strip().partition(" ")
    if not NUMBER_PATTERN.fullmatch(number):
        return None, text.strip() or None
    return float(number), unit.strip() or None


def split_cells(text: str) -> tuple[list[str], str | None]:
    """Split a line at the delimiter that leaves only numbers, or at the first delimiter; None: blanks.

    So a decimal comma is not taken for a delimiter.
    """
    for delimiter in (*DELIMITERS, None):
        cells = _strip_cells(text.split(delimiter))
        if len(cells) > 1 and all(is_number(cell, delimiter) for cell in cells):
            return cells, delimiter
    delimiter = next((sign for sign in DELIMITERS if sign in text), None)
    parts = text.split(delimiter) if delimiter else _CELL.findall(text[:MAX_LINE])
    return _strip_cells(parts), delimiter


def _strip_cells(cells: list[str]) -> list[str]:
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
