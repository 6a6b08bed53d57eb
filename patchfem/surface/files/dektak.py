"""A line scan of a Dektak stylus instrument as it exports it: CSV with the settings, its own results and the heights.

The lateral column is printed to 0.1 um, so that the step that it shows is wrong by half of that; the true step is the
length of the scan over the number of its points. Heights and places stay as the instrument wrote them: raw, not
levelled, from 0 on.
"""

import re
from dataclasses import replace

import numpy as np

from ...core import PatchfemError, say
from ..profile import Profile
from ..samples import checked
from .raw import Raw, shown
from .text import text_of, values

MARK = b"Scan Parameters"  # the first words of an export
_LENGTHS = {"m": 1.0, "mm": 1e-3, "millimeter": 1e-3, "um": 1e-6, "micrometer": 1e-6, "micron": 1e-6, "nm": 1e-9,
            "nanometer": 1e-9, "a": 1e-10, "å": 1e-10, "angstrom": 1e-10, "mil": 25.4e-6}
_QUANTITY = re.compile(r"\s*([+-]?[0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)\s*([^\W\d_]*)\s*")
_HEADER = re.compile(r"^\s*Lateral\s+(\w+)\s*,\s*Raw\s+(\w+)[^\n]*$", re.MULTILINE | re.IGNORECASE)


def dektak(raw: Raw) -> Profile:
    """The trace of a Dektak export; PatchfemError names the line."""
    path, text = raw.path, text_of(raw)
    header = _HEADER.search(text)
    if header is None:
        raise PatchfemError(f"{path}: a Dektak export without the columns `Lateral um,Raw Micrometer`; export the scan "
                            "data as CSV")
    number = text.count("\n", 0, header.start()) + 1
    factors = [_unit(f"{path}:{number}", word) for word in header.groups()]
    body = text[header.end() + 1:]
    if body.count(",,\n") == body.count("\n"):
        body = body.replace(",,\n", "\n")  # empty columns behind
    found, at = values(path, body, number, {"x": 0, "z": 1}, ",", 2)
    settings = _settings(text[:header.start()])
    x, notes = _stepped(path, found["x"], _length(settings.get("Length", "")), factors[0])
    found = checked(path, x, found["z"], at, tuple(factors))
    return replace(found, notes=notes + found.notes)


def _settings(head: str) -> dict:
    """Return the settings above the results of the instrument as name -> text."""
    settings = {}
    for line in head.split("\n"):
        cells = [cell.strip() for cell in line.split(",")]
        if cells[0] == "Function":  # the results of the instrument follow
            break
        if len(cells) > 1:
            settings.setdefault(cells[0], ",".join(cells[1:]))
    return settings


def _length(text: str) -> float | None:
    """A printed length [m], None where the text is none."""
    found = _QUANTITY.fullmatch(text.replace("µ", "u").replace("μ", "u"))
    factor = _LENGTHS.get(found[2].lower()) if found else None
    value = None if factor is None else float(found[1]) * factor
    return value if value is not None and np.isfinite(value) else None


def _unit(at: str, word: str) -> float:
    factor = _LENGTHS.get(word.lower().replace("µ", "u").replace("μ", "u"))
    if factor is None:
        raise PatchfemError(f"{at}: unknown unit '{shown(word)}'; export the scan in Micrometer or Angstrom")
    return factor


def _stepped(path, x, length: float | None, factor: float) -> tuple:
    """Places in even steps of the header's length over the number of points, in the unit of the file; the printed
    ones where these do not fit them."""
    if length is None or x.size < 3 or not np.isfinite(x).all() or not x[-1] > x[0]:
        return x, ()
    steps = np.arange(x.size)
    digits = 10.0 ** np.arange(3, -6, -1)
    digit = next((one for one in digits if np.abs(x / one - np.rint(x / one)).max() < 1e-4), digits[-1])
    for count in (x.size, x.size - 1):
        step = length / factor / count
        if np.abs(x - (x[0] + step * steps)).max() <= 0.6 * digit:  # half a digit, and the round-off of the printing
            return x[0] + step * steps, (
                f"{path}: x is rounded to {say(digit * factor)} in the file; the step {say(length)}/{count} = "
                f"{say(step * factor)} of the header is used",)
    return x, (f"{path}: the length of {say(length)} in the header does not fit {x.size} samples that end at "
               f"{say(x[-1] * factor)}: the x values of the samples are used",)
