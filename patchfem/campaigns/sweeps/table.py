"""Cases of a sweep from a CSV table with a column for each key and a row for each case.

The unit of a key is given in the header or in the cells. The tables that a sweep writes are accepted
as well.
"""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path
from typing import NamedTuple

from ...disk.open_with_timeout import open_for_reading
from ...inputs.cells import NUMBER_PATTERN
from ...scene.axes import Axis, make_axis
from .cases import Cases

_HEAD = re.compile(r"\s*((?:[^\[\]]|\[[1-9][0-9]*\](?=\.))+?)\s*(?:\[\s*([^\[\]]*?)\s*\])?\s*")
# Name of the first result column of a sweep.csv; this and all later columns are ignored.
OUTCOME_COLUMN = "outcome"
HEADER = "contact.load [lbf],contact.tilt.angle [mrad]"


def read_case_table(path: Path) -> tuple[Cases | None, list[str]]:
    """Read the cases of a CSV table, and its validation errors.

    Returns
    -------
    tuple
        Cases, or None if there are errors, and a list of errors with file, line and key.
    """
    try:
        with (
            open_for_reading(path) as raw,
            io.TextIOWrapper(raw, encoding="utf-8-sig", newline="") as file,
        ):
            lines = _read_nonempty_lines(file)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        return None, [f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"]
    if len(lines) < 2:
        return None, [
            f"{path}: the first line must be a header such as `{HEADER}`, and each line after it must give "
            "one case"
        ]
    header = lines.pop(0)
    key_cells = header.cells
    if OUTCOME_COLUMN in key_cells:
        key_cells = key_cells[: key_cells.index(OUTCOME_COLUMN)]
    header_matches = list(map(_HEAD.fullmatch, key_cells))
    if not header_matches or not all(header_matches):
        return None, [
            f"{path}:{header.number}: the first line must be a header such as `{HEADER}`, not "
            f"'{','.join(header.cells)[:80]}'"
        ]
    errors = []
    n_columns = len(header.cells)
    for line in lines:
        if len(line.cells) != n_columns:
            errors.append(
                f"{path}:{line.number}: the line must have {n_columns} cells, as the header has, not "
                f"{len(line.cells)}"
            )
    keys = [head[1] for head in header_matches]
    for key in dict.fromkeys(keys):
        if keys.count(key) > 1:
            errors.append(
                f"{path}:{header.number}: {key}: two columns have this key; remove one of them"
            )
    if errors:
        return None, errors
    axes = []
    for column, head in enumerate(header_matches):
        key, unit = head.groups()
        cells = [(line.number, line.cells[column]) for line in lines]
        axis, wrong_cells = _parse_column(key, unit, cells)
        axes.append(axis)
        for number, text in wrong_cells:
            errors.append(f"{path}:{number or header.number}: {key}: {text}")
    return (None, errors) if errors else (Cases(tuple(axes), True), [])


class _TableLine(NamedTuple):
    """Line of a CSV table: its number, counted from 1, and its cells."""

    number: int
    cells: list


def _read_nonempty_lines(file) -> list:
    """Return the lines of a CSV table that are not empty."""
    lines = []
    for number, row in enumerate(csv.reader(file), 1):
        cells = [cell.strip() for cell in row]
        if any(cells):
            lines.append(_TableLine(number, cells))
    return lines


def _parse_column(key: str, unit: str | None, cells: list) -> tuple[Axis | None, list[tuple]]:
    """Parse a column of (line number, cell) pairs to an axis, or return its validation errors."""
    axes = {}
    errors = []
    for number, cell in cells:
        if cell in axes:
            continue
        if unit is not None and not NUMBER_PATTERN.fullmatch(cell):
            errors.append(
                (
                    number,
                    f"'{cell[:60]}' must be a number without a unit; write the unit in the header",
                )
            )
            continue
        try:
            axes[cell] = make_axis(key, [f"{cell} {unit}" if unit else cell])
        except ValueError as error:
            errors.append((number, str(error)))
            if str(error).startswith("not a key"):
                return None, [(0, str(error))]
    if errors:
        return None, errors
    values = [axes[cell] for _, cell in cells]
    texts = tuple(value.texts[0] for value in values)
    if not all(value.unit for value in values):
        return Axis(key, texts, texts, ""), []
    return Axis(key, texts, tuple(value.values[0] for value in values), values[0].unit), []
