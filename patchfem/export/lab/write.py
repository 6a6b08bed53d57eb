"""Histories and loops of a results folder as a laboratory file, whose ending chooses the format."""

from pathlib import Path

import numpy as np

from ...core import Missing, PatchfemError
from ...disk.atomic_write import write_atomically
from .. import store
from ..answer import Answer
from . import ENDINGS, universal
from .universal import Column

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
MAX_STEP_RATIO = 5.0  # largest ratio of a time step to the last one if all samples are stored


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

    tail = ""
    with write_atomically(out) as partial:
        if ending == ".mat":
            write_matlab(partial, answer)
        elif ending == ".csv":
            write_columns(partial, [time, *columns] if time else columns)
        else:
            loops = find_loops(columns)
            universal.write_histories(partial, time, columns, loops, answer.title)
            tail = f"; {len(loops)} loops"
    names = list(dict.fromkeys(column.name for column in columns))
    return f"{out}: {columns[0].values.size} rows of {', '.join(names)}{_note_thinning(time)}{tail}"


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


def _note_thinning(time: Column | None) -> str:
    """Return a note that only the reversals of early histories are stored, or "" if the rows are even all along."""
    steps = np.zeros(1) if time is None else np.diff(time.values)
    if steps.max() <= MAX_STEP_RATIO * steps[-1]:
        return ""
    even_from = time.values[np.flatnonzero(steps > MAX_STEP_RATIO * steps[-1])[-1] + 1]
    return (
        f"; before {even_from:.4g} s the rows are turning points, stops and starts of slip alone (fewer drive.cycles give "
        "even rows)"
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
