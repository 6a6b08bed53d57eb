"""Columns of sweep.csv, in their order.

In: the `SweepTable` of a sweep. Out: sweep.csv, with a row for each case. A new column is a row of `list_columns`. It shows
what the table holds of a case (`SweepTable.insert`). A text that is not stored yet is added to `STORED_TEXTS` of
`runs.batch.case_results`, and is then in `SweepTable.texts`. A number that is not in the table yet is also stored in the
chunks (`export.sweeps.folder`), because the rows of an interrupted sweep are made from them.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.sweep_table import SweepTable
from ...campaigns.sweeps.table import OUTCOME_COLUMN
from ...disk.atomic_write import write_rows
from .answer import sort_measures

N_ROWS_PER_PART = 4096  # rows of sweep.csv whose cells are in memory at the same time


# function of a slice of the cases that returns their cells, "" for a missing number
CellLister = Callable[[slice], Iterable[str]]


class CsvColumn(NamedTuple):
    """Column of sweep.csv: its first cell, and the function that lists the others."""

    heading: str
    list_cells: CellLister


def list_columns(
    cases: Cases, table: SweepTable, case_folders: Sequence[str] = ()
) -> list[CsvColumn]:
    """Return the columns: the swept keys as written, the outcome, every measure with its error in SI, and the rest.

    A column after the outcome is ignored when the file is read as a table of cases.

    Parameters
    ----------
    cases : Cases
        Values of the keys in each case.
    table : SweepTable
        Measures and outcome of each case.
    case_folders : sequence of str
        Folders of the cases; empty if there are none.
    """
    columns = []
    for number, axis in enumerate(cases.axes):
        columns.append(CsvColumn(axis.key, partial(_list_values_of_key, cases, number)))
    columns.append(CsvColumn(OUTCOME_COLUMN, partial(_list_words, table.outcome)))
    for name in sort_measures(table):
        column = table.measures[name]
        columns.append(CsvColumn(name, partial(_list_numbers, column.values, "%r")))
        columns.append(CsvColumn(f"{name}_error", partial(_list_numbers, column.errors, "%.6g")))
    texts = [table.messages.get(number, "") for number in range(len(table))]
    columns.append(CsvColumn("message", partial(_list_words, texts)))
    if case_folders:
        columns.append(CsvColumn("case", partial(_list_words, case_folders)))
    return columns


def _list_values_of_key(cases: Cases, number: int, part: slice) -> list[str]:
    """Return the values of the swept key `number` in a part of the cases, as they were written."""
    indices = cases.axis_indices(np.arange(len(cases))[part])[number]
    return [cases.axes[number].texts[index] for index in indices.tolist()]


def _list_words(words: Sequence[str], part: slice) -> Iterable[str]:
    """Return the words (n,) of a part of the cases."""
    return map(str, words[part])


def _list_numbers(numbers: np.ndarray, number_format: str, part: slice) -> list[str]:
    """Return the numbers (n,) of a part of the cases as strings; "" for NaN."""
    values = numbers[part].astype(float).tolist()
    return ["" if value != value else number_format % value for value in values]


def write_csv(columns: Sequence[CsvColumn], n_cases: int, path: Path) -> None:
    """Write sweep.csv.

    Parameters
    ----------
    columns : sequence of CsvColumn
        Columns, as `list_columns` returns them.
    n_cases : int
        Number of their rows.
    path : Path
        File to write.
    """

    def make_rows(first: int) -> Iterator[tuple[str, ...]]:
        """Return the rows of a part of the cases, because the cells of all cases would fill the memory."""
        part = slice(first, first + N_ROWS_PER_PART)
        return zip(*(column.list_cells(part) for column in columns), strict=True)

    header = [column.heading for column in columns]
    parts = map(make_rows, range(0, n_cases, N_ROWS_PER_PART))
    write_rows(path, chain([header], chain.from_iterable(parts)))
