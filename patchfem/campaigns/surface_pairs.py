"""Tables of pairs of surfaces before and after wear."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ..core import PatchfemError
from ..inputs.tables import TableFormat, find_factors, read_text

REQUIRED_COLUMNS = ("before", "after")  # files of a pair; the other columns are optional


class TableLine(NamedTuple):
    """Line of a table of pairs.

    - line: number of the line in the file.
    - names: both files as written.
    - paths: where both files are.
    - direction: "x", "y" or "".
    - labels: the other cells by column.
    """

    line: int
    names: tuple[str, str]
    paths: tuple[Path, Path]
    direction: str
    labels: Mapping[str, str]


def read_pairs(table: Path) -> list[TableLine]:
    """Read pairs from a table whose columns before and after name files or results folders.

    Names are relative to the folder of the table. A column direction (x, y or empty) gives the axis along which the
    traces of a pair run; other columns are kept as text.

    Parameters
    ----------
    table : Path
        CSV file.

    Returns
    -------
    list of TableLine

    Raises
    ------
    Missing
        If the table is not there.
    PatchfemError
        If it is no such table, with file and line.
    """
    path = Path(table)
    text = read_text(path, "the table")
    # No column is a number; the call refuses a header without the columns of the files.
    find_factors(text, TableFormat({}, REQUIRED_COLUMNS, ",".join(REQUIRED_COLUMNS), "the table"))

    lines = []
    for number, row in text.iterate_rows(skips_blank=True):
        cells = dict(zip(text.names, row))
        names = tuple(cells.pop(column) for column in REQUIRED_COLUMNS)
        direction = cells.pop("direction", "")

        if not all(names):
            column = REQUIRED_COLUMNS[names.index("")]
            raise PatchfemError(f"{path}:{number}: {column}: the name of a file is needed")
        # Possible cells of the column `direction`, "" if it is not known
        if direction not in ("", "x", "y"):
            raise PatchfemError(
                f"{path}:{number}: direction: must be x, y or empty, not '{direction[:40]}'"
            )

        paths = tuple(path.parent / name for name in names)
        lines.append(TableLine(number, names, paths, direction, cells))

    if not lines:
        raise PatchfemError(
            f"{path}: no pair below its header; a line such as `new.csv,worn.csv` is needed for each"
        )
    return lines
