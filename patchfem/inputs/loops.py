"""A measured friction loop: rows of displacement and force, and optionally time and labels."""

from collections.abc import Container, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from .tables import TableFormat, read_columns
from .units import CHANNEL_UNITS

READING_NAMES = ("force", "friction_ratio")  # quantities of which a loop has exactly one
LOOP_HEADER = "time [s],displacement [um],force [N]"
# Columns of `patchfem export` for each quantity, the preferred one first.
EXPORTED_NAMES = {
    "displacement": ("slide", "relative_displacement"),
    "force": ("friction_force",),
}


class Loop(NamedTuple):
    """A measured friction loop.

    - path: file.
    - time (k,): [s], or None if it was not measured.
    - displacement (k,): [m], 0 in the first row.
    - reading (k,): force [N] or friction ratio [1].
    - quantity: "force" or "friction_ratio".
    - labels: k texts of each other column, such as `run`, by its name.
    """

    path: Path
    time: np.ndarray | None
    displacement: np.ndarray
    reading: np.ndarray
    quantity: str
    labels: dict[str, tuple[str, ...]]


def read_loop(path) -> Loop:
    """Read a friction loop; its displacement is measured from the first row.

    Parameters
    ----------
    path : path-like
        CSV file with a header like ``time [s],displacement [um],force [N]``. The time may be absent, a
        column friction_ratio may replace the force, and the columns of `patchfem export` may replace
        displacement and force (`EXPORTED_NAMES`).

    Returns
    -------
    Loop

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the table is not a loop; the message names the line.
    """
    path = Path(path)
    known = {name: CHANNEL_UNITS[name] for name in (*READING_NAMES, "time", "displacement")}
    for quantity, names in EXPORTED_NAMES.items():
        known |= dict.fromkeys(names, known[quantity])
    required = " ".join(("displacement", *EXPORTED_NAMES["displacement"]))
    table = TableFormat(known, (required,), LOOP_HEADER, "a measured loop")

    # A column of `patchfem export` stands for the quantity that it contains.
    columns = read_columns(path, table)
    values = {
        find_standard_name(name, columns.values): column for name, column in columns.values.items()
    }

    # The table has either a force or a ratio.
    quantities = [name for name in READING_NAMES if name in values]
    if not quantities:
        raise PatchfemError(
            f"{path}:1: no column force; write a header like `{LOOP_HEADER}` (or friction_ratio for "
            "the force)"
        )
    if len(quantities) > 1:
        raise PatchfemError(
            f"{path}:1: there are columns force and friction_ratio: keep only one of the two"
        )
    (quantity,) = quantities

    # The slide is measured from the first row.
    displacement = values["displacement"]
    if not np.ptp(displacement):
        raise PatchfemError(f"{path}: displacement is the same in every row, so nothing slides")
    if not values[quantity].any():
        raise PatchfemError(f"{path}: {quantity} is 0 in every row, so there is nothing to fit")
    return Loop(
        path=path,
        time=values.get("time"),
        displacement=displacement - displacement[0],
        reading=values[quantity],
        quantity=quantity,
        labels=columns.labels,
    )


def find_standard_name(
    name: str, names: Container, exported_names: Mapping = EXPORTED_NAMES
) -> str:
    """Return the quantity for which a column of `patchfem export` stands, or the name itself.

    Parameters
    ----------
    name : str
        Column.
    names : Container
        All columns of the table. A column that has the name of the quantity has priority.
    exported_names : Mapping
        Quantity -> columns that stand for it; the first that is in the table does.

    Returns
    -------
    str
    """
    for quantity, candidates in exported_names.items():
        present = [candidate for candidate in candidates if candidate in names]
        if quantity not in names and present[:1] == [name]:
            return quantity
    return name
