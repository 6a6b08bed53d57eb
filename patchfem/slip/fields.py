"""Shear modes of a pressed patch, and traction and local slip at every node, read back from elements or bond points."""

import numpy as np

from ..friction.bonds.parameters import Bonds
from .shear_modes import SHEAR_MODES, enough_modes, shear_modes


def element_fields(patch, found, states, length: float) -> tuple:
    """Traction and irreversible local slip (f, m) of a Jenkins set in states [(slide, stretch), ...]."""
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
    """Traction and irreversible local slip (f, m) of bond points in states [(slide, bonds (4, a)), ...]."""
    m = patch.x.size
    index = np.arange(m) if shear is None else shear.points
    tau, local = np.zeros((len(states), m)), np.zeros((len(states), m))
    for i, (slide, bonds) in enumerate(states):
        tau[i, index] = law.static / law.length * bonds[1]
        local[i] = slide
        stretch = np.divide(bonds[1], bonds[0], out=np.zeros(index.size), where=bonds[0] > 0)
        local[i, index] = bonds[3] - stretch
    return tau, local


def shear_of(patch, law: Bonds, count: int | None, tolerance: float):
    """ShearModes of the pressed patch for a bond law: `count` of them, or as many as the tolerance asks for."""
    limit = law.static * patch.pressure.sigma_n * patch.pieces.interface.weight
    weakening = 1 / law.ratio if law.ratio > 0 else np.inf
    if count is not None:
        return shear_modes(patch.giving, limit, law.length, count, weakening)
    return enough_modes(patch.giving, limit, law.length, SHEAR_MODES, 0.1 * tolerance, weakening)
