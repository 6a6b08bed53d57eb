"""Columns of a text file whose header names the units: `x [um],z [um]` is a trace, `x [um],y [um],z [um]` a raster.

The columns stand in any order; `x (um)`, `x_um` and `x/um` mean the same. They stand apart by commas, semicolons, tabs,
bars or blanks. The decimal sign is a point, or a comma where columns do not stand apart by commas or cells are quoted.
Lines that start with #, % or // are comments, and the header itself may be one. A height that is empty, `nan` or `***`
is missing. UTF-8 with or without its mark, UTF-16 with it, else Latin-1.
"""

import io
import re
from array import array

import numpy as np

from ...core import PatchfemError
from ...inputs.cells import NUMBER
from ..areal import Areal
from ..profile import Profile
from ..samples import checked
from .raster import raster
from .raw import Raw, shown

UNITS = {"m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9,
         "in": 0.0254, "ft": 0.3048, "mil": 25.4e-6}
WIDEST = 1000  # characters of a line
EXAMPLE = "write the header as `x [um],z [um]`"
_SIGNS = (";", ",", "\t", "|")
_COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
_LOST = re.compile(r"(?:[+-]?nan|\*+)?", re.IGNORECASE)
_COLUMN = re.compile(r"(\w+?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|[_/]\s*(\w+))")
_CELL = re.compile(r"[^\s\[\](]+\s*(?:\[[^\]]*\]|\([^)]*\))|\S+")
_QUOTED = re.compile(r'"\s*([+-]?[0-9]*),([0-9]+(?:[eE][+-]?[0-9]+)?)\s*"')
_WIDE = re.compile(rf"\n[^\n]{{{WIDEST + 1}}}")
_COMMENT = ("#", "%", "//")


def columns(raw: Raw, given: tuple | None = None) -> Profile | Areal:
    """The trace or areal scan in a text file of two or three columns, in the order of growing x.

    given: units of x (and y) and of z where the file names none. Samples at one x become their mean, x that only its
    printed digits keep from even spacing is evened, both with a note; an x that turns back is refused. A million
    samples: 0.3 s. PatchfemError names the line.
    """
    path, text = raw.path, text_of(raw)
    header, number, body = _header(path, text)
    names, cells, delimiter = _names(header, False)
    if all(_is_number(cell, delimiter) for cell in cells):
        if given is None:
            raise PatchfemError(f"{path}:{number}: no header, and units are never guessed; {EXAMPLE} above the first "
                                "sample")
        names = {2: ["x", "z"], 3: ["x", "y", "z"]}.get(len(cells), cells)
        cells, body, number = names, f"{header}\n{body}", number - 1
    order, factors = _columns(f"{path}:{max(number, 1)}", cells, given, header)
    found, at = values(path, body, number, order, delimiter)
    if len(order) == 2:
        return checked(path, *found, at, factors)
    return raster(path, *found, at, factors)


def text_of(raw: Raw) -> str:
    """The text of a file with lines that end in \\n, without quotes."""
    path, data = raw.path, raw.data
    if not data.strip(b"\xef\xbb\xbf \t\r\n"):
        raise PatchfemError(f"{path}: the profile is empty")
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


def _header(path, text: str) -> tuple:
    """First line that is no comment, or a comment that is columns with units; its line number; the text after it."""
    start = number = 0
    while start < len(text):
        stop = text.find("\n", start)
        stop = len(text) if stop < 0 else stop
        line, number = text[start:stop].strip(), number + 1
        start = stop + 1
        comment = line.startswith(_COMMENT)
        if len(line) > WIDEST and not comment:
            raise PatchfemError(f"{path}:{number}: a line of {len(line)} characters; two columns are wanted, {EXAMPLE}")
        if comment:
            line = line[:WIDEST].lstrip("#%/").strip()
            names, cells, delimiter = _names(line, True)
            if names:
                return (delimiter or " ").join(cells), number, text[start:]
        elif line:
            return line, number, text[start:]
    raise PatchfemError(f"{path}: no data, only comments")


def _names(line: str, comment: bool) -> tuple:
    """Names of the columns where every cell is one with a unit, else []; the cells of a line; the delimiter.

    The last column of a comment may go on with other words, which are left out.
    """
    cells, delimiter = _split(line)
    found = [_COLUMN.fullmatch(cell) for cell in cells]
    if comment and len(cells) > 1 and None in found:
        last = found.index(None)
        more = _COLUMN.match(cells[last])
        if more and cells[last][more.end():][:1].isspace():
            found, cells = [*found[:last], more], [*cells[:last], more[0]]
    good = 1 < len(found) < 4 and None not in found
    return ([one[1] for one in found] if good else []), cells, delimiter


def _split(text: str) -> tuple:
    """Cells of a line without the empty ones at the end, and the delimiter between them, None for blanks."""
    for delimiter in (*_SIGNS, None):  # numbers with a decimal comma stand apart by something else
        cells = _trimmed(text.split(delimiter))
        if 1 < len(cells) < 4 and all(_is_number(cell, delimiter) for cell in cells):
            return cells, delimiter
    delimiter = next((sign for sign in _SIGNS if sign in text), None)
    return _trimmed(text.split(delimiter) if delimiter else _CELL.findall(text)), delimiter


def _trimmed(cells: list) -> list:
    cells = [cell.strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _is_number(cell: str, delimiter) -> bool:
    number = NUMBER.fullmatch(cell) or _LOST.fullmatch(cell)
    return bool(number or (delimiter != "," and _COMMA.fullmatch(cell)))


def _columns(at: str, cells: list, given: tuple | None, header: str) -> tuple:
    """Meaning of the header: places of x, (y,) z; factors of x, (y,) z."""
    if len(cells) < 2:
        raise PatchfemError(f"{at}: one column, '{shown(header)}', where x and z are wanted; {EXAMPLE}")
    if len(cells) > 3:
        raise PatchfemError(f"{at}: {len(cells)} columns where x and z, or x, y and z, are wanted; keep one trace of "
                            f"two columns and {EXAMPLE}")
    found, known = {}, ("x", "z") if len(cells) == 2 else ("x", "y", "z")
    for place, cell in enumerate(cells):
        name, factor = _column(at, cell, known, given)
        if name in found:
            raise PatchfemError(f"{at}: two columns are named {name}; {EXAMPLE}")
        found[name] = place, factor
    return tuple(zip(*(found[name] for name in known)))


def _column(at: str, cell: str, known: tuple, given: tuple | None) -> tuple:
    """(name, factor) of a column; its own unit counts, and one given for it must be the same."""
    match = _COLUMN.fullmatch(cell)
    if match is None and (given is None or cell.lower() not in known):
        raise PatchfemError(f"{at}: column '{shown(cell)}' has no unit, and units are never guessed; {EXAMPLE}")
    name = (match[1] if match else cell).lower()
    if name not in known:
        listed = " and ".join(filter(None, (", ".join(known[:-1]), known[-1])))
        raise PatchfemError(f"{at}: column '{shown(match[1])}' is not known, {listed} are wanted; {EXAMPLE}")
    asked = None if given is None else given[name == "z"]
    unit = next((part for part in match.groups()[1:] if part is not None), "").strip() if match else asked
    factor = UNITS.get(unit.replace("µ", "u").replace("μ", "u"))
    if factor is None:
        raise PatchfemError(f"{at}: unknown unit '{shown(unit)}' of {name}; use one of {', '.join(UNITS)}")
    if asked is not None and UNITS.get(asked) != factor:
        raise PatchfemError(f"{at}: the header gives {name} in {shown(unit)}, but {shown(asked)} was given for it; "
                            "leave the units out, the header names them")
    return name, factor


def values(path, body: str, number: int, order: tuple, delimiter) -> tuple:
    """Columns x, (y,) z in the file's units, z NaN where missing, and the line of each row."""
    first = next((line for line in _lines(body) if line.strip() and not line.lstrip().startswith(_COMMENT)), "")
    delimiter = _delimiter(first, delimiter, len(order))
    comma = delimiter != "," and "," in body
    if comma:
        comma = any("," in line for line in _lines(body) if not line.lstrip().startswith(_COMMENT))
    table, at = (None, None) if comma and "." in body else _quick(body.replace(",", ".") if comma else body, delimiter)
    if table is not None and table.shape[1] == len(order):
        return [table[:, place] for place in order], at + number + 1
    rows, at = array("d"), array("q")
    for count, line in enumerate(_lines(body), number + 1):
        row = _row(f"{path}:{count}", line, order, delimiter, comma)
        if row is not None:
            rows.extend(row)
            at.append(count)
    return list(np.array(rows).reshape(-1, len(order)).T), np.array(at)


def _lines(body: str):
    start = 0
    while start < len(body):
        stop = body.find("\n", start)
        stop = len(body) if stop < 0 else stop
        yield body[start:stop]
        start = stop + 1


def _delimiter(line: str, ours, count: int):
    """The delimiter that makes `count` numbers of a line; that of the header, `ours`, is tried first."""
    for sign in (ours, *_SIGNS, None) if len(line) <= WIDEST else ():
        cells = [cell.strip() for cell in line.split(sign)]
        trimmed = _trimmed(cells)
        if len(trimmed) <= count <= len(cells) and all(_is_number(cell, sign) for cell in trimmed):
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


def _row(at: str, line: str, order: tuple, delimiter, comma: bool) -> list | None:
    """Numbers x, (y,) z of a line; None for a comment or a blank line."""
    if not line.strip(" \t,;|") or line.lstrip().startswith(_COMMENT):
        return None
    words = {2: "two", 3: "three"}[len(order)]
    if len(line) > WIDEST:
        raise PatchfemError(f"{at}: a line of {len(line)} characters; {words} numbers are wanted")
    cells = [cell.strip() for cell in line.split(delimiter)]
    while len(cells) > len(order) and not cells[-1]:
        cells.pop()
    if delimiter == "," and len(cells) == 2 * len(order):
        raise PatchfemError(f"{at}: '{shown(line)}': {words} numbers are wanted; with a decimal comma the columns "
                            "stand apart by semicolons or tabs")
    if len(cells) != len(order):
        raise PatchfemError(f"{at}: '{shown(line)}': {words} numbers are wanted; write nan for a missing height")
    if comma and "." in line:
        raise PatchfemError(f"{at}: '{shown(line)}': the decimal sign is a comma elsewhere in the file and a point "
                            "here; write it in one way")
    if comma:
        cells = [cell.replace(",", ".") if _COMMA.fullmatch(cell) else cell for cell in cells]
    return [_value(at, name, cells[place]) for name, place in zip("xz" if len(order) == 2 else "xyz", order)]


def _value(at: str, name: str, cell: str) -> float:
    if name == "z" and _LOST.fullmatch(cell):
        return np.nan
    if NUMBER.fullmatch(cell) or re.fullmatch(r"[+-]?(?:nan|inf)", cell, re.IGNORECASE):
        return float(cell)
    if name == "z":
        raise PatchfemError(f"{at}: '{shown(cell)}' is not a height; a missing one is empty, nan or ***")
    raise PatchfemError(f"{at}: '{shown(cell)}' is not a number for {name}; correct the line or leave it out")
