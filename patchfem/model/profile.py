"""A measured profile as its share of the gap."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..core import PatchfemError, frozen_array
from ..surface.files.read import read_profile
from ..surface.fine import too_fine
from ..surface.nodes import on_nodes, placed
from ..surface.profile import Profile, cleaned, level

SPLIT = 16  # straight pieces of a cell of a smooth profile
NOISE = 1e-10  # m: heights below it are digits


def profile_gap(path: Path, x, asked: float | None, rough: bool, material: bool = False) -> tuple:
    """Gap (m,) [m] that a profile in a file adds at the nodes x (m,) [m], and notes for the user.

    The profile is levelled, freed of spikes and averaged over cells of `asked` [m], which decides what it may hold; a
    smooth curve through these means is what the nodes see, however fine they are. None: it is averaged over the nodes'
    own cells. The gap counts from its least, where flat pieces touch first.
    rough: asperities stand for what is finer; material: heights of a surface, on either piece measured outwards, so
    that a peak closes the gap. PatchfemError where too much of it is finer than the mesh and no asperities stand for
    it.
    """
    size = float(np.diff(x).max())
    whole = _whole(path, x, 2 * size)
    if material:
        whole = replace(whole, z=frozen_array(-whole.z))
    trace = level(whole)
    slope = float(np.polyfit(whole.x, whole.z - trace.z, 1)[0])
    notes = trace.notes
    if abs(slope) * trace.length > 1e-2 * np.ptp(trace.z):
        notes = (*notes, f"{trace.source}: levelled, a slope of {slope:.3g} rad is taken out; a tilt belongs in "
                         "[contact.tilt]")
    noise = np.std(trace.z) <= max(NOISE, 1e-5 * np.ptp(whole.z))  # what levelling leaves of a straight line
    if not noise and (said := too_fine(trace, size if asked is None else asked)) is not None:
        if not rough:
            raise PatchfemError(said, "contact.profile.file")
        notes = (*notes, said.partition(": add")[0] + ": that is averaged out and left to the law of the asperities")
    shape, even = trace, x
    if asked is not None and not _even(x, asked):
        even = np.linspace(x[0], x[-1], max(2, round(float(x[-1] - x[0]) / asked) + 1))
        shape = _smooth(trace, even)
    least = on_nodes(trace, even).min()
    return on_nodes(shape, x) - least, notes


def _even(x, size: float) -> bool:
    """Whether the nodes x (m,) [m] are as far apart as `size` [m] says."""
    return np.ptp(np.diff(x)) <= 1e-9 * np.ptp(x) and abs(x[1] - x[0] - size) <= 1e-2 * size


def _smooth(trace: Profile, even) -> Profile:
    """The cubic spline through the heights of a trace on even nodes (k,) [m], SPLIT points a cell."""
    from scipy.interpolate import CubicSpline

    fine = np.interp(np.arange(SPLIT * (even.size - 1) + 1) / SPLIT, np.arange(even.size), even)
    heights = CubicSpline(even, on_nodes(trace, even), bc_type="natural")(fine)
    return replace(trace, x=frozen_array(fine), z=frozen_array(heights), notes=())


def trace_of(path: Path) -> Profile:
    """The trace in a file, heights as they stand there; a file is read once. PatchfemError with the key of the file."""
    stamp = path.stat().st_mtime_ns if path.exists() else 0
    try:
        return _read(path, stamp)
    except PatchfemError as error:
        raise type(error)(str(error), "contact.profile.file") from None


def _whole(path: Path, x, longest: float) -> Profile:
    """The cleaned part of a trace over the nodes; a line may bridge `longest` [m]."""
    found = trace_of(path)
    try:
        return cleaned(placed(found, x), longest)
    except PatchfemError as error:
        raise type(error)(str(error), error.key or "contact.profile.file") from None


@lru_cache(maxsize=4)
def _read(path, stamp):
    return read_profile(path)
