"""Rate law of eq. 2.4: friction depends on the slip velocity and is zero at rest."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..protocol import Element, LastTraction, Step


@dataclass(frozen=True, slots=True)
class TanhLaw(LastTraction):
    """Rate law tau = mu sigma tanh(v/v_0) (eq. 2.4) at each point, for the mean velocity of a step.

    It never sticks: under a constant fraction f of the limit it creeps at v_0 atanh(f).

    - static: mu [1]
    - speed: v_0 [m/s]
    """

    static: float
    speed: float
    has_force_at_rest: ClassVar[bool] = False

    def element(self, load: float) -> Element:
        """Return the `protocol.Element` of a contact under a constant load [N], of form "speed"."""
        return Element(
            "friction.laws.tanh_kernels",
            np.array([0.0, self.static * load, 1 / self.speed]),
            np.zeros(0),
            self.static * load,
            form="speed",
        )

    def limit_fraction(self, dq, dt):
        """Return the ratio of the friction force to its limit for increments dq [m] during dt [s].

        For dt = 0 it is the sign of dq, because the velocity is infinite.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            fraction = np.tanh(np.divide(dq, dt) / self.speed)
        return np.where(np.greater(dt, 0), fraction, np.sign(dq))[()]

    def limit(self, sigma, direction: float):
        """Return the largest traction mu sigma (m,) [Pa], which is equal in both directions."""
        return self.static * sigma

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """Advance the rate law by an increment at mean velocity and pressure; all work is dissipated.

        Parameters
        ----------
        state : (m,) array
            Last traction [Pa].
        dq : float
            Increment [m].
        s0, s1 : (m,) array
            Pressures [Pa] at the ends.
        dt : float
            Duration [s].

        Returns
        -------
        Step
        """
        fraction = self.limit_fraction(dq, dt)
        mean = self.static * (s0 + s1) / 2 * fraction
        return Step(mean, mean * dq, self.static * s1 * fraction)


def from_keys(friction, load: float) -> TanhLaw:
    """Return the rate law that a [friction] table defines; load [N] is not used."""
    return TanhLaw(friction.static, friction.reference_speed)
