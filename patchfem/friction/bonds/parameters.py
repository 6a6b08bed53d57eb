"""Parameters of the bond law (report, 2.C), and the growth of the bond length (eq. 2.10)."""

from dataclasses import dataclass
from math import exp, log
from typing import NamedTuple

import numpy as np

MAX_EXPONENT = 1e100  # exponent of growth from which the bond length no longer changes
MAX_LIST_SECONDS = 600.0  # largest estimated CPU time [s] of a run with a list of bonds
# Largest relative difference of two speeds for which their mean is used; it avoids cancellation
SAME_SPEED_TOL = 1e-6
MAX_LINEAR_GROWTH = 1e-9  # largest growth J of a step along which the growth is treated as linear


@dataclass(frozen=True, slots=True)
class Bonds:
    """Parameters of the bonds in the nonlocal friction law (eqs. 2.10 to 2.17).

    - static: friction coefficient mu_s
    - length: bond length eps_0 [m]
    - order: exponent p
    - reading: "stretch" or "report", see `quadrature`
    - ratio: eps_k/eps_0 = mu_k/mu_s (eq. 2.21)
    - rest_growth: a_s [m s-2], None for a constant bond length (eq. 2.10 needs this unit)
    - slip_growth: l_k [m], None for a constant bond length
    - rest_speed: v_h [m/s], lower limit of |v|, without which eq. 2.10 has no limit at a reversal
    - initial: density m_0 of the initial bonds
    - breakaway: fraction of the bond length that stretches without damage

    In `recursion` the growth may be an array (m,) for points of different temperature.
    """

    static: float
    length: float
    order: float = 1.0
    reading: str = "stretch"
    ratio: float = 1.0
    rest_growth: float | None = None
    slip_growth: float | None = None
    rest_speed: float = 1e-6
    initial: float = 1.0
    breakaway: float = 0.0

    @property
    def has_growth(self) -> bool:
        """Return whether the bond length changes by eq. 2.10; otherwise it is always eps_0."""
        return self.rest_growth is not None


class ElasticSplit(NamedTuple):
    """Elastic and damaging part of a displacement increment [m], and the play [1] after the increment."""

    elastic: float
    damaging: float
    play: float


def grown_fraction(growth, back):
    """Return the fraction of a bond's growth in a step that occurs before a given position in the step.

    The speed is constant in the step.

    Parameters
    ----------
    growth : array
        Growth J of the step, which multiplies the distance to the target length by exp(-J).
    back : array
        Position as a fraction of the step, measured from its end.

    Returns
    -------
    array
    """
    before = np.expm1(-growth * (1 - back))
    return np.divide(before, np.expm1(-growth), out=1 - back, where=growth > MAX_LINEAR_GROWTH)


def growth_path_ratio(law: Bonds, speed: float) -> float:
    """Return the slip distance over which a new bond grows (eq. 2.10) / its steady length (eq. 2.11) at a speed [m/s].

    With this ratio a, the friction for reading="report" is mu (eps/eps_0) G(a; p). Eqs. 2.18 to 2.21 hold for small a,
    within 1.5 % up to 0.1 for p = 0 and 1; for a above 1 the friction itself vanishes.
    """
    if not law.has_growth or speed == 0:
        return 0.0
    healing = law.rest_growth / speed**2
    weakening = 1 / law.slip_growth
    steady = law.length * (healing + law.ratio * weakening) / (healing + weakening)
    return 1 / ((healing + weakening) * steady)


def split_elastic(law: Bonds, play, increment, eps) -> ElasticSplit:
    """Split a displacement increment into an elastic and a damaging part (play operator).

    Source: Visintin, Differential Models of Hysteresis, 1994.

    The play is the position in the elastic range, of half width breakaway eps, from -1 to 1 at its ends. Within the
    range, bonds stretch, and none breaks or forms. At an end, an outward displacement moves the range and damages bonds.
    The play does not change when eps changes the width of the range. A motion within the range leaves no trace.

    Parameters
    ----------
    law : Bonds
    play, increment, eps : float or (m,) array
        Play [1] before, increment and bond length [m].

    Returns
    -------
    ElasticSplit
    """
    half = law.breakaway * eps
    start = play * half
    end = np.clip(start + increment, -half, half)
    elastic = np.where(end == start + increment, increment, end - start)[()]
    inside = np.divide(end, half, out=np.zeros_like(end), where=half > 0)
    after = np.where(np.abs(end) == half, np.sign(end), inside)[()]
    return ElasticSplit(elastic, increment - elastic, after)


def _integrate_slowness(speed: float, min_speed: float) -> float:
    """Integrate 1/max(|v|, min_speed) over v from 0 to the given speed."""
    if abs(speed) < min_speed:
        return speed / min_speed
    return np.sign(speed) * (1 + log(abs(speed) / min_speed))


def growth_exponents(law: Bonds, v0: float, v1: float, increment: float, dt: float) -> tuple:
    """Integrate a_s/max(|v|, v_h) and |v|/l_k over a step; the result is exact for a linear velocity.

    Parameters
    ----------
    law : Bonds
    v0, v1 : float
        Velocities [m/s] at the ends of the step.
    increment, dt : float
        Increment [m] and duration [s].

    Returns
    -------
    healing, weakening : float
        Exponents of eq. 2.10.
    """
    min_speed = law.rest_speed
    if max(abs(v0), abs(v1)) < min_speed:
        healing = law.rest_growth * dt / min_speed
    elif abs(v1 - v0) > SAME_SPEED_TOL * (abs(v0) + abs(v1)):
        slowness = _integrate_slowness(v1, min_speed) - _integrate_slowness(v0, min_speed)
        healing = law.rest_growth * dt * slowness / (v1 - v0)
    else:
        healing = law.rest_growth * dt / max(abs(v0 + v1) / 2, min_speed)
    weakening = abs(increment) / law.slip_growth
    return np.minimum(healing, MAX_EXPONENT), np.minimum(weakening, MAX_EXPONENT)


def grow(law: Bonds, eps, v0: float, v1: float, increment: float, dt: float):
    """Return the length of growing bonds after a time step (eq. 2.10).

    A and B are the exponents of `growth_exponents`. At rest the bonds heal; a step without motion and time changes
    nothing.

    Parameters
    ----------
    law : Bonds
    eps : float or (m,) array
        Bond length [m] before; an array if the rates of the law are arrays.
    v0, v1, increment, dt : float
        As in `growth_exponents`.

    Returns
    -------
    float or (m,) array
        Bond length [m], at most eps_0.
    """
    if not law.has_growth:
        return law.length
    healing, weakening = growth_exponents(law, v0, v1, increment, dt)
    total = healing + weakening
    if np.ndim(total):
        target = law.length * (healing + weakening * law.ratio) / np.where(total > 0, total, 1.0)
        return np.where(total > 0, target + (eps - target) * np.exp(-total), eps)
    if total == 0:
        return eps
    target = law.length * (healing + weakening * law.ratio) / total
    return target + (eps - target) * exp(-total)
