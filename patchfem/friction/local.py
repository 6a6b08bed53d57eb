"""Laws of the last increment: Coulomb, the rate law 2.4, and the elastic-plastic law 3.12 with its reversal.

As printed, 3.12 sets dF/dt = 0 for |F| > mu N and so never unloads; here it is zero only while sliding goes on.
A law is start(sigma) -> state and step(state, dq, s0, s1, dt) -> Step; stepping never changes the state it was given.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


class Step(NamedTuple):
    """mean: (m,) path-mean traction [Pa]; dissipated: (m,) energy per area [J/m2]; state: after the step."""

    mean: np.ndarray
    dissipated: np.ndarray
    state: object


@dataclass(frozen=True, slots=True)
class Coulomb:
    """Set-valued kinetic friction under prescribed motion; at rest the last traction is kept."""

    kinetic: float

    def start(self, sigma):
        """State: the last traction (m,) [Pa], 0 before any motion."""
        return np.zeros_like(sigma)

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] under pressure s0 -> s1 (m,) [Pa]."""
        if dq == 0:
            return Step(state, np.zeros_like(s0), state)
        mean = self.kinetic * (s0 + s1) / 2 * np.sign(dq)
        return Step(mean, mean * dq, self.kinetic * s1 * np.sign(dq))

    def traction(self, state):
        """Traction (m,) [Pa] at the end of the last step."""
        return state

    def stored(self, state):
        """Elastic energy per area (m,) [J/m2]: none."""
        return np.zeros_like(state)


@dataclass(frozen=True, slots=True)
class Rate:
    """Eq. 2.4 per point: tau = mu sigma tanh(v/v_0), taken at the mean speed of a step. It never holds: under a steady
    share f of the limit it creeps at v_0 atanh(f)."""

    static: float
    speed: float

    def start(self, sigma):
        """State: the last traction (m,) [Pa], 0 before any motion."""
        return np.zeros_like(sigma)

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] in dt [s] under pressure s0 -> s1 (m,) [Pa]; a jump in no time has no speed
        limit."""
        part = np.tanh(dq / (dt * self.speed)) if dt > 0 else np.sign(dq)
        mean = self.static * (s0 + s1) / 2 * part
        return Step(mean, mean * dq, self.static * s1 * part)

    def traction(self, state):
        """Traction (m,) [Pa] at the end of the last step."""
        return state

    def stored(self, state):
        """Elastic energy per area (m,) [J/m2]: none."""
        return np.zeros_like(state)


@dataclass(frozen=True, slots=True)
class ElasticPlastic:
    """Eq. 3.12 per point: stiffness mu sigma/length up to mu sigma, elastic again on reversal.

    Rising pressure leaves the traction as it is, falling pressure scales it down: neither creates energy.
    """

    static: float
    length: float

    def start(self, sigma):
        """State: (traction/mu, pressure), (2, m) [Pa]."""
        return np.stack([np.zeros_like(sigma), sigma])

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] at the mean pressure of its ends; mean traction of the clipped ramp."""
        held, before = state
        sigma = (s0 + s1) / 2
        shrink = np.where(before > 0, np.minimum(sigma / np.where(before > 0, before, 1.0), 1.0), 0.0)
        y0 = held * shrink
        lost = self._energy(held, before) - self._energy(y0, sigma)
        move = sigma * dq / self.length
        y1 = np.clip(y0 + move, -sigma, sigma)
        ramp = np.divide(y1 - y0, move, out=np.zeros_like(y0), where=move != 0)
        mean = ramp * (y0 + y1) / 2 + (1 - ramp) * y1
        sliding = self.static * np.abs(y1) * (1 - ramp) * abs(dq)
        mean = np.where(move != 0, mean, y0)
        bare = s1 <= 0  # bonds are lost where no pressure holds them
        lost = np.maximum(lost, 0.0) + np.where(bare, self._energy(y1, sigma), 0.0)
        return Step(self.static * mean, sliding + lost, np.stack([np.where(bare, 0.0, y1), np.where(bare, 0.0, sigma)]))

    def _energy(self, y, sigma):
        return self.static * self.length * np.divide(y**2, 2 * sigma, out=np.zeros_like(y), where=sigma > 0)

    def traction(self, state):
        """Traction (m,) [Pa]."""
        return self.static * state[0]

    def stored(self, state):
        """Elastic energy per area (m,) [J/m2]."""
        return self._energy(*state)
