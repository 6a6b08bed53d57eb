"""Columns of sweep.csv, in their order.

In: the `SweepTable` of a sweep. Out: sweep.csv, with a row for each case. A new column is a row of `list_columns`. What it
shows of a case is in the table (`SweepTable.insert`); a text that the files of cases do not store yet is added to
`STORED_TEXTS` of `runs.batch.case_results`, and is then in `SweepTable.texts`.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
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


class CsvColumn(NamedTuple):
    """Column of sweep.csv.

    - heading: its first cell.
    - list_cells: function of a slice of the cases that returns their cells, "" for a missing number.
    """

    heading: str
    list_cells: Callable[[slice], Iterable[str]]


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

    def list_keys(number: int) -> CsvColumn:
        """Return the column of the swept key with this number."""
        axis = cases.axes[number]

        def list_cells(part: slice) -> list[str]:
            """Return the values of the key as they were written."""
            indices = cases.axis_indices(np.arange(len(table))[part])
            return [axis.texts[index] for index in indices[number].tolist()]

        return CsvColumn(axis.key, list_cells)

    def list_numbers(heading: str, numbers: np.ndarray, number_format: str) -> CsvColumn:
        """Return a column of numbers (n,)."""
        return CsvColumn(heading, lambda part: _format_numbers(numbers[part], number_format))

    def list_texts(heading: str, texts: dict[int, str]) -> CsvColumn:
        """Return a column of texts by the number of the case."""
        numbers = range(len(table))
        return CsvColumn(heading, lambda part: [texts.get(number, "") for number in numbers[part]])

    measures = []
    for name in sort_measures(table):
        column = table.measures[name]
        measures.append(list_numbers(name, column.values, "%r"))
        measures.append(list_numbers(f"{name}_error", column.errors, "%.6g"))
    columns = [
        *map(list_keys, range(len(cases.axes))),
        CsvColumn(OUTCOME_COLUMN, lambda part: map(str, table.outcome[part])),
        *measures,
        list_texts("message", table.messages),
    ]
    if case_folders:
        columns.append(CsvColumn("case", lambda part: case_folders[part]))
    return columns


def write_csv(cases: Cases, table: SweepTable, case_folders: Sequence[str], path: Path) -> None:
    """Write sweep.csv.

    Parameters
    ----------
    cases : Cases
        Values of the keys in each case.
    table : SweepTable
        Measures and outcome of each case.
    case_folders : sequence of str
        Folders of the cases; empty if there are none.
    path : Path
        File to write.
    """
    columns = list_columns(cases, table, case_folders)

    def make_rows(first: int) -> Iterator[tuple[str, ...]]:
        """Return the rows of a part of the cases, because the cells of all cases would fill the memory."""
        part = slice(first, first + N_ROWS_PER_PART)
        return zip(*(column.list_cells(part) for column in columns), strict=True)

    header = [column.heading for column in columns]
    parts = map(make_rows, range(0, len(table), N_ROWS_PER_PART))
    write_rows(path, chain([header], chain.from_iterable(parts)))


def _format_numbers(numbers: np.ndarray, number_format: str) -> list[str]:
    """Return numbers as strings; "" for NaN."""
    values = numbers.astype(float).tolist()
    return ["" if value != value else number_format % value for value in values]
