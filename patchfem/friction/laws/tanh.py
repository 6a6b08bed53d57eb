"""The rate law of eq. 2.4: friction that follows the slip speed and never holds."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..protocol import Element, LastTraction, Step


@dataclass(frozen=True, slots=True)
class Rate(LastTraction):
    """Eq. 2.4 per point: tau = mu sigma tanh(v/v_0), taken at the mean speed of a step. It never holds: under a steady
    share f of the limit it creeps at v_0 atanh(f)."""

    static: float
    speed: float
    holds: ClassVar[bool] = False

    def element(self, load: float) -> Element:
        """The law of a contact under a constant load [N], as the loops take it (`protocol.Element`), of form
        "speed"."""
        return Element(
            "friction.laws.tanh_kernels",
            np.array([0.0, self.static * load, 1 / self.speed]),
            np.zeros(0),
            self.static * load,
            form="speed",
            sizes=(),
        )

    def share(self, dq, dt):
        """Share [1] of the limit that is carried in increments dq [m] over dt [s]; a jump in no time has no speed
        limit."""
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.tanh(np.divide(dq, dt) / self.speed)
        return np.where(np.greater(dt, 0), part, np.sign(dq))[()]

    def limit(self, sigma, way: float):
        """Largest traction mu sigma (m,) [Pa], >= 0, of a motion of either sign under a pressure sigma (m,) [Pa]."""
        return self.static * sigma

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] in dt [s] under a pressure that goes from s0 to s1 (m,) [Pa] (eq. 2.4).

        The mean traction is that of the mean speed and the mean pressure of the step; all work is dissipated.
        """
        part = self.share(dq, dt)
        mean = self.static * (s0 + s1) / 2 * part
        return Step(mean, mean * dq, self.static * s1 * part)


def from_keys(friction, load: float) -> Rate:
    """The rate law of a [friction] table; load [N] is not used."""
    return Rate(friction.static, friction.reference_speed)
