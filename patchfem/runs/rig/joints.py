"""Interfaces of a rig in the form of the engine `event_driven`.

In: a Model, its Numerics and its Patch. Out: the laws and loads of its interfaces (`make_joints`), and the rig without its
drive (`make_undriven_rig`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...effects import law_has_trait
from ...event_driven import laws
from ...event_driven.cases import Load, UndrivenRig, list_interfaces
from ...event_driven.laws import grooves, masing
from ...event_driven.records import LawNumbers
from ...model.model import Model
from ..interfaces import averaged_law, bond_lists
from ..interfaces.joints import SlidingPart, find_climbed_grooves, list_parts

NO_STEADY_LOOP = (
    'bonds have a steady loop only with friction.reading = "stretch", friction.order = 1, a constant bond length and '
    "pieces that are rigid in shear; run the scene in time instead"
)
NO_SOFT_LOOP = (
    "a patch that slips part by part has a steady loop only under law 'coulomb' or 'elastic-plastic'; run the scene in "
    "time instead"
)
MAX_STUCK_SLIP_RATIO = 1e-3  # largest slip per cycle of an interface that counts as stuck, relative to its elastic length


def make_law(joint: SlidingPart) -> LawNumbers:
    """Return the law of an interface as LawNumbers, the form for the engine `event_driven`."""
    elements = joint.elements
    if elements is not None:
        return masing.from_elements(elements.stiffness, elements.yield_displacement)
    keys = averaged_law.replace_law(joint.keys, joint.patch)
    varies = make_load(joint).varies
    return laws.make_law(keys.law, joint.make_law(keys), joint.load, varies=varies)


def make_load(joint: SlidingPart) -> Load:
    """Return the normal load of an interface; that of a point may oscillate."""
    model = joint.model
    if not model.load_varies:
        return Load(joint.load)
    point = model.point
    return Load(point.load, point.amplitude, 2 * np.pi * (point.frequency or 0.0), point.phase)


class Joints(NamedTuple):
    """Interfaces of a rig for the engine `event_driven`.

    - laws: (LawNumbers, Load) of each interface.
    - elements: stiffness [N/m] and yield displacement [m] (e,) of the elements of each interface, or () without partial
      slip.
    - reduction: JenkinsSet of the only patch, if it slips part by part, or None.
    - stick_tolerance: largest slip per cycle [m] at which the interfaces count as stuck.
    """

    laws: tuple[tuple[LawNumbers, Load], ...] = ()
    elements: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    reduction: object = None
    stick_tolerance: float = 0.0

    @property
    def has_kinks(self) -> bool:
        """Whether a law has elements that yield at several displacements."""
        return any(masing.has_many_elements(law) for law, _ in self.laws)

    @property
    def springs(self) -> np.ndarray:
        """Stiffness (i,) [N/m] of each interface in stick, or nan for a law that is not a single spring with a slider."""
        stiffness = []
        for law, _ in self.laws:
            is_single = law.law == "masing" and law.numbers[1] < 0
            if is_single and not masing.has_many_elements(law):
                limit, length = law.numbers[2:4]
                stiffness.append(limit / length)
            else:
                stiffness.append(np.nan)
        return np.array(stiffness)


def make_joints(model: Model, numerics, patch) -> Joints:
    """Return laws and loads of all interfaces of a rig for the engine `event_driven`.

    Parameters
    ----------
    model : Model
        Rig with its interfaces.
    numerics : Numerics
        Names the interfaces with a coarser mesh.
    patch : Patch or None
        None without [contact].
    """
    joints = list_parts(model, patch, numerics.space.meshed)
    pairs = []
    lengths = []
    for joint in joints:
        if model.grooves is None:
            law = make_law(joint)
        else:
            law = grooves.make_grooves(joint.keys, find_climbed_grooves(model))
        if joint.elements is not None and model.rig.drive.is_release:
            # Decay curves are measured at the extremes of the output.
            law = masing.with_all_reversals(law)
        pairs.append((law, make_load(joint)))
        # Displacement over which the law reaches its friction limit; none for rigid laws
        keys = joint.keys
        if np.isfinite(law.length):
            lengths.append(law.length)
        elif keys.bond_length and not law_has_trait(keys.law, "set-valued"):
            lengths.append(keys.bond_length)
        elif keys.stiffness:
            lengths.append(keys.static * joint.total / keys.stiffness)

    elements = ()
    if any(joint.elements is not None for joint in joints):
        elements = tuple(joint.list_elements() for joint in joints)
    reduction = joints[0].elements.jenkins_set if elements and len(joints) == 1 else None
    return Joints(
        tuple(pairs), elements, reduction, MAX_STUCK_SLIP_RATIO * min(lengths, default=0.0)
    )


def make_undriven_rig(model: Model, numerics, patch) -> UndrivenRig:
    """Return the modes of a rig with the laws of all interfaces and its nonlinear springs, without the drive.

    Parameters
    ----------
    model : Model
        Rig, springs and friction laws.
    numerics : Numerics
        Method of bond summation and coarser meshes.
    patch : Patch or None
        None under [normal] and between masses.

    Raises
    ------
    PatchfemError
        If a law has no steady loop.
    """
    joints = list_parts(model, patch, numerics.space.meshed)
    for joint in joints:
        if joint.is_soft and joint.elements is None:
            raise PatchfemError(NO_SOFT_LOOP)
        if not law_has_trait(joint.keys.law, "bonds") or joint.elements is not None:
            continue
        # Bonds that grow, and a list of bonds, have no state of a few numbers.
        is_listed = len(joints) == 1 and (
            model.side == "lower"
            or bond_lists.choose_bond_summation(model, numerics).engine != "recursion"
        )
        if joint.keys.rest_growth is not None or is_listed:
            raise PatchfemError(NO_STEADY_LOOP)
    pairs = [(make_law(joint), make_load(joint)) for joint in joints]
    return UndrivenRig(model.rig.modes, tuple(list_interfaces(model.rig, pairs)), len(pairs))
