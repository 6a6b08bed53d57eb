"""Columns of a text file whose header names the units: `x [um],z [um]` is a trace, `x [um],y [um],z [um]` a raster.

The columns stand in any order; `x (um)`, `x_um`, `x/um` and `x in um` mean the same, and names and units may stand in a
line each. Columns stand apart by commas, semicolons, tabs, bars or blanks. The decimal sign is a point, or a comma
where columns do not stand apart by commas or cells are quoted. Lines that start with #, % or // are comments, and the
header itself may be one. A height that is empty, `nan` or `***` is missing.
UTF-8 with or without its mark, UTF-16 with it, else Latin-1.
"""

import io
import re
from array import array
from dataclasses import replace

import numpy as np

from ...core import PatchfemError
from ...inputs.cells import NUMBER
from ..areal import Areal
from ..profile import Profile
from ..samples import GIVEN, checked
from .head import COMMA, COMMENT, EXAMPLE, LOST, SIGNS, WIDEST, Head, head_of, is_number, role_of, trimmed
from .matrix import is_matrix, matrix
from .raster import raster
from .raw import Raw, shown
from .units import GIVE, LISTED, factor_of, pixel_of

_QUOTED = re.compile(r'"\s*([+-]?[0-9]*),([0-9]+(?:[eE][+-]?[0-9]+)?)\s*"')
_WIDE = re.compile(rf"\n[^\n]{{{WIDEST + 1}}}")
_COUNTS = {1: "one", 2: "two", 3: "three", 4: "four"}


def columns(raw: Raw, given: tuple | None = None) -> Profile | Areal:
    """The trace or areal scan in a text file of two or three columns, in the order of growing x; of a matrix the scan.

    given: units of x (and y) and of z; they complete what the file does not tell, and overrule with a note what it
    does. Samples at one x become their mean, x that only its printed digits keep from even spacing is evened, both with
    a note; an x that turns back is refused. A million samples: 0.3 s. PatchfemError names the line.
    """
    path, text = raw.path, text_of(raw)
    pixel = given is not None and pixel_of(given[0]) is not None
    for unit in (given or ())[pixel:]:
        if factor_of(unit) is None:
            raise PatchfemError(f"{path}: unknown unit '{shown(unit)}'; use one of {LISTED}")
    head = head_of(path, text)
    facts = {} if head.named else head.facts(path)
    at, names, units = _above(head)
    if not head.named and is_matrix(len(head.row), names, facts):
        return matrix(path, head, facts, given, text[head.start:])
    if pixel:
        raise PatchfemError(f"{path}: '{shown(given[0])}' is a pixel size, which is needed only for a matrix of "
                            "heights, but this file has columns; give the units of the columns")
    if len(head.named or head.row) < 2:
        raise PatchfemError(f"{path}:{head.number + 1}: only one column, '{shown(head.row[0])}', but x and z are "
                            f"needed; {EXAMPLE}")
    if not (names or given or units or "lateral" in facts):
        raise PatchfemError(f"{path}:{at}: there is no header, and units are never guessed; {EXAMPLE} above the first "
                            f"sample, or {GIVE}")
    place, notes = _roles(f"{path}:{at}", names or list("xz" if len(head.row) == 2 else "xyz"), given is not None)
    found, lines = values(path, text[head.start:], head.number, place, head.delimiter, len(names or head.row))
    if "valid" in place:
        found["z"] = np.where(found.pop("valid") == 0, np.nan, found["z"])
    if list(place) == ["x", "y", "z"] and not {"x", "y"} <= {role_of(cell)[0] for cell in names} and _counted(found):
        place, found = {"x": place["y"], "z": place["z"]}, {"x": found["y"], "z": found["z"]}
        notes += (f"{path}: the first column numbers the samples; x and z are taken from the other columns",)
    factors, more = _factors(f"{path}:{at}", place, (names, units), facts, given)
    said = GIVEN if given else ""
    if "y" not in place:
        trace = checked(path, found["x"], found["z"], lines, factors, said)
    else:
        trace = raster(path, [found[name] for name in "xyz"], lines, factors, said)
    return replace(trace, notes=(*notes, *more, *trace.notes))


def text_of(raw: Raw) -> str:
    """The text of a file with lines that end in \\n, without quotes."""
    path, data = raw.path, raw.data
    if not data.strip(b"\xef\xbb\xbf \t\r\n"):
        raise PatchfemError(f"{path}: the profile is empty; export it again as text with two columns and {EXAMPLE}")
    text = data.decode(_encoding(raw), errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    return _QUOTED.sub(r"\1.\2", text).replace('"', "") if '"' in text else text


def _encoding(raw: Raw) -> str:
    path, data = raw.path, raw.data
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if raw.kind != "text" or re.search(rb"[\x00-\x08\x0e-\x1f\x7f]", data):
        raise PatchfemError(f"{path}: not a text file; export the profile as text with two columns and {EXAMPLE}")
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _above(head: Head) -> tuple:
    """Line of the head that names the columns, for messages; their names; their units from a line of their own."""
    if head.named:
        return head.number, head.named, []
    (number, names), units = head.beside(len(head.row))
    return number or head.number + 1, names, units


def _roles(at: str, cells: list, given: bool) -> tuple:
    """What named columns are -> their places, in the order x, (y,) z, (valid); notes. given: units were given, so that
    columns of unknown names count by their place."""
    roles = {k: role_of(cell)[0] for k, cell in enumerate(cells)}
    valid = {role: k for k, role in roles.items() if role == "valid"}
    data = {k: role for k, role in roles.items() if role not in ("valid", "index")}
    if not 1 < len(data) < 4:
        what = f"{len(cells)} columns" if len(data) == len(cells) else f"{', '.join(map(shown, cells))}"
        raise PatchfemError(f"{at}: {what}, but x and z, or x, y and z, are needed; keep one trace of two columns and "
                            f"{EXAMPLE}")
    known, notes = ("x", "z") if len(data) == 2 else ("x", "y", "z"), ()
    if sorted(data.values()) == ["x", "y"]:
        data = {k: "z" if role == "y" else role for k, role in data.items()}  # heights over x
    strange = next((cells[k] for k, role in data.items() if role not in known), None)
    if strange is not None and not given:
        listed = " and ".join(filter(None, (", ".join(known[:-1]), known[-1])))
        raise PatchfemError(f"{at}: column '{shown(strange.partition('[')[0].strip())}' is not known; the columns "
                            f"{listed} are needed; {EXAMPLE}")
    if strange is not None:
        names = ", ".join(f"'{shown(cells[k])}'" for k in data)
        data = dict(zip(data, known))
        notes = (f"{at}: columns {names} are taken as {', '.join(known)} in this order",)
    if len(set(data.values())) < len(data):
        twice = next(role for role in known if list(data.values()).count(role) > 1)
        raise PatchfemError(f"{at}: two columns are named {twice}; {EXAMPLE}")
    place = {role: k for k, role in data.items()}
    return {role: place[role] for role in known} | valid, notes


def _factors(at: str, place: dict, cells: tuple, facts: dict, given: tuple | None) -> tuple:
    """Factors to metres of x, (y,) z; notes where a unit that was given overrules that of the file.

    cells: names and units of the columns, [] where no line has them; facts: what the head tells beside.
    """
    names, units = cells
    factors, notes = [], ()
    for name, k in place.items():
        if name == "valid":
            continue
        told = role_of(names[k])[1] if names else None
        told = units[k] if told is None and units else told
        if told is None:
            told = facts.get("value" if name == "z" else "lateral", (None, None))[1]
        unit = given[name == "z"] if given else told
        if unit is None:
            raise PatchfemError(f"{at}: column '{shown(names[k] if names else name)}' has no unit, and units are never "
                                f"guessed; {EXAMPLE}, or {GIVE}")
        if factor_of(unit) is None:
            raise PatchfemError(f"{at}: unknown unit '{shown(unit)}' of {name}; use one of {LISTED}")
        if told is not None and factor_of(told) != factor_of(unit):
            notes += (f"{at}: the header gives {name} in {shown(told)}, but {unit} is used, as given by --units",)
        factors.append(factor_of(unit))
    return tuple(factors), notes


def _counted(found: dict) -> bool:
    """Whether x is 0, 1, 2, ... or 1, 2, 3, ... and y grows or falls from row to row, as on no raster."""
    x, steps = found["x"], np.diff(found["y"])
    return bool(x.size > 2 and x[0] in (0, 1) and (np.diff(x) == 1).all() and ((steps > 0).all() or (steps < 0).all()))


def values(path, body: str, number: int, place: dict, delimiter, width: int) -> tuple:
    """Columns by what they are, x, (y,) z, at their places among `width`, in the file's units, NaN where a height is
    missing; the line of each row. number: lines above the body."""
    first = next((line for line in _lines(body) if line.strip() and not line.lstrip().startswith(COMMENT)), "")
    delimiter = _delimiter(first, delimiter, width)
    comma = delimiter != "," and "," in body
    if comma:
        comma = any("," in line for line in _lines(body) if not line.lstrip().startswith(COMMENT))
    table, at = (None, None) if comma and "." in body else _quick(body.replace(",", ".") if comma else body, delimiter)
    if table is not None and table.shape[1] == width:
        return {name: table[:, k] for name, k in place.items()}, at + number + 1
    rows, at = array("d"), array("q")
    for count, line in enumerate(_lines(body), number + 1):
        row = _row(f"{path}:{count}", line, (place, width), delimiter, comma)
        if row is not None:
            rows.extend(row)
            at.append(count)
    return dict(zip(place, np.array(rows).reshape(-1, len(place)).T)), np.array(at)


def _lines(body: str):
    start = 0
    while start < len(body):
        stop = body.find("\n", start)
        stop = len(body) if stop < 0 else stop
        yield body[start:stop]
        start = stop + 1


def _delimiter(line: str, ours, count: int):
    """The delimiter that makes `count` numbers of a line; that of the header, `ours`, is tried first."""
    for sign in (ours, *SIGNS, None) if len(line) <= WIDEST else ():
        cells = [cell.strip() for cell in line.split(sign)]
        full = trimmed(cells)
        if len(full) <= count <= len(cells) and all(is_number(cell, sign) for cell in full):
            return sign
    return ours


def _quick(body: str, delimiter) -> tuple:
    """The table (k, columns) of a text of numbers and blank lines and nothing else, and the line of each row from 0;
    None twice for any other text."""
    plain = body.strip() and body.isascii() and "_" not in body  # loadtxt may take what no number is
    if not plain or _WIDE.search(f"\n{body[:WIDEST + 1]}") or _WIDE.search(body):
        return None, None
    body = body.rstrip("\n")
    at = np.arange(body.count("\n") + 1)
    if "\n\n" in f"\n{body}":
        at = np.array([k for k, line in enumerate(body.split("\n")) if line])
    try:
        table = np.loadtxt(io.BytesIO(body.encode()), delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return None, None
    good = len(table) == at.size and np.isfinite(table).all()
    return (table, at) if good else (None, None)


def _row(at: str, line: str, columns: tuple, delimiter, comma: bool) -> list | None:
    """Numbers of a line for the columns wanted, (their places, how many there are); None for a comment or a blank
    line."""
    place, width = columns
    if not line.strip(" \t,;|") or line.lstrip().startswith(COMMENT):
        return None
    words = _COUNTS[width]
    if len(line) > WIDEST:
        raise PatchfemError(f"{at}: the line is {len(line)} characters long; {words} numbers are needed")
    cells = [cell.strip() for cell in line.split(delimiter)]
    while len(cells) > width and not cells[-1]:
        cells.pop()
    if delimiter == "," and len(cells) == 2 * width:
        raise PatchfemError(f"{at}: '{shown(line)}': {words} numbers are needed; with a decimal comma, separate "
                            "the columns by semicolons or tabs")
    if len(cells) != width:
        raise PatchfemError(f"{at}: '{shown(line)}': {words} numbers are needed; write nan for a missing height")
    if comma and "." in line:
        raise PatchfemError(f"{at}: '{shown(line)}': the decimal sign is a comma elsewhere in the file and a point "
                            "here; use the same sign in the whole file")
    if comma:
        cells = [cell.replace(",", ".") if COMMA.fullmatch(cell) else cell for cell in cells]
    return [_value(at, name, cells[k]) for name, k in place.items()]


def _value(at: str, name: str, cell: str) -> float:
    if name == "z" and LOST.fullmatch(cell):
        return np.nan
    if NUMBER.fullmatch(cell) or re.fullmatch(r"[+-]?(?:nan|inf)", cell, re.IGNORECASE):
        return float(cell)
    if name == "z":
        raise PatchfemError(f"{at}: '{shown(cell)}' is not a height; write a missing height as nan")
    raise PatchfemError(f"{at}: '{shown(cell)}' is not a number for {name}; correct the line or delete it")
