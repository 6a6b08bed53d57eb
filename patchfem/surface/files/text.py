"""Text files of columns or of a matrix of heights.

The header `x [um],z [um]` is that of a trace, `x [um],y [um],z [um]` that of a raster.
The columns stand in any order; `x (um)`, `x_um`, `x/um` and `x in um` mean the same, and names and
units may stand in a line each. Columns are separated by commas, semicolons, tabs, bars or blanks.
The decimal sign is a point, or a comma if columns are separated by something else or cells are
quoted. Lines that start with #, % or // are comments, and the header itself may be one. A height
that is empty, `nan`, `bad` or `***` is missing. The encoding is UTF-8, UTF-16 with its mark, or
else Latin-1. An export of Dektak is such a file; its header gives the length of the scan.
"""

import io
import math
import re

import numpy as np

from ...core import PatchfemError
from .content import Content
from .header import Column, Header, parse_fact, read_header
from .rows import Rows, read_rows
from .spellings import HEADER_EXAMPLE, SIZE_LINES, parse_length_unit, shorten
from .table import Table

NOT_TEXT = f"export the profile as text with two columns and {HEADER_EXAMPLE}"
# Largest relative range of the steps of coordinates; the steps of heights vary more.
MAX_UNEVEN = 1e-6
_QUOTED_NUMBER = re.compile(r'"\s*([+-]?[0-9]*),([0-9]+(?:[eE][+-]?[0-9]+)?)\s*"')
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")


def read_text(content: Content, units: tuple[str, str] | None = None) -> Table:
    """Read the columns or the matrix of a text file.

    units: those that the user states; with them, columns of unknown names are taken in their order.
    """
    path = content.path
    header, lines = read_header(path, enumerate(io.StringIO(_decode(content)), 1))
    has_width = "width" in header.facts
    is_sized = has_width and (header.count == 1 or "height" in header.facts)
    if not header.columns and (header.count > 3 or is_sized):
        return _make_matrix(path, header, read_rows(path, lines, ["z"] * header.count).numbers)
    place = f"{path}:{header.number}"
    columns, notes = _find_roles(place, header, has_units=units is not None)
    rows = read_rows(path, lines, [column.role for column in columns])
    return _make_columns(path, header, columns, rows)._replace(place=place, notes=notes)


def _decode(content: Content) -> str:
    """Decode a text file, with \\n at the ends of lines and without quotes."""
    data = content.data
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    if not text.strip():
        raise PatchfemError(f"{content.path}: the profile is empty; {NOT_TEXT}")
    if _CONTROL.search(text):
        raise PatchfemError(f"{content.path}: not a text file; {NOT_TEXT}")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return _QUOTED_NUMBER.sub(r"\1.\2", text).replace('"', "")


def _find_roles(
    place: str, header: Header, *, has_units: bool
) -> tuple[list[Column], tuple[str, ...]]:
    """Return the columns with their roles, by order if units are given and names are unknown, and a note on that."""
    columns = header.columns or [Column(role) for role in ("xz" if header.count == 2 else "xyz")]
    if header.count < 2:
        raise PatchfemError(f"{place}: only one column, but x and z are needed; {HEADER_EXAMPLE}")
    data = [column for column in columns if column.role != "index"]
    known = {2: ["x", "z"], 3: ["x", "y", "z"]}.get(len(data))
    if known is None:
        raise PatchfemError(
            f"{place}: {len(data)} columns of numbers, but x and z, or x, y and z, are needed; keep one trace of two "
            f"columns and {HEADER_EXAMPLE}"
        )
    roles = [column.role for column in data]
    if sorted(roles) == ["x", "y"]:
        # Columns x and y are a trace whose heights are named y.
        roles = [role.replace("y", "z") for role in roles]
    notes = ()
    if sorted(roles) != known:
        listed = ", ".join(f"'{shorten(column.name)}'" for column in data)
        if not has_units:
            raise PatchfemError(
                f"{place}: the columns {listed} are not {', '.join(known)}, which are needed; {HEADER_EXAMPLE}"
            )
        notes = (f"{place}: columns {listed} are taken as {', '.join(known)} in this order",)
        roles = known
    named = iter(roles)
    return [
        column if column.role == "index" else column._replace(role=next(named))
        for column in columns
    ], notes


def _make_columns(path, header: Header, columns: list[Column], rows: Rows) -> Table:
    """Return the table of the columns x and z of a trace, or x, y and z of points of a surface."""
    values = {}
    units = {}
    for column, numbers in zip(columns, rows.numbers.T):
        if column.role == "index":
            continue
        values[column.role] = numbers
        fact = header.facts.get("value units" if column.role == "z" else "lateral units")
        units[column.role] = fact if column.unit is None else column.unit
    length, unit = parse_fact(path, header.facts.get("length", ""))
    if length is not None:
        factor = parse_length_unit(unit)
        length = length * factor if factor else None
    return Table(path, values, units, str(path), rows.lines, length=length)


def _make_matrix(path, header: Header, z) -> Table:
    """Return the table of a matrix of heights (m, n), with the size and the units that its header states."""
    if z.shape[1] == 1 and "height" not in header.facts:
        z = z.T  # a trace with one height in each line
    has_axes = min(z.shape) > 3 and _is_even(z[0, 1:]) and _is_even(z[1:, 0])
    if has_axes and not _is_even(z[1, 1:]):
        raise PatchfemError(
            f"{path}: the first row and the first column of the matrix grow evenly, like coordinates and not "
            "heights; leave out this row and this column"
        )

    columns = {}
    units = {}
    for role, name, count in (("x", "width", z.shape[1]), ("y", "height", z.shape[0])):
        size, units[role] = parse_fact(path, header.facts.get(name, ""))
        if size is not None and 0 < size < math.inf:
            columns[role] = np.arange(count) * size / count
    columns["z"] = z
    units["z"] = header.facts.get("value units")
    remedy = f"write {SIZE_LINES} and `# Value units: um` above its rows"
    return Table(path, columns, units, str(path), remedy=remedy)


def _is_even(values) -> bool:
    """Return whether numbers (n,) increase by equal steps, within MAX_UNEVEN of the first step."""
    steps = np.diff(values)
    return bool(steps[0] > 0 and np.ptp(steps) < MAX_UNEVEN * steps[0])
