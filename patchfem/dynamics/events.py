"""Coulomb friction in closed form from event to event: modes that slip or stick at one interface under a base sine.

Between events every modal motion is a sum of (c0 + c1 t + c2 t^2) exp(rate t), exact for damped, undamped-resonant,
rigid and overdamped modes. The first root of a velocity or of the margin to sliding is found by steps that a bound on
the second derivative proves free of roots, so no event can be missed; near the root they are Newton steps. While the
interface sticks its slide is constant to the last bit.
"""

from cmath import exp as cexp
from dataclasses import dataclass
from math import inf, pi, sqrt

import numpy as np

from ..core import BaseSine, ModalBasis, NotConverged, PatchfemError

PANEL, WEIGHT = np.polynomial.legendre.leggauss(12)


class Signal:
    """Real part of a sum of (c0 + c1 t + c2 t^2) exp(rate t); terms: list of (rate, c0, c1, c2)."""

    __slots__ = ("_next", "terms")

    def __init__(self, terms):
        self.terms = terms
        self._next = None

    def __call__(self, t: float) -> float:
        return sum((cexp(r * t) * (a + t * (b + t * c))).real for r, a, b, c in self.terms)

    def rate(self) -> "Signal":
        """Time derivative."""
        if self._next is None:
            self._next = Signal([(r, r * a + b, r * b + 2 * c, r * c) for r, a, b, c in self.terms])
        return self._next

    def bound(self, t: float, ahead: float) -> float:
        """Upper bound of the magnitude on [t, t + ahead], t >= 0, for rates with no positive real part.

        Terms near the first rate are added before their magnitude is taken, |exp(r u) - exp(r0 u)| <= |r - r0| u:
        close to resonance the free and the forced motion cancel, and a term-by-term bound would be 1/damping too large.
        """
        lead = self.terms[0][0]
        near, out = 0j, 0.0
        for r, a, b, c in self.terms:
            turn = cexp(r * t)
            now = (a + t * (b + t * c)) * turn
            out += (abs(b + 2 * t * c) * ahead + abs(c) * ahead * ahead) * abs(turn)
            if abs(r - lead) * ahead < 0.5:
                near += now
                out += abs(now) * abs(r - lead) * ahead
            else:
                out += abs(now)
        return out + abs(near)

    def noise(self, span: float) -> float:
        """Round-off of a value on [0, span]: a few units in the last place of the largest term."""
        return 4e-16 * sum(abs(a) + span * (abs(b) + span * abs(c)) for _, a, b, c in self.terms)

    def scaled(self, factor: float) -> list:
        """Terms of factor times the signal."""
        return [(r, factor * a, factor * b, factor * c) for r, a, b, c in self.terms]

    def many(self, t: np.ndarray) -> np.ndarray:
        """Values at times t (k,)."""
        out = np.zeros(t.shape)
        for r, a, b, c in self.terms:
            out += (np.exp(r * t) * (a + t * (b + t * c))).real
        return out


@dataclass(frozen=True, eq=False, slots=True)
class Phase:
    """One stretch of slip (direction +1, -1) or stick (0) from `time` [s], drive phase `theta`, `span` [s] long."""

    time: float
    theta: float
    span: float
    direction: int
    modal: list
    force: Signal


def combine(signals, factors) -> Signal:
    """Weighted sum of signals."""
    return Signal([term for s, f in zip(signals, factors) if f != 0 for term in s.scaled(f)])


GRAZE = 1e-8  # share of the static friction by which the need may exceed it for an instant: slip below 1e-15 a/omega^2


def first_root(signals, limit: float, ahead: float, ignore: float = 0.0) -> float:
    """First time in (0, limit] at which one of the signals, positive just after 0, is no longer positive; inf if none.

    A dip that does not go below -ignore is passed over: near the onset a stick only grazes its limit, and the slip that
    follows is smaller than the round-off of the motion.

    Each step is one that |f''| <= M on the stretch ahead proves free of roots of every signal; the last ones are
    Newton's. NotConverged after 100000 steps.
    """
    watched = [(f, f.rate(), f.rate().rate(), f.noise(min(limit, 4 * ahead))) for f in signals]
    t = min(_first_leap(f, ahead) for f in signals)
    for _ in range(100_000):
        if t >= limit:
            return inf
        step = ahead
        for f, d1, d2, tiny in watched:
            value, slope = f(t), d1(t)
            if value <= tiny:
                curve = d2(t)
                if ignore > 0 and curve > 0 and value - slope * slope / (2 * curve) > -ignore:
                    step = (sqrt(max(slope * slope - 2 * curve * (value - 4 * tiny), 0.0)) - slope) / curve
                    break
                if slope < 0 and abs(value / slope) < 1e-6 * ahead:
                    t -= value / slope
                return t if t <= limit else inf
            step = min(step, _free_step(value, slope, d2.bound(t, ahead)))
        if t + step == t:
            return t
        t += step
    raise NotConverged("dynamics: an event could not be located in 100000 steps")


def _free_step(value: float, slope: float, curve: float) -> float:
    """Largest h with value + slope h - curve h^2/2 >= 0, value > 0."""
    root = sqrt(slope * slope + 2 * curve * value)
    if slope < 0:
        return 2 * value / (root - slope)
    return (slope + root) / curve if curve > 0 else inf


def _first_leap(f: Signal, ahead: float) -> float:
    """A time up to which f cannot return to zero when it starts there with a positive first derivative of any order."""
    g = f
    for order in range(5):
        value = g(0.0)
        size = 1e-10 * g.bound(0.0, ahead)
        if order and value < -size:
            return 0.0
        if value > size:
            return min(0.5 * (order + 1) * value / max(g.rate().bound(0.0, ahead), 1e-300), ahead) if order else 0.0
        g = g.rate()
    return 1e-9 * ahead


class Rig:
    """Closed-form phases of the modes under the drive; `static`, `kinetic`: friction forces [N]."""

    def __init__(self, modes: ModalBasis, drive: BaseSine, static: float, kinetic: float):
        self.modes, self.drive, self.static, self.kinetic = modes, drive, static, kinetic
        self.omega, self.zeta = modes.omega.tolist(), modes.zeta.tolist()
        self.slide, self.base = modes.slide.tolist(), modes.base.tolist()
        self.square = sum(s * s for s in self.slide)
        if self.square == 0 and static > 0:
            raise PatchfemError("structure.mode.slide: no mode moves the interface, so friction cannot act")

    def slip(self, z, v, theta: float, force: float) -> list:
        """Modal signals under a constant friction force [N] from state (z, v) at drive phase theta."""
        return [self._mode(i, z[i], v[i], theta, -self.slide[i] * force / self.modes.mass) for i in range(len(z))]

    def _mode(self, i, z, v, theta, push) -> Signal:
        w, d, om = self.omega[i], self.zeta[i], self.drive.omega
        terms, x0, v0 = [], z, v
        lead = 1j * self.base[i] * self.drive.acceleration * cexp(1j * theta)
        if lead != 0:
            weight = w * w - om * om + 2j * d * w * om
            if abs(weight) > 1e-11 * om * om:
                p = lead / weight
                terms.append((1j * om, p, 0.0, 0.0))
                x0, v0 = x0 - p.real, v0 - (1j * om * p).real
            else:
                p = lead / (2j * om)
                terms.append((1j * om, 0.0, p, 0.0))
                v0 -= p.real
        if w == 0:
            return Signal([*terms, (0j, x0, v0, push / 2)])
        if push != 0:
            terms.append((0j, push / (w * w), 0.0, 0.0))
            x0 -= push / (w * w)
        if abs(d - 1) < 1e-8:
            return Signal([*terms, (complex(-w), x0, v0 + w * x0, 0.0)])
        if d < 1:
            own = w * sqrt(1 - d * d)
            return Signal([*terms, (complex(-d * w, own), complex(x0, -(v0 + d * w * x0) / own), 0.0, 0.0)])
        fast, slow = -w * (d + sqrt(d * d - 1)), -w / (d + sqrt(d * d - 1))
        a = (v0 - slow * x0) / (fast - slow)
        return Signal([*terms, (complex(fast), a, 0.0, 0.0), (complex(slow), x0 - a, 0.0, 0.0)])

    def stick(self, z, v, theta: float) -> list:
        """Modal signals while the interface does not move."""
        if len(z) == 1:
            return [Signal([(0j, z[0], 0.0, 0.0)])]
        return self._stick_modes(np.array(z), np.array(v), theta)

    def _stick_modes(self, z, v, theta) -> list:
        s = np.array(self.slide)
        null = np.linalg.svd(s[None, :])[2][1:].T
        held = s * (s @ z) / self.square
        spring = null.T @ np.diag(self.modes.omega**2) @ null
        damper = null.T @ np.diag(2 * self.modes.zeta * self.modes.omega) @ null
        r, om = null.shape[1], self.drive.omega
        lead = null.T @ self.modes.base * 1j * self.drive.acceleration * cexp(1j * theta)
        try:
            steady = np.linalg.solve(spring - om * om * np.eye(r) + 1j * om * damper, lead)
            rest = np.linalg.solve(spring, -null.T @ (self.modes.omega**2 * held))
            y = np.concatenate([null.T @ z - rest - steady.real, null.T @ v - (1j * om * steady).real])
            rates, shapes = np.linalg.eig(np.block([[np.zeros((r, r)), np.eye(r)], [-spring, -damper]]))
            parts = shapes[:r] * np.linalg.solve(shapes, y)
        except np.linalg.LinAlgError:
            raise PatchfemError("accuracy.method: the stuck modes have no closed form here (rigid or resonant without "
                                "damping); use method = \"march\"") from None
        constant = held + null @ rest
        moving, swing = null @ parts, null @ steady
        return [Signal([(0j, constant[i], 0.0, 0.0), (1j * om, swing[i], 0.0, 0.0),
                        *((complex(rates[k]), complex(moving[i, k]), 0.0, 0.0) for k in range(2 * r))])
                for i in range(len(z))]

    def reaction(self, modal, theta: float) -> Signal:
        """Friction force [N] that keeps the interface from accelerating, while `modal` are the stuck motions."""
        m, terms = self.modes.mass / self.square if self.square else 0.0, []
        for i, signal in enumerate(modal):
            s, w = self.slide[i], self.omega[i]
            if s == 0:
                continue
            lead = 1j * self.base[i] * self.drive.acceleration * cexp(1j * theta)
            terms.append((1j * self.drive.omega, m * s * lead, 0.0, 0.0))
            terms += signal.scaled(-m * s * w * w)
            if len(modal) > 1:
                terms += signal.rate().scaled(-2 * m * s * w * self.zeta[i])
        return Signal(terms)


def run(modes: ModalBasis, drive: BaseSine, static: float, kinetic: float, duration: float):
    """Yield the phases of a run from rest, in order, up to `duration` [s]; the last one is cut there.

    static, kinetic [N] >= 0. NotConverged after 1000 phases without progress.
    """
    rig = Rig(modes, drive, static, kinetic)
    n = len(rig.omega)
    z, v, time, theta, idle = [0.0] * n, [0.0] * n, 0.0, 0.0, 0
    ahead = 0.25 * min(drive.period, 2 * pi / max([*rig.omega, drive.omega]))
    direction = 0 if static > 0 else (1 if modes.slide @ modes.base <= 0 else -1)
    while time < duration:
        left = duration - time
        if static == 0:
            modal, force, span = rig.slip(z, v, theta, 0.0), Signal([(0j, 0.0, 0.0, 0.0)]), left
        elif direction == 0:
            modal = rig.stick(z, v, theta)
            force = rig.reaction(modal, theta)
            up = Signal([(0j, static, 0.0, 0.0), *force.scaled(-1.0)])
            down = Signal([(0j, static, 0.0, 0.0), *force.terms])
            span = min(first_root((up, down), left, ahead, GRAZE * static), left)
        else:
            modal = rig.slip(z, v, theta, direction * kinetic)
            force = Signal([(0j, direction * kinetic, 0.0, 0.0)])
            span = min(first_root((combine(modal, [direction * s for s in rig.slide]).rate(),), left, ahead), left)
        yield Phase(time, theta, span, direction, modal, force)
        idle = idle + 1 if span < 1e-12 * drive.period else 0
        if idle > 1000:
            raise NotConverged(f"dynamics: events pile up at t = {time:.9g} s")
        z, v = [s(span) for s in modal], [s.rate()(span) for s in modal]
        time, theta = time + span, (theta + drive.omega * span) % (2 * pi)
        if span < left:
            direction = _next(rig, z, v, theta, direction, force(span))


def _next(rig: Rig, z, v, theta: float, direction: int, force: float) -> int:
    """Direction after an event; a stopped interface has its slide velocity set to exactly zero."""
    if direction == 0:
        return 1 if force > 0 else -1
    if len(v) == 1:
        v[0] = 0.0
    else:
        rest = sum(s * u for s, u in zip(rig.slide, v)) / rig.square
        v[:] = [u - s * rest for s, u in zip(rig.slide, v)]
    need = rig.reaction(rig.stick(z, v, theta), theta)(0.0)
    if abs(need) <= rig.static:
        return 0
    return 1 if need > 0 else -1
