"""The stiffness of a pressed patch taken off the modes of a rig that were measured with it."""

from dataclasses import replace

import numpy as np

from ..effects import law_has_trait
from ..friction import record
from ..model.model import Model
from ..model.source import locate_errors
from ..model.structure import sticking_stiffness
from .patch import result as patch_result
from .patch.jenkins_elements import elements, strip_elements


def freed(model: Model, patch=None) -> Model:
    """The model whose modes are those without the joint; of any other the model as it stands.

    patch: the pressed Patch, pressed here unless given. PatchfemError where the patch holds more than the modes have.
    """
    if model.rig is None or model.rig.structure.without_joint is None:
        return model
    with locate_errors(model.source):
        if patch is None:
            patch = patch_result.solve_all(model.patch, model.accuracy.tolerance)[0]
        held = patch_stiffness(model, patch) if patch.pressure.load > 0 else 0.0
        return replace(model, rig=model.rig.structure.without_joint(held))


def patch_stiffness(model: Model, patch) -> float:
    """Tangential stiffness [N/m] of a pressed patch and its law while nothing slips."""
    f, load = model.friction, patch.pressure.load
    held = record.held_stiffness(f, load)
    if not model.partial_slip or (np.isfinite(held) and not law_has_trait(f.law, "set-valued")):
        held = sticking_stiffness(model.rig.friction.interfaces[0], load)
    if not model.partial_slip:
        return held
    length = f.static * load / held  # 0 of a law that holds rigidly
    if patch.strips is not None:
        return float(sum(one[0].sum() for one in strip_elements(patch, f.static, length)))
    return float(elements(patch, f.static, length).stiffness.sum())


def held_patch(model: Model, patch, apart: tuple):
    """The Measure of the stiffness [N/m] of a pressed Patch while nothing slips, extrapolated over its meshes, as its
    run prints it, where the pieces alone give way; None of any other. apart: the coarser Patches or Nones."""
    if (
        patch is None
        or not model.partial_slip
        or not law_has_trait(model.friction.law, "set-valued")
    ):
        return None
    found = patch_result.measured(model, patch, tuple(apart)).get("tangential_stiffness")
    return None if found is None or found.value is None or found.error is None else found
