"""The Bouc-Wen law (Wen, J. Eng. Mech. Div. ASCE 102, 249, 1976).

    F = mu N z,    z' = v/eps (1 - |z|^n (s sgn(v z) + 1 - s)),    eps = mu N/stiffness

n is the sharpness of the knee and s the weight of the two terms. On unloading the slope is 1 - (1 - 2 s) |z|^n of the
initial slope, so it is the elastic line for s = 1/2. With n = 1 and s = 1 the law is eq. 2.17 with reading="stretch".
The stored energy is that of the spring, F^2/(2 stiffness). No step creates energy for s >= 1/2; for a smaller s
unloading gives back more than the stored energy.
"""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from ..protocol import SteadyLoop


class _HalfLoop(NamedTuple):
    """Half of a steady Bouc-Wen loop, between the states -y and y.

    - displacement: of the stroke [eps]
    - displacement_by_w: its derivative with respect to w
    - area: area [mu N eps] between loading and unloading
    """

    displacement: np.ndarray
    displacement_by_w: np.ndarray
    area: np.ndarray


@dataclass(frozen=True, slots=True)
class BoucWen:
    """Bouc-Wen law under a constant pressure; the state z is the same at all points of a contact.

    - static: mu [1]
    - length: eps [m]
    - exponent, shape: n and s in the equation of the module
    """

    static: float
    length: float
    exponent: float = 1.0
    shape: float = 0.5

    def steady_loop(self, load: float, amplitude) -> SteadyLoop:
        """Return the steady loops under a load [N] at amplitudes u [m] of the relative displacement.

        The tip y is that of the displacement 2 u/eps = int_0^y dv/(1 - (1 - 2 s) v^n) + int_0^y dv/(1 - v^n). Newton's
        method solves for w = -ln(1 - y). The relative errors are below 1e-12 for an exponent up to 8, and 1e-9 up to 50.
        """
        limit = self.static * load
        target = 2 * np.asarray(amplitude, float) / self.length
        w = np.minimum(target / 2, 1.0)
        # Largest number of Newton iterations for the tip of a loop
        for _ in range(200):
            half_loop = self._half_loop(w)
            step = (half_loop.displacement - target) / half_loop.displacement_by_w
            # Largest change of w, relative to 1 + w, at which Newton's method has converged
            if np.all(np.abs(step) <= 1e-14 * (1 + w)):
                break
            w = np.maximum(w - step, w / 8)
        return SteadyLoop(limit * -np.expm1(-w), 2 * limit * self.length * half_loop.area)

    def _half_loop(self, w) -> _HalfLoop:
        """Integrate the half-loop from -y to y, where w = -ln(1 - y) is an array of any shape.

        The area is the integral of v (1/(1 - v^n) - 1/(1 - (1 - 2 s) v^n)) from 0 to y.
        """
        points, weights = _gauss_rule()
        v = w[..., None] * points
        displacement_by_w, area_by_w = self._rates(v)
        weights = w[..., None] * weights
        displacement = (weights * displacement_by_w).sum(axis=-1)
        return _HalfLoop(displacement, self._rates(w)[0], (weights * area_by_w).sum(axis=-1))

    def _rates(self, w) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of the displacement [eps] and the area [mu N eps] with respect to w."""
        rate = self._loading_rate(w)
        y = -np.expm1(-w)
        unloading = 1 - 2 * self.shape
        power = y**self.exponent
        slope = 1 - unloading * power
        return 1 / rate + np.exp(-w) / slope, y / rate * power * (1 - unloading) / slope

    def _loading_rate(self, w):
        """Return dw/dx = (1 - y^n)/(1 - y), where w = -ln(1 - y); its value is between 1 and n."""
        y = -np.expm1(-w)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            log_y = np.where(w < 0.7, np.log(y), np.log1p(-np.exp(-w)))
            rate = -np.expm1(self.exponent * log_y) * np.exp(w)
        # Value of w = -ln(1 - y) from which 1 - y is below 1e-13 and dw/dx equals n to round-off
        return np.where(w > 30.0, self.exponent, rate)


@cache
def _gauss_rule() -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss points and weights on (0, 1) for the substitution x = r^4.

    Fractional powers of x are smooth functions of r.
    """
    # Number of Gauss points on each piece of a half-loop
    points, weights = np.polynomial.legendre.leggauss(20)
    # Number of pieces for the integrals over a half-loop
    edges = np.linspace(0.0, 1.0, 10 + 1)
    half = np.diff(edges)[:, None] / 2
    root = (edges[:-1, None] + half * (1 + points)).ravel()
    return root**4, (half * weights).ravel() * 4 * root**3


def from_keys(friction, load: float) -> BoucWen:
    """Return the Bouc-Wen law defined by a [friction] table, for a load N [N] on the whole contact.

    The bond length is mu N/stiffness.
    """
    length = friction.static * load / friction.stiffness
    return BoucWen(friction.static, length, friction.exponent, friction.shape)
