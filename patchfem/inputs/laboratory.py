"""Any file of a laboratory as `Records`, by its ending: universal files, .mat files by an explicit map, tables.

A table has a header such as `Time [s],Load cell [lbf]`, then rows; comma, semicolon or tab between. Of a .mat file a
variable, a field of a structure or a column of either is named for each quantity, with its unit.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..core import Missing, PatchfemError
from . import matlab, universal
from .cells import NUMBER_PATTERN, read_text
from .loops import EXPORTED_NAMES, standard_name
from .records import (
    MAX_BYTES,
    UNITS,
    Channel,
    Records,
    RequestedChannel,
    make_records,
    select_channels,
    unit_factor,
)

UNIVERSAL_ENDINGS = (".uff", ".unv", ".uf", ".58")
ENDINGS = (*UNIVERSAL_ENDINGS, ".mat", ".csv", ".txt")
# channels of every motion of `patchfem export`
EXPORTED = (
    "absolute_acceleration",
    "base_acceleration",
)
WIDEST = 1000  # columns of a table
_HEAD = re.compile(r"(.*?)\s*(?:\[\s*([^\[\]]*?)\s*\]|\(\s*([^()]*?)\s*\))?", re.S)
_COLUMN = re.compile(r"([\w.]+)\(:,\s*([1-9][0-9]*)\)")


def read_records(path, asked: list, own: Mapping = EXPORTED_NAMES) -> Records:
    """Records over time of a file, in SI; asked: `RequestedChannel` channels, none to take those
    that say what they are.

    own: quantity -> the names of `patchfem export` that stand for it, as of `loops.own_name`. PatchfemError names the
    file and what is wanted, Missing where there is no file.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending == ".mat":
        return _variables(path, asked)
    if ending in UNIVERSAL_ENDINGS:
        return read_datasets_as_records(path, universal.read_datasets(path), asked, own)
    if ending in ENDINGS:
        return select_channels(path, _columns(path, own), asked, [])
    raise PatchfemError(f"{path}: the name of an imported file must end in {', '.join(ENDINGS)}")


def read_datasets_as_records(
    path, sets: list, asked: list, own: Mapping = EXPORTED_NAMES
) -> Records:
    """Records over time among the datasets of a universal file; PatchfemError where there is none. own: as
    `read_records` has it."""
    notes = []
    there = universal.record_channels(path, sets, notes)
    names = [one.name for one in there]
    if set(EXPORTED) <= set(names):  # types of data do not tell its displacements apart
        ours = [standard_name(name, names, own) for name in names]
        there = [
            one._replace(quantity=known if known in UNITS else "")
            for one, known in zip(there, ours)
        ]
    if not there:
        raise PatchfemError(
            f"{path}: contains no record over time (dataset 58, function type 1), only modes or "
            "frequency responses; write these as the modes of a scene with -o modes.toml"
        )
    return select_channels(path, there, asked, notes)


def _columns(path: Path, own: Mapping) -> list:
    """`Channel`s of the columns of numbers; one whose name is a quantity (in any letters), or what `patchfem export`
    calls it, is taken as it; own: as `read_records` has it.

    Columns with a text in any row are left out. PatchfemError with file and line for a row of another length and for a
    header of numbers, Missing where there is no file.
    """
    lines = read_text(path, "a measured table").rstrip("\n").split("\n")
    mark = max(",;\t", key=lines[0].count)
    heads = [_HEAD.fullmatch(_bare(cell)) for cell in lines[0].split(mark)]
    names = [one[1] for one in heads]
    if (
        len(names) > WIDEST
        or len(lines) < 3
        or any(NUMBER_PATTERN.fullmatch(name) for name in names)
    ):
        raise PatchfemError(
            f"{path}:1: a header like `time [s],displacement [mm],force [N]` over at least two rows is "
            f"needed, not '{lines[0][:80]}'"
        )
    rows = []
    for number, line in enumerate(lines[1:], 2):
        cells = [_bare(cell) for cell in line.split(mark)]
        if len(cells) != len(names):
            raise PatchfemError(
                f"{path}:{number}: {len(cells)} cells, but {len(names)} column names"
            )
        rows.append(cells)
    found, plain = [], [name.strip().lower().replace(" ", "_") for name in names]
    ours = [standard_name(name, plain, own) for name in plain]
    for name, known, head, column in zip(names, ours, heads, zip(*rows)):
        if not all(map(NUMBER_PATTERN.fullmatch, column)):
            _refuse_commas(path, name, column)
            continue
        found.append(
            Channel(
                name,
                "",
                known if known in UNITS else "",
                head[2] or head[3] or "",
                np.array(column, float),
            )
        )
    return found


def _bare(cell: str) -> str:
    return cell.strip().strip('"').strip()


def _refuse_commas(path, name: str, column) -> None:
    """PatchfemError for numbers that are written with a decimal comma."""
    odd = next(
        (number, cell)
        for number, cell in enumerate(column, 2)
        if not NUMBER_PATTERN.fullmatch(cell)
    )
    if NUMBER_PATTERN.fullmatch(odd[1].replace(",", ".", 1)):
        raise PatchfemError(
            f"{path}:{odd[0]}: {name}: '{odd[1][:40]}' has a decimal comma; export the file with "
            "decimal points"
        )
    if name.strip().lower() in UNITS:
        raise PatchfemError(f"{path}:{odd[0]}: {name}: '{odd[1][:40]}' is not a finite number")


def _variables(path: Path, asked: list) -> Records:
    """`Records` of a .mat file; asked: `RequestedChannel`, each with a variable such as `F`,
    `data(:,2)` or `run.load.F`.

    Only real arrays are read; nothing in the file is run or unpickled. PatchfemError names what is not there,
    Missing where there is no file.
    """
    if not path.is_file():
        raise Missing(f"{path}: there is no such file")
    if path.stat().st_size > MAX_BYTES:
        raise PatchfemError(
            f"{path}: more than {MAX_BYTES >> 20} MiB; save fewer variables or a part of the record"
        )
    arrays = {
        name: one
        for name, one in matlab.read_variables(path, matlab.read_bytes(path)).items()
        if one.kind == "number"
    }
    held = (
        ", ".join(
            f"{name} {'x'.join(map(str, one.shape))}" for name, one in list(arrays.items())[:20]
        )
        or "no array of numbers (objects, and structures with several elements, cannot be read)"
    )
    if not asked:
        raise PatchfemError(
            f'{path}: assign the variables of the file, such as --map "time=t [s]" --map '
            f'"force=F [N]"; the file contains {held}'
        )
    return make_records(
        path,
        {
            one.quantity: _values(path, arrays, one, held)
            for one in sorted(asked, key=lambda one: one.quantity != "time")
        },
        [],
    )


def _values(path, arrays: dict, one: RequestedChannel, held: str):
    found = _COLUMN.fullmatch(one.source)
    name, column = (found[1], int(found[2]) - 1) if found else (one.source, None)
    if name not in arrays:
        raise PatchfemError(f"{path}: no variable '{name[:40]}'; the file contains {held}")
    if not one.unit:
        raise PatchfemError(
            f"--map {one.quantity}={one.source}: a .mat file has no units; write the unit, such as "
            f'"{one.quantity}={one.source} [unit]"'
        )
    values = arrays[name].values()
    if column is None:
        if values.ndim != 2 or min(values.shape) != 1:
            raise PatchfemError(
                f"{path}: {name} is {'x'.join(map(str, values.shape))}; choose a column such as "
                f"{name}(:,1)"
            )
        values = values.ravel()
    elif values.ndim != 2 or column >= values.shape[1]:
        raise PatchfemError(
            f"{path}: {name} is {'x'.join(map(str, values.shape))}, so it has no column {column + 1}"
        )
    else:
        values = values[:, column]
    return values * unit_factor(one.quantity, one.unit)
