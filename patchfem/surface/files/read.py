"""Reader of a measured surface, a trace or an areal scan, from a file of any format."""

from dataclasses import replace
from importlib.util import find_spec

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from .arrays import read_mat, read_npy
from .dektak import FIRST_WORDS, read_dektak
from .instruments import read_instrument
from .raw import TEXT_SUFFIXES, fetch
from .text import read_text
from .units import UNITS_IGNORED
from .x3p import read_x3p

READERS = {"npy": read_npy, "mat": read_mat, "binary": read_instrument, "text": read_text}
# Readers of the formats that state their units.
READERS_WITH_UNITS = {"x3p": read_x3p, "dektak": read_dektak}
# Start of a text file with heights in wavelengths, which SurfaceTopography reads.
WYKO = b"Wyko ASCII"


def read_surface(path, units: tuple | None = None) -> Profile | Areal:
    """Read the surface in a file: a trace as `Profile`, an areal scan as `Areal`, in metres.

    units: units of x (and y) and of z, such as ("mm", "um"): they complete a file that states none,
    and overrule the header of a text with a note; a format that states its units keeps them, with a
    note. Heights keep the sign of the file. Raises PatchfemError that names file and line, Missing
    if there is no file.
    """
    if units is not None and (
        isinstance(units, str) or not hasattr(units, "__len__") or len(units) != 2
    ):
        raise PatchfemError(
            f'{path}: give two units, of x and of z, such as ("mm", "um"), not {units!r}'
        )
    raw = fetch(path)
    kind = raw.kind
    if kind == "text":
        start = raw.data[:80].replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \r\n\t")
        if start.startswith(FIRST_WORDS):
            kind = "dektak"
        elif start.startswith(WYKO):
            kind = "binary"
    if kind in READERS_WITH_UNITS:
        surface = READERS_WITH_UNITS[kind](raw)
        if units is None:
            return surface
        return replace(surface, notes=(*surface.notes, f"{path}: {UNITS_IGNORED}"))
    try:
        return READERS[kind](raw, units)
    except PatchfemError:
        is_plain_text = raw.suffix in ("", *TEXT_SUFFIXES)
        if kind != "text" or is_plain_text or find_spec("SurfaceTopography") is None:
            raise
    return read_instrument(raw, units)


def read_profile(path, units: tuple | None = None) -> Profile:
    """Read the trace in a file; raise PatchfemError for an areal scan."""
    surface = read_surface(path, units)
    if isinstance(surface, Areal):
        rows, columns = surface.z.shape
        raise PatchfemError(
            f"{path}: an areal scan of {rows} x {columns} heights, but a single trace is needed; "
            "write one row of the scan to a file with the header `x [um],z [um]`"
        )
    return surface
