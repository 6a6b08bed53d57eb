"""A prescribed slide from a table: time, displacement and, for two directions, lateral; straight between the rows."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..core import Missing, PatchfemError, frozen_array

_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "mil": 25.4e-6}
UNITS = {"time": {"s": 1.0, "ms": 1e-3, "us": 1e-6}, "displacement": _LENGTHS, "lateral": _LENGTHS}
COLUMNS = ("time", "displacement", "lateral")
LARGEST = 64 * 2**20  # bytes of text
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def read_path(path, units: Mapping = UNITS) -> tuple:
    """(time (k,) [s], displacement (k,) [m]) of a CSV whose header is like `time [s],displacement [um]`; and lateral
    (k,) [m], the displacement across, where that column stands too.

    units: column -> unit -> factor to SI. At least two rows, time strictly rising; the first row is 0 in every
    column, where the pieces were pressed, and the path leaves it. PatchfemError names file and line, Missing where
    there is no file.
    """
    path = Path(path)
    lines = _text(path).split("\n")
    order, factors = _header(path, lines[0], units)
    last = max((n for n, line in enumerate(lines) if line.strip()), default=0)
    rows = np.array([_row(path, number, line, order) for number, line in enumerate(lines[1:last + 1], 2)])
    if len(rows) < 2:
        raise PatchfemError(f"{path}:{last + 1}: a path is at least two rows below its header, not {len(rows)}")
    rows = rows * factors
    _check(path, *rows.T)
    return tuple(frozen_array(column) for column in rows.T)


def _text(path: Path) -> str:
    try:
        with open(path, "rb") as file:
            data = file.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise PatchfemError(f"{path}: more than {LARGEST >> 20} MiB of text; keep every few rows of the path")
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except FileNotFoundError:
        raise Missing(f"{path}: no such path; slide.file is relative to the scene") from None
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise PatchfemError(f"{path}: the path cannot be read ({error})") from None


def _header(path, line: str, units: Mapping) -> tuple:
    """(column names as they stand, factors of time, displacement and lateral)."""
    wanted = f"a header like `time [s],displacement [um]` is wanted, not '{line.strip()[:80]}'"
    found = [re.fullmatch(r"\s*(\w+)\s*\[\s*([^\[\]]*?)\s*\]\s*", cell) for cell in line.split(",")]
    names = [one[1] if one else "" for one in found]
    known = COLUMNS[:max(len(names), 2)]
    if sorted(names) != sorted(known):
        raise PatchfemError(f"{path}:1: {wanted}")
    for _, name, unit in ((one, one[1], one[2]) for one in found):
        if unit not in units[name]:
            raise PatchfemError(f"{path}:1: {name} [{unit}]: the unit is not known; one of {', '.join(units[name])}")
    unit = {one[1]: one[2] for one in found}
    return names, np.array([units[name][unit[name]] for name in known])


def _row(path, number: int, line: str, order) -> tuple:
    cells = [cell.strip() for cell in line.split(",")]
    if len(cells) != len(order):
        wanted = "two cells are wanted, time and displacement" if len(order) == 2 else "three cells are wanted"
        raise PatchfemError(f"{path}:{number}: {wanted}, not '{line.strip()[:80]}'")
    values = dict(zip(order, cells))
    for name, cell in values.items():
        if not _NUMBER.fullmatch(cell) or not np.isfinite(float(cell)):
            raise PatchfemError(f"{path}:{number}: {name}: '{cell[:80]}' is not a finite number")
    return tuple(float(values[name]) for name in COLUMNS[:len(order)])


def _check(path, time, *places) -> None:
    for name, column in zip(COLUMNS, (time, *places)):
        if (first := column[0]) != 0:
            raise PatchfemError(f"{path}:2: {name} starts at {first:g}: the slide starts at 0, 0, where the pieces are "
                                f"pressed; subtract the first {name} from the column")
    back = np.flatnonzero(np.diff(time) <= 0)
    if back.size:
        k = back[0]
        raise PatchfemError(f"{path}:{k + 3}: time {time[k + 1]:g} s does not follow {time[k]:g} s; strictly rising "
                            "time is wanted")
    if not any(column.any() for column in places):
        raise PatchfemError(f"{path}: displacement is 0 in every row, so nothing slides")
