"""Contact model of an engine, from friction law, load and patch.

In: a Model, its Numerics and its Patch. Out: a contact model of `dynamics` (single interface,
several joints, grooves, varying load), or the Elements of every interface.
"""

import numpy as np

from ...dynamics.march import joints, models
from ...effects import law_has_trait
from ...friction.laws.elastic_plastic import parallel_element
from ...friction.laws.stretch import points_element
from ...friction.protocol import Element
from ...friction.record import make_law
from ...model.law import InterfaceLaw, make_bond_parameters
from ...model.model import Model
from ...slip import fields, shear_modes
from ...structure.drive_sizes import find_drive_omega
from ..bench import averaged_law, rigid, shear
from ..patch import faces, jenkins_elements, store
from . import strips, varying_load
from .bond_lists import choose_bond_summation
from .numerics import Numerics

# Largest ratio of the error of the backbone curve to the tolerance, in the reduction to few modes
# and in that to few points.
REDUCTION_TOL_FRACTION = 1e-3


def make_contact(model: Model, numerics: Numerics, patch):
    """Return the contact model of a time integration, with all interfaces and nonlinear springs.

    It is a ContactModel for a single interface, a JointsModel for several interfaces or nonlinear
    springs, or a model of grooves. Under a nonlocal law with [contact.shear], the nodes of the patch
    with pressure become points of bonds with the friction limits mu sigma_n area [N]. They are coupled
    by shear modes of the pieces, as many as keep the error of the backbone curve below a tenth of the
    tolerance (`slip.shear_modes`).

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
        None under [normal].

    Raises
    ------
    PatchfemError
        If the law cannot be combined with other joints.
    """
    rig = model.rig
    has_joints = len(rig.modes.interfaces) > 1
    if model.grooves is not None:
        load = patch.pressure.load if patch is not None else model.point.load
        return rigid.make_climbing_model(model, load, patch, numerics.shear_modes)
    alone = None if has_joints else make_single_contact(model, numerics, patch)
    if not has_joints and not rig.springs.is_nonlinear:
        return alone

    rows = [*rig.modes.interfaces]
    all_joints = []
    if has_joints:
        elements = _make_independent_elements(model, numerics, patch)
        all_joints = [joints.Joint(k, element) for k, element in enumerate(elements)]
    if rig.springs.interlock is not None:
        all_joints.append(joints.make_interlocking_spring(0, *rig.springs.interlock))
    if rig.springs.cubic is not None:
        all_joints.append(joints.make_cubic_spring(len(rows), rig.springs.cubic))
        rows.append(rig.modes.output)
    size = rig.modes.mass * find_drive_omega(rig.drive.signal) * rig.speed_scale
    single_contact = alone if alone is not None and alone.limit > 0 else None
    return joints.JointsModel(single_contact, tuple(all_joints), np.array(rows), size)


def _make_independent_elements(model: Model, numerics: Numerics, patch) -> list:
    """Return the friction elements of interfaces or strips that slide independently."""
    if patch is None:
        return make_interface_elements(model, numerics.meshed)
    f = model.friction
    if model.partial_slip:
        length = make_law(f, patch.pressure.load).element(patch.pressure.load).length
        strip_elements = jenkins_elements.strip_elements(patch, f.static, length)
        return [parallel_element(*strip_element) for strip_element in strip_elements]
    law = model.rig.friction.interfaces[0]
    speed = model.rig.speed_scale
    return [make_element(law, load, speed) for load in strips.compute_strip_loads(patch)]


def make_interface_elements(model: Model, meshed: tuple) -> list:
    """Return the friction elements of each interface under its own load.

    `meshed` are the indices of interfaces whose patches have a coarser mesh.
    """
    elements = []
    for k, interface in enumerate(model.rig.friction.interfaces):
        if interface.partial_slip:
            parts = faces.make_patch_elements(interface, model.accuracy.tolerance, k in meshed)
            elements.append(parallel_element(*parts[:2]))
        else:
            elements.append(make_element(interface, interface.load, model.rig.speed_scale))
    return elements


def make_element(interface: InterfaceLaw, load: float, speed: float) -> Element:
    """Convert the friction law of an interface to an Element under a given load.

    Parameters
    ----------
    interface : InterfaceLaw
    load : float
        Normal load [N].
    speed : float
        Expected slip speed [m/s].
    """
    f = interface.numbers
    if law_has_trait(f.law, "bonds"):
        return points_element(make_bond_parameters(f, speed, 1e-12), [1.0], [load])
    return make_law(f, load).element(load)


def make_single_contact(model: Model, numerics: Numerics, patch):
    """Return the contact model of a rig with one interface.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
        None under [normal].
    """
    f = model.friction
    has_partial_slip = model.partial_slip
    if f is None:
        return models.frictionless_model()
    if model.rig.friction.load_varies:
        return varying_load.make_varying_load_model(model, numerics, patch)
    if model.rig.friction.has_partial_slip:
        return models.jenkins_model(
            *faces.make_patch_elements(
                model.rig.friction.interfaces[0], model.accuracy.tolerance, 0 in numerics.meshed
            )
        )
    load = patch.pressure.load if patch is not None else model.point.load
    if law_has_trait(f.law, "bonds"):
        return _make_bond_contact(model, numerics, patch, load)
    if law_has_trait(f.law, "averaged"):
        return models.coulomb_model(
            *(f.static * load * averaged_law.slip_force_ratio(model, patch),) * 2
        )
    element = make_law(f, load).element(load)
    if not has_partial_slip:
        return models.element_model(element)

    if patch.strips is not None:  # Strips of a patch that does not yaw have the same displacement.
        strip_elements = jenkins_elements.strip_elements(patch, f.static, element.length)
        return models.jenkins_model(*map(np.concatenate, zip(*strip_elements)))
    elements = jenkins_elements.elements(patch, f.static, element.length)
    return models.jenkins_model(elements.stiffness, elements.yield_displacement, elements)


def _make_bond_contact(model: Model, numerics: Numerics, patch, load: float):
    """Return the contact model of a nonlocal law.

    The bonds are summed in a list, at the points of shear modes, at the nodes, or at a single
    point.
    """
    law = model.bonds
    choice = choose_bond_summation(model, numerics)
    is_list = choice.engine != "recursion"
    limit = model.friction.static * load
    if model.side == "lower" and (model.partial_slip or is_list):
        modes = None
        if model.partial_slip:
            modes = shear.compute_point_shear_modes(model, patch, numerics.shear_modes)
        return shear.make_bond_lists_on_lower_piece(model, patch, choice, modes)
    if is_list and not model.partial_slip:
        return models.bond_list_model(law, limit, choice.reach(law.order), choice.merge)
    if model.partial_slip:
        reduced, force = _compute_shear_modes(patch, law, numerics.shear_modes, model)
        if is_list:
            return shear.make_bond_lists_with_shear(patch, law, reduced, choice, force)
        if force is not None:
            return models.points_model(law, force, np.ones_like(force), reduced)
        weight = patch.pieces.interface.weight
        return models.points_model(law, weight, patch.pressure.sigma_n, reduced)
    if numerics.per_point:
        x = patch.x
        weight = patch.pieces.interface.weight
        sigma = patch.pressure.sigma_n
        return models.points_model(
            law, weight, sigma, None, (x, sigma) if model.side == "lower" else None
        )
    return models.points_model(law, [1.0], [load])


def _compute_shear_modes(patch, law, n_modes: int | None, model) -> tuple:
    """Compute the shear modes of a patch, and the normal forces if it is reduced to few points.

    The forces (k,) [N] are normal forces; they are None if all nodes are points. Both are cached
    for all runs with the same Patch.
    """
    tolerance = model.accuracy.tolerance
    has_few_points = model.patch.mesh.can_gather_points

    def make() -> tuple:
        """Compute the shear modes, and the normal forces of the few points."""
        if not has_few_points:
            return fields.bond_shear_modes(patch, law, n_modes, 0.1 * tolerance, fewest=False), None
        mode_tolerance = REDUCTION_TOL_FRACTION * tolerance
        reduced = fields.bond_shear_modes(patch, law, n_modes, mode_tolerance, fewest=True)
        reduced, limit, _ = shear_modes.find_fewest_gauss_points(
            reduced, patch.x[reduced.points], mode_tolerance
        )
        return reduced, limit / law.static

    key = ("shear modes", patch, law, n_modes, tolerance, has_few_points)
    return store.get_or_compute(key, make)
