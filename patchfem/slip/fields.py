"""Shear modes of a patch, and the traction and slip at its nodes in given states."""

from typing import NamedTuple

import numpy as np

from ..friction.bonds.parameters import Bonds
from .shear_modes import N_SHEAR_MODES, find_sufficient_modes, shear_modes


class ShearFields(NamedTuple):
    """Fields at m nodes in f states.

    - traction (f, m): shear traction [Pa].
    - local_slip (f, m): irreversible slip [m].
    """

    traction: np.ndarray
    local_slip: np.ndarray


def element_fields(patch, elements, states, length: float) -> ShearFields:
    """Compute traction and slip at the nodes of a patch from the states of its Jenkins elements.

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    elements : JenkinsSet
        Elements that are equivalent to its t yielding nodes.
    states : sequence
        f pairs of relative displacement [m] and stretches (t,) [m] of the elements.
    length : float
        Length of the elastic-plastic law [m], 0 for Coulomb's law.

    Returns
    -------
    ShearFields
    """
    weight = patch.pieces.interface.weight
    traction = np.zeros((len(states), patch.x.size))
    local_slip = np.zeros_like(traction)
    for i, (rel_disp, stretch) in enumerate(states):
        force = np.zeros(patch.x.size)
        force[elements.points] = elements.force_matrix @ stretch
        traction[i] = force / weight
        local_slip[i] = rel_disp - patch.slip_compliance @ force
        local_slip[i, elements.points] -= length * force[elements.points] / elements.limit
    return ShearFields(traction, local_slip)


def point_fields(patch, shear, snapshots) -> ShearFields:
    """Compute traction and slip at the nodes of a patch from the states of its contact points.

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    shear : ShearModes or None
        Shear of the pieces; None if every node is a point.
    snapshots : sequence of points.time_march.Snapshot
        f states of the points.

    Returns
    -------
    ShearFields
    """
    index = np.arange(patch.x.size) if shear is None else shear.points
    weight = patch.pieces.interface.weight[index]
    traction = np.zeros((len(snapshots), patch.x.size))
    local_slip = np.zeros_like(traction)
    for i, snapshot in enumerate(snapshots):
        traction[i, index] = snapshot.forces / weight
        local_slip[i] = snapshot.slide
        local_slip[i, index] -= snapshot.stretch + snapshot.bend
    return ShearFields(traction, local_slip)


def bond_shear_modes(patch, law: Bonds, count: int | None, tolerance: float, *, sigma=None):
    """Return the ShearModes of a pressed patch whose nodes follow a bond law.

    The friction limit [N] of a node is mu_s sigma_n times its area. Its bonds are springs in series with the pieces.

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    law : Bonds
        Parameters of the bonds.
    count : int or None
        Number of modes; None to determine it from the tolerance.
    tolerance : float
        Largest error of the friction force on first loading / friction limit.
    sigma : (m,) ndarray, optional
        Pressure [Pa] that replaces that of the patch.

    Returns
    -------
    ShearModes
    """
    pressure = patch.pressure.sigma_n if sigma is None else sigma
    limit = law.static * pressure * patch.pieces.interface.weight
    weakening = 1 / law.ratio if law.ratio > 0 else np.inf
    if count is not None:
        return shear_modes(patch.slip_compliance, limit, law.length, count, weakening)
    return find_sufficient_modes(
        patch.slip_compliance, limit, law.length, N_SHEAR_MODES, tolerance, weakening
    )
