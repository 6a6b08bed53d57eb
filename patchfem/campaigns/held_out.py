"""Rows of a measured table that a fit leaves out and predicts (--hold, --leave-out)."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..core import PatchfemError
from ..inputs.damage import shorten

MAX_LISTED_LENGTH = 200  # largest number of characters of a list of values in a message


def find_cells(columns: Mapping[str, Sequence], name: str, path: Path) -> Sequence:
    """Return the cells of a column by which rows can be selected.

    Parameters
    ----------
    columns : Mapping
        Column -> its cells, of those columns by which rows can be selected.
    name : str
        Column that the user names.
    path : Path
        Table, for messages.

    Raises
    ------
    PatchfemError
        If rows cannot be selected by this column.
    """
    if name not in columns:
        known = ", ".join(columns) or "a new column of labels, such as `run`"
        raise PatchfemError(
            f"{path}: there is no column {name} by which rows can be held out or left out; use {known}"
        )
    return columns[name]


def select_held_out(
    selector: str,
    path: Path,
    columns: Mapping[str, Sequence],
    matches: Callable[[str, object, str], bool],
    format_cell: Callable[[str, object], str],
) -> np.ndarray:
    """Return a mask (n,) of the rows that fulfil a condition "column=value,value" of the option --hold.

    Parameters
    ----------
    selector : str
        Condition, such as "frequency=135 Hz,150 Hz" or "cycle=1". A row fulfils it with any of the values.
    path : Path
        Table, for messages.
    columns : Mapping
        Column -> its n cells, of those columns by which rows can be selected.
    matches : callable
        (column, cell, value as text) -> whether the cell has this value.
    format_cell : callable
        (column, cell) -> text of the cell, for messages.

    Returns
    -------
    (n,) bool array

    Raises
    ------
    PatchfemError
        If the condition is incomplete, or if no row has one of the values.
    """
    name, equals, values = map(str.strip, selector.partition("="))
    texts = [text.strip() for text in values.split(",")]
    if not equals or not all(texts):
        raise PatchfemError(
            f"--hold {selector}: column=value,value is needed, such as frequency=135 Hz,150 Hz or cycle=1"
        )

    cells = find_cells(columns, name, path)
    selected = np.zeros(len(cells), bool)
    for text in texts:
        has_value = np.array([matches(name, cell, text) for cell in cells])
        if not has_value.any():
            known = ", ".join(dict.fromkeys(format_cell(name, cell) for cell in cells))
            raise PatchfemError(
                f"--hold {name}={text}: none of the rows of {path.name} with a reading has this value in the column "
                f"{name}; its values are {shorten(known, MAX_LISTED_LENGTH)}"
            )
        selected |= has_value
    return selected
