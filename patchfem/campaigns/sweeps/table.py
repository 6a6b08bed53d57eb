"""Cases of a sweep from a comma-separated file with a column per key and a case per row.

The unit of a key is in the header or in the cells. The tables that a sweep writes can be read as
well.
"""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

from ...disk.open_with_timeout import open_for_reading
from ...inputs.cells import NUMBER_PATTERN
from ...scene.axes import Axis, make_axis
from .cases import Cases

_HEAD = re.compile(r"\s*((?:[^\[\]]|\[[1-9][0-9]*\](?=\.))+?)\s*(?:\[\s*([^\[\]]*?)\s*\])?\s*")
OUTCOME_COLUMN = "outcome"  # column of a sweep.csv; this column and those after it are results
HEADER = "contact.load [lbf],contact.tilt.angle [mrad]"


def read_case_table(path: Path) -> tuple[Cases | None, list[str]]:
    """Read the cases of a file, and the mistakes in it.

    Returns
    -------
    tuple
        Cases, or None if there are mistakes, and a list of mistakes with file, line and key.
    """
    try:
        with (
            open_for_reading(path) as raw,
            io.TextIOWrapper(raw, encoding="utf-8-sig", newline="") as file,
        ):
            lines = [
                (number, [cell.strip() for cell in row])
                for number, row in enumerate(csv.reader(file), 1)
                if any(cell.strip() for cell in row)
            ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        return None, [f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"]
    if len(lines) < 2:
        return None, [
            f"{path}: the first line must be a header such as `{HEADER}`, and each line after it must give "
            "one case"
        ]
    first = lines[0][1]
    heads = [
        _HEAD.fullmatch(cell)
        for cell in first[: first.index(OUTCOME_COLUMN) if OUTCOME_COLUMN in first else None]
    ]
    if not heads or not all(heads):
        return None, [
            f"{path}:{lines[0][0]}: the first line must be a header such as `{HEADER}`, not "
            f"'{','.join(first)[:80]}'"
        ]
    wrong = [
        f"{path}:{number}: the line must have {len(first)} cells, as the header has, not {len(row)}"
        for number, row in lines[1:]
        if len(row) != len(first)
    ]
    keys = [head[1] for head in heads]
    wrong += [
        f"{path}:{lines[0][0]}: {key}: two columns have this key; remove one of them"
        for key in dict.fromkeys(keys)
        if keys.count(key) > 1
    ]
    if wrong:
        return None, wrong
    axes = []
    for place, (key, unit) in enumerate(head.groups() for head in heads):
        axis, mistakes = _parse_column(
            key, unit, [(number, row[place]) for number, row in lines[1:]]
        )
        axes.append(axis)
        wrong += [f"{path}:{number or lines[0][0]}: {key}: {text}" for number, text in mistakes]
    return (None, wrong) if wrong else (Cases(tuple(axes), True), [])


def _parse_column(key: str, unit: str | None, cells: list) -> tuple[Axis | None, list[tuple]]:
    """Return the axis of a column of (line, cell), and its mistakes as (line or 0, message)."""
    known = {}
    wrong = []
    for number, cell in cells:
        if cell in known:
            continue
        if unit is not None and not NUMBER_PATTERN.fullmatch(cell):
            wrong.append(
                (
                    number,
                    f"'{cell[:60]}' must be a number without a unit; write the unit in the header",
                )
            )
            continue
        try:
            known[cell] = make_axis(key, [f"{cell} {unit}" if unit else cell])
        except ValueError as error:
            wrong.append((number, str(error)))
            if str(error).startswith("not a key"):
                return None, [(0, str(error))]
    if wrong:
        return None, wrong
    parts = [known[cell] for _, cell in cells]
    numbers = all(part.unit for part in parts)
    texts = tuple(part.texts[0] for part in parts)
    return Axis(
        key,
        texts,
        tuple(part.values[0] for part in parts) if numbers else texts,
        parts[0].unit if numbers else "",
    ), []
