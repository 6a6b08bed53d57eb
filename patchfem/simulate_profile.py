"""A measured profile of a scene as its share of the gap."""

from functools import lru_cache

import numpy as np

from .core import PatchfemError
from .quantities import KINDS
from .surface.fine import too_fine
from .surface.nodes import on_nodes, placed
from .surface.profile import cleaned, level
from .surface.trace import read_trace


def profile_gap(scene, x) -> tuple:
    """((m,) heights of the scene's profile at the nodes x (m,) [m], notes): levelled, without spikes, averaged over the
    nodes' cells. PatchfemError where too much of it is finer than the mesh and no asperities stand for it."""
    contact = scene.contact
    path = scene.beside(contact.profile.file)
    stamp = path.stat().st_mtime_ns if path.exists() else 0
    size = float(np.diff(x).max())
    trace = level(cleaned(placed(_read(path, stamp), x), 2 * size))
    notes = trace.notes
    if (said := too_fine(trace, asked_size(contact, size))) is not None:
        if contact.asperities is None:
            raise PatchfemError(f"{scene.path}: contact.profile: {said}")
        notes = (*notes, said.partition(": add")[0] + ": that is averaged out and left to the law of the asperities")
    return on_nodes(trace, x), notes


def asked_size(contact, size: float) -> float:
    """Element size [m] that decides what a profile may hold: the scene's own, not that of a coarser comparison mesh."""
    from .simulate_plan import AUTOMATIC_CELLS

    if contact.mesh is not None:
        return size
    return contact.element_size or contact.length / AUTOMATIC_CELLS


@lru_cache(maxsize=4)
def _read(path, stamp):
    return read_trace(path, KINDS["length"])
