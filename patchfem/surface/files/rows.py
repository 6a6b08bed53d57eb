"""Rows of numbers in a text file."""

import re
from array import array
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...inputs.cells import NUMBER_PATTERN
from .header import COMMENT, MAX_COLUMNS, MAX_LINE, split_cells
from .spellings import MISSING, shorten

_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf)", re.IGNORECASE)


class Rows(NamedTuple):
    """Numbers (m, n) of a text file, with the line of each row."""

    numbers: np.ndarray
    lines: np.ndarray


def read_rows(
    path, lines: Iterator[tuple[int, str]], roles: list[str], delimiter: str | None
) -> Rows:
    """Read all rows of numbers of a text file.

    Parameters
    ----------
    path : Path
        For messages.
    lines : iterator of (int, str)
        Numbers and texts of the lines below the header.
    roles : list of str
        Role of each column; a height "z" may be missing.
    delimiter : str or None
        Expected between columns; the first row may show another.

    Returns
    -------
    Rows
        In the units of the file; a million rows of two columns take a second.
    """
    width = len(roles)
    is_matrix = set(roles) == {"z"}
    numbers = array("d")
    row_lines = array("q")
    has_comma = has_point = False
    for number, line in lines:
        line = line.strip("\r\n " if delimiter == "\t" else None)
        if line.startswith(COMMENT):
            if is_matrix and re.search("[:=]", line):
                raise PatchfemError(
                    f"{path}:{number}: '{shorten(line)}' ends the scan or begins another one; keep only one "
                    "scan per file"
                )
            continue
        if not line.strip(" \t,;|"):
            continue
        if len(line) > MAX_LINE and width <= MAX_COLUMNS:
            raise PatchfemError(
                f"{path}:{number}: the line is {len(line)} characters long; {width} numbers are needed"
            )
        if not row_lines:
            delimiter = _find_delimiter(line, delimiter, width)

        # All rows must have the same decimal sign.
        has_point |= "." in line
        if delimiter != "," and "," in line:
            has_comma = True
        if has_comma and has_point:
            raise PatchfemError(
                f"{path}:{number}: '{shorten(line)}': a decimal comma and a decimal point in one file; use the "
                "same sign in the whole file"
            )
        cells = (line.replace(",", ".") if has_comma else line).split(delimiter)
        try:
            # The function float also accepts 1_0 and digits of other scripts.
            if len(cells) != width or "_" in line or not line.isascii():
                raise ValueError
            numbers.extend([float(cell) for cell in cells])
        except ValueError:
            numbers.extend(_parse_cells(f"{path}:{number}", line, cells, roles, delimiter))
        row_lines.append(number)
    return Rows(np.array(numbers).reshape(-1, width), np.array(row_lines))


def _find_delimiter(line: str, expected: str | None, width: int) -> str | None:
    """Return the delimiter of the first row, which may differ from that of the header."""
    cells, delimiter = split_cells(line)
    return delimiter if len(cells) == width else expected


def _parse_cells(
    place: str, line: str, cells: list[str], roles: list[str], delimiter: str | None
) -> list[float]:
    """Parse a row with missing heights or empty cells at its end; a PatchfemError says what is wrong in it."""
    cells = [cell.strip() for cell in cells]
    while len(cells) > len(roles) and not cells[-1]:
        cells.pop()
    if len(cells) != len(roles):
        remedy = "write nan for a missing height"
        if delimiter == "," and len(cells) == 2 * len(roles):
            remedy = "with a decimal comma, separate the columns by semicolons or tabs"
        raise PatchfemError(
            f"{place}: '{shorten(line)}': {len(roles)} numbers are needed; {remedy}"
        )
    numbers = []
    for role, cell in zip(roles, cells):
        if NUMBER_PATTERN.fullmatch(cell) or _NOT_FINITE.fullmatch(cell):
            numbers.append(float(cell))
        elif role == "z" and MISSING.fullmatch(cell):
            numbers.append(np.nan)
        elif role == "z":
            raise PatchfemError(
                f"{place}: '{shorten(cell)}' is not a height; write a missing height as nan"
            )
        elif role != "index":
            raise PatchfemError(
                f"{place}: '{shorten(cell)}' is not a number for {role}; correct the line or delete it"
            )
        else:
            numbers.append(0.0)
    return numbers
