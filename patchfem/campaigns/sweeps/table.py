"""Cases of a sweep from a CSV table with a column for each key and a row for each case.

The unit of a key is given in the header or in the cells. The tables that a sweep writes are accepted
as well.
"""

import csv
import io
import re
from collections import Counter
from pathlib import Path

from ...disk.open_with_timeout import open_for_reading
from ...inputs.tables import NUMBER_PATTERN
from ...scene.assignments import Axis, make_axis
from ...scene.suggestions import require_key
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
            rows = enumerate(csv.reader(file), 1)
            lines = [(number, [cell.strip() for cell in row]) for number, row in rows]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        return None, [f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"]
    lines = [(number, cells) for number, cells in lines if any(cells)]
    if len(lines) < 2:
        return None, [
            f"{path}: the first line must be a header such as `{HEADER}`, and each line after it must give "
            "one case"
        ]
    (header_number, heads), *lines = lines
    key_cells = heads[: heads.index(OUTCOME_COLUMN)] if OUTCOME_COLUMN in heads else heads
    matches = list(map(_HEAD.fullmatch, key_cells))
    if not matches or not all(matches):
        return None, [
            f"{path}:{header_number}: the first line must be a header such as `{HEADER}`, not "
            f"'{','.join(heads)[:80]}'"
        ]
    errors = []
    for number, cells in lines:
        if len(cells) != len(heads):
            errors.append(
                f"{path}:{number}: the line must have {len(heads)} cells, as the header has, not {len(cells)}"
            )
    for key, count in Counter(match[1] for match in matches).items():
        if count > 1:
            errors.append(
                f"{path}:{header_number}: {key}: two columns have this key; remove one of them"
            )
    if errors:
        return None, errors

    axes = []
    for column, match in enumerate(matches):
        key, unit = match.groups()
        axis, wrong_cells = _parse_column(key, unit, [cells[column] for _, cells in lines])
        axes.append(axis)
        for row, text in wrong_cells:
            number = header_number if row is None else lines[row][0]
            errors.append(f"{path}:{number}: {key}: {text}")
    return (None, errors) if errors else (Cases(tuple(axes), True), [])


def _parse_column(
    key: str, unit: str | None, cells: list[str]
) -> tuple[Axis | None, list[tuple[int | None, str]]]:
    """Parse the cells of a column.

    Returns
    -------
    tuple
        Axis, or None if there are errors, and a list of the row of each wrong cell with its error; the
        row is None if the key is wrong.
    """
    try:
        require_key(key)
    except ValueError as error:
        return None, [(None, str(error))]
    errors = []
    for row, cell in enumerate(cells):
        try:
            if unit is not None and not NUMBER_PATTERN.fullmatch(cell):
                raise ValueError(
                    f"'{cell[:60]}' must be a number without a unit; write the unit in the header"
                )
            make_axis(key, [f"{cell} {unit}" if unit else cell])
        except ValueError as error:
            errors.append((row, str(error)))
    if errors:
        return None, errors
    texts = [f"{cell} {unit}" if unit else cell for cell in cells]
    return make_axis(key, texts, distinct=False), []
