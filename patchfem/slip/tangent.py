"""Stiffness of a solved patch against the three motions of its holder, with contact set and slip zones as they are."""

from dataclasses import dataclass

import numpy as np

from ..core import Compliance, NotConverged, PatchfemError, frozen_array
from ..elasticity.lapack import one_thread


@dataclass(frozen=True, eq=False, slots=True)
class Operators:
    """Compliance of a pair for normal and shear forces.

    x: (m,) [m]; normal, tangential: (m, m) [m/N] as in `core.Compliance`; coupling: (m, m) [m/N], closing undone per
    shear force as in `substructure.joined`, None for alike pieces.
    """

    x: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    coupling: np.ndarray | None = None


def operators_of(pieces: Compliance, coupling: np.ndarray | None = None) -> Operators:
    """Operators of a pair; a coupling (m, m) [m/N] that is zero throughout is dropped.

    PatchfemError for a shape or a value that cannot be.
    """
    if coupling is not None:
        coupling = frozen_array(coupling)
        if coupling.shape != pieces.normal.shape or not np.isfinite(coupling).all():
            raise PatchfemError(f"contact: the coupling must be {pieces.normal.shape} and finite, has {coupling.shape}")
        coupling = coupling if coupling.any() else None
    return Operators(pieces.interface.x, pieces.normal, pieces.tangential, coupling)


@dataclass(frozen=True, eq=False, slots=True)
class OperatingTangent:
    """Tangent of a solved patch.

    matrix: (3, 3) change of shear T [N], load N [N] and moment M [N m] (rows) per slide [m], approach [m] and rotation
    [rad] > 0 that opens +x (columns). Without slip (T, N, -M) against these motions is symmetric. Slipping nodes carry
    mu dN, which makes it unsymmetric in T only for alike pieces.
    """

    matrix: np.ndarray

    @property
    def tangential(self) -> float:
        """Tangential stiffness K_t = dT/d(slide) [N/m] at held approach and rotation."""
        return float(self.matrix[0, 0])

    @property
    def normal(self) -> float:
        """Normal stiffness K_n = dN/d(approach) [N/m] at held slide and rotation."""
        return float(self.matrix[1, 1])

    @property
    def rotational(self) -> float:
        """Rotational stiffness -dM/d(rotation) [N m/rad] > 0 at held approach and slide: the moment that resists the
        rotation."""
        return float(-self.matrix[2, 2])


def operating_tangent(operators: Operators, active, slipping=None, friction: float = 0.0, skin_normal=None,
                      skin_tangential=None) -> OperatingTangent:
    """Tangent of a state of contact and slip.

    active: (m,) bool contact set; slipping: (m,) -1, 0, 1, None where all stick; friction: mu; skin_normal,
    skin_tangential: (m,) [N/m] > 0, tangent stiffness of each node's asperities in series, None where rigid. No contact
    gives zeros. PatchfemError for a skin without stiffness, NotConverged where slip makes the tangent singular.
    """
    index = np.flatnonzero(active)
    sign = np.zeros(index.size) if slipping is None else np.asarray(slipping, float)[index]
    slips = np.flatnonzero(sign)
    stuck = np.flatnonzero(sign == 0)
    n = index.size
    if n == 0:
        return OperatingTangent(frozen_array(np.zeros((3, 3))))
    here = np.ix_(index, index)
    cross = np.zeros((n, n)) if operators.coupling is None else operators.coupling[here]
    system = np.block([[operators.normal[here] + _series(skin_normal, index, "normal"), cross],
                       [cross.T, operators.tangential[here] + _series(skin_tangential, index, "tangential")]])
    x = operators.x[index]
    motion = np.zeros((2 * n, 3))
    motion[:n, 1], motion[:n, 2], motion[n:, 0] = 1.0, -x, 1.0
    # unknowns f and the sticking t; a slipping node has t = sign mu f
    known = np.concatenate([np.arange(n), n + stuck])
    core = system[np.ix_(known, known)]
    core[:, slips] += system[np.ix_(known, n + slips)] * (sign[slips] * friction)
    try:
        with one_thread():
            found = np.linalg.solve(core, motion[known])
    except np.linalg.LinAlgError:
        raise NotConverged("contact: the tangent is singular; friction times the coupling of the unlike pieces is too "
                           "strong") from None
    force, shear = found[:n], np.zeros((n, 3))
    shear[stuck] = found[n:]
    shear[slips] = friction * sign[slips, None] * force[slips]
    return OperatingTangent(frozen_array([shear.sum(axis=0), force.sum(axis=0), x @ force]))


def _series(skin, index, name: str) -> np.ndarray:
    if skin is None:
        return np.zeros((index.size, index.size))
    stiffness = np.asarray(skin, float)[index]
    if not (np.isfinite(stiffness).all() and (stiffness > 0).all()):
        raise PatchfemError(f"contact.asperities: the {name} stiffness of the skin must be positive on the contact set")
    return np.diag(1 / stiffness)
