"""One mesh for all cases of a sweep whose patches have one geometry, chosen by the hardest of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...core import PatchfemError
from ...model.model import Model
from ..patch.shared.meshes import geometry_of, shared_meshes


def meshed(models: Sequence[Model | PatchfemError]) -> list:
    """The models in their order, those of one geometry with meshes that they share; all others as they are.

    The meshes depend on all the models that are given, not on their order. So a sweep calls it once with all its cases,
    before these are handed out in chunks. A patch that stands alone keeps the mesh that its own run chooses.
    """
    out, groups = list(models), {}
    for case, model in enumerate(models):
        if isinstance(model, Model) and model.patch is not None and model.patch.meshes is None:
            groups.setdefault((geometry_of(model.patch), model.accuracy.tolerance), []).append(case)
    for (_, tolerance), cases in groups.items():
        if len(cases) < 2:
            continue
        try:
            meshes = shared_meshes([models[case].patch for case in cases], tolerance)
        except PatchfemError:  # each case is told by its own run what is wrong
            continue
        for case in cases:
            out[case] = replace(models[case], patch=replace(models[case].patch, meshes=meshes))
    return out
