"""Files of measured surfaces, before and after: read, put in pairs, each direction compared."""

from ...core import PatchfemError
from ..areal import Areal
from ..files.read import read_surface
from .compare import Comparison, compared


def compared_files(paths: tuple, direction: str = "", units: tuple | None = None,
                   shift: float | None = None, keep_spikes: bool = False) -> list[Comparison]:
    """One `Comparison` for each direction that the files show.

    paths: of the surface before and after, along one direction; two more for the other direction, of traces only. An
    areal scan shows both. direction: "x", "y" or "" for two traces of no told direction; with four files or a scan it
    is that of the first pair, x unless told. units: of x and of z as `read_surface` takes them. shift [m]: where it
    is known, as `compared` takes it, of two traces alone; keep_spikes as there. PatchfemError for another number of
    files, another direction, a trace beside a scan, four scans, and a shift of other than two traces.
    """
    if direction not in ("", "x", "y"):
        raise PatchfemError(f"compare: direction {direction!r}: x or y is wanted")
    if len(paths) not in (2, 4):
        raise PatchfemError(f"compare: {len(paths)} files; two are wanted, or four: before and after along one "
                            "direction, then before and after along the other")
    files = [read_surface(path, units) for path in paths]
    scans = {isinstance(one, Areal) for one in files}
    if shift is not None and len(files) != 2:
        raise PatchfemError("compare: a shift is that of two traces; compare each direction by itself")
    if len(scans) > 1 or (True in scans and len(files) == 4):
        raise PatchfemError("compare: two or four traces are wanted, or two areal scans")
    if len(files) == 2 and True not in scans:
        return [compared(*files, direction, shift=shift, keep_spikes=keep_spikes)]
    first = direction or "x"
    return [compared(*pair, along, keep_spikes=keep_spikes) for pair, along in
            ((files[:2], first), (files[-2:], "y" if first == "x" else "x"))]
