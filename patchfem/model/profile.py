"""A measured profile of a scene as its share of the gap."""

from functools import lru_cache

import numpy as np

from ..core import PatchfemError
from ..scene.quantities import KINDS
from ..surface.fine import too_fine
from ..surface.nodes import on_nodes, placed
from ..surface.profile import cleaned, level
from ..surface.trace import read_trace

NOISE = 1e-10  # m: heights below it are digits


def profile_gap(scene, x) -> tuple:
    """((m,) heights of the scene's profile at the nodes x (m,) [m], notes): levelled, without spikes, averaged over the
    nodes' cells, from the lowest on, where flat pieces touch first. PatchfemError where too much of it is finer than
    the mesh and no asperities stand for it."""
    contact = scene.contact
    path = scene.beside(contact.profile.file)
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
    if not noise and (said := too_fine(trace, asked_size(contact, size))) is not None:
        if contact.asperities is None:
            raise PatchfemError(f"{scene.where('contact.profile.file')}: {said}")
        notes = (*notes, said.partition(": add")[0] + ": that is averaged out and left to the law of the asperities")
    heights = on_nodes(trace, x)
    return heights - heights.min(), notes


def asked_size(contact, size: float) -> float:
    """Element size [m] that decides what a profile may hold: the scene's own, not that of a coarser comparison mesh."""
    from .pieces import AUTOMATIC_CELLS

    if contact.mesh is not None:
        return size
    return contact.element_size or contact.length / AUTOMATIC_CELLS


@lru_cache(maxsize=4)
def _read(path, stamp):
    return read_trace(path, KINDS["length"])
