"""One mesh for all cases of a sweep whose patches have one geometry, chosen by the hardest of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ...core import PatchfemError
from ...model.model import Model
from ..patch import meshes as patch_meshes


class Shared:
    """The meshes of a sweep: by geometry and tolerance those that its cases share.

    They depend on all the models that they are chosen by, not on their order. So a sweep makes them once of its cases,
    before these are handed out in chunks. `all_`: there are no other cases beside these models.
    """

    def __init__(self, models: Iterable[Model | PatchfemError], all_: bool = True):
        self.meshes, groups = {}, {}
        for model in models:
            if _wants(model):
                groups.setdefault(_key(model), []).append(model.patch)
        for key, patches in groups.items():
            if len(patches) < 2:
                continue

            try:
                self.meshes[key] = patch_meshes.shared_meshes(patches, key[1], all_)
            except PatchfemError:  # each case is told by its own run what is wrong
                continue

    def given(self, model: Model | PatchfemError) -> Model | PatchfemError:
        """The model with the meshes that it shares; as it is where it shares none."""
        meshes = self.meshes.get(_key(model)) if self.meshes and _wants(model) else None
        if meshes is None:
            return model
        return replace(model, patch=model.patch.with_mesh(shared=meshes))


def meshed(models: Sequence[Model | PatchfemError]) -> list:
    """The models in their order, those of one geometry with meshes that they share; a patch that stands alone keeps the
    mesh that its own run chooses."""
    shared = Shared(models)
    return [shared.given(model) for model in models]


def _wants(model: Model | PatchfemError) -> bool:
    return isinstance(model, Model) and model.patch is not None and model.patch.mesh.shared is None


def _key(model: Model) -> tuple:
    return patch_meshes.geometry_of(model.patch), model.accuracy.tolerance
