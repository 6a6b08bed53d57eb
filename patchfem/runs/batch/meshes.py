"""Common meshes for cases of a sweep with the same patch geometry.

In: the models of the cases. Out: models with common meshes, fine enough for the most demanding case.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import replace

from ...core import PatchfemError
from ...model.model import Model
from ..patch import sweep_meshes


class SharedMeshes:
    """Common meshes of the cases of a sweep, by patch geometry and tolerance.

    The meshes depend on all models, but not on their order. A sweep therefore creates them once,
    before its cases are divided into chunks.

    Parameters
    ----------
    models : iterable of Model or PatchfemError
    all_ : bool
        Whether the models are all cases of the sweep.
    """

    def __init__(self, models: Iterable[Model | PatchfemError], all_: bool = True):
        self.meshes = {}
        groups = {}
        for model in models:
            if _may_share_meshes(model):
                groups.setdefault(_mesh_key(model), []).append(model.patch)
        for key, patches in groups.items():
            if len(patches) < 2:
                continue

            try:
                self.meshes[key] = sweep_meshes.choose_shared_meshes(patches, key[1], all_)
            except PatchfemError:  # the single run of each case reports its error
                continue

    def with_shared_meshes(self, model: Model | PatchfemError) -> Model | PatchfemError:
        """Return a model with the common meshes of its geometry, or unchanged if there are none."""
        meshes = (
            self.meshes.get(_mesh_key(model)) if self.meshes and _may_share_meshes(model) else None
        )
        if meshes is None:
            return model
        return replace(model, patch=model.patch.with_mesh(shared=meshes))


def with_shared_meshes(models: Sequence[Model | PatchfemError]) -> list[Model | PatchfemError]:
    """Return the models with common meshes for patches of the same geometry.

    A patch whose geometry occurs only once keeps the mesh of its single run.
    """
    common_meshes = SharedMeshes(models)
    return [common_meshes.with_shared_meshes(model) for model in models]


def _may_share_meshes(model: Model | PatchfemError) -> bool:
    """Return whether a model has a patch without a common mesh.

    The patch of a bolted joint keeps its own mesh, so that a case is equal to a single run. Faces share their cells
    without it.
    """
    if not isinstance(model, Model) or model.patch is None or model.has_bolted_patch:
        return False
    return model.patch.mesh.shared is None and model.patch.area is None


def _mesh_key(model: Model) -> tuple[Hashable, float]:
    """Return the hashable key of a model's common mesh: patch geometry and tolerance."""
    return sweep_meshes.geometry_key(model.patch), model.accuracy.tolerance
