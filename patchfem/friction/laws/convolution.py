"""Friction law with an average of the pressure behind a point, which the report extends.

Source: Oden and Pires, J. Appl. Mech. 50, 67, 1983.

    tau(x) = mu_s sgn(v) int_0^inf phi_p(s/eps)/eps sigma_n(x - s sgn v) ds,   phi_p as in 2.14

It has no memory but the last sign of the motion: set-valued at rest, where the last traction is kept. On a pressure
that stays on the lower piece it is what 2.17 settles to in a steady slide longer than some bond lengths; on a pressure
that rides on the mover 2.17 settles to mu_s sigma_n itself, without this average, and the two laws differ.

sigma_n is linear between its nodes and 0 outside; the integral is exact, by incomplete gamma functions. Bonds are lost
where no pressure holds them: nothing is carried at bare places, and the average ends at the first bare stretch behind
a point.
"""

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.special import gammainc, gammainccinv

from ..protocol import Step

# number of positions averaged at a time, so that nodes out of their reach can be left out
N_POSITIONS_PER_BLOCK = 64


def _bond_gammainc(order: float, x):
    """Return P(order + 1, x), in closed form for the first orders."""
    if order in (0, 1, 2):
        e = np.exp(-x)
        return -np.expm1(-x) - (x * e if order else 0.0) - (x * x * e / 2 if order == 2 else 0.0)
    return gammainc(order + 1, x)


def _node_weights(places, nodes, bare, length: float, order: float) -> np.ndarray:
    """Return the weights (n, m) of the nodes in averages at positions (n,), for motion to +x.

    bare (m - 1,): segments without pressure, beyond which nothing is averaged.
    """
    behind = places[:, None] - nodes
    x = np.maximum(behind, 0.0) / length
    zero, one = (
        -np.diff(_bond_gammainc(order, x), axis=1),
        -np.diff(_bond_gammainc(order + 1, x), axis=1),
    )
    near = (behind[:, :-1] * zero - (order + 1) * length * one) / np.diff(nodes)
    own = np.clip(np.searchsorted(nodes, places) - 1, 0, nodes.size - 2)
    island = np.concatenate([[0], np.cumsum(bare[1:] != bare[:-1])])
    beyond = places > nodes[-1]  # no pressure holds a bond beyond the last node
    held = (island == island[own][:, None]) & ~bare & ~beyond[:, None]
    out = np.zeros((places.size, nodes.size))
    out[:, :-1] += np.where(held, zero - near, 0.0)
    out[:, 1:] += np.where(held, near, 0.0)
    return out


def average_pressure(places, nodes, sigma, way: float, length: float, order: float) -> np.ndarray:
    """Average the pressure behind the positions (n,) [m], weighted by phi_p; returns (n,) [Pa].

    This is the integral in the docstring of the module.

    nodes (m,) [m] rising, sigma (m,) [Pa] >= 0 linear between them and 0 outside; way: sign of the motion, +1 averages
    over x below the position; length: eps [m]; order: p > -1. Exact except for positions so far behind that they have
    less than a fraction 1e-20 of the weight. Source: Oden and Pires, J. Appl. Mech. 50, 67, 1983.
    """
    places, nodes, sigma = (np.asarray(part, float) for part in (places, nodes, sigma))
    if way < 0:
        return average_pressure(-places, -nodes[::-1], sigma[::-1], 1.0, length, order)
    bare = (sigma[1:] <= 0) & (sigma[:-1] <= 0)
    # further nodes have weights below round-off
    reach = length * float(gammainccinv(order + 2, 1e-20))
    out = np.zeros(places.size)
    for first in range(0, places.size, N_POSITIONS_PER_BLOCK):
        here = places[first : first + N_POSITIONS_PER_BLOCK]
        low = max(int(np.searchsorted(nodes, here.min() - reach)) - 1, 0)
        high = max(int(np.searchsorted(nodes, here.max())) + 1, low + 2)
        some = slice(low, high) if nodes[low:high].size > 1 else slice(-2, None)
        weights = _node_weights(
            here, nodes[some], bare[some.start :][: nodes[some].size - 1], length, order
        )
        out[first : first + N_POSITIONS_PER_BLOCK] = weights @ sigma[some]
    return out


def sliding_limits(nodes, sigma, weight, length: float, order: float) -> tuple:
    """Return friction force / mu_s [N] for rigid sliding towards +x and towards -x, both >= 0.

    nodes (m,) [m]; sigma (m,) [Pa]; weight: nodal areas (m,) [m2]; length: eps [m]; order: p. They differ where the
    pressure is not symmetric: each loses what its own trailing edge would carry.
    """
    on = np.asarray(sigma) > 0
    return tuple(
        float(
            np.asarray(weight)
            @ np.where(on, average_pressure(nodes, nodes, sigma, way, length, order), 0.0)
        )
        for way in (1.0, -1.0)
    )


class ConvolutionState(NamedTuple):
    """State of the averaged law.

    - traction (m,): traction of the last motion [Pa]
    - slide: relative displacement since the start [m]
    - way: sign of the last motion; 0 if the traction is no longer at the limit of this motion
    """

    traction: np.ndarray
    slide: float
    way: float


@dataclass(frozen=True, eq=False, slots=True)
class Convolution:
    """Law object of the averaged pressure.

    - nodes (m,): positions of the points of the mover [m]; None for a uniform pressure, whose average is the pressure
      itself (Coulomb's law)
    - pattern (m,): pressure at the same nodes of the lower piece if it stays there [Pa]; None if it moves with the mover
    """

    static: float
    length: float
    order: float = 1.0
    nodes: np.ndarray | None = None
    pattern: np.ndarray | None = None
    kept: dict = field(default_factory=dict)
    # the law has no stretch, so the load may change within a step of the motion
    can_change_load: ClassVar[bool] = True
    has_force_at_rest: ClassVar[bool] = True  # the last traction at rest

    def start(self, sigma) -> ConvolutionState:
        """Return the state before any motion: no traction, under a pressure sigma (m,) [Pa]."""
        return ConvolutionState(np.zeros_like(sigma), 0.0, 0.0)

    def limit_fraction(self, dq, dt):
        """Return the fraction of the limit that is carried in increments dq [m]; 0 at rest."""
        return np.sign(dq)

    def limit(self, sigma, way: float):
        """Return the traction (m,) [Pa], >= 0, that resists a motion of sign `way`.

        The pressure sigma (m,) [Pa] moves with the mover.
        """
        return self.static * self._averaged(0.0, sigma, way)

    def step(self, state: ConvolutionState, dq: float, s0, s1, dt: float) -> Step:
        """Advance by a straight increment dq [m] while the pressure changes from s0 to s1 (m,) [Pa].

        dt is not used.

        The mean traction is that of the two ends of the increment. All work is dissipated. At dq = 0 the traction
        stays.
        """
        if dq == 0:
            return Step(state.traction, np.zeros_like(s0), state)
        way, slide = float(np.sign(dq)), state.slide + dq
        start = state.traction
        if way != state.way:
            start = self.static * way * self._averaged(state.slide, s0, way)
        end = self.static * way * self._averaged(slide, s1, way)
        mean = (start + end) / 2
        return Step(mean, mean * dq, ConvolutionState(end, slide, way))

    def press(self, state: ConvolutionState, s0, s1) -> Step:
        """Change the pressure at rest from s0 to s1 (m,) [Pa]; the traction is cut to its new limit.

        The mean of the Step is the traction after it; nothing is dissipated.
        """
        way = float(np.sign(state.traction.sum()))
        held = state.traction
        if way != 0:
            held = way * np.minimum(way * held, self.static * self._averaged(state.slide, s1, way))
        return Step(held, np.zeros_like(held), ConvolutionState(held, state.slide, 0.0))

    def _averaged(self, slide: float, sigma, way: float):
        if self.nodes is None:
            return sigma
        if self.pattern is not None:
            behind = average_pressure(
                self.nodes + slide, self.nodes, self.pattern, way, self.length, self.order
            )
            return np.where(sigma > 0, behind, 0.0)
        before, behind = self.kept.get(way, (None, None))
        if before is None or not np.array_equal(before, sigma):
            behind = average_pressure(self.nodes, self.nodes, sigma, way, self.length, self.order)
            self.kept[way] = np.array(sigma), behind
        return np.where(sigma > 0, behind, 0.0)

    def traction(self, state: ConvolutionState):
        """Return the traction (m,) [Pa] at the end of the last step, > 0 against slip towards +x."""
        return state.traction

    def stored(self, state: ConvolutionState):
        """Return the elastic energy per area (m,) [J/m2]: zero, because the law has no stretch."""
        return np.zeros_like(state.traction)
