"""Contact points of a march in time steps, and laws of single interfaces, made from friction law, load and patch.

In: a Model, its Numerics and its Patch. Out: a `points.contacts.Contact`, or the Elements of the interfaces.
"""

from dataclasses import replace

from ...effects import law_has_trait
from ...friction.laws import coulomb
from ...friction.laws.elastic_plastic import parallel_element
from ...friction.laws.stretch import points_element
from ...friction.protocol import Element
from ...model.model import Model
from ...points import contacts
from ...structure.drive_sizes import find_drive_omega
from ..bench import averaged_law, shear
from .bond_lists import choose_bond_summation
from .joints import list_joints
from .numerics import Numerics


def make_contact(model: Model, numerics: Numerics, patch) -> contacts.Contact:
    """Return the contact points of a time integration, with all interfaces and nonlinear springs.

    Parameters
    ----------
    model : Model
        Rig, springs and friction laws.
    numerics : Numerics
        Numbers of shear modes, method of bond summation and coarser meshes.
    patch : Patch or None
        None under [normal].
    """
    rig = model.rig
    rows = rig.modes.interfaces
    springs = []
    if rig.springs.interlock is not None:
        springs.append(contacts.make_interlocking_spring(*rig.springs.interlock, rows[0]))
    if rig.springs.cubic is not None:
        springs.append(contacts.make_cubic_spring(rig.springs.cubic, rig.modes.output))
    scale = rig.modes.mass * find_drive_omega(rig.drive.signal) * rig.speed_scale
    if len(rows) > 1:
        joints = list_joints(model, patch, numerics.meshed)
        elements = [joint.make_element(rig.speed_scale) for joint in joints]
        return contacts.make_contact(elements, rows, springs, scale)
    if model.friction is None:
        return contacts.make_contact([], rows[:0], springs, scale)
    contact = _make_own_contact(model, numerics, patch, rows[0])
    return replace(contact, point_sets=[*contact.point_sets, *springs])


def _make_own_contact(model: Model, numerics: Numerics, patch, row) -> contacts.Contact:
    """Return the contact points of the only interface, of the slide `row` (n,) per coordinate."""
    has_bonds = law_has_trait(model.friction.law, "bonds")
    if has_bonds or model.grooves is not None or model.rig.friction.load_varies:
        choice = choose_bond_summation(model, numerics) if has_bonds else None
        return shear.make_points(model, patch, row, choice, numerics.shear_modes)
    contact = contacts.make_contact([make_single_law(model, numerics, patch)], [row])
    reduction = list_joints(model, patch, numerics.meshed)[0].reduction
    return replace(contact, elements=reduction)


def make_single_law(model: Model, numerics: Numerics, patch) -> Element | None:
    """Return the law of a rig with one interface under a constant load; None for bonds that are no single element.

    Parameters
    ----------
    model : Model
        Friction law and load of the interface.
    numerics : Numerics
        Method of bond summation and coarser meshes.
    patch : Patch or None
        None under [normal].
    """
    f = model.friction
    if f is None:
        return parallel_element([0.0], [1.0])
    is_single = not (model.partial_slip or model.side == "lower")
    if law_has_trait(f.law, "bonds") and not model.rig.friction.has_partial_slip:
        if not is_single or choose_bond_summation(model, numerics).engine != "recursion":
            return None
        return points_element(model.bonds, list_joints(model, patch)[0].load)
    joint = list_joints(model, patch, numerics.meshed)[0]
    if law_has_trait(f.law, "averaged"):
        limit = f.static * joint.load * averaged_law.slip_force_ratio(model, patch)
        return coulomb.Coulomb(limit, limit).element(1.0)
    return joint.make_element(model.rig.speed_scale)
