"""Measures of a pressed patch, computed once for all runs of this patch.

In: a `Patch` and its coarser ones. Out: measures and notes from `measures`, kept in `store` if
several runs share the patch.
"""

from . import store
from .measures import measures, plane_band
from .press import Patch


def static_measures(patch_model, patch: Patch, coarse, tolerance: float | None) -> dict:
    """Return the static measures of a patch with errors (see `measures.measures`).

    Parameters
    ----------
    patch_model : PatchModel
    patch : Patch
    coarse : sequence of Patch or None
        The patch on coarser meshes, fine to coarse.
    tolerance : float or None
        Tolerance that chose the mesh; None for a given mesh.
    """
    if patch_model.solved is not None:
        return patch_model.solved.measures
    coarse = tuple(coarse)

    def make() -> dict:
        """Compute the measures with errors."""
        return measures(patch, *coarse, tolerance=tolerance)

    return (
        store.reuse(("measures", patch, coarse, tolerance), make)
        if store.may_be_shared(patch_model)
        else make()
    )


def plane_notes(patch_model, patch: Patch) -> list:
    """Return the note on the plane state of a patch (`measures.plane_band`), as a list."""
    if patch_model.solved is not None:
        return patch_model.solved.band
    if not store.may_be_shared(patch_model):
        return plane_band(patch_model, patch)
    return store.reuse(("plane band", patch), lambda: plane_band(patch_model, patch))
