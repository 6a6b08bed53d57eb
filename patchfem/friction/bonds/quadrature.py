"""Direct sum over all bonds on the path of a point (eq. 2.17), on a line or in a plane.

Each step of the path is one straight strip of bonds that formed at the mean pressure of its ends. In rigid sliding
all points have the same path, so a strip holds scalars of the path and one pressure per point; `strips` integrates over
them. A line is a plane with one component: positions, directions and tractions have d = 1 or 2 components throughout.

Readings (`Bonds.reading`). "report" is eqs. 2.14-2.17 as printed there: (R/eps)^p exp(-R/eps) against the direction
u/|u| of the displacement since the bond formed, every bond growing its own length from zero (2.10); the path element is
|v| dt, not the signed dX1 of the print. "stretch" separates stretch from damage: (|u|/eps)^p exp(-int dR/eps), eps in
the power frozen when the bond forms; it agrees with "report" on every path without a reversal and never creates energy
for p >= 0.

Bonds older than `cutoff_age` bond lengths of path are left out; what they could carry is at most `tail` of mu_s sigma.

Energy. A bond stores what it gives back when its stretch goes to zero at the current damage: f u/(p + 1) for "stretch",
f u for "report", whose force does not depend on the stretch. The dissipated energy of a step is its work minus the gain
in stored energy; for "report" it is sometimes negative, which means that energy is created.

Compiled form, along a line: `list_kernels`.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..protocol import Step
from .list_numbers import cutoff_age
from .parameters import Bonds, grow, growth_exponents, split_elastic
from .recursion import BondState, length_and_direction, move_bonds, press_bonds, refuse_directions
from .strips import COLUMNS, Strips, strip_weights, surviving_density

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
# ends of the panels of a step in bond lengths, with five Gauss points per panel
PANEL_ENDS = (0, 1, 2, 4, 8, 16, 32)


@dataclass(frozen=True, slots=True)
class Quadrature:
    """Law object that evaluates eq. 2.17 directly.

    `tail` bounds the fraction of the friction limit that the cut-off leaves out; 0 keeps every bond.

    Along a line increments are numbers and tractions (m,) [Pa]; in a plane they are (2,) and (2, m), positive against
    slip.
    """

    law: Bonds
    tail: float = 1e-9

    def start(self, sigma, directions: int = 1) -> Strips:
        """Return the initial cohort: unstressed, full-grown bonds under sigma (m,) [Pa].

        Their density is m_0. Raises PatchfemError for a law that is not defined in two directions.
        """
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
        """Advance by a straight increment dq [m] in dt [s]; pressure from s0 to s1 (m,) [Pa].

        The mean traction is exact for reading="stretch" and p = 1. Otherwise it comes from five Gauss points. For
        reading="stretch" its component along the increment comes from the energy, so no step creates energy.
        """
        dq = np.atleast_1d(np.asarray(dq, float))
        after = self.advance(state, dq, s0, s1, dt)
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
            # energy of bonds that are lost at the end of the step, as they still act during the step
            held = (
                end
                if (s1 > 0).all()
                else self.stored(
                    self.advance(
                        state,
                        dq,
                        s0,
                        np.maximum(s1, np.finfo(float).tiny),
                        dt,
                        forming=(s0 + s1) / 2,
                    )
                )
            )
            path, e = length_and_direction(dq)
            own = (spent + held - before) / path
            mean = mean + e[:, None] * (own - e @ mean) if len(dq) > 1 else e[:, None] * own
        return Step(_squeezed(mean), dq @ mean - gain, after)

    def _along(self, state: Strips, dq, s0, s1, dt: float) -> tuple:
        """Integrate the mean traction (d, m) [Pa] and dissipated energy (m,) [J/m2] of an increment.

        The energy holds for reading="stretch", where damage dissipates the fraction dR/eps of the stored energy, which is
        never negative.
        """
        middle, path = self._middle(state, dq, dt), length_and_direction(dq)[0]
        length = self._damaging(state, dq, middle)[0] / middle
        free, edges = (
            1 - length * middle / path,
            np.unique(np.append(np.minimum(PANEL_ENDS, length), length)),
        )
        if self.law.reading == "report":
            free, length, edges = 0.0, 1.0, np.array([0.0, 1.0])
        mean, spent = np.zeros((len(dq), len(s0))), np.zeros(len(s0))
        for a, b in pairwise(edges):
            for place, w in zip((a + b + (b - a) * _NODES) / 2, (b - a) / 2 * _WEIGHTS):
                part = free + (1 - free) * place / length
                here = self.advance(
                    state, part * dq, s0, s0 + part * (s1 - s0), part * dt, forming=(s0 + s1) / 2
                )
                sums = self.law.static * self._sums(here)
                mean, spent = mean + w / length * sums[:-1], spent + w * sums[-1]
        return mean, spent

    def press(self, state: Strips, s0, s1) -> Step:
        """Change the pressure at rest linearly from s0 to s1 (m,) [Pa].

        The mean of the Step is the traction after it.

        For reading="report" a bond keeps the pressure at which it formed, and none forms at rest. For reading="stretch"
        and p = 1 the rule is that of `recursion.press_bonds`; with another order the last-formed bonds are lost first,
        one by one.
        """
        after = replace(state, alive=np.where(s1 > 0, state.alive, len(state.q)))
        if self.law.reading == "stretch":
            keep, more = (
                self._release_last_formed(after, s0, s1)
                if not self._closed
                else self._thinned(after, s0, s1)
            )
            q, path, damage, growth, mature = state.now
            new = (q, path, damage, growth, mature, np.zeros(1), 0.0, mature)
            after = _joined(after, new, np.zeros(2), np.where(s1 > 0, more, 0.0))
            after = replace(after, sigma=np.vstack([state.sigma * keep, after.sigma[-1:]]))
        return Step(self.traction(after), self.stored(state) - self.stored(after), after)

    def _thinned(self, state: Strips, s0, s1) -> tuple:
        """Return the factor (m,) on all bonds and the density (m,) [Pa] of an added cohort.

        Together they have the moments of `press_bonds`. A negative density removes unstretched bonds.
        """
        before = self._moments(state)
        m, _, s2 = before
        dense, _, kept = press_bonds(self.law, before, s0, s1)
        keep = np.divide(kept, s2, out=np.ones_like(s2), where=s2 > 0)
        return keep, dense - keep * m

    def _release_last_formed(self, state: Strips, s0, s1) -> tuple:
        """Return the surviving fraction (k, m) of the bonds and the re-formed density (m,) [Pa].

        Where the pressure falls, the last-formed bonds are lost first. Bonds re-form unstretched where the pressure
        rises, or where the remaining ones would carry more than mu_s sigma.
        """
        mass = _young(state) * state.sigma * surviving_density(state)[:, None]
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
        """Return m, z, s2 of `recursion`, (d + 2, m), for reading="stretch" with p = 1."""
        sums = self._sums(state) * self.law.length
        sums[-1] *= 2
        return np.vstack([_summed(state, surviving_density(state)[:, None]), sums])

    def advance(self, state: Strips, dq, s0, s1, dt: float, forming=None) -> Strips:
        """Return the bonds after an increment, without the means that `step` computes.

        This takes at most a tenth of the time of `step`. forming (m,) [Pa]: pressure at which new bonds form; by default
        the mean of s0 and s1.
        """
        (q, path, damage, growth, mature), law = state.now, self.law
        dq = np.atleast_1d(np.asarray(dq, float))
        distance = length_and_direction(dq)[0]
        speed = distance / dt if dt > 0 else 0.0
        middle = self._middle(state, dq, dt)
        length, way, play = self._damaging(state, dq, middle)
        total = sum(growth_exponents(law, speed, speed, distance, dt)) if law.has_growth else 0.0
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
        """Return length [m], direction (d,) and final play of the damaging part of an increment.

        In this part bonds form and break.
        """
        if len(dq) > 1:
            return *length_and_direction(dq), state.play
        _, damaging, play = split_elastic(self.law, state.play, float(dq[0]), middle)
        return abs(damaging), np.sign([damaging]), play

    def _middle(self, state: Strips, dq, dt: float) -> float:
        """Return the bond length [m] in the middle of an increment, which new bonds have."""
        half = length_and_direction(dq)[0] / 2
        speed = 2 * half / dt if dt > 0 else 0.0
        return grow(self.law, state.now[4], speed, speed, half, dt / 2)

    def _cut(self, state: Strips) -> Strips:
        if self.tail <= 0:
            return state
        reach, stretched = cutoff_age(self.law.order, self.tail), self.law.reading == "stretch"
        old, now = (
            (state.damage, state.now[2])
            if stretched
            else (state.path / self.law.length, state.now[1] / self.law.length)
        )
        first = int(np.searchsorted(old, now - reach))
        # copying pays only when at least half of the strips can be dropped
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
        """Return signed weights [1] and stored energy [m] of each entry, (k, d + 1).

        The traction is mu_s sum_k weight_k sigma_k, the stored energy mu_s sum_k energy_k sigma_k.
        """
        return strip_weights(state, self.law)

    def _sums(self, state: Strips) -> np.ndarray:
        """Return traction / mu_s [Pa] and stored energy / mu_s [Pa m], (d + 1, m)."""
        return _summed(state, self.weights(state))

    def traction(self, state: Strips) -> np.ndarray:
        """Return the traction [Pa], positive against slip: (m,) along a line, (2, m) in a plane."""
        return self.law.static * _squeezed(self._sums(state)[:-1])

    def stored(self, state: Strips) -> np.ndarray:
        """Return the elastic energy per area (m,) [J/m2] of the bonds at the current damage."""
        return self.law.static * self._sums(state)[-1]


def _joined(state: Strips, new: tuple, gain, sigma) -> Strips:
    """Append a strip: the entries of COLUMNS, its gain (2,) and its pressures (m,) [Pa]."""
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
    """Return whether each entry still acts at each point, (k, m) bool."""
    return np.arange(len(state.q))[:, None] >= state.alive


def _summed(state: Strips, each) -> np.ndarray:
    """Sum weights (k, c) times the pressures of the bonds that still act; returns (c, m)."""
    if not state.alive.any():
        return each.T @ state.sigma
    return each.T @ (state.sigma * _young(state))


def _squeezed(vectors):
    """Return vectors (d, m) as an array (m,) along a line, unchanged in a plane."""
    return vectors[0] if len(vectors) == 1 else vectors
