"""Histories and loops of a results folder as a laboratory file, whose ending chooses the format."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...core import Missing, PatchfemError
from ...disk.atomic_write import write_atomically, write_text
from .. import store
from ..answer import Answer
from ..columns import format_csv

PROGRAM_AND_VERSION = f"patchfem {__version__}"
# type codes of dataset 58 by the unit of a quantity; 1 (general) for other units
UNIVERSAL_TYPE_CODES = {"m": 8, "m s-1": 11, "m s-2": 12, "N": 13, "s": 17}
UNIVERSAL_UNIT_LABELS = {"m s-1": "m/s", "m s-2": "m/s^2"}
# function types of dataset 58
LOOP_FUNCTION_TYPE = 0
HISTORY_FUNCTION_TYPE = 1
SI_UNITS_DATASET = {
    "type": 164,
    "units_code": 1,
    "units_description": "SI: Meter (newton)",
    "temp_mode": 1,
    "length": 1.0,
    "force": 1.0,
    "temp": 1.0,
    "temp_offset": 273.15,
}
# histories that form a friction loop with the slide of the same interface
LOOP_FORCE_NAMES = ("friction_force", "force", "friction_ratio", "fitted")


class Column(NamedTuple):
    """Values of a quantity along the rows of a file.

    - name: name of the quantity.
    - unit: unit as in netCDF, such as "m s-2".
    - values (k,): one value for each row.
    - number: number of the interface or mode, from 1, or 0 if there is only one.
    """

    name: str
    unit: str
    values: np.ndarray
    number: int = 0

    @property
    def label(self) -> str:
        """Name of the column, followed by its number."""
        return f"{self.name}_{self.number}" if self.number else self.name


def make_dataset(
    name: str, function: int, x: Column, y: Column, title: str
) -> dict[str, str | int | np.ndarray]:
    """Return a dataset 58 of one column against another.

    Parameters
    ----------
    name : str
        First line of identification.
    function : int
        LOOP_FUNCTION_TYPE or HISTORY_FUNCTION_TYPE.
    x, y : Column
        Abscissa and ordinate.
    title : str
        Fourth line of identification.
    """
    return {
        "type": 58,
        "binary": 1,
        "func_type": function,
        "id1": name[:80],
        "id2": PROGRAM_AND_VERSION,
        "id4": title,
        "rsp_node": y.number or 1,
        "rsp_dir": 1,
        "ref_node": 0,
        "ref_dir": 0,
        "orddenom_spec_data_type": 0,
        "abscissa_spec_data_type": UNIVERSAL_TYPE_CODES[x.unit],
        "abscissa_axis_units_lab": x.unit,
        "ordinate_spec_data_type": UNIVERSAL_TYPE_CODES.get(y.unit, 1),
        "ordinate_axis_units_lab": UNIVERSAL_UNIT_LABELS.get(y.unit, y.unit),
        "data": np.array(y.values),
        "x": np.array(x.values, float),
    }


def write_histories(
    path: Path, columns: Sequence[Column], loops: Sequence[tuple[Column, Column]], title: str
) -> None:
    """Write histories and friction loops.

    The first line of identification is the name of the history (of a loop, "force over slide"), the fourth the title; the
    node is the number of the interface or mode, or 1, and the direction is +x.

    Parameters
    ----------
    path : Path
        File that is written.
    columns : sequence of Column
        The time comes first; without it there are only loops.
    loops : sequence of (Column, Column)
        Slide and force.
    title : str
        Fourth line of identification.

    Raises
    ------
    PatchfemError
        If a value is not finite, or if there is neither time nor loop.
    Missing
        If pyuff is not installed.
    """
    for column in columns:
        if not np.isfinite(column.values).all():  # pyuff would write these values as 0
            raise PatchfemError(
                f"{column.label} has values that are not finite, which a universal file cannot contain; export .mat or .csv"
            )
    time, *histories = columns
    curves = [
        (f"{force.label} over {slide.label}", LOOP_FUNCTION_TYPE, slide, force)
        for slide, force in loops
    ]
    if time.name == "time":
        curves = [
            (column.label, HISTORY_FUNCTION_TYPE, time, column) for column in histories
        ] + curves
    if not curves:
        raise PatchfemError(
            "the run has no history over time and no friction loop, so a universal file would be empty"
        )
    line = "".join(letter if " " <= letter <= "~" else "?" for letter in title)[:80].strip()
    write_datasets(path, [make_dataset(*curve, line or "NONE") for curve in curves])


def write_datasets(path: Path, datasets: list[dict]) -> None:
    """Write the units and datasets 58 into a new file by pyuff, with correct byte counts.

    Missing is raised if pyuff is not installed.
    """
    try:
        import pyuff
    except ImportError:
        raise Missing(
            "writing universal files needs the package pyuff; run pip install 'patchfem[lab]'"
        ) from None
    with write_atomically(path) as partial:
        partial.write_bytes(b"")
        file = pyuff.UFF(str(partial))
        file.write_sets(SI_UNITS_DATASET, "add")
        for dataset in datasets:
            start = partial.stat().st_size
            file.write_sets(dataset, "add")
            _correct_byte_count(partial, start, dataset["data"].nbytes + dataset["x"].nbytes)


def _correct_byte_count(path: Path, start: int, size: int) -> None:
    """Write the number of bytes of values into the header of the dataset 58 that begins at a position of the file.

    `start` is the position of the dataset [bytes], and `size` the number of bytes of its values.
    """
    with open(path, "r+b") as file:
        file.seek(start)
        head = file.read(200)
        # the byte count follows the byte order, the float format and the number of text lines
        position = head.index(b"b", head.index(b"    58")) + 1 + 6 + 6 + 12
        file.seek(start + position)
        file.write(b"%12d" % size)


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
        write_histories(out, columns, loops, answer.title)
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
    # Largest ratio of a time step to the last one if all samples are stored
    (uneven,) = np.nonzero(steps > 5.0 * steps[-1])
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
    content |= {"title": answer.title, "source": PROGRAM_AND_VERSION, "units": units}
    with write_atomically(path) as partial, open(partial, "wb") as file:
        savemat(file, content, oned_as="column", long_field_names=True)
