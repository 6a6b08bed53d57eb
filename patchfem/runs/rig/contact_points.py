"""Contact points of a rig for the march: a law, a load and a port for every effect.

In: a Model, its Numerics and its Patch. Out: a `time_steps.contacts.Contact`. Each interface, or each band of a face that
yaws, is a set of points on its port: a point, the nodes of a patch with shear modes of its pieces, or
the parallel elements of a patch under a constant load.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ... import friction, slip
from ...contact import contact_sets
from ...contact.stiffness import tangential_stiffness
from ...core import MIN_LOAD
from ...effects import law_has_trait, law_takes_stiffness_or_length
from ...model.law import make_bond_parameters
from ...model.model import MIN_RIG_REST_SPEED, Model
from ...structure.drive_sizes import find_drive_omega
from ...time_steps import laws
from ...time_steps.contacts import Contact, PointSet
from ...time_steps.systems import find_stiffness
from ..bench import shear
from ..patch import faces
from . import bands, bond_lists, joints

# Largest number of shear modes, and that of laws whose points have the compliance of the modes left out: for Coulomb's law
# the loop area then has an error of 5e-4
MAX_SOFT_MODES = 64
MAX_MODES = 16
# Smallest compliance in series with rigid friction at a node, relative to that of the node. All modes of a few nodes leave
# none out, and the march solves rigid friction only at whole ports. It changes amplitudes by up to 5e-4.
MIN_NEGLECTED = 1e-2
# Laws whose memory only `time_steps` takes through a change of the load
MEMORY_LAWS = ("iwan", "bouc-wen", "lugre")


class Surface(NamedTuple):
    """Interface, or a band of its face.

    - keys: effective keys of its law
    - total: load [N] on the whole contact, to which stiffness and damping in the keys refer
    - force: load of a point [N], or loads of the nodes (m,)
    - compliance (m, m): shear compliance of the pieces [m/N], or None
    - row (n,): slide per modal coordinate
    - n_cells: number of cells of an Iwan model
    """

    keys: object
    total: float
    force: np.ndarray
    compliance: np.ndarray | None
    row: np.ndarray
    n_cells: int = laws.N_CELLS


def make_contact(model: Model, numerics, patch) -> Contact:
    """Return the contact points of a march, with all interfaces and nonlinear springs.

    Parameters
    ----------
    model : Model
        Rig, springs and friction laws.
    numerics : Numerics
        Numbers of shear modes and coarser meshes.
    patch : Patch or None
        None under [normal] and between masses.
    """
    if _needs_points(model, numerics):
        return joints.make_contact(model, numerics, patch)
    rig = model.rig
    rows = rig.modes.interfaces
    springs = []
    if rig.springs.interlock is not None:
        law = laws.make_interlocking(*rig.springs.interlock)
        springs.append(PointSet(law, rows[0], is_spring=True))
    if rig.springs.cubic is not None:
        springs.append(
            PointSet(laws.make_cubic(rig.springs.cubic), rig.modes.output, is_spring=True)
        )
    fields = {}
    sets = []
    if model.rig.friction.interfaces:
        fields = _find_load(model, patch)
        found = _list_element_joints(model, numerics, patch) if not fields else []
        sets = [PointSet(joint.make_step_law(), row) for joint, row in zip(found, rows)]
        if len(found) == 1:
            fields["elements"] = found[0].reduction
        if not sets:
            surfaces = _list_surfaces(model, numerics, patch)
            if model.grooves is not None:
                # The points carry the normal force on the flank.
                climb = float(np.hypot(1.0, model.grooves.slope(0.0)))
                surfaces = [part._replace(force=climb * part.force) for part in surfaces]
            if numerics.has_half_cells:
                surfaces = [part._replace(n_cells=laws.N_CELLS // 2) for part in surfaces]
            moves = "sets" in fields
            sets = [_make_points(model, numerics, part, moves=moves) for part in surfaces]

    limit = sum(float(point_set.law.limits.sum()) for point_set in sets)
    scale = rig.modes.mass * find_drive_omega(rig.drive.signal) * rig.speed_scale
    if model.grooves is not None:
        limit = model.grooves.max_force(fields["preload"], model.friction.static)
    length = _find_length(sets[0]) if sets else 0.0
    return Contact([*sets, *springs], limit or scale, length, **fields)


def _needs_points(model: Model, numerics) -> bool:
    """Return whether the march of `points` computes a model, and not that of `time_steps`.

    It computes what it can, because its errors have been compared with other programs on more random rigs. It knows the
    memory of a law with a state of its own neither under a changing load, nor behind elastic pieces, nor on grooves; a rigid
    law behind elastic pieces, an averaged pressure and a given stiffness of the bonds not under a changing load; and bonds
    behind elastic pieces only at a single interface.
    """
    law = model.friction
    if law is None:
        return True
    friction = model.rig.friction
    is_soft = model.partial_slip or friction.has_partial_slip
    has_grooves = model.grooves is not None
    varies = friction.load_varies
    if law.law in MEMORY_LAWS:
        return not (varies or is_soft or has_grooves)
    if law.law == "tanh":
        return not (is_soft or has_grooves)
    if law_has_trait(law.law, "averaged"):
        return not varies
    if law_has_trait(law.law, "set-valued"):
        return not (varies and is_soft)
    if law_has_trait(law.law, "bonds") and is_soft and len(friction.interfaces) > 1:
        is_listed = bond_lists.choose_bond_summation(model, numerics).engine != "recursion"
        return is_listed or model.side == "lower"
    return not (varies and getattr(law, "stiffness", None) is not None)


def _find_load(model: Model, patch) -> dict:
    """Return the fields of a Contact that describe a load that changes."""
    if model.grooves is not None:
        # The lifted mass is compared to the modal mass at the interface, m / (s . s).
        modes = model.rig.modes
        mass = modes.mass / float(modes.slide @ modes.slide)
        model.grooves.check_lifted_mass(model.friction.static, mass)
        load = model.point.load if patch is None else float(patch.pressure.load)
        return {"grooves": model.grooves, "preload": load}
    if model.load_varies:
        return {
            "load": model.point.evaluate,
            "preload": float(model.point.evaluate(np.zeros(1))[0]),
        }
    if patch is None or not model.rig.friction.load_varies:
        return {}

    # Without pressure, the gap at the approach of the preload is g - C f. The rotational spring of the holder is in series
    # with the pitch, as a compliance x_i x_j/K in addition to that of the pieces.
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    compliance = patch.pieces.normal
    spring = model.patch.loading.rotational_stiffness
    if spring > 0:
        compliance = compliance + np.outer(patch.x, patch.x) / spring
    opening = patch.pressure.gap - compliance @ force
    modes = model.rig.modes
    still = np.zeros(modes.omega.size)
    return {
        "sets": contact_sets.ContactSets(compliance, patch.x, opening, force > 0),
        "heave": still if modes.normal is None else np.asarray(modes.normal, float),
        "pitch": still if modes.pitch is None else np.asarray(modes.pitch, float),
        "preload": float(force.sum()),
    }


def _list_element_joints(model: Model, numerics, patch) -> list[joints.Joint]:
    """Return the interfaces as joints of parallel elements where all that slip part by part have them; [] elsewhere."""
    interfaces = model.rig.friction.interfaces
    is_soft = [model.partial_slip or interface.partial_slip for interface in interfaces]
    keys = [model.friction if patch is not None else interface.numbers for interface in interfaces]
    soft_keys = [law for law, soft in zip(keys, is_soft) if soft]
    if not soft_keys or not all(joints.has_elements(law) for law in soft_keys):
        return []
    return joints.list_joints(model, patch, numerics.meshed)


def _list_surfaces(model: Model, numerics, patch) -> list[Surface]:
    """Return the interfaces of a rig, or the bands of its face that slide apart."""
    rig = model.rig
    rows = rig.modes.interfaces
    if patch is not None:
        keys = joints.replace_averaged_law(model.friction, model, patch)
        total = float(patch.pressure.load)
        force = patch.pressure.sigma_n * patch.pieces.interface.weight
        compliance = patch.slip_compliance if model.partial_slip else None
        if rig.friction.bands_slide_apart and not model.partial_slip:
            pairs = zip(bands.compute_band_loads(patch), rows)
            return [Surface(keys, total, np.array([load]), None, row) for load, row in pairs]
        return [Surface(keys, total, force, compliance, rows[0])]

    surfaces = []
    for k, interface in enumerate(rig.friction.interfaces):
        load = model.point.load if interface.load is None else interface.load
        force = np.array([load])
        compliance = None
        if interface.partial_slip:
            solved = faces.solve_contact_on_meshes(interface, model.accuracy.tolerance)
            own = solved[int(k in numerics.meshed)]
            force = own.pressure.sigma_n * own.pieces.interface.weight
            compliance = own.slip_compliance
        keys = joints.replace_averaged_law(interface.numbers, model, patch)
        surfaces.append(Surface(keys, load, force, compliance, rows[k]))
    return surfaces


def _make_points(model: Model, numerics, surface: Surface, *, moves: bool) -> PointSet:
    """Return the points of a surface.

    Parameters
    ----------
    model : Model
        Rig with its loads.
    numerics : Numerics
        Number of shear modes; None: set by the tolerance.
    surface : Surface
        Interface or band.
    moves : bool
        Whether heave and pitch change its pressure, so that every node has a load of its own.
    """
    keys = surface.keys
    if law_has_trait(keys.law, "bonds"):
        law = make_bond_parameters(keys, model.rig.slide_speed_scale, MIN_RIG_REST_SPEED)
    else:
        law = friction.record.make_law(keys, surface.total)
    if surface.compliance is None:
        # Laws without memory act on the resultant.
        has_nodes = moves and not law_has_trait(keys.law, "memoryless")
        if not has_nodes:
            load = model.point.evaluate(np.zeros(1)) if model.load_varies else surface.force.sum()
            return PointSet(_make_law_points(surface, law, surface.force.sum(), load), surface.row)
        nodes = np.arange(surface.force.size)
        points = _make_law_points(surface, law, surface.force, surface.force)
        return PointSet(points, surface.row, nodes)

    # The shear modes of nodes that may be pressed later are weighted with an added pressure.
    force = surface.force
    weight = force
    if moves:
        weight = force + shear.ADDED_WEIGHT_PRESSURE_FRACTION * force.mean()
    length = getattr(law, "length", None) or 0.0
    fall = shear.find_steepest_fall(law) if law_has_trait(keys.law, "bonds") else 0.0
    limit = keys.static * weight
    most = MAX_MODES if keys.law in laws.STIFF_LAWS else MAX_SOFT_MODES
    modes = _choose_modes(model, numerics, surface.compliance, limit, _Softness(length, fall, most))
    own = surface.compliance[np.ix_(modes.points, modes.points)]
    neglected = np.diag(own) - (modes.shape**2 / modes.stiffness).sum(axis=1)
    least = MIN_NEGLECTED if law_has_trait(keys.law, "set-valued") else 0.0
    neglected = np.maximum(neglected, least * np.diag(own))
    force = force[modes.points]
    points = _make_law_points(surface, law, force, force, neglected)
    return PointSet(points, surface.row, modes.points if moves else None, modes)


class _Softness(NamedTuple):
    """Properties of a law that decide how many shear modes it needs.

    - length: displacement over which the force grows to its limit [m], 0 for rigid friction
    - fall: steepest fall of the friction force over the slip, relative to its limit [1/m]
    - max_modes: largest number of modes
    """

    length: float
    fall: float
    max_modes: int


def _make_law_points(surface: Surface, law, mean, load, compliance=0.0) -> laws.PointLaw:
    """Return points with the law of a surface.

    Parameters
    ----------
    surface : Surface
        Interface or strip; a stiffness in its keys is that under the mean load, and does not follow a load that changes.
    law : friction law
        Law of the keys.
    mean, load : float or (m,) array
        Mean loads of the points, and their loads at the start [N].
    compliance : float or (m,) array
        Compliance of the shear modes left out [m/N].
    """
    keys = surface.keys
    if keys.stiffness and law_takes_stiffness_or_length(keys.law):
        points = laws.make_cells(law.static, law.length, mean, is_fixed=True)
        return points._replace(load=np.broadcast_to(load, points.load.shape))
    if keys.law == "iwan":
        return laws.make_iwan(law, np.maximum(load, MIN_LOAD), surface.n_cells)
    return laws.make_point_law(keys.law, law, load, compliance)


def _choose_modes(model: Model, numerics, compliance, limit, softness: _Softness):
    """Return the shear modes of the pieces; their number is that of the numerics, the scene, or by the tolerance.

    Parameters
    ----------
    model : Model
        Tolerance and number of modes of the scene.
    numerics : Numerics
        Number of modes of the run, or None.
    compliance : (m, m) array
        Shear compliance of the nodes [m/N].
    limit : (m,) array
        Friction limits [N].
    softness : _Softness
        Properties of the law.
    """
    count = numerics.shear_modes or model.accuracy.shear_modes
    if count is not None:
        return slip.shear_modes.shear_modes(compliance, limit, count, softness.fall)
    # Rigid friction is replaced by a short length, as its number of modes would have no bound.
    length = softness.length
    if not length:
        slide = limit.sum() / tangential_stiffness(compliance, limit > 0)
        length = shear.MIN_BOND_LENGTH_RATIO * slide
    return slip.shear_modes.find_sufficient_modes(
        compliance,
        limit,
        length,
        slip.shear_modes.N_SHEAR_MODES,
        shear.SHEAR_MODES_ERROR_RATIO * model.accuracy.tolerance,
        softness.fall,
        softness.max_modes,
    )


def _find_length(point_set: PointSet) -> float:
    """Return the displacement [m] over which the first interface stretches before it slips; 0 for a rigid one."""
    stiffness = find_stiffness(point_set)
    return float(point_set.law.limits.sum() / stiffness) if stiffness else 0.0
