"""Shear modes of a pressed patch, and traction and local slip at every node, read back from elements or bond points."""

import numpy as np

from ..friction.bonds.parameters import Bonds
from .shear_modes import SHEAR_MODES, enough_modes, fewest_modes, shear_modes


def element_fields(patch, found, states, length: float) -> tuple:
    """Traction (f, m) [Pa] and irreversible local slip (f, m) [m] of a Jenkins set, read back from its states.

    patch: the solved Patch; found: its JenkinsSet; states: f of (slide [m], stretch (t,) [m]); length [m]: of the
    elastic-plastic law, 0 for Coulomb's.
    """
    m, weight = patch.x.size, patch.pieces.interface.weight
    tau, local = np.zeros((len(states), m)), np.zeros((len(states), m))
    for i, (slide, stretch) in enumerate(states):
        force = np.zeros(m)
        force[found.points] = found.share @ stretch
        tau[i] = force / weight
        local[i] = slide - patch.giving @ force
        local[i, found.points] -= length * force[found.points] / found.limit
    return tau, local


def point_fields(patch, law: Bonds, shear, states) -> tuple:
    """Traction (f, m) [Pa] and irreversible local slip (f, m) [m] of bond points, read back from their states.

    patch: the solved Patch; shear: its ShearModes or None; states: f of (slide [m], bonds (5, a), of which four
    are read: m, z, s2, local slide).
    """
    m = patch.x.size
    index = np.arange(m) if shear is None else shear.points
    tau, local = np.zeros((len(states), m)), np.zeros((len(states), m))
    for i, (slide, bonds) in enumerate(states):
        tau[i, index] = law.static / law.length * bonds[1]
        local[i] = slide
        stretch = np.divide(bonds[1], bonds[0], out=np.zeros(index.size), where=bonds[0] > 0)
        local[i, index] = bonds[3] - stretch
    return tau, local


def shear_of(
    patch, law: Bonds, count: int | None, tolerance: float, fewest: bool = False, sigma=None
):
    """ShearModes of the pressed patch for a bond law: `count` of them, or as many as the tolerance asks for.

    The limit of a node is mu_s sigma_n times its share of the interface [N]; the bonds' length [m] is a spring in
    series. Unless named, the number is doubled until the error of the backbone is within `tolerance`; fewest: none more
    than that takes; sigma (m,) [Pa]: another pressure, of nodes that nothing presses yet.
    """
    limit = (
        law.static
        * (patch.pressure.sigma_n if sigma is None else sigma)
        * patch.pieces.interface.weight
    )
    weakening = 1 / law.ratio if law.ratio > 0 else np.inf
    if count is not None:
        return shear_modes(patch.giving, limit, law.length, count, weakening)
    if fewest:
        return fewest_modes(patch.giving, limit, law.length, tolerance, weakening)
    return enough_modes(patch.giving, limit, law.length, SHEAR_MODES, tolerance, weakening)
