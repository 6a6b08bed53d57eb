"""A prescribed slide from a table: time, displacement and, for two directions, lateral displacement.

The slide is straight between the rows. Other columns are not used.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..core import PatchfemError
from .columns import read_columns

_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "mil": 25.4e-6}
SLIDE_UNITS = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "displacement": _LENGTHS,
    "lateral": _LENGTHS,
}
FORCE_UNITS = {
    "force": {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605, "kgf": 9.80665},
    "friction_ratio": {"": 1.0, "1": 1.0},
}
_ACCELERATIONS = {"m/s^2": 1.0, "g": 9.80665, "mm/s^2": 1e-3, "in/s^2": 0.0254}
# what a table of a laboratory's records may hold besides time: each reader takes what it needs and passes over the rest
RECORD_UNITS = {
    "displacement": _LENGTHS,
    "lateral": _LENGTHS,
    "velocity": {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "in/s": 0.0254},
    "acceleration": _ACCELERATIONS,
    "base_acceleration": _ACCELERATIONS,
    **FORCE_UNITS,
}


def read_slide(path, units: Mapping = SLIDE_UNITS) -> tuple:
    """Read a slide from a CSV whose header is like `time [s],displacement [um]`: time (k,) [s], displacement (k,) [m].

    Where a column lateral stands too, (k,) [m], the displacement across, is returned third. units: column -> unit ->
    factor to SI. There must be two rows or more with strictly rising time; the first row is 0 in every column, where
    the pieces were pressed, and the path leaves it. A measured loop or a table of `patchfem import` may be given as it
    is: the other columns of RECORDED and those without a unit are passed over. PatchfemError names file and line,
    Missing where there is no file.
    """
    path = Path(path)
    found = read_columns(
        path,
        {**RECORD_UNITS, **units},
        ("time", "displacement"),
        "time [s],displacement [um]",
        "a path",
        "; slide.file is relative to the scene",
    )
    columns = [
        found.values[name] for name in ("time", "displacement", "lateral") if name in found.values
    ]
    _check(path, *columns)
    return tuple(columns)


def _check(path, time, *places) -> None:
    for name, column in zip(("time", "displacement", "lateral"), (time, *places)):
        if (first := column[0]) != 0:
            raise PatchfemError(
                f"{path}:2: {name} starts at {first:g}: a slide must start at time 0 and "
                f"displacement 0; subtract the first {name} from the column, or use `patchfem "
                "import --zero`"
            )
    check_rising(path, time)
    if not any(column.any() for column in places):
        raise PatchfemError(f"{path}: displacement is 0 in every row, so nothing slides")


def check_rising(path, time) -> None:
    """Raise PatchfemError at the first row whose time does not follow the one before.

    path: the file, for the message; time: (k,) [s], its first value in line 2.
    """
    back = np.flatnonzero(np.diff(time) <= 0)
    if back.size:
        k = back[0]
        raise PatchfemError(
            f"{path}:{k + 3}: time {time[k + 1]:g} s is not later than the time in the row above, "
            f"{time[k]:g} s; times must strictly rise"
        )
