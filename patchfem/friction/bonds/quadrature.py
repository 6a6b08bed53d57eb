"""Eq. 2.17 in full: the shear of a point is the sum over the bonds that formed along its path.

Each step of the path is one strip of bonds that formed at the mean pressure of its ends. In a rigid slide all points
share the path, so a strip holds scalars of the path and one pressure per point. Strips are integrated

* stretch, p = 1: in closed form, any bond length history;
* report, constant bond length: in closed form, any p > -1, by the incomplete gamma function P(p + 1, R/eps);
* otherwise: by four Gauss points on pieces of at most a quarter bond length.

Readings. `report` is 2.14-2.17 as printed: (R/eps)^p exp(-R/eps) against the direction u/|u| of the displacement since
the bond formed, every bond growing its own length from zero (2.10); the path element is |v| dt, not the signed dX1 of
the print. `stretch` keeps stretch apart from damage: (|u|/eps)^p exp(-int dR/eps), eps in the power frozen when the
bond forms; it agrees with the print on every path without a reversal and never creates energy for p >= 0.

Bonds older than `cutoff` bond lengths of path are left out; what they could carry is at most `tail` of mu_s sigma.

Energy. A bond stores what it gives back when its stretch goes to zero at the damage of the moment: f u/(p + 1) in the
stretch reading, f u in the print, whose force does not depend on how far it is stretched. What a step dissipates is its
work less the gain of that store; the print makes it negative at times, which is energy created.
"""

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.special import gammainc, gammainccinv, gammaln, roots_jacobi

from ..protocol import Step
from .parameters import Bonds, elastic_part, grow, growth_exponents, won_share
from .recursion import advance, pressed, stretch

_GAUSS_Y, _GAUSS_W = np.polynomial.legendre.leggauss(4)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
PIECE = 0.25  # longest Gauss piece in bond lengths


def cutoff(order: float, tail: float) -> float:
    """Path R/eps beyond which all older bonds together carry at most `tail` (Q(p + 1, R/eps) = tail)."""
    return float(gammainccinv(order + 1, tail))


@dataclass(frozen=True, eq=False, slots=True)
class Strips:
    """Bonds of a path. Strip k: q, path, damage, growth (J), mature (eps_p) at its end; span (signed length), length
    scale eps when it formed, gain: growth and mature length won while it formed (2, k); sigma (k, m) [Pa]. An entry of
    span 0 is a cohort: bonds, full-grown and unstressed at q, of the density sigma; the first entry is the initial
    one, m_0 sigma."""

    q: np.ndarray
    path: np.ndarray
    damage: np.ndarray
    growth: np.ndarray
    mature: np.ndarray
    span: np.ndarray
    eps: np.ndarray
    gain: np.ndarray
    sigma: np.ndarray
    now: tuple  # q, path, damage, growth, mature of the present
    alive: np.ndarray  # (m,) first strip that still holds at a point
    dropped: int = 0
    play: float = 0.0  # of `law.elastic_part`


@dataclass(frozen=True, slots=True)
class Quadrature:
    """Law object that evaluates 2.17 directly; `tail` bounds what the cut-off may lose, 0 keeps every bond."""

    law: Bonds
    tail: float = 1e-9

    def start(self, sigma) -> Strips:
        """Only the initial cohort: unstressed, full-grown bonds of density m_0."""
        one = np.zeros(1)
        return Strips(one, one, one, one, np.full(1, self.law.length), one, np.full(1, self.law.length),
                      np.zeros((2, 1)), self.law.initial * np.array(sigma, float)[None],
                      (0.0, 0.0, 0.0, 0.0, self.law.length), np.zeros(len(sigma), np.int64))

    def step(self, state: Strips, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment; the mean traction is exact for p = 1 stretch, else by five Gauss points."""
        after = self._moved(state, dq, s0, s1, dt)
        if dq == 0:
            mean = self.traction(after)
        elif self._closed:
            bonds = self._sums(state)
            free, damaging, _ = elastic_part(self.law, state.play, dq, self._middle(state, dq, dt))
            loose = stretch(bonds, free)
            part = advance(loose, damaging, (s0 + s1) / 2, after.eps[-1] if damaging else self.law.length)[1]
            part = free / dq * (bonds[1] + loose[1]) / 2 + damaging / dq * part
            mean = self.law.static / self.law.length * part
        elif self.law.reading == "stretch":
            # bonds lost at the end of the step leave their energy to nobody: the force holds them until then
            held = after if (s1 > 0).all() else self._moved(state, dq, s0, np.maximum(s1, np.finfo(float).tiny), dt,
                                                            forming=(s0 + s1) / 2)
            mean = (self._spent(state, dq, s0, s1, dt) + self.stored(held) - self.stored(state)) / dq
        else:
            mean = np.zeros(len(s0))
            for part, w in zip((1 + _NODES) / 2, _WEIGHTS / 2):
                mean += w * self.traction(self._part(state, part, dq, s0, s1, dt))
        return Step(mean, mean * dq - (self.stored(after) - self.stored(state)), after)

    def _spent(self, state: Strips, dq: float, s0, s1, dt: float) -> np.ndarray:
        """Energy dissipated along a step of the stretch reading: damage takes the share dR/eps of what is stored. It is
        never negative, and the mean traction that follows from it has the work of the law at any length of step."""
        middle = self._middle(state, dq, dt)
        free, damaging, _ = elastic_part(self.law, state.play, dq, middle)
        spent, length = np.zeros(len(s0)), abs(damaging) / middle
        edges = np.unique(np.append(np.minimum([0, 1, 2, 4, 8, 16, 32], length), length))
        for a, b in pairwise(edges):
            for place, w in zip((a + b + (b - a) * _NODES) / 2, (b - a) / 2 * _WEIGHTS):
                here = self._part(state, (free + place / length * damaging) / dq, dq, s0, s1, dt)
                spent += w * self.stored(here)
        return spent

    def _part(self, state: Strips, part: float, dq: float, s0, s1, dt: float) -> Strips:
        """The state within a step, whose bonds form under its mean pressure."""
        return self._moved(state, part * dq, s0, s0 + part * (s1 - s0), part * dt, forming=(s0 + s1) / 2)

    def press(self, state: Strips, s0, s1) -> Step:
        """The pressure at rest goes from s0 to s1 (m,) [Pa]; mean: the traction after it.

        As printed, a bond keeps the pressure it formed under and none forms at rest. In the stretch reading with p = 1
        the rule is that of `recursion.pressed`; with another order the last-formed bonds are let go first, one by one.
        """
        after = replace(state, alive=np.where(s1 > 0, state.alive, len(state.q)))
        if self.law.reading == "stretch":
            keep, more = self._let_go(after, s0, s1) if not self._closed else self._thinned(after, s0, s1)
            q, path, damage, growth, mature = state.now
            columns = zip(("q", "path", "damage", "growth", "mature", "span", "eps"),
                          (q, path, damage, growth, mature, 0.0, mature))
            after = replace(after, **{name: np.append(getattr(state, name), value) for name, value in columns},
                            gain=np.append(state.gain, np.zeros((2, 1)), axis=1),
                            sigma=np.vstack([state.sigma * keep, np.where(s1 > 0, more, 0.0)]))
        return Step(self.traction(after), self.stored(state) - self.stored(after), after)

    def _thinned(self, state: Strips, s0, s1) -> tuple:
        """Factor (m,) on all bonds and density (m,) [Pa] of a cohort (below 0: bonds without stretch that are gone)
        that have the moments of `pressed`."""
        before = self._sums(state)
        m, _, s2 = before
        dense, _, kept = pressed(self.law, before, s0, s1)
        keep = np.divide(kept, s2, out=np.ones_like(s2), where=s2 > 0)
        return keep, dense - keep * m

    def _let_go(self, state: Strips, s0, s1) -> tuple:
        """Factors (k, m) on the bonds where the pressure falls, the last-formed first, and density (m,) of the cohort
        of bonds that re-form: those that rise with the pressure or would keep more than mu_s sigma."""
        mass = self._young(state) * state.sigma * self._surviving(state)[:, None]
        falls, total = s1 < s0, mass.sum(axis=0)
        excess = np.where(falls & (s0 > 0), total * (1 - s1 / np.where(s0 > 0, s0, 1.0)), 0.0)
        younger = np.cumsum(mass[::-1], axis=0)[::-1] - mass
        gone = np.clip(excess - younger, 0.0, mass)
        keep = 1 - np.divide(gone, mass, out=np.zeros_like(mass), where=mass > 0)
        held = np.abs(self.weights(state) @ (self._young(state) * state.sigma * keep))
        bound = np.where(falls & (held > s1), s1 / np.where(held > 0, held, 1.0), 1.0)
        left = (mass * keep).sum(axis=0)
        return keep * bound, np.where(falls, (1 - bound) * left, self.law.initial * np.maximum(s1 - s0, 0.0))

    def _surviving(self, state: Strips) -> np.ndarray:
        """(k,) surviving bond density of each entry [1] in the stretch reading."""
        left = np.exp(-(state.now[2] - state.damage))
        return np.where(state.span == 0, left, left * -np.expm1(-np.abs(state.span) / state.eps))

    def _sums(self, state: Strips) -> np.ndarray:
        """(3, m): m, z, s2 of `recursion`, in the stretch reading with p = 1."""
        return np.stack([self._sum(state, self._surviving(state)), self._sum(state, self.weights(state)) *
                         self.law.length, self._sum(state, self._energies(state)) * 2 * self.law.length])

    @property
    def _closed(self) -> bool:
        return self.law.order == 1 and self.law.reading == "stretch"

    def _moved(self, state: Strips, dq, s0, s1, dt, forming=None) -> Strips:
        q, path, damage, growth, mature = state.now
        law = self.law
        speed = dq / dt if dt > 0 else 0.0
        middle = self._middle(state, dq, dt)
        span, play = elastic_part(law, state.play, dq, middle)[1:]
        total = sum(growth_exponents(law, speed, speed, dq, dt)) if law.grows else 0.0
        after = (q + dq, path + abs(span), damage + abs(span) / middle, growth + total,
                 grow(law, mature, speed, speed, dq, dt))
        sigma = (s0 + s1) / 2 if forming is None else forming
        alive = np.where(s1 > 0, state.alive, len(state.q) + (span != 0))
        if span == 0:
            return replace(state, now=after, alive=alive, play=play)
        new = (*after, span, middle)
        names = ("q", "path", "damage", "growth", "mature", "span", "eps")
        columns = {name: np.append(getattr(state, name), value) for name, value in zip(names, new)}
        gain = np.append(state.gain, [[after[3] - growth], [after[4] - mature]], axis=1)
        return self._cut(Strips(**columns, gain=gain, sigma=np.vstack([state.sigma, sigma]), now=after, alive=alive,
                                dropped=state.dropped, play=play))

    def _middle(self, state: Strips, dq: float, dt: float) -> float:
        speed = dq / dt if dt > 0 else 0.0
        return grow(self.law, state.now[4], speed, speed, dq / 2, dt / 2)

    def _cut(self, state: Strips) -> Strips:
        if self.tail <= 0:
            return state
        reach = cutoff(self.law.order, self.tail)
        old = state.damage if self.law.reading == "stretch" else state.path / self.law.length
        now = state.now[2] if self.law.reading == "stretch" else state.now[1] / self.law.length
        first = int(np.searchsorted(old, now - reach))
        if first < max(64, len(state.q) // 2):
            return state
        kept = {name: getattr(state, name)[first:] for name in
                ("q", "path", "damage", "growth", "mature", "span", "eps", "sigma")}
        return replace(state, **kept, gain=state.gain[:, first:], alive=np.maximum(state.alive - first, 0),
                       dropped=state.dropped + first)

    def weights(self, state: Strips) -> np.ndarray:
        """(k,) signed weight [1] of each entry: tau = mu_s sum_k weight_k sigma_k."""
        return self._entries(state)[0]

    def _energies(self, state: Strips) -> np.ndarray:
        """(k,) weight [m] of each entry in the stored energy: V = mu_s sum_k energy_k sigma_k."""
        return self._entries(state)[1]

    def _entries(self, state: Strips) -> tuple:
        law, out = self.law, np.empty((2, len(state.q)))
        cohorts = state.span == 0
        out[:, cohorts] = _cohorts(state, cohorts, law)
        rest = ~cohorts
        if self._closed:
            first, second = _stretch_strip(state, rest)
            out[:, rest] = first / law.length, second / (2 * law.length)
        elif law.reading == "report" and not law.grows:
            out[:, rest] = _report_strip(state, rest, law)
        else:
            out[:, rest] = _gauss_strip(state, rest, law)
        return out

    def traction(self, state: Strips) -> np.ndarray:
        """tau (m,) [Pa], positive against positive slip."""
        return self.law.static * self._sum(state, self.weights(state))

    def stored(self, state: Strips) -> np.ndarray:
        """Elastic energy per area (m,) [J/m2] of the bonds at the damage of the moment."""
        return self.law.static * self._sum(state, self._energies(state))

    def _sum(self, state, weights):
        if not state.alive.any():
            return weights @ state.sigma
        return np.einsum("k,km,km->m", weights, state.sigma, self._young(state))

    def _young(self, state: Strips) -> np.ndarray:
        """(k, m): whether an entry still holds at a point."""
        return np.arange(len(state.q))[:, None] >= state.alive


def _cohorts(state: Strips, which, law: Bonds) -> tuple:
    """Weights [1] and stored energies [m] of cohorts: (|u|/eps)^p exp(-damage) or phi_p(R/eps_0), against u."""
    u, damage = state.now[0] - state.q[which], state.now[2] - state.damage[which]
    x = (state.now[1] - state.path[which]) / law.length
    stretched = law.reading == "stretch"
    size, harm = (np.abs(u) / law.length, damage) if stretched else (x, x)
    with np.errstate(divide="ignore"):
        force = np.where(u == 0, 0.0, np.sign(u) * np.exp(law.order * np.log(np.maximum(size, 1e-300)) - harm
                                                          - gammaln(law.order + 1)))
    return force, force * u / (law.order + 1 if stretched else 1.0)


def _stretch_strip(state: Strips, rest) -> tuple:
    """Closed-form sums over a strip of k u dL/eps [m] and k u^2 dL/eps [m2] (p = 1)."""
    u = state.now[0] - state.q[rest]
    g, eps = np.sign(state.span[rest]), state.eps[rest]
    x = np.abs(state.span[rest]) / eps
    e = np.exp(-x)
    zero, one, two = -np.expm1(-x), 1 - e * (1 + x), 2 - e * (x * x + 2 * x + 2)
    left = np.exp(-(state.now[2] - state.damage[rest]))
    first = left * (u * zero + g * eps * one)
    return first, left * (u * u * zero + 2 * u * g * eps * one + eps**2 * two)


def _report_strip(state: Strips, rest, law: Bonds) -> tuple:
    """Exact strip of the printed law at constant eps: weight and stored energy [m] by differences of P(p + 1, R/eps)
    and P(p + 2, R/eps), split where u changes sign."""
    u = state.now[0] - state.q[rest]
    g, h = np.sign(state.span[rest]), np.abs(state.span[rest])
    near = state.now[1] - state.path[rest]
    turn = np.clip(-g * u, 0.0, h)
    ends = [np.maximum(near + y, 0) / law.length for y in (0.0, turn, h)]
    share = [gammainc(law.order + 1, x) for x in ends]
    reach = [law.length * (law.order + 1) * gammainc(law.order + 2, x) for x in ends]
    signed = np.stack([share[0] - share[1], share[2] - share[1]])  # sgn(u) dL over both parts, over g
    arm = np.stack([reach[0] - reach[1], reach[2] - reach[1]])
    return g * signed.sum(axis=0), (u * g - near) * signed.sum(axis=0) + arm.sum(axis=0)


def _gauss_strip(state: Strips, rest, law: Bonds) -> tuple:
    """Four Gauss points on pieces of at most a quarter bond length, none across u = 0 where the sign of a bond turns;
    those beside it with |u|^p as their weight. Weights [1] and stored energies [m] per unit mu_s sigma."""
    spans, end = state.span[rest], state.now[0] - state.q[rest]
    g, h = np.sign(spans), np.abs(spans)
    turn = np.clip(-g * end, 0.0, h)  # way back along the strip to where u = 0
    starts, parts = np.concatenate([np.zeros_like(h), turn]), np.concatenate([turn, h - turn])
    strip = np.tile(np.arange(h.size), 2)[parts > 0]
    starts, parts = starts[parts > 0], parts[parts > 0]
    pieces = np.maximum(1, np.ceil(parts / (PIECE * state.eps[rest][strip]))).astype(int)
    part = np.repeat(np.arange(parts.size), pieces)
    number = np.arange(part.size) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    owner, size = strip[part], (parts / pieces)[part]
    turns = np.abs(turn + g * end) <= 1e-9 * h  # u = 0 there, not only the strip's own end
    near = turns[owner] & (number == 0) & (starts[part] == turn[owner])
    far = turns[owner] & (number == pieces[part] - 1) & (starts[part] + parts[part] == turn[owner])
    bent = law.reading == "stretch"
    share, weight = _towards(bent & near, bent & far, law.order if bent else 0.0)
    way = starts[part][:, None] + (number[:, None] + share) * size[:, None]  # behind the strip's end
    weight = size[:, None] * weight
    u = end[owner][:, None] + way * g[owner][:, None]
    travel = state.now[1] - state.path[rest][owner][:, None] + way
    if law.reading == "stretch":
        eps = state.eps[rest][owner][:, None]
        harm = state.now[2] - state.damage[rest][owner][:, None] + way / eps
        x = np.abs(u) / eps
    else:
        before, back = state.gain[:, rest], way / h[owner][:, None]
        age = state.now[3] - state.growth[rest][owner][:, None] + back * before[0][owner][:, None]
        later = 1 - won_share(before[0][owner][:, None], back)
        born = state.mature[rest][owner][:, None] - later * before[1][owner][:, None]
        eps = np.maximum(state.now[4] - born * np.exp(-age), 1e-300)
        harm = x = travel / eps
    with np.errstate(divide="ignore"):
        f = np.sign(u) * np.exp(law.order * np.log(np.maximum(x, 1e-300)) - harm - gammaln(law.order + 1))
    part = 1 / (law.order + 1) if bent else 1.0
    return tuple(np.bincount(owner, (values * weight).sum(axis=1), spans.size) / law.length for values in
                 (f, part * f * u))


@cache
def _weighted_points(order: float) -> tuple:
    """Gauss-Jacobi points (4,) in (0, 1) for the weight t^order at 0, and their weights divided by it."""
    x, w = roots_jacobi(4, 0.0, order)
    t = (1 + x) / 2
    return t, w / (2**(order + 1) * t**order)


def _towards(near, far, order: float) -> tuple:
    """Gauss points (k, 4) in (0, 1) and weights of pieces (k,); of pieces that end at u = 0 (near their start or far)
    those with |u|^order as their weight."""
    t, w = _weighted_points(order)
    near, far = near[:, None], far[:, None]
    share = np.where(near, t, np.where(far, 1 - t, (1 - _GAUSS_Y) / 2))
    return share, np.where(near | far, w, _GAUSS_W / 2)
