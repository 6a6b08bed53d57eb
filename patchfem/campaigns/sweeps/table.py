"""Cases of a sweep from a CSV table with a column for each key and a row for each case.

The unit of a key is given in the header or in the cells. The tables that a sweep writes are accepted
as well.
"""

from collections import Counter
from pathlib import Path

from ...core import PatchfemError
from ...inputs.tables import NUMBER_PATTERN, read_text
from ...scene.assignments import Axis, make_axis
from ...scene.suggestions import require_key
from .cases import Cases

# Name of the first result column of a sweep.csv; this and all later columns are ignored.
OUTCOME_COLUMN = "outcome"
# Header of a table of cases, for messages
CASE_HEADER = "contact.load [lbf],contact.tilt.angle [mrad]"


def read_case_table(path: Path) -> tuple[Cases | None, list[str]]:
    """Read the cases of a CSV table, and its validation errors.

    Parameters
    ----------
    path : Path
        CSV file.

    Returns
    -------
    tuple
        Cases, or None if there are errors, and a list of errors with file, line and key.
    """
    try:
        table = read_text(path, "the table of cases")
        lines = list(table.iterate_rows(skips_blank=True))
    except PatchfemError as error:
        return None, [str(error)]

    # The table that a sweep wrote has results from the column "outcome" on.
    keys = table.names[: [*table.names, OUTCOME_COLUMN].index(OUTCOME_COLUMN)]
    if not all(keys) or not keys or not lines:
        return None, [
            f"{path}:1: the first line must be a header such as `{CASE_HEADER}`, and each line after it must give one case"
        ]
    doubled = [key for key, count in Counter(keys).items() if count > 1]
    errors = [f"{path}:1: {key}: two columns have this key; remove one of them" for key in doubled]

    # Each column is an axis of the sweep; row i of all axes is a case.
    axes = []
    for column, (key, unit) in enumerate(zip(keys, table.units)):
        axis, wrong_cells = _parse_column(key, unit, [cells[column] for _, cells in lines])
        axes.append(axis)
        for row, text in wrong_cells:
            errors.append(f"{path}:{1 if row is None else lines[row][0]}: {key}: {text}")
    return (None, errors) if errors else (Cases(tuple(axes), True), [])


def _parse_column(
    key: str, unit: str | None, cells: list[str]
) -> tuple[Axis | None, list[tuple[int | None, str]]]:
    """Parse the cells of a column.

    Parameters
    ----------
    key : str
        Dotted key in the header of the column.
    unit : str or None
        Unit in the header.
    cells : list of str
        Values.

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
