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
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.special import gammainc, gammainccinv, gammaln, roots_jacobi

from .law import Bonds, grow, growth_exponents
from .local import Step
from .recursion import advance

_GAUSS_Y, _GAUSS_W = np.polynomial.legendre.leggauss(4)
PIECE = 0.25  # longest Gauss piece in bond lengths


def cutoff(order: float, tail: float) -> float:
    """Path R/eps beyond which all older bonds together carry at most `tail` (Q(p + 1, R/eps) = tail)."""
    return float(gammainccinv(order + 1, tail))


@dataclass(frozen=True, eq=False, slots=True)
class Strips:
    """Bonds of a path. Strip k: q, path, damage, growth (J), mature (eps_p) at its end; span (signed length), length
    scale eps when it formed, gain: growth and mature length won while it formed (2, k); sigma (k, m) [Pa]. The first
    entry is the initial cohort of weight m_0 eps_0."""

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


@dataclass(frozen=True, slots=True)
class Quadrature:
    """Law object that evaluates 2.17 directly; `tail` bounds what the cut-off may lose, 0 keeps every bond."""

    law: Bonds
    tail: float = 1e-9

    def start(self, sigma) -> Strips:
        """Only the initial cohort: unstressed, full-grown bonds of density m_0."""
        one = np.zeros(1)
        return Strips(one, one, one, one, np.full(1, self.law.length), one, np.full(1, self.law.length),
                      np.zeros((2, 1)), np.array(sigma, float)[None], (0.0, 0.0, 0.0, 0.0, self.law.length),
                      np.zeros(len(sigma), np.int64))

    def step(self, state: Strips, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment; the mean traction is exact for p = 1 stretch, by five Gauss points else."""
        after = self._moved(state, dq, s0, s1, dt)
        if dq == 0:
            mean = self.traction(after)
        elif self._closed:
            first = 1 if state.dropped == 0 else 0
            share = self._sum(state, self._surviving(state, first))
            stretch = self._sum(state, self.weights(state)) * self.law.length
            bonds = np.stack([share, stretch, np.zeros_like(share)])
            mean = self.law.static / self.law.length * advance(bonds, dq, (s0 + s1) / 2, after.eps[-1])[1]
        else:
            nodes, weights = np.polynomial.legendre.leggauss(5)
            mean = np.zeros(len(s0))
            for y, w in zip(nodes, weights):
                part = (1 + y) / 2
                here = self._moved(state, part * dq, s0, s0 + part * (s1 - s0), part * dt, forming=(s0 + s1) / 2)
                mean += w / 2 * self.traction(here)
        work = mean * dq
        return Step(mean, work - (self.stored(after) - self.stored(state)), after)

    def _surviving(self, state: Strips, first: int) -> np.ndarray:
        """(k,) surviving bond density of each strip [1], p = 1 stretch."""
        left = np.exp(-(state.now[2] - state.damage))
        out = left * -np.expm1(-np.abs(state.span) / state.eps)
        if first:
            out[0] = self.law.initial * left[0]
        return out

    @property
    def _closed(self) -> bool:
        return self.law.order == 1 and self.law.reading == "stretch"

    def _moved(self, state: Strips, dq, s0, s1, dt, forming=None) -> Strips:
        q, path, damage, growth, mature = state.now
        law = self.law
        speed = dq / dt if dt > 0 else 0.0
        middle = grow(law, mature, speed, speed, dq / 2, dt / 2)
        total = sum(growth_exponents(law, speed, speed, dq, dt)) if law.grows else 0.0
        after = (q + dq, path + abs(dq), damage + abs(dq) / middle, growth + total,
                 grow(law, mature, speed, speed, dq, dt))
        sigma = (s0 + s1) / 2 if forming is None else forming
        alive = np.where(s1 > 0, state.alive, len(state.q) + (dq != 0))
        if dq == 0:
            return replace(state, now=after, alive=alive)
        new = (*after, dq, middle)
        names = ("q", "path", "damage", "growth", "mature", "span", "eps")
        columns = {name: np.append(getattr(state, name), value) for name, value in zip(names, new)}
        gain = np.append(state.gain, [[after[3] - growth], [after[4] - mature]], axis=1)
        return self._cut(Strips(**columns, gain=gain, sigma=np.vstack([state.sigma, sigma]), now=after, alive=alive,
                                dropped=state.dropped))

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
        """(k,) signed weight [1] of each strip: tau = mu_s sum_k weight_k sigma_k. The first is the initial cohort."""
        law = self.law
        first = 1 if state.dropped == 0 else 0
        out = np.empty(len(state.q))
        if first:
            out[0] = self._cohort(state)
        rest = slice(first, None)
        if law.reading == "stretch" and law.order == 1:
            out[rest] = _stretch_strip(state, rest)[0] / law.length
        elif law.reading == "report" and not law.grows:
            out[rest] = _report_strip(state, rest, law)
        else:
            out[rest] = _gauss_strip(state, rest, law)
        return out

    def _cohort(self, state: Strips) -> float:
        """m_0 phi_p(R/eps_0) sgn(u): the bonds that were there at the start."""
        law = self.law
        q, path, damage = state.now[:3]
        if path == 0 or law.initial == 0:
            return 0.0
        u = q - state.q[0]
        if law.reading == "stretch":
            if u == 0:
                return 0.0
            return law.initial * np.sign(u) * np.exp(law.order * np.log(abs(u) / law.length) - damage
                                                     - gammaln(law.order + 1))
        x = path / law.length
        return law.initial * np.sign(u) * np.exp(law.order * np.log(x) - x - gammaln(law.order + 1))

    def traction(self, state: Strips) -> np.ndarray:
        """tau (m,) [Pa], positive against positive slip."""
        return self.law.static * self._sum(state, self.weights(state))

    def _sum(self, state, weights):
        if not state.alive.any():
            return weights @ state.sigma
        young = np.arange(len(weights))[:, None] >= state.alive
        return np.einsum("k,km,km->m", weights, state.sigma, young)

    def stored(self, state: Strips) -> np.ndarray:
        """Elastic energy per area (m,) [J/m2] of the stretch reading with p = 1; zero where no energy is defined."""
        if not self._closed:
            return np.zeros(state.sigma.shape[1])
        first = 1 if state.dropped == 0 else 0
        squares = np.empty(len(state.q))
        if first:
            squares[0] = self.law.initial * (state.now[0] - state.q[0])**2 * np.exp(-state.now[2])
        squares[first:] = _stretch_strip(state, slice(first, None))[1]
        return self.law.static / (2 * self.law.length) * self._sum(state, squares)


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


def _report_strip(state: Strips, rest, law: Bonds) -> np.ndarray:
    """Exact strip of the printed law at constant eps: differences of P(p + 1, R/eps), split where u changes sign."""
    u = state.now[0] - state.q[rest]
    g, h = np.sign(state.span[rest]), np.abs(state.span[rest])
    near = state.now[1] - state.path[rest]
    turn = np.clip(-g * u, 0.0, h)
    share = [gammainc(law.order + 1, np.maximum(near + y, 0) / law.length) for y in (0.0, turn, h)]
    return -g * (share[1] - share[0]) + g * (share[2] - share[1])


def _gauss_strip(state: Strips, rest, law: Bonds) -> np.ndarray:
    """Four Gauss points on pieces of at most a quarter bond length, none across u = 0 where the sign of a bond turns;
    those beside it with |u|^p as their weight. Weights per unit mu_s sigma."""
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
        born = state.mature[rest][owner][:, None] - back * before[1][owner][:, None]
        eps = np.maximum(state.now[4] - born * np.exp(-age), 1e-300)
        harm = x = travel / eps
    with np.errstate(divide="ignore"):
        f = np.sign(u) * np.exp(law.order * np.log(np.maximum(x, 1e-300)) - harm - gammaln(law.order + 1))
    return np.bincount(owner, ((f * weight).sum(axis=1)), spans.size) / law.length


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
