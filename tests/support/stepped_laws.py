"""NumPy twins of the laws of constant load, step by step; the package runs their kernels alone.

Each has start(sigma) -> state, step(state, dq, s0, s1, dt) -> `protocol.Step`, traction(state) and stored(state), as
`friction.protocol` describes, under a pressure (m,) [Pa] that stays; s0 is not used.
"""

import numpy as np

from patchfem.friction.laws.bouc_wen import NODES, WEIGHTS, BoucWen
from patchfem.friction.laws.iwan import Iwan
from patchfem.friction.laws.lugre import LuGre
from patchfem.friction.protocol import Step


class SteppedBoucWen(BoucWen):
    """The Bouc-Wen law; the state is (z [1], pressure [Pa])."""

    def start(self, sigma):
        """State (z [1], pressure (m,) [Pa]) before any motion: z = 0 under the pressure sigma (m,) [Pa]."""
        return 0.0, sigma

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment of slide dq [m] under a pressure (m,) [Pa] that stays; s0 and dt are not used.

        The mean traction is mu s1 int z dq/dq, by the integral of `along`; with dq = 0 it is the traction as it stands.
        """
        way, before = float(np.sign(dq)), self.stored(state)
        end, area = self.along(way * state[0], abs(dq) / self.length)
        after = way * end if dq else state[0], s1
        work = self.static * s1 * self.length * area
        mean = np.divide(work, abs(dq)) * way if dq else self.traction(state)
        return Step(mean, work - (self.stored(after) - before), after)

    def along(self, y: float, x: float) -> tuple:
        """(y, integral of y) [1] after a slide x > 0 in lengths eps, from y = z sgn v.

        Equation: dy/dx = 1 - |y|^n, below zero 1 - (1 - 2 s) |y|^n. It is solved by its inverse function: x as an
        integral over y, which Newton's method turns around.
        """
        area = 0.0
        if y < 0:
            give = 1 - 2 * self.shape
            way = self._integral(lambda u: 1 / (1 - give * u**self.exponent), 0.0, -y)
            if way >= x:
                u = -y
                for _ in range(60):
                    miss = self._integral(lambda v: 1 / (1 - give * v**self.exponent), u, -y) - x
                    u = min(max(u + miss * (1 - give * u**self.exponent), 0.0), -y)
                    if abs(miss) <= 1e-15 * x:
                        break
                return -u, -self._integral(lambda v: v / (1 - give * v**self.exponent), u, -y)
            area, x, y = -self._integral(lambda u: u / (1 - give * u**self.exponent), 0.0, -y), x - way, 0.0
        w = begin = -np.log1p(-min(y, 1 - 1e-16))  # the knee taken out; w has no bound at y = 1
        for _ in range(60):
            miss = self._integral(lambda v: 1 / self._pace(v), begin, w) - x
            w -= miss * self._pace(w)
            if abs(miss) <= 1e-15 * max(x, 1.0):
                break
        return -np.expm1(-w), area + self._integral(lambda v: -np.expm1(-v) / self._pace(v), begin, w)

    @staticmethod
    def _integral(of, a: float, b: float) -> float:
        """Gauss rule on pieces of 1/4, in the fourth root of the place, where powers are smooth down to zero."""
        a, b = a**0.25, b**0.25
        edges = np.linspace(a, b, 1 + max(1, int(np.ceil(16 * abs(b - a)))))
        half = np.diff(edges)[:, None] / 2
        root = edges[:-1, None] + half * (1 + NODES)
        return float(np.sum(half * WEIGHTS * 4 * root**3 * of(root**4)))

    def traction(self, state):
        """Traction mu sigma z (m,) [Pa] of a state, > 0 against slip towards +x."""
        return self.static * state[1] * state[0]

    def stored(self, state):
        """Elastic energy per area mu sigma eps z^2/2 (m,) [J/m2] of a state."""
        return self.static * state[1] * self.length * state[0]**2 / 2


class SteppedLuGre(LuGre):
    """The LuGre law; the state is (z [m], z' [m/s], speed [m/s], pressure [Pa])."""

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


class SteppedIwan(Iwan):
    """Sliders side by side; the state is (their stretch (t,) [m], pressure [Pa])."""

    def start(self, sigma):
        """State (stretch (t,) [m] of the elements, pressure (m,) [Pa]) before any motion: unstretched under sigma (m,)
        [Pa]."""
        return np.zeros(self.yield_slide.size), sigma

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] under a pressure (m,) [Pa] that stays; s0 and dt are not used. The path mean is
        exact."""
        stretch, before = state[0], self.stored(state)
        end = np.clip(stretch + dq, -self.yield_slide, self.yield_slide)
        part = np.divide(end - stretch, dq, out=np.ones_like(end), where=dq != 0)
        mean = s1 * float(self.stiffness @ (part * (stretch + end) / 2 + (1 - part) * end))
        after = end, s1
        return Step(mean, mean * dq - (self.stored(after) - before), after)

    def traction(self, state):
        """Traction (m,) [Pa] of a state, > 0 against slip towards +x."""
        return state[1] * float(self.stiffness @ state[0])

    def stored(self, state):
        """Elastic energy per area (m,) [J/m2] of a state."""
        return state[1] * float(self.stiffness @ state[0]**2) / 2
