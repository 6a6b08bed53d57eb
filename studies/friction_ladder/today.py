"""The hysteresis laws in use beside the ladder: Iwan's parallel elements, Bouc-Wen and a rate law, on one bond scale.

Slides in bond lengths, forces in shares of mu N. Iwan and Bouc-Wen have the stiffness mu N/eps_0 and the limit mu N of
the constant bond length, the rate law only its limit.
"""

import numpy as np
from scipy.optimize import minimize_scalar


def iwan_elements(count: int, scale: float = 1.0) -> tuple:
    """Return stiffness and yield slide, (count,) each, of Jenkins elements with the virgin curve 1 - exp(-x/scale).

    Minus its second derivative is the stiffness per yield slide s of a population, exp(-s) ds. An element takes over
    stiffness and force of its share of s: a chain of tangents, with limit and first stiffness exact. The shares are
    cut so that the error is even.
    """
    cuts = -2 * np.log1p(-np.arange(count) / count)
    left = np.append(np.exp(-cuts), 0.0)  # stiffness of all elements beyond a cut
    force = np.append((1 + cuts) * left[:-1], 0.0)
    stiffness = left[:-1] - left[1:]
    return stiffness / scale, scale * (force[:-1] - force[1:]) / stiffness


def bouc_wen(path, power: float) -> np.ndarray:
    """Integrate z of the Bouc-Wen law at the points of a path (k, ...).

    dz/dq = 1 - |z|^n (1 + sgn(v z))/2 with n = power. It is exact for n = 1; other powers take Runge-Kutta
    steps of order 4 that are at most 0.05 long.

    Parameters
    ----------
    path : (k, ...) array
    power : float
    """
    z = np.zeros_like(path)
    step = _exact if power == 1 else _runge_kutta
    for i, dq in enumerate(np.diff(path, axis=0)):
        z[i + 1] = step(z[i], dq, power)
    return z


def _exact(z, dq, _):
    """Integrate along the direction of motion in closed form: da = 1 below zero and da = 1 - a above it."""
    way = np.sign(dq)
    left = np.abs(dq)
    young = np.minimum(way * z, 0.0)
    old = np.maximum(way * z, 0.0)
    first = np.minimum(left, -young)
    above = 1 - (1 - old) * np.exp(first - left)
    return np.where(dq == 0, z, way * np.where(left < -young, young + left, above))


def _runge_kutta(z, dq, power):
    def slope(y):
        return 1 - np.abs(y) ** power * (np.sign(way * y) + 1) / 2

    way = np.sign(dq)
    pieces = max(1, int(np.ceil(np.abs(dq).max() / 0.05)))
    h = dq / pieces
    for _ in range(pieces):
        a = slope(z)
        b = slope(z + h / 2 * a)
        c = slope(z + h / 2 * b)
        z = z + h / 6 * (a + 2 * b + 2 * c + slope(z + h * c))
    return z


def best_rate(share, wanted) -> float:
    """Return v_0, relative to the largest speed, for which tanh(share/v_0) is closest to `wanted` (k,) in the rms.

    `share` (k,) are the speeds over the greatest speed.
    """

    def miss(log_speed):
        return np.sqrt(np.mean((np.tanh(share / np.exp(log_speed)) - wanted) ** 2))

    tries = np.linspace(np.log(1e-2), np.log(1e4), 60)
    near = int(np.argmin([miss(t) for t in tries]))
    low = tries[max(near - 1, 0)]
    high = tries[min(near + 1, tries.size - 1)]
    return float(
        np.exp(
            minimize_scalar(miss, bounds=(low, high), method="bounded", options={"xatol": 1e-8}).x
        )
    )
