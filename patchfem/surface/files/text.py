"""Text files of columns or of a matrix of heights.

The header `x [um],z [um]` is that of a trace, `x [um],y [um],z [um]` that of a raster.
The columns stand in any order; `x (um)`, `x_um`, `x/um` and `x in um` mean the same, and names and
units may stand in a line each. Columns are separated by commas, semicolons, tabs, bars or blanks.
The decimal sign is a point, or a comma if columns are separated by something else or cells are
quoted. Lines that start with #, % or // are comments, and the header itself may be one. A height
that is empty, `nan`, `bad` or `***` is missing. The encoding is UTF-8, UTF-16 with its mark, or
else Latin-1. An export of Dektak has a header of its own.
"""

import io
import math
import re
from collections.abc import Iterator

import numpy as np

from ...core import PatchfemError
from .content import Content
from .header import Column, Header, parse_fact, read_header
from .rows import read_rows
from .spellings import HEADER_EXAMPLE, SIZE_LINES, parse_length_unit, shorten
from .table import Table

NOT_TEXT = f"export the profile as text with two columns and {HEADER_EXAMPLE}"
# Largest relative range of the steps of coordinates; the steps of heights vary more.
MAX_UNEVEN = 1e-6
_QUOTED_NUMBER = re.compile(r'"\s*([+-]?[0-9]*),([0-9]+(?:[eE][+-]?[0-9]+)?)\s*"')
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")
_DEKTAK_START = "Scan Parameters"
_DEKTAK_HEADER = re.compile(r"^\s*Lateral\s+(\w+)\s*,\s*Raw\s+(\w+)[^\n]*$", re.MULTILINE)
_DEKTAK_LENGTH = re.compile(r"^Length,\s*([0-9]*\.?[0-9]+)\s*(\w+)\s*$", re.MULTILINE)


def read_text(content: Content, units: tuple[str, str] | None = None) -> Table:
    """Read the columns or the matrix of a text file.

    units: those that the user states; with them, columns of unknown names are taken in their order.
    """
    path = content.path
    text = _decode(content)
    length = None
    if text.startswith(_DEKTAK_START):
        text, length = _translate_dektak(path, text)
    header, lines = read_header(path, enumerate(io.StringIO(text), 1))
    is_sized = {"width", "height"} <= header.facts.keys() or (
        header.count == 1 and "width" in header.facts
    )
    if not header.columns and (header.count > 3 or is_sized):
        return _read_matrix(path, header, lines)
    table = _read_columns(path, header, lines, has_units=units is not None)
    return table if length is None else table._replace(are_units_fixed=True, length=length)


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
    return _QUOTED_NUMBER.sub(r"\1.\2", text).replace('"', "") if '"' in text else text


def _read_columns(
    path, header: Header, lines: Iterator[tuple[int, str]], *, has_units: bool
) -> Table:
    """Read the columns x and z of a trace, or x, y and z of points of a surface."""
    place = f"{path}:{header.number}"
    if (header.count or len(header.columns)) < 2:
        raise PatchfemError(f"{place}: only one column, but x and z are needed; {HEADER_EXAMPLE}")
    unnamed = [Column(role) for role in ("xz" if header.count == 2 else "xyz")]
    columns, notes = _find_roles(place, header.columns or unnamed, has_units=has_units)
    roles = [column.role for column in columns]
    numbers, row_lines = read_rows(path, lines, roles, header.delimiter)

    values = {}
    units = {}
    for role in ("x", "y", "z"):
        if role not in roles:
            continue
        k = roles.index(role)
        values[role] = numbers[:, k]
        fact = header.facts.get("value units" if role == "z" else "lateral units")
        units[role] = fact if columns[k].unit is None else columns[k].unit
    return Table(path, values, units, place, row_lines, notes)


def _find_roles(
    place: str, columns: list[Column], *, has_units: bool
) -> tuple[list[Column], tuple[str, ...]]:
    """Return the columns with their roles, by order if units are given and names are unknown, and a note on that."""
    data = [k for k, column in enumerate(columns) if column.role != "index"]
    known = ("x", "z") if len(data) == 2 else ("x", "y", "z")
    if len(data) != len(known):
        raise PatchfemError(
            f"{place}: {len(data)} columns of numbers, but x and z, or x, y and z, are needed; keep one trace of two "
            f"columns and {HEADER_EXAMPLE}"
        )
    roles = [columns[k].role for k in data]
    if sorted(roles) == ["x", "y"]:
        # Columns x and y are a trace whose heights are named y.
        roles = [role.replace("y", "z") for role in roles]
    strange = next((columns[k].name for k, role in zip(data, roles) if role not in known), None)
    notes = ()
    if strange is not None and not has_units:
        raise PatchfemError(
            f"{place}: column '{shorten(strange.partition('[')[0])}' is not known; the columns "
            f"{' and '.join(', '.join(known).rsplit(', ', 1))} are needed; {HEADER_EXAMPLE}"
        )
    if strange is not None:
        listed = ", ".join(f"'{shorten(columns[k].name)}'" for k in data)
        notes = (f"{place}: columns {listed} are taken as {', '.join(known)} in this order",)
        roles = list(known)
    for role in known:
        if roles.count(role) != 1:
            raise PatchfemError(f"{place}: two columns are named {role}; {HEADER_EXAMPLE}")
    columns = list(columns)
    for k, role in zip(data, roles):
        columns[k] = columns[k]._replace(role=role)
    return columns, notes


def _read_matrix(path, header: Header, lines: Iterator[tuple[int, str]]) -> Table:
    """Read a matrix of heights, with the size and the units that its header states."""
    z = read_rows(path, lines, ["z"] * header.count, header.delimiter).numbers
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


def _translate_dektak(path, text: str) -> tuple[str, float | None]:
    """Give an export of Dektak the header of a trace; returns the length [m] in its settings too."""
    header = _DEKTAK_HEADER.search(text)
    if header is None:
        raise PatchfemError(
            f"{path}: a Dektak export without the columns `Lateral um,Raw Micrometer`; export the scan data "
            "as CSV"
        )
    x_unit, z_unit = ("Angstrom" if word == "A" else word for word in header.groups())
    settings = text[: header.start()]
    length = _DEKTAK_LENGTH.search(settings)
    number = parse_length_unit(length[2]) if length else None
    blank_lines = "\n" * settings.count("\n")  # lines keep their numbers for messages
    text = f"{blank_lines}x [{x_unit}],z [{z_unit}]{text[header.end() :]}"
    return text, None if number is None else float(length[1]) * number
