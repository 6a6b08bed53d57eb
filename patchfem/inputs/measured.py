"""A table of measured responses: frequency, input, acceleration, displacement and a flag per row."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from ..faults import PatchfemError

UNITS = {"frequency": {"Hz": 1.0, "kHz": 1e3},
         "input": {"g": 9.80665, "m/s^2": 1.0, "m s-2": 1.0},
         "acceleration": {"g": 9.80665, "m/s^2": 1.0, "m s-2": 1.0},
         "displacement": {"mil": 25.4e-6, "in": 0.0254, "m": 1.0, "mm": 1e-3, "um": 1e-6}}
LARGEST = 4 * 2**20  # bytes: a hundred thousand conditions
FLAGS = {"U": "unstable", "*": "no reading of the gauge", "R": "repeat run"}


@dataclass(frozen=True, slots=True)
class Row:
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

    frequency and input must stand in every row. PatchfemError names line and column of a mistake.
    """
    try:
        with open(path, "rb") as file:
            data = file.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise PatchfemError(f"{path}: more than {LARGEST >> 20} MiB; a table of measured conditions has a row for "
                                "each")
        lines = list(csv.reader(data.decode("utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise PatchfemError(f"{path}: the measured table cannot be read ({error})") from None
    if not lines:
        raise PatchfemError(f"{path}:1: the measured table is empty")
    columns = [_column(path, cell.strip()) for cell in lines[0]]
    twice = {name for name, _ in columns if [n for n, _ in columns].count(name) > 1}
    if twice:
        raise PatchfemError(f"{path}:1: two columns are named {', '.join(sorted(twice))}")
    missing = {"frequency", "input"} - {name for name, _ in columns}
    if missing:
        raise PatchfemError(f"{path}:1: no column {', '.join(sorted(missing))}; a header is like `frequency [Hz]`")
    return [_row(path, number, columns, cells) for number, cells in enumerate(lines[1:], 2) if any(cells)]


def _column(path, text: str) -> tuple:
    if text == "flag":
        return "flag", 1.0
    found = re.fullmatch(r"(\w+)\s*\[(.+)\]", text)
    if not found or found[1] not in UNITS or found[2] not in UNITS[found[1]]:
        known = "; ".join(f"{name} [{' | '.join(units)}]" for name, units in UNITS.items())
        raise PatchfemError(f"{path}:1: column '{text}' is not known; known are flag and {known}")
    return found[1], UNITS[found[1]][found[2]]


def _row(path, number: int, columns, cells) -> Row:
    if len(cells) != len(columns):
        raise PatchfemError(f"{path}:{number}: {len(cells)} cells under {len(columns)} columns")
    values = {"acceleration": None, "displacement": None, "flag": ""}
    for (name, factor), cell in zip(columns, cells):
        cell = cell.strip()
        if name == "flag":
            if set(cell) - set(FLAGS):
                raise PatchfemError(f"{path}:{number}: flag '{cell}'; known letters are {', '.join(FLAGS)}")
            values[name] = cell
        elif cell:
            if not re.fullmatch(r"\+?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", cell) or float(cell) == float("inf"):
                raise PatchfemError(f"{path}:{number}: {name}: '{cell[:40]}' is not a number >= 0")
            values[name] = float(cell) * factor
    if values.get("frequency") is None or values.get("input") is None:
        raise PatchfemError(f"{path}:{number}: frequency and input are wanted in every row")
    return Row(**values)
