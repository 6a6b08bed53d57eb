"""Histories and loops of a results folder as a laboratory file, whose ending chooses the format."""

from pathlib import Path

import numpy as np

from ...core import Missing, PatchfemError
from ...disk.atomic_write import write_atomically, write_text
from .. import store
from ..answer import Answer
from ..columns import format_csv
from . import universal
from .universal import Column

# histories that form a friction loop with the slide of the same interface
LOOP_FORCE_NAMES = ("friction_force", "force", "friction_ratio", "fitted")
MAX_TIME_STEP_RATIO = 5.0  # largest ratio of a time step to the last one if all samples are stored


def export_histories(folder: Path, out: Path) -> str:
    """Write the histories and loops of a results folder, and return a line of text about the file.

    Parameters
    ----------
    folder : Path
        Of a run, or of a fit to a loop.
    out : Path
        File whose ending names the format, one of LAB_FILE_ENDINGS such as .mat or .uff.

    Raises
    ------
    PatchfemError
        For a folder without histories.
    Missing
        If the folder does not exist, or if the file cannot be written.
    """
    if not folder.is_dir():
        raise Missing(f"{folder}: no such results folder")
    answer = store.read_answer(folder)
    columns = list_columns(answer)
    # a fitted loop may have no time
    histories = [column for column in columns if column.name != "time"]
    if not histories:
        raise PatchfemError(
            f"{folder}: these results have no history; fields are exported as .pvd, .vtu, .vtkhdf, or .csv of the interface"
        )

    tail = ""
    if out.suffix.lower() == ".csv":
        # all digits, with units in the headings
        cells = {f"{column.label} [{column.unit}]": column.values.tolist() for column in columns}
        write_text(out, format_csv(cells))
    elif out.suffix.lower() == ".mat":
        write_matlab(out, answer)
    else:
        slides = {column.number: column for column in histories if column.name == "slide"}
        loops = [
            (slides[force.number], force)
            for force in histories
            if force.name in LOOP_FORCE_NAMES and force.number in slides
        ]
        universal.write_histories(out, columns, loops, answer.title)
        tail = f"; {len(loops)} loops"

    names = ", ".join(dict.fromkeys(column.name for column in histories))
    size = histories[0].values.size
    return f"{out}: {size} rows of {names}{_note_thinning(answer)}{tail}"


def list_columns(answer: Answer) -> list[Column]:
    """Return time and histories of a run, or the columns of a fitted loop, whose record may have no time."""
    is_fit = answer.kind == "fit"
    dimension = "row" if is_fit else "time"
    columns = []
    for name, variable in answer.data.items():
        is_history = dimension in variable.dims and variable.values.dtype.kind == "f"
        if not is_history or (is_fit and name not in ("time", "slide", *LOOP_FORCE_NAMES)):
            continue
        values = np.moveaxis(variable.values, variable.dims.index(dimension), -1)
        if values.ndim == 1:
            columns.append(Column(name, variable.unit, values))
        elif values.ndim == 2:
            columns += [Column(name, variable.unit, row, k) for k, row in enumerate(values, 1)]
    return sorted(columns, key=lambda column: column.name != "time")


def _note_thinning(answer: Answer) -> str:
    """Return a note that only the reversals of early histories are stored, or "" if the rows are even all along."""
    if "time" not in answer.data:
        return ""
    time = answer.data["time"].values
    steps = np.diff(time)
    (uneven,) = np.nonzero(steps > MAX_TIME_STEP_RATIO * steps[-1])
    if not uneven.size:
        return ""
    return (
        f"; before {time[uneven[-1] + 1]:.4g} s the rows are turning points, stops and starts of slip alone (fewer "
        "drive.cycles give even rows)"
    )


def write_matlab(path: Path, answer: Answer) -> None:
    """Write all arrays of numbers as variables of a MATLAB file of version 5; `units.NAME` is the unit of NAME."""
    from scipy.io import savemat

    content = {}
    units = {}
    for name, variable in answer.data.items():
        if variable.values.dtype.kind in "fiu":
            content[name] = variable.values
            units[name] = variable.unit
    content |= {"title": answer.title, "source": universal.PROGRAM_AND_VERSION, "units": units}
    with write_atomically(path) as partial, open(partial, "wb") as file:
        savemat(file, content, oned_as="column", long_field_names=True)
