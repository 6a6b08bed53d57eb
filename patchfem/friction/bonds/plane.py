"""The bond law on a path in two directions: eq. 2.17 with the displacement u of a bond as a vector.

A path is a polygon; an increment dq (2,) is one straight leg of it. Tractions are (2, m) [Pa], positive against slip.

Stretch reading, p = 1: the sums z over all bonds become vectors, s2 stays a scalar. Along a leg of direction e

    m' = (sigma - m)/eps,   z' = m e - z/eps,   s2' = 2 z.e - s2/eps        per unit of path,

so the part of z along e steps as in one direction, the part across it decays with exp(-x), and the step is exact.
Stored energy mu_s s2/(2 eps_0) and dissipation mu_s s2/(2 eps_0 eps) stay what they are: passive on every path.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ..protocol import Step
from .parameters import Bonds, grow
from .recursion import advance, shape_functions


class PlaneState(NamedTuple):
    """bonds (4, m): m [Pa], z along x and across [Pa m], s2 [Pa m2]; eps: the common bond length [m]."""

    bonds: np.ndarray
    eps: float


def refuse_breakaway(law: Bonds) -> None:
    """PatchfemError for a law whose elastic range has no form in two directions."""
    if law.breakaway:
        raise PatchfemError("breakaway in two directions: set breakaway = 0; not yet built")


def direction(dq) -> tuple:
    """(length [m], unit vector (2,)) of an increment; the vector is 0 where nothing moves."""
    path = float(np.hypot(dq[0], dq[1]))
    return path, np.asarray(dq, float) / path if path > 0 else np.zeros(2)


def advance_plane(bonds, dq, sigma, eps: float) -> tuple:
    """New bonds (4, m), path-mean stretch (2, m) [Pa m], integral of s2 dR/eps (m,) [Pa m2] of one leg dq (2,) [m].

    bonds (4, m), sigma (m,) [Pa] the pressure that forms the new bonds, eps [m].
    """
    path, e = direction(dq)
    along = e @ bonds[1:3]
    across = bonds[1:3] - e[:, None] * along
    f1, _, decay = shape_functions(path / eps)
    out, mean, _, burnt = advance(np.stack([bonds[0], along, bonds[3]]), path, sigma, eps)
    z = e[:, None] * out[1] + across * decay
    return np.stack([out[0], *z, out[2]]), e[:, None] * mean + across * f1, burnt


@dataclass(frozen=True, slots=True)
class PlaneRecursion:
    """Law object of the stretch reading, p = 1, along a path in two directions."""

    law: Bonds

    def __post_init__(self):
        refuse_breakaway(self.law)

    def start(self, sigma) -> PlaneState:
        """Unstressed bonds of density m_0 on pressure sigma (m,) [Pa]."""
        bonds = np.zeros((4, np.size(sigma)))
        bonds[0] = self.law.initial * sigma
        return PlaneState(bonds, self.law.length)

    def step(self, state: PlaneState, dq, s0, s1, dt: float) -> Step:
        """One leg dq (2,) [m] in dt [s]; new bonds form at the mean pressure of its ends, all are lost where s1 = 0.
        The mean traction is (2, m)."""
        path, _ = direction(dq)
        speed = path / dt if dt > 0 else 0.0
        middle = grow(self.law, state.eps, speed, speed, path / 2, dt / 2)
        out, mean, burnt = advance_plane(state.bonds, dq, (s0 + s1) / 2, middle)
        scale = self.law.static / self.law.length
        lost = s1 <= 0
        spent = scale * (burnt + np.where(lost, out[3], 0.0)) / 2
        return Step(scale * mean, spent, PlaneState(np.where(lost, 0.0, out),
                                                    grow(self.law, state.eps, speed, speed, path, dt)))

    def traction(self, state: PlaneState):
        """tau = mu_s z/eps_0 (2, m) [Pa]."""
        return self.law.static / self.law.length * state.bonds[1:3]

    def stored(self, state: PlaneState):
        """Elastic energy of the bonds per area (m,) [J/m2]."""
        return self.law.static / (2 * self.law.length) * state.bonds[3]
