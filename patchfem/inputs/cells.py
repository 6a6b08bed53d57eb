"""Cells of a comma-separated table whose header states the units of its columns.

Nothing here needs NumPy, because `patchfem check` reads tables of measured responses with it.
"""

import csv
import re
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from ..exceptions import Missing, PatchfemError
from .units import normalize_unit

MAX_BYTES = 64 * 2**20  # largest size of a text file in bytes
MAX_VALUE = 1e50  # largest value in SI; the keys of a scene have the same limit
NUMBER_PATTERN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_HEADER_CELL_PATTERN = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:\[\s*([^\[\]]*?)\s*\])?\s*")
_NUMBER_WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


class TableFormat(NamedTuple):
    """Columns that a table may have, and the words for them in error messages.

    units: column of numbers -> unit -> factor to SI; the unit "" stands for a column without a unit.
    required: columns that must be there; "displacement slide" accepts either name.
    example: header of such a table. contents: what the file is, such as "a drive". remedy: end of the
    message if there is no file. has_label_units: other columns, which are read as text, may have units.
    """

    units: Mapping
    required: tuple
    example: str
    contents: str
    remedy: str = ""
    has_label_units: bool = False


def read_lines(path: Path, contents: str, remedy: str = "") -> list[str]:
    """Read the lines of a text file; the last one is empty if the file ends with a line break.

    Parameters
    ----------
    path : Path
    contents, remedy : str
        Words of the error messages, as in `TableFormat`.

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the file cannot be read or is too large.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise PatchfemError(
                f"{path}: more than {MAX_BYTES >> 20} MiB of text; leave out some rows of {contents}"
            )
        return path.read_text("utf-8-sig").split("\n")
    except FileNotFoundError:
        raise Missing(f"{path}: there is no such file{remedy}") from None
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise PatchfemError(f"{path}: {contents} cannot be read ({error})") from None


def parse_header(path, line: str, table: TableFormat) -> tuple[list, dict]:
    """Parse the header of a table into the names of its columns and factors to SI.

    Parameters
    ----------
    path : Path
        File, for error messages.
    line : str
        First line of the file.
    table : TableFormat

    Returns
    -------
    names : list of str
        All columns in their order.
    factors : dict
        Factor to SI of each column of numbers.

    Raises
    ------
    PatchfemError
        If the line is not such a header.
    """
    expected = f"a header like `{table.example}` is needed, not '{line.strip()[:80]}'"
    heads = [_HEADER_CELL_PATTERN.fullmatch(cell) for cell in line.split(",")]
    if not all(heads):
        raise PatchfemError(f"{path}:1: {expected}")
    names = [head[1] for head in heads]
    if len(set(names)) < len(names):
        raise PatchfemError(f"{path}:1: {expected} (a column is given twice)")
    factors = {}
    for name, unit in (head.groups() for head in heads):
        units = table.units.get(name)
        if units is None:
            if unit is not None and not table.has_label_units:
                raise PatchfemError(
                    f"{path}:1: {expected} (columns with a unit: {', '.join(table.units)})"
                )
            continue
        if unit is None and "" not in units:
            raise PatchfemError(f"{path}:1: {expected} ({name} without a unit)")
        factors[name] = units.get(normalize_unit(unit or ""))
        if factors[name] is None:
            known = ", ".join(filter(None, units))
            raise PatchfemError(f"{path}:1: {name} [{unit}]: unknown unit; use one of {known}")
    absent = [text.split()[0] for text in table.required if not set(text.split()) & set(names)]
    if absent:
        raise PatchfemError(f"{path}:1: {expected} (no column {', '.join(absent)})")
    return names, factors


def split_cells(path, line_number: int, line: str, names: list) -> dict:
    """Split a line of a table into its cells.

    Parameters
    ----------
    path : Path
        File, for error messages.
    line_number : int
        Number of the line from 1.
    line : str
        Cells may stand in quotation marks.
    names : list of str
        Columns of the table.

    Returns
    -------
    dict
        Text of the cell of each column.

    Raises
    ------
    PatchfemError
        If there are more or fewer cells than columns.
    """
    try:
        cells = next(csv.reader([line])) if '"' in line else line.split(",")
    except csv.Error as error:
        raise PatchfemError(
            f"{path}:{line_number}: the quotation marks in this row cannot be read ({error})"
        ) from None
    if len(cells) != len(names):
        count = _NUMBER_WORDS[len(names)] if len(names) < len(_NUMBER_WORDS) else len(names)
        columns = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
        raise PatchfemError(
            f"{path}:{line_number}: {count} cells are needed, {columns}, not '{line.strip()[:80]}'"
        )
    return {name: cell.strip() for name, cell in zip(names, cells)}


def parse_number(location: str, cell: str, factor: float) -> float:
    """Convert the text of a cell to a number in SI.

    Parameters
    ----------
    location : str
        Beginning of the error message, such as ``a.csv:3: force``.
    cell : str
    factor : float
        Factor to SI.

    Returns
    -------
    float

    Raises
    ------
    PatchfemError
        If the cell is not a finite number, or larger than `MAX_VALUE`.
    """
    if not NUMBER_PATTERN.fullmatch(cell) or not isfinite(float(cell)):
        raise PatchfemError(f"{location}: '{cell[:80]}' is not a finite number")
    value = float(cell) * factor
    if abs(value) > MAX_VALUE:
        raise PatchfemError(
            f"{location}: {value:g} in SI is outside the computable range; at most {MAX_VALUE:g} is possible"
        )
    return value
