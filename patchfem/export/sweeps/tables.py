"""sweep.csv: a row for each case, with the swept keys as written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.sweep_table import SweepTable
from ...disk.atomic_write import write_rows
from ...response import rows
from ...runs.results.patch_rows import TABLE as STATIC

CASES_PER_BLOCK = 256  # cases whose strings are in memory at the same time
MEASURE_ORDER = {name: place for place, name in enumerate((*STATIC, *rows.TABLE))}


def sort_measures(table: SweepTable) -> list[str]:
    """Return the measures of a table in the order in which the reference lists them."""
    return sorted(
        table.measures,
        key=lambda name: (
            MEASURE_ORDER.get(rows.remove_interface_number(name), len(MEASURE_ORDER)),
            name,
        ),
    )


def write_csv(cases: Cases, table: SweepTable, case_folders: Sequence[str], path: Path) -> None:
    """Write sweep.csv.

    A row has the swept keys as written, the outcome, every measure with its error in SI, the message
    of a failed case, and the name of its folder. A missing number is "".

    Parameters
    ----------
    cases : Cases
    table : SweepTable
    case_folders : sequence of str
        Folders of the cases; empty if there are none.
    path : Path
    """
    names = sort_measures(table)
    heads = [axis.key for axis in cases.axes] + ["outcome"]
    heads += [head for name in names for head in (name, f"{name}_error")] + ["message"]
    heads += ["case"] if case_folders else []
    write_rows(path, chain([heads], _make_rows(cases, table, names, case_folders)))


def _make_rows(
    cases: Cases, table: SweepTable, names: list[str], case_folders: Sequence[str]
) -> Iterator[list[str]]:
    """Yield the rows of the cases."""
    columns = [table.measures[name] for name in names]
    for first in range(0, len(table), CASES_PER_BLOCK):
        block = slice(first, first + CASES_PER_BLOCK)
        texts = []
        for column in columns:
            texts.append(_format_numbers(column.values[block], "{!r}"))
            texts.append(_format_numbers(column.errors[block], "{:.6g}"))
        for number, *cells in zip(range(len(table))[block], *texts, strict=bool(texts)):
            folder = case_folders[number : number + 1]
            message = table.messages.get(number, "")
            yield [*cases.texts(number), str(table.outcome[number]), *cells, message, *folder]


def _format_numbers(numbers, template: str) -> list[str]:
    """Return numbers as strings; "" for NaN."""
    return ["" if number != number else template.format(number) for number in numbers.tolist()]
