"""Measures of a pressed patch, worked out once for all runs of this patch."""

from . import store
from .measures import measures, plane_band
from .press import Patch


def static_measures(asked, patch: Patch, coarse, tolerance: float | None) -> dict:
    """Return `measures.measures` of a patch and of its coarser ones."""
    if asked.solved is not None:
        return asked.solved.measures
    coarse = tuple(coarse)

    def make() -> dict:
        return measures(patch, *coarse, tolerance=tolerance)

    return (
        store.reuse(("measures", patch, coarse, tolerance), make)
        if store.is_shared(asked)
        else make()
    )


def plane_notes(asked, patch: Patch) -> list:
    """Return `measures.plane_band` of a patch."""
    if asked.solved is not None:
        return asked.solved.band
    if not store.is_shared(asked):
        return plane_band(asked, patch)
    return store.reuse(("plane band", patch), lambda: plane_band(asked, patch))
