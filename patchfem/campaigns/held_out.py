"""Rows of a measured table that a fit leaves out and predicts (--hold, --leave-out)."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..core import PatchfemError
from ..formatting import format_length
from ..inputs.damage import shorten
from ..scene.keys.quantities import parse_quantity

MAX_LISTED_VALUES_CHARACTERS = 200  # largest number of characters of a list of values in a message
EQUAL_NUMBERS_TOL = 1e-9  # largest relative difference at which two numbers count as equal
# Kind of quantity and unit of each column of numbers by which rows can be selected
NUMBER_UNITS = {
    "frequency": ("frequency", "Hz"),
    "input": ("acceleration", "m/s^2"),
    "amplitude": ("length", "m"),
}


def find_cells(columns: Mapping[str, Sequence], name: str, path: Path) -> Sequence:
    """Return the cells of a column by which rows of a measured table can be selected.

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
    columns: Mapping[str, Sequence[float | str]],
) -> np.ndarray:
    """Return a mask (n,) of the rows that fulfil a condition "column=value,value" of the option --hold.

    Parameters
    ----------
    selector : str
        Condition, such as "frequency=135 Hz,150 Hz" or "cycle=1". A row fulfils it with any of the values.
    path : Path
        Table, for messages.
    columns : Mapping
        Column -> its n cells, of those columns by which rows can be selected: labels, or numbers [SI] of
        `NUMBER_UNITS`.

    Returns
    -------
    (n,) bool array

    Raises
    ------
    PatchfemError
        If the condition is incomplete, if a value lacks its unit, or if no row has one of the values.
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
        has_value = np.array([_has_value(name, cell, text) for cell in cells])
        if not has_value.any():
            known = ", ".join(dict.fromkeys(format_cell(name, cell) for cell in cells))
            raise PatchfemError(
                f"--hold {name}={text}: none of the rows of {path.name} with a reading has this value in the column "
                f"{name}; its values are {shorten(known, MAX_LISTED_VALUES_CHARACTERS)}"
            )
        selected |= has_value
    return selected


def format_cell(name: str, cell: float | str) -> str:
    """Return the text of a cell in the column `name`: a label, or a number with its unit."""
    if isinstance(cell, str):
        return cell or "(none)"
    if name == "amplitude":
        return format_length(cell, 6)
    return f"{cell:.6g} {NUMBER_UNITS[name][1]}"


def group_by_column(
    name: str, path: Path, columns: Mapping[str, Sequence[float | str]], selected: np.ndarray
) -> list[np.ndarray]:
    """Group selected rows by their value in the column of the option --leave-out.

    Parameters
    ----------
    name : str
        Column.
    path : Path
        Table, for messages.
    columns : Mapping
        Column -> its n cells: labels, or numbers [SI].
    selected : (n,) bool array
        Rows that are grouped.

    Returns
    -------
    list of (n,) bool array
        Masks of the groups, in the order of the rows.

    Raises
    ------
    PatchfemError
        If rows cannot be selected by this column, or if all rows have the same value.
    """
    texts = np.array([format_cell(name, cell) for cell in find_cells(columns, name, path)])
    groups = [selected & (texts == text) for text in dict.fromkeys(texts[selected].tolist())]
    if len(groups) == 1:
        raise PatchfemError(
            f"--leave-out {name}: all rows that are not held out have the same value in this column, so leaving this value "
            "out leaves no rows for the fit; choose another column"
        )
    return groups


def _has_value(name: str, cell: float | str, text: str) -> bool:
    """Return whether a cell in the column `name` has the value that a text of the option --hold states.

    Labels that are numbers are compared as numbers, and frequencies and inputs but for round-off. Other flags of a row
    need only contain the text.
    """
    if isinstance(cell, str):
        try:
            return float(cell) == float(text)
        except ValueError:
            return text in cell if name == "flag" else text == cell
    try:
        value = parse_quantity(text, NUMBER_UNITS[name][0])
    except ValueError as error:
        raise PatchfemError(f"--hold {name}={text}: {error}") from None
    return abs(cell - value) <= EQUAL_NUMBERS_TOL * abs(value)
