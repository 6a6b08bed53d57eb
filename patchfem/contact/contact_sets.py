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

MAX_STORED_BYTES = (
    64e6  # bytes of stored contact sets; when they are full, the oldest set is replaced
)
MAX_SIDES = 16  # sides of a polygon, as in `polygon_kernels`


@dataclass(frozen=True, eq=False, slots=True)
class ContactSet:
    """One contact set, with its forces and gaps as affine functions of the motion.

    - on (m,): whether a node is in contact.
    - rows (3, m): force [N] of nodes in contact and gap [m] of the others, per (1, d, t).
    - energy (6,): energy of the preloaded contact, E - E0 - N0 d + M0 t, as coefficients of 1, d, t, d^2/2,
      d t and t^2/2.
    """

    on: np.ndarray
    rows: np.ndarray
    energy: np.ndarray

    def values(self, d: float, t: float) -> np.ndarray:
        """Return forces [N] of nodes in contact and gaps [m] of the others (m,) at a motion.

        d [m], t [rad]: motion of the holder.
        """
        return self.rows[0] + d * self.rows[1] + t * self.rows[2]

    def forces(self, d: float, t: float) -> np.ndarray:
        """Return the nodal forces (m,) [N] at a motion, with rounding errors below 0 cut off.

        d [m], t [rad]: motion of the holder.
        """
        return np.where(self.on, np.maximum(self.values(d, t), 0.0), 0.0)


class ContactSets:
    """Pressed reference state, around which `press_kernels` searches for contact sets.

    Parameters
    ----------
    c : (m, m) ndarray
        Compliance [m/N].
    x : (m,) ndarray
        Positions [m].
    opening : (m,) ndarray
        Openings g + theta0 x - delta0 [m] of the state without forces, negative where the pieces would overlap.
    on : (m,) bool ndarray
        Contact set of the state.

    Raises
    ------
    PatchfemError
        If the state carries no load.
    """

    def __init__(self, c, x, opening, on):
        self.c = frozen_array(c)
        self.x = frozen_array(x)
        self.opening = frozen_array(opening)
        self.load = 0.0
        self.moment = 0.0
        self.energy = 0.0
        self.size = float(np.abs(self.opening).max())
        found = self._make_set(np.asarray(on, bool))
        force = found.forces(0.0, 0.0)
        self.load = float(force.sum())
        self.moment = float(force @ self.x)
        self.energy = float(found.energy[0])
        self.size += float(np.abs(self.c @ force).max())
        if not self.load > 0:
            raise PatchfemError(
                "contact: the motion must start from a loaded contact; raise contact.load"
            )
        self.reference = self._make_set(found.on)

    def _make_set(self, on) -> ContactSet:
        index = np.flatnonzero(on)
        right = np.stack([self.opening, -np.ones(self.x.size), self.x], axis=1)
        force = np.zeros_like(right)
        if index.size:
            low = cho_factor(self.c[np.ix_(index, index)], lower=True)
            for _ in range(2):  # the second pass is one step of iterative refinement
                force[index] -= cho_solve(low, (right + self.c @ force)[index])
        rows = np.where(on[:, None], force, right + self.c @ force).T
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
        return ContactSet(frozen_array(on, bool), frozen_array(rows), frozen_array(energy))

    def arrays(self, max_bytes: float = MAX_STORED_BYTES) -> dict:
        """Return empty arrays of `press_kernels.SetArrays`, with the reference set in `wanted`.

        room: size of the contact sets that can be stored [bytes].
        """
        m = self.x.size
        # 25 m + 400 bytes: rows, set, polygon and names of one set
        count = int(max(16, min(max_bytes / (25 * m + 400), 100_000)))
        names = np.random.default_rng(5).integers(-(2**63), 2**63, m, dtype=np.int64)
        return {
            "c": self.c.copy(),
            "x": self.x.copy(),
            "b": self.opening.copy(),
            "tableau": np.zeros((m, m + 3)),
            "here": np.zeros(m, bool),
            "rows": np.zeros((count, 3, m)),
            "on": np.zeros((count, m), bool),
            "energy": np.zeros((count, 6)),
            "names": np.zeros(count, np.int64),
            "heads": np.full(1 << int(count).bit_length(), -1, np.int64),
            "link": np.zeros(count, np.int64),
            "node": names,
            "wanted": self.reference.on.copy(),
            "base": np.array(
                [self.load, self.moment, self.energy, self.size, self.reference.energy[3]]
            ),
            "side": np.zeros((2, 3, m)),
            "row": np.zeros(m + 3),
            "meta": np.zeros(5, np.int64),
            **make_empty_polygons(count),
        }

    def name(self, arrays: dict) -> int:
        """Return the 64-bit name of the reference set: the exclusive or of the names of its nodes."""
        return int(np.bitwise_xor.reduce(arrays["node"][self.reference.on], initial=0))


def make_empty_polygons(count: int) -> dict:
    """Return the empty polygon arrays of `press_kernels.SetArrays` for `count` contact sets."""
    return {
        "sides": np.zeros(count, np.int64),
        "edge": np.zeros((count, MAX_SIDES), np.int64),
        "beside": np.zeros((count, MAX_SIDES), np.int64),
        "limit": np.zeros((count, 2)),
        "corner": np.zeros((2, 3, 4 * MAX_SIDES)),
    }
