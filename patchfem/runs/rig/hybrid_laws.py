"""Friction laws and loads of the interfaces of a rig, in the form of the engine `hybrid`.

In: a Model, its Numerics and its Patch. Out: `Joints`. A patch that slips part by part under a constant load is its exact
set of Jenkins elements.
"""

from typing import NamedTuple

import numpy as np

from ...effects import law_has_trait
from ...hybrid.cases import Load
from ...hybrid.laws import make_law
from ...hybrid.laws.grooves import make_grooves
from ...hybrid.laws.masing import from_elements, has_many_elements, with_all_reversals
from ...hybrid.records import LawNumbers
from ...model.model import Model
from ..bench import averaged_law
from . import joints
from .numerics import Numerics

STUCK_SLIP = 1e-3  # largest slip per cycle of an interface that counts as stuck, relative to its elastic length


class Joints(NamedTuple):
    """Interfaces of a rig.

    - laws: (LawNumbers, Load) of each interface.
    - elements: stiffness [N/m] and yield displacement [m] (e,) of the elements of each interface; () without partial
      slip.
    - contact: joints.Joint of the only patch, if it slips part by part, or None.
    - stick_tolerance: largest slip per cycle [m] at which the interfaces count as stuck.
    """

    laws: tuple[tuple[LawNumbers, Load], ...] = ()
    elements: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    contact: "joints.Joint | None" = None
    stick_tolerance: float = 0.0

    @property
    def has_kinks(self) -> bool:
        """Whether a law has elements that yield at several displacements."""
        return any(has_many_elements(law) for law, _ in self.laws)

    @property
    def springs(self) -> np.ndarray:
        """Stiffness (i,) [N/m] of each interface in stick; nan for a law that is no single element."""
        return np.array([find_spring_stiffness(law) for law, _ in self.laws])


def make_joints(model: Model, numerics: Numerics, patch) -> Joints:
    """Return laws and loads of all interfaces of a rig.

    Parameters
    ----------
    model : Model
        Rig with its interfaces.
    numerics : Numerics
        Names the interfaces with a coarser mesh.
    patch : Patch or None
        None without [contact].
    """
    rig = model.rig
    if model.friction is None:
        return Joints()

    speed = rig.speed_scale
    listed = joints.list_joints(model, patch, numerics.meshed)
    is_soft = bool(model.partial_slip or rig.friction.has_partial_slip)

    if not (is_soft or rig.friction.names or rig.friction.strips_slide_apart):
        laws = [_make_whole_law(model, patch)]
    else:
        laws = []
        for joint in listed:
            law = make_law(joint.interface.numbers, joint.load, speed)
            if joint.stiffness is not None:
                law = from_elements(joint.stiffness, joint.yields)
                # Decay curves are measured at the extremes of the output.
                law = with_all_reversals(law) if rig.drive.kind == "free" else law
            laws.append((law, Load(float(joint.load))))
    return Joints(
        tuple(laws),
        tuple(joint.list_elements(speed) for joint in listed) if is_soft else (),
        listed[0] if is_soft and len(listed) == 1 else None,
        _find_stick_tolerance(listed, [law for law, _ in laws]),
    )


def _make_whole_law(model: Model, patch) -> tuple[LawNumbers, Load]:
    """Return law and load of the only interface, which slips as a whole."""
    rig = model.rig
    friction = model.friction
    load = _make_load(model, patch)
    if model.grooves is not None:
        slide = rig.modes.slide
        model.grooves.check_lifted_mass(friction.static, rig.modes.mass / float(slide @ slide))
        return make_grooves(friction, model.grooves), load
    if law_has_trait(friction.law, "averaged"):
        static = friction.static * averaged_law.slip_force_ratio(model, patch)
        return LawNumbers("coulomb", (static, static)), load
    return make_law(friction, load.mean, rig.speed_scale, varies=load.varies), load


def _make_load(model: Model, patch) -> Load:
    """Return the load of the only interface."""
    if patch is not None:
        return Load(float(patch.pressure.load))
    point = model.point
    return Load(point.load, point.amplitude, 2 * np.pi * (point.frequency or 0.0), point.phase)


def list_elements(model: Model, numerics: Numerics, patch) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return stiffness [N/m] and yield displacement [m] (e,) of the elements of each interface.

    Parameters
    ----------
    model : Model
        Rig with its interfaces.
    numerics : Numerics
        Names the interfaces with a coarser mesh.
    patch : Patch or None
        None without [contact].
    """
    listed = joints.list_joints(model, patch, numerics.meshed)
    return [joint.list_elements(model.rig.speed_scale) for joint in listed]


def find_spring_stiffness(law) -> float:
    """Return the stiffness [N/m] of a law that is a single element in stick; nan for other laws."""
    if law.law != "masing" or law.numbers[1] >= 0 or has_many_elements(law):
        return np.nan
    limit, length = law.numbers[2:4]
    return limit / length


def _find_stick_tolerance(listed, laws) -> float:
    """Return the largest slip per cycle [m] of interfaces that count as stuck; 0 for rigid laws."""
    lengths = []
    for joint, law in zip(listed, laws):
        keys = joint.interface.numbers
        if np.isfinite(law.length):
            lengths.append(law.length)
        elif keys.bond_length and not law_has_trait(keys.law, "set-valued"):
            lengths.append(keys.bond_length)
        elif keys.stiffness:
            lengths.append(keys.static * joint.load / keys.stiffness)
    return STUCK_SLIP * min(lengths, default=0.0)
