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
    SIZE_LINES,
    UNIT_LIST,
    parse_length_unit,
    parse_pixel_size,
    shorten,
)

MAX_POINTS = 50_000_000  # largest number of heights
MAX_LENGTH = 10.0  # length or coordinate [m] above which a number has a wrong unit
MIN_LENGTH = 1e-9  # length [m] below which a trace has a wrong unit
ATOM_WIDTH = 1e-10  # span of heights [m] below which they have a wrong unit
OUTLIER_FRACTION = 0.01  # fraction of the heights at either end that may be measurement faults
MIN_ROUNDED = (
    10  # smallest number of positions that shows whether they are even apart from rounding
)
MAX_ROUNDING = (
    0.75  # largest distance from even positions in printed digits, half of which is rounding
)
MIN_DIGIT = 1e-5  # smallest printed digit of a position, in the unit of the file
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
    path = table.path
    z = table.columns["z"]
    if z.size > MAX_POINTS:
        raise PatchfemError(
            f"{path}: {z.size} heights, more than {MAX_POINTS:.0e}; export a part of the scan"
        )
    if units is not None and table.are_units_fixed:
        note = f"{path}: the file states its own units; the units that you gave are ignored"
        table = table._replace(notes=(*table.notes, note))
        units = None
    pixel = parse_pixel_size(units[0]) if units else None
    for unit in units or ():
        if parse_length_unit(unit) is None and (pixel is None or unit != units[0]):
            raise PatchfemError(f"{path}: unknown unit '{shorten(unit)}'; use one of {UNIT_LIST}")
    table = _set_axes(table, units[0] if pixel else None)

    factors = {}
    for role in table.columns:
        if pixel and role != "z":
            factors[role] = pixel
            continue
        given = units[role == "z"] if units else None
        factors[role], notes = _find_factor(table, role, given)
        table = table._replace(notes=table.notes + notes)
    n_heights = np.isfinite(z).sum()
    if n_heights < 2:
        raise PatchfemError(f"{path}: {n_heights} heights; a trace needs at least two")
    for role, factor in factors.items():
        _check_numbers(table, role, factor)

    # Steep heights have probably a wrong unit, unless somebody states it.
    stated = "the file states these units" if table.are_units_fixed else ""
    stated = "heights and length were read in the given units" if units else stated
    if table.columns["z"].ndim == 1 and "y" in table.columns:
        table = _fill_raster(table, factors)
    return _make_surface(table, factors, stated)


def _set_axes(table: Table, pixel: str | None) -> Table:
    """Give a matrix of heights the axes of a pixel size; a single row of it is a trace."""
    columns = dict(table.columns)
    z = columns["z"]
    if z.ndim == 1:
        if pixel is not None:
            raise PatchfemError(
                f"{table.path}: '{shorten(pixel)}' is a pixel size, which is needed only for a matrix of "
                "heights, but this file has columns; give the units of the columns"
            )
        return table
    notes = table.notes
    if pixel is not None:
        notes += tuple(
            f"{table.path}: the header gives the size of the scan along {role}, but the pixel size that "
            f"you gave, {pixel}, is used instead"
            for role in ("x", "y")
            if role in columns
        )
        columns |= {role: np.arange(float(n)) for role, n in zip("yx", z.shape)}
    if z.shape[0] == 1:
        columns = {"x": columns.get("x"), "z": z[0]}
    for role, name in (("x", "width"), ("y", "height")):
        if columns.get(role, table if z.shape[0] == 1 else None) is None:
            raise PatchfemError(
                f"{table.path}: the rows are a matrix of heights (a map, or more than three numbers in a "
                f"row), but the {name} of the scan is not given; write the scan's {SIZE_LINES} and "
                f"`# Value units: um` above its rows, or {GIVE_PIXEL_SIZE}"
            )
    return table._replace(columns=columns, notes=notes)


def _find_factor(table: Table, role: str, given: str | None) -> tuple[float, tuple[str, ...]]:
    """Find the factor of a column to metres; a unit of the user overrules the file, with a note."""
    stated = table.units.get(role)
    unit = stated if given is None else given
    if unit is None:
        raise PatchfemError(
            f"{table.place}: the unit of {role} is not given, and units are never guessed; {table.remedy}, or "
            f"{GIVE_UNITS}"
        )
    factor = parse_length_unit(unit)
    if factor is None:
        raise PatchfemError(
            f"{table.place}: unknown unit '{shorten(unit)}' of {role}; use one of {UNIT_LIST}"
        )
    if stated is None or parse_length_unit(stated) == factor:
        return factor, ()
    note = f"the header gives {role} in {shorten(stated)}, but {unit} is used, as given by --units"
    return factor, (f"{table.place}: {note}",)


def _check_numbers(table: Table, role: str, factor: float) -> None:
    """Raise PatchfemError if numbers of a column are not finite or too large; a height may be missing."""
    values = table.columns[role].ravel()
    known = np.isfinite(values)
    bad = np.isinf(values) if role == "z" else ~known
    if bad.any():
        first = int(np.argmax(bad))
        raise PatchfemError(
            f"{table.locate(first)}: {role} is {values[first]:g}; finite numbers are needed"
        )
    largest = int(np.nanargmax(np.abs(values)))
    if abs(values[largest]) > MAX_LENGTH / factor:
        raise PatchfemError(
            f"{table.locate(largest)}: {role} is {float(values[largest]) * factor:.4g} m; is the unit right? "
            "write a missing height as nan"
        )


def _fill_raster(table: Table, factors: dict[str, float]) -> Table:
    """Arrange points as a matrix, whose cells without a point are missing, or as a trace if they form a line."""
    x, y, z = (table.columns[role] for role in "xyz")
    columns, in_column = _find_positions(x)
    rows, in_row = _find_positions(y)
    if rows.size == 1:
        return table._replace(columns={"x": x, "z": z})
    if columns.size == 1:
        factors["x"] = factors["y"]
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
            f"{table.locate(second)}: a second height at x = {format_length(x[second] * factors['x'])}, y = "
            f"{format_length(y[second] * factors['y'])}; keep one scan per file"
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


def _make_surface(table: Table, factors: dict[str, float], stated: str) -> Profile | Areal:
    """Make the surface of a trace (n,) or of a matrix (m, n), whose positions increase."""
    z = table.columns["z"] * factors["z"]
    axes = []
    for axis, role in enumerate("yx"[2 - z.ndim :]):
        places = table.columns[role]
        if places[-1] < places[0]:
            places = places[::-1]
            z = np.flip(z, axis)
            table = table._replace(lines=None if table.lines is None else table.lines[::-1])
        places, notes = _undo_rounding(table, role, places, factors[role])
        table = table._replace(notes=table.notes + notes)
        if z.ndim == 1:
            places, z, notes = _average_equal(table, places, z)
            table = table._replace(notes=table.notes + notes)
        _require_increase(table, role, places)
        axes.append(frozen_array(places))
    known = z[np.isfinite(z)]
    if known.size <= z.ndim:
        raise PatchfemError(
            f"{table.path}: {known.size} heights; a {'scan' if z.ndim > 1 else 'trace'} needs more"
        )
    length = max(float(np.ptp(axis)) for axis in axes)
    notes = table.notes + _check_span(table.path, length, known, stated)
    surface = Profile if z.ndim == 1 else Areal
    return surface(*reversed(axes), frozen_array(z), str(table.path), notes)


def _require_increase(table: Table, role: str, places) -> None:
    """Raise PatchfemError if positions [m] do not increase, or there are fewer than two of them."""
    if places.size < 2:
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
    if lines is not None and lines[first] > lines[second]:
        first, second = second, first
    raise PatchfemError(
        f"{table.locate(second)}: {role} reverses: {format_length(places[first])} and then "
        f"{format_length(places[second])}; {role} must only rise or only fall, so keep one trace or scan per file"
    )


def _average_equal(table: Table, x, z) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Average the heights (n,) of neighbouring samples with the same x, with a note."""
    equal = 1e-6 * (x[-1] - x[0]) / x.size
    is_new = np.abs(np.diff(x)) > equal
    if is_new.all():
        return x, z, ()
    group = np.concatenate([[0], np.cumsum(is_new)])
    first = int(np.argmin(is_new)) + 1
    place = f"sample {first + 1}" if table.lines is None else f"line {table.lines[first]}"
    note = (
        f"{table.path}: {x.size - group[-1] - 1} samples have the same x as another sample (the first in {place}); "
        "the mean of their heights is used"
    )
    with np.errstate(invalid="ignore"):
        z = np.bincount(group, np.nan_to_num(z)) / np.bincount(group, np.isfinite(z))
    return np.bincount(group, x) / np.bincount(group), z, (note,)


def _undo_rounding(table: Table, role: str, x, factor: float) -> tuple[np.ndarray, tuple[str, ...]]:
    """Convert positions (n,) to metres, equally spaced ones if they differ from these only by rounding, with a note.

    A step of 0.15625 um printed to 0.1 um makes the slopes 14 % too large. If the header gives the length of the scan, it
    gives the step.
    """
    if x.size < MIN_ROUNDED or not x[-1] > x[0]:
        return x * factor, ()
    digit = find_printed_digit(x)
    count = np.arange(x.size) - (x.size - 1) / 2
    step = float(count @ x / (count @ count))
    evens = [float(x.mean()) + step * count]
    if table.length is not None:
        steps = (table.length / factor / n for n in (x.size, x.size - 1))
        evens = [x[0] + step * np.arange(x.size) for step in steps]
    for even in evens:
        distance = float(np.abs(x - even).max())
        step = float(even[1] - even[0])
        if step > 0 and 1e-6 * step < distance <= MAX_ROUNDING * max(digit, MIN_DIGIT):
            note = (
                f"{table.path}: {role} is rounded to {format_length(digit * factor)} in the file; the samples are "
                f"taken as evenly spaced by {format_length(step * factor)}"
            )
            return even * factor, (note,)
    if table.length is None:
        return x * factor, ()
    note = (
        f"{table.path}: the length of {format_length(table.length)} in the header does not fit {x.size} samples that "
        f"end at {format_length(x[-1] * factor)}: the x values of the samples are used"
    )
    return x * factor, (note,)


def find_printed_digit(x) -> float:
    """Return the largest power of ten that divides all positions (n,), or 0 if there is none."""
    largest = int(np.floor(np.log10((x[-1] - x[0]) / 5)))
    for digit in 10.0 ** np.arange(largest, largest - 8, -1):
        if np.abs(x / digit - np.rint(x / digit)).max() < DIGIT_TOL:
            return float(digit)
    return 0.0


def _check_span(path, length: float, heights, stated: str) -> tuple[str, ...]:
    """Return a note on heights [m] that span more than the length, or less than an atom.

    Raises PatchfemError for most of them above the length [m] if nobody states their unit.
    """
    heights = np.sort(heights)
    if heights.size < 2:
        raise PatchfemError(f"{path}: {heights.size} heights; a trace needs at least two")
    span = float(heights[-1] - heights[0])
    if length < MIN_LENGTH:
        raise PatchfemError(
            f"{path}: the profile is {format_length(length, 3)} long; is the unit of x right?"
        )
    if 0 < span < ATOM_WIDTH:
        return (
            f"{path}: heights span {format_length(span)}, which is less than the width of an atom; is the "
            "unit of the heights right?",
        )
    if span <= length:
        return ()
    text = f"{path}: heights span {format_length(span)} over a length of {format_length(length)}"
    count = max(1, int(OUTLIER_FRACTION * heights.size)) if heights.size >= MIN_ROUNDED else 0
    inner_span = float(heights[-1 - count] - heights[count])
    if inner_span <= length:
        return (
            f"{text}, but only {format_length(inner_span)} without the {count} highest and the {count} lowest of "
            f"{heights.size}; write nan for each of these heights that is a fault of the measurement",
        )
    if not stated:
        raise PatchfemError(
            f"{text}; is the unit of z right? If not, correct the header or give --units to "
            "profile and compare; write a missing height as nan"
        )
    return (f"{text}: {stated}",)
