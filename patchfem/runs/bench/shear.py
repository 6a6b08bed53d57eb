"""Contact points of one interface, for the path of a bench and for the march of a rig.

In: a model and its Patch. Out: a `points.contacts.Contact` of a law with memory along the motion: bonds, or a load
that changes (`make_points`); and the fields of points. Pieces that deform in shear are replaced by shear modes.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...contact import contact_sets
from ...effects import law_has_trait
from ...points import contacts, slides
from ...slip import shear_modes
from ..patch import area_slip, store

# Ratio of the assumed pressure of an initially unloaded node of the lower piece to the mean
# pressure.
UNLOADED_NODE_PRESSURE_FRACTION = 1e-3
# Bond length for the choice of the shear modes of rigid friction, relative to the slide at gross slip.
MIN_BOND_LENGTH_RATIO = 1e-3
# Pressure that is added to each node in the weights of shear modes under a changing load, relative to the mean pressure.
ADDED_WEIGHT_PRESSURE_FRACTION = 1.0
# First and last slide over which the steepest fall of a friction force is sought, relative to the smallest and the largest
# length of the law; with 400 samples the fall is known to 0.3 %.
FALL_RANGE = (1e-2, 20.0)
N_FALL_SAMPLES = 400
# Largest growth of the bonds at rest during that slide, relative to the whole growth.
MAX_FALL_GROWTH = 1e-8
MAX_MODES = 64  # largest number of shear modes that the tolerance asks for
# Error of the backbone curve by neglected shear modes, relative to the tolerance.
SHEAR_MODES_ERROR_RATIO = 0.1


def make_points(model, patch, row, choice=None, n_modes: int | None = None) -> "contacts.Contact":
    """Return the contact points of bonds, or under a load that changes.

    Under a nonlocal law with [contact.shear], the nodes of the patch with pressure become points of bonds with the
    friction limits mu sigma_n area [N]. They are coupled by shear modes of the pieces, as many as keep the error of the
    backbone curve below a tenth of the tolerance (`slip.shear_modes`).

    Parameters
    ----------
    model : Model
        Model of a bench or of a rig with one interface.
    patch : Patch or None
        None for a single point.
    row : (n,) array
        Slide per modal coordinate; (0,) for a bench.
    choice : EngineChoice, optional
        Method of bond summation of a law with bonds.
    n_modes : int, optional
        Number of shear modes of the pieces; default: by the scene, otherwise by the tolerance.
    """
    n_modes = n_modes or model.accuracy.shear_modes
    load = patch.pressure.load if patch is not None else model.point.load
    law = model.friction
    bond_sum = None
    if law_has_trait(law.law, "bonds"):
        law = model.bonds
        bond_sum = make_bond_sum(law, choice)

    # A single point follows the load of the scene and has no contact set.
    if model.load_varies:
        preload = float(model.point.evaluate(np.zeros(1))[0])
        return contacts.make_pressed_contact(
            law, preload, row, bond_sum=bond_sum, load=model.point.evaluate
        )
    if model.rig is not None and model.rig.friction.load_varies:
        return _make_moving_contact(model, patch, law, row, bond_sum, n_modes)

    modes = compute_point_shear_modes(model, patch, n_modes) if model.partial_slip else None
    if model.side == "lower":
        return make_lower_contact(model, patch, row, modes, bond_sum)
    force = load
    if modes is not None:
        force = (patch.pressure.sigma_n * patch.pieces.interface.weight)[modes.points]
    if model.grooves is None:
        return contacts.make_bond_contact(law, force, row, modes, bond_sum)

    # The points carry the normal force on the flank.
    normal = force * float(np.hypot(1.0, model.grooves.slope(0.0)))
    contact = contacts.make_bond_contact(law, normal, row, modes, bond_sum)
    limit = model.grooves.max_force(load, law.static)
    return replace(contact, limit=limit, preload=load, grooves=find_climbed_grooves(model))


def find_climbed_grooves(model):
    """Return the grooves that the upper piece climbs.

    Raises
    ------
    PatchfemError
        If the mass that they lift in a rig makes the acceleration undefined.
    """
    if model.rig is None:
        # A prescribed slide has no inertia.
        return replace(model.grooves, lifted_mass=0.0)
    # The lifted mass is compared to the modal mass at the interface, m / (s . s).
    modes = model.rig.modes
    mass = modes.mass / float(modes.slide @ modes.slide)
    model.grooves.check_lifted_mass(model.friction.static, mass)
    return model.grooves


def _make_moving_contact(model, patch, law, row, bond_sum, n_modes) -> "contacts.Contact":
    """Return the points of a patch whose contact set changes with heave and pitch of the upper piece.

    The rotational spring of the holder is in series with the pitch, as a compliance x_i x_j/K in addition to that of the
    pieces. The shear modes are weighted with mu_s times the preload plus ADDED_WEIGHT_PRESSURE_FRACTION of its mean
    pressure, so that nodes that are open at first also count. With m modes they are exact for any weights.

    Parameters
    ----------
    model : Model
        Model of a rig with a patch.
    patch : Patch
        Solved patch under the preload, with m nodes.
    law
        Friction law of the interface.
    row : (n,) array
        Slide per modal coordinate.
    bond_sum
        How the bonds of a law with bonds are summed, or None for other laws.
    n_modes : int or None
        Number of shear modes. It follows from the tolerance if this is None.
    """
    # Without pressure, the gap at the approach of the preload is g - C f.
    weight = patch.pieces.interface.weight
    force = patch.pressure.sigma_n * weight
    compliance = patch.pieces.normal
    spring = model.patch.loading.rotational_stiffness
    if spring > 0:
        compliance = compliance + np.outer(patch.x, patch.x) / spring
    sets = contact_sets.ContactSets(
        compliance, patch.x, patch.pressure.gap - compliance @ force, force > 0
    )

    shear = None
    if model.partial_slip:
        # An unstable patch could jump without a change of the drive, so it is rejected as under a constant load.
        length = _find_yield_length(law)
        if steepest_fall := find_steepest_fall(law):
            choose_modes(patch, law.static * force, Softness(length, steepest_fall), 1, 1.0)
        mean = force.sum() * weight / weight.sum()
        limit = law.static * (force + mean * ADDED_WEIGHT_PRESSURE_FRACTION)
        shear = choose_modes(patch, limit, Softness(length), n_modes, model.accuracy.tolerance)

    modes = model.rig.modes
    still = np.zeros(modes.omega.size)
    return contacts.make_pressed_contact(
        law,
        force,
        row,
        shear,
        bond_sum,
        sets=sets,
        heave=still if modes.normal is None else np.asarray(modes.normal, float),
        pitch=still if modes.pitch is None else np.asarray(modes.pitch, float),
    )


def _find_yield_length(law) -> float:
    """Return the length [m] over which a law reaches its friction limit; 0 for rigid friction."""
    return getattr(law, "length", None) or law.bond_length or 0.0


def find_steepest_fall(law) -> float:
    """Return the steepest fall of the friction force of a law over the slip, relative to the friction limit [1/m].

    It is that of the first slip of a point, which is so fast that its bonds do not grow at rest: a slower slip lets the
    force fall less, and a sudden one leaves no time. It is 0 for a law without growth, whose force does not fall.

    Parameters
    ----------
    law : Bonds or table [friction]
        Friction law of a point.
    """
    if not getattr(law, "has_growth", False):
        return 0.0
    scales = (law.length, law.slip_growth)
    first = FALL_RANGE[0] * min(scales)
    slide = np.append(0.0, np.geomspace(first, FALL_RANGE[1] * max(scales), N_FALL_SAMPLES))

    # A step of duration t grows the bonds by a_s t^2/h over its slide h, relative to their whole growth.
    growth = max(law.rest_growth, np.finfo(float).tiny) * np.sum(1 / np.diff(slide))
    time = np.sqrt(MAX_FALL_GROWTH / growth) * np.arange(slide.size)
    is_list = law.order != 1 or law.reading != "stretch"
    bond_sum = contacts.BondSum(law, np.inf, 0.0) if is_list else None
    contact = contacts.make_bond_contact(law, 1.0, np.zeros(0), bond_sum=bond_sum)
    force = slides.follow(contact, time, slide).force / law.static
    return max(0.0, float(-(np.diff(force) / np.diff(slide)).min()))


class Softness(NamedTuple):
    """Properties of a law that decide how many shear modes it needs.

    - length: displacement over which the force of a node grows to its limit [m]; 0 for rigid friction
    - fall: steepest fall of the friction force over the slip, relative to its limit [1/m]
    - max_modes: largest number of modes
    """

    length: float
    fall: float = 0.0
    max_modes: int = MAX_MODES


def choose_modes(
    patch, limit, softness: Softness, n_modes: int | None, tolerance: float
) -> "shear_modes.ShearModes":
    """Return the shear modes of the pieces by which the interface deforms; without a number, as many as are needed.

    The neglected modes then change the backbone curve of the interface by at most SHEAR_MODES_ERROR_RATIO times the
    tolerance.

    Parameters
    ----------
    patch : Patch
        Patch with the shear compliance of its pieces.
    limit : (m,) array
        Friction limits of the nodes [N].
    softness : Softness
        Properties of the law.
    n_modes : int or None
        Number of modes; None: by the tolerance.
    tolerance : float
        Relative tolerance of the scene.
    """
    compliance = patch.slip_compliance
    length = softness.length
    if not length and n_modes is None:
        # Rigid friction is replaced by a length far below the mean displacement under the friction limits of all nodes, as
        # its number of modes would have no bound.
        length = MIN_BOND_LENGTH_RATIO * float(limit @ (compliance @ limit) / limit.sum())
    bound = SHEAR_MODES_ERROR_RATIO * tolerance
    if patch.model.area is not None:
        count = n_modes or area_slip.N_AREA_MODES
        modes = area_slip.choose_area_modes(
            patch, limit, length, count, None if n_modes is not None else bound
        )
        shear_modes.require_stability(modes, softness.fall)
        return modes
    if n_modes is not None:
        return shear_modes.shear_modes(compliance, limit, n_modes, softness.fall)
    return shear_modes.find_sufficient_modes(
        compliance,
        limit,
        length,
        shear_modes.N_SHEAR_MODES,
        bound,
        softness.fall,
        softness.max_modes,
    )


def find_own_compliance(patch) -> np.ndarray:
    """Return the shear displacement (m,) [m/N] of each node of a patch under a force of its own."""
    compliance = patch.slip_compliance
    if patch.model.area is None:
        return np.diag(compliance)
    own = compliance.holder
    if compliance.cells is not None:
        own += compliance.cells.self_compliance / compliance.weight
    return np.full(patch.x.size, compliance.factor * own)


def compute_point_fields(patch, contact, snapshots) -> tuple[np.ndarray, np.ndarray]:
    """Return traction (f, m) [Pa] and slip (f, m) [m] at the nodes of a patch from the states of its contact points.

    Over grooves, the traction is the horizontal part of the forces on the flank of slope t, and the elastic stretch along
    the flank is divided by sqrt(1 + t^2).

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    contact : points.contacts.Contact
        Points at all nodes, or at those of its shear modes.
    snapshots : sequence of points.time_march.Snapshot
        States of the points in the f frames.
    """
    reduction = contact.reduction
    index = np.arange(patch.x.size) if reduction is None else reduction.points
    slide = np.array([snapshot.slide for snapshot in snapshots])[:, None]
    shape = (len(snapshots), index.size)
    forces = np.reshape([snapshot.forces for snapshot in snapshots], shape)
    elastic = np.reshape([snapshot.stretch + snapshot.bend for snapshot in snapshots], shape)
    if contact.grooves is not None:
        slope = contact.grooves.slope(slide)
        vertical = np.array([snapshot.vertical for snapshot in snapshots])[:, None]
        loads = contact.point_sets[0].law.load
        length = np.hypot(1.0, slope)
        forces = vertical * loads / loads.sum() * slope + forces * length
        elastic = elastic / length
    tau = np.zeros((len(snapshots), patch.x.size))
    local = tau + slide
    tau[:, index] = forces / patch.pieces.interface.weight[index]
    local[:, index] -= elastic
    return tau, local


def make_bond_sum(law, choice) -> "contacts.BondSum | None":
    """Return the settings of a sum over lists of bonds; None for the recursion.

    Parameters
    ----------
    law : Bonds
        Parameters of the bond law.
    choice : EngineChoice or None
        Method of bond summation.
    """
    if choice is None or choice.engine == "recursion":
        return None
    return contacts.BondSum(law, choice.reach(law.order), choice.merge)


def compute_point_shear_modes(model, patch, n_modes: int | None = None) -> "shear_modes.ShearModes":
    """Return the shear modes of the contact points of a nonlocal law.

    If the pressure is fixed to the lower piece, all nodes are contact points. An initially unloaded
    node then has UNLOADED_NODE_PRESSURE_FRACTION times the mean pressure of the loaded nodes.

    Parameters
    ----------
    model : Model
        Model with a law whose stretch varies along the interface.
    patch : Patch
        Solved patch, which gives limits and compliance of the points.
    n_modes : int, optional
        Number of modes; default: by the scene, otherwise by the tolerance.
    """
    law = model.bonds
    n_modes = n_modes or model.accuracy.shear_modes
    tolerance = model.accuracy.tolerance

    def compute() -> "shear_modes.ShearModes":
        """Compute the shear modes, which the cache keeps for all runs with the same Patch."""
        fall = find_steepest_fall(law)
        limit = law.static * patch.pieces.interface.weight
        sigma = patch.pressure.sigma_n
        if model.side == "lower":
            # A single mode is computed first, because this rejects a patch that could jump at constant
            # displacement.
            choose_modes(patch, limit * sigma, Softness(law.length, fall), 1, tolerance)
            sigma = np.maximum(sigma, UNLOADED_NODE_PRESSURE_FRACTION * mean_loaded_pressure(patch))
        return choose_modes(patch, limit * sigma, Softness(law.length, fall), n_modes, tolerance)

    key = ("shear modes", patch, law, model.side, n_modes, tolerance)
    return store.get_or_compute(key, compute)


def mean_loaded_pressure(patch) -> float:
    """Return the mean pressure [Pa] over the loaded nodes."""
    return patch.pressure.load / float(patch.pieces.interface.weight @ (patch.pressure.sigma_n > 0))


def make_lower_contact(model, patch, row, modes, bond_sum) -> "contacts.Contact":
    """Return the points of bonds at all nodes, under a pressure that is fixed to the lower piece.

    Parameters
    ----------
    model : Model
        Model with a bond law.
    patch : Patch
        Solved patch, whose pressure moves with the lower piece.
    row : (n,) array
        Slide per modal coordinate.
    modes : ShearModes or None
        Shear modes at the nodes; None for pieces that are rigid in shear.
    bond_sum : BondSum or None
        Sum over lists of bonds, or None for the recursion.
    """
    mean = mean_loaded_pressure(patch)
    return contacts.make_bond_contact(
        model.bonds,
        mean * patch.pieces.interface.weight,
        row,
        modes,
        bond_sum,
        np.stack([patch.x, patch.pressure.sigma_n / mean]),
    )
