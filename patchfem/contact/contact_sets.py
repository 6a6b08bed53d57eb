"""Contact sets: normal contact as a piecewise linear function of the holder's motion.

The motion consists of the approach delta and the rotation theta. The unilateral contact of `unilateral`, w = g + theta
x - delta + C f >= 0, f >= 0, f . w = 0, is affine in (delta, theta) as long as its set of touching nodes stays. So the
plane falls into convex polygons, one for each contact set. Motions are measured from a solved reference state: d = delta
- delta0, t = theta - theta0.

The energy E = f . C f/2 is convex and has the slopes dE/d(delta) = N and dE/d(theta) = -M, M = sum f x, across the
borders of the polygons as well. So the forces give back the energy that they took.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ..core import PatchfemError, frozen_array
from .set_arrays import SetArrays, make_set_arrays

# Largest memory [bytes] of the stored contact sets; when it is full, the oldest set is replaced
MAX_STORED_BYTES = 64e6
MAX_SLOTS = 100_000  # largest number of stored contact sets; no problem needs more


@dataclass(frozen=True, eq=False, slots=True)
class ContactSet:
    """Set of nodes in contact, with forces and gaps as linear functions of the rigid displacement.

    - in_contact (m,): whether a node is in contact.
    - unknowns (3, m): force [N] of nodes in contact and gap [m] of the others, coefficients of 1, d, t.
    - energy (6,): energy of the preloaded contact, E - E0 - N0 d + M0 t, as coefficients of 1, d, t, d^2/2,
      d t and t^2/2.
    """

    in_contact: np.ndarray
    unknowns: np.ndarray
    energy: np.ndarray

    def values(self, d: float, t: float) -> np.ndarray:
        """Return the forces [N] at nodes in contact and the gaps [m] at other nodes.

        d [m], t [rad]: motion of the holder.
        """
        return self.unknowns[0] + d * self.unknowns[1] + t * self.unknowns[2]

    def forces(self, d: float, t: float) -> np.ndarray:
        """Return the nodal forces (m,) [N] at a rigid displacement, with negative round-off set to 0.

        d [m], t [rad]: motion of the holder.
        """
        return np.where(self.in_contact, np.maximum(self.values(d, t), 0.0), 0.0)


class ContactSets:
    """Preloaded contact from which a compiled search for contact sets starts.

    Parameters
    ----------
    c : (m, m) ndarray
        Compliance [m/N].
    x : (m,) ndarray
        Positions [m].
    opening : (m,) ndarray
        Openings g + theta0 x - delta0 [m] of the state without forces, negative where the pieces would overlap.
    in_contact : (m,) bool ndarray
        Contact set of the state.

    Raises
    ------
    PatchfemError
        If the state carries no load.
    """

    def __init__(self, c, x, opening, in_contact):
        self.c = frozen_array(c)
        self.x = frozen_array(x)
        self.opening = frozen_array(opening)
        self.load = 0.0
        self.moment = 0.0
        self.energy = 0.0
        self.size = float(np.abs(self.opening).max())
        reference = self._make_set(np.asarray(in_contact, bool))
        force = reference.forces(0.0, 0.0)
        self.load = float(force.sum())
        self.moment = float(force @ self.x)
        self.energy = float(reference.energy[0])
        self.size += float(np.abs(self.c @ force).max())
        if not self.load > 0:
            raise PatchfemError(
                "contact: the motion must start from a loaded contact; raise contact.load"
            )
        self.reference = self._make_set(reference.in_contact)

    def _make_set(self, in_contact) -> ContactSet:
        """Compute forces and gaps as linear functions for given nodes (m,) in contact."""
        index = np.flatnonzero(in_contact)
        right = np.stack([self.opening, -np.ones(self.x.size), self.x], axis=1)
        force = np.zeros_like(right)
        if index.size:
            low = cho_factor(self.c[np.ix_(index, index)], lower=True)
            for _ in range(2):  # the second pass is one step of iterative refinement
                force[index] -= cho_solve(low, (right + self.c @ force)[index])
        unknowns = np.where(in_contact[:, None], force, right + self.c @ force).T
        square = -(force.T @ right)
        square = (square + square.T) / 2
        energy = np.array(
            [
                square[0, 0] / 2 - self.energy,
                square[0, 1] - self.load,
                square[0, 2] + self.moment,
                square[1, 1],
                square[1, 2],
                square[2, 2],
            ]
        )
        return ContactSet(
            frozen_array(in_contact, bool), frozen_array(unknowns), frozen_array(energy)
        )

    def make_arrays(self, max_bytes: float = MAX_STORED_BYTES) -> SetArrays:
        """Return the arrays in which compiled code searches contact sets, starting from the preloaded one.

        max_bytes: size of the contact sets that can be stored [bytes].
        """
        # One set takes 25 m + 400 bytes: unknowns, nodes, polygon and names.
        n_slots = int(max(16, min(max_bytes / (25 * self.x.size + 400), MAX_SLOTS)))
        stiffness = self.reference.energy[3]
        return make_set_arrays(
            self.c,
            self.x,
            self.opening,
            (self.load, self.moment, self.energy, self.size, stiffness),
            self.reference.in_contact,
            n_slots,
        )
