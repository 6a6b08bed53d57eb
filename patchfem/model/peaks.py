"""The peaks of [contact.asperities] law = "hertz" from a trace, or from its root mean squares."""

from functools import lru_cache
from pathlib import Path

from ..core import PatchfemError
from ..scene.keys.contact import Asperities
from ..surface.files.read import read_profile
from ..surface.roughness.peaks import Moments, TraceMoments, gaussian_peaks, trace_moments

AT = "contact.asperities."


def complete_skin(table: Asperities, beside, cutoff: float | None = None) -> Asperities:
    """The table with the radius, density and height_deviation that its law asks for, of its trace the root mean squares
    too; beside(name) -> path of a file that the scene names; cutoff [m]: of the waves of a trace that count, None: all.
    PatchfemError with the key where no surface has them."""
    if table.radius is not None:
        return table
    if table.from_ is not None:
        found = of_trace(Path(beside(table.from_)), cutoff).fine
        table = table.model_copy(
            update={
                "from_": str(beside(table.from_)),
                "cutoff": cutoff,
                **{f"rms_{name}": one for name, one in found._asdict().items()},
            }
        )
    try:
        one = gaussian_peaks(Moments(table.rms_height, table.rms_slope, table.rms_curvature))
    except PatchfemError as error:
        raise PatchfemError(str(error), f"{AT}from" if table.from_ else f"{AT}rms_height") from None
    return table.model_copy(
        update={"radius": one.radius, "density": one.density, "height_deviation": one.deviation}
    )


def of_trace(path: Path, cutoff: float | None = None) -> TraceMoments:
    """What the waves below a cut-off [m] of the trace in a file tell, None: all waves; a file is read once.
    PatchfemError with the key for one that has no peaks of a surface."""
    try:
        return _read(path, path.stat().st_mtime_ns if path.exists() else 0, cutoff)
    except PatchfemError as error:
        cure = f"; {AT}cutoff sets this cut-off" if "cut-off" in str(error) else ""
        raise type(error)(f"{error}{cure}", f"{AT}from") from None


@lru_cache(maxsize=4)
def _read(path: Path, stamp: int, cutoff: float | None) -> TraceMoments:
    found = trace_moments(read_profile(path), cutoff)
    gaussian_peaks(found.fine)
    return found
