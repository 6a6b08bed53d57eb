"""Numbers from a comma-separated table whose header carries the units, every mistake named with file and line."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core import Missing, PatchfemError, frozen_array

LARGEST = 64 * 2**20  # bytes of text
NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_HEAD = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:\[\s*([^\[\]]*?)\s*\])?\s*")
_WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


@dataclass(frozen=True, eq=False, slots=True)
class Columns:
    """Columns of a table that was read.

    values: name -> (k,) in SI; labels: name -> k texts of a column that `units` does not know; rows: k; row i stands in
    line i + 2.
    """

    values: dict
    labels: dict
    rows: int


def read_columns(path, units: Mapping, wanted: tuple, header: str, what: str, remedy: str = "",
                 labels: bool = False) -> Columns:
    """Read a comma-separated table whose header looks like `header`.

    units: column -> unit -> factor to SI ("" as unit: the column may stand without one); wanted: columns that must be
    there; what: a name for the contents, remedy: what to do where there is no file. Columns that `units` does not know
    may stand without a unit, or with one where `labels` says so; they are kept as text. PatchfemError names file and
    line, Missing where there is no file.
    """
    path = Path(path)
    lines = text_of(path, what, remedy).split("\n")
    names, factors = _header(path, lines[0], units, wanted, header, labels)
    last = max((n for n, line in enumerate(lines) if line.strip()), default=0)
    numbers, texts = [], []
    for number, line in enumerate(lines[1:last + 1], 2):
        cells = _cells(path, number, line, names)
        numbers.append([_number(path, number, name, cells[name]) for name in factors])
        texts.append([cells[name] for name in names if name not in factors])
    if len(numbers) < 2:
        raise PatchfemError(f"{path}:{last + 1}: {what} is at least two rows below its header, not {len(numbers)}")
    table = np.array(numbers).reshape(len(numbers), len(factors)) * list(factors.values())
    free = [name for name in names if name not in factors]
    return Columns({name: frozen_array(column) for name, column in zip(factors, table.T)},
                   {name: tuple(row[k] for row in texts) for k, name in enumerate(free)}, len(numbers))


def text_of(path: Path, what: str, remedy: str = "") -> str:
    """The text of a file with plain ends of lines; Missing where there is none, PatchfemError where it is too large."""
    try:
        with open(path, "rb") as file:
            data = file.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise PatchfemError(f"{path}: more than {LARGEST >> 20} MiB of text; keep every few rows of {what}")
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except FileNotFoundError:
        raise Missing(f"{path}: no such {what.split()[-1]}{remedy}") from None
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise PatchfemError(f"{path}: {what} cannot be read ({error})") from None


def _header(path, line: str, units: Mapping, wanted: tuple, header: str, labels: bool) -> tuple:
    """Names of the columns as they stand, and the factor of each column of numbers."""
    asked = f"a header like `{header}` is wanted, not '{line.strip()[:80]}'"
    found = [_HEAD.fullmatch(cell) for cell in line.split(",")]
    if not all(found):
        raise PatchfemError(f"{path}:1: {asked}")
    names = [one[1] for one in found]
    if len(set(names)) < len(names):
        raise PatchfemError(f"{path}:1: {asked} (a column stands twice)")
    factors = {}
    for name, unit in ((one[1], one[2]) for one in found):
        if name in units:
            if unit is None and "" not in units[name]:
                raise PatchfemError(f"{path}:1: {asked} ({name} without a unit)")
            if (unit or "") not in units[name]:
                known = ", ".join(text for text in units[name] if text)
                raise PatchfemError(f"{path}:1: {name} [{unit}]: the unit is not known; one of {known}")
            factors[name] = units[name][unit or ""]
        elif unit is not None and not labels:
            raise PatchfemError(f"{path}:1: {asked} (with a unit are known: {', '.join(units)})")
    absent = [name for name in wanted if name not in names]
    if absent:
        raise PatchfemError(f"{path}:1: {asked} (no column {', '.join(absent)})")
    return names, factors


def _cells(path, number: int, line: str, names) -> dict:
    cells = [cell.strip() for cell in line.split(",")]
    if len(cells) != len(names):
        count = _WORDS[len(names)] if len(names) < len(_WORDS) else str(len(names))
        listed = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
        raise PatchfemError(f"{path}:{number}: {count} cells are wanted, {listed}, not '{line.strip()[:80]}'")
    return dict(zip(names, cells))


def _number(path, number: int, name: str, cell: str) -> float:
    if not NUMBER.fullmatch(cell) or not np.isfinite(float(cell)):
        raise PatchfemError(f"{path}:{number}: {name}: '{cell[:80]}' is not a finite number")
    return float(cell)
