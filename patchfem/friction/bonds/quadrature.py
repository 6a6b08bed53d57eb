"""Eq. 2.17 in full: the shear of a point is the sum over the bonds that formed along its path, on a line or in a plane.

Each step of the path is one straight strip of bonds that formed at the mean pressure of its ends. In a rigid slide all
points share the path, so a strip holds scalars of the path and one pressure per point; `strips` integrates over them.
A line is a plane with one component: places, directions and tractions have d = 1 or 2 components throughout.

Readings. `report` is 2.14-2.17 as printed: (R/eps)^p exp(-R/eps) against the direction u/|u| of the displacement since
the bond formed, every bond growing its own length from zero (2.10); the path element is |v| dt, not the signed dX1 of
the print. `stretch` keeps stretch apart from damage: (|u|/eps)^p exp(-int dR/eps), eps in the power frozen when the
bond forms; it agrees with the print on every path without a turn and never creates energy for p >= 0.

Bonds older than `cutoff` bond lengths of path are left out; what they could carry is at most `tail` of mu_s sigma.

Energy. A bond stores what it gives back when its stretch goes to zero at the damage of the moment: f u/(p + 1) in the
stretch reading, f u in the print, whose force does not depend on how far it is stretched. What a step dissipates is its
work less the gain of that store; the print makes it negative at times, which is energy created.

Compiled form, along a line: `list_kernels`.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..protocol import Step
from .list_numbers import cutoff
from .parameters import Bonds, elastic_part, grow, growth_exponents
from .recursion import BondState, direction, move_bonds, press_bonds, refuse_directions
from .strips import COLUMNS, Strips, surviving, weights

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
PANELS = (0, 1, 2, 4, 8, 16, 32)  # of a step in bond lengths, five Gauss points each


@dataclass(frozen=True, slots=True)
class Quadrature:
    """Law object that evaluates 2.17 directly; `tail` bounds what the cut-off may lose, 0 keeps every bond.

    Along a line increments are numbers and tractions (m,) [Pa]; in a plane they are (2,) and (2, m), positive against
    slip.
    """

    law: Bonds
    tail: float = 1e-9

    def start(self, sigma, directions: int = 1) -> Strips:
        """Only the initial cohort: unstressed, full-grown bonds of density m_0 under sigma (m,) [Pa]. PatchfemError for
        a law that has no form in two directions."""
        refuse_directions(self.law, directions)
        none, length, place = np.zeros(1), np.full(1, self.law.length), np.zeros((1, directions))
        return Strips(
            place,
            none,
            none,
            none,
            length,
            place,
            none,
            length,
            np.zeros((2, 1)),
            self.law.initial * np.array(sigma, float)[None],
            (np.zeros(directions), 0.0, 0.0, 0.0, self.law.length),
            np.zeros(len(sigma), np.int64),
        )

    def step(self, state: Strips, dq, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] in dt [s] under s0 to s1 (m,) [Pa].

        The mean traction is exact for p = 1 stretch. Otherwise it comes from five Gauss points, and its part along the
        increment in the stretch reading from the energy, so that no step creates any.
        """
        dq = np.atleast_1d(np.asarray(dq, float))
        after = self.carried(state, dq, s0, s1, dt)
        before, end = self.stored(state), self.stored(after)
        gain = end - before
        if not dq.any():
            return Step(self.traction(after), -gain, after)
        if self._closed:
            middle = self._middle(state, dq, dt)
            bonds = BondState(self._moments(state), middle, state.play)
            increment = dq[0] if len(dq) == 1 else dq
            mean = move_bonds(self.law, bonds, increment, (s0 + s1) / 2, middle).mean
            mean = self.law.static / self.law.length * np.reshape(mean, (len(dq), -1))
        elif self.law.reading == "report":
            mean = self._along(state, dq, s0, s1, dt)[0]
        else:
            mean, spent = self._along(state, dq, s0, s1, dt)
            # bonds lost at the end of the step leave their energy to nobody: the force holds them until then
            held = (
                end
                if (s1 > 0).all()
                else self.stored(
                    self.carried(
                        state,
                        dq,
                        s0,
                        np.maximum(s1, np.finfo(float).tiny),
                        dt,
                        forming=(s0 + s1) / 2,
                    )
                )
            )
            path, e = direction(dq)
            own = (spent + held - before) / path
            mean = mean + e[:, None] * (own - e @ mean) if len(dq) > 1 else e[:, None] * own
        return Step(_squeezed(mean), dq @ mean - gain, after)

    def _along(self, state: Strips, dq, s0, s1, dt: float) -> tuple:
        """(mean traction (d, m) [Pa], dissipated energy (m,) [J/m2]) of an increment. The latter holds in the stretch
        reading, where damage takes the share dR/eps of what is stored and so never less than nothing."""
        middle, path = self._middle(state, dq, dt), direction(dq)[0]
        length = self._damaging(state, dq, middle)[0] / middle
        free, edges = (
            1 - length * middle / path,
            np.unique(np.append(np.minimum(PANELS, length), length)),
        )
        if self.law.reading == "report":
            free, length, edges = 0.0, 1.0, np.array([0.0, 1.0])
        mean, spent = np.zeros((len(dq), len(s0))), np.zeros(len(s0))
        for a, b in pairwise(edges):
            for place, w in zip((a + b + (b - a) * _NODES) / 2, (b - a) / 2 * _WEIGHTS):
                part = free + (1 - free) * place / length
                here = self.carried(
                    state, part * dq, s0, s0 + part * (s1 - s0), part * dt, forming=(s0 + s1) / 2
                )
                sums = self.law.static * self._sums(here)
                mean, spent = mean + w / length * sums[:-1], spent + w * sums[-1]
        return mean, spent

    def press(self, state: Strips, s0, s1) -> Step:
        """The pressure at rest goes from s0 to s1 (m,) [Pa] on a line; mean: the traction after it.

        As printed, a bond keeps the pressure it formed under and none forms at rest. In the stretch reading with p = 1
        the rule is that of `recursion.press_bonds`; with another order the last-formed bonds are let go first, one by one.
        """
        after = replace(state, alive=np.where(s1 > 0, state.alive, len(state.q)))
        if self.law.reading == "stretch":
            keep, more = (
                self._let_go(after, s0, s1) if not self._closed else self._thinned(after, s0, s1)
            )
            q, path, damage, growth, mature = state.now
            new = (q, path, damage, growth, mature, np.zeros(1), 0.0, mature)
            after = _joined(after, new, np.zeros(2), np.where(s1 > 0, more, 0.0))
            after = replace(after, sigma=np.vstack([state.sigma * keep, after.sigma[-1:]]))
        return Step(self.traction(after), self.stored(state) - self.stored(after), after)

    def _thinned(self, state: Strips, s0, s1) -> tuple:
        """Factor (m,) on all bonds and density (m,) [Pa] of a cohort (below 0: bonds without stretch that are gone)
        that have the moments of `pressed`."""
        before = self._moments(state)
        m, _, s2 = before
        dense, _, kept = press_bonds(self.law, before, s0, s1)
        keep = np.divide(kept, s2, out=np.ones_like(s2), where=s2 > 0)
        return keep, dense - keep * m

    def _let_go(self, state: Strips, s0, s1) -> tuple:
        """Factors (k, m) on the bonds where the pressure falls, the last-formed first, and density (m,) of the cohort
        of bonds that re-form: those that rise with the pressure or would keep more than mu_s sigma."""
        mass = _young(state) * state.sigma * surviving(state)[:, None]
        falls, total = s1 < s0, mass.sum(axis=0)
        excess = np.where(falls & (s0 > 0), total * (1 - s1 / np.where(s0 > 0, s0, 1.0)), 0.0)
        younger = np.cumsum(mass[::-1], axis=0)[::-1] - mass
        gone = np.clip(excess - younger, 0.0, mass)
        keep = 1 - np.divide(gone, mass, out=np.zeros_like(mass), where=mass > 0)
        held = np.abs(self.weights(state)[:, 0] @ (_young(state) * state.sigma * keep))
        bound = np.where(falls & (held > s1), s1 / np.where(held > 0, held, 1.0), 1.0)
        left = (mass * keep).sum(axis=0)
        return keep * bound, np.where(
            falls, (1 - bound) * left, self.law.initial * np.maximum(s1 - s0, 0.0)
        )

    @property
    def _closed(self) -> bool:
        return self.law.order == 1 and self.law.reading == "stretch"

    def _moments(self, state: Strips) -> np.ndarray:
        """(d + 2, m): m, z, s2 of `recursion`, in the stretch reading with p = 1."""
        sums = self._sums(state) * self.law.length
        sums[-1] *= 2
        return np.vstack([_summed(state, surviving(state)[:, None]), sums])

    def carried(self, state: Strips, dq, s0, s1, dt: float, forming=None) -> Strips:
        """The bonds after an increment, the state that `step` gives at a tenth of its cost or less, without its means;
        forming (m,) [Pa]: the pressure of the new ones, the mean of both ends where it is not given."""
        (q, path, damage, growth, mature), law = state.now, self.law
        dq = np.atleast_1d(np.asarray(dq, float))
        distance = direction(dq)[0]
        speed = distance / dt if dt > 0 else 0.0
        middle = self._middle(state, dq, dt)
        length, way, play = self._damaging(state, dq, middle)
        total = sum(growth_exponents(law, speed, speed, distance, dt)) if law.grows else 0.0
        now = (
            q + dq,
            path + length,
            damage + length / middle,
            growth + total,
            grow(law, mature, speed, speed, distance, dt),
        )
        after = replace(
            state,
            now=now,
            play=play,
            alive=np.where(s1 > 0, state.alive, len(state.q) + (length != 0)),
        )
        if length == 0:
            return after
        sigma = (s0 + s1) / 2 if forming is None else forming
        return self._cut(
            _joined(after, (*now, way, length, middle), (total, now[4] - mature), sigma)
        )

    def _damaging(self, state: Strips, dq, middle: float) -> tuple:
        """(length [m], direction (d,), play after it) of the part of an increment in which bonds form and break."""
        if len(dq) > 1:
            return *direction(dq), state.play
        _, damaging, play = elastic_part(self.law, state.play, float(dq[0]), middle)
        return abs(damaging), np.sign([damaging]), play

    def _middle(self, state: Strips, dq, dt: float) -> float:
        """Bond length [m] half way through an increment, which the bonds that form on it have."""
        half = direction(dq)[0] / 2
        speed = 2 * half / dt if dt > 0 else 0.0
        return grow(self.law, state.now[4], speed, speed, half, dt / 2)

    def _cut(self, state: Strips) -> Strips:
        if self.tail <= 0:
            return state
        reach, stretched = cutoff(self.law.order, self.tail), self.law.reading == "stretch"
        old, now = (
            (state.damage, state.now[2])
            if stretched
            else (state.path / self.law.length, state.now[1] / self.law.length)
        )
        first = int(np.searchsorted(old, now - reach))
        # copying the rest is worth it only when half of it is gone
        if first < max(64, len(state.q) // 2):
            return state
        kept = {name: getattr(state, name)[first:] for name in (*COLUMNS, "sigma")}
        return replace(
            state,
            **kept,
            gain=state.gain[:, first:],
            alive=np.maximum(state.alive - first, 0),
            dropped=state.dropped + first,
        )

    def weights(self, state: Strips) -> np.ndarray:
        """(k, d + 1) of each entry: signed weights [1], tau = mu_s sum_k weight_k sigma_k, and stored energy [m],
        V = mu_s sum_k energy_k sigma_k."""
        return weights(state, self.law)

    def _sums(self, state: Strips) -> np.ndarray:
        """(d + 1, m): traction over mu_s [Pa], stored energy over mu_s [Pa m]."""
        return _summed(state, self.weights(state))

    def traction(self, state: Strips) -> np.ndarray:
        """tau [Pa], positive against positive slip: (m,) along a line, (2, m) in a plane."""
        return self.law.static * _squeezed(self._sums(state)[:-1])

    def stored(self, state: Strips) -> np.ndarray:
        """Elastic energy per area (m,) [J/m2] of the bonds of a state, at the damage of the moment."""
        return self.law.static * self._sums(state)[-1]


def _joined(state: Strips, new: tuple, gain, sigma) -> Strips:
    """The strips and one more: its entries of COLUMNS, what grew on it (2,) and its pressures (m,) [Pa]."""
    columns = {
        name: np.concatenate([getattr(state, name), np.asarray(value, float)[None]])
        for name, value in zip(COLUMNS, new)
    }
    return replace(
        state,
        **columns,
        gain=np.append(state.gain, np.reshape(gain, (2, 1)), axis=1),
        sigma=np.vstack([state.sigma, sigma]),
    )


def _young(state: Strips) -> np.ndarray:
    """(k, m): whether an entry still holds at a point."""
    return np.arange(len(state.q))[:, None] >= state.alive


def _summed(state: Strips, each) -> np.ndarray:
    """(c, m) sums of weights (k, c) times the pressures of the bonds that still hold."""
    if not state.alive.any():
        return each.T @ state.sigma
    return each.T @ (state.sigma * _young(state))


def _squeezed(vectors):
    """Vectors (d, m) as numbers (m,) along a line."""
    return vectors[0] if len(vectors) == 1 else vectors
