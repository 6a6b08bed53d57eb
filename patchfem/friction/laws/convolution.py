"""Friction law that averages the pressure along the path behind each point; eq. 2.17 extends it.

Source: Oden and Pires, J. Appl. Mech. 50, 67, 1983.

    tau(x) = mu_s sgn(v) int_0^inf phi(s/eps)/eps sigma_n(x - s sgn v) ds,   phi as in eq. 2.14

The law is set-valued at rest, where the last traction stays, and its only memory is the sign of the last motion. If the
pressure stays on the lower piece, eq. 2.17 tends to this law in a steady motion over several bond lengths. If the
pressure moves with the upper piece, eq. 2.17 tends to mu_s sigma_n, and both laws differ.

sigma_n is linear between its nodes and 0 outside; the integral is exact, by incomplete gamma functions. Bonds are lost
where the pressure vanishes: such a point carries nothing, and the average ends at the first segment behind a point on
which the pressure is 0.
"""

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.special import gammainc, gammainccinv

from ..protocol import Step

# Number of positions that are averaged at a time; nodes beyond the cut-off of the whole block are
# left out
N_POSITIONS_PER_BLOCK = 64
# Largest weight of a node beyond the cut-off in an average; it is below round-off
CUTOFF_WEIGHT = 1e-20


class ConvolutionState(NamedTuple):
    """State of the friction law that averages the pressure.

    - traction (m,): traction [Pa] of the last motion
    - displacement: relative displacement [m] since the start
    - direction: sign of the last motion; 0 if the traction is no longer at the limit of this motion
    """

    traction: np.ndarray
    displacement: float
    direction: float


class SlidingLimits(NamedTuple):
    """Friction force / mu_s [N] in rigid sliding towards +x and towards -x, both >= 0."""

    forward: float
    backward: float


def _bond_gammainc(order: float, x):
    """Return P(order + 1, x), the regularised lower incomplete gamma function.

    It is elementary for the orders 0, 1 and 2.
    """
    if order not in (0, 1, 2):
        return gammainc(order + 1, x)
    decay = np.exp(-x)
    value = -np.expm1(-x)
    if order >= 1:
        value = value - x * decay
    if order == 2:
        value = value - x * x * decay / 2
    return value


def _node_weights(positions, nodes, is_bare, length: float, order: float) -> np.ndarray:
    """Return the weights (n, m) of the nodes in the averages at positions (n,), for sliding towards +x.

    is_bare (m - 1,): whether a segment between two nodes has no pressure; nothing is averaged beyond it.
    """
    # The average is over the path behind a position: distances s >= 0 to the nodes below it
    distance = positions[:, None] - nodes
    x = np.maximum(distance, 0.0) / length
    # These are the integrals of phi and of phi s over each segment; the pressure is linear between
    # its two nodes.
    zeroth = -np.diff(_bond_gammainc(order, x), axis=1)
    first = -(order + 1) * length * np.diff(_bond_gammainc(order + 1, x), axis=1)
    second_node = (distance[:, :-1] * zeroth - first) / np.diff(nodes)

    segment = np.clip(np.searchsorted(nodes, positions) - 1, 0, nodes.size - 2)
    # Segments without pressure divide the interface into islands; only the island of a position
    # contributes to its average.
    island = np.concatenate([[0], np.cumsum(is_bare[1:] != is_bare[:-1])])
    is_beyond = positions > nodes[-1]
    is_averaged = (island == island[segment][:, None]) & ~is_bare & ~is_beyond[:, None]
    weights = np.zeros((positions.size, nodes.size))
    weights[:, :-1] += np.where(is_averaged, zeroth - second_node, 0.0)
    weights[:, 1:] += np.where(is_averaged, second_node, 0.0)
    return weights


def average_pressure(
    positions, nodes, sigma, direction: float, length: float, order: float
) -> np.ndarray:
    """Average the pressure behind positions with the weight phi, by the equation in the module docstring.

    Parameters
    ----------
    positions : (n,) array
        Positions [m].
    nodes : (m,) array
        Increasing positions [m] of the nodes.
    sigma : (m,) array
        Pressure [Pa] >= 0 at the nodes, linear between them and 0 outside.
    direction : float
        Sign of the motion; +1 averages over x below the position.
    length, order : float
        Bond length eps [m] and exponent p > -1.

    Returns
    -------
    (n,) array
        Average [Pa], exact but for nodes so far behind that their weight is below CUTOFF_WEIGHT.
    """
    positions, nodes, sigma = (np.asarray(part, float) for part in (positions, nodes, sigma))
    if direction < 0:
        return average_pressure(-positions, -nodes[::-1], sigma[::-1], 1.0, length, order)
    is_bare = (sigma[1:] <= 0) & (sigma[:-1] <= 0)
    cutoff = length * float(gammainccinv(order + 2, CUTOFF_WEIGHT))

    # Blocks of positions bound the memory; nodes whose weight is below round-off are left out
    averages = np.zeros(positions.size)
    for first in range(0, positions.size, N_POSITIONS_PER_BLOCK):
        block = positions[first : first + N_POSITIONS_PER_BLOCK]
        low = max(int(np.searchsorted(nodes, block.min() - cutoff)) - 1, 0)
        high = max(int(np.searchsorted(nodes, block.max())) + 1, low + 2)
        node_range = slice(low, high) if nodes[low:high].size > 1 else slice(-2, None)
        segments = is_bare[node_range.start :][: nodes[node_range].size - 1]
        weights = _node_weights(block, nodes[node_range], segments, length, order)
        averages[first : first + N_POSITIONS_PER_BLOCK] = weights @ sigma[node_range]
    return averages


def sliding_limits(nodes, sigma, weight, length: float, order: float) -> SlidingLimits:
    """Return the friction forces / mu_s in rigid sliding in both directions.

    They differ where the pressure is not symmetric: each lacks what its own trailing edge would carry.

    Parameters
    ----------
    nodes : (m,) array
        Increasing positions [m] of the nodes.
    sigma : (m,) array
        Pressure [Pa] >= 0 at the nodes, linear between them and 0 outside.
    weight : (m,) array
        Areas [m2] of the nodes.
    length, order : float
        Bond length eps [m] and exponent p > -1.

    Returns
    -------
    SlidingLimits
    """
    weight = np.where(np.asarray(sigma) > 0, weight, 0.0)
    forward = weight @ average_pressure(nodes, nodes, sigma, 1.0, length, order)
    backward = weight @ average_pressure(nodes, nodes, sigma, -1.0, length, order)
    return SlidingLimits(float(forward), float(backward))


@dataclass(frozen=True, eq=False, slots=True)
class Convolution:
    """Friction law whose traction is proportional to a weighted average of the pressure.

    - static, length, order: mu_s [1], eps [m] and p
    - nodes (m,): positions [m] of the points of the upper piece; None for a uniform pressure, whose average is the
      pressure itself (Coulomb's law)
    - lower_pressure (m,): pressure [Pa] at these positions of the lower piece if it stays there; None if it moves with
      the upper piece
    - cache: last pressure and its average, per direction
    """

    static: float
    length: float
    order: float = 1.0
    nodes: np.ndarray | None = None
    lower_pressure: np.ndarray | None = None
    cache: dict[float, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    can_change_load: ClassVar[bool] = True  # the law has no stretch
    has_force_at_rest: ClassVar[bool] = True  # the traction persists while the interface rests

    def initial_state(self, sigma) -> ConvolutionState:
        """Return the state before any motion: zero traction, under a pressure sigma (m,) [Pa]."""
        return ConvolutionState(np.zeros_like(sigma), 0.0, 0.0)

    def limit_fraction(self, dq, dt):
        """Return the ratio of the friction force to its limit for increments dq [m]; 0 at rest."""
        return np.sign(dq)

    def limit(self, sigma, direction: float):
        """Return the traction (m,) [Pa], >= 0, that resists sliding in a given direction.

        The pressure sigma (m,) [Pa] moves with the upper piece.
        """
        return self.static * self._average(0.0, sigma, direction)

    def step(self, state: ConvolutionState, dq: float, s0, s1, dt: float) -> Step:
        """Advance the law by an increment; all friction work is dissipated.

        The mean traction is that of the two ends of the increment. Without motion the traction stays.

        Parameters
        ----------
        state : ConvolutionState
            Last traction, displacement and direction.
        dq : float
            Increment [m].
        s0, s1 : (m,) array
            Pressures [Pa] at the ends.
        dt : float
            Not used.

        Returns
        -------
        Step
        """
        if dq == 0:
            return Step(state.traction, np.zeros_like(s0), state)
        direction = float(np.sign(dq))
        displacement = state.displacement + dq
        start = state.traction
        if direction != state.direction:
            start = self.static * direction * self._average(state.displacement, s0, direction)
        end = self.static * direction * self._average(displacement, s1, direction)
        mean = (start + end) / 2
        return Step(mean, mean * dq, ConvolutionState(end, displacement, direction))

    def press(self, state: ConvolutionState, s0, s1) -> Step:
        """Change the pressure at rest; a traction above the new friction limit is reduced to this limit.

        Parameters
        ----------
        state : ConvolutionState
            Last traction, displacement and direction.
        s0, s1 : (m,) array
            Pressures [Pa] before and after.

        Returns
        -------
        Step
            Its mean is the traction after the change; nothing is dissipated.
        """
        direction = float(np.sign(state.traction.sum()))
        traction = state.traction
        if direction != 0:
            limit = self.static * self._average(state.displacement, s1, direction)
            traction = direction * np.minimum(direction * traction, limit)
        after = ConvolutionState(traction, state.displacement, 0.0)
        return Step(traction, np.zeros_like(traction), after)

    def _average(self, displacement: float, sigma, direction: float):
        """Return the average (m,) [Pa] of the pressure behind the points, or 0 where sigma is 0."""
        if self.nodes is None:
            return sigma
        if self.lower_pressure is not None:
            positions = self.nodes + displacement
            average = self._average_at(positions, self.lower_pressure, direction)
            return np.where(sigma > 0, average, 0.0)
        pressure, average = self.cache.get(direction, (None, None))
        if pressure is None or not np.array_equal(pressure, sigma):
            average = self._average_at(self.nodes, sigma, direction)
            self.cache[direction] = np.array(sigma), average
        return np.where(sigma > 0, average, 0.0)

    def _average_at(self, positions, sigma, direction: float) -> np.ndarray:
        """Return the average (n,) [Pa] at positions (n,) [m] of a pressure (m,) [Pa] at the nodes."""
        return average_pressure(positions, self.nodes, sigma, direction, self.length, self.order)

    def traction(self, state: ConvolutionState):
        """Return the traction (m,) [Pa] at the end of the last step, positive against slip to +x."""
        return state.traction

    def stored_energy(self, state: ConvolutionState):
        """Return the elastic energy per area (m,) [J/m2], which is 0."""
        return np.zeros_like(state.traction)
