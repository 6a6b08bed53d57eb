"""Numbers from a comma-separated table whose header carries the units, every mistake named with file and line."""

import re
from codecs import getincrementaldecoder
from collections.abc import Mapping
from dataclasses import dataclass
from io import IncrementalNewlineDecoder
from pathlib import Path

import numpy as np

from ..core import Missing, PatchfemError, frozen_array

LARGEST = 64 * 2**20  # bytes of text
BLOCK = 2**17  # bytes read at a time
BEYOND = 1e50  # SI, as for the keys of a scene
_PLAIN = re.compile(r"[0-9eE+.,\t -]*")
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
    there, one with the names that may stand for it behind it, "displacement slide"; what: a name for the contents,
    remedy: what to do where there is no file. Columns that `units` does not know may stand without a unit, or with one
    where `labels` says so; they are kept as text. PatchfemError names file and line, Missing where there is no file.
    """
    path, number = Path(path), 2
    blocks = _blocks(path, what, remedy)
    names, factors = _header(path, next(blocks)[0], units, wanted, header, labels)
    tables, texts = [np.zeros((0, len(factors)))], []
    for lines in blocks:
        table, more = _rows(path, number, lines, names, factors)
        number += len(lines)
        tables.append(table)
        texts += more
    table = np.concatenate(tables)
    if len(table) < 2:
        raise PatchfemError(f"{path}:{number - 1}: {what} is at least two rows below its header, not {len(table)}")
    free = [name for name in names if name not in factors]
    return Columns({name: frozen_array(column) for name, column in zip(factors, table.T)},
                   {name: tuple(row[k] for row in texts) for k, name in enumerate(free)}, len(table))


def _blocks(path: Path, what: str, remedy: str):
    """The first line, then the others some megabyte at a time, without blank lines at the end of the file."""
    blank, head = [], True
    for lines in lines_of(path, what, remedy):
        if head:
            yield lines[:1]
            lines, head = lines[1:], False
        last = max((n for n, line in enumerate(lines) if line.strip()), default=-1)
        if last >= 0:
            yield [*blank, *lines[:last + 1]]
            blank = []
        blank = blank or lines[last + 1:last + 2]  # the first of blank lines, a mistake where more follows


def _rows(path: Path, number: int, lines: list, names: list, factors: dict) -> tuple:
    """Numbers (rows, columns) in SI of lines from `number` on, and the rows of the other columns as texts.

    A block of plain numbers is turned at once, 0.3 us a row and a tenth of the memory; one in which anything else
    stands goes line by line, so that a mistake is named.
    """
    joined = ",".join(lines)
    if len(names) == len(factors) and _PLAIN.fullmatch(joined):
        if all(line.count(",") == len(names) - 1 for line in lines):
            try:
                table = np.array(list(map(float, joined.split(",")))).reshape(len(lines), -1) * list(factors.values())
            except ValueError:  # an empty cell, or signs of a number that are none
                table = np.full((1, 1), np.inf)
            if np.abs(table).max() <= BEYOND:
                return table, []
    numbers, texts = [], []
    for at, line in enumerate(lines, number):
        cells = _cells(path, at, line, names)
        numbers.append([_number(path, at, name, cells[name], factor) for name, factor in factors.items()])
        texts.append([cells[name] for name in names if name not in factors])
    return np.array(numbers).reshape(len(numbers), len(factors)), texts


def text_of(path: Path, what: str, remedy: str = "") -> str:
    """The text of a file with plain ends of lines; Missing where there is none, PatchfemError where it is too large."""
    return "\n".join(line for lines in lines_of(path, what, remedy) for line in lines)


def lines_of(path: Path, what: str, remedy: str = ""):
    """The lines of a file some megabyte at a time, the last of which may be empty; errors as `text_of`."""
    decoder = IncrementalNewlineDecoder(getincrementaldecoder("utf-8-sig")(), translate=True)
    begun, seen = [], 0
    try:
        with open(path, "rb") as file:
            while data := file.read(BLOCK):
                seen += len(data)
                if seen > LARGEST:
                    raise PatchfemError(f"{path}: more than {LARGEST >> 20} MiB of text; keep every few rows of {what}")
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
    absent = [one for one, *others in map(str.split, wanted) if not {one, *others} & set(names)]
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


def _number(path, number: int, name: str, cell: str, factor: float) -> float:
    if not NUMBER.fullmatch(cell) or not np.isfinite(float(cell)):
        raise PatchfemError(f"{path}:{number}: {name}: '{cell[:80]}' is not a finite number")
    value = float(cell) * factor
    if abs(value) > BEYOND:
        raise PatchfemError(f"{path}:{number}: {name}: {value:g} in SI is beyond what can be computed with, {BEYOND:g}")
    return value
