"""The peaks of [contact.asperities] law = "hertz" from a trace, or from its root mean squares."""

from functools import lru_cache
from pathlib import Path

from ..core import PatchfemError
from ..scene.keys.contact import Asperities
from ..surface.files.read import read_profile
from ..surface.roughness.peaks import Moments, moments_of, peaks_of

AT = "contact.asperities."


def skin_asked(table: Asperities, beside) -> Asperities:
    """The table with the radius, density and height_deviation that its law asks for, of its trace the root mean squares
    too; beside(name) -> path of a file that the scene names. PatchfemError with the key where no surface has them."""
    if table.radius is not None:
        return table
    if table.from_ is not None:
        found = of_trace(Path(beside(table.from_)))[0]
        table = table.model_copy(update={"from_": str(beside(table.from_)), **{
            f"rms_{name}": one for name, one in found._asdict().items()}})
    try:
        one = peaks_of(Moments(table.rms_height, table.rms_slope, table.rms_curvature))
    except PatchfemError as error:
        raise PatchfemError(str(error), f"{AT}from" if table.from_ else f"{AT}rms_height") from None
    return table.model_copy(update={"radius": one.radius, "density": one.density, "height_deviation": one.deviation})


def of_trace(path: Path) -> tuple:
    """Moments of the trace in a file, and the Peaks that every second sample tells, None where it tells none; a file is
    read once. PatchfemError with the key for one that has no peaks of a surface."""
    try:
        return _read(path, path.stat().st_mtime_ns if path.exists() else 0)
    except PatchfemError as error:
        raise type(error)(str(error), f"{AT}from") from None


@lru_cache(maxsize=4)
def _read(path: Path, stamp: int) -> tuple:
    trace = read_profile(path)
    found = moments_of(trace)
    peaks_of(found)
    try:
        return found, peaks_of(moments_of(trace, 2))
    except PatchfemError:
        return found, None
