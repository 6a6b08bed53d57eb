"""Removal of a joint from the modes of a rig that were measured with the joint.

In: a model whose modes were measured with the joint, and its solved patch. Out: the model with the
modes without the joint.
"""

from dataclasses import replace

import numpy as np

from ..effects import law_has_trait
from ..friction import record
from ..model.model import Model
from ..model.source import locate_errors
from ..model.structure import compute_sticking_stiffness
from .patch import result as patch_result
from .patch.jenkins_elements import elements, strip_elements


def remove_joint(model: Model, patch=None) -> Model:
    """Subtract the stiffness of the joint from modes that were measured with the joint.

    All other models are returned unchanged.

    Parameters
    ----------
    model : Model
    patch : Patch, optional
        Solved patch; None: it is solved here.

    Raises
    ------
    PatchfemError
        If the patch is stiffer than the modes allow.
    """
    if model.rig is None or model.rig.structure.without_joint is None:
        return model
    with locate_errors(model.source):
        if patch is None:
            patch = patch_result.solve_with_coarser(model.patch, model.accuracy.tolerance)[0]
        stiffness = compute_full_stick_stiffness(model, patch)
        return replace(model, rig=model.rig.structure.without_joint(stiffness))


def compute_full_stick_stiffness(model: Model, patch) -> float:
    """Return the tangential stiffness [N/m] of a patch in full stick; 0 without contact."""
    f = model.friction
    load = patch.pressure.load
    if not load > 0:
        return 0.0
    stiffness = record.stick_stiffness(f, load)
    if not model.partial_slip or (
        np.isfinite(stiffness) and not law_has_trait(f.law, "set-valued")
    ):
        stiffness = compute_sticking_stiffness(model.rig.friction.interfaces[0], load)
    if not model.partial_slip:
        return stiffness
    length = (
        f.static * load / stiffness
    )  # the yield displacement is 0 for a law that is rigid in stick
    if patch.strips is not None:
        return float(
            sum(strip_element[0].sum() for strip_element in strip_elements(patch, f.static, length))
        )
    return float(elements(patch, f.static, length).stiffness.sum())


def stuck_patch_stiffness(model: Model, patch, coarse: tuple):
    """Return the tangential stiffness [N/m] of a patch in full stick with its error, or None.

    It is the extrapolated value that the run reports. It is None unless the pieces alone are
    compliant.

    Parameters
    ----------
    model : Model
    patch : Patch or None
    coarse : tuple
        The patch on coarser meshes; None for a missing one.

    Returns
    -------
    Measure or None
    """
    if (
        patch is None
        or not model.partial_slip
        or not law_has_trait(model.friction.law, "set-valued")
    ):
        return None
    measure = patch_result.static_measures(model, patch, tuple(coarse)).get("tangential_stiffness")
    return None if measure is None or measure.value is None or measure.error is None else measure
