"""The LuGre law (Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE Trans. Autom. Control 40, 419, 1995).

    g(v) = mu_k N + (mu_s - mu_k) N exp(-(v/v_s)^2),   z' = v - stiffness |v| z/g(v),
    F = stiffness z + micro_damping z' + viscous v

A steady slide has the Stribeck curve F = g(v) sgn v + viscous v. With mu_k = mu_s and neither damping it is Dahl's law,
which is eq. 2.17 in the stretch reading with eps_0 = mu N/stiffness. At the constant speed of a step z relaxes as an
exponential of the path, so a step is exact at any size.
"""

from dataclasses import dataclass

import numpy as np

from ..protocol import Element, Step


@dataclass(frozen=True, slots=True)
class LuGre:
    """Per newton of normal load: mu_s, mu_k, stiffness [1/m], v_s [m/s], micro_damping and viscous [s/m]. All points of
    a contact share z, as all share the slide."""

    static: float
    kinetic: float
    stiffness: float
    speed: float
    micro_damping: float = 0.0
    viscous: float = 0.0

    def element(self, load: float) -> Element:
        """The law of a contact under a constant load [N], as the loops take it (`protocol.Element`), of form "flow"."""
        share = np.array([self.stiffness, self.kinetic, self.static, 0.0, self.micro_damping, self.viscous])
        numbers = np.concatenate([[0.0], load * share])
        numbers[4] = self.speed
        return Element("friction.laws.lugre_kernels", numbers, np.zeros(1), self.static * load,
                       self.static / self.stiffness, False, "flow", (self.static / self.stiffness,))

    def limit(self, speed):
        """g/N [1] at a speed [m/s]: the steady friction force per newton of load, at least 1e-9 mu_s, as z divides by
        it."""
        rise = (self.static - self.kinetic) * np.exp(-(speed / self.speed)**2)
        return np.maximum(self.kinetic + rise, 1e-9 * self.static)

    def start(self, sigma):
        """State (z [m], z' [m/s], speed [m/s], pressure (m,) [Pa]) at rest and unstretched, under sigma (m,) [Pa]."""
        return 0.0, 0.0, 0.0, sigma

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] in dt [s] under a pressure (m,) [Pa] that stays; a jump in no time has the
        kinetic limit and no damping."""
        z, before = state[0], self.stored(state)
        v = dq / dt if dt > 0 else 0.0
        length = self.limit(v if dt > 0 else np.inf) / self.stiffness
        end, x = np.sign(dq) * length, abs(dq) / length
        after = end + (z - end) * np.exp(-x)
        middle = end - (z - end) * np.expm1(-x) / x if x > 0 else z
        rate = (after - z) / dt if dt > 0 else 0.0
        mean = s1 * (self.stiffness * middle + self.micro_damping * rate + self.viscous * v)
        state = after, v - abs(v) * after / length, v, s1
        return Step(mean, mean * dq - (self.stored(state) - before), state)

    def traction(self, state):
        """Traction (m,) [Pa] of a state at the speed of the last step, > 0 against slip towards +x."""
        z, rate, v, sigma = state
        return sigma * (self.stiffness * z + self.micro_damping * rate + self.viscous * v)

    def stored(self, state):
        """Elastic energy per area sigma stiffness z^2/2 (m,) [J/m2] of a state."""
        return state[3] * self.stiffness * state[0]**2 / 2


def from_keys(friction, load: float) -> LuGre:
    """The LuGre law of a [friction] table under a load [N] of the whole contact, to which stiffness and damping refer.

    A load of 0 counts as 1 N. Without a kinetic coefficient it is the static one.
    """
    whole = load or 1.0
    kinetic = friction.static if friction.kinetic is None else friction.kinetic
    return LuGre(friction.static, kinetic, friction.stiffness / whole, friction.stribeck_speed,
                 friction.micro_damping / whole, friction.viscous / whole)
