"""Header of a text file: names and units of columns, or size and units of a matrix.

A line above the first row of numbers is a comment (#, % or //) or text. A line that names columns with
their units ends the header. Otherwise names and units may stand in lines of their own, and lines such as
`# Width: 12.34 um` or `pixel size = 0.5 um` describe a matrix of heights.
"""

import re
from collections.abc import Iterator
from itertools import chain
from typing import NamedTuple

from ...core import PatchfemError
from ...inputs.cells import NUMBER_PATTERN
from .spellings import (
    FACTS,
    GERMAN,
    HEADER_EXAMPLE,
    MISSING,
    NO_UNIT,
    ROLES,
    parse_length_unit,
    shorten,
)

MAX_LINE = 1000  # largest number of characters in a line that is no row of a matrix
MAX_LINES = 500  # largest number of lines in a header; instruments write fewer than 200
MAX_NAME = 80  # largest number of characters in the name of a column with its unit
MAX_COLUMNS = 4  # largest number of columns: x, y, z, and one with row numbers or flags of validity
DELIMITERS = (";", ",", "\t", "|")
COMMENT = ("#", "%", "//")
DECIMAL_COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
_COLUMN = re.compile(r"(\w[\w .-]*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|[_/]\s*(\w+)|\s+in\s+(\w+))")
_CELL = re.compile(r"[^\s\[\](]+\s*(?:\[[^\]]*\]|\([^)]*\))|[^\W\d_]+\s+in\s+[^\W\d_]+|\S+")
_VALUE = re.compile(
    r"\s*([+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?(?![0-9.,]))?\s*[\[(]?\s*([^\W\d_]*)"
)
# Number such as 1,234, which is ambiguous unless the words of the header are German.
_THOUSANDS = re.compile("[1-9][0-9]{0,2},[0-9]{3}")


class Line(NamedTuple):
    """Line of a header without its comment sign."""

    number: int
    text: str
    is_comment: bool


class Cells(NamedTuple):
    """Cells of a line, and the delimiter that separates them; None: blanks."""

    cells: list[str]
    delimiter: str | None


class Column(NamedTuple):
    """Role of a column ("x", "y", "z", "index", "valid", or an unknown name) and its unit."""

    role: str
    unit: str | None


class Fact(NamedTuple):
    """Statement of a header on a matrix: a number or None, with its unit or word."""

    number: float | None = None
    word: str = ""


class Header(NamedTuple):
    """Lines of a text file above its numbers.

    names: cells of the line that names the columns; units: of a line of units; row: cells of the first row
    of numbers, [] if a line of names with units ended the header; delimiter: of this line; number: of the
    line of names, or of the first row.
    """

    lines: list[Line]
    names: list[str]
    units: list[str]
    row: list[str]
    delimiter: str | None
    number: int


def read_header(path, lines: Iterator[tuple[int, str]]) -> tuple[Header, Iterator[tuple[int, str]]]:
    """Read the lines above the numbers; returns the header, and the lines from the first row of numbers on.

    Raises PatchfemError if no row of numbers follows.
    """
    header_lines = []
    number = 0
    for number, raw_line in lines:
        line = raw_line.strip()
        is_comment = line.startswith(COMMENT)
        text = line[:MAX_LINE].lstrip("#%/").strip() if is_comment else line
        names = _find_names_with_units(text, is_comment=is_comment)
        if names:
            delimiter = split_cells(text).delimiter
            return Header(header_lines, names, [], [], delimiter, number), lines
        if not is_comment and line.strip(" \t,;|"):
            row, delimiter = split_cells(line)
            is_row = row[0] and all(is_number(cell, delimiter) for cell in row)
            if is_row and any(map(str.isdigit, line)):
                names_line, units = _find_separate_names(header_lines, row, delimiter)
                names = split_cells(names_line.text).cells if names_line else []
                start = names_line.number if names_line else number
                header = Header(header_lines, names, units, row, delimiter, start)
                return header, chain([(number, raw_line)], lines)
        if len(line) > MAX_LINE and not is_comment:
            raise PatchfemError(
                f"{path}:{number}: a line is {len(line)} characters long; two columns are needed, "
                f"{HEADER_EXAMPLE}"
            )
        if text:
            header_lines.append(Line(number, text, is_comment))
        if number == MAX_LINES:
            break
    if all(line.is_comment for line in header_lines):
        raise PatchfemError(f"{path}: no data, only comments")
    raise PatchfemError(
        f"{path}: no row of numbers in the first {number} lines; {HEADER_EXAMPLE} above rows of two "
        "numbers"
    )


def _find_names_with_units(text: str, *, is_comment: bool) -> list[str]:
    """Return the cells of a line that names columns with units, or [] for another line.

    Further words after the last column of a comment are left out.
    """
    cells = split_cells(text).cells if len(text) <= MAX_LINE else []
    if is_comment and len(cells) > 1:
        last = next((k for k, cell in enumerate(cells) if parse_column(cell).unit is None), 0)
        match = _COLUMN.match(cells[last][:MAX_NAME])
        if last and match and cells[last][match.end() :][:1].isspace():
            cells = [*cells[:last], match[0]]
    columns = [parse_column(cell) for cell in cells]
    with_units = [column.role for column in columns if column.unit is not None]
    others = {column.role for column in columns} - set(with_units)
    if not 1 < len(with_units) < MAX_COLUMNS or not others <= {"index", "valid"}:
        return []
    if len(cells) > MAX_COLUMNS or (is_comment and set(with_units).isdisjoint("xyz")):
        return []
    return cells


def _find_separate_names(
    lines: list[Line], row: list[str], delimiter: str | None
) -> tuple[Line | None, list[str]]:
    """Find the line that names the columns without units, and the cells of a line of units."""
    names_line = None
    units = []
    for line in lines:
        cells, line_delimiter = split_cells(line.text)
        if len(cells) != len(row):
            continue
        others = [cell for cell in cells if parse_length_unit(cell) is None]
        is_text = not line.is_comment and line_delimiter == delimiter
        if len(others) < len(cells) and all(cell in NO_UNIT for cell in others):
            units = cells
        elif has_column_names(cells) or (is_text and not re.search(r"[:=：]", line.text)):
            names_line = line
    return names_line, units


def has_column_names(cells: list[str]) -> bool:
    """Return whether cells of a line name the columns of a trace or a scan."""
    return len({parse_column(cell).role for cell in cells} & {"x", "y", "z", "index"}) > 1


def parse_column(cell: str) -> Column:
    """Parse the heading of a column with its unit, such as `x [um]`, `height (nm)` or `x in mm`."""
    match = _COLUMN.fullmatch(cell) if len(cell) <= MAX_NAME else None
    name = (match[1] if match else cell).strip(" _").lower()
    unit = (
        next((part.strip() for part in match.groups()[1:] if part is not None), None)
        if match
        else None
    )
    return Column(ROLES.get(name, name), unit)


def read_facts(path, header: Header) -> dict[str, Fact]:
    """Return what a header states about a matrix of heights, such as its pixel size.

    Raises PatchfemError for 1,234, which may be a thousand or one, if no row has a decimal comma.
    """
    facts = {}
    has_comma = any("," in cell for cell in header.row)
    for line in header.lines:
        for name, pattern in FACTS.items():
            match = pattern.search(line.text)
            if name in facts or not match:
                continue
            number, word = _VALUE.match(match["value"]).groups()
            is_ambiguous = _THOUSANDS.fullmatch(number or "") and not has_comma
            if is_ambiguous and not GERMAN.search(match[0]):
                raise PatchfemError(
                    f"{path}:{line.number}: '{shorten(line.text)}': the comma in {number} may be a decimal "
                    "comma or a thousands separator; write a decimal point, or leave out the comma"
                )
            value = float(number.replace(",", ".")) if number else None
            facts[name] = Fact(value, match["unit"] or word)
    return facts


def split_cells(text: str) -> Cells:
    """Split a line at the delimiter that leaves only numbers, or at the first delimiter if there is none.

    So a decimal comma is not taken for a delimiter.
    """
    for delimiter in (*DELIMITERS, None):
        cells = strip_cells(text.split(delimiter))
        if len(cells) > 1 and all(is_number(cell, delimiter) for cell in cells):
            return Cells(cells, delimiter)
    delimiter = next((sign for sign in DELIMITERS if sign in text), None)
    parts = text.split(delimiter) if delimiter else _CELL.findall(text)
    return Cells(strip_cells(parts), delimiter)


def strip_cells(cells: list[str]) -> list[str]:
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
