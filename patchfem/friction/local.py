"""Laws of the last increment: Coulomb, the rate law 2.4, and the elastic-plastic law 3.12 with its reversal.

As printed, 3.12 sets dF/dt = 0 for |F| > mu N and so never unloads; here it is zero only while sliding goes on.
A law is start(sigma) -> state, step(state, dq, s0, s1, dt) -> Step for an increment of slide over a pressure that
changes along the way, and press(state, s0, s1) -> Step for a pressure that changes in time at rest. None of them
changes the state it was given. No traction outlives the contact, and at rest none exceeds mu sigma.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np


class Step(NamedTuple):
    """mean: (m,) path-mean traction [Pa]; dissipated: (m,) energy per area [J/m2]; state: after the step."""

    mean: np.ndarray
    dissipated: np.ndarray
    state: object


@dataclass(frozen=True, slots=True)
class Coulomb:
    """Set-valued kinetic friction under prescribed motion; at rest the last traction is kept.

    `static` is what the contact carries at the instant a rest ends (`breaking`); it does no work.
    """

    kinetic: float
    static: float | None = None
    at_once: ClassVar[bool] = True  # nothing stretches: a changing load is taken along with the motion

    def start(self, sigma):
        """State: the last traction (m,) [Pa], 0 before any motion."""
        return np.zeros_like(sigma)

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] under pressure s0 -> s1 (m,) [Pa]."""
        if dq == 0:
            return Step(state, np.zeros_like(s0), state)
        mean = self.kinetic * (s0 + s1) / 2 * np.sign(dq)
        return Step(mean, mean * dq, self.kinetic * s1 * np.sign(dq))

    def press(self, state, s0, s1) -> Step:
        """The pressure at rest goes from s0 to s1 (m,) [Pa]; mean: the traction after it."""
        held = np.clip(state, -self.kinetic * s1, self.kinetic * s1)
        return Step(held, np.zeros_like(held), held)

    def breaking(self, sigma, direction: float):
        """Traction (m,) [Pa] under sigma at the instant a rest ends in a motion of this sign."""
        return (self.kinetic if self.static is None else self.static) * sigma * direction

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
    at_once: ClassVar[bool] = True

    def start(self, sigma):
        """State: the last traction (m,) [Pa], 0 before any motion."""
        return np.zeros_like(sigma)

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] in dt [s] under pressure s0 -> s1 (m,) [Pa]; a jump in no time has no speed
        limit."""
        part = np.tanh(dq / dt / self.speed) if dt > 0 else np.sign(dq)
        mean = self.static * (s0 + s1) / 2 * part
        return Step(mean, mean * dq, self.static * s1 * part)

    def press(self, state, s0, s1) -> Step:
        """The pressure at rest goes from s0 to s1 (m,) [Pa]; mean: the traction after it."""
        held = np.clip(state, -self.static * s1, self.static * s1)
        return Step(held, np.zeros_like(held), held)

    def traction(self, state):
        """Traction (m,) [Pa] at the end of the last step."""
        return state

    def stored(self, state):
        """Elastic energy per area (m,) [J/m2]: none."""
        return np.zeros_like(state)


@dataclass(frozen=True, slots=True)
class ElasticPlastic:
    """Eq. 3.12 per point: springs of stiffness mu sigma/length up to mu sigma, elastic again on reversal.

    Springs come unstressed where the pressure rises and go where slip breaks them, within one length of slip; a falling
    pressure only lowers the limit. So no pressure creates energy, and a force below the limit holds still.
    """

    static: float
    length: float

    def start(self, sigma):
        """State: (traction/mu, density of springs), (2, m) [Pa]."""
        return np.stack([np.zeros_like(sigma), sigma])

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] at the mean pressure of its ends; mean traction of the clipped ramp."""
        sigma = (s0 + s1) / 2
        y0, springs = self._at(state, sigma)
        move = springs * dq / self.length
        y1 = np.clip(y0 + move, -sigma, sigma)
        ramp = np.divide(y1 - y0, move, out=np.zeros_like(y0), where=move != 0)
        mean = np.where(move != 0, ramp * (y0 + y1) / 2 + (1 - ramp) * y1, y0)
        left = np.minimum(sigma, springs)
        springs = left + (springs - left) * np.exp(-(1 - ramp) * abs(dq) / self.length)
        bare = s1 <= 0  # bonds are lost where no pressure holds them
        after = np.stack([np.where(bare, 0.0, y1), np.where(bare, 0.0, springs)])
        spent = self.static * mean * dq - (self.stored(after) - self.stored(state))
        return Step(self.static * mean, spent, after)

    def press(self, state, s0, s1) -> Step:
        """The pressure at rest goes from s0 to s1 (m,) [Pa]; mean: the traction after it."""
        after = np.stack(self._at(state, s1))
        return Step(self.static * after[0], self.stored(state) - self.stored(after), after)

    def _at(self, state, sigma):
        """Traction/mu and density of springs under another pressure; without any both are gone."""
        y, springs = state
        return np.clip(y, -sigma, sigma), np.where(sigma > 0, np.maximum(springs, sigma), 0.0)

    def traction(self, state):
        """Traction (m,) [Pa]."""
        return self.static * state[0]

    def stored(self, state):
        """Elastic energy per area (m,) [J/m2]."""
        y, springs = state
        return self.static * self.length * np.divide(y**2, 2 * springs, out=np.zeros_like(y), where=springs > 0)
