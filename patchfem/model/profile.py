"""A measured profile as its share of the gap."""

from functools import lru_cache
from pathlib import Path

import numpy as np

from ..core import PatchfemError
from ..scene.quantities import KINDS
from ..surface.files.text import read_trace
from ..surface.fine import too_fine
from ..surface.nodes import on_nodes, placed
from ..surface.profile import cleaned, level

NOISE = 1e-10  # m: heights below it are digits


def profile_gap(path: Path, x, asked: float | None, rough: bool) -> tuple:
    """Heights (m,) [m] of a profile in a file at the nodes x (m,) [m], and notes for the user.

    The profile is levelled, freed of spikes and averaged over the nodes' cells. Heights count from the lowest, where
    flat pieces touch first. asked [m]: element size that decides what a profile may hold, None: that of the nodes;
    rough: asperities stand for what is finer. PatchfemError where too much of it is finer than the mesh and no
    asperities stand for it.
    """
    stamp = path.stat().st_mtime_ns if path.exists() else 0
    size = float(np.diff(x).max())
    whole = cleaned(placed(_read(path, stamp), x), 2 * size)
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
    heights = on_nodes(trace, x)
    return heights - heights.min(), notes


@lru_cache(maxsize=4)
def _read(path, stamp):
    return read_trace(path, KINDS["length"])
