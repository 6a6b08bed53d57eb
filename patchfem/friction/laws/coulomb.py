"""Coulomb friction under prescribed motion: the traction has the sign of the slip (2.1)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..protocol import Element, LastTraction, Step


@dataclass(frozen=True, slots=True)
class Coulomb(LastTraction):
    """Set-valued kinetic friction under prescribed motion; at rest the last traction is kept.

    `static` is what the contact carries at the instant a rest ends (`breakaway_traction`); it does no work.
    """

    kinetic: float
    static: float | None = None
    has_force_at_rest: ClassVar[bool] = True  # the last traction at rest

    def element(self, load: float) -> Element:
        """Return the Element of a contact under a constant load [N]: static and kinetic force.

        It has no kernels, because a set-valued law has no slope.
        """
        static = self.kinetic if self.static is None else self.static
        return Element(
            "", np.array([0.0, static * load, self.kinetic * load]), np.zeros(1), static * load
        )

    def limit_fraction(self, dq, dt):
        """Return the fraction of the limit that is carried in increments dq [m]; 0 at rest."""
        return np.sign(dq)

    def limit(self, sigma, way: float):
        """Return the largest traction mu_k sigma (m,) [Pa] of a motion of either sign."""
        return self.kinetic * sigma

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """Advance by a straight increment dq [m] while the pressure changes from s0 to s1 (m,) [Pa].

        dt is not used.

        The mean traction is mu_k (s0 + s1)/2 sgn dq and all work is dissipated. At dq = 0 the last traction is kept.
        """
        if dq == 0:
            return Step(state, np.zeros_like(s0), state)
        mean = self.kinetic * (s0 + s1) / 2 * np.sign(dq)
        return Step(mean, mean * dq, self.kinetic * s1 * np.sign(dq))

    def breakaway_traction(self, sigma, direction: float):
        """Return the traction mu_s sigma (m,) [Pa] at the instant at which a rest ends.

        direction: sign of the motion.
        """
        return (self.kinetic if self.static is None else self.static) * sigma * direction


def from_keys(friction, load: float) -> Coulomb:
    """Return Coulomb's law of a [friction] table; load [N] is not used.

    Without a kinetic coefficient the static one is used.
    """
    return Coulomb(
        friction.static if friction.kinetic is None else friction.kinetic, friction.static
    )
