"""The cells of a comma-separated table whose header carries the units, every mistake named with file and line.

Nothing here needs NumPy: `check` reads measured rows by it.
"""

import csv
import re
from codecs import getincrementaldecoder
from collections.abc import Mapping
from io import IncrementalNewlineDecoder
from math import isfinite
from pathlib import Path

from ..exceptions import Missing, PatchfemError

MAX_BYTES = 64 * 2**20  # bytes of text
BLOCK = 2**17  # bytes read at a time
MAX_VALUE = 1e50  # SI, as for the keys of a scene
NUMBER_PATTERN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_HEAD = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:\[\s*([^\[\]]*?)\s*\])?\s*")
_WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def read_text(path: Path, what: str, remedy: str = "") -> str:
    """The text of a file with plain ends of lines; Missing where there is none, PatchfemError where it is too large."""
    return "\n".join(line for lines in read_line_blocks(path, what, remedy) for line in lines)


def read_line_blocks(path: Path, what: str, remedy: str = ""):
    """The lines of a file some megabyte at a time, the last of which may be empty; errors as `text_of`."""
    decoder = IncrementalNewlineDecoder(getincrementaldecoder("utf-8-sig")(), translate=True)
    begun, seen = [], 0
    try:
        with open(path, "rb") as file:
            while data := file.read(BLOCK):
                seen += len(data)
                if seen > MAX_BYTES:
                    raise PatchfemError(
                        f"{path}: more than {MAX_BYTES >> 20} MiB of text; leave out some rows of {what}"
                    )
                *whole, last = decoder.decode(data).split("\n")
                if whole:
                    begun.append(whole[0])
                    yield ["".join(begun), *whole[1:]]
                    begun = []
                begun.append(last)
        begun.append(decoder.decode(b"", final=True))
        yield "".join(begun).split("\n")
    except FileNotFoundError:
        raise Missing(f"{path}: no such {what.split()[-1]}{remedy}") from None
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise PatchfemError(f"{path}: {what} cannot be read ({error})") from None


def parse_header(
    path, line: str, units: Mapping, wanted: tuple, header: str, labels: bool
) -> tuple:
    """Names of the columns as they stand, and the factor of each column of numbers; arguments as in `read_columns`."""
    asked = f"a header like `{header}` is needed, not '{line.strip()[:80]}'"
    found = [_HEAD.fullmatch(cell) for cell in line.split(",")]
    if not all(found):
        raise PatchfemError(f"{path}:1: {asked}")
    names = [one[1] for one in found]
    if len(set(names)) < len(names):
        raise PatchfemError(f"{path}:1: {asked} (a column is given twice)")
    factors = {}
    for name, unit in ((one[1], one[2]) for one in found):
        if name in units:
            if unit is None and "" not in units[name]:
                raise PatchfemError(f"{path}:1: {asked} ({name} without a unit)")
            if (unit or "") not in units[name]:
                known = ", ".join(text for text in units[name] if text)
                raise PatchfemError(f"{path}:1: {name} [{unit}]: unknown unit; use one of {known}")
            factors[name] = units[name][unit or ""]
        elif unit is not None and not labels:
            raise PatchfemError(f"{path}:1: {asked} (columns with a unit: {', '.join(units)})")
    absent = [one for one, *others in map(str.split, wanted) if not {one, *others} & set(names)]
    if absent:
        raise PatchfemError(f"{path}:1: {asked} (no column {', '.join(absent)})")
    return names, factors


def split_cells(path, number: int, line: str, names) -> dict:
    """Name -> text of the cells of a line, which may stand in quotes; PatchfemError for another count than of names."""
    try:
        cells = [
            cell.strip() for cell in (next(csv.reader([line])) if '"' in line else line.split(","))
        ]
    except csv.Error as error:
        raise PatchfemError(
            f"{path}:{number}: the quotation marks in this row cannot be read ({error})"
        ) from None
    if len(cells) != len(names):
        count = _WORDS[len(names)] if len(names) < len(_WORDS) else str(len(names))
        listed = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
        raise PatchfemError(
            f"{path}:{number}: {count} cells are needed, {listed}, not '{line.strip()[:80]}'"
        )
    return dict(zip(names, cells))


def parse_number(path, number: int, name: str, cell: str, factor: float) -> float:
    """The number of a cell in SI; PatchfemError where it is none, or beyond what can be computed with."""
    if not NUMBER_PATTERN.fullmatch(cell) or not isfinite(float(cell)):
        raise PatchfemError(f"{path}:{number}: {name}: '{cell[:80]}' is not a finite number")
    value = float(cell) * factor
    if abs(value) > MAX_VALUE:
        raise PatchfemError(
            f"{path}:{number}: {name}: {value:g} in SI is outside the computable range, {MAX_VALUE:g}"
        )
    return value
