"""sweep.csv: a row for each case, with the swept keys as written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.sweep_table import SweepTable
from ...disk.atomic_write import write_rows
from ...response import rows
from ...runs.results.patch_rows import TABLE as STATIC

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
        Values of the keys in each case.
    table : SweepTable
        Measures and outcome of each case.
    case_folders : sequence of str
        Folders of the cases; empty if there are none.
    path : Path
        File to write.
    """
    names = sort_measures(table)
    heads = [axis.key for axis in cases.axes] + ["outcome"]
    texts = []
    for name in names:
        heads += [name, f"{name}_error"]
        texts.append(_format_numbers(table.measures[name].values, "{!r}"))
        texts.append(_format_numbers(table.measures[name].errors, "{:.6g}"))
    heads += ["message"] + ["case"] * bool(case_folders)
    # The rows are made one by one, because the cells of all cases would fill the memory.
    lines = (
        [
            *cases.texts(number),
            str(table.outcome[number]),
            *cells,
            table.messages.get(number, ""),
            *case_folders[number : number + 1],
        ]
        for number, *cells in zip(range(len(table)), *texts)
    )
    write_rows(path, chain([heads], lines))


def _format_numbers(numbers: np.ndarray, template: str) -> Iterator[str]:
    """Yield numbers as strings; "" for NaN."""
    for number in map(float, numbers):
        yield "" if number != number else template.format(number)
