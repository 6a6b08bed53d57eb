"""Numbers and units of a surface file, and the trace or areal scan that they describe."""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal
from ..profile import Profile
from .spellings import (
    GIVE_PIXEL_SIZE,
    GIVE_UNITS,
    HEADER_EXAMPLE,
    SCAN_HEADER_EXAMPLE,
    SIZE_LINES,
    UNIT_LIST,
    UNITS,
    parse_length_unit,
    parse_pixel_size,
    shorten,
)

MAX_POINTS = 50_000_000  # largest number of heights
MAX_LENGTH = 10.0  # length or coordinate [m] above which a number has a wrong unit
MIN_LENGTH = 1e-9  # length [m] below which a trace has a wrong unit
ATOM_WIDTH = 1e-10  # span of heights [m] below which they have a wrong unit
# Largest fraction of the highest, and of the lowest, heights that may be faults, such as 999 um for no signal.
FAULT_FRACTION = 0.01
MIN_ROUNDED = (
    10  # smallest number of positions that shows whether they are even apart from rounding
)
MAX_ROUNDING = (
    0.75  # largest distance from even positions in printed digits, half of which is rounding
)
MIN_PRINTED_DIGIT = 1e-11  # smallest printed digit of a position [m]
DIGIT_TOL = 1e-4  # largest deviation from a multiple of a digit, relative to it, that is round-off
# Largest distance of positions that count as equal, relative to the length of the axis.
ROUND_OFF = 1e-9
MAX_CELLS_PER_POINT = 4  # largest number of raster cells per point; scattered points need more


class Table(NamedTuple):
    """Numbers of a file in its own units.

    columns: "x" and "z" (n,) of a trace, with "y" (n,) of the points of a scan, or "z" (m, n) of a matrix with
    "x" (n,) and "y" (m,) if the file gives them; NaN: missing height. units: of each column, None where the
    file states none. place: file, with the line that names the columns if there is one. lines: of each sample
    in the file. notes: sentences on the file. are_units_fixed: whether the format defines or always states its
    units. remedy: how the file would state its units. length: of the scan [m], if the header gives it.
    """

    path: object
    columns: dict[str, np.ndarray]
    units: dict[str, str | None]
    place: str
    lines: np.ndarray | None = None
    notes: tuple[str, ...] = ()
    are_units_fixed: bool = False
    remedy: str = HEADER_EXAMPLE
    length: float | None = None

    def add_notes(self, *texts: str) -> "Table":
        """Return the table with further sentences about the file."""
        return self._replace(notes=(*self.notes, *(f"{self.place}: {text}" for text in texts)))

    def locate(self, sample: int) -> str:
        """Return the place of a sample in the file for a message."""
        if self.lines is None:
            return f"{self.path}: sample {sample + 1}"
        return f"{self.path}:{self.lines[sample]}"


def make_surface(table: Table, units: tuple[str, str] | None = None) -> Profile | Areal:
    """Make the trace or the areal scan of a table, in metres.

    Its notes state every change of the samples.

    Parameters
    ----------
    table : Table
    units : tuple of str, optional
        Units of x (and y) and of z, or the size of a pixel and the unit of z. They complete and overrule those
        of the file, with a note, except in formats that always state their units.
    """
    size = table.columns["z"].size
    if size > MAX_POINTS:
        raise PatchfemError(
            f"{table.path}: {size} heights, more than {MAX_POINTS:.0e}; export a part of the scan"
        )
    if units is not None and table.are_units_fixed:
        table = table.add_notes(
            "the file states its own units; the units that you gave are ignored"
        )
        units = None
    pixel = parse_pixel_size(units[0]) if units else None
    for unit in units or ():
        if parse_length_unit(unit) is None and (pixel is None or unit != units[0]):
            raise PatchfemError(
                f"{table.path}: unknown unit '{shorten(unit)}'; use one of {UNIT_LIST}"
            )
    table = _set_axes(table, pixel)
    for role in table.columns:
        # The size of a pixel gives places in metres.
        given = units[role == "z"] if units else None
        table = _convert_column(table, role, "m" if pixel and role != "z" else given)
        _check_numbers(table, role)
    if size and table.columns["z"].ndim == 1 and "y" in table.columns:
        table = _fill_raster(table)
    _require_heights(table)
    unit_source = "the file format" if table.are_units_fixed else ""
    return _make_surface(table, "--units" if units else unit_source)


def _set_axes(table: Table, pixel: float | None) -> Table:
    """Give a matrix of heights the axes of a pixel size [m]; a single row of it is a trace."""
    columns = dict(table.columns)
    z = columns["z"]
    if z.ndim == 1:
        if pixel is not None:
            raise PatchfemError(
                f"{table.path}: the size of a pixel is needed only for a matrix of heights, but this file has columns; "
                "give the units of the columns"
            )
        return table
    if pixel is not None:
        if "x" in columns or "y" in columns:
            table = table.add_notes(
                "the size of the scan in the header is not used, because --units gives the pixel size"
            )
        columns |= {role: pixel * np.arange(n) for role, n in zip("yx", z.shape)}
        table = table._replace(units=table.units | dict.fromkeys("xy", "m"))
    if z.shape[0] == 1:
        columns = {"x": columns.get("x"), "z": z[0]}
    for role, name in (("x", "width"), ("y", "height")):
        if columns.get(role, table if z.shape[0] == 1 else None) is None:
            raise PatchfemError(
                f"{table.path}: the rows are a matrix of heights (a map, or more than three numbers in a "
                f"row), but the {name} of the scan is not given; write the scan's {SIZE_LINES} and "
                f"`# Value units: um` above its rows, or {GIVE_PIXEL_SIZE}"
            )
    return table._replace(columns=columns)


def _convert_column(table: Table, role: str, given: str | None) -> Table:
    """Convert a column to metres; a unit of the user overrules the file, with a note."""
    stated = table.units.get(role)
    unit = stated if given is None else given
    if unit is None:
        remedy = table.remedy
        if "y" in table.columns:
            remedy = remedy.replace(HEADER_EXAMPLE, SCAN_HEADER_EXAMPLE)
        raise PatchfemError(
            f"{table.place}: the unit of {role} is not given, and units are never guessed; {remedy}, or {GIVE_UNITS}"
        )
    factor = parse_length_unit(unit)
    if factor is None:
        raise PatchfemError(
            f"{table.place}: unknown unit '{shorten(unit)}' of {role}; use one of {UNIT_LIST}"
        )
    if stated is not None and parse_length_unit(stated) != factor:
        table = table.add_notes(
            f"the header gives {role} in {shorten(stated)}, but {unit} is used, as given by --units"
        )
    return table._replace(columns=table.columns | {role: table.columns[role] * factor})


def _check_numbers(table: Table, role: str) -> None:
    """Raise PatchfemError if numbers of a column [m] are not finite or too large; a height may be missing."""
    values = table.columns[role].ravel()
    bad = np.isinf(values) if role == "z" else ~np.isfinite(values)
    if bad.any():
        first = int(np.argmax(bad))
        raise PatchfemError(
            f"{table.locate(first)}: {role} is {values[first]:g}; finite numbers are needed"
        )
    is_far = np.abs(values) > MAX_LENGTH
    if is_far.any():
        first = int(np.argmax(is_far))
        raise PatchfemError(
            f"{table.locate(first)}: {role} is {values[first]:.4g} m; is the unit right? "
            "write a missing height as nan"
        )


def _require_heights(table: Table) -> None:
    """Raise PatchfemError for fewer than two heights of a trace, or three of a scan."""
    z = table.columns["z"]
    count = np.isfinite(z).sum()
    if count <= z.ndim:
        kind = ("a trace needs at least two", "a scan needs at least three")[z.ndim - 1]
        raise PatchfemError(f"{table.path}: {count} heights; {kind}")


def _fill_raster(table: Table) -> Table:
    """Arrange points as a matrix, whose cells without a point are missing, or as a trace if they form a line."""
    x, y, z = (table.columns[role] for role in "xyz")
    columns, in_column = _find_positions(x)
    rows, in_row = _find_positions(y)
    if rows.size == 1:
        return table._replace(columns={"x": x, "z": z})
    if columns.size == 1:
        return table._replace(columns={"x": y, "z": z})
    cells = rows.size * columns.size
    if cells > max(MAX_CELLS_PER_POINT * z.size, 16) or cells > MAX_POINTS:
        raise PatchfemError(
            f"{table.path}: {z.size} points with {columns.size} different x and {rows.size} different y do "
            "not fill a grid; export the scan as a grid, or one trace of two columns"
        )
    cell = in_row * columns.size + in_column
    first = np.unique(cell, return_index=True)[1]
    if first.size < cell.size:
        second = int(np.setdiff1d(np.arange(cell.size), first)[0])
        raise PatchfemError(
            f"{table.locate(second)}: a second height at x = {format_length(x[second])}, y = "
            f"{format_length(y[second])}; keep one scan per file"
        )
    heights = np.full(cells, np.nan)
    heights[cell] = z
    matrix = {"x": columns, "y": rows, "z": heights.reshape(rows.size, columns.size)}
    return table._replace(columns=matrix, lines=None)


def _find_positions(values) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct positions of points (k,) but for round-off, and the index of each point (n,)."""
    order = np.argsort(values, kind="stable")
    is_new = np.diff(values[order]) > ROUND_OFF * max(float(np.ptp(values)), 1e-300)
    index = np.empty(values.size, np.int64)
    index[order] = np.concatenate([[0], np.cumsum(is_new)])
    return values[order][np.concatenate([[True], is_new])], index


def _make_surface(table: Table, unit_source: str) -> Profile | Areal:
    """Make the surface of a trace (n,) or of a matrix (m, n) in metres, whose positions increase."""
    z = table.columns["z"]
    axes = []
    for axis, role in enumerate("yx"[2 - z.ndim :]):
        places = table.columns[role]
        if places[-1] < places[0]:
            places = places[::-1]
            z = np.flip(z, axis)
            table = table._replace(lines=None if table.lines is None else table.lines[::-1])
        places, notes = _undo_rounding(table, role, places)
        table = table.add_notes(*notes)
        _require_increase(table, role, places)
        axes.append(frozen_array(places))
    length = max(float(np.ptp(axis)) for axis in axes)
    notes = _check_span(table.path, length, z, unit_source)
    table = table._replace(notes=table.notes + notes)
    surface = Profile if z.ndim == 1 else Areal
    return surface(*reversed(axes), frozen_array(z), str(table.path), table.notes)


def _require_increase(table: Table, role: str, places) -> None:
    """Raise PatchfemError if positions [m] are equal or do not increase, or there are fewer than two of them."""
    if not np.ptp(places) > 0:
        raise PatchfemError(
            f"{table.path}: every sample lies at {role} = {format_length(places[0])}; a surface needs at least two "
            f"different {role}"
        )
    is_rising = np.diff(places) > 0
    if is_rising.all():
        return
    first = int(np.argmin(is_rising))
    second = first + 1
    lines = table.lines
    if places[first] == places[second]:
        raise PatchfemError(
            f"{table.locate(second)}: two samples have {role} = {format_length(places[first])}; delete one of them, or "
            "write the mean of their heights"
        )
    if lines is not None and lines[first] > lines[second]:
        first, second = second, first
    raise PatchfemError(
        f"{table.locate(second)}: {role} reverses: {format_length(places[first])} and then "
        f"{format_length(places[second])}; {role} must only rise or only fall, so keep one trace or scan per file"
    )


def _undo_rounding(table: Table, role: str, x) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return equally spaced positions (n,) [m] if these differ from them only by rounding, with a note.

    A step of 0.15625 um printed to 0.1 um makes the slopes 14 % too large. If the header gives a length that fits, it
    gives the step, else the regression on the positions.
    """
    if x.size < MIN_ROUNDED or not x[-1] > x[0]:
        return x, ()
    digit = find_printed_digit(x)
    count = np.arange(x.size) - (x.size - 1) / 2
    step = float(count @ x / (count @ count))
    evens = [float(x.mean()) + step * count]
    if table.length is not None:
        of_length = [x[0] + table.length / n * np.arange(x.size) for n in (x.size, x.size - 1)]
        evens = [*of_length, *evens]
    for even in evens:
        distance = float(np.abs(x - even).max())
        step = float(even[1] - even[0])
        if step > 0 and distance <= MAX_ROUNDING * max(digit, MIN_PRINTED_DIGIT):
            if distance <= 1e-6 * step:
                return x, ()
            note = (
                f"{role} is rounded to {format_length(digit)} in the file; the samples are taken as evenly spaced by "
                f"{format_length(step)}"
            )
            return even, (note,)
    if table.length is None:
        return x, ()
    note = (
        f"the length of {format_length(table.length)} in the header does not fit {x.size} samples that "
        f"end at {format_length(x[-1])}: the x values of the samples are used"
    )
    return x, (note,)


def find_printed_digit(x) -> float:
    """Return the largest power of ten of a metre or of an inch [m] that divides all positions (n,), or 0."""
    digits = [0.0]
    for unit in (1.0, UNITS["in"]):
        largest = int(np.floor(np.log10((x[-1] - x[0]) / unit / 5)))
        for digit in unit * 10.0 ** np.arange(largest, largest - 8, -1):
            if np.abs(x / digit - np.rint(x / digit)).max() < DIGIT_TOL:
                digits.append(float(digit))
                break
    return max(digits)


def _check_span(path, length: float, z, unit_source: str) -> tuple[str, ...]:
    """Return a note on heights [m] that span less than an atom, or more than the length [m].

    Raises PatchfemError for a tiny length, and if most heights span more than the length in units from a header, which
    have no other source.
    """
    if length < MIN_LENGTH:
        raise PatchfemError(
            f"{path}: the profile is {format_length(length, 3)} long; is the unit of x right?"
        )
    span = float(np.nanmax(z) - np.nanmin(z))
    if 0 < span < ATOM_WIDTH:
        note = f"{path}: heights span {format_length(span)}, less than the width of an atom; is the unit of z right?"
        return (note,)
    if span <= length:
        return ()
    text = f"{path}: heights span {format_length(span)} over a length of {format_length(length)}"
    heights = np.sort(z[np.isfinite(z)])
    count = int(np.ceil(FAULT_FRACTION * heights.size)) if heights.size >= MIN_ROUNDED else 0
    inner_span = float(heights[-1 - count] - heights[count])
    if inner_span <= length:
        note = (
            f"{text}, but only {format_length(inner_span)} without the {count} highest and the {count} lowest of "
            f"{heights.size}; write nan for each of these heights that is a fault of the measurement"
        )
        return (note,)
    if unit_source:
        return (f"{text} in the units of {unit_source}; are they right?",)
    raise PatchfemError(
        f"{text}; is the unit of z right? If not, correct the header or give --units to profile and compare; write a "
        "missing height as nan"
    )
