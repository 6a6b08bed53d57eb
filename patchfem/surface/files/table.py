"""Numbers and units of a surface file, and the trace or areal scan that they describe."""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array, max_abs
from ...formatting import format_length
from ...inputs.damage import shorten
from ..areal import Areal
from ..profile import Profile
from .units import (
    HEADER_EXAMPLE,
    LENGTH_UNIT_LIST,
    MISSING_UNITS_REMEDY,
    parse_length_unit,
)

MAX_HEIGHTS = 50_000_000  # largest number of heights
MAX_COORDINATE = 10.0  # length or coordinate [m] above which a number has a wrong unit
# Fraction of the highest, and of the lowest, heights that may be faults, such as 999 um for no signal.
MAX_FAULTY_HEIGHT_FRACTION = 0.01
# Largest distance of positions that count as even, and smallest difference of two steps, relative to a step.
EVEN_POSITIONS_TOL = 1e-6


class Table(NamedTuple):
    """Numbers of a file in its own units.

    - path: file, for messages.
    - columns: "x" and "z" (n,) of a trace, with "y" (n,) of the points of a scan, or "z" (m, n) of a matrix, with "x"
      (n,) and "y" (m,). A missing height is NaN.
    - units: unit of each column, or None where the file states none.
    - place: file, with the line that names the columns if there is one.
    - lines: line of the file of each sample, or None if the file has no lines.
    - notes: sentences on the file.
    - remedy: how the file would state its units; "" if its format always states them.
    - length: length of the scan [m], if the header gives it.
    """

    path: object
    columns: dict[str, np.ndarray]
    units: dict[str, str | None]
    place: str
    lines: np.ndarray | None = None
    notes: tuple[str, ...] = ()
    remedy: str = HEADER_EXAMPLE
    length: float | None = None

    @property
    def has_fixed_units(self) -> bool:
        """Return whether the format of the file defines or always states its units."""
        return not self.remedy

    def add_note(self, text: str) -> "Table":
        """Return the table with a further sentence about the file, `text`."""
        return self._replace(notes=(*self.notes, f"{self.place}: {text}"))

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
        Numbers of a file in its own units.
    units : tuple of str, optional
        Units of x (and y) and of z. They complete and overrule those of the file, with a note, except in formats that
        always state their units.

    Returns
    -------
    Profile or Areal
        Positions and heights [m], with increasing positions.
    """
    size = table.columns["z"].size
    refuse_many_heights(table.path, size)
    if units is not None and table.has_fixed_units:
        table = table.add_note("the file states its own units; the units that you gave are ignored")
        units = None

    # All that follows is in metres.
    for coordinate in table.columns:
        table = _convert_column(table, coordinate, units and units[coordinate == "z"])
        _check_numbers(table, coordinate)
    if size and table.columns["z"].ndim == 1 and "y" in table.columns:
        table = _fill_raster(table)

    z = table.columns["z"]
    count = np.isfinite(z).sum()
    if count <= z.ndim:
        kind = ("a trace needs at least two", "a scan needs at least three")[z.ndim - 1]
        raise PatchfemError(f"{table.path}: {count} heights; {kind}")

    # Positions of a surface increase, whatever the direction of the measurement.
    axes = []
    for axis, coordinate in enumerate("yx"[2 - z.ndim :]):
        places = table.columns[coordinate]
        if places[-1] < places[0]:
            places = places[::-1]
            z = np.flip(z, axis)
            table = table._replace(lines=None if table.lines is None else table.lines[::-1])
        table, places = _undo_rounding(table, coordinate, places)
        _require_increase(table, coordinate, places)
        axes.append(frozen_array(places))
    has_sure_units = table.has_fixed_units or units is not None
    notes = _check_span(table.path, max(map(np.ptp, axes)), z, has_sure_units=has_sure_units)
    surface = Profile if z.ndim == 1 else Areal
    return surface(*reversed(axes), frozen_array(z), str(table.path), table.notes + notes)


def refuse_many_heights(path, count: int) -> None:
    """Raise PatchfemError if the count of heights in the file `path` is too large for the memory."""
    if count > MAX_HEIGHTS:
        raise PatchfemError(
            f"{path}: {count} heights, more than {MAX_HEIGHTS:.0e}; export a part of the scan"
        )


def _convert_column(table: Table, coordinate: str, given: str | None) -> Table:
    """Convert a column of a table to metres.

    `coordinate` is "x", "y" or "z", and `given` is the unit that the user states, or None. It overrules the file, with a
    note.
    """
    stated = table.units.get(coordinate)
    unit = given or stated
    if unit is None:
        raise PatchfemError(
            f"{table.place}: the unit of {coordinate} is not given, and units are never guessed; {table.remedy}, or "
            f"{MISSING_UNITS_REMEDY}"
        )
    factor = parse_length_unit(unit)
    if factor is None:
        raise PatchfemError(
            f"{table.place}: unknown unit '{shorten(unit)}' of {coordinate}; use one of {LENGTH_UNIT_LIST}"
        )
    if stated is not None and parse_length_unit(stated) != factor:
        table = table.add_note(
            f"the header gives {coordinate} in {shorten(stated)}, but {unit} is used, as given by --units"
        )
    return table._replace(columns=table.columns | {coordinate: table.columns[coordinate] * factor})


def _check_numbers(table: Table, coordinate: str) -> None:
    """Raise PatchfemError if numbers of a column [m] are not finite or too large; a height may be missing.

    `coordinate` is the name of the column of the `table`.
    """
    values = table.columns[coordinate].ravel()
    is_bad = ~(np.abs(values) <= MAX_COORDINATE)
    if coordinate == "z":
        is_bad &= ~np.isnan(values)
    if not is_bad.any():
        return
    first = int(np.argmax(is_bad))
    raise PatchfemError(
        f"{table.locate(first)}: {coordinate} is {values[first]:.4g} m; is the unit right? write a missing height as nan"
    )


def _fill_raster(table: Table) -> Table:
    """Arrange the points of a table as a matrix, or as a trace if they form a line.

    Cells of the matrix without a point are missing heights.
    """
    x, y, z = (table.columns[coordinate] for coordinate in "xyz")
    columns, in_column = _find_positions(x)
    rows, in_row = _find_positions(y)
    if rows.size == 1:
        return table._replace(columns={"x": x, "z": z})
    if columns.size == 1:
        return table._replace(columns={"x": y, "z": z})

    # Scattered points would leave nearly all cells of a grid empty.
    count = rows.size * columns.size
    # Largest number of raster cells per point; scattered points need more
    if count > max(4 * z.size, 16) or count > MAX_HEIGHTS:
        raise PatchfemError(
            f"{table.path}: {z.size} points with {columns.size} different x and {rows.size} different y do "
            "not fill a grid; export the scan as a grid, or one trace of two columns"
        )
    cells, first = np.unique(in_row * columns.size + in_column, return_index=True)
    if cells.size < z.size:
        second = int(np.setdiff1d(np.arange(z.size), first)[0])
        raise PatchfemError(
            f"{table.locate(second)}: a second height at x = {format_length(x[second])}, y = "
            f"{format_length(y[second])}; keep one scan per file"
        )

    heights = np.full((rows.size, columns.size), np.nan)
    heights[in_row, in_column] = z
    return table._replace(columns={"x": columns, "y": rows, "z": heights}, lines=None)


def _find_positions(values) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct positions (k,) among values (n,), and the index (n,) of each value in them.

    Values that differ by round-off count as equal.
    """
    positions, index = np.unique(values, return_inverse=True)
    # Largest distance of positions that count as equal, relative to the length of the axis.
    is_new = np.diff(positions, prepend=-np.inf) > 1e-9 * np.ptp(values)
    return positions[is_new], (np.cumsum(is_new) - 1)[index]


def _require_increase(table: Table, coordinate: str, places) -> None:
    """Raise PatchfemError if the positions of a column are equal or do not increase.

    `coordinate` is "x" or "y", and `places` (n,) [m] are the positions. The `table` tells the line of a wrong one.
    """
    if not np.ptp(places) > 0:
        raise PatchfemError(
            f"{table.path}: every sample lies at {coordinate} = {format_length(places[0])}; a surface needs at least two "
            f"different {coordinate}"
        )
    is_rising = np.diff(places) > 0
    if is_rising.all():
        return
    first = int(np.argmin(is_rising))
    pair = [first, first + 1]
    if table.lines is not None and table.lines[first] > table.lines[first + 1]:
        pair.reverse()
    before, after = map(format_length, places[pair])
    raise PatchfemError(
        f"{table.locate(pair[1])}: {coordinate} is {before} and then {after}, but it must only rise or only fall; keep one "
        "trace or scan per file, and one height at each place"
    )


def _undo_rounding(table: Table, coordinate: str, x) -> tuple[Table, np.ndarray]:
    """Return the table, and positions x (n,) [m] with equal steps if their steps differ only by printed digits.

    A step of 0.15625 um printed to 0.1 um makes the slopes 14 % too large. If the header gives a length that fits, it
    gives the step, else the regression on the positions. Rounded even steps are two multiples of the printed digit, and
    differ by it; uneven steps, such as 1.0 and 1.4 um in turn, are no multiples of their difference.

    `coordinate` is "x" or "y". The table gets a note if positions are changed.
    """
    # Smallest number of positions that show whether they are even but for rounding
    if x.size < 10:
        return table, x

    # The printed digit is the smallest difference of two steps.
    gaps = np.diff(np.sort(np.diff(x)))
    gaps = gaps[gaps > EVEN_POSITIONS_TOL * np.ptp(x) / x.size]
    # Smallest printed digit of a position [m]
    digit = 1e-11
    if gaps.size and gaps[0] > digit:
        digit = float(gaps[0])
        n_digits = np.diff(x) / digit
        # Largest distance of a step from a multiple of the printed digit, relative to the digit
        if max_abs(n_digits - np.rint(n_digits)) > 1e-4:
            return table, x

    # Candidates for even positions: by the length in the header over n or n - 1 steps, and by regression
    count = np.arange(x.size) - (x.size - 1) / 2
    evens = [x.mean() + float(count @ x / (count @ count)) * count]
    if table.length is not None:
        lengths = [table.length / n * np.arange(x.size) for n in (x.size, x.size - 1)]
        evens = [*(x[0] + places for places in lengths), *evens]

    # The first candidate from which the positions differ by rounding alone
    for even in evens:
        distance = max_abs(x - even)
        step = float(even[1] - even[0])
        # Largest distance from even positions in printed digits, half of which is rounding.
        if step > 0 and distance <= 0.75 * digit:
            if distance <= EVEN_POSITIONS_TOL * step:
                return table, x
            note = (
                f"{coordinate} is rounded to {format_length(digit)} in the file; the samples are taken as evenly spaced by "
                f"{format_length(step)}"
            )
            return table.add_note(note), even
    return table, x


def _check_span(path, length: float, z, *, has_sure_units: bool) -> tuple[str, ...]:
    """Return a note on heights [m] that span more than the length [m] in units that the user or the format gives.

    Raises PatchfemError for a tiny length, and for such heights in units from a header, which have no other source.

    `path` names the file in messages, z (n,) or (m, n) are its heights, and `has_sure_units` tells whether the units
    were given by the user or by the format.
    """
    # Length [m] below which a trace has a wrong unit
    if length < 1e-9:
        raise PatchfemError(
            f"{path}: the profile is {format_length(length, 3)} long; is the unit of x right?"
        )

    # A few heights that stand out, such as 999 um for no signal, are spikes and do not count.
    low, first, last, high = np.nanquantile(
        z, [0.0, MAX_FAULTY_HEIGHT_FRACTION, 1 - MAX_FAULTY_HEIGHT_FRACTION, 1.0]
    )
    if last - first <= length:
        return ()
    text = (
        f"{path}: heights span {format_length(high - low)} over a length of {format_length(length)}"
    )
    if has_sure_units:
        return (f"{text}; are the units right?",)
    raise PatchfemError(
        f"{text}; is the unit of z right? If not, correct the header or give --units to profile and compare; write a "
        "missing height as nan"
    )
