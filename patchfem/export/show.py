"""The answer of a verb as lines on the screen: verdict, key numbers, and one line for each file."""

import shlex
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..measures.rows import AMPLITUDE
from . import quantities, store
from .answer import Answer, Quantities, Quantity
from .columns import make_tables

# Largest number of rows of a table on the screen, by kind of answer; a kind without a number shows no table.
MAX_TABLE_ROWS = {"cost": float("inf"), "backbone": 10}
MAX_CURVES = 24  # largest number of response curves of a sweep whose peaks are shown


def make_lines(answer: Answer, is_verbose: bool = False) -> list[str]:
    """Return the lines of an answer for the standard output, without warnings and notes.

    `is_verbose` selects all quantities instead of the key quantities.
    """
    lines = [answer.title] if answer.title else []
    lines += answer.verdict
    # The runs of `cost` are its answer, and so are the cases of a backbone over a few values of a key.
    for table in make_tables(answer) if answer.kind in MAX_TABLE_ROWS else ():
        if len(table["rows"]) <= MAX_TABLE_ROWS[answer.kind]:
            lines += _align_columns([table["headings"], *table["rows"]])
    lines += _align_columns(_list_peaks(answer))
    shown = answer.quantities if is_verbose else quantities.choose_key_quantities(answer.quantities)
    return lines + format_quantities(shown)


def _list_peaks(answer: Answer) -> list[list[str]]:
    """Return the keys, the amplitude and the frequency at the peak of each response curve of a sweep, below their names.

    It is [] for other answers, for random cases and for many curves.
    """
    peaks = answer.data.get("peak_frequency")
    if answer.kind != "sweep" or peaks is None or peaks.values.size > MAX_CURVES:
        return []
    if "case" in peaks.dims:
        return []

    # A column for each key of the grid
    columns = []
    keys = [answer.data[name] for name in peaks.dims]
    for key, values in zip(keys, np.meshgrid(*(key.values for key in keys), indexing="ij")):
        cells = values.ravel().tolist()
        if values.dtype.kind == "f":
            cells = [quantities.format_value(value, key.unit) for value in cells]
        columns.append(cells)

    # Columns for the peaks
    for name in (AMPLITUDE, "peak_frequency"):
        parts = [answer.data.get(name + ending) for ending in ("", "_error", "_floor")]
        cells = []
        for place in np.ndindex(peaks.values.shape):
            value, error, floor = (float(part.values[place]) if part else 0.0 for part in parts)
            quantity = Quantity(value, parts[0].unit, error, floor=floor)
            cells.append(quantities.format_quantity(name, quantity))
        columns.append(cells)
    headings = [*answer.details["of"]["keys"], "peak amplitude", "peak frequency"]
    return [headings, *map(list, zip(*columns))]


def format_quantities(shown: Quantities) -> list[str]:
    """Return an aligned line for each quantity."""
    return _align_columns(list_quantities(shown))


def _align_columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return an indented line for each row of texts, in aligned columns."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    return ["  " + "  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def list_quantities(shown: Quantities) -> list[tuple[str, str]]:
    """Return name and text of each quantity, with the reason for a missing value or error."""
    rows = []
    for name, quantity in shown.items():
        reason = f" ({quantity.reason})" if quantity.reason else ""
        rows.append((name, quantities.format_quantity(name, quantity) + reason))
    return rows


def list_files(folder: Path, has_page: bool = True) -> list[str]:
    """Return a line for the results folder, and for its page, its fields and its main table if it has them."""
    lines = [f"results: {folder}{'' if has_page else ' (without report.html: --no-page)'}"]
    for label, name in (
        ("page", store.PAGE_FILE),
        ("fields", store.FIELDS_FILE),
        ("table", "sweep.csv"),
    ):
        if (folder / name).is_file():
            lines.append(f"{label}: {folder / name}")
    inside = sorted(folder.glob("interfaces/*"))
    if inside:
        first = shlex.quote(str(inside[0]))
        lines.append(
            f"fields of each interface: {folder / 'interfaces'}; view: patchfem view {first}"
        )
    return lines
