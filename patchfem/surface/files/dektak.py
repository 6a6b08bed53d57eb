"""Line scan that a Dektak stylus instrument exported as CSV.

The lateral column is printed to 0.1 um, so the step that it shows is wrong by half of that; the
true step is the length of the scan over the number of its points. Heights and positions stay as the
instrument wrote them: raw, not levelled, from 0 on.
"""

import re
from dataclasses import replace

import numpy as np

from ...core import PatchfemError
from ...formatting import format_length
from ..profile import Profile
from ..samples import make_trace, printed_digit
from .head import Head
from .raw import RawFile, shorten
from .rows import read_columns
from .text import decode_text
from .units import parse_length_unit

FIRST_WORDS = b"Scan Parameters"  # words with which every export begins
MIN_DIGIT = 1e-5  # smallest printed digit of x, in the unit of the file
# Largest distance of a rounded position from the true one, in printed
# digits: a half, and round-off.
MAX_STEP_ERROR = 0.6
_LENGTH = re.compile(
    r"^Length,\s*([+-]?[0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)\s*([^\W\d_]*)\s*$", re.MULTILINE
)
_HEADER = re.compile(r"^\s*Lateral\s+(\w+)\s*,\s*Raw\s+(\w+)[^\n]*$", re.MULTILINE | re.IGNORECASE)


def read_dektak(raw: RawFile) -> Profile:
    """Read the trace of a Dektak export; a PatchfemError names the line that cannot be read."""
    path = raw.path
    text = decode_text(raw)
    header = _HEADER.search(text)
    if header is None:
        raise PatchfemError(
            f"{path}: a Dektak export without the columns `Lateral um,Raw Micrometer`; export the "
            "scan data as CSV"
        )
    number = text.count("\n", 0, header.start()) + 1
    factors = []
    for word in header.groups():
        factor = _parse_unit(word)
        if factor is None:
            raise PatchfemError(
                f"{path}:{number}: unknown unit '{shorten(word)}'; export the scan in Micrometer "
                "or Angstrom"
            )
        factors.append(factor)
    body = text[header.end() + 1 :]
    if body.count(",,\n") == body.count("\n"):
        body = body.replace(",,\n", "\n")  # two empty columns end each row
    head = Head([], [], [], ",", number, 0)
    values, lines = read_columns(path, body, head, {"x": 0, "z": 1}, 2)
    settings, _, _ = text[: header.start()].partition("\nFunction,")  # the results follow this line
    length = _LENGTH.search(settings)
    factor = length and _parse_unit(length[2])
    x = values["x"]
    note = ""
    if factor and np.isfinite(float(length[1])):
        x, note = _restore_places(x, float(length[1]) * factor, factors[0])
    trace = make_trace(path, x, values["z"], lines, tuple(factors))
    return replace(trace, notes=(f"{path}: {note}", *trace.notes)) if note else trace


def _parse_unit(word: str) -> float | None:
    """Return the factor of a length unit to metres, or None for any other text."""
    return 1e-10 if word.lower() == "a" else parse_length_unit(word)


def _restore_places(x, length: float, factor: float) -> tuple[np.ndarray, str]:
    """Replace rounded positions by equally spaced ones that fit the length in the header.

    The printed positions stay if the steps do not fit them. factor: of x to metres.
    """
    if x.size < 3 or not np.isfinite(x).all() or not x[-1] > x[0]:
        return x, ""
    numbers = np.arange(x.size)
    digit = max(printed_digit(x), MIN_DIGIT)
    for count in (x.size, x.size - 1):
        step = length / factor / count
        places = x[0] + step * numbers
        if np.abs(x - places).max() <= MAX_STEP_ERROR * digit:
            return places, (
                f"x is rounded to {format_length(digit * factor)} in the file; the step "
                f"{format_length(length)}/{count} = {format_length(step * factor)} of the header is used"
            )
    return x, (
        f"the length of {format_length(length)} in the header does not fit {x.size} samples that end at "
        f"{format_length(x[-1] * factor)}: the x values of the samples are used"
    )
