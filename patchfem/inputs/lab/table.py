"""Channels of a table: a header such as `Time [s],Load cell [lbf]`, then rows; comma, semicolon or tab between."""

import re
from pathlib import Path

import numpy as np

from ...core import PatchfemError
from ..columns import NUMBER, text_of
from ..loops import own_name
from .records import UNITS, Channel

_HEAD = re.compile(r"(.*?)\s*(?:\[\s*([^\[\]]*?)\s*\]|\(\s*([^()]*?)\s*\))?", re.S)
WIDEST = 1000  # columns


def channels(path: Path) -> list:
    """`Channel`s of the columns of numbers; one whose name is a quantity (in any letters), or what `patchfem export`
    calls it, is taken as it.

    Columns with a text in any row are left out. PatchfemError with file and line for a row of another length and for a
    header of numbers, Missing where there is no file.
    """
    path = Path(path)
    lines = text_of(path, "a measured table").rstrip("\n").split("\n")
    mark = max(",;\t", key=lines[0].count)
    heads = [_HEAD.fullmatch(_bare(cell)) for cell in lines[0].split(mark)]
    names = [one[1] for one in heads]
    if len(names) > WIDEST or len(lines) < 3 or any(NUMBER.fullmatch(name) for name in names):
        raise PatchfemError(f"{path}:1: a header like `time [s],displacement [mm],force [N]` over at least two rows is "
                            f"wanted, not '{lines[0][:80]}'")
    rows = []
    for number, line in enumerate(lines[1:], 2):
        cells = [_bare(cell) for cell in line.split(mark)]
        if len(cells) != len(names):
            raise PatchfemError(f"{path}:{number}: {len(cells)} cells under {len(names)} columns")
        rows.append(cells)
    found, plain = [], [name.strip().lower().replace(" ", "_") for name in names]
    ours = [own_name(name, plain) for name in plain]
    for name, known, head, column in zip(names, ours, heads, zip(*rows)):
        if not all(map(NUMBER.fullmatch, column)):
            _refuse_commas(path, name, column)
            continue
        found.append(Channel(name, "", known if known in UNITS else "", head[2] or head[3] or "",
                             np.array(column, float)))
    return found


def _bare(cell: str) -> str:
    return cell.strip().strip('"').strip()


def _refuse_commas(path, name: str, column) -> None:
    """PatchfemError for numbers that are written with a decimal comma."""
    odd = next((number, cell) for number, cell in enumerate(column, 2) if not NUMBER.fullmatch(cell))
    if NUMBER.fullmatch(odd[1].replace(",", ".", 1)):
        raise PatchfemError(f"{path}:{odd[0]}: {name}: '{odd[1][:40]}' has a decimal comma; export it with points")
    if name.strip().lower() in UNITS:
        raise PatchfemError(f"{path}:{odd[0]}: {name}: '{odd[1][:40]}' is not a finite number")
