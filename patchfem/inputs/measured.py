"""A table of measured responses: frequency, input, acceleration, displacement and a flag per row."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ..exceptions import PatchfemError
from .cells import parse_header, parse_number, read_text, split_cells

UNITS = {
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "input": {"g": 9.80665, "m/s^2": 1.0, "m s-2": 1.0},
    "acceleration": {"g": 9.80665, "m/s^2": 1.0, "m s-2": 1.0},
    "displacement": {"mil": 25.4e-6, "in": 0.0254, "m": 1.0, "mm": 1e-3, "um": 1e-6},
}
# endings of files of records; their reader is heavy to import
BINARY = (
    ".mat",
    ".uff",
    ".unv",
    ".uf",
    ".58",
)
# columns that make a table with `time` a record
MOTIONS = (
    "displacement",
    "velocity",
    "acceleration",
    "slide",
    "relative_displacement",
    "relative_velocity",
    "absolute_acceleration",
)
FLAGS = {"U": "unstable", "*": "the gauge gave no reading", "R": "repeat run"}


@dataclass(frozen=True, slots=True)
class MeasuredRow:
    """One measured condition in SI; a value that was not read is None.

    frequency [Hz], input [m s-2], acceleration [m s-2], displacement [m], all >= 0; flag: letters of FLAGS, may be
    empty.
    """

    frequency: float
    input: float
    acceleration: float | None
    displacement: float | None
    flag: str


def read_table(path: Path) -> list:
    """Rows of a CSV of measured responses with units in its header, like `input [g]`.

    frequency and input must stand in every row. PatchfemError names line and column of a mistake, Missing where there
    is no file.
    """
    _refuse_record(Path(path))
    lines = read_text(Path(path), "a measured table").split("\n")
    names, factors = parse_header(
        path, lines[0], UNITS, ("frequency", "input"), "frequency [Hz],input [g],flag", False
    )
    unknown = [name for name in names if name not in (*UNITS, "flag")]
    if unknown:
        raise PatchfemError(
            f"{path}:1: column '{unknown[0][:40]}' is unknown; possible columns are flag and "
            f"{', '.join(UNITS)}"
        )
    return [
        _row(path, number, split_cells(path, number, line, names), factors)
        for number, line in enumerate(lines[1:], 2)
        if line.strip(", \t")
    ]


def _refuse_record(path: Path) -> None:
    """PatchfemError for a record over time, which no row of a table is."""
    ending = path.suffix.lower()
    if not path.is_file():
        return
    if ending not in BINARY:
        names = [
            cell.partition("[")[0].strip().lower()
            for cell in read_text(path, "a measured table").split("\n", 1)[0].split(",")
        ]
        if "time" not in names or not set(MOTIONS) & set(names) or "frequency" in names:
            return
    which = (
        ' --map "time=VARIABLE [s]" --map "displacement=VARIABLE [m]"' if ending == ".mat" else ""
    )
    raise PatchfemError(
        f"{path}: this file contains records over time; a rig is fitted to rows of frequency, input, "
        "acceleration and displacement, or to frequency and damping against amplitude. Compute the "
        f"latter from a free decay with `patchfem import {path} --decay{which} -o decay.csv`, then fit "
        "to decay.csv"
    )


def _row(path, number: int, cells: dict, factors: dict) -> MeasuredRow:
    flag = cells.get("flag", "")
    if set(flag) - set(FLAGS):
        raise PatchfemError(
            f"{path}:{number}: flag '{flag[:40]}' is unknown; possible letters are {', '.join(FLAGS)}"
        )
    values = {
        name: parse_number(path, number, name, cells[name], factor) if cells.get(name) else None
        for name, factor in (dict.fromkeys(UNITS) | factors).items()
    }
    below = next((name for name, value in values.items() if value is not None and value < 0), None)
    if below:
        raise PatchfemError(f"{path}:{number}: {below}: '{cells[below][:40]}' is below 0")
    if values["frequency"] is None or values["input"] is None:
        raise PatchfemError(f"{path}:{number}: frequency and input are needed in every row")
    return MeasuredRow(**values, flag=flag)


@lru_cache(64)
def is_readable(path: Path) -> bool:
    """Whether there is a table of measured responses at the path; asked once, since many models name the same one."""
    try:
        read_table(path)
    except PatchfemError:
        return False
    return True
