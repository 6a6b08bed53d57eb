"""Rate law of eq. 2.4: friction depends on the slip velocity and is zero at rest."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class TanhLaw:
    """Rate law tau = mu sigma tanh(v/v_0) (eq. 2.4) at each point, for the mean velocity of a step.

    It never sticks: under a constant fraction f of the limit it creeps at v_0 atanh(f).

    - static: mu [1]
    - speed: v_0 [m/s]
    """

    static: float
    speed: float

    @property
    def length(self) -> float:
        """Stretch before slip [m]: a function of the velocity has none."""
        return 0.0

    def limit_fraction(self, dq, dt):
        """Return the ratio of the friction force to its limit for increments dq [m] during dt [s].

        For dt = 0 it is the sign of dq, because the velocity is infinite.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            fraction = np.tanh(np.divide(dq, dt) / self.speed)
        return np.where(np.greater(dt, 0), fraction, np.sign(dq))[()]


def from_keys(friction, load: float) -> TanhLaw:
    """Return the rate law that a [friction] table defines; load [N] is not used."""
    return TanhLaw(friction.static, friction.reference_speed)
