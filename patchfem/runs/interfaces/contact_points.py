"""Contact points of the interfaces of a rig or a bench: a law, a load and a port for every effect.

In: a Model, its Numerics and its Patch. Out: a `time_steps.contacts.Contact`. Each interface, or each band of a face that
yaws, is a set of points on its port: a point, the nodes of a patch, with shear modes of its pieces if they deform, or
the parallel elements of a patch under a constant load. Loads follow from time, from the place over the lower piece, from
the flank of a groove, or, in a rig, from heave and pitch.
"""

from __future__ import annotations

import numpy as np

from ... import time_steps
from ...contact import contact_sets
from ...core import MIN_LOAD
from ...effects import law_has_trait, law_takes_stiffness_or_length
from ...model.model import Model
from ...partial_slip import shear_modes
from ...structure.drive_sizes import find_drive_omega
from ...time_steps import contacts, laws, systems
from ...time_steps.contacts import PointSet
from ..patch import store
from . import averaged_law, bands, bond_lists
from .joints import SlidingPart, find_climbed_grooves, has_elements, list_joints

# Largest number of shear modes that the tolerance asks for; for Coulomb's law, whose points have the compliance of the
# modes left out, 16 of them give the loop area an error of 5e-4.
MAX_MODES = 64
MAX_STIFF_MODES = 16
# Error of the backbone curve by neglected shear modes, relative to the tolerance.
SHEAR_MODES_ERROR_RATIO = 0.1
# Bond length for the choice of the shear modes of rigid friction, relative to the slide at gross slip.
MIN_BOND_LENGTH_RATIO = 1e-3
# Pressure of nodes in the weights of shear modes, relative to the mean pressure: that which is added to each node under a
# changing load, and the smallest one of a node that the lower piece does not press at the start.
ADDED_WEIGHT_PRESSURE_FRACTION = 1.0
UNLOADED_NODE_PRESSURE_FRACTION = 1e-3
# Ratio of the cells of an Iwan model on a bench to those on a rig: the force is exact to 2e-7 of the friction limit
CELLS_FACTOR = 16
# First and last slide over which the steepest fall of a friction force is sought, relative to the smallest and the largest
# length of the law; with 400 samples the fall is known to 0.3 %.
FALL_RANGE = (1e-2, 20.0)
N_FALL_SAMPLES = 400
# Largest growth of the bonds at rest during that slide, relative to the whole growth.
MAX_FALL_GROWTH = 1e-8


def make_contact(model: Model, numerics, patch) -> contacts.Contact:
    """Return the contact points of a rig, with its nonlinear springs, or of a bench.

    Parameters
    ----------
    model : Model
        Rig or bench, springs and friction laws.
    numerics : Numerics
        Numbers of shear modes and cells, method of bond summation, and coarser meshes.
    patch : Patch or None
        None under [normal] and between masses.
    """
    rig = model.rig
    joints = list_joints(model, patch, numerics.space.meshed)
    fields = _find_load(model, patch) if joints else {}

    # Parallel elements represent an interface exactly under a constant load; its nodes or shear modes serve all other
    # cases. Bands that yaw deform the same pieces, so that their elements are not parallel.
    slide_apart = rig is not None and rig.friction.bands_slide_apart
    has_lower = any(j.patch is not None and j.patch.model.gap.side == "lower" for j in joints)
    soft_keys = [joint.keys for joint in joints if joint.is_soft]
    uses_elements = not (fields or has_lower or slide_apart) and all(map(has_elements, soft_keys))
    moves = "press" in fields
    sets = []
    for joint in joints:
        elements = joint.elements if uses_elements else None
        if elements is not None:
            law = laws.make_elements(elements.stiffness, elements.yield_displacement)
            sets.append(PointSet(law, joint.row))
            if len(joints) == 1:
                fields["elements"] = elements.jenkins_set
        elif slide_apart and joint.is_soft:
            whole = make_points(joint, numerics, moves=moves)
            numbers = bands.number_bands(patch)[whole.shear.points]
            sets += whole.divide(numbers, rig.modes.interfaces)
        else:
            sets += [make_points(one, numerics, moves=moves) for one in joint.split_by_bands()]

    # The friction limit of all interfaces measures residuals. Without friction the drive gives the scale of the forces.
    limit = sum(float(point_set.law.limits.sum()) for point_set in sets)
    if rig is None:
        limit = model.friction.static * float(joints[0].node_loads.sum())
    elif not limit:
        limit = rig.modes.mass * find_drive_omega(rig.drive.signal) * rig.speed_scale
    if model.grooves is not None:
        limit = model.grooves.max_force(joints[0].total, model.friction.static)

    # Displacement over which the first interface stretches before it slips; 0 for a rigid one
    length = 0.0
    if sets:
        stiffness = systems.find_stiffness(sets[0])
        length = float(sets[0].law.limits.sum() / stiffness) if stiffness else 0.0

    # Nonlinear springs are points too, which follow the interfaces.
    if rig is not None and rig.springs.interlock is not None:
        law = laws.make_interlocking(*rig.springs.interlock)
        sets.append(PointSet(law, rig.modes.interfaces[0], is_spring=True))
    if rig is not None and rig.springs.cubic is not None:
        law = laws.make_cubic(rig.springs.cubic)
        sets.append(PointSet(law, rig.modes.output, is_spring=True))
    return contacts.Contact(sets, limit, length, **fields)


def _find_load(model: Model, patch) -> dict:
    """Return the fields of a Contact that describe a load that changes with time, place or motion; {} for a constant one."""
    if model.load_varies:
        preload = float(model.point.evaluate(np.zeros(1))[0])
        grooves = None if model.grooves is None else find_climbed_grooves(model)
        return {"grooves": grooves, "load": model.point.evaluate, "preload": preload}
    if model.grooves is not None:
        load = model.point.load if patch is None else float(patch.pressure.load)
        return {"grooves": find_climbed_grooves(model), "preload": load}
    if model.rig is None or not model.rig.friction.load_varies:
        return {}

    # Without pressure, the gap at the approach of the preload is g - C f. The rotational spring K of the holder is in
    # series with the pitch: it adds the compliance x_i x_j/K at the places x_i of the nodes to that of the pieces.
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    compliance = patch.pieces.normal
    spring = model.patch.loading.rotational_stiffness
    if spring > 0:
        compliance = compliance + np.outer(patch.x, patch.x) / spring
    opening = patch.pressure.gap - compliance @ force
    modes = model.rig.modes
    still = np.zeros(modes.omega.size)
    press = contacts.Press(
        contact_sets.ContactSets(compliance, patch.x, opening, force > 0),
        still if modes.normal is None else np.asarray(modes.normal, float),
        still if modes.pitch is None else np.asarray(modes.pitch, float),
        averaged_law.make_averages(model.friction, patch),
    )
    return {"press": press, "preload": float(force.sum())}


def make_points(joint: SlidingPart, numerics, *, moves: bool = False) -> PointSet:
    """Return the points of an interface or a band.

    Laws without memory, and points that slide alike under a pressure that moves with them, act on the resultant. Others
    act at the nodes; where the pieces deform, at those of the shear modes.

    Parameters
    ----------
    joint : SlidingPart
        Interface with its load.
    numerics : Numerics
        Number of shear modes, by default that of the scene or by the tolerance; number of cells; bond summation.
    moves : bool
        Whether heave and pitch change its pressure, so that every node has a load of its own.
    """
    model = joint.model
    keys = joint.keys
    law = joint.make_law()
    loads = joint.node_loads
    limits = averaged_law.find_loads(keys, joint.patch)
    if limits is not None and joint.band is not None:
        limits = np.array([bands.sum_bands(joint.patch, side) for side in limits])[:, [joint.band]]
    lower = _place_on_lower_piece(joint, limits)

    # Rise of the loads at the start over their mean. Over grooves the points carry the normal force on the flank.
    rise = 1.0
    if model.load_varies:
        rise = float(model.point.evaluate(np.zeros(1))[0] / model.point.load)
    if model.grooves is not None:
        rise *= float(np.hypot(1.0, model.grooves.slope(0.0)))

    modes = None
    nodes = None
    rest = 0.0
    n = loads.size
    if joint.is_soft:
        modes = _choose_modes(joint, law, numerics, moves=moves)
        if keys.law in laws.STIFF_LAWS:
            # Rigid friction and that of a speed have the compliance of the modes left out.
            diagonal = joint.patch.slip_compliance.diagonal()[modes.points]
            modes, rest = shear_modes.share_rest(modes, diagonal)
        nodes = modes.points
        loads = loads[nodes]
        if limits is not None:
            limits = limits[:, modes.points]
            nodes = modes.points + n * np.array([[1], [2]])
        if lower is not None:
            points = modes.points
            lower = lower._replace(places=lower.places[points], shares=lower.shares[points])
    elif (moves or lower is not None) and not law_has_trait(keys.law, "memoryless"):
        nodes = np.arange(n)
    else:
        loads = loads.sum()
        if limits is not None:
            limits = limits.sum(axis=1, keepdims=True)
            nodes = 3 * n + np.array([[0], [1]])

    # A stiffness in the keys is that under the mean load, and does not follow a load that changes.
    load = rise * loads
    bond_sum = None
    if bond_lists.sums_over_lists(model, keys):
        choice = bond_lists.choose_bond_summation(model, numerics)
        bond_sum = contacts.BondSum(law, choice.reach(law.order), choice.merge)
        points = laws.make_list(law, load)
    elif keys.stiffness and law_takes_stiffness_or_length(keys.law):
        points = laws.make_cells(law.static, law.length, loads, is_fixed=True)
        points = points._replace(load=np.broadcast_to(load, points.load.shape))
    elif keys.law == "iwan":
        # A single point on a prescribed slide takes little time.
        is_cheap = joint.row.size == 0 and np.size(load) == 1
        n_cells = laws.N_CELLS * (CELLS_FACTOR if is_cheap else 1)
        n_cells = n_cells // 2 if numerics.space.has_half_cells else n_cells
        points = laws.make_iwan(law, np.maximum(load, MIN_LOAD), n_cells)
    elif limits is None:
        points = laws.make_point_law(keys.law, law, load, rest)
    else:
        forward, back = rise * limits
        points = laws.make_point_law(keys.law, law, forward, rest)._replace(back=back)
    if lower is not None and bond_sum is None:
        points = laws.keep_loads(points)
    nodes = nodes if moves else None
    return PointSet(points, joint.row, nodes, modes, lower=lower, bond_sum=bond_sum)


def _place_on_lower_piece(joint: SlidingPart, limits) -> contacts.LowerPressure | None:
    """Return the places of the points of a joint over the pressure of the lower piece; None if the upper piece has it.

    One point carries the whole load under a law without memory on rigid pieces. Its table has slides and relative loads in
    place of places and relative pressures: at a slide it carries the load of the part of the lower piece that the upper
    one covers. `limits` (2, m) are the loads [N] that limit friction if the law averages the pressure, or None.
    """
    patch = joint.patch
    keys = joint.keys
    is_below = patch is not None and patch.model.gap.side == "lower"
    if not is_below or joint.model.grooves is not None or joint.band is not None:
        return None

    # A law that averages the pressure limits friction by its tractions of either sign.
    x = patch.x
    area = patch.pieces.interface
    pressures = [patch.pressure.sigma_n]
    if limits is not None:
        pressures = [averaged_law.find_tractions(keys, patch, sign) for sign in (1.0, -1.0)]
    if joint.is_soft or not law_has_trait(keys.law, "memoryless"):
        mean = patch.pressure.load / float(area.weight @ (patch.pressure.sigma_n > 0))
        tables = tuple(np.stack([x, sigma / mean]) for sigma in pressures)
        return contacts.LowerPressure(x, mean * area.weight, tables)

    tables = []
    load = joint.node_loads.sum()
    slides = np.append(x - x[-1], x[1:] - x[0])
    for sigma in pressures:
        passed = np.append(0.0, np.cumsum((sigma[1:] + sigma[:-1]) * np.diff(x)))
        scale = passed[-1] if limits is None else 2 * load / area.width
        tables.append(np.stack([slides, np.append(passed, passed[-1] - passed[1:]) / scale]))
    return contacts.LowerPressure(np.zeros(1), np.array([load]), tuple(tables))


def _choose_modes(joint: SlidingPart, law, numerics, *, moves: bool) -> shear_modes.ShearModes:
    """Return the shear modes of the pieces of a joint, which the cache keeps for all runs with the same Patch.

    Without a number of modes the neglected ones change the backbone curve of the interface by at most
    SHEAR_MODES_ERROR_RATIO times the tolerance.

    Parameters
    ----------
    joint : SlidingPart
        Interface whose pieces deform in shear.
    law : friction law or Bonds
        Law of the points.
    numerics : Numerics
        Number of modes; None: by the scene, otherwise by the tolerance.
    moves : bool
        Whether heave and pitch change its pressure.
    """
    patch = joint.patch
    keys = joint.keys
    force = joint.node_loads
    accuracy = joint.model.accuracy
    bound = SHEAR_MODES_ERROR_RATIO * accuracy.tolerance
    count = numerics.space.shear_modes or accuracy.shear_modes
    is_below = patch.model.gap.side == "lower" and joint.model.grooves is None
    most = MAX_STIFF_MODES if keys.law in laws.STIFF_LAWS else MAX_MODES

    def find_modes(limit, count: int | None, fall: float) -> shear_modes.ShearModes:
        """Return shear modes.

        Parameters
        ----------
        limit : (m,) array
            Friction limits of the nodes [N].
        count : int or None
            Number of modes; None: a sufficient one.
        fall : float
            Steepest fall of the friction force over the slip, relative to its limit [1/m].
        """
        compliance = patch.slip_compliance
        length = getattr(law, "length", None) or 0.0
        if not length and count is None:
            # Rigid friction is replaced by a length far below the mean displacement under the friction limits of all
            # nodes, as its number of modes would have no bound.
            length = MIN_BOND_LENGTH_RATIO * float(limit @ (compliance @ limit) / limit.sum())
        if count is not None:
            return shear_modes.shear_modes(compliance, limit, count, fall)
        first = shear_modes.N_SHEAR_MODES
        return shear_modes.find_sufficient_modes(
            compliance, limit, length, first, bound, fall, most
        )

    def compute() -> shear_modes.ShearModes:
        """Compute the shear modes."""
        # Nodes that may be pressed later are weighted with an added pressure.
        weight = force
        if moves:
            weight = force + ADDED_WEIGHT_PRESSURE_FRACTION * force.mean()
        elif is_below:
            weight = np.maximum(force, UNLOADED_NODE_PRESSURE_FRACTION * force.mean())
        fall = find_steepest_fall(law) if law_has_trait(keys.law, "bonds") else 0.0
        if fall and (moves or is_below):
            # A patch that could jump without a change of the drive is rejected under its pressure at the start.
            find_modes(keys.static * force, 1, fall)
            fall = 0.0
        return find_modes(keys.static * weight, count, fall)

    key = ("shear modes", patch, keys, float(force.sum()), moves, is_below, count, bound)
    return store.get_or_compute(key, compute)


def find_steepest_fall(law) -> float:
    """Return the steepest fall of the friction force of a law over the slip, relative to the friction limit [1/m].

    It is that of the first slip of a point, which is so fast that its bonds do not grow at rest: a slower slip lets the
    force fall less, and a sudden one leaves no time. It is 0 for a law without growth, whose force does not fall.

    Parameters
    ----------
    law : Bonds
        Friction law of a point.
    """
    if not law.has_growth:
        return 0.0
    scales = (law.length, law.growth.slip_growth)
    first = FALL_RANGE[0] * min(scales)
    slide = np.append(0.0, np.geomspace(first, FALL_RANGE[1] * max(scales), N_FALL_SAMPLES))

    # A step of duration t grows the bonds by a_s t^2/h over its slide h, relative to their whole growth.
    growth = max(law.growth.rest_growth, np.finfo(float).tiny) * np.sum(1 / np.diff(slide))
    time = np.sqrt(MAX_FALL_GROWTH / growth) * np.arange(slide.size)
    point = PointSet(laws.make_bonds(law, 1.0), np.zeros(0))
    if law.order != 1 or law.reading != "stretch":
        bond_sum = contacts.BondSum(law, np.inf, 0.0)
        point = PointSet(laws.make_list(law, 1.0), np.zeros(0), bond_sum=bond_sum)
    contact = contacts.Contact([point], law.static)
    force = time_steps.slides.follow(contact, time, slide).force / law.static
    return max(0.0, float(-(np.diff(force) / np.diff(slide)).min()))


def compute_point_fields(patch, contact, snapshots) -> tuple[np.ndarray, np.ndarray]:
    """Return traction (f, m) [Pa] and slip (f, m) [m] at the nodes of a patch from the states of its contact points.

    Over grooves, the traction is the horizontal part of the forces on the flank of slope t, and the elastic stretch along
    the flank is divided by sqrt(1 + t^2).

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    contact : time_steps.contacts.Contact
        Points at all nodes, or at those of its shear modes.
    snapshots : sequence of time_steps.time_march.Snapshot
        States of the points in the f frames.
    """
    tau = np.zeros((len(snapshots), patch.x.size))
    if not len(snapshots):
        return tau, tau

    # Points of shear modes are at some of the nodes.
    index = np.arange(patch.x.size)
    if contact.reduction is not None:
        index = np.concatenate([point_set.shear.points for point_set in contact.first_sets])

    def collect(name: str) -> np.ndarray:
        """Return values (f, m) of the points, or (f, 1) of the interface, in all frames."""
        return np.array([np.ravel(getattr(snapshot, name)) for snapshot in snapshots])

    slide = collect("slide")
    forces = collect("forces")
    elastic = collect("stretch") + collect("bend")
    if contact.grooves is not None:
        slope = contact.grooves.slope(slide)
        loads = contact.point_sets[0].law.load
        length = np.hypot(1.0, slope)
        forces = collect("vertical") * loads / loads.sum() * slope + forces * length
        elastic = elastic / length
    local = tau + slide
    tau[:, index] = forces / patch.pieces.interface.weight[index]
    local[:, index] = collect("moves") - elastic
    return tau, local
