"""Contact points of a march in time steps, and laws of single interfaces, made from friction law, load and patch.

In: a Model, its Numerics and its Patch. Out: a `points.contacts.Contact`, or the Elements of the interfaces.
"""

from dataclasses import replace

import numpy as np

from ...contact import contact_sets
from ...effects import law_has_trait, needs_bond_list
from ...friction.laws import coulomb
from ...friction.laws.elastic_plastic import parallel_element
from ...friction.laws.stretch import points_element
from ...friction.protocol import Element
from ...model.model import Model
from ...points import contacts
from ...slip import fields, shear_modes
from ...structure.drive_sizes import find_drive_omega
from ..bench import averaged_law, shear
from ..patch import store
from .bond_lists import choose_bond_summation
from .joints import list_joints
from .numerics import Numerics

# Pressure that is added to each node in the weights of shear modes under a changing load, relative to the mean pressure.
MIN_PRESSURE_FRACTION = 1.0


def make_contact(model: Model, numerics: Numerics, patch) -> contacts.Contact:
    """Return the contact points of a time integration, with all interfaces and nonlinear springs.

    Under a nonlocal law with [contact.shear], the nodes of the patch with pressure become points of bonds with the
    friction limits mu sigma_n area [N]. They are coupled by shear modes of the pieces, as many as keep the error of the
    backbone curve below a tenth of the tolerance (`slip.shear_modes`).

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
    load = patch.pressure.load if patch is not None else model.point.load
    if model.grooves is not None:
        return shear.make_flank_contact(model, load, patch, numerics.shear_modes)
    if model.rig.friction.load_varies:
        return _make_varying_contact(model, numerics, patch, row)
    law = model.friction.law
    if law_has_trait(law, "bonds"):
        choice = choose_bond_summation(model, numerics)
        if model.partial_slip or choice.engine != "recursion" or numerics.per_point:
            return _make_bond_contact(model, numerics, patch, load, row)
    contact = contacts.make_contact([make_single_law(model, numerics, patch)], [row])
    reduction = None
    if not law_has_trait(law, "bonds"):
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
    is_single = not (model.partial_slip or numerics.per_point)
    if law_has_trait(f.law, "bonds") and not model.rig.friction.has_partial_slip:
        if not is_single or choose_bond_summation(model, numerics).engine != "recursion":
            return None
        return points_element(model.bonds, list_joints(model, patch)[0].load)
    joint = list_joints(model, patch, numerics.meshed)[0]
    if law_has_trait(f.law, "averaged"):
        limit = f.static * joint.load * averaged_law.slip_force_ratio(model, patch)
        return coulomb.Coulomb(limit, limit).element(1.0)
    return joint.make_element(model.rig.speed_scale)


def _make_bond_contact(model: Model, numerics: Numerics, patch, load: float, row):
    """Return the points of a nonlocal law: at the points of shear modes, at the nodes, or at a single point."""
    law = model.bonds
    choice = choose_bond_summation(model, numerics)
    bond_sum = shear.make_bond_sum(law, choice)
    if patch is None:
        return contacts.make_bond_contact(law, load, row, None, bond_sum)
    modes = None
    if model.side == "lower":
        if model.partial_slip:
            modes = shear.compute_point_shear_modes(model, patch, numerics.shear_modes)
        return shear.make_lower_contact(model, patch, row, modes, bond_sum)
    if model.partial_slip:
        modes, force = _compute_shear_modes(patch, law, numerics.shear_modes, model)
        return contacts.make_bond_contact(law, force, row, modes, bond_sum)
    if bond_sum is None and numerics.per_point:
        force = patch.pressure.sigma_n * patch.pieces.interface.weight
        return contacts.make_bond_contact(law, force, row)
    return contacts.make_bond_contact(law, load, row, None, bond_sum)


def _compute_shear_modes(patch, law, n_modes: int | None, model) -> tuple:
    """Compute the shear modes of a patch, and the normal forces (k,) [N] of their points.

    Both are cached for all runs with the same Patch.
    """
    tolerance = model.accuracy.tolerance

    def make() -> tuple:
        """Compute the shear modes, and the normal forces of the points."""
        reduced = fields.bond_shear_modes(patch, law, n_modes, 0.1 * tolerance)
        force = patch.pressure.sigma_n * patch.pieces.interface.weight
        return reduced, force[reduced.points]

    key = ("shear modes", patch, law, n_modes, tolerance)
    return store.get_or_compute(key, make)


# ---- loads that change


def _make_varying_contact(model: Model, numerics: Numerics, patch, row) -> contacts.Contact:
    """Return the points of an interface whose load changes with the motion, or over time."""
    f = model.friction
    modes = model.rig.modes
    law = f
    bond_sum = None
    if law_has_trait(f.law, "bonds"):
        law = model.bonds
        if needs_bond_list(f):
            choice = choose_bond_summation(model, numerics)
            bond_sum = contacts.BondSum(law, choice.reach(f.order), choice.merge)

    # A single point follows the load of the scene and has no contact set.
    if patch is None:
        preload = float(model.point.evaluate(np.zeros(1))[0])
        return contacts.make_pressed_contact(
            law, preload, row, bond_sum=bond_sum, load=model.point.evaluate
        )

    # Heave and pitch of the upper piece change the contact set of a patch.
    sets = make_contact_sets(patch, model.patch.loading.rotational_stiffness)
    weight = patch.pieces.interface.weight
    force = patch.pressure.sigma_n * weight
    mean = force.sum() * weight / weight.sum()
    measure = force + mean * MIN_PRESSURE_FRACTION

    modes_of_pieces = None
    if model.partial_slip:
        modes_of_pieces = choose_shear_modes(
            model, patch, law, force, measure, numerics.shear_modes
        )

    still = np.zeros(modes.omega.size)
    return contacts.make_pressed_contact(
        law,
        force,
        row,
        modes_of_pieces,
        bond_sum,
        sets=sets,
        heave=still if modes.normal is None else np.asarray(modes.normal, float),
        pitch=still if modes.pitch is None else np.asarray(modes.pitch, float),
    )


def make_contact_sets(patch, spring: float = 0.0) -> "contact_sets.ContactSets":
    """Return the contact sets of a patch in the vicinity of its solved contact state.

    The rotational spring of the holder is in series with the pitch, as a compliance x_i x_j/K in addition to that of the
    pieces.

    Parameters
    ----------
    patch : Patch
        Patch with its static solution.
    spring : float
        Rotational stiffness of the holder [N m/rad], 0 for a rigid one.
    """
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    compliance = patch.pieces.normal
    if spring > 0:
        compliance = compliance + np.outer(patch.x, patch.x) / spring
    return contact_sets.ContactSets(
        compliance, patch.x, patch.pressure.gap - compliance @ force, force > 0
    )


def choose_shear_modes(model: Model, patch, law, force, measure, count: int | None):
    """Return the shear modes of pieces whose contact set changes during the motion.

    The modes are weighted with mu_s times the preload plus MIN_PRESSURE_FRACTION of its mean pressure, so that nodes that
    are open at first also count; with m modes they are exact for any weights.

    Parameters
    ----------
    model : Model
        Its tolerance sets the number of modes.
    patch : Patch
        Patch with the shear compliance of its pieces.
    law : Bonds, or the keys of an elastic-plastic law
        Static friction, and the length over which the force grows.
    force, measure : (m,) array
        Nodal forces of the preload [N], without and with the fraction of the mean pressure.
    count : int or None
        Number of modes; None for as many as a tenth of the tolerance needs.

    Raises
    ------
    PatchfemError
        If the patch is unstable.
    """
    compliance = patch.slip_compliance
    length = getattr(law, "length", None) or law.bond_length
    # An unstable patch could jump without a change of the drive, so it is rejected as under a constant load.
    if getattr(law, "has_growth", False):
        weakening = 1 / law.ratio if law.ratio > 0 else np.inf
        shear_modes.shear_modes(compliance, law.static * force, length, 1, weakening)
    limit = law.static * measure
    if count is not None:
        return shear_modes.shear_modes(compliance, limit, length, count)
    tolerance = 0.1 * model.accuracy.tolerance
    return shear_modes.find_sufficient_modes(
        compliance, limit, length, shear_modes.N_SHEAR_MODES, tolerance
    )
