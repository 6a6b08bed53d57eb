"""A trace from a two-column text file whose header names the units: `x [um],z [um]`.

Columns stand apart by commas, semicolons, tabs or blanks; the decimal sign is a point. Lines that start with #, % or //
are comments, and the header itself may be one. A height that is empty, `nan` or `***` is missing. UTF-8 with or
without its mark, UTF-16 with it, else Latin-1; gzip is known by its first bytes.
"""

import gzip
import io
import re
import zlib
from array import array
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...core import Missing, PatchfemError
from ..profile import Profile
from ..samples import checked

UNITS = {"m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9,
         "in": 0.0254, "ft": 0.3048, "mil": 25.4e-6}
LARGEST = 64 * 2**20  # bytes of text, unpacked: four million samples
WIDEST = 1000  # characters of a line
EXAMPLE = "write the header as `x [um],z [um]`"
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_LOST = re.compile(r"(?:[+-]?nan|\*+)?", re.IGNORECASE)
_COLUMN = re.compile(r"(\w+)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))")
_CELL = re.compile(r"[^\s\[\](]+\s*(?:\[[^\]]*\]|\([^)]*\))|\S+")
_COMMENT = ("#", "%", "//")


def read_trace(path, units: Mapping = UNITS) -> Profile:
    """The trace of a file in the order of growing x; units: name of a length -> factor to metres.

    Samples at one x become their mean, x that only its printed digits keep from even spacing is evened, both with a
    note; an x that turns back is refused. A million samples: 0.5 s. PatchfemError, Missing where there is no file.
    """
    lines = _lines(path)
    header, number = _header(path, lines)
    order, delimiter, factors = _columns(path, number, header, units)
    x, z, at = _samples(path, lines, number, order, delimiter)
    return checked(path, x, z, at, factors)


def _lines(path):
    """An iterator over the text lines of a file."""
    data = _unpacked(path, _bytes(path))
    if not data.strip(b"\xef\xbb\xbf \t\r\n"):
        raise PatchfemError(f"{path}: the profile is empty")
    encoding = _encoding(path, data)
    return iter(io.TextIOWrapper(io.BytesIO(data), encoding=encoding, errors="replace"))


def _bytes(path) -> bytes:
    try:
        if Path(path).exists() and not Path(path).is_file():
            raise PatchfemError(f"{path}: not a file; a profile is a text file with two columns")
        with open(path, "rb") as file:
            data = file.read(LARGEST + 1)
    except FileNotFoundError:
        raise Missing(f"{path}: no such profile; contact.profile.file is relative to the scene") from None
    except (OSError, ValueError) as error:
        raise PatchfemError(f"{path}: the profile cannot be read ({error})") from None
    return _limited(path, data)


def _unpacked(path, data: bytes) -> bytes:
    if not data.startswith(b"\x1f\x8b"):
        return data
    try:
        with gzip.open(io.BytesIO(data)) as file:
            return _limited(path, file.read(LARGEST + 1))
    except (OSError, EOFError, zlib.error) as error:
        raise PatchfemError(f"{path}: the gzip file is damaged ({error}); pack it again") from None


def _limited(path, data: bytes) -> bytes:
    if len(data) > LARGEST:
        raise PatchfemError(f"{path}: more than {LARGEST >> 20} MiB of text; keep every few samples of the profile")
    return data


def _encoding(path, data: bytes) -> str:
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if re.search(rb"[\x00-\x08\x0e-\x1f\x7f]", data):
        raise PatchfemError(f"{path}: not a text file; export the profile as text with two columns and {EXAMPLE}")
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _header(path, lines) -> tuple:
    """First line that is no comment, or a comment that is two columns with units, and its line number."""
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if len(text) > WIDEST and not text.startswith(_COMMENT):
            raise PatchfemError(f"{path}:{number}: a line of {len(text)} characters; two columns are wanted, {EXAMPLE}")
        if text.startswith(_COMMENT):
            text = text[:WIDEST].lstrip("#%/").strip()
            if _is_header(text):
                return text, number
        elif text:
            return text, number
    raise PatchfemError(f"{path}: no data, only comments")


def _is_header(text: str) -> bool:
    cells, _ = _split(text)
    return len(cells) == 2 and all(_COLUMN.fullmatch(cell) for cell in cells)


def _split(text: str) -> tuple:
    """Cells of a line without the empty ones at the end, and the delimiter between them, None for blanks."""
    delimiter = next((sign for sign in ";,\t" if sign in text), None)
    cells = [cell.strip().strip('"').strip() for cell in (text.split(delimiter) if delimiter else _CELL.findall(text))]
    while cells and not cells[-1]:
        cells.pop()
    return cells, delimiter


def _columns(path, number: int, header: str, units: Mapping) -> tuple:
    """Meaning of the header: (place of x, of z), delimiter, (factor of x, of z)."""
    cells, delimiter = _split(header)
    at = f"{path}:{number}"
    if all(_NUMBER.fullmatch(cell) or _LOST.fullmatch(cell) for cell in cells):
        raise PatchfemError(f"{at}: no header, and units are never guessed; {EXAMPLE} above the first sample")
    if len(cells) < 2:
        raise PatchfemError(f"{at}: one column, '{_shown(header)}', where x and z are wanted; {EXAMPLE}")
    if len(cells) > 2:
        raise PatchfemError(f"{at}: {len(cells)} columns where x and z are wanted; keep one trace of two columns and "
                            f"{EXAMPLE}")
    found = {}
    for place, cell in enumerate(cells):
        name, factor = _column(at, cell, units)
        if name in found:
            raise PatchfemError(f"{at}: two columns are named {name}; {EXAMPLE}")
        found[name] = place, factor
    return (found["x"][0], found["z"][0]), delimiter, (found["x"][1], found["z"][1])


def _column(at: str, cell: str, units: Mapping) -> tuple:
    match = _COLUMN.fullmatch(cell)
    if match is None:
        raise PatchfemError(f"{at}: column '{_shown(cell)}' has no unit, and units are never guessed; {EXAMPLE}")
    name, unit = match[1].lower(), (match[2] if match[2] is not None else match[3]).strip()
    if name not in ("x", "z"):
        raise PatchfemError(f"{at}: column '{_shown(match[1])}' is not known, x and z are wanted; {EXAMPLE}")
    factor = units.get(unit.replace("µ", "u").replace("μ", "u"))
    if factor is None:
        raise PatchfemError(f"{at}: unknown unit '{_shown(unit)}' of {name}; use one of {', '.join(units)}")
    return name, factor


def _samples(path, lines, number: int, order: tuple, delimiter) -> tuple:
    """Samples x and z in the file's units, z NaN where missing, and the line of each."""
    x, z, at = array("d"), array("d"), array("q")
    first, second = order
    for count, line in enumerate(lines, number + 1):
        try:
            if len(line) > WIDEST or "_" in line or not line.isascii():
                raise ValueError  # float() would take 1_000 and foreign digits
            cells = line.split(delimiter)
            if len(cells) != 2:
                raise ValueError
            here, height = float(cells[first]), float(cells[second])
        except ValueError:
            row = _row(f"{path}:{count}", line.strip("\r\n"), order, delimiter)
            if row is None:
                continue
            here, height = row
        x.append(here)
        z.append(height)
        at.append(count)
    return np.array(x), np.array(z), np.array(at)


def _row(at: str, line: str, order: tuple, delimiter) -> tuple | None:
    """Numbers (x, z) of a line that is not simply two numbers; None for a comment or a blank line."""
    if not line.strip(" \t,;") or line.lstrip().startswith(_COMMENT):
        return None
    if len(line) > WIDEST:
        raise PatchfemError(f"{at}: a line of {len(line)} characters; two numbers are wanted")
    cells = [cell.strip().strip('"').strip() for cell in line.split(delimiter)]
    while len(cells) > 2 and not cells[-1]:
        cells.pop()
    if any(re.fullmatch(r"[+-]?[0-9]+,[0-9]+", cell) for cell in cells) or (delimiter == "," and len(cells) == 4):
        raise PatchfemError(f"{at}: '{_shown(line)}': two numbers are wanted; the decimal sign is a point, no comma")
    if len(cells) != 2:
        raise PatchfemError(f"{at}: '{_shown(line)}': two numbers are wanted; write nan for a missing height")
    here, height = cells[order[0]], cells[order[1]]
    if not _NUMBER.fullmatch(here):
        raise PatchfemError(f"{at}: '{_shown(here)}' is not a number for x; correct the line or leave it out")
    if _LOST.fullmatch(height):
        return float(here), np.nan
    if not _NUMBER.fullmatch(height):
        raise PatchfemError(f"{at}: '{_shown(height)}' is not a height; a missing one is empty, nan or ***")
    return float(here), float(height)


def _shown(text: str) -> str:
    text = text.encode("unicode_escape").decode() if not text.isprintable() else text
    return text if len(text) <= 40 else text[:37] + "..."
