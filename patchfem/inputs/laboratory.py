"""Time records from a universal file, a MATLAB file or a table.

The ending decides. A table has a header such as `Time [s],Load cell [lbf]`, with commas, semicolons or
tabs between the cells. Of a MATLAB file, the user names a variable, a field of a structure or a column of
either for each quantity, with its unit.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..core import PatchfemError
from ..scene.keys.tables import UNIVERSAL_EXTENSIONS
from . import matlab, universal
from .damage import shorten
from .loops import EXPORTED_NAMES, find_standard_name
from .records import (
    Channel,
    Records,
    RequestedChannel,
    select_channels,
)
from .tables import MAX_LINE_CHARACTERS, NUMBER_PATTERN, has_decimal_comma, parse_number, read_text
from .units import CHANNEL_UNITS

RECORD_EXTENSIONS = (*UNIVERSAL_EXTENSIONS, ".mat", ".csv", ".txt")
MAX_TABLE_COLUMNS = 1000  # largest number of columns in a table or an array


def read_records(
    path, requests: list[RequestedChannel], exported_names: Mapping = EXPORTED_NAMES
) -> Records:
    """Read measured records over time from a laboratory file.

    Parameters
    ----------
    path : path-like
        File to read.
    requests : list of RequestedChannel
        Without any, the channels whose quantity the file states are read.
    exported_names : Mapping
        Quantity -> names of `patchfem export` that stand for it, the preferred one first.

    Returns
    -------
    Records

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the file cannot be read, or lacks a requested channel.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending == ".mat":
        return _read_matlab(path, requests)
    if ending in UNIVERSAL_EXTENSIONS:
        return _read_universal(path, requests, exported_names)
    if ending in RECORD_EXTENSIONS:
        return select_channels(path, _read_table(path, exported_names), requests, [])
    raise PatchfemError(
        f"{path}: the name of an imported file must end in {', '.join(RECORD_EXTENSIONS)}"
    )


def _read_universal(
    path: Path, requests: list[RequestedChannel], exported_names: Mapping
) -> Records:
    """Read the requested channels of a universal file, by default all that it states a quantity for.

    `path` is the file, `requests` are the channels that the user asks for, and `exported_names` has the names that
    patchfem gives to columns of its own exports, which say more than the data types of the file.
    """
    notes = []
    channels = universal.make_channels(path, universal.read_datasets(path), notes)
    names = [channel.name for channel in channels]
    # Every motion of `patchfem export` has these channels
    if {"absolute_acceleration", "base_acceleration"} <= set(names):
        # The data types do not distinguish the displacements of an export; the names do.
        channels = [
            channel._replace(quantity=_find_quantity(channel.name, names, exported_names))
            for channel in channels
        ]
    if not channels:
        raise PatchfemError(
            f"{path}: contains no record over time (dataset 58, function type 1), only modes or "
            "frequency responses; name a file of mode shapes in the scene as structure.file"
        )
    return select_channels(path, channels, requests, notes)


def _find_quantity(name: str, names: list[str], exported_names: Mapping) -> str:
    """Return the quantity that the name of a column states, or "" if it states none.

    `names` are those of all columns. `exported_names` maps names of columns in files that patchfem exports to quantities.
    """
    quantity = find_standard_name(name, names, exported_names)
    return quantity if quantity in CHANNEL_UNITS else ""


def _read_table(path: Path, exported_names: Mapping) -> list[Channel]:
    """Read the numeric columns of the table `path` as channels.

    Columns of text are left out. `exported_names` has the names that patchfem gives to columns of its own exports.
    """
    table = read_text(path, "a measured table")
    names = table.names
    is_data = any(map(NUMBER_PATTERN.fullmatch, names))
    if len(names) > MAX_TABLE_COLUMNS or len(table.lines) < 2 or is_data:
        raise PatchfemError(
            f"{path}:1: a header like `time [s],displacement [mm],force [N]` over at least two rows is "
            f"needed, not '{shorten(table.header, MAX_LINE_CHARACTERS)}'"
        )
    columns = [name.lower().replace(" ", "_") for name in names]
    channels = []
    rows = [cells for _, cells in table.iterate_rows()]
    for name, unit, column, cells in zip(names, table.units, columns, zip(*rows)):
        quantity = _find_quantity(column, columns, exported_names)
        row = next((k for k, cell in enumerate(cells) if not NUMBER_PATTERN.fullmatch(cell)), None)
        if row is None:
            values = np.array(cells, float)
            channels.append(Channel(name, "", quantity, unit or "", values))
        elif column in CHANNEL_UNITS or has_decimal_comma(cells[row]):
            # This cell is no number, and the error says why.
            parse_number(f"{path}:{row + 2}: {shorten(name)}", cells[row], 1.0)
    return channels


def _read_matlab(path: Path, requests: list[RequestedChannel]) -> Records:
    """Read the requested variables of the MATLAB file `path`, such as `F`, `data(:,2)` or `run.load.F`.

    Only real arrays are read; nothing in the file is executed.
    """
    channels = []
    for name, values in matlab.read_real_arrays(path).items():
        if values.ndim != 2:
            continue
        if 1 in values.shape:
            channels.append(Channel(name, "", "", "", values.ravel()))
        else:
            columns = enumerate(values.T[:MAX_TABLE_COLUMNS], 1)
            channels += [Channel(f"{name}(:,{k})", "", "", "", column) for k, column in columns]
    requests = [request._replace(source=request.source.replace(" ", "")) for request in requests]
    return select_channels(path, channels, requests, [])
