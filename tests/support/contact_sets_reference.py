"""Search for contact sets with NumPy: the reference for the compiled search in `contact.press_kernels`."""

import numpy as np

from patchfem.contact import contact_sets
from patchfem.contact.contact_sets import ROOM, ContactSet
from patchfem.contact.unilateral import solve_forces
from patchfem.core import NotConverged

NOISE = 1e-13  # relative to the largest term; smaller violations are round-off
MAX_BLOCK_EXCHANGES = 12  # exchanges of all failing nodes at once, before Murty's exchange of a single node


class ContactSets(contact_sets.ContactSets):
    """Contact sets with a search in NumPy; each set that was computed is kept."""

    def __init__(self, c, x, opening, on):
        self.kept = {}
        super().__init__(c, x, opening, on)
        self.reference = self.contact_set(self.reference.on)

    def contact_set(self, on: np.ndarray) -> ContactSet:
        """Return the contact set of the touching nodes `on` (m,) bool; compute it at the first request.

        The oldest set is dropped where all sets together need more than `ROOM` bytes.
        """
        key = on.tobytes()
        if key not in self.kept:
            if len(self.kept) * 3 * on.size * 8 > ROOM:
                self.kept.pop(next(iter(self.kept)))
            self.kept[key] = self._made(on)
        return self.kept[key]

    def at(self, d: float, t: float, start: ContactSet | None = None) -> ContactSet:
        """Find the contact set at an approach d [m] and a rotation t [rad] relative to the reference.

        The search starts from `start` (None: the reference). It exchanges all nodes that violate the contact
        conditions, and after `MAX_BLOCK_EXCHANGES` exchanges only the first one, which terminates for every positive
        definite compliance (Murty 1974). If that fails, `unilateral.solve_forces` gives the set. The compiled form is
        `press_kernels.locate`.

        Raises
        ------
        NotConverged
            If no set satisfies the contact conditions.
        """
        touching = self.reference if start is None else start
        for count in range(MAX_BLOCK_EXCHANGES + 10 * self.x.size):
            value = touching.values(d, t)
            terms = np.abs(touching.rows[0]) + np.abs(d * touching.rows[1]) + np.abs(t * touching.rows[2])
            least = np.where(touching.on, NOISE * terms[touching.on].max(initial=0.0),
                             NOISE * (self.size + abs(d) + abs(t) * np.abs(self.x[[0, -1]]).max()))
            fails = value < -least
            if not fails.any():
                return touching
            if count >= MAX_BLOCK_EXCHANGES:
                fails &= np.cumsum(fails) == 1
            touching = self.contact_set(touching.on != fails)
        force, _, _ = solve_forces(self.c, self.x, self.opening - d + t * self.x, np.zeros(0))
        touching = self.contact_set(force > 0)
        if self.flaw(touching, d, t) > 1e-12:  # as `unilateral.SOLVED`
            raise NotConverged("contact: no set of touching nodes satisfies the contact conditions during the motion; "
                               "raise the load or check the mesh")
        return touching

    def flaw(self, touching: ContactSet, d: float, t: float) -> float:
        """Return the largest relative violation of the contact conditions at (d, t).

        Gaps are relative to the size of the openings, tensile forces to the load.
        """
        force = np.where(touching.on, touching.values(d, t), 0.0)
        opening = self.opening - d + t * self.x + self.c @ force
        size = self.size + abs(d) + abs(t) * np.abs(self.x[[0, -1]]).max()
        pulls = max(-force.min(initial=0.0), 0.0) / max(np.abs(force).sum(), 1e-300)
        return float(max(np.abs(opening[touching.on]).max(initial=0.0) / size, -opening.min(initial=0.0) / size, pulls))
