"""Matrix of heights in text: a row of the scan in each line, size and units above."""

import math
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from ..samples import GIVEN_UNITS_NOTE, make_trace
from .head import Fact, Head, has_column_names
from .raster import make_scan_from_matrix
from .raw import shorten
from .rows import read_matrix
from .units import GIVE_PIXEL_SIZE, GIVE_UNITS, parse_length_unit, parse_pixel_size

SIZE_LINES = "`# Width: 1.2 mm` and `# Height: 0.8 mm`"
SIZE_REMEDY = (
    f"write the scan's {SIZE_LINES} and `# Value units: um` above its rows, or {GIVE_PIXEL_SIZE}"
)
UNKNOWN = Fact()
# Largest relative range of the steps of coordinates; the steps of heights vary more.
MAX_UNEVEN = 1e-6


class Scale(NamedTuple):
    """Sample spacing [m] of an axis or factor of the heights, with notes on its source."""

    value: float
    notes: tuple = ()


class Unit(NamedTuple):
    """Length unit that is used for an axis or the heights, with notes on its source."""

    name: str | None
    notes: tuple = ()


def is_matrix(count: int, names: list, facts: dict) -> bool:
    """Return whether rows of numbers are a matrix of heights instead of columns of points.

    Parameters
    ----------
    count : int
        Numbers in a row.
    names : list
        Names of the columns, [] without any.
    facts : dict
        Facts of the head.

    Returns
    -------
    bool
    """
    if has_column_names(names):
        return False
    has_size = "width" in facts or "step_x" in facts
    return count > 3 or (count == 1 and has_size) or facts.get("columns", UNKNOWN).number == count


def read_scan(path, head: Head, facts: dict, units: tuple | None, body: str) -> Profile | Areal:
    """Convert a matrix of heights to a scan, or to a trace if it is one row or column.

    Parameters
    ----------
    path : Path
        For messages.
    head : Head
    facts : dict
        Facts of the head.
    units : tuple or None
        Units of x, y and of z, which complete and overrule the facts; the first may be the size of
        a pixel.
    body : str
        Text below the head.

    Returns
    -------
    Profile or Areal
    """
    table = read_matrix(path, body, head)
    if table.shape[1] == 1 and "height" not in facts and "step_y" not in facts:
        table = table.T  # a trace with one height in each line
    for name, axis, count in zip(("rows", "columns"), ("rows", "numbers per row"), table.shape):
        stated = facts.get(name, UNKNOWN).number
        if stated is not None and stated != count:
            raise PatchfemError(
                f"{path}: {count} {axis}, but the header says {stated:g}; the file is cut off or "
                "joined from parts: export the scan anew"
            )
    if (
        min(table.shape) > 3
        and _is_even(table[0, 1:])
        and _is_even(table[1:, 0])
        and not _is_even(table[1, 1:])
    ):
        raise PatchfemError(
            f"{path}: the first row and the first column of the matrix grow evenly, like "
            "coordinates and not heights; leave out this row and this column"
        )
    rows, columns = table.shape
    step_x = _find_step(path, "x", columns, facts, units)
    step_y = Scale(1.0) if rows == 1 else _find_step(path, "y", rows, facts, units)
    factor = _find_height_factor(path, facts, units)
    notes = (*step_x.notes, *step_y.notes, *factor.notes)
    stated = GIVEN_UNITS_NOTE if units else ""
    x = np.arange(columns) * step_x.value
    z = table * factor.value
    if rows == 1:
        trace = make_trace(path, x, z[0], None, (1.0, 1.0), stated)
        return Profile(trace.x, trace.z, trace.source, (*notes, *trace.notes))
    return make_scan_from_matrix(path, x, np.arange(rows) * step_y.value, z, stated, notes)


def _is_even(values) -> bool:
    """Return whether numbers (n,) increase by equal steps."""
    steps = np.diff(values)
    return bool(steps[0] > 0 and np.ptp(steps) < MAX_UNEVEN * steps[0])


def _find_height_factor(path, facts: dict, units: tuple | None) -> Scale:
    """Find the factor that converts the heights to metres."""
    stated = facts.get("value", UNKNOWN).word or facts.get("factor", UNKNOWN).word or None
    scale = facts.get("factor", UNKNOWN).number
    if facts.get("scaled", UNKNOWN).word.lower() == "yes":
        scale = facts.get("scale", UNKNOWN).number
    bit = facts.get("bit2nm", UNKNOWN).number
    if stated is None and bit:
        stated = "nm"
        scale = bit
    scale = 1.0 if scale is None else scale
    if not 0 < abs(scale) < math.inf:
        raise PatchfemError(
            f"{path}: the factor of the heights in the header is {scale:g}, which is not possible; "
            "export the scan anew"
        )
    if units is None and stated is None:
        raise PatchfemError(
            f"{path}: a matrix of heights whose unit is not given; write `# Value units: um` above "
            f"its rows, or {GIVE_UNITS}"
        )
    if units is None and parse_length_unit(stated) is None:
        raise PatchfemError(
            f"{path}: the values are in '{shorten(stated)}', which is not a unit of length; export "
            f"the channel of the heights, or {GIVE_UNITS}"
        )
    unit = _choose_unit(path, "the heights", stated, units and units[1])
    return Scale(scale * parse_length_unit(unit.name), unit.notes)


def _find_step(path, axis: str, count: int, facts: dict, units: tuple | None) -> Scale:
    """Return the sample spacing [m] of an axis from the pixel size or the scan size."""
    size, step = ("width", "step_x") if axis == "x" else ("height", "step_y")
    pixel = None if units is None else parse_pixel_size(units[0])
    if pixel is not None:
        note = (
            f"{path}: the header gives the size of the scan along {axis}, but the pixel size that "
            f"you gave, {units[0]}, is used instead"
        )
        return Scale(pixel, (note,) if size in facts or step in facts else ())
    if axis == "y" and step not in facts and size not in facts:
        step = "step_x"  # a single pixel size holds for both axes, because the pixels are square
    number, word = facts.get(step, facts.get(size, UNKNOWN))
    if number is None or not 0 < number < math.inf:
        name = "width" if axis == "x" else "height"
        raise PatchfemError(
            f"{path}: the rows are a matrix of heights (a map, or more than three numbers in a "
            f"row), but the {name} of the scan is not given; {SIZE_REMEDY}"
        )
    if not word and axis == "y":
        word = facts.get("unit_y", UNKNOWN).word
    word = word or facts.get("lateral", UNKNOWN).word
    if not word and facts.get("format", UNKNOWN).word.lower() == "ascii":
        word = "nm"  # SPIP writes coordinates in nanometres
    if units is None and parse_length_unit(word) is None:
        raise PatchfemError(
            f"{path}: the unit of the scan's width and height, '{shorten(word)}', is not known; "
            f"write {SIZE_LINES}, or {GIVE_UNITS}"
        )
    unit = _choose_unit(path, f"places along {axis}", word or None, units and units[0])
    return Scale(
        number * parse_length_unit(unit.name) / (1 if step in facts else count), unit.notes
    )


def _choose_unit(path, quantity: str, stated: str | None, given: str | None) -> Unit:
    """Return the unit given by the user, or else that of the file, with a note if they differ."""
    if given is None or stated is None or parse_length_unit(given) == parse_length_unit(stated):
        return Unit(given or stated)
    note = f"{path}: the header gives {quantity} in {shorten(stated)}, but {given} is used, as given by --units"
    return Unit(given, (note,))
