"""A matrix of heights in text, a row of the scan in each line, whose size and units stand in the lines above it."""

import io

import numpy as np

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from ..samples import GIVEN, checked
from .head import COMMA, COMMENT, VOID, Head, is_number, named, trimmed
from .raster import areal
from .raw import shown
from .units import GIVE, PIXEL, factor_of, pixel_of

SIZE = "`# Width: 1.2 mm` and `# Height: 0.8 mm`"
ABOVE = f"write the scan's {SIZE} and `# Value units: um` above its rows, or {PIXEL}"


def is_matrix(count: int, names: list, facts: dict) -> bool:
    """Whether rows of `count` numbers are a matrix and no columns x, (y,) z."""
    sized = count == 1 and not {"width", "step_x"}.isdisjoint(facts)
    return not named(names) and (count > 3 or sized or facts.get("columns", (0,))[0] == count)


def matrix(path, head: Head, facts: dict, given: tuple | None, body: str) -> Profile | Areal:
    """The scan in a matrix of heights; a trace where it is one row or one column.

    The step is that of a pixel: Width over the number of columns. facts: what the head tells; given: units of x, y and
    of z, which complete and overrule it. PatchfemError for a matrix of unknown size or unit, or of uneven rows.
    """
    table = _table(path, head, body)
    if table.shape[1] == 1 and {"height", "step_y"}.isdisjoint(facts):
        table = table.T  # one height a line
    for name, axis, count in (("rows", "rows", table.shape[0]), ("columns", "numbers per row", table.shape[1])):
        stated = facts.get(name, (None,))[0]
        if stated is not None and stated != count:
            raise PatchfemError(f"{path}: {count} {axis}, but the header says {stated:g}; the file is cut off or "
                                "joined from parts: export the scan anew")
    if min(table.shape) > 3 and _even(table[0, 1:]) and _even(table[1:, 0]) and not _even(table[1, 1:]):
        raise PatchfemError(f"{path}: the first row and the first column of the matrix grow evenly, like coordinates "
                            "and not heights; leave out this row and this column")
    steps, notes = [], ()
    for axis, count in zip(("x", "y"), table.shape[::-1]):
        if axis == "y" and count == 1:
            continue
        step, more = _step(path, axis, count, facts, given)
        steps.append(step)
        notes += more
    up, more = _height(path, facts, given)
    table, said, notes = table * up, GIVEN if given else "", (*notes, *more)
    if len(steps) == 1:
        trace = checked(path, np.arange(table.shape[1]) * steps[0], table[0], None, (1.0, 1.0), said)
        return Profile(trace.x, trace.z, trace.source, (*notes, *trace.notes))
    axes = [np.arange(count) * step for count, step in zip(table.shape[::-1], steps)]
    return areal(path, *axes, table, said, notes)


def _even(values) -> bool:
    """Whether numbers (n,) grow by one step."""
    steps = np.diff(values)
    return bool(steps[0] > 0 and np.ptp(steps) < 1e-6 * steps[0])


def _height(path, facts: dict, given: tuple | None) -> tuple:
    """Factor of the heights to metres; notes."""
    told = next((facts[name][1] for name in ("value", "factor") if facts.get(name, ("", ""))[1]), None)
    scale = facts.get("factor", (None,))[0]
    if facts.get("scaled", ("", ""))[1].lower() == "yes":
        scale = facts.get("scale", (None,))[0]
    if told is None and facts.get("bit2nm", (None,))[0]:
        told, scale = "nm", facts["bit2nm"][0]
    scale = 1.0 if scale is None else scale
    if not 0 < abs(scale) < np.inf:
        raise PatchfemError(f"{path}: the factor of the heights in the header is {scale:g}, which is not possible; "
                            "export the scan anew")
    if told is not None and factor_of(told) is None and given is None:
        raise PatchfemError(f"{path}: the values are in '{shown(told)}', which is not a unit of length; export the "
                            f"channel of the heights, or {GIVE}")
    if told is None and given is None:
        raise PatchfemError(f"{path}: a matrix of heights whose unit is not given; write `# Value units: um` above its "
                            f"rows, or {GIVE}")
    unit, notes = _overruled(path, "the heights", told, given and given[1])
    return scale * factor_of(unit), notes


def _step(path, axis: str, count: int, facts: dict, given: tuple | None) -> tuple:
    """Step along x or y [m]; notes."""
    size, step = ("width", "step_x") if axis == "x" else ("height", "step_y")
    if given is not None and (pixel := pixel_of(given[0])) is not None:
        told = (f"{path}: the header gives the size of the scan along {axis}, but the pixel size that you gave, "
                f"{given[0]}, is used instead")
        return pixel, () if {size, step}.isdisjoint(facts) else (told,)
    if axis == "y" and step not in facts and size not in facts:
        step = "step_x"  # square pixels by a size of one number
    number, unit = facts.get(step, facts.get(size, (None, "")))
    if number is None or not 0 < number < np.inf:
        raise PatchfemError(f"{path}: the rows are a matrix of heights (a map, or more than three numbers in a row), "
                            f"but the {'width' if axis == 'x' else 'height'} of the scan is not given; {ABOVE}")
    unit = unit or next((facts[name][1] for name in ("unit_y", "lateral") if axis == "y" or name == "lateral"
                         if name in facts), None)
    if not unit and facts.get("format", ("", ""))[1].lower() == "ascii":
        unit = "nm"  # SPIP writes places in nanometres
    if given is None and factor_of(unit or "") is None:
        raise PatchfemError(f"{path}: the unit of the scan's width and height, '{shown(unit or '')}', is not known; "
                            f"write {SIZE}, or {GIVE}")
    unit, notes = _overruled(path, f"places along {axis}", unit or None, given and given[0])
    return number * factor_of(unit) / (1 if step in facts else count), notes


def _overruled(path, what: str, told: str | None, asked: str | None) -> tuple:
    """The unit that counts, and a note where the one given overrules the one of the file."""
    if asked is None or told is None or factor_of(asked) == factor_of(told):
        return asked or told, ()
    return asked, (f"{path}: the header gives {what} in {shown(told)}, but {asked} is used, as given by --units",)


def _table(path, head: Head, body: str) -> np.ndarray:
    """Rows of numbers (m, n), NaN where a height is missing."""
    comma = head.delimiter != "," and "," in body
    plain = body.replace(",", ".") if comma else body
    if plain.isascii() and "_" not in plain and not (comma and "." in body):
        try:
            table = np.loadtxt(io.BytesIO(plain.encode()), delimiter=head.delimiter, comments=None, ndmin=2)
            if not np.isinf(table).any():
                return table
        except ValueError:
            pass  # the line at fault is found below
    rows = []
    for number, line in enumerate(body.split("\n"), head.number + 1):
        if row := _row(f"{path}:{number}", line, head.delimiter, len(head.row)):
            rows.append(row)
    return np.array(rows, float)


def _row(at: str, line: str, delimiter: str | None, count: int) -> list:
    """Heights of a line, [] of a blank one."""
    line = line.strip("\r\n \t" if delimiter is None else "\r\n ")
    if not line.strip():
        return []
    if line.startswith(COMMENT):
        if ":" in line or "=" in line:
            raise PatchfemError(f"{at}: '{shown(line)}' ends the scan or begins another one; keep only one scan per "
                                "file")
        return []
    cells = [cell.strip() for cell in line.split(delimiter)]
    cells = cells if len(cells) == count else trimmed(cells)
    if len(cells) != count:
        raise PatchfemError(f"{at}: {len(cells)} numbers, but the first row of the matrix has {count}; write nan for a "
                            "missing height, and one row of the scan per line")
    bad = next((cell for cell in cells if not is_number(cell, delimiter)), None)
    if bad is not None:
        raise PatchfemError(f"{at}: '{shown(bad)}' is not a height; write a missing height as nan")
    return [np.nan if VOID.fullmatch(cell) else float(cell.replace(",", ".") if COMMA.fullmatch(cell) else cell)
            for cell in cells]
