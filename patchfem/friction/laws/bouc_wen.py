"""The Bouc-Wen law (Wen, J. Eng. Mech. Div. ASCE 102, 249, 1976) with its limit mu N and its first slope as numbers.

    F = mu N z,    z' = v/eps (1 - |z|^n (s sgn(v z) + 1 - s)),    eps = mu N/stiffness

n is the sharpness of the knee, s the share of the two terms: on unloading the slope over the first one is 1 - (1 - 2 s)
|z|^n, so it rests on the elastic line for s = 1/2. n = 1, s = 1 is eq. 2.17 in the stretch reading. With the energy of
the spring, F^2/(2 stiffness), no step creates energy where s >= 1/2; below that unloading gives back more than it.
"""

from dataclasses import dataclass

import numpy as np

from ..protocol import Element, Step

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)
PIECES = 10  # of the integrals of a stroke


@dataclass(frozen=True, slots=True)
class BoucWen:
    """The Bouc-Wen law as a law object: mu [1], eps [m], exponent n and shape s of the module's equation.

    All points of a contact share z, as all share the slide. The pressure must stay constant. Compiled twin:
    `bouc_wen_kernels`.
    """

    static: float
    length: float
    exponent: float = 1.0
    shape: float = 0.5

    def element(self, load: float) -> Element:
        """The law of a contact under a constant load [N], as the loops take it (`protocol.Element`): limit mu N, length
        eps."""
        numbers = np.array([0.0, self.static * load, self.length, self.exponent, self.shape])
        return Element("friction.laws.bouc_wen_kernels", numbers, np.zeros(1), self.static * load, self.length,
                       form="flow", sizes=(1.0,))

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

    def stroke(self, w) -> tuple:
        """(slide [eps], its slope over w, area [mu N eps]) of a stroke between the tips -y and y, w = -ln(1 - y) (...).

        The area is int v (1/(1 - v^n) - 1/(1 - g v^n)) dv, g = 1 - 2 s: what loading takes more than unloading.
        """
        edges = np.linspace(0.0, 1.0, PIECES + 1)
        half = np.diff(edges)[:, None] / 2
        root = (edges[:-1, None] + half * (1 + NODES)).ravel()  # the fourth root, as in `_integral`
        v = w[..., None] * root**4
        rule = w[..., None] * (half * WEIGHTS).ravel() * 4 * root**3
        rise, spent = self._rates(v)
        return (rule * rise).sum(axis=-1), self._rates(w)[0], (rule * spent).sum(axis=-1)

    def _rates(self, w) -> tuple:
        """Slopes over w of the slide [eps] of a stroke, and of its area [mu N eps]."""
        pace, y, give = self._pace(w), -np.expm1(-w), 1 - 2 * self.shape
        power = y**self.exponent
        rest = 1 - give * power
        return 1 / pace + np.exp(-w) / rest, y / pace * power * (1 - give) / rest

    def _pace(self, w):
        """dw/dx of w = -ln(1 - y): (1 - y^n)/(1 - y), between 1 and n."""
        y = -np.expm1(-w)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            pace = -np.expm1(self.exponent * np.where(w < 0.7, np.log(y), np.log1p(-np.exp(-w)))) * np.exp(w)
        return np.where(w > 30.0, self.exponent, pace)  # 1 - y = 1e-13: the pace is n but for that

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


def loop_from_keys(friction, load: float, slide) -> tuple:
    """(force at the turns [N], area [J]) of the steady loops of the law of a [friction] table at amplitudes of the
    slide [m], (...) or a number.

    The tip y is that of a stroke 2 u/eps = int_0^y dv/(1 - (1 - 2 s) v^n) + int_0^y dv/(1 - v^n), which Newton's method
    finds as w = -ln(1 - y). Errors below 1e-12 of force and area to an exponent of 8, 1e-9 to one of 50.
    """
    one, limit = from_keys(friction, load), friction.static * load
    wanted = 2 * np.asarray(slide, float) / one.length
    w = np.minimum(wanted / 2, 1.0)
    for _ in range(200):
        found, slope, area = one.stroke(w)
        step = (found - wanted) / slope
        if np.all(np.abs(step) <= 1e-14 * (1 + w)):
            break
        w = np.maximum(w - step, w / 8)
    return limit * -np.expm1(-w), 2 * limit * one.length * area


def from_keys(friction, load: float) -> BoucWen:
    """The Bouc-Wen law of a [friction] table: eps = mu N/stiffness under a load N [N] of the whole contact, 1 N where
    it is 0."""
    length = friction.static * (load or 1.0) / friction.stiffness
    return BoucWen(friction.static, length, friction.exponent, friction.shape)
