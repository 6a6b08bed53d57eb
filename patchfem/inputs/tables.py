"""Tables whose header states the units of their columns: the only reader of .csv and .txt files of numbers.

Commas, semicolons or tabs separate the cells, whichever the header has most of, and a unit stands in brackets behind
the name of its column: ``time [s]`` or ``time (s)``. NumPy is imported only for columns of numbers, because `patchfem
check` reads tables of measured responses.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..disk.open_with_timeout import open_for_reading
from ..exceptions import Missing, PatchfemError
from .damage import shorten
from .units import find_unit_factor

if TYPE_CHECKING:
    import numpy as np

MAX_TABLE_BYTES = 64 * 2**20  # largest size of a text file in bytes
MAX_LINE_CHARACTERS = 80  # largest number of characters of a quoted line
MAX_SI_VALUE = 1e50  # largest value in SI; the keys of a scene have the same limit
# Pattern of a number in a table
NUMBER_PATTERN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_HEAD_PATTERN = re.compile(r"(.*?)\s*(?:\[\s*([^\[\]]*?)\s*\]|\(\s*([^()]*?)\s*\))?", re.S)


class TableFormat(NamedTuple):
    """Columns that a table may have, and the words for them in error messages.

    - units: factors to SI by unit, for each column of numbers by its name. The unit "" stands for a column without a
      unit.
    - required: columns that must be there. "displacement slide" accepts either name.
    - example: header of such a table.
    - contents: what the file is, such as "a drive".
    """

    units: Mapping
    required: tuple[str, ...]
    example: str
    contents: str


class Columns(NamedTuple):
    """Columns of a table; row i is on line i + 2 of the file, because the header is on line 1.

    - values: values (k,) in SI of each column of numbers, by its name.
    - labels: k texts of each other column, by its name.
    """

    values: dict[str, np.ndarray]
    labels: dict[str, tuple[str, ...]]


class TextTable(NamedTuple):
    """Text of a table.

    - path: file.
    - header: first line of the file.
    - names, units: name and unit of each column. The unit is None if there is none.
    - separator: sign between the cells.
    - lines: lines below the header, without blank ones at the end.
    """

    path: Path
    header: str
    names: list[str]
    units: list[str | None]
    separator: str
    lines: list[str]

    def iterate_rows(self, *, skips_blank: bool = False) -> Iterator[tuple[int, list[str]]]:
        """Yield the number of each line, from 2 on, and its cells.

        An error names a line with too few or too many cells. Lines without any text are left out if `skips_blank`.
        """
        for number, line in enumerate(self.lines, 2):
            if skips_blank and not line.strip(f"{self.separator} \t"):
                continue
            cells = split_cells(f"{self.path}:{number}", line, self.separator)
            if len(cells) != len(self.names):
                columns = shorten(", ".join(self.names), 3 * MAX_LINE_CHARACTERS)
                raise PatchfemError(
                    f"{self.path}:{number}: the number of cells must be {len(self.names)} ({columns}), not "
                    f"{len(cells)} as in '{shorten(line, MAX_LINE_CHARACTERS)}'"
                )
            yield number, cells


def split_cells(location: str, line: str, separator: str) -> list[str]:
    """Split a line into its cells, which may stand in quotation marks.

    Parameters
    ----------
    location : str
        Beginning of the error message, such as ``a.csv:3``.
    line : str
        Line of the table, without its line break.
    separator : str
        Sign between the cells.

    Raises
    ------
    PatchfemError
        If a quotation mark is not closed.
    """
    cells = line.split(separator)
    try:
        if '"' in line:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:
        raise PatchfemError(
            f"{location}: the quotation marks in this row cannot be read ({error}); close each of them"
        ) from None
    return [cell.strip() for cell in cells]


def read_text(path: Path, contents: str) -> TextTable:
    """Read a table whose columns may have any names.

    Parameters
    ----------
    path : Path
        File to read.
    contents : str
        What the file is, such as "a drive".

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the file cannot be read or is too large.
    """
    try:
        with open_for_reading(path) as file:
            data = file.read(MAX_TABLE_BYTES + 1)
        if len(data) > MAX_TABLE_BYTES:
            raise PatchfemError(
                f"{path}: more than {MAX_TABLE_BYTES >> 20} MiB of text; leave out some rows of {contents}"
            )
        text = data.decode("utf-8-sig")
    except FileNotFoundError:
        raise Missing(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise PatchfemError(f"{path}: {contents} cannot be read ({reason})") from None

    # Lines end as on any system. Blank ones at the end do not count.
    header, *lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    separator = max(",;\t", key=header.count)
    cells = split_cells(f"{path}:1", header, separator)
    heads = [_HEAD_PATTERN.fullmatch(cell).groups() for cell in cells]
    units = [unit if other is None else other for _, unit, other in heads]
    return TextTable(path, header, [name for name, *_ in heads], units, separator, lines)


def find_factors(table: TextTable, form: TableFormat) -> dict[str, float]:
    """Return the factor to SI of each column of numbers in a table.

    Raises PatchfemError if the header is not that of the format, `form`.
    """
    names = table.names
    expected = (
        f"{table.path}:1: a header like `{form.example}` is needed, not "
        f"'{shorten(table.header, MAX_LINE_CHARACTERS)}'"
    )
    if len(set(names)) < len(names):
        raise PatchfemError(f"{expected} (a column is given twice)")

    # A column that the format does not know is text, whose unit has no meaning.
    factors = {}
    for name, unit in zip(names, table.units):
        units = form.units.get(name)
        if units is None:
            continue
        if unit is None and "" not in units:
            raise PatchfemError(f"{expected} ({name} without a unit)")
        factors[name] = find_unit_factor(name, unit or "", f"{table.path}:1: ", units)

    # An entry such as "displacement slide" is met by either column.
    absent = [text.split()[0] for text in form.required if not set(text.split()) & set(names)]
    if absent:
        raise PatchfemError(f"{expected} (no column {', '.join(absent)})")
    return factors


def has_decimal_comma(cell: str) -> bool:
    """Return whether the text of a cell is a number with a comma in place of the decimal point."""
    return "," in cell and bool(NUMBER_PATTERN.fullmatch(cell.replace(",", ".", 1)))


def parse_number(location: str, cell: str, factor: float) -> float:
    """Convert the text of a cell to a number in SI.

    Parameters
    ----------
    location : str
        Beginning of the error message, such as ``a.csv:3: force``.
    cell : str
        Text of the cell.
    factor : float
        Factor to SI.

    Raises
    ------
    PatchfemError
        If the cell is not a finite number, or larger than `MAX_SI_VALUE`.
    """
    if not NUMBER_PATTERN.fullmatch(cell):
        reason = "is not a finite number"
        if has_decimal_comma(cell):
            reason = "has a decimal comma; export the file with decimal points"
        raise PatchfemError(f"{location}: '{shorten(cell)}' {reason}")
    value = float(cell) * factor
    if abs(value) > MAX_SI_VALUE:
        raise PatchfemError(
            f"{location}: {value:g} in SI is outside the computable range; at most {MAX_SI_VALUE:g} is possible"
        )
    return value


def _read_numbers(table: TextTable, factors: dict[str, float]) -> dict[str, np.ndarray]:
    """Return the columns (k,) of a table that contains only numbers in range, in SI, and else nothing.

    `factors` are those to SI by column. NumPy's reader takes a tenth of the time of `parse_number`, but does not say
    which cell is wrong.
    """
    import numpy as np

    from ..core import frozen_array

    if len(factors) < len(table.names):
        return {}
    try:
        numbers = np.loadtxt(table.lines, delimiter=table.separator, comments=None, ndmin=2)
    except ValueError:
        return {}
    # NumPy leaves out blank lines.
    scales = np.array(list(factors.values()))
    is_complete = numbers.shape == (len(table.lines), scales.size)
    if not is_complete or not (np.abs(numbers) <= MAX_SI_VALUE / scales).all():
        return {}
    return {name: frozen_array(column) for name, column in zip(factors, (numbers * scales).T)}


def read_columns(path, form: TableFormat) -> Columns:
    """Read a table of numbers; columns that ``form.units`` does not know are kept as text.

    Parameters
    ----------
    path : path-like
        CSV file.
    form : TableFormat
        Columns that the table may have.

    Returns
    -------
    Columns

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the file is not such a table, or if its times do not rise; the message names the line.
    """
    from ..core import frozen_array

    path = Path(path)
    table = read_text(path, form.contents)
    factors = find_factors(table, form)
    if len(table.lines) < 2:
        raise PatchfemError(
            f"{path}:{len(table.lines) + 1}: {form.contents} needs at least two rows below the header, "
            f"not {len(table.lines)}"
        )

    values = _read_numbers(table, factors)
    labels = {}
    # Cells are read one by one if there is text among them, or a cell at fault to name.
    rows = [] if values else [cells for _, cells in table.iterate_rows()]
    for name, cells in zip(table.names, zip(*rows)):
        if name not in factors:
            labels[name] = cells
            continue
        numbers = []
        for line, cell in enumerate(cells, 2):
            numbers.append(parse_number(f"{path}:{line}: {name}", cell, factors[name]))
        values[name] = frozen_array(numbers)
    if "time" in values:
        require_increasing_time(f"{path}:", values["time"])
    return Columns(values, labels)


def require_increasing_time(place: str, time: np.ndarray, second_row: int = 3) -> None:
    """Raise PatchfemError at the first row whose time (k,) [s] does not rise.

    Parameters
    ----------
    place : str
        Beginning of the message, which the number of the row follows, such as ``a.csv:``.
    time : (k,) array
        Times [s].
    second_row : int
        Number of the second row, 3 in a table with a header.
    """
    import numpy as np

    late = np.flatnonzero(np.diff(time) <= 0)
    if late.size:
        k = int(late[0])
        raise PatchfemError(
            f"{place}{k + second_row}: time {time[k + 1]:.9g} s is not later than the time before it, "
            f"{time[k]:.9g} s; times must strictly rise"
        )
