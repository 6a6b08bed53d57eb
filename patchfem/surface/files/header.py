"""Header of a text file: names and units of columns, or size and units of a matrix.

A line above the first row of numbers is a comment (#, % or //) or text. A line that names columns with their units ends
the header; names and units may also stand in a line each. The lines `# Width: 12.34 um`, `# Height: 8 um` and
`# Value units: nm`, as Gwyddion writes them, describe a matrix of heights, and `# Lateral units: um` points.
"""

import re
from collections.abc import Iterator
from itertools import chain
from typing import NamedTuple

from ...core import PatchfemError
from ...inputs.cells import NUMBER_PATTERN
from .spellings import HEADER_EXAMPLE, MISSING, NO_UNIT, ROLES, parse_length_unit, shorten

MAX_LINE = 1000  # largest number of characters in a line that is no row of a matrix
MAX_LINES = 500  # largest number of lines in a header; instruments write fewer than 200
MAX_NAME = 80  # largest number of characters in the name of a column with its unit
MAX_COLUMNS = 4  # largest number of columns: x, y, z, and one with row numbers
DELIMITERS = (";", ",", "\t", "|")
COMMENT = ("#", "%", "//")
DECIMAL_COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
_COLUMN = re.compile(r"(\w[\w .-]*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|[_/]\s*(\w+)|\s+in\s+(\w+))")
_CELL = re.compile(r"[^\s\[\](]+\s*(?:\[[^\]]*\]|\([^)]*\))|[^\W\d_]+\s+in\s+[^\W\d_]+|\S+")
_FACT = re.compile(r"(width|height|lateral units|value units)\s*:\s*(.*)", re.IGNORECASE)


class Column(NamedTuple):
    """Role of a column ("x", "y", "z", "index" or an unknown name), its unit and its name in the file."""

    role: str
    unit: str | None = None
    name: str = ""


class Header(NamedTuple):
    """What stands above the numbers of a text file.

    columns: those that a line names, [] without one; facts: what is said of a matrix or of points, such as {"width":
    "4 um"}; count: numbers in the first row, 0 if a line of names with units ended the header; delimiter: of this
    line; number: of the line of names, or of the first row.
    """

    columns: list[Column]
    facts: dict[str, str]
    count: int
    delimiter: str | None
    number: int


def read_header(path, lines: Iterator[tuple[int, str]]) -> tuple[Header, Iterator[tuple[int, str]]]:
    """Read the lines above the numbers; returns the header, and the lines from the first row of numbers on.

    Raises PatchfemError if no row of numbers follows.
    """
    named: dict[int, list[Column]] = {}
    facts = {}
    number = 0
    has_text = False
    for number, raw_line in lines:
        line = raw_line.strip()
        is_comment = line.startswith(COMMENT)
        text = line[:MAX_LINE].lstrip("#%/").strip() if is_comment else line
        fact = _FACT.fullmatch(text[:MAX_NAME])
        cells, delimiter = split_cells(line)
        is_row = any(map(str.isdigit, line)) and all(is_number(cell, delimiter) for cell in cells)
        if is_row and cells[0] and not is_comment:
            start, columns = _find_columns(named, len(cells))
            header = Header(columns, facts, len(cells), delimiter, start or number)
            return header, chain([(number, raw_line)], lines)
        if len(line) > MAX_LINE and not is_comment:
            raise PatchfemError(
                f"{path}:{number}: a line is {len(line)} characters long; two columns are needed, "
                f"{HEADER_EXAMPLE}"
            )
        if fact:
            facts[fact[1].lower()] = fact[2]
            continue

        cells, delimiter = split_cells(text)
        columns = [parse_column(cell) for cell in cells]
        if is_comment and columns and columns[-1].unit is None:
            # words may follow the last column
            match = _COLUMN.match(cells[-1][:MAX_NAME])
            columns[-1] = parse_column(match[0]) if match else columns[-1]
        n_units = sum(column.unit is not None for column in columns)
        if 1 < n_units and len(columns) <= MAX_COLUMNS:
            others = {column.role for column in columns if column.unit is None}
            is_known = not {column.role for column in columns}.isdisjoint("xyz")
            if others <= {"index"} and (is_known or not is_comment):
                return Header(columns, facts, 0, delimiter, number), lines
        if text:
            named[number] = columns
            has_text |= not is_comment
        if number == MAX_LINES:
            break
    if not has_text:
        raise PatchfemError(f"{path}: no data, only comments")
    raise PatchfemError(
        f"{path}: no row of numbers in the first {number} lines; {HEADER_EXAMPLE} above rows of two "
        "numbers"
    )


def _find_columns(named: dict[int, list[Column]], count: int) -> tuple[int, list[Column]]:
    """Return the line that names so many columns and the columns, whose units may stand in a line of their own."""
    start = 0
    names: list[Column] = []
    units: list[str | None] = [None] * count
    for number, columns in named.items():
        cells = [column.name for column in columns]
        factors = [parse_length_unit(cell) for cell in cells]
        is_unit = [cell in NO_UNIT or bool(factor) for cell, factor in zip(cells, factors)]
        if len(cells) != count:
            continue
        if any(factors) and all(is_unit):
            units = [cell if factor else None for cell, factor in zip(cells, factors)]
            continue
        is_named = len({column.role for column in columns} & {"x", "y", "z", "index"}) > 1
        is_plain = 1 < count < MAX_COLUMNS and not re.search("[:=]", " ".join(cells))
        if is_named or is_plain:
            start = number
            names = columns
    if not names and any(units) and 1 < count < MAX_COLUMNS:
        names = [Column(role) for role in ("x", "y", "z")[3 - count :]]
        names[0] = Column("x")
    units = [column.unit or unit for column, unit in zip(names, units)]
    return start, [column._replace(unit=unit) for column, unit in zip(names, units)]


def parse_column(cell: str) -> Column:
    """Parse the heading of a column with its unit, such as `x [um]`, `height (nm)` or `x in mm`."""
    match = _COLUMN.fullmatch(cell) if len(cell) <= MAX_NAME else None
    unit = None
    if match:
        unit = next(part.strip() for part in match.groups()[1:] if part is not None)
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
