"""Contact points of a rig for the march: a law, a load and a port for every effect.

In: a Model, its Numerics and its Patch. Out: a `time_steps.contacts.Contact`. Each interface, or each band of a face that
yaws, is a set of points on its port: a point, the nodes of a patch with shear modes of its pieces, or
the parallel elements of a patch under a constant load.
"""

from __future__ import annotations

import numpy as np

from ...contact import contact_sets
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
    parts = joints.list_loaded_interfaces(model, patch, numerics.meshed)
    patches = [part.patch for part in parts if part.patch is not None]
    is_below = any(solved.model.gap.side == "lower" for solved in patches)
    if is_below or model.rig.friction.bands_slide_apart:
        return []
    soft_keys = [part.keys for part in parts if part.is_soft]
    if not soft_keys or not all(map(joints.has_elements, soft_keys)):
        return []
    return joints.list_joints(model, patch, numerics.meshed)


def _list_surfaces(model: Model, numerics, patch) -> list[Surface]:
    """Return the interfaces of a rig, or the bands of its face that slide apart."""
    rows = model.rig.modes.interfaces
    surfaces = []
    for part, row in zip(joints.list_loaded_interfaces(model, patch, numerics.meshed), rows):
        own = part.patch
        force = np.array([part.load.mean])
        if own is not None:
            force = own.pressure.sigma_n * own.pieces.interface.weight
        limits = averaged_law.find_loads(part.keys, own)
        soft = own if part.is_soft else None
        surface = Surface(part.keys, part.load.mean, force, soft, row, limits=limits)
        if model.rig.friction.bands_slide_apart and not part.is_soft:
            return _list_bands(own, surface, rows)
        surfaces.append(place_surface(model, own, surface))
    return surfaces


def _list_bands(patch, surface: Surface, rows) -> list[Surface]:
    """Return the bands of a face, with a row (n,) of `rows` each, that slide apart as wholes."""
    loads = bands.compute_band_loads(patch)
    limits = [None] * len(rows)
    if surface.limits is not None:
        sums = [bands.sum_bands(patch, side) for side in surface.limits]
        limits = np.transpose(sums)[:, :, None]
    parts = []
    for load, row, limit in zip(loads, rows, limits):
        parts.append(surface._replace(force=np.array([load]), row=row, limits=limit))
    return parts
