"""Rows of numbers below the header of a text file."""

import io
import re
from array import array
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...inputs.cells import NUMBER_PATTERN
from .head import (
    COMMENT,
    DECIMAL_COMMA,
    DELIMITERS,
    MAX_LINE,
    MISSING,
    Head,
    is_number,
    strip_cells,
)
from .raw import shorten

_LONG_LINE = re.compile(rf"\n[^\n]{{{MAX_LINE + 1}}}")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf)", re.IGNORECASE)
_NUMBER_WORDS = ("no", "one", "two", "three", "four")


class Columns(NamedTuple):
    """Columns of numbers in a text file by role, with the line of each row."""

    values: dict
    lines: np.ndarray


def read_columns(path, body: str, head: Head, places: dict, width: int) -> Columns:
    """Read the columns of numbers in a text file.

    Parameters
    ----------
    path : Path
        For messages.
    body : str
        Text below the head.
    head : Head
    places : dict
        Role of each wanted column and its place.
    width : int
        Number of columns.

    Returns
    -------
    Columns
        In the units of the file.
    """
    first = next((line for line in _iterate_lines(body) if _is_row(line)), "")
    delimiter = _find_delimiter(first, head.delimiter, width)
    has_comma = delimiter != "," and "," in body
    if has_comma:
        has_comma = any(
            "," in line for line in _iterate_lines(body) if not line.lstrip().startswith(COMMENT)
        )
    if not _LONG_LINE.search(f"\n{body[: MAX_LINE + 1]}") and not _LONG_LINE.search(body):
        table = _load_table(body, delimiter, has_comma=has_comma)
        lines = _row_numbers(body)
        is_complete = (
            table is not None and table.shape == (lines.size, width) and np.isfinite(table).all()
        )
        if is_complete:
            return Columns(
                {role: table[:, k] for role, k in places.items()}, lines + head.number + 1
            )
    numbers = array("d")
    lines = array("q")
    for line_number, line in enumerate(_iterate_lines(body), head.number + 1):
        if not _is_row(line):
            continue
        place = f"{path}:{line_number}"
        cells = _split_row(place, line, delimiter, width)
        if has_comma and "." in line:
            raise PatchfemError(
                f"{place}: '{shorten(line)}': the decimal sign is a comma elsewhere in the file "
                "and a point here; use the same sign in the whole file"
            )
        numbers.extend(
            _parse_number(place, role, cells[k], delimiter) for role, k in places.items()
        )
        lines.append(line_number)
    table = np.array(numbers).reshape(-1, len(places))
    return Columns(dict(zip(places, table.T)), np.array(lines))


def read_matrix(path, body: str, head: Head) -> np.ndarray:
    """Read the rows (m, n) of a matrix of heights from a text file.

    Parameters
    ----------
    path : Path
        For messages.
    body : str
        Text below the head.
    head : Head

    Returns
    -------
    (m, n) array
        In the unit of the file.
    """
    table = _load_table(body, head.delimiter, has_comma=head.delimiter != "," and "," in body)
    if table is not None and not np.isinf(table).any():
        return table
    count = len(head.row)
    rows = []
    for line_number, line in enumerate(body.split("\n"), head.number + 1):
        place = f"{path}:{line_number}"
        line = line.strip("\r\n \t" if head.delimiter is None else "\r\n ")
        if line.startswith(COMMENT) and (":" in line or "=" in line):
            raise PatchfemError(
                f"{place}: '{shorten(line)}' ends the scan or begins another one; keep only one "
                "scan per file"
            )
        if not line.strip() or line.startswith(COMMENT):
            continue
        cells = [cell.strip() for cell in line.split(head.delimiter)]
        if len(cells) != count:
            cells = strip_cells(cells)
        if len(cells) != count:
            raise PatchfemError(
                f"{place}: {len(cells)} numbers, but the first row of the matrix has {count}; "
                "write nan for a missing height, and one row of the scan per line"
            )
        rows.append([_parse_number(place, "z", cell, head.delimiter) for cell in cells])
    return np.array(rows, float)


def _iterate_lines(body: str) -> Iterator[str]:
    """Iterate over the lines of a text file; they are not stored."""
    start = 0
    while start < len(body):
        stop = body.find("\n", start)
        stop = len(body) if stop < 0 else stop
        yield body[start:stop]
        start = stop + 1


def _is_row(line: str) -> bool:
    return bool(line.strip(" \t,;|")) and not line.lstrip().startswith(COMMENT)


def _find_delimiter(line: str, expected: str | None, count: int) -> str | None:
    """Find the delimiter that splits a line into `count` numbers, first trying the expected one."""
    for sign in (expected, *DELIMITERS, None) if len(line) <= MAX_LINE else ():
        cells = line.split(sign)
        filled = strip_cells(cells)
        if len(filled) <= count <= len(cells) and all(is_number(cell, sign) for cell in filled):
            return sign
    return expected


def _load_table(body: str, delimiter: str | None, *, has_comma: bool) -> np.ndarray | None:
    """Read rows that contain only numbers at once, or return None for rows that need a parser."""
    if has_comma and "." in body:
        return None
    if has_comma:
        body = body.replace(",", ".")
    if not body.strip() or not body.isascii() or "_" in body:  # loadtxt would read 1_0 as a number
        return None
    try:
        return np.loadtxt(io.BytesIO(body.encode()), delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return None


def _row_numbers(body: str) -> np.ndarray:
    """Return the zero-based indices of the non-empty lines."""
    body = body.rstrip("\n")
    if "\n\n" in f"\n{body}":
        return np.array([k for k, line in enumerate(body.split("\n")) if line])
    return np.arange(body.count("\n") + 1)


def _split_row(place: str, line: str, delimiter: str | None, width: int) -> list:
    """Split a row into its cells; raise PatchfemError if their number is not `width`."""
    words = _NUMBER_WORDS[width]
    if len(line) > MAX_LINE:
        raise PatchfemError(
            f"{place}: the line is {len(line)} characters long; {words} numbers are needed"
        )
    cells = [cell.strip() for cell in line.split(delimiter)]
    while len(cells) > width and not cells[-1]:
        cells.pop()
    if len(cells) == width:
        return cells
    remedy = "write nan for a missing height"
    if delimiter == "," and len(cells) == 2 * width:
        remedy = "with a decimal comma, separate the columns by semicolons or tabs"
    raise PatchfemError(f"{place}: '{shorten(line)}': {words} numbers are needed; {remedy}")


def _parse_number(place: str, role: str, cell: str, delimiter: str | None) -> float:
    """Parse a number of a text file; a missing height becomes NaN."""
    if role == "z" and MISSING.fullmatch(cell):
        return np.nan
    if delimiter != "," and DECIMAL_COMMA.fullmatch(cell):
        cell = cell.replace(",", ".")
    if NUMBER_PATTERN.fullmatch(cell) or _NOT_FINITE.fullmatch(cell):
        return float(cell)
    if role == "z":
        raise PatchfemError(
            f"{place}: '{shorten(cell)}' is not a height; write a missing height as nan"
        )
    raise PatchfemError(
        f"{place}: '{shorten(cell)}' is not a number for {role}; correct the line or delete it"
    )
