"""Coulomb friction under prescribed motion: the traction has the sign of the slip (2.1)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..protocol import Element, Step


@dataclass(frozen=True, slots=True)
class Coulomb:
    """Set-valued kinetic friction under prescribed motion; at rest the last traction is kept.

    `static` is what the contact carries at the instant a rest ends (`breaking`); it does no work.
    """

    kinetic: float
    static: float | None = None
    at_once: ClassVar[bool] = True  # nothing stretches: a changing load is taken along with the motion
    holds: ClassVar[bool] = True  # the last traction at rest

    def element(self, load: float) -> Element:
        """The law of a contact under a constant load [N]: no kernels with a slope."""
        static = self.kinetic if self.static is None else self.static
        return Element("", np.array([0.0, static * load, self.kinetic * load]), np.zeros(1), static * load)

    def start(self, sigma):
        """State: the last traction (m,) [Pa], 0 before any motion."""
        return np.zeros_like(sigma)

    def share(self, dq, dt):
        """Share [1] of the limit that is carried in increments dq [m] of any duration; 0 at rest."""
        return np.sign(dq)

    def limit(self, sigma, way: float):
        """Largest traction (m,) [Pa] of a motion of either sign."""
        return self.kinetic * sigma

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] under pressure s0 -> s1 (m,) [Pa]."""
        if dq == 0:
            return Step(state, np.zeros_like(s0), state)
        mean = self.kinetic * (s0 + s1) / 2 * np.sign(dq)
        return Step(mean, mean * dq, self.kinetic * s1 * np.sign(dq))

    def press(self, state, s0, s1) -> Step:
        """The pressure at rest goes from s0 to s1 (m,) [Pa]; mean: the traction after it."""
        held = np.clip(state, -self.kinetic * s1, self.kinetic * s1)
        return Step(held, np.zeros_like(held), held)

    def breaking(self, sigma, direction: float):
        """Traction (m,) [Pa] under sigma at the instant a rest ends in a motion of this sign."""
        return (self.kinetic if self.static is None else self.static) * sigma * direction

    def traction(self, state):
        """Traction (m,) [Pa] at the end of the last step."""
        return state

    def stored(self, state):
        """Elastic energy per area (m,) [J/m2]: none."""
        return np.zeros_like(state)


def from_keys(friction, load: float) -> Coulomb:
    """The law of a [friction] table."""
    return Coulomb(friction.static if friction.kinetic is None else friction.kinetic, friction.static)
