"""Histories and loops of a results folder as a laboratory file, whose ending chooses the format."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import Missing, PatchfemError
from ...disk.atomic_write import write_atomically
from ...formatting import format_quantity
from ...structure.drive_sizes import MAX_STORED_SAMPLES, MIN_SAMPLES_PER_CYCLE
from .. import store
from ..answer import Answer
from . import ENDINGS, universal

# pairs of variables that form a friction loop; of a force, the first pair that a folder contains
LOOPS = (
    ("slide", "friction_force"),
    ("relative_displacement", "friction_force"),
    ("slide", "force"),
    ("slide", "friction_ratio"),
    ("slide", "fitted"),
)
FIT_COLUMNS = ("slide", "force", "friction_ratio", "fitted")
MAX_NAME_LENGTH = 63  # largest length of a MATLAB variable name, in characters
MAX_LISTED_COLUMNS = 8  # largest number of columns that the line about a file names
# Smallest number of rows between two reversals if all samples are stored; fewer rows show that only reversals are stored.
MIN_ROWS_PER_SWING = 5


class Column(NamedTuple):
    """History of a quantity over time.

    name; unit as in netCDF ("m s-2"); values (k,); number: of the interface or mode from 1, 0 if there is only one.
    """

    name: str
    unit: str
    values: np.ndarray
    number: int = 0

    @property
    def label(self) -> str:
        """Name of the column, followed by its number."""
        return f"{self.name}_{self.number}" if self.number else self.name


def export_histories(folder: Path, out: Path) -> str:
    """Write the histories and loops of a results folder, and return a line of text about the file.

    Parameters
    ----------
    folder : Path
        Of a run, or of a fit to a loop.
    out : Path
        File with one of the ENDINGS.

    Raises
    ------
    PatchfemError
        For another ending, and for a folder without histories.
    Missing
        If the folder does not exist, or if the file cannot be written.
    """
    out = Path(out)
    ending = out.suffix.lower()
    if ending not in ENDINGS:
        raise PatchfemError(f"{out}: histories are exported as {', '.join(ENDINGS)}")
    if not Path(folder).is_dir():
        raise Missing(f"{folder}: no such results folder")
    answer = store.read(folder)
    time, columns = list_columns(answer)
    if not columns:
        raise PatchfemError(
            f"{folder}: these results have no history; fields are exported as .pvd, .vtu, .vtkhdf, or .csv of the interface"
        )

    loops = find_loops(columns)
    with write_atomically(out) as partial:
        if ending == ".mat":
            write_matlab(partial, answer)
        elif ending == ".csv":
            write_columns(partial, [time, *columns] if time else columns)
        else:
            universal.write_histories(partial, time, columns, loops, answer.title)
    labels = [column.label for column in columns]
    more = len(labels) - MAX_LISTED_COLUMNS
    others = f" and {more} more" if more > 0 else ""
    names = ", ".join(labels[:MAX_LISTED_COLUMNS])
    text = f"{out}: {columns[0].values.size} rows of {names}{others}{_note_thinning(time, columns)}"
    is_universal = ending not in (".mat", ".csv")
    return f"{text}; {len(loops)} loops" if is_universal else text


def list_columns(answer: Answer) -> tuple[Column | None, list[Column]]:
    """Return the time and the histories of a run, or the time and the columns of a fitted loop.

    The time is None if the record of a fit has none; the histories are empty if there are none.
    """
    dimension = "row" if answer.kind == "fit" else "time"
    columns = []
    for name, variable in answer.data.items():
        is_history = (
            dimension in variable.dims and name != "time" and variable.values.dtype.kind == "f"
        )
        if not is_history or (answer.kind == "fit" and name not in FIT_COLUMNS):
            continue
        values = np.moveaxis(variable.values, variable.dims.index(dimension), -1)
        if values.ndim == 1:
            columns.append(Column(name, variable.unit, values))
        elif values.ndim == 2:
            columns += [Column(name, variable.unit, row, k) for k, row in enumerate(values, 1)]
    time = answer.data.get("time")
    return time and Column("time", "s", time.values), columns


def find_loops(columns: list[Column]) -> list[tuple[Column, Column]]:
    """Return slide and force of the friction loop of each interface."""
    known = {(column.name, column.number): column for column in columns}
    loops = {}
    for slide, force in LOOPS:
        for name, number in known:
            if name == slide and (force, number) in known:
                loop = known[slide, number], known[force, number]
                loops.setdefault((force, number), loop)
    return list(loops.values())


def _note_thinning(time: Column | None, columns: list[Column]) -> str:
    """Return a note that only the reversals of early histories are stored, or "" if all samples are stored."""
    moving = [column.values for column in columns if column.name.endswith("displacement")]
    if time is None or not moving:
        return ""
    reversals = np.flatnonzero(np.diff(np.sign(np.diff(moving[0]))) != 0) + 1
    thinned = np.flatnonzero(np.diff(reversals) < MIN_ROWS_PER_SWING)
    if thinned.size < MIN_ROWS_PER_SWING or thinned.size < (thinned[-1] + 1) / 2:
        return ""
    first_even = format_quantity(float(time.values[reversals[thinned[-1] + 1]]), "s", 3)
    return (
        f"; before {first_even} the rows are turning points, stops and starts of slip alone: a release of up to "
        f"{MAX_STORED_SAMPLES // MIN_SAMPLES_PER_CYCLE} cycles (drive.cycles) has even rows all along, any other run "
        "in its last cycles"
    )


def write_matlab(path: Path, answer: Answer) -> None:
    """Write all arrays of numbers as variables of a MATLAB file of version 5; `units.NAME` is the unit of NAME."""
    from scipy.io import savemat

    arrays = {
        name[:MAX_NAME_LENGTH]: variable
        for name, variable in answer.data.items()
        if variable.values.dtype.kind in "fiu"
    }
    content = {name: variable.values for name, variable in arrays.items()}
    units = {name: variable.unit for name, variable in arrays.items()}
    origin = {"title": answer.title, "source": universal.PROGRAM, "units": units}
    with open(path, "wb") as file:
        savemat(file, content | origin, oned_as="column", long_field_names=True)


def write_columns(path: Path, columns: list[Column]) -> None:
    """Write columns of equal length as CSV with units in the header and all digits."""
    lines = [",".join(f"{column.label} [{column.unit}]" for column in columns)]
    rows = zip(*(column.values.tolist() for column in columns), strict=True)
    lines += [",".join(map(repr, row)) for row in rows]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
