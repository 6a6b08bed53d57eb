"""Contact points of a rig for the march: a law, a load and a port for every effect.

In: a Model, its Numerics and its Patch. Out: a `time_steps.contacts.Contact`. Each interface, or each band of a face that
yaws, is a set of points on its port: a point, the nodes of a patch with shear modes of its pieces, or
the parallel elements of a patch under a constant load.
"""

from __future__ import annotations

import numpy as np

from ...contact import contact_sets
from ...effects import law_has_trait
from ...model.model import Model
from ...structure.drive_sizes import find_drive_omega
from ...time_steps import laws
from ...time_steps.contacts import PointSet
from ..bench import averaged_law
from ..bench.contact_points import (
    Surface,
    find_load_fields,
    join_points,
    make_bond_sum,
    make_points,
    place_surface,
)
from ..patch import faces
from . import bands, bond_lists, joints


def make_contact(model: Model, numerics, patch):
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
    rig = model.rig
    rows = rig.modes.interfaces

    # Nonlinear springs are points too, which follow the interfaces.
    springs = []
    if rig.springs.interlock is not None:
        law = laws.make_interlocking(*rig.springs.interlock)
        springs.append(PointSet(law, rows[0], is_spring=True))
    if rig.springs.cubic is not None:
        law = laws.make_cubic(rig.springs.cubic)
        springs.append(PointSet(law, rig.modes.output, is_spring=True))

    # Parallel elements represent an interface exactly under a constant load; its nodes or shear modes serve all other cases.
    fields = {}
    sets = []
    if rig.friction.interfaces:
        fields = _find_load(model, patch)
        found = _list_element_joints(model, numerics, patch) if not fields else []
        sets = [PointSet(joint.make_step_law(), row) for joint, row in zip(found, rows)]
        if len(found) == 1:
            fields["elements"] = found[0].reduction
        if not sets:
            surfaces = _list_surfaces(model, numerics, patch)
            halves = {"has_half_cells": numerics.has_half_cells}
            surfaces = [part._replace(**halves) for part in surfaces]
            if bond_lists.has_bond_list(model):
                choice = bond_lists.choose_bond_summation(model, numerics)
                sums = [make_bond_sum(model, part.keys, choice) for part in surfaces]
                surfaces = [part._replace(bond_sum=one) for part, one in zip(surfaces, sums)]
            moves = "sets" in fields
            count = numerics.shear_modes
            sets = [make_points(model, part, count, moves=moves) for part in surfaces]
            if rig.friction.bands_slide_apart and model.partial_slip:
                sets = sets[0].divide(bands.number_bands(patch)[sets[0].shear.points], rows)

    # Without friction the drive gives the scale of the forces.
    limit = sum(float(point_set.law.limits.sum()) for point_set in sets)
    scale = rig.modes.mass * find_drive_omega(rig.drive.signal) * rig.speed_scale
    if model.grooves is not None:
        load = model.point.load if patch is None else float(patch.pressure.load)
        limit = model.grooves.max_force(load, model.friction.static)
    return join_points([*sets, *springs], limit or scale, fields)


def _find_load(model: Model, patch) -> dict:
    """Return the fields of a Contact that describe a load that changes."""
    if not model.rig.friction.load_varies or model.load_varies:
        return find_load_fields(model, patch)

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
        "averages": averaged_law.make_averages(model.friction, patch),
    }


def _list_element_joints(model: Model, numerics, patch) -> list[joints.Joint]:
    """Return the interfaces as joints of parallel elements where all that slip part by part have them; [] elsewhere.

    Bands that yaw deform the same pieces, so that their elements are not parallel.
    """
    interfaces = model.rig.friction.interfaces
    if model.rig.friction.bands_slide_apart:
        return []
    patches = [model.patch, *(interface.patch for interface in interfaces)]
    if any(part is not None and part.gap.side == "lower" for part in patches):
        return []
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
        keys = model.friction
        limits = averaged_law.find_loads(keys, patch)
        total = float(patch.pressure.load)
        force = patch.pressure.sigma_n * patch.pieces.interface.weight
        soft = patch if model.partial_slip else None
        if rig.friction.bands_slide_apart and not model.partial_slip:
            pairs = zip(bands.compute_band_loads(patch), rows)
            parts = [Surface(keys, total, np.array([load]), None, row) for load, row in pairs]
            if limits is not None:
                sums = [bands.sum_bands(patch, loads) for loads in limits]
                parts = [
                    part._replace(limits=np.reshape(pair, (2, 1)))
                    for part, *pair in zip(parts, *sums)
                ]
            return parts
        surface = Surface(keys, total, force, soft, rows[0], limits=limits)
        return [place_surface(model, patch, surface)]

    # Between masses only a patch whose shape matters to the motion is pressed; any other is a point.
    surfaces = []
    for k, interface in enumerate(rig.friction.interfaces):
        load = model.point.load if interface.load is None else interface.load
        force = np.array([load])
        keys = interface.numbers
        own = None
        if interface.patch is not None and (
            interface.partial_slip
            or interface.patch.gap.side == "lower"
            or law_has_trait(keys.law, "averaged")
        ):
            solved = faces.solve_contact_on_meshes(interface, model.accuracy.tolerance)
            own = solved[int(k in numerics.meshed)]
            force = own.pressure.sigma_n * own.pieces.interface.weight
        limits = averaged_law.find_loads(keys, own)
        soft = own if interface.partial_slip else None
        surface = Surface(keys, load, force, soft, rows[k], limits=limits)
        surfaces.append(place_surface(model, own, surface))
    return surfaces
