"""Reader of a measured surface, a trace or an areal scan, from a file of any format."""

from importlib.util import find_spec

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from .arrays import read_mat, read_npy
from .content import TEXT_SUFFIXES, fetch
from .instruments import read_instrument
from .table import make_surface
from .text import read_text

READERS = {"npy": read_npy, "mat": read_mat, "instrument": read_instrument}


def read_surface(path, units: tuple[str, str] | None = None) -> Profile | Areal:
    """Read the surface in a file: a trace as `Profile`, an areal scan as `Areal`, in metres.

    Parameters
    ----------
    path : path-like
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
        If the file cannot be read, with file and line.
    """
    content = fetch(path)
    if content.kind != "text":
        return make_surface(READERS[content.kind](content), units)
    try:
        return make_surface(read_text(content, has_units=units is not None), units)
    except PatchfemError:
        if content.suffix in ("", *TEXT_SUFFIXES) or find_spec("SurfaceTopography") is None:
            raise
    return make_surface(read_instrument(content), units)


def read_profile(path, units: tuple[str, str] | None = None) -> Profile:
    """Read the trace in a file; raise PatchfemError for an areal scan."""
    surface = read_surface(path, units)
    if isinstance(surface, Areal):
        rows, columns = surface.z.shape
        raise PatchfemError(
            f"{path}: an areal scan of {rows} x {columns} heights, but a single trace is needed; "
            "write one row of the scan to a file with the header `x [um],z [um]`"
        )
    return surface
