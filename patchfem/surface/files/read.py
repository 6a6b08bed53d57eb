"""Any file of a measured surface as a trace or an areal scan; the format is known by its content, then its suffix."""

from dataclasses import replace
from importlib.util import find_spec

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from .arrays import mat, npy
from .dektak import MARK, dektak
from .instruments import instrument
from .raw import PLAIN, Raw, fetch
from .text import columns
from .units import ASIDE
from .x3p import x3p

KINDS = {"npy": npy, "mat": mat, "binary": instrument}
TOLD = {"x3p": x3p, "dektak": dektak}  # formats that tell their units
WYKO = b"Wyko ASCII"  # first words of heights in wavelengths, which SurfaceTopography reads


def read_surface(path, units: tuple | None = None) -> Profile | Areal:
    """Read the surface in a file: a trace as `Profile`, an areal scan as `Areal`, heights and places in metres.

    units: names of the units of x (and y) and of z, such as ("mm", "um"): they complete a file that names none, and
    overrule a header of text, with a note; a format that tells its units keeps them, with a note. Heights keep the sign
    of the file. PatchfemError names file and line of a fault, Missing what is not there.
    """
    if units is not None and (isinstance(units, str) or not hasattr(units, "__len__") or len(units) != 2):
        raise PatchfemError(f'{path}: give two units, of x and of z, such as ("mm", "um"), not {units!r}')
    raw = fetch(path)
    begins = raw.data[:80].replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \r\n\t") if raw.kind == "text" else b""
    kind = "dektak" if begins.startswith(MARK) else raw.kind
    if kind in TOLD:
        found = TOLD[kind](raw)
        return found if units is None else replace(found, notes=(*found.notes, f"{path}: {ASIDE}"))
    if begins.startswith(WYKO):
        return instrument(raw, units)
    return _text(raw, units) if kind == "text" else KINDS[kind](raw, units)


def read_profile(path, units: tuple | None = None) -> Profile:
    """Read the one trace in a file (`read_surface`); PatchfemError for an areal scan."""
    found = read_surface(path, units)
    if isinstance(found, Areal):
        raise PatchfemError(f"{path}: an areal scan of {found.z.shape[0]} x {found.z.shape[1]} heights, but a single "
                            "trace is needed; write one row of the scan to a file with the header `x [um],z [um]`")
    return found


def _text(raw: Raw, units: tuple | None) -> Profile | Areal:
    try:
        return columns(raw, units)
    except PatchfemError:
        if raw.suffix in PLAIN or find_spec("SurfaceTopography") is None:
            raise
    return instrument(raw, units)

