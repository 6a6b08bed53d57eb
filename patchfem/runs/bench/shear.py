"""Shear modes of the pieces of a patch, and fields of its interface from the states of its contact points."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...slip import shear_modes

# Ratio of the assumed pressure of an initially unloaded node of the lower piece to the mean
# pressure.
UNLOADED_NODE_PRESSURE_FRACTION = 1e-3
# Bond length for the choice of the shear modes of rigid friction, relative to the slide at gross slip.
MIN_BOND_LENGTH_RATIO = 1e-3
# Pressure that is added to each node in the weights of shear modes under a changing load, relative to the mean pressure.
ADDED_WEIGHT_PRESSURE_FRACTION = 1.0
MAX_MODES = 64  # largest number of shear modes that the tolerance asks for
# Error of the backbone curve by neglected shear modes, relative to the tolerance.
SHEAR_MODES_ERROR_RATIO = 0.1


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


class Softness(NamedTuple):
    """Properties of a law that decide how many shear modes it needs.

    - length: displacement over which the force of a node grows to its limit [m]; 0 for rigid friction.
    - fall: steepest fall of the friction force over the slip, relative to its limit [1/m].
    - max_modes: largest number of modes.
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
    index = np.arange(patch.x.size)
    if contact.reduction is not None:
        index = np.concatenate([point_set.shear.points for point_set in contact.first_sets])
    slide = np.array([snapshot.slide for snapshot in snapshots])[:, None]
    shape = (len(snapshots), index.size)
    moves = np.reshape([snapshot.moves for snapshot in snapshots], shape)
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
    local[:, index] = moves - elastic
    return tau, local


def mean_loaded_pressure(patch) -> float:
    """Return the mean pressure [Pa] over the loaded nodes."""
    return patch.pressure.load / float(patch.pieces.interface.weight @ (patch.pressure.sigma_n > 0))
