"""Any file of a measured surface as a trace or an areal scan; the format is known by its content, then its suffix."""

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from .text import read_trace


def read_surface(path, units: tuple | None = None) -> Profile | Areal:
    """Read the surface in a file: a trace as `Profile`, an areal scan as `Areal`, heights and places in metres.

    units: names of the units of x (and y) and of z, such as ("mm", "um"), for a file that names none; where the file
    names its own, they must agree. Heights keep the sign of the file. PatchfemError names file and line of a fault,
    Missing what is not there.
    """
    return read_trace(path)


def read_profile(path, units: tuple | None = None) -> Profile:
    """Read the one trace in a file (`read_surface`); PatchfemError for an areal scan."""
    found = read_surface(path, units)
    if isinstance(found, Areal):
        raise PatchfemError(f"{path}: an areal scan of {found.z.shape[0]} x {found.z.shape[1]} heights where one trace "
                            "is wanted; write one of its rows to a file with the header `x [um],z [um]`")
    return found
