"""Contact sets: normal contact as a piecewise linear function of the holder's motion.

The motion consists of the approach delta and the rotation theta. The unilateral contact of `unilateral`, w = g + theta
x - delta + C f >= 0, f >= 0, f . w = 0, is affine in (delta, theta) as long as its set of touching nodes stays. So the
plane falls into convex polygons, one for each contact set. Motions are measured from a solved reference state: d = delta
- delta0, t = theta - theta0.

The energy E = f . C f/2 is convex and has the slopes dE/d(delta) = N and dE/d(theta) = -M, M = sum f x, across the
borders of the polygons as well. So the forces give back the energy that they took.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ..core import PatchfemError, frozen_array
from .set_arrays import SetArrays, make_set_arrays


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
        self.in_contact = frozen_array(in_contact, bool)

        # The forces in contact that close the openings
        index = np.flatnonzero(in_contact)
        response = np.zeros(self.x.size)
        if index.size:
            low = cho_factor(self.c[np.ix_(index, index)], lower=True)
            for _ in range(2):  # the second pass is one step of iterative refinement
                response[index] += cho_solve(low, (self.opening - self.c @ response)[index])

        # A node of the set may carry a rounding error below zero
        force = np.maximum(-response, 0.0)
        self.force = frozen_array(force)
        self.load = float(force.sum())
        if not self.load > 0:
            raise PatchfemError(
                "contact: the motion must start from a loaded contact; raise contact.load"
            )
        self.moment = float(force @ self.x)
        self.energy = float(response @ self.opening) / 2
        self.size = float(np.abs(self.opening).max() + np.abs(self.c @ force).max())

    def make_arrays(self, max_bytes: float = 64e6) -> SetArrays:
        """Return the arrays in which compiled code searches contact sets, starting from the preloaded one.

        `max_bytes` is the largest memory for the stored contact sets [bytes]; when it is full, the oldest one is replaced.
        """
        # One set takes 25 m + 80 bytes: unknowns, nodes, energy and names.
        # Largest number of stored contact sets; no problem needs more
        n_slots = int(max(16, min(max_bytes / (25 * self.x.size + 80), 100_000)))
        return make_set_arrays(
            self.c,
            self.x,
            self.opening,
            (self.load, self.moment, self.energy, self.size),
            self.in_contact,
            n_slots,
        )
