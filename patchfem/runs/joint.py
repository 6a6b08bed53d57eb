"""Removal of a joint from the modes of a rig that were measured with the joint bolted.

In: a model with such modes, and its solved patch. Out: the model with the modes without the joint, and the
patch whose shear compliance has the same stiffness in full stick as the joint.

The stiffness that is subtracted is the extrapolated one that a run prints (`tangential_stiffness`), not
that of the finest mesh. The compliance of the patch is scaled to the same stiffness, so that a sticking
joint gives the measured frequency again. The comparison run on a coarser mesh has a stiffness that
differs by the error of the extrapolated one, in the modes and in the patch, so that this error enters
the errors of all measures.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..core import frozen_array
from ..effects import law_has_trait
from ..friction import record
from ..model.model import Model
from ..model.source import locate_errors
from ..model.structure import compute_sticking_stiffness
from .patch import result as patch_result
from .patch import store
from .patch.jenkins_elements import elements, strip_elements


class FreeRig(NamedTuple):
    """Rig without the joint that was bolted in the modal test, and its pressed patch.

    - model: Model whose modes are those without the joint.
    - patches: the patch, from fine to coarse; None for a missing mesh; empty without [contact].
    """

    model: Model
    patches: Sequence


def solve_without_joint(model: Model) -> FreeRig:
    """Solve the patch of a model, and remove the joint from modes that were measured with it.

    Parameters
    ----------
    model : Model

    Raises
    ------
    PatchfemError
        If the joint is stiffer than the modes allow, or has no stiffness.
    """
    if model.patch is None:
        return FreeRig(model, ())
    return remove_joint(model, solve_patch(model))


def solve_patch(model: Model) -> tuple:
    """Return the patch of a model on its meshes, from fine to coarse.

    The patch of a bolted joint is solved once for the plan, the run and all cases of a study.
    """

    def solve() -> tuple:
        return patch_result.solve_with_coarser(model.patch, model.accuracy.tolerance)

    if not model.has_bolted_patch:
        return solve()
    return store.get_or_compute(("bolted patch", model.patch, model.accuracy.tolerance), solve)


def remove_joint(model: Model, patches: Sequence) -> FreeRig:
    """Subtract the stiffness of the joint from modes that were measured with the joint bolted.

    All other models and their patches are returned unchanged.

    Parameters
    ----------
    model : Model
    patches : sequence of Patch or None
        The patch of [contact] on its meshes, from fine to coarse (`mesh_levels.solve_with_coarser`).

    Raises
    ------
    PatchfemError
        If the joint is stiffer than the modes allow, or has no stiffness.
    """
    if not model.has_bolted_patch:
        return FreeRig(model, patches)
    bolted = model.rig.structure.bolted
    with locate_errors(model.source):
        patches = _scale_shear(model, patches)
        own = _compute_stiffnesses(model, patches)
        taken_off = own
        if bolted.model is not None:
            written = bolted.model
            taken_off = _compute_stiffnesses(written, _scale_shear(written, solve_patch(written)))
        rig, *coarse_rigs = map(bolted.build_rig, taken_off)
        removed = bolted._replace(build_rig=None, stiffness=(taken_off[0],), stuck_stiffness=own[0])
        if coarse_rigs and len(own) > 1:
            removed = removed._replace(coarse_rig=coarse_rigs[0])
        rig = replace(rig, structure=replace(rig.structure, bolted=removed))
        return FreeRig(replace(model, rig=rig), patches)


def compute_full_stick_stiffness(model: Model, patch) -> float:
    """Return the tangential stiffness [N/m] of a patch in full stick; 0 without contact.

    It includes the shear of the pieces, asperities, holder and the stiffness of the friction law.
    """
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
    # The yield displacement is 0 for a law that is rigid in stick.
    return _sum_elements(patch, f.static, f.static * load / stiffness)


def _compute_stiffnesses(model: Model, patches: Sequence) -> list:
    """Return the stiffness [N/m] of a joint on its mesh and, if there is one, on a coarser mesh."""
    solved = [patch for patch in patches[:2] if patch is not None]
    return [compute_full_stick_stiffness(model, patch) for patch in solved]


def _sum_elements(patch, static: float, length: float) -> float:
    """Return the summed stiffness [N/m] of the elements of a patch, with bonds of a length [m]."""
    if patch.strips is not None:
        strips = strip_elements(patch, static, length)
        return float(sum(strip_element.stiffness.sum() for strip_element in strips))
    return float(elements(patch, static, length).stiffness.sum())


def _scale_shear(model: Model, patches: Sequence) -> list:
    """Scale the shear compliance of a patch to the extrapolated stiffness in full stick.

    A patch on a coarser mesh gets a stiffness that differs from it by its error, to the side on which
    the coarser mesh lies. Without this error, and for pieces that are rigid in shear, the patches are
    returned unchanged, so that each one has the stiffness of its own mesh.
    """
    fine, coarse, *others = patches
    measure = (fine.measures or {}).get("tangential_stiffness")
    is_known = measure is not None and None not in (measure.value, measure.error)
    if not (model.patch.interface.has_shear and is_known and fine.pressure.load > 0):
        return list(patches)
    holder = model.patch.loading.tangential_stiffness
    own_stiffness = _pieces_stiffness(fine, holder)
    fine = _with_pieces_stiffness(fine, holder, measure.value)
    if coarse is not None and coarse.pressure.load > 0:
        difference = np.sign(_pieces_stiffness(coarse, holder) - own_stiffness) * measure.error
        coarse = _with_pieces_stiffness(coarse, holder, measure.value + difference)
    return [fine, coarse, *others]


def _pieces_stiffness(patch, holder: float | None) -> float:
    """Return the stiffness [N/m] of a patch in full stick, without its holder [N/m] in series."""
    stiffness = _sum_elements(patch, 1.0, 0.0)
    return stiffness if holder is None else 1 / (1 / stiffness - 1 / holder)


def _with_pieces_stiffness(patch, holder: float | None, stiffness: float):
    """Return a patch with a given stiffness [N/m] in full stick, without its holder [N/m] in series."""
    holder_compliance = 0.0 if holder is None else 1 / holder
    factor = _pieces_stiffness(patch, holder) / stiffness
    compliance = holder_compliance + factor * (patch.slip_compliance - holder_compliance)
    return replace(patch, slip_compliance=frozen_array(compliance))


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
