"""The numbers of the bond law (report, 2.C) and the growth of the bond length (2.10)."""

from dataclasses import dataclass
from math import exp, log

import numpy as np

LONG = 1e100  # exponents of growth beyond which nothing changes any more
LONGEST = 600.0  # seconds that a list of bonds may take before a run is refused


@dataclass(frozen=True, slots=True)
class Bonds:
    """Parameters of eq. 2.10-2.17.

    static: mu_s; ratio = eps_k/eps_0 = mu_k/mu_s (2.21); length = eps_0 [m]; order = p; reading "stretch" or "report";
    rest_growth = a_s [m s-2] (2.10 needs this unit) and slip_growth = l_k [m], None for a constant bond length, (m,) in
    `recursion` for points of their own temperature;
    rest_speed = v_h [m/s], the floor under |v| without which 2.10 has no limit at a reversal; initial = m_0;
    breakaway: share of the bond length that stretches without damage.
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
    def grows(self) -> bool:
        """Whether the bond length evolves by eq. 2.10; without rates it stays at eps_0."""
        return self.rest_growth is not None


def won_share(growth, back):
    """Share of the mature length won in a step (2.10 at constant speed) that was won before the place `back` [1] behind
    its end; growth: the step multiplies the distance to its goal by exp(-growth)."""
    # of little growth the share is linear
    return np.divide(
        np.expm1(-growth * (1 - back)), np.expm1(-growth), out=1 - back, where=growth > 1e-9
    )


def ripening(law: Bonds, speed: float) -> float:
    """Path in which a bond that starts from nothing ripens (2.10), over its steady length (2.11), at a speed [m/s].

    In the report reading friction is mu (eps/eps_0) G(a; p) with this a, so 2.18-2.21 hold where a is small: within
    1.5 % up to 0.1 for p = 0 and 1; for a beyond 1 the friction itself fades away.
    """
    if not law.grows or speed == 0:
        return 0.0
    slow, fast = law.rest_growth / speed**2, 1 / law.slip_growth
    return 1 / ((slow + fast) * law.length * (slow + law.ratio * fast) / (slow + fast))


def elastic_part(law: Bonds, play, dq, eps):
    """(elastic, damaging) parts of the increment dq and the play after it; dq [m] and play [1] scalars or (m,).

    Play says where the slide stands in its elastic range, of half width breakaway * eps: -1 and 1 at the ends. Inside,
    bonds stretch and none breaks or forms, and the slide keeps its share of a width that changes with eps; at an end
    all of an outward slide drags the range along and damages. A damaged path counted so keeps every statement about
    energy, and a motion to and fro within the range leaves no trace (a play operator, Visintin, Differential Models of
    Hysteresis, 1994).
    """
    half = law.breakaway * eps
    start = play * half
    end = np.clip(start + dq, -half, half)
    free = np.where(end == start + dq, dq, end - start)[()]
    inside = np.divide(end, half, out=np.zeros_like(end), where=half > 0)
    return free, dq - free, np.where(np.abs(end) == half, np.sign(end), inside)[()]


def growth_exponents(law: Bonds, v0: float, v1: float, dq: float, dt: float) -> tuple:
    """(I_A, I_B): integrals over the step of a_s/max(|v|, v_h) and |v|/l_k, exact for a velocity linear in time.

    v0, v1 [m/s] at the ends, dq [m] moved, dt [s]. With S(v) = v/v_h below the floor and sgn(v)(1 + ln(|v|/v_h)) above,
    I_A = a_s dt (S(v1) - S(v0))/(v1 - v0).
    """
    floor = law.rest_speed

    def primitive(v):
        return v / floor if abs(v) < floor else np.sign(v) * (1 + log(abs(v) / floor))

    if max(abs(v0), abs(v1)) < floor:
        rest = law.rest_growth * dt / floor
    # closer speeds: their difference loses its digits, and the mean speed is as good
    elif abs(v1 - v0) > 1e-6 * (abs(v0) + abs(v1)):
        rest = law.rest_growth * dt * (primitive(v1) - primitive(v0)) / (v1 - v0)
    else:
        rest = law.rest_growth * dt / max(abs(v0 + v1) / 2, floor)
    return np.minimum(rest, LONG), np.minimum(abs(dq) / law.slip_growth, LONG)


def grow(law: Bonds, eps, v0: float, v1: float, dq: float, dt: float):
    """Bond length [m] after a step (2.10): exact relaxation towards (I_A eps_0 + I_B eps_k)/(I_A + I_B), in (0, eps_0].

    A step of zero length and zero time changes nothing; at rest it is pure healing. Where the law holds its rates per
    point (m,), so is the length.
    """
    if not law.grows:
        return law.length
    rest, slide = growth_exponents(law, v0, v1, dq, dt)
    total = rest + slide
    if np.ndim(total):
        target = law.length * (rest + slide * law.ratio) / np.where(total > 0, total, 1.0)
        return np.where(total > 0, target + (eps - target) * np.exp(-total), eps)
    if total == 0:
        return eps
    target = law.length * (rest + slide * law.ratio) / total
    return target + (eps - target) * exp(-total)
