"""Coulomb friction under prescribed motion: the sign of the traction is that of the slip (eq. 2.1)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..protocol import Element, LastTraction, Step


@dataclass(frozen=True, slots=True)
class Coulomb(LastTraction):
    """Coulomb's law of kinetic friction; at rest, the last traction is kept.

    - kinetic: coefficient mu_k of the motion
    - static: coefficient mu_s of the traction at the instant at which a rest ends, which does no work; None for mu_k
    """

    kinetic: float
    static: float | None = None
    has_force_at_rest: ClassVar[bool] = True  # the traction persists while the interface rests

    @property
    def _static_coefficient(self) -> float:
        return self.kinetic if self.static is None else self.static

    def element(self, load: float) -> Element:
        """Return the Element under a constant load [N], with the static and kinetic friction force."""
        limit = self._static_coefficient * load
        return Element(
            "", np.array([0.0, limit, self.kinetic * load]), np.zeros(1), limit, form="rigid"
        )

    def limit_fraction(self, dq, dt):
        """Return the ratio of the friction force to its limit for increments dq [m]; 0 at rest."""
        return np.sign(dq)

    def limit(self, sigma, direction: float):
        """Return the sliding traction mu_k sigma (m,) [Pa], which is equal in both directions."""
        return self.kinetic * sigma

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """Advance Coulomb's law by an increment, with mean traction mu_k (s0 + s1)/2 sgn dq.

        All work is dissipated. Without motion the last traction stays.

        Parameters
        ----------
        state : (m,) array
            Last traction [Pa].
        dq : float
            Increment [m].
        s0, s1 : (m,) array
            Pressures [Pa] at the ends.
        dt : float
            Not used.

        Returns
        -------
        Step
        """
        if dq == 0:
            return Step(state, np.zeros_like(s0), state)
        mean = self.kinetic * (s0 + s1) / 2 * np.sign(dq)
        return Step(mean, mean * dq, self.kinetic * s1 * np.sign(dq))

    def static_traction(self, sigma, direction: float):
        """Return the traction mu_s sigma (m,) [Pa] at the instant at which sliding starts.

        direction: sign of the motion.
        """
        return self._static_coefficient * sigma * direction


def from_keys(friction, load: float) -> Coulomb:
    """Return Coulomb's law with the coefficients in a [friction] table; load [N] is not used.

    Without a kinetic coefficient the static one is used.
    """
    kinetic = friction.static if friction.kinetic is None else friction.kinetic
    return Coulomb(kinetic, friction.static)
