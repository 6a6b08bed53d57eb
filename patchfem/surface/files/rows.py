"""Rows of numbers in a text file."""

import re
from array import array
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...inputs.tables import NUMBER_PATTERN
from .header import COMMENT, split_cells
from .spellings import MISSING, shorten

_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf)", re.IGNORECASE)


class Rows(NamedTuple):
    """Numbers (m, n) of a text file, with the line of each row."""

    numbers: np.ndarray
    lines: np.ndarray


def read_rows(path, lines: Iterator[tuple[int, str]], roles: list[str]) -> Rows:
    """Read all rows of numbers of a text file; a million rows of two columns take three seconds.

    Parameters
    ----------
    path : Path
        For messages.
    lines : iterator of (int, str)
        Numbers and texts of the lines below the header. The first row shows the delimiter of all.
    roles : list of str
        Role of each column; a height "z" may be missing, and an "index" is not read.
    """
    is_matrix = set(roles) == {"z"}
    numbers = array("d")
    row_lines = array("q")
    delimiter = None
    has_comma = has_point = False
    for number, line in lines:
        line = line.strip(" \r\n")
        place = f"{path}:{number}: '{shorten(line)}'"
        if line.startswith(COMMENT):
            if is_matrix and re.search("[:=]", line):
                raise PatchfemError(
                    f"{place} ends the scan or begins another one; keep only one scan per file"
                )
            continue
        if not line.strip(" \t,;|"):
            continue
        if not row_lines:
            delimiter = split_cells(line)[1]

        # All rows must have the same decimal sign.
        has_point |= "." in line
        has_comma |= delimiter != "," and "," in line
        if has_comma and has_point:
            raise PatchfemError(
                f"{place}: a decimal comma and a decimal point in one file; use the same sign in the whole file"
            )
        cells = (line.replace(",", ".") if has_comma else line).split(delimiter)
        cells = [cell.strip() for cell in cells]
        while len(cells) > len(roles) and not cells[-1]:
            cells.pop()
        if len(cells) != len(roles):
            is_decimal = delimiter == "," and len(cells) == 2 * len(roles)
            remedy = "with a decimal comma, separate the columns by semicolons or tabs"
            remedy = remedy if is_decimal else "write nan for a missing height"
            raise PatchfemError(f"{place}: {len(roles)} numbers are needed; {remedy}")
        numbers.extend([_parse_cell(f"{path}:{number}", *pair) for pair in zip(roles, cells)])
        row_lines.append(number)
    return Rows(np.array(numbers).reshape(-1, len(roles)), np.array(row_lines))


def _parse_cell(place: str, role: str, cell: str) -> float:
    """Return the number in a cell, NaN for a missing height; raise PatchfemError for other text."""
    if NUMBER_PATTERN.fullmatch(cell) or _NOT_FINITE.fullmatch(cell):
        return float(cell)
    if role == "index" or (role == "z" and MISSING.fullmatch(cell)):
        return np.nan
    raise PatchfemError(
        f"{place}: '{shorten(cell)}' is not a number for {role}; correct the line, or write a missing height as nan"
    )
