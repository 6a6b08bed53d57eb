"""The Bouc-Wen law (Wen, J. Eng. Mech. Div. ASCE 102, 249, 1976).

    F = mu N z,    z' = v/eps (1 - |z|^n (s sgn(v z) + 1 - s)),    eps = mu N/stiffness

n is the sharpness of the knee, s weights the two terms: on unloading the slope over the first one is 1 - (1 - 2 s)
|z|^n, so it rests on the elastic line for s = 1/2. n = 1, s = 1 is eq. 2.17 with reading="stretch". With the energy of
the spring, F^2/(2 stiffness), no step creates energy where s >= 1/2; below that unloading gives back more than it.
"""

from dataclasses import dataclass

import numpy as np

from ..protocol import Element

GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(20)
N_PIECES = 10  # number of pieces for the integrals over a stroke


@dataclass(frozen=True, slots=True)
class BoucWen:
    """Bouc-Wen law object: mu [1], eps [m], and n and s of the equation of the module.

    All points of a contact have the same z. The pressure must stay constant. `bouc_wen_kernels` steps
    it.
    """

    static: float
    length: float
    exponent: float = 1.0
    shape: float = 0.5

    def element(self, load: float) -> Element:
        """Return the `protocol.Element` under a constant load [N], with limit mu N and length eps."""
        numbers = np.array([0.0, self.static * load, self.length, self.exponent, self.shape])
        return Element(
            "friction.laws.bouc_wen_kernels",
            numbers,
            np.zeros(1),
            self.static * load,
            self.length,
            form="flow",
            state_scales=(1.0,),
        )

    def stroke(self, w) -> tuple:
        """Return displacement [eps], its derivative over w, and area [mu N eps] of a stroke.

        The stroke goes from -y to y, with w = -ln(1 - y) of any shape.

        The area is int v (1/(1 - v^n) - 1/(1 - g v^n)) dv, g = 1 - 2 s: the excess of loading over unloading.
        """
        edges = np.linspace(0.0, 1.0, N_PIECES + 1)
        half = np.diff(edges)[:, None] / 2
        # Gauss rule in the fourth root of v, where powers of v are smooth down to zero
        root = (edges[:-1, None] + half * (1 + GAUSS_POINTS)).ravel()
        v = w[..., None] * root**4
        rule = w[..., None] * (half * GAUSS_WEIGHTS).ravel() * 4 * root**3
        rise, spent = self._rates(v)
        return (rule * rise).sum(axis=-1), self._rates(w)[0], (rule * spent).sum(axis=-1)

    def _rates(self, w) -> tuple:
        """Return the derivatives of displacement [eps] and area [mu N eps] of a stroke over w."""
        pace, y, give = self._pace(w), -np.expm1(-w), 1 - 2 * self.shape
        power = y**self.exponent
        rest = 1 - give * power
        return 1 / pace + np.exp(-w) / rest, y / pace * power * (1 - give) / rest

    def _pace(self, w):
        """Return dw/dx of w = -ln(1 - y): (1 - y^n)/(1 - y), between 1 and n."""
        y = -np.expm1(-w)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            pace = -np.expm1(
                self.exponent * np.where(w < 0.7, np.log(y), np.log1p(-np.exp(-w)))
            ) * np.exp(w)
        # beyond w = 30, 1 - y is below 1e-13 and the rate is n to round-off
        return np.where(w > 30.0, self.exponent, pace)


def loop_from_keys(friction, load: float, slide) -> tuple:
    """Return force at the reversals [N] and area [J] of steady loops of the Bouc-Wen law.

    slide: displacement amplitudes [m] of any shape. The tip y is that of a stroke 2 u/eps = int_0^y dv/(1 - (1 - 2 s)
    v^n) + int_0^y dv/(1 - v^n), which Newton's method finds as w = -ln(1 - y). Errors below 1e-12 of force and area to
    an exponent of 8, 1e-9 to one of 50.
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
    """Return the Bouc-Wen law of a [friction] table under a load N [N] of the whole contact.

    eps = mu N/stiffness; a load of 0 counts as 1 N.
    """
    length = friction.static * (load or 1.0) / friction.stiffness
    return BoucWen(friction.static, length, friction.exponent, friction.shape)
