"""Common mesh of all cases of a sweep whose patches have one geometry.

In: the models of the cases. Out: models with shared meshes, chosen by the hardest case.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ...core import PatchfemError
from ...model.model import Model
from ..patch import sweep_meshes


class SharedMeshes:
    """Meshes that the cases of a sweep share, by geometry of the patch and tolerance.

    They depend on all models that choose them, but not on their order. Therefore a sweep makes them
    once from its cases, before these are divided into chunks. `all_`: there are no other cases.
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
                self.meshes[key] = sweep_meshes.shared_meshes(patches, key[1], all_)
            except PatchfemError:  # each case is run by itself, and reports its own error
                continue

    def with_shared_meshes(self, model: Model | PatchfemError) -> Model | PatchfemError:
        """Return a model with the shared meshes of its geometry, if there are any."""
        meshes = (
            self.meshes.get(_mesh_key(model)) if self.meshes and _may_share_meshes(model) else None
        )
        if meshes is None:
            return model
        return replace(model, patch=model.patch.with_mesh(shared=meshes))


def with_shared_meshes(models: Sequence[Model | PatchfemError]) -> list:
    """Choose common meshes for models with patches of the same geometry.

    A single patch of a geometry keeps the mesh that its own run chooses.
    """
    shared = SharedMeshes(models)
    return [shared.with_shared_meshes(model) for model in models]


def _may_share_meshes(model: Model | PatchfemError) -> bool:
    """Return whether a model may use a mesh that is chosen for several models."""
    return isinstance(model, Model) and model.patch is not None and model.patch.mesh.shared is None


def _mesh_key(model: Model) -> tuple:
    """Return a hashable key of the patch geometry and the tolerance of a model."""
    return sweep_meshes.geometry_key(model.patch), model.accuracy.tolerance
