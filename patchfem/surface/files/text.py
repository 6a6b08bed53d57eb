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
import re
from array import array
from collections.abc import Iterator

import numpy as np

from ...core import PatchfemError
from ...inputs.damage import shorten
from ...inputs.tables import NUMBER_PATTERN
from .content import Content
from .header import (
    COMMENT_SIGNS,
    MISSING_HEIGHT_PATTERN,
    Column,
    Header,
    parse_fact,
    read_header,
    split_cells,
)
from .table import Table
from .units import HEADER_EXAMPLE, MISSING_SIZE_REMEDY, parse_length_unit


def read_text(content: Content, *, has_units: bool = False) -> Table:
    """Read the columns or the matrix in the content of a text file.

    `has_units` tells whether the user states the units. Columns of unknown names are then taken in their order.
    """
    path = content.path
    header, lines = read_header(path, enumerate(io.StringIO(_decode(content)), 1))
    facts = header.facts
    is_sized = "width" in facts and (header.count == 1 or "height" in facts)
    if not header.columns and (header.count > 3 or is_sized):
        return _make_matrix(path, facts, _read_rows(path, lines, ["z"] * header.count)[0])
    place = f"{path}:{header.number}"
    columns, notes = _find_coordinates(place, header, has_units=has_units)
    numbers, row_lines = _read_rows(path, lines, [column.coordinate for column in columns])

    values = {}
    units = {}
    for column, column_numbers in zip(columns, numbers.T):
        if column.coordinate != "index":
            values[column.coordinate] = column_numbers
            fact = facts.get("value units" if column.coordinate == "z" else "lateral units")
            units[column.coordinate] = fact if column.unit is None else column.unit
    length, unit = parse_fact(facts.get("length", ""))
    length = length and length * (parse_length_unit(unit) or 0.0)
    return Table(path, values, units, place, row_lines, notes, length=length or None)


def _decode(content: Content) -> str:
    r"""Decode the content of a text file, with \n at the ends of lines and without quotes."""
    data = content.data
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    # No text contains control characters
    if re.search(r"[\x00-\x08\x0e-\x1f\x7f]", text):
        raise PatchfemError(
            f"{content.path}: not a text file; export the profile as text with two columns and {HEADER_EXAMPLE}"
        )
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    # Numbers in quotes with a decimal comma
    text = re.sub(r'"\s*([+-]?[0-9]*),([0-9]+(?:[eE][+-]?[0-9]+)?)\s*"', r"\1.\2", text)
    return text.replace('"', "")


def _find_coordinates(
    place: str, header: Header, *, has_units: bool
) -> tuple[list[Column], tuple[str, ...]]:
    """Find which columns of a text file are x, y and z.

    Parameters
    ----------
    place : str
        File and line, for messages.
    header : Header
        What stands above the numbers.
    has_units : bool
        Whether the user states the units. Then columns of unknown names have their coordinates in their order.

    Returns
    -------
    columns : list of Column
        The columns with their coordinates.
    notes : tuple of str
        A note if the coordinates follow from the order.
    """
    default_coordinates = {2: "xz", 3: "xyz"}.get(header.count, "z")
    columns = header.columns or list(map(Column, default_coordinates))
    data = [column for column in columns if column.coordinate != "index"]
    if len(data) not in (2, 3):
        raise PatchfemError(
            f"{place}: {len(data)} columns of numbers, but x and z, or x, y and z, are needed; keep one trace of two "
            f"columns and {HEADER_EXAMPLE}"
        )

    # Coordinates by the names of the columns, or in the order of the columns where the user states the units.
    known = ["x", "z"] if len(data) == 2 else ["x", "y", "z"]
    coordinates = [column.coordinate for column in data]
    if sorted(coordinates) == ["x", "y"]:
        # Columns x and y are a trace whose heights are named y.
        coordinates = [coordinate.replace("y", "z") for coordinate in coordinates]

    notes = ()
    if sorted(coordinates) != known:
        listed = ", ".join(f"'{shorten(column.name)}'" for column in data)
        if not has_units:
            raise PatchfemError(
                f"{place}: the columns {listed} are not {', '.join(known)}, which are needed; {HEADER_EXAMPLE}"
            )
        notes = (f"{place}: columns {listed} are taken as {', '.join(known)} in this order",)
        coordinates = known

    named = iter(coordinates)
    return [
        column if column.coordinate == "index" else column._replace(coordinate=next(named))
        for column in columns
    ], notes


def _make_matrix(path, facts: dict[str, str], z) -> Table:
    """Return the table of a matrix of heights, with the size and the units that its header states.

    Parameters
    ----------
    path : Path
        File, for messages.
    facts : dict of str to str
        What the header states, such as {"width": "4 um"}.
    z : (m, n) array
        Heights in the unit of the file.
    """
    if z.shape[1] == 1 and "height" not in facts:
        z = z.T  # a trace with one height in each line

    # No header tells whether the first row and the first column are coordinates. Evenly spaced numbers in both are
    # coordinates, unless the second row is even as well, as that of a tilted plane.
    has_axes = min(z.shape) > 3 and _is_even(z[0, 1:]) and _is_even(z[1:, 0])
    if has_axes and not _is_even(z[1, 1:]):
        raise PatchfemError(
            f"{path}: the first row and the first column of the matrix grow evenly, like coordinates and not "
            "heights; leave out this row and this column"
        )

    axes = (("x", "width", z.shape[1]), ("y", "height", z.shape[0]))
    columns = {}
    units = {"z": facts.get("value units")}
    for coordinate, name, count in axes if z.shape[0] > 1 else axes[:1]:
        size, units[coordinate] = parse_fact(facts.get(name, ""))
        if size is None or not 0 < size < np.inf:
            raise PatchfemError(
                f"{path}: the rows are a matrix of heights (a map, or more than three numbers in a "
                f"row), but the {name} of the scan is not given as a length above zero; {MISSING_SIZE_REMEDY}"
            )
        columns[coordinate] = np.arange(count) * size / count
    columns["z"] = z if z.shape[0] > 1 else z[0]
    return Table(path, columns, units, str(path), remedy=MISSING_SIZE_REMEDY)


def _is_even(values: np.ndarray) -> bool:
    """Return whether values (n,) increase by equal steps, within 1e-6 of the first step."""
    steps = np.diff(values)
    # The steps of heights vary more
    return bool(steps[0] > 0 and np.ptp(steps) < 1e-6 * steps[0])


def _read_rows(
    path, lines: Iterator[tuple[int, str]], coordinates: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Read all rows of numbers of a text file.

    A million rows of two columns take three seconds.

    Parameters
    ----------
    path : Path
        For messages.
    lines : iterator of (int, str)
        Numbers and texts of the lines below the header. The first row shows the delimiter of all.
    coordinates : list of str
        Role of each column. A height "z" may be missing, and an "index" is not read.

    Returns
    -------
    numbers : (m, n) array
    row_lines : (m,) array
        Line of each row.
    """
    is_matrix = set(coordinates) == {"z"}
    numbers = array("d")
    row_lines = array("q")
    delimiter = None
    has_comma = has_point = False
    for number, line in lines:
        line = line.strip(" \n")
        place = f"{path}:{number}: '{shorten(line)}'"
        if line.startswith(COMMENT_SIGNS):  # one with a setting in a matrix belongs to another scan
            if is_matrix and re.search("[:=]", line):
                raise PatchfemError(
                    f"{place} ends the scan or begins another one; keep only one scan per file"
                )
            continue
        if not line.strip(" \t,;|"):
            continue
        if not row_lines:
            delimiter = split_cells(line)[1]

        # All rows must have the same decimal sign.
        has_point |= "." in line
        has_comma |= delimiter != "," and "," in line
        if has_comma and has_point:
            raise PatchfemError(
                f"{place}: a decimal comma and a decimal point in one file; use the same sign in the whole file"
            )
        cells = (line.replace(",", ".") if has_comma else line).split(delimiter)
        cells = [cell.strip() for cell in cells]
        while len(cells) > len(coordinates) and not cells[-1]:
            cells.pop()  # empty cells behind the last column
        if len(cells) != len(coordinates):
            is_decimal = delimiter == "," and len(cells) == 2 * len(coordinates)
            remedy = "with a decimal comma, separate the columns by semicolons or tabs"
            remedy = remedy if is_decimal else "write nan for a missing height"
            raise PatchfemError(f"{place}: {len(coordinates)} numbers are needed; {remedy}")
        numbers.extend([_parse_cell(f"{path}:{number}", *pair) for pair in zip(coordinates, cells)])
        row_lines.append(number)
    return np.array(numbers).reshape(-1, len(coordinates)), np.array(row_lines)


def _parse_cell(place: str, coordinate: str, cell: str) -> float:
    """Return the number in a cell, or NaN for a missing height.

    PatchfemError is raised for other text. `place` is file and line for the message, and `coordinate` is the name of the
    column.
    """
    if NUMBER_PATTERN.fullmatch(cell):
        return float(cell)
    if coordinate == "index" or (coordinate == "z" and MISSING_HEIGHT_PATTERN.fullmatch(cell)):
        return np.nan
    raise PatchfemError(
        f"{place}: '{shorten(cell)}' is not a number for {coordinate}; correct the line, or write a missing height as nan"
    )
