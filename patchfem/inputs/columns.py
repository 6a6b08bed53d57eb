"""Columns of numbers from a comma-separated table whose header states the units."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core import PatchfemError, frozen_array
from .cells import (
    MAX_VALUE,
    TableFormat,
    parse_header,
    parse_number,
    read_line_blocks,
    split_cells,
)

_NUMERIC_TEXT_PATTERN = re.compile(r"[0-9eE+.,\t -]*")


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
    line_number = 2
    blocks = _iterate_row_blocks(path, table)
    names, factors = parse_header(path, next(blocks)[0], table)
    numbers = [np.zeros((0, len(factors)))]
    labels = []
    for lines in blocks:
        block = _read_plain_block(lines, names, factors)
        if block is None:
            block, texts = _read_block(path, line_number, lines, names, factors)
            labels += texts
        numbers.append(block)
        line_number += len(lines)
    values = np.concatenate(numbers)
    if len(values) < 2:
        raise PatchfemError(
            f"{path}:{line_number - 1}: {table.contents} needs at least two rows below the header, "
            f"not {len(values)}"
        )
    label_names = [name for name in names if name not in factors]
    return Columns(
        {name: frozen_array(column) for name, column in zip(factors, values.T)},
        {name: tuple(row[k] for row in labels) for k, name in enumerate(label_names)},
        len(values),
    )


def _iterate_row_blocks(path: Path, table: TableFormat) -> Iterator[list]:
    """Yield the header, then blocks of rows; blank lines at the end of the file are left out."""
    blank = []
    is_header = True
    for lines in read_line_blocks(path, table.contents, table.remedy):
        if is_header:
            yield lines[:1]
            lines = lines[1:]
            is_header = False
        n_filled = max((n for n, line in enumerate(lines, 1) if line.strip()), default=0)
        if n_filled:
            yield [*blank, *lines[:n_filled]]
            blank = []
        # A blank line before further rows is an error; the first of them is enough to report it.
        blank = blank or lines[n_filled : n_filled + 1]


def _read_plain_block(lines: list, names: list, factors: dict) -> np.ndarray | None:
    """Read rows that contain only numbers, in SI, or return None if `_read_block` has to read them.

    This path takes 0.3 us per row and a tenth of the memory of the other one.
    """
    text = ",".join(lines)
    if len(names) > len(factors) or not _NUMERIC_TEXT_PATTERN.fullmatch(text):
        return None
    if any(line.count(",") != len(names) - 1 for line in lines):
        return None
    try:
        numbers = np.array(list(map(float, text.split(","))))
    except ValueError:  # an empty cell, or a sign without a number
        return None
    values = numbers.reshape(len(lines), -1) * list(factors.values())
    return values if np.abs(values).max() <= MAX_VALUE else None


def _read_block(path: Path, line_number: int, lines: list, names: list, factors: dict) -> tuple:
    """Read rows cell by cell: numbers in SI (rows, columns), and strings of other columns."""
    numbers = []
    texts = []
    for number, line in enumerate(lines, line_number):
        cells = split_cells(path, number, line, names)
        location = f"{path}:{number}: "
        numbers.append(
            [parse_number(location + name, cells[name], factor) for name, factor in factors.items()]
        )
        texts.append([cells[name] for name in names if name not in factors])
    return np.array(numbers).reshape(len(lines), len(factors)), texts
