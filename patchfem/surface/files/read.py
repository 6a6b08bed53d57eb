"""Reader of a measured surface, a trace or an areal scan, from a file of any format."""

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from .arrays import read_mat, read_npy
from .content import fetch
from .instruments import read_instrument
from .table import make_surface
from .text import read_text
from .units import LENGTH_UNIT_LIST, MISSING_SIZE_REMEDY, parse_length_unit

# Reader of each kind of content
READERS_BY_KIND = {"npy": read_npy, "mat": read_mat, "instrument": read_instrument}


def read_surface(path, units: tuple[str, str] | None = None) -> Profile | Areal:
    """Read the surface in a file: a trace as `Profile`, an areal scan as `Areal`, in metres.

    Parameters
    ----------
    path : path-like
        Text, NumPy, MATLAB or instrument file, which may be compressed by gzip.
    units : tuple of str, optional
        Units of x (and y) and of z, such as ("mm", "um"): they complete a file that states none, and overrule
        the header of a text with a note. A format that always states its units keeps them, with a note.

    Returns
    -------
    Profile or Areal
        Heights with the sign of the file.

    Raises
    ------
    Missing
        If there is no file, or a package that can read it is not installed.
    PatchfemError
        If the file cannot be read, with file and line, or if the units are not two units of length.
    """
    if units is not None:
        _require_units(path, units)
    content = fetch(path)
    if content.kind == "text":
        return make_surface(read_text(content, has_units=units is not None), units)
    return make_surface(READERS_BY_KIND[content.kind](content), units)


def _require_units(path, units) -> None:
    """Raise PatchfemError unless the units are a pair of units of length; the text "mm" is not the pair m and m.

    `path` names the file in the message.
    """
    is_pair = isinstance(units, tuple | list) and len(units) == 2
    if is_pair and all(isinstance(unit, str) and parse_length_unit(unit) for unit in units):
        return
    raise PatchfemError(
        f'{path}: the units {units!r} are not those of x and of z, such as ("mm", "um"): use two of {LENGTH_UNIT_LIST}; for '
        f"the size of a matrix of heights, which is no unit, {MISSING_SIZE_REMEDY} in a text"
    )


def read_profile(path, units: tuple[str, str] | None = None) -> Profile:
    """Read the trace in the file `path`.

    PatchfemError is raised for an areal scan. `units` are those of x and z, such as ("mm", "um").
    """
    surface = read_surface(path, units)
    if isinstance(surface, Areal):
        rows, columns = surface.z.shape
        raise PatchfemError(
            f"{path}: an areal scan of {rows} x {columns} heights, but a single trace is needed; "
            "write one row of the scan to a file with the header `x [um],z [um]`"
        )
    return surface
