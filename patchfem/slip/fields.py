"""Shear modes of a patch, and traction and slip at its nodes from states."""

from typing import NamedTuple

import numpy as np

from ..friction.bonds.parameters import Bonds
from .shear_modes import N_SHEAR_MODES, enough_modes, fewest_modes, shear_modes


class ShearFields(NamedTuple):
    """Traction (f, m) [Pa] and irreversible local slip (f, m) [m] of f states."""

    traction: np.ndarray
    local_slip: np.ndarray


def element_fields(patch, elements, states, length: float) -> ShearFields:
    """Recover the fields of a patch from the states of its Jenkins elements.

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    elements : JenkinsSet
    states : sequence
        f pairs of slide [m] and stretch (t,) [m].
    length : float
        Length of the elastic-plastic law [m], 0 for Coulomb's law.
    """
    shape, weight = (len(states), patch.x.size), patch.pieces.interface.weight
    traction, local_slip = np.zeros(shape), np.zeros(shape)
    for i, (slide, stretch) in enumerate(states):
        force = np.zeros(patch.x.size)
        force[elements.points] = elements.force_matrix @ stretch
        traction[i] = force / weight
        local_slip[i] = slide - patch.giving @ force
        local_slip[i, elements.points] -= length * force[elements.points] / elements.limit
    return ShearFields(traction, local_slip)


def point_fields(patch, law: Bonds, shear, states) -> ShearFields:
    """Recover the fields of a patch from the states of its bond points.

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    law : Bonds
    shear : ShearModes or None
    states : sequence
        f pairs of slide [m] and bonds (5, a), of which m, z, s2 and the local slide are read.
    """
    shape = (len(states), patch.x.size)
    index = np.arange(patch.x.size) if shear is None else shear.points
    traction, local_slip = np.zeros(shape), np.zeros(shape)
    for i, (slide, bonds) in enumerate(states):
        traction[i, index] = law.static / law.length * bonds[1]
        local_slip[i] = slide
        stretch = np.divide(bonds[1], bonds[0], out=np.zeros(index.size), where=bonds[0] > 0)
        local_slip[i, index] = bonds[3] - stretch
    return ShearFields(traction, local_slip)


def bond_shear_modes(
    patch, law: Bonds, count: int | None, tolerance: float, *, fewest: bool = False, sigma=None
):
    """Return the ShearModes of a pressed patch for a bond law.

    The friction limit of a node is mu_s sigma_n times its area [N]; the bonds are springs in series.

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    law : Bonds
    count : int or None
        Number of modes; without it the tolerance decides.
    tolerance : float
        Error of the backbone over the friction limit.
    fewest : bool
        Whether to search for the smallest number of modes, in place of doubling it.
    sigma : (m,) ndarray, optional
        Another pressure [Pa], of nodes that are not yet in contact.
    """
    pressure = patch.pressure.sigma_n if sigma is None else sigma
    limit = law.static * pressure * patch.pieces.interface.weight
    weakening = 1 / law.ratio if law.ratio > 0 else np.inf
    if count is not None:
        return shear_modes(patch.giving, limit, law.length, count, weakening)
    if fewest:
        return fewest_modes(patch.giving, limit, law.length, tolerance, weakening)
    return enough_modes(patch.giving, limit, law.length, N_SHEAR_MODES, tolerance, weakening)
