"""Numbers from a comma-separated table whose header carries the units, every mistake named with file and line."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core import PatchfemError, frozen_array
from .cells import MAX_VALUE, parse_header, parse_number, read_line_blocks, split_cells

_PLAIN = re.compile(r"[0-9eE+.,\t -]*")


@dataclass(frozen=True, eq=False, slots=True)
class Columns:
    """Columns of a table that was read.

    values: name -> (k,) in SI; labels: name -> k texts of a column that `units` does not know; rows: k; row i stands in
    line i + 2.
    """

    values: dict
    labels: dict
    rows: int


def read_columns(
    path,
    units: Mapping,
    wanted: tuple,
    header: str,
    what: str,
    remedy: str = "",
    labels: bool = False,
) -> Columns:
    """Read a comma-separated table whose header looks like `header`.

    units: column -> unit -> factor to SI ("" as unit: the column may stand without one); wanted: columns that must be
    there, one with the names that may stand for it behind it, "displacement slide"; what: a name for the contents,
    remedy: what to do where there is no file. Columns that `units` does not know may stand without a unit, or with one
    where `labels` says so; they are kept as text. PatchfemError names file and line, Missing where there is no file.
    """
    path, number = Path(path), 2
    blocks = _blocks(path, what, remedy)
    names, factors = parse_header(path, next(blocks)[0], units, wanted, header, labels)
    tables, texts = [np.zeros((0, len(factors)))], []
    for lines in blocks:
        table, more = _rows(path, number, lines, names, factors)
        number += len(lines)
        tables.append(table)
        texts += more
    table = np.concatenate(tables)
    if len(table) < 2:
        raise PatchfemError(
            f"{path}:{number - 1}: {what} needs at least two rows below the header, not {len(table)}"
        )
    free = [name for name in names if name not in factors]
    return Columns(
        {name: frozen_array(column) for name, column in zip(factors, table.T)},
        {name: tuple(row[k] for row in texts) for k, name in enumerate(free)},
        len(table),
    )


def _blocks(path: Path, what: str, remedy: str):
    """The first line, then the others some megabyte at a time, without blank lines at the end of the file."""
    blank, head = [], True
    for lines in read_line_blocks(path, what, remedy):
        if head:
            yield lines[:1]
            lines, head = lines[1:], False
        last = max((n for n, line in enumerate(lines) if line.strip()), default=-1)
        if last >= 0:
            yield [*blank, *lines[: last + 1]]
            blank = []
        # the first of blank lines, a mistake where more follows
        blank = blank or lines[last + 1 : last + 2]


def _rows(path: Path, number: int, lines: list, names: list, factors: dict) -> tuple:
    """Numbers (rows, columns) in SI of lines from `number` on, and the rows of the other columns as texts.

    A block of plain numbers is turned at once, 0.3 us a row and a tenth of the memory; one in which anything else
    stands goes line by line, so that a mistake is named.
    """
    joined = ",".join(lines)
    if len(names) == len(factors) and _PLAIN.fullmatch(joined):
        if all(line.count(",") == len(names) - 1 for line in lines):
            try:
                table = np.array(list(map(float, joined.split(",")))).reshape(
                    len(lines), -1
                ) * list(factors.values())
            except ValueError:  # an empty cell, or signs of a number that are none
                table = np.full((1, 1), np.inf)
            if np.abs(table).max() <= MAX_VALUE:
                return table, []
    numbers, texts = [], []
    for at, line in enumerate(lines, number):
        cells = split_cells(path, at, line, names)
        numbers.append(
            [parse_number(path, at, name, cells[name], factor) for name, factor in factors.items()]
        )
        texts.append([cells[name] for name in names if name not in factors])
    return np.array(numbers).reshape(len(numbers), len(factors)), texts
