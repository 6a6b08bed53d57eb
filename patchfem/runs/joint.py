"""Removal of a joint from the modes of a rig that were measured with the joint bolted.

In: a model with such modes, and its solved patch. Out: the model with the modes without the joint, and the
patch with the same stiffness in full stick as the joint.

The stiffness that is subtracted is the extrapolated one that a run prints (`tangential_stiffness`), not
that of the finest mesh. Springs at the edges of the contact give the patch this stiffness on each mesh, so that
a sticking joint has the measured frequency again. In one more comparison run the joint is stiffer by the error of
this stiffness, in the modes and in the patch, so that this error enters the errors of all measures.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..convergence import convergence_error
from ..core import frozen_array
from ..effects import law_has_trait
from ..friction import record
from ..model.model import Model
from ..model.source import Source, locate_errors
from ..model.structure import compute_sticking_stiffness
from ..partial_slip.edge_springs import add_edge_springs
from .patch import case_meshes, faces
from .patch.jenkins_elements import compute_stick_stiffness
from .patch.press import Patch, Patches

# Largest logarithm of the factor by which the compliance of a patch is scaled.
MAX_LOG_COMPLIANCE_FACTOR = 5.0


class FreeRig(NamedTuple):
    """Rig without the joint that was bolted in the modal test, and its pressed patch.

    - model: Model whose modes are those without the joint.
    - patches: the patch, from fine to coarse; None for a missing mesh; empty without [contact].
    - stiffer: the same for a joint that is stiffer by the error of its stiffness; None without such a joint.
    """

    model: Model
    patches: Sequence
    stiffer: "FreeRig | None" = None


class StickStiffness(NamedTuple):
    """Tangential stiffness of a patch in full stick with its error [N/m], and the bond length [m] of its law.

    The bond length is 0 for a law that is rigid in stick.
    """

    value: float
    error: float
    bond_length: float


def solve_without_joint(model: Model) -> FreeRig:
    """Solve the patch of a model, and remove the joint from modes that were measured with it.

    Parameters
    ----------
    model : Model
        Model of a rig with a patch.

    Raises
    ------
    PatchfemError
        If the joint is stiffer than the modes allow, or has no stiffness.
    """
    if model.patch is None:
        return FreeRig(press_interfaces(model) if model.has_interface_patches else model, ())
    return remove_joint(model, solve_patch(model))


def press_interfaces(model: Model) -> Model:
    """Return a model whose interfaces with a prescribed approach have the loads of their pressed patches."""
    interfaces = model.rig.friction.interfaces
    if not any(part.patch is not None and part.patch.loading.load is None for part in interfaces):
        return model
    pressed = []
    for interface in interfaces:
        if interface.patch is not None:
            patch = faces.solve_contact_on_meshes(interface, model.accuracy.tolerance)[0]
            interface = replace(interface, load=float(patch.pressure.load))
        pressed.append(interface)
    rig = replace(model.rig, friction=replace(model.rig.friction, interfaces=tuple(pressed)))
    return replace(model, rig=rig, point=replace(model.point, load=pressed[0].load))


def solve_patch(model: Model, solved: Patches = ()) -> Patches:
    """Return the patch of a model on its meshes, from fine to coarse.

    Parameters
    ----------
    model : Model
        Model of a rig with a patch.
    solved : tuple
        Patches of an earlier pass, from fine to coarse, whose meshes are refined further.
    """
    return case_meshes.solve_with_coarser(model.patch, model.accuracy.tolerance, solved=solved)


def find_source(model: Model) -> Source:
    """Return the source of a model, which states the joint that is subtracted from bolted modes."""
    return solve_without_joint(model).model.source if model.has_bolted_patch else model.source


def remove_joint(model: Model, patches: Sequence) -> FreeRig:
    """Subtract the stiffness of the joint from modes that were measured with the joint bolted.

    All other models and their patches are returned unchanged.

    Parameters
    ----------
    model : Model
        Model of a rig, whose modes may include the joint.
    patches : sequence of Patch or None
        The patch of [contact] on its meshes, from fine to coarse (`case_meshes.solve_with_coarser`).

    Raises
    ------
    PatchfemError
        If the joint is stiffer than the modes allow, or has no stiffness.
    """
    if not model.has_bolted_patch:
        return FreeRig(model, patches)

    # The bolted modes may belong to another contact than the one of this run: `written` is the one
    # of the measurement, unless the scene states what is subtracted.
    bolted = model.bolted_joint
    written = bolted.model or model
    with locate_errors(model.source):
        own = _find_stick_stiffness(model, patches)
        subtracted = bolted.subtracted
        if subtracted is None:
            written_patches = patches if bolted.model is None else solve_patch(written)
            stiffness, stiffer = find_bolted_stiffness(written, written_patches)
            (spring,) = bolted.spring.stiffness
            subtracted = bolted.spring._replace(
                stiffness=(float(stiffness + spring),), error=float(stiffer - stiffness)
            )
        joints = (subtracted, subtracted.stiffen())
        builders = (bolted.build_rig, bolted.build_stiffer_rig or bolted.build_rig)

        def subtract(n_errors: int) -> FreeRig:
            """Return the rig without its joint, whose stiffness is the computed one (0) or larger by its error (1)."""
            own_patches = _match_stiffness(patches, own, n_errors)
            rig = builders[n_errors](joints[n_errors])
            removed = bolted._replace(
                build_rig=None,
                subtracted=joints[n_errors],
                stuck_stiffness=compute_full_stick_stiffness(model, own_patches[0]),
            )
            free = replace(model, rig=rig).with_bolted(removed)
            return FreeRig(free.state_subtracted_joint(), own_patches)

        # The second result has the joint stiffer by its error, and its change is the error of the
        # motion.
        free = subtract(0)
        if own is None and not subtracted.error:
            return free
        return free._replace(stiffer=subtract(1))


def find_bolted_stiffness(model: Model, patches: Sequence) -> tuple[float, float]:
    """Return the stiffness [N/m] of a joint that is subtracted from bolted modes, and that of a joint stiffer by its error.

    Both are 0 without contact.

    Parameters
    ----------
    model : Model
        Model with the joint that was bolted in the modal test.
    patches : sequence of Patch or None
        Its patch on its meshes, from fine to coarse.
    """
    own = _find_stick_stiffness(model, patches)
    matched = [_match_stiffness(patches[:1], own, n_errors)[0] for n_errors in (0, 1)]
    stiffness, stiffer = (compute_full_stick_stiffness(model, patch) for patch in matched)
    return stiffness, stiffer


def compute_full_stick_stiffness(model: Model, patch) -> float:
    """Return the tangential stiffness [N/m] of a patch of which no point slips; 0 without contact.

    It is that of the pieces in shear, the asperity layer, the spring of the holder and the friction law, in series.
    """
    load = patch.pressure.load
    if not load > 0:
        return 0.0
    if not model.partial_slip:
        return compute_sticking_stiffness(model.rig.friction.interfaces[0], load)
    return compute_stick_stiffness(
        patch, 1.0, _find_bond_length(model, load) / model.friction.static
    )


def _find_bond_length(model: Model, load: float) -> float:
    """Return the displacement [m] over which the friction law of a patch reaches its limit; 0 if it is rigid in stick.

    It is the friction limit under the load [N] over the stiffness of the law in stick.
    """
    stiffness = record.stick_stiffness(model.friction, load)
    if np.isfinite(stiffness) and not law_has_trait(model.friction.law, "set-valued"):
        stiffness = compute_sticking_stiffness(model.rig.friction.interfaces[0], load)
    return model.friction.static * load / stiffness


def _find_stick_stiffness(model: Model, patches: Sequence) -> StickStiffness | None:
    """Return the stiffness of a patch in full stick; None for a patch without partial slip, load or friction.

    For pieces alone it is the extrapolated stiffness that a run prints, in series with the holder. Otherwise it
    is that of the finest mesh, with the error that follows from the coarser ones.
    """
    solved = [patch for patch in patches if patch is not None]
    load = solved[0].pressure.load
    if not (model.partial_slip and load > 0 and model.friction.static > 0):
        return None
    length = _find_bond_length(model, load)
    measure = (solved[0].measures or {}).get("tangential_stiffness")
    is_known = measure is not None and None not in (measure.value, measure.error)
    if is_known and model.patch.interface.has_shear and not length:
        holder_compliance = 0.0
        if model.patch.loading.tangential_stiffness is not None:
            holder_compliance = 1 / model.patch.loading.tangential_stiffness
        value = 1 / (1 / measure.value + holder_compliance)
        return StickStiffness(value, measure.error * (value / measure.value) ** 2, 0.0)

    touching = [patch for patch in solved[:3] if patch.pressure.load > 0]
    bond_length = length / model.friction.static
    values = [compute_stick_stiffness(patch, bond_length=bond_length) for patch in touching]
    changes = np.abs(np.diff(values))
    error = float(convergence_error(*changes)) if changes.size else 0.0
    return StickStiffness(values[0], error, bond_length)


def _match_stiffness(
    patches: Sequence, stiffness: StickStiffness | None, n_errors: int
) -> list[Patch | None]:
    """Return patches whose tangential stiffness in full stick is `stiffness.value + n_errors * stiffness.error`.

    With `n_errors` = 1 a comparison run shows the effect of the error of the stiffness. Patches without load, and all
    patches if `stiffness` is None, are unchanged; None stands for a missing mesh.
    """
    if stiffness is None:
        return list(patches)
    out = []
    for patch in patches:
        if patch is not None and patch.pressure.load > 0:
            target = stiffness.value + n_errors * stiffness.error
            compliance = _match_compliance(patch, target, stiffness.bond_length)
            patch = replace(patch, slip_compliance=compliance)
        out.append(patch)
    return out


def _match_compliance(patch, stiffness: float, bond_length: float) -> np.ndarray:
    """Return the tangential compliance (m, m) [m/N] of a patch with a given stiffness [N/m] in full stick.

    `bond_length` [m] is that of the friction law, whose bonds are in series with the pieces; 0 for rigid contact.
    Nodes at the edges of a contact have soft bonds; the whole compliance of
    such patches is scaled. It is returned unchanged if the bonds alone determine the stiffness.
    """
    is_plane = patch.model.area is None
    if is_plane and not bond_length:
        return add_edge_springs(patch.slip_compliance, patch.pressure.sigma_n > 0, stiffness)

    def excess(log_factor: float) -> float:
        """Return the logarithm of the ratio of the stiffness for a scaled compliance to the wanted one.

        Over the logarithm of the factor it is nearly a straight line.
        """
        return np.log(compute_stick_stiffness(patch, np.exp(log_factor), bond_length) / stiffness)

    if not excess(-MAX_LOG_COMPLIANCE_FACTOR) > 0 > excess(MAX_LOG_COMPLIANCE_FACTOR):
        return patch.slip_compliance

    # scipy.optimize takes half a second to import, and most joints have no bonds.
    from scipy.optimize import brentq

    ends = -MAX_LOG_COMPLIANCE_FACTOR, MAX_LOG_COMPLIANCE_FACTOR
    factor = np.exp(brentq(excess, *ends, xtol=1e-12))
    if not is_plane:
        return patch.slip_compliance.scale(factor)
    return frozen_array(factor * patch.slip_compliance)


def find_stuck_patch_stiffness(model: Model, patches: Sequence) -> StickStiffness | None:
    """Return the stiffness of a patch in full stick, or None unless the pieces alone are compliant.

    Parameters
    ----------
    model : Model
        Model of a rig with a patch.
    patches : sequence of Patch or None
        The patch of [contact] on its meshes, from fine to coarse; None for a missing mesh.
    """
    if patches[0] is None or not law_has_trait(model.friction.law, "set-valued"):
        return None
    return _find_stick_stiffness(model, patches)
