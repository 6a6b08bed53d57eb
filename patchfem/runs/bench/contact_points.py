"""Contact points of an interface under every law: at nodes, at the resultant, or behind shear modes of the pieces.

In: a model and its Patch. Out: a `time_steps.contacts.PointSet` for an interface of a rig, or the whole Contact of a bench,
whose slide is prescribed. Loads follow from time, from the place over the lower piece, from the flank of a groove, or, in a
rig, from heave and pitch.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ... import friction, time_steps
from ...core import MIN_LOAD
from ...effects import law_has_trait, law_takes_stiffness_or_length, needs_bond_list
from ...model.law import make_bond_parameters
from ...model.model import MIN_RIG_REST_SPEED
from ...slip import shear_modes
from ...time_steps import contacts, laws, systems
from ..patch import store
from . import averaged_law, shear

# Largest number of shear modes of laws whose points have the compliance of the modes left out: for Coulomb's law the loop
# area then has an error of 5e-4
MAX_MODES = 16
# Ratio of the cells of an Iwan model on a bench to those on a rig: the force is exact to 2e-7 of the friction limit
CELLS_FACTOR = 16
# First and last slide over which the steepest fall of a friction force is sought, relative to the smallest and the largest
# length of the law; with 400 samples the fall is known to 0.3 %.
FALL_RANGE = (1e-2, 20.0)
N_FALL_SAMPLES = 400
# Largest growth of the bonds at rest during that slide, relative to the whole growth.
MAX_FALL_GROWTH = 1e-8


class Surface(NamedTuple):
    """Interface, or a band of its face.

    - keys: effective keys of its law.
    - total: load [N] on the whole contact, to which stiffness and damping in the keys refer.
    - force: mean load of a point [N], or mean loads of the nodes (m,).
    - soft: Patch whose pieces deform in shear, or None.
    - row (n,): slide per modal coordinate.
    - has_half_cells: whether an Iwan model has half of its cells, to estimate their error.
    - rise: load of the points at the start over their mean load.
    - lower: LowerPressure if the pressure belongs to the lower piece, or None.
    - bond_sum: sum over lists of bonds, or None.
    - limits (2, m): loads [N] that limit friction in slides to +x and to -x, if the law averages the pressure, or None.
    """

    keys: object
    total: float
    force: np.ndarray
    soft: object
    row: np.ndarray
    has_half_cells: bool = False
    rise: float = 1.0
    lower: contacts.LowerPressure | None = None
    bond_sum: object = None
    limits: np.ndarray | None = None


def sums_over_lists(model, keys=None) -> bool:
    """Return whether the bonds of a law are summed one by one; without its keys, of the first interface of a model.

    A list keeps the load under which a bond formed, but the bonds of order 1 break as the load falls. So a named sum does
    not replace their recursion under a load that changes.
    """
    keys = keys or model.friction
    if not law_has_trait(keys.law, "bonds") or needs_bond_list(keys):
        return needs_bond_list(keys)
    changes = model.load_varies or model.grooves is not None
    if model.rig is not None:
        changes = changes or model.rig.friction.load_varies
    return not changes and model.accuracy.quadrature not in ("auto", "recursion")


def make_bond_sum(model, keys, choice):
    """Return the settings of a sum over lists of bonds (`time_steps.contacts.BondSum`); None without a list.

    Parameters
    ----------
    model : Model
        Model with the expected speed of the slide.
    keys : Friction
        Effective keys of the law.
    choice : EngineChoice or None
        Method of bond summation.
    """
    if not sums_over_lists(model, keys):
        return None
    law = _make_bonds(model, keys)
    return contacts.BondSum(law, choice.reach(law.order), choice.merge)


def _make_bonds(model, keys):
    """Return the parameters of the bonds of a law, whose effective keys are given, at the speed of a model."""
    min_rest_speed = 0.0 if model.rig is None else MIN_RIG_REST_SPEED
    return make_bond_parameters(keys, model.speed_scale, min_rest_speed)


def make_contact(model, patch, choice=None, *, has_half_cells: bool = False) -> contacts.Contact:
    """Return the contact points of a bench.

    Parameters
    ----------
    model : Model
        Model of a bench.
    patch : Patch or None
        None for a single point.
    choice : EngineChoice, optional
        Method of a sum over lists of bonds.
    has_half_cells : bool
        Whether an Iwan model has half of its cells.
    """
    fields = find_load_fields(model, patch)
    force = np.array([model.point.load if patch is None else 0.0])
    if patch is not None:
        force = patch.pressure.sigma_n * patch.pieces.interface.weight
    surface = Surface(
        model.friction,
        float(force.sum()),
        force,
        patch if model.partial_slip else None,
        np.zeros(0),
        has_half_cells,
        bond_sum=make_bond_sum(model, model.friction, choice),
        limits=averaged_law.find_loads(model.friction, patch),
    )
    surface = place_surface(model, patch, surface)
    limit = model.friction.static * float(force.sum())
    if model.grooves is not None:
        limit = model.grooves.max_force(float(force.sum()), model.friction.static)
    return join_points([make_points(model, surface)], limit, fields)


def join_points(point_sets, limit: float, fields: dict) -> contacts.Contact:
    """Return the Contact of some sets of points, the first of which are interfaces.

    Parameters
    ----------
    point_sets : list of PointSet
        Interfaces, then springs.
    limit : float
        Friction limit of all interfaces [N].
    fields : dict
        Fields of a Contact that describe the load.
    """
    return contacts.Contact(point_sets, limit, _find_length(point_sets), **fields)


def place_surface(model, patch, surface: Surface) -> Surface:
    """Return the surface of the only patch or point of a model with its load at the start and its places on the lower piece.

    Parameters
    ----------
    model : Model
        Grooves, load and side of the shapes.
    patch : Patch or None
        None for a single point.
    surface : Surface
        The surface under its mean load.
    """
    rise = 1.0
    if model.load_varies:
        rise = float(model.point.evaluate(np.zeros(1))[0] / model.point.load)
    if model.grooves is not None:
        # The points carry the normal force on the flank.
        rise *= float(np.hypot(1.0, model.grooves.slope(0.0)))
    lower = None
    if patch is not None and model.grooves is None and patch.model.gap.side == "lower":
        lower = _place_on_lower_piece(patch, surface)
    return surface._replace(rise=rise, lower=lower)


def find_load_fields(model, patch) -> dict:
    """Return the fields of a Contact that describe a load that follows from time, the place, or the flank of a groove."""
    fields = {}
    if model.grooves is not None:
        load = model.point.load if patch is None else float(patch.pressure.load)
        fields |= {"grooves": shear.find_climbed_grooves(model), "preload": load}
    if model.load_varies:
        preload = float(model.point.evaluate(np.zeros(1))[0])
        fields |= {"load": model.point.evaluate, "preload": preload}
    return fields


def _place_on_lower_piece(patch, surface: Surface) -> contacts.LowerPressure:
    """Return the places of the points of a surface over the pressure of the lower piece of a patch.

    One point carries the whole load under a law without memory on rigid pieces. Its table has slides and relative loads in
    place of places and relative pressures: at a slide it carries the load of the part of the lower piece that the upper
    one covers.
    """
    x = patch.x
    keys = surface.keys
    pressures = [patch.pressure.sigma_n]
    if surface.limits is not None:
        pressures = [averaged_law.find_tractions(keys, patch, sign) for sign in (1.0, -1.0)]
    if surface.soft is not None or not law_has_trait(keys.law, "memoryless"):
        mean = shear.mean_loaded_pressure(patch)
        tables = tuple(np.stack([x, sigma / mean]) for sigma in pressures)
        return contacts.LowerPressure(x, mean * patch.pieces.interface.weight, tables)

    tables = []
    load = surface.force.sum()
    slides = np.append(x - x[-1], x[1:] - x[0])
    for sigma in pressures:
        passed = np.append(0.0, np.cumsum((sigma[1:] + sigma[:-1]) * np.diff(x)))
        scale = passed[-1] if len(pressures) == 1 else 2 * load / patch.pieces.interface.width
        tables.append(np.stack([slides, np.append(passed, passed[-1] - passed[1:]) / scale]))
    return contacts.LowerPressure(np.zeros(1), np.array([load]), tuple(tables))


def make_points(
    model, surface: Surface, n_modes: int | None = None, *, moves: bool = False
) -> contacts.PointSet:
    """Return the points of a surface.

    Parameters
    ----------
    model : Model
        Model with the tolerance, the number of shear modes, and the expected speed of the slide.
    surface : Surface
        Interface or band.
    n_modes : int, optional
        Number of shear modes; default: by the scene, otherwise by the tolerance.
    moves : bool
        Whether heave and pitch change its pressure, so that every node has a load of its own.
    """
    keys = surface.keys
    if law_has_trait(keys.law, "bonds"):
        law = _make_bonds(model, keys)
    else:
        law = friction.record.make_law(keys, surface.total)

    # Laws without memory act on the resultant.
    force = surface.force
    if surface.soft is None:
        has_nodes = moves or surface.lower is not None
        if not has_nodes or law_has_trait(keys.law, "memoryless"):
            nodes = None
            if surface.limits is not None:
                surface = surface._replace(limits=surface.limits.sum(axis=1, keepdims=True))
                nodes = 3 * force.size + np.array([[0], [1]]) if moves else None
            return _make_point_set(surface, _make_law_points(surface, law, force.sum()), nodes)
        nodes = np.arange(force.size)
        return _make_point_set(
            surface, _make_law_points(surface, law, force), nodes if moves else None
        )

    modes = _choose_modes(model, surface, law, n_modes, moves=moves)

    # Rigid friction and that of a speed have the compliance of the modes left out.
    own = 0.0
    if keys.law in laws.STIFF_LAWS:
        diagonal = surface.soft.slip_compliance.diagonal()[modes.points]
        modes, own = shear_modes.share_rest(modes, diagonal)
    nodes = modes.points
    if surface.limits is not None:
        surface = surface._replace(limits=surface.limits[:, modes.points])
        nodes = modes.points + force.size * np.array([[1], [2]])
    point_law = _make_law_points(surface, law, force[modes.points], own)
    return _make_point_set(surface, point_law, nodes if moves else None, modes)


def _choose_modes(model, surface: Surface, law, n_modes: int | None, *, moves: bool):
    """Return the shear modes of a surface, which the cache keeps for all runs with the same Patch.

    Parameters
    ----------
    model : Model
        Model with the tolerance and the number of shear modes.
    surface : Surface
        Surface whose pieces deform in shear.
    law : friction law or Bonds
        Law of the points.
    n_modes : int or None
        Number of shear modes; None: by the scene, otherwise by the tolerance.
    moves : bool
        Whether heave and pitch change its pressure.
    """
    keys = surface.keys
    force = surface.force
    count = n_modes or model.accuracy.shear_modes
    tolerance = model.accuracy.tolerance
    is_below = surface.lower is not None

    def compute():
        """Compute the shear modes."""
        # Nodes that may be pressed later are weighted with an added pressure.
        weight = force
        if moves:
            weight = force + shear.ADDED_WEIGHT_PRESSURE_FRACTION * force.mean()
        elif is_below:
            weight = np.maximum(force, shear.UNLOADED_NODE_PRESSURE_FRACTION * force.mean())
        length = getattr(law, "length", None) or 0.0
        fall = find_steepest_fall(law) if law_has_trait(keys.law, "bonds") else 0.0
        if fall and (moves or is_below):
            # A patch that could jump without a change of the drive is rejected under its pressure at the start.
            first = shear.Softness(length, fall)
            shear.choose_modes(surface.soft, keys.static * force, first, 1, tolerance)
            fall = 0.0
        most = MAX_MODES if keys.law in laws.STIFF_LAWS else shear.MAX_MODES
        softness = shear.Softness(length, fall, most)
        return shear.choose_modes(surface.soft, keys.static * weight, softness, count, tolerance)

    key = ("shear modes", surface.soft, keys, float(force.sum()), moves, is_below, count, tolerance)
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
    scales = (law.length, law.slip_growth)
    first = FALL_RANGE[0] * min(scales)
    slide = np.append(0.0, np.geomspace(first, FALL_RANGE[1] * max(scales), N_FALL_SAMPLES))

    # A step of duration t grows the bonds by a_s t^2/h over its slide h, relative to their whole growth.
    growth = max(law.rest_growth, np.finfo(float).tiny) * np.sum(1 / np.diff(slide))
    time = np.sqrt(MAX_FALL_GROWTH / growth) * np.arange(slide.size)
    bond_sum = None
    point_law = laws.make_bonds(law, 1.0)
    if law.order != 1 or law.reading != "stretch":
        bond_sum = contacts.BondSum(law, np.inf, 0.0)
        point_law = laws.make_list(law, 1.0)
    point_sets = [contacts.PointSet(point_law, np.zeros(0), bond_sum=bond_sum)]
    contact = join_points(point_sets, law.static, {})
    force = time_steps.slides.follow(contact, time, slide).force / law.static
    return max(0.0, float(-(np.diff(force) / np.diff(slide)).min()))


def _make_point_set(surface: Surface, law, nodes=None, modes=None) -> contacts.PointSet:
    """Return the points of a surface as a PointSet, at their places over the lower piece if that has the pressure.

    Parameters
    ----------
    surface : Surface
        Surface of the points.
    law : laws.PointLaw
        Law of m points.
    nodes : (m,) array, optional
        Nodes whose forces are the loads of the points.
    modes : ShearModes, optional
        Shear of the pieces.
    """
    point_set = contacts.PointSet(law, surface.row, nodes, modes, bond_sum=surface.bond_sum)
    if surface.lower is None:
        return point_set
    lower = surface.lower
    if modes is not None:
        lower = lower._replace(places=lower.places[modes.points], shares=lower.shares[modes.points])
    if surface.bond_sum is None:
        law = laws.keep_loads(law)
    return replace(point_set, law=law, lower=lower)


def _make_law_points(surface: Surface, law, mean, compliance=0.0) -> laws.PointLaw:
    """Return points with the law of a surface.

    Parameters
    ----------
    surface : Surface
        Interface or band; a stiffness in its keys is that under the mean load, and does not follow a load that changes.
    law : friction law
        Law of the keys.
    mean : float or (m,) array
        Mean loads of the points [N].
    compliance : float or (m,) array
        Compliance of the shear modes left out [m/N].
    """
    keys = surface.keys
    load = surface.rise * mean
    if surface.bond_sum is not None:
        return laws.make_list(law, load)
    if keys.stiffness and law_takes_stiffness_or_length(keys.law):
        cells = laws.make_cells(law.static, law.length, mean, is_fixed=True)
        return cells._replace(load=np.broadcast_to(load, cells.load.shape))
    if keys.law == "iwan":
        # A single point on a prescribed slide takes little time.
        is_cheap = surface.row.size == 0 and np.size(load) == 1
        n_cells = laws.N_CELLS * (CELLS_FACTOR if is_cheap else 1)
        n_cells = n_cells // 2 if surface.has_half_cells else n_cells
        return laws.make_iwan(law, np.maximum(load, MIN_LOAD), n_cells)
    if surface.limits is None:
        return laws.make_point_law(keys.law, law, load, compliance)
    forward, back = surface.rise * surface.limits
    return laws.make_point_law(keys.law, law, forward, compliance)._replace(back=back)


def _find_length(point_sets) -> float:
    """Return the displacement [m] over which the first interface stretches before it slips; 0 for a rigid one."""
    if not point_sets or point_sets[0].is_spring:
        return 0.0
    stiffness = systems.find_stiffness(point_sets[0])
    return float(point_sets[0].law.limits.sum() / stiffness) if stiffness else 0.0
