"""Friction laws and loads of the interfaces of a rig, in the form of the engine `hybrid`.

In: a Model, its Numerics and its Patch. Out: `Joints`. A patch that slips part by part under a constant load is its exact
set of Jenkins elements.
"""

from typing import NamedTuple

import numpy as np

from ...effects import law_has_trait
from ...friction import record
from ...hybrid.cases import Load
from ...hybrid.laws import make_law, smooth_grooves
from ...hybrid.laws.grooves import make_grooves
from ...hybrid.laws.masing import from_elements, has_many_elements, with_all_reversals
from ...hybrid.records import LawNumbers
from ...model.model import Model
from ..bench import averaged_law
from ..patch import jenkins_elements
from . import interface, strips
from .numerics import Numerics

STUCK_SLIP = 1e-3  # largest slip per cycle of an interface that counts as stuck, relative to its elastic length


class Joints(NamedTuple):
    """Interfaces of a rig.

    - laws: (LawNumbers, Load) of each interface.
    - elements: stiffness [N/m] and yield displacement [m] (e,) of the elements of each interface; () for other laws.
    - contact: interface.SingleLaw of a patch that slips part by part, or None.
    - stick_tolerance: largest slip per cycle [m] at which the interfaces count as stuck.
    """

    laws: tuple = ()
    elements: tuple = ()
    contact: object = None
    stick_tolerance: float = 0.0

    @property
    def has_kinks(self) -> bool:
        """Whether a law has elements that yield at several displacements."""
        return any(has_many_elements(law) for law, _ in self.laws)

    @property
    def springs(self) -> np.ndarray:
        """Stiffness (i,) [N/m] of each interface that is a single element; empty if one is not."""
        if not self.elements or any(np.size(stiffness) != 1 for stiffness, _ in self.elements):
            return np.zeros(0)
        return np.array([float(stiffness[0]) for stiffness, _ in self.elements])


def make_joints(model: Model, numerics: Numerics, patch) -> Joints:
    """Return laws and loads of all interfaces of a rig.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
        None without [contact].
    """
    rig = model.rig
    friction = model.friction
    if friction is None:
        return Joints()
    if model.partial_slip or rig.friction.has_partial_slip:
        joints = _make_soft_joints(model, numerics, patch)
        if rig.drive.kind == "free":
            # Decay curves are measured at the extremes of the output.
            laws = tuple((with_all_reversals(law), load) for law, load in joints.laws)
            joints = joints._replace(laws=laws)
        return joints
    laws = _list_laws(model, patch)
    return Joints(
        tuple(laws),
        _list_single_elements(law for law, _ in laws),
        stick_tolerance=_find_stick_tolerance(model, [law for law, _ in laws]),
    )


def _list_laws(model: Model, patch) -> list[tuple[LawNumbers, Load]]:
    """Return law and load of each interface that slips as a whole."""
    rig = model.rig
    friction = model.friction
    speed = rig.speed_scale
    if rig.friction.names:
        return [
            (make_law(one.numbers, one.load, speed), Load(one.load))
            for one in rig.friction.interfaces
        ]
    if rig.friction.strips_slide_apart:
        loads = strips.compute_strip_loads(patch)
        return [(make_law(friction, load, speed), Load(float(load))) for load in loads]

    load = _make_load(model, patch)
    if model.grooves is not None:
        slide = rig.modes.slide
        model.grooves.check_lifted_mass(friction.static, rig.modes.mass / float(slide @ slide))
        is_rigid = law_has_trait(friction.law, "set-valued")
        make = make_grooves if is_rigid else smooth_grooves.make_grooves
        return [(make(friction, model.grooves), load)]
    if law_has_trait(friction.law, "averaged"):
        static = friction.static * averaged_law.slip_force_ratio(model, patch)
        return [(LawNumbers("coulomb", (static, static)), load)]
    return [(make_law(friction, load.mean, speed, varies=load.varies), load)]


def _make_load(model: Model, patch) -> Load:
    """Return the load of the only interface."""
    if patch is not None:
        return Load(float(patch.pressure.load))
    point = model.point
    return Load(point.load, point.amplitude, 2 * np.pi * (point.frequency or 0.0), point.phase)


def _make_soft_joints(model: Model, numerics: Numerics, patch) -> Joints:
    """Return the elements of interfaces, some of which slip part by part."""
    rig = model.rig
    contact = None
    if patch is not None and rig.friction.strips_slide_apart:
        limit = patch.pressure.load
        length = record.make_law(model.friction, limit).element(limit).length
        strip_elements = jenkins_elements.strip_elements(patch, model.friction.static, length)
        elements = [strip[:2] for strip in strip_elements]
    elif len(rig.modes.interfaces) > 1:
        elements = list_elements(model, numerics, patch)
    else:
        contact = interface.make_single_law(model, numerics, patch)
        elements = [_read_elements(contact.element)]

    # The engine has a continuous law for interfaces without a patch that slips part by part.
    loads = [
        one.load if one.load is not None else model.nominal_load for one in rig.friction.interfaces
    ]
    laws = []
    for k, pair in enumerate(elements):
        own = rig.friction.interfaces[min(k, len(loads) - 1)]
        law = from_elements(*pair)
        if patch is None and not own.partial_slip:
            law = make_law(own.numbers, own.load, rig.speed_scale)
        laws.append((law, Load(float(loads[min(k, len(loads) - 1)]))))
    return Joints(
        tuple(laws),
        tuple(elements),
        contact,
        _find_stick_tolerance(model, [law for law, _ in laws]),
    )


def list_elements(model: Model, numerics: Numerics, patch) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return stiffness [N/m] and yield displacement [m] (e,) of the elements of each interface.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
        None without [contact].
    """
    if len(model.rig.modes.interfaces) > 1:
        parts = interface.make_interface_elements(model, numerics.meshed)
    else:
        parts = [interface.make_single_law(model, numerics, patch).element]
    return [_read_elements(part) for part in parts]


def _read_elements(element) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffnesses [N/m] and yield displacements [m] of a law of parallel elements."""
    count = int(element.numbers[1])
    numbers = element.numbers[2:]
    return numbers[:count], numbers[count : 2 * count]


def _list_single_elements(laws) -> tuple:
    """Return stiffness and yield displacement of laws that are single elements, () if one is not."""
    elements = []
    for law in laws:
        if law.law != "masing" or law.numbers[1] >= 0:
            return ()
        limit, length = law.numbers[2:4]
        elements.append((np.array([limit / length]), np.array([length])))
    return tuple(elements)


def _find_stick_tolerance(model: Model, laws) -> float:
    """Return the largest slip per cycle [m] of interfaces that count as stuck; 0 for rigid laws."""
    lengths = []
    for k, law in enumerate(laws):
        interfaces = model.rig.friction.interfaces
        keys = interfaces[min(k, len(interfaces) - 1)].numbers
        if np.isfinite(law.length):
            lengths.append(law.length)
        elif keys.bond_length and not law_has_trait(keys.law, "set-valued"):
            lengths.append(keys.bond_length)
        elif keys.stiffness:
            load = interfaces[min(k, len(interfaces) - 1)].load
            lengths.append(
                keys.static * (model.nominal_load if load is None else load) / keys.stiffness
            )
    return STUCK_SLIP * min(lengths, default=0.0)
