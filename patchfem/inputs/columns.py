"""Columns of numbers from a comma-separated table whose header states the units."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core import PatchfemError, frozen_array
from .cells import (
    MAX_VALUE,
    TableFormat,
    parse_header,
    parse_number,
    read_lines,
    split_cells,
)


@dataclass(frozen=True, eq=False, slots=True)
class Columns:
    """Columns of a table; row i is on line i + 2 of the file, because the header is on line 1.

    values: column -> (k,) in SI; labels: column that is not known as a number -> k strings; rows: k.
    """

    values: dict
    labels: dict
    rows: int


def read_columns(path, table: TableFormat) -> Columns:
    """Read a table of numbers; columns that ``table.units`` does not know are kept as text.

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the file is not such a table; the message names the line.
    """
    path = Path(path)
    header, *lines = read_lines(path, table.contents, table.remedy)
    names, factors = parse_header(path, header, table)
    while lines and not lines[-1].strip():
        lines.pop()
    if len(lines) < 2:
        raise PatchfemError(
            f"{path}:{len(lines) + 1}: {table.contents} needs at least two rows below the header, not {len(lines)}"
        )
    values = _read_numbers(lines, list(factors.values())) if len(names) == len(factors) else None
    labels = []
    if values is None:
        values, labels = _read_cells(path, lines, names, factors)
    label_names = [name for name in names if name not in factors]
    return Columns(
        {name: frozen_array(column) for name, column in zip(factors, values.T)},
        {name: tuple(row[k] for row in labels) for k, name in enumerate(label_names)},
        len(values),
    )


def _read_numbers(lines: list[str], factors: list[float]) -> np.ndarray | None:
    """Return rows that contain only numbers, in SI; None if a cell is not a number, or out of range.

    NumPy's reader takes a tenth of the time of `_read_cells`, but does not say which cell is wrong.
    """
    try:
        values = np.loadtxt(lines, delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    if values.shape != (len(lines), len(factors)):  # NumPy leaves out blank lines
        return None
    values = values * factors
    return values if (np.abs(values) <= MAX_VALUE).all() else None


def _read_cells(path: Path, lines: list[str], names: list[str], factors: dict) -> tuple:
    """Read rows cell by cell: numbers in SI (rows, columns), and strings of other columns."""
    numbers = []
    texts = []
    for number, line in enumerate(lines, 2):
        cells = split_cells(path, number, line, names)
        location = f"{path}:{number}: "
        numbers.append(
            [parse_number(location + name, cells[name], factor) for name, factor in factors.items()]
        )
        texts.append([cells[name] for name in names if name not in factors])
    return np.array(numbers).reshape(len(lines), len(factors)), texts
