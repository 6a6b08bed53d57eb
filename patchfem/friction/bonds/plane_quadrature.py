"""Eq. 2.17 in full along a path in two directions: the sum over the bonds that formed on every leg of a polygon.

Readings and their numbers are those of `quadrature`; u is a vector, R the length of path since a bond formed. Legs are
integrated in closed form for stretch with p = 1 and for the last leg, whose bonds all point along it; otherwise by
eight Gauss points on pieces of at most a quarter bond length, shorter than their distance from where u or R vanishes,
and by three on legs ten times shorter than that distance and than a bond length.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.special import gammainc, gammaln

from ..protocol import Step
from .parameters import Bonds, grow, growth_exponents, won_share
from .plane import advance_plane, direction, refuse_breakaway
from .quadrature import PIECE, cutoff

_THREE, _FIVE, _EIGHT = (np.polynomial.legendre.leggauss(count) for count in (3, 5, 8))
SLIGHT = 0.1  # legs so short against their distance and the bond length take three points


@dataclass(frozen=True, eq=False, slots=True)
class Legs:
    """Bonds of a polygon. Leg k: q (k, 2) its end, path, damage, growth (J), mature (eps_p) there; span (k, 2), length
    scale eps when it formed, gain: growth and mature length won on it (2, k); sigma (k, m) [Pa]. The first entry is the
    initial cohort of weight m_0 eps_0; now: q, path, damage, growth, mature; alive (m,): first leg that still holds."""

    q: np.ndarray
    path: np.ndarray
    damage: np.ndarray
    growth: np.ndarray
    mature: np.ndarray
    span: np.ndarray
    eps: np.ndarray
    gain: np.ndarray
    sigma: np.ndarray
    now: tuple
    alive: np.ndarray
    dropped: int = 0


@dataclass(frozen=True, slots=True)
class PlaneQuadrature:
    """Law object; `tail` bounds what the cut-off of old bonds may lose, 0 keeps every bond."""

    law: Bonds
    tail: float = 1e-9

    def __post_init__(self):
        refuse_breakaway(self.law)

    def start(self, sigma) -> Legs:
        """Only the initial cohort: unstressed, full-grown bonds of density m_0."""
        none, length = np.zeros(1), np.full(1, self.law.length)
        return Legs(np.zeros((1, 2)), none, none, none, length, np.zeros((1, 2)), length, np.zeros((2, 1)),
                    np.array(sigma, float)[None], (np.zeros(2), 0.0, 0.0, 0.0, self.law.length),
                    np.zeros(len(sigma), np.int64))

    def step(self, state: Legs, dq, s0, s1, dt: float) -> Step:
        """One leg dq (2,) [m]; the mean traction (2, m) is exact for p = 1 stretch, by five Gauss points else, its part
        along the leg in the stretch reading by the energy."""
        dq = np.asarray(dq, float)
        after = self._moved(state, dq, s0, s1, dt)
        gain = self.stored(after) - self.stored(state)
        if not dq.any():
            return Step(self.traction(after), -gain, after)
        if self._closed:
            bonds = np.zeros((4, len(s0)))
            bonds[0] = _summed(state, self._surviving(state)[:, None])[0]
            bonds[1:3] = _summed(state, self.weights(state))[:2] * self.law.length
            mean = self.law.static / self.law.length * advance_plane(bonds, dq, (s0 + s1) / 2, after.eps[-1])[1]
            return Step(mean, dq @ mean - gain, after)
        mean, spent = self._along(state, dq, s0, s1, dt)
        if self.law.reading == "report":
            return Step(mean, dq @ mean - gain, after)
        path, e = direction(dq)
        return Step(mean + e[:, None] * ((spent + gain) / path - e @ mean), spent, after)

    def _along(self, state: Legs, dq, s0, s1, dt) -> tuple:
        """(mean traction (2, m), dissipated energy (m,)) of a leg; the latter in the stretch reading, where damage
        takes the share dR/eps of what is stored."""
        middle = self._moved(state, dq, s0, s1, dt).eps[-1]
        length, mean, spent = direction(dq)[0] / middle, np.zeros((2, len(s0))), np.zeros(len(s0))
        edges = np.append(np.minimum([0, 1, 2, 4, 8, 16, 32], length), length)
        if self.law.reading == "report":
            edges = np.array([0.0, length])
        for a, b in pairwise(np.unique(edges)):
            for place, w in zip((a + b + (b - a) * _FIVE[0]) / 2, (b - a) / 2 * _FIVE[1]):
                part = place / length
                here = self._moved(state, part * dq, s0, s0 + part * (s1 - s0), part * dt, (s0 + s1) / 2)
                sums = self.law.static * _summed(here, self.weights(here))
                mean, spent = mean + w / length * sums[:2], spent + w * sums[2]
        return mean, spent

    @property
    def _closed(self) -> bool:
        return self.law.order == 1 and self.law.reading == "stretch"

    def _surviving(self, state: Legs) -> np.ndarray:
        """(k,) surviving bond density of each leg [1], p = 1 stretch."""
        left = np.exp(-(state.now[2] - state.damage))
        out = left * -np.expm1(-np.hypot(*state.span.T) / state.eps)
        if state.dropped == 0:
            out[0] = self.law.initial * left[0]
        return out

    def _moved(self, state: Legs, dq, s0, s1, dt, forming=None) -> Legs:
        q, path, damage, growth, mature = state.now
        law, (h, _) = self.law, direction(dq)
        speed = h / dt if dt > 0 else 0.0
        middle = grow(law, mature, speed, speed, h / 2, dt / 2)
        total = sum(growth_exponents(law, speed, speed, h, dt)) if law.grows else 0.0
        after = (q + dq, path + h, damage + h / middle, growth + total, grow(law, mature, speed, speed, h, dt))
        alive = np.where(s1 > 0, state.alive, len(state.path) + (h > 0))
        if h == 0:
            return replace(state, now=after, alive=alive)
        sigma = (s0 + s1) / 2 if forming is None else forming
        new = {name: np.append(getattr(state, name), value) for name, value in zip(
            ("path", "damage", "growth", "mature", "eps"), (*after[1:], middle))}
        gain = np.append(state.gain, [[after[3] - growth], [after[4] - mature]], axis=1)
        return self._cut(Legs(np.vstack([state.q, after[0]]), span=np.vstack([state.span, dq]), gain=gain,
                              sigma=np.vstack([state.sigma, sigma]), now=after, alive=alive, dropped=state.dropped,
                              **new))

    def _cut(self, state: Legs) -> Legs:
        if self.tail <= 0:
            return state
        reach, stretch = cutoff(self.law.order, self.tail), self.law.reading == "stretch"
        old, now = (state.damage, state.now[2]) if stretch else (state.path / self.law.length,
                                                                 state.now[1] / self.law.length)
        first = int(np.searchsorted(old, now - reach))
        if first < max(64, len(state.path) // 2):
            return state
        kept = {name: getattr(state, name)[first:] for name in
                ("q", "path", "damage", "growth", "mature", "span", "eps", "sigma")}
        return replace(state, **kept, gain=state.gain[:, first:], alive=np.maximum(state.alive - first, 0),
                       dropped=state.dropped + first)

    def weights(self, state: Legs) -> np.ndarray:
        """(k, 3) of each leg: weight [1] along x and across, tau = mu_s sum_k weight_k sigma_k, and stored energy [m],
        V = mu_s sum_k energy_k sigma_k. The first is the initial cohort."""
        law, first = self.law, 1 if state.dropped == 0 else 0
        out, rest = np.zeros((len(state.path), 3)), slice(first, None)
        if first:
            out[0] = self._cohort(state)
        if len(state.path) == first:
            return out
        if self._closed:
            u, square = _stretch_leg(state, rest)
            out[rest] = np.column_stack([u, square / 2]) / law.length
            return out
        out[rest] = _gauss_leg(state, rest, law)
        return out

    def _cohort(self, state: Legs) -> np.ndarray:
        """m_0 phi_p(R/eps_0) u/|u| and its stored energy: the bonds that were there at the start."""
        law, (u, way) = self.law, direction(state.now[0])
        path, damage = state.now[1:3]
        if u == 0 or law.initial == 0:
            return np.zeros(3)
        stretched = law.reading == "stretch"
        x, harm = (u, damage) if stretched else (path, path / law.length)
        force = law.initial * np.exp(law.order * np.log(x / law.length) - harm - gammaln(law.order + 1))
        return force * np.append(way, u / (law.order + 1 if stretched else 1.0))

    def traction(self, state: Legs) -> np.ndarray:
        """tau (2, m) [Pa], positive against positive slip."""
        return self.law.static * _summed(state, self.weights(state))[:2]

    def stored(self, state: Legs) -> np.ndarray:
        """Elastic energy per area (m,) [J/m2] of the bonds at the damage of the moment."""
        return self.law.static * _summed(state, self.weights(state))[2]


def _summed(state: Legs, weights) -> np.ndarray:
    """(c, m) sums of weights (k, c) times the pressures of the legs that still hold."""
    if not state.alive.any():
        return weights.T @ state.sigma
    young = np.arange(len(weights))[:, None] >= state.alive
    return weights.T @ (state.sigma * young)


def _stretch_leg(state: Legs, rest) -> tuple:
    """Closed-form sums over a leg of k u dL/eps (k, 2) [m] and k |u|^2 dL/eps (k,) [m2] (p = 1)."""
    span, eps = state.span[rest], state.eps[rest]
    h = np.hypot(*span.T)
    e = np.divide(span, h[:, None], out=np.zeros_like(span), where=h[:, None] > 0)
    a = state.now[0] - state.q[rest]
    x = h / eps
    d = np.exp(-x)
    zero, one, two = -np.expm1(-x), 1 - d * (1 + x), 2 - d * (x * x + 2 * x + 2)
    left = np.exp(-(state.now[2] - state.damage[rest]))
    along = np.sum(a * e, axis=1)
    first = left[:, None] * (a * zero[:, None] + e * (eps * one)[:, None])
    return first, left * (np.sum(a * a, axis=1) * zero + 2 * along * eps * one + eps**2 * two)


def _gauss_leg(state: Legs, rest, law: Bonds) -> np.ndarray:
    """(k, 3) sums over the legs by Gauss points; the last leg in closed form where its bonds share a length."""
    span, eps = state.span[rest], state.eps[rest]
    h = np.hypot(*span.T)
    e, a, near = span / h[:, None], state.now[0] - state.q[rest], state.now[1] - state.path[rest]
    before = np.sum(a * e, axis=1)  # u along e at the end of a leg; grows backwards along it
    aside = np.hypot(*(a - e * before[:, None]).T)
    out, stretched = np.zeros((h.size, 3)), law.reading == "stretch"
    last = (stretched or not law.grows) & (near == 0)
    whole, arm = (eps * gammainc(law.order + n, h / eps) / law.length for n in (1, 2))
    out[last] = np.column_stack([e * whole[:, None], eps * arm * (1 if stretched else law.order + 1)])[last]
    count = np.maximum(1, np.ceil(h / (PIECE * eps))).astype(int)
    away = np.minimum(np.hypot(aside, np.maximum(np.maximum(before, -before - h), 0.0)), near)
    slight = (h <= SLIGHT * np.minimum(away, eps)) & ~last
    clear = (away >= h / count) & ~last & ~slight
    even, odd = np.flatnonzero(clear), np.flatnonzero(~clear & ~last & ~slight)
    owner = np.repeat(even, count[even])
    size = (h / count)[owner]
    begin = size * (np.arange(owner.size) - np.repeat(np.cumsum(count[even]) - count[even], count[even]))
    for k in odd:
        cuts = _graded(h[k], PIECE * eps[k], (complex(-before[k], aside[k]), complex(-near[k], 0.0)))
        owner, begin = np.append(owner, np.full(cuts.size - 1, k)), np.append(begin, cuts[:-1])
        size = np.append(size, np.diff(cuts))
    few = np.flatnonzero(slight)
    for part, rule in (((owner, begin, size), _EIGHT), ((few, np.zeros(few.size), h[few]), _THREE)):
        found = _pieces(state, rest, law, a, e, h, part, rule)
        for c in (0, 1, 2):
            out[:, c] += np.bincount(part[0], found[:, c], h.size)
    return out


def _pieces(state: Legs, rest, law: Bonds, a, e, h, part: tuple, rule: tuple) -> np.ndarray:
    """(n, 3) sums over pieces (leg, start behind its end, length), each (n,), by the points and weights of a rule."""
    (owner, begin, size), (points, weights) = part, rule
    back = begin[:, None] + size[:, None] * (1 + points) / 2
    ux, uy = (a[owner, c][:, None] + back * e[owner, c][:, None] for c in (0, 1))
    far = np.maximum(np.sqrt(ux * ux + uy * uy), 1e-300)
    x, harm = _ages(state, rest, law, owner, back, far, h)
    with np.errstate(under="ignore"):
        f = np.exp(-harm) if law.order == 0 else np.exp(
            law.order * np.log(np.maximum(x, 1e-300)) - harm - gammaln(law.order + 1))
    f *= weights * size[:, None] / (2 * law.length * far)
    share = law.order + 1 if law.reading == "stretch" else 1.0
    return np.stack([(ux * f).sum(axis=1), (uy * f).sum(axis=1), (far * far * f).sum(axis=1) / share], axis=1)


def _ages(state: Legs, rest, law: Bonds, owner, back, far, h) -> tuple:
    """(argument of the power, exponent of the decay) of bonds `back` (n, points) behind the ends of their legs."""
    if law.reading == "stretch":
        eps = state.eps[rest][owner][:, None]
        return far / eps, state.now[2] - state.damage[rest][owner][:, None] + back / eps
    travel = state.now[1] - state.path[rest][owner][:, None] + back
    if not law.grows:
        return travel / law.length, travel / law.length
    part, (won, grown) = back / h[owner][:, None], state.gain[:, rest][:, owner][..., None]
    age = state.now[3] - state.growth[rest][owner][:, None] + part * won
    born = state.mature[rest][owner][:, None] - (1 - won_share(won, part)) * grown
    own = np.maximum(state.now[4] - born * np.exp(-age), 1e-300)
    return travel / own, travel / own


def _graded(h: float, most: float, poles) -> np.ndarray:
    """Cuts (k,) of [0, h], none longer than `most` or than its distance from the complex places `poles`."""
    inner = [p.real for p in poles if 0 < p.real < h]
    least = 1e-15 * h
    knots = sorted({0.0, h, *inner})
    todo = list(pairwise(knots))[::-1]
    cuts = [0.0]
    while todo:
        a, b = todo.pop()
        away = min(abs(complex(max(a - p.real, p.real - b, 0.0), p.imag)) for p in poles)
        if b - a > max(min(most, away), least):
            todo += [((a + b) / 2, b), (a, (a + b) / 2)]
        else:
            cuts.append(b)
    return np.array(cuts)
