"""Columns over time in a results folder: histories of a run, or the measured and the fitted loop of a fit."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...core import Missing, PatchfemError
from ...inputs.cells import TableFormat
from ...inputs.columns import read_columns
from ...inputs.units import FORCE_UNITS, SLIDE_UNITS
from ..read_results import is_real, read_variables

# Pairs of variables that form a friction loop; the first pair that a folder contains is used.
LOOPS = (
    ("slide", "friction_force"),
    ("relative_displacement", "friction_force"),
    ("displacement", "force"),
    ("displacement", "friction_ratio"),
    ("displacement", "fitted"),
)


class Column(NamedTuple):
    """History of one quantity over time, with its unit.

    name; unit as in netCDF ("m s-2"); values (k,); number: of the interface or mode from 1, 0 if
    there is only one.
    """

    name: str
    unit: str
    values: np.ndarray
    number: int

    @property
    def label(self) -> str:
        """Name of the column, followed by its number."""
        return f"{self.name}_{self.number}" if self.number else self.name


@dataclass(frozen=True, eq=False, slots=True)
class Histories:
    """Histories of equal length from one results folder.

    Attributes
    ----------
    title : str
        One line.
    time : (k,) array or None
        [s]
    columns : list of Column
    arrays : dict
        Name -> (values, unit) of all arrays of the folder, for formats that can contain arrays of
        any shape.
    """

    title: str
    time: np.ndarray | None
    columns: list
    arrays: dict

    def loops(self) -> list:
        """Return the friction loop of each interface as a pair of columns."""
        columns_by_name = {(column.name, column.number): column for column in self.columns}
        loops = {}
        for slide, force in LOOPS:
            for number in sorted(number for name, number in columns_by_name if name == slide):
                if (force, number) in columns_by_name:
                    loops.setdefault(
                        (force, number),
                        (columns_by_name[slide, number], columns_by_name[force, number]),
                    )
        return list(loops.values())


def read_histories(folder: Path) -> Histories:
    """Read the histories in a results folder.

    They are those of a run (result.nc), or of a fit to a loop (fit.csv).

    Missing if the folder or both files do not exist; PatchfemError if a file is not one of
    patchfem, or has no history.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise Missing(f"{folder}: no such results folder")
    if (folder / "result.nc").is_file():
        return _read_run_histories(folder / "result.nc")
    if (folder / "fit.csv").is_file():
        return _read_fit_histories(folder / "fit.csv")
    raise Missing(f"{folder}: it contains neither result.nc of a run nor fit.csv of a fit")


def _read_run_histories(path: Path) -> Histories:
    """Read the histories of a run."""
    attributes, variables = read_variables(path)
    title = str(attributes.get("title", ""))
    arrays = {
        name: (variable.values, variable.unit)
        for name, variable in variables.items()
        if is_real(variable.values)
    }
    columns = []
    for name, (dims, values, unit) in variables.items():
        if "time" not in dims or name == "time" or not is_real(values):
            continue
        if len(dims) == 1:
            columns.append(Column(name, unit, values.astype(float), 0))
        elif len(dims) == 2:
            rows = values if dims[1] == "time" else values.T
            columns += [Column(name, unit, row.astype(float), k) for k, row in enumerate(rows, 1)]
    if not columns or "time" not in variables:
        raise PatchfemError(
            f"{path}: a static patch has no history; its fields are exported as .pvd, .vtu, .vtkhdf, "
            "or .csv of the interface"
        )
    return Histories(title, variables["time"][1].astype(float), columns, arrays)


def _read_fit_histories(path: Path) -> Histories:
    """Read the measured and the fitted loop of a fit."""
    units = {**FORCE_UNITS, **SLIDE_UNITS, "fitted": {"": 1.0}}
    fitted_loop = TableFormat(
        units,
        ("displacement", "fitted"),
        "displacement [m],force [N],fitted",
        "a fitted loop",
        has_label_units=True,
    )
    table = read_columns(path, fitted_loop).values
    names = {"displacement": "m", "force": "N", "friction_ratio": "1"}
    names["fitted"] = "N" if "force" in table else "1"
    columns = [Column(name, unit, table[name], 0) for name, unit in names.items() if name in table]
    return Histories(
        "measured and fitted loop",
        table.get("time"),
        columns,
        {name: (values, "s" if name == "time" else names[name]) for name, values in table.items()},
    )


def program_name() -> str:
    """Return the name of the program with its version."""
    return f"patchfem {__version__}"
