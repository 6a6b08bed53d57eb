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

import numpy as np
from scipy.special import gammainc, gammainccinv

from .coulomb import Coulomb

# Number of positions that are averaged at a time; nodes beyond the cut-off of the whole block are
# left out
N_POSITIONS_PER_BLOCK = 64


def from_keys(friction, load: float) -> Coulomb:
    """Return Coulomb's law, which acts on the averaged pressure; load [N] is not used."""
    return Coulomb(friction.static, friction.static)


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


def compute_segment_weights(positions, nodes, length: float, order: float) -> np.ndarray:
    """Return the weights (n, m - 1, 2) of both nodes of each segment in the averages of a slide to +x.

    Parameters
    ----------
    positions : (n,) array
        Positions at which the averages are taken [m].
    nodes : (m,) array
        Positions of the nodes [m], increasing.
    length : float
        Bond length eps [m].
    order : float
        Order p of the kernel phi.
    """
    # The average is over the path behind a position: distances s >= 0 to the nodes below it
    distance = positions[:, None] - nodes
    x = np.maximum(distance, 0.0) / length
    # These are the integrals of phi and of phi s over each segment; the pressure is linear between
    # its two nodes.
    zeroth = -np.diff(_bond_gammainc(order, x), axis=1)
    first = -(order + 1) * length * np.diff(_bond_gammainc(order + 1, x), axis=1)
    second_node = (distance[:, :-1] * zeroth - first) / np.diff(nodes)
    return np.stack([zeroth - second_node, second_node], axis=2)


def _node_weights(positions, nodes, is_bare, length: float, order: float) -> np.ndarray:
    """Return the weights (n, m) of the nodes in the averages at positions (n,), for sliding towards +x.

    Parameters
    ----------
    positions : (n,) array
        Positions at which the averages are taken [m].
    nodes : (m,) array
        Positions of the nodes [m], increasing.
    is_bare : (m - 1,) array of bool
        Segments between two nodes that have no pressure. Nothing is averaged beyond them.
    length : float
        Bond length eps [m].
    order : float
        Order p of the kernel phi.
    """
    parts = compute_segment_weights(positions, nodes, length, order)
    segment = np.clip(np.searchsorted(nodes, positions) - 1, 0, nodes.size - 2)
    # Segments without pressure divide the interface into islands; only the island of a position
    # contributes to its average.
    island = np.concatenate([[0], np.cumsum(is_bare[1:] != is_bare[:-1])])
    is_beyond = positions > nodes[-1]
    is_averaged = (island == island[segment][:, None]) & ~is_bare & ~is_beyond[:, None]
    weights = np.zeros((positions.size, nodes.size))
    weights[:, :-1] += np.where(is_averaged, parts[:, :, 0], 0.0)
    weights[:, 1:] += np.where(is_averaged, parts[:, :, 1], 0.0)
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
        Average [Pa], exact but for nodes so far behind that their weight is below 1e-20.
    """
    positions, nodes, sigma = (np.asarray(part, float) for part in (positions, nodes, sigma))
    if direction < 0:
        return average_pressure(-positions, -nodes[::-1], sigma[::-1], 1.0, length, order)
    is_bare = (sigma[1:] <= 0) & (sigma[:-1] <= 0)
    # Nodes farther away than `cutoff` have weights below round-off. A pressure that is linear between two nodes multiplies
    # phi by a power of s, so that the incomplete gamma function of order p + 2 bounds these weights.
    cutoff = length * float(gammainccinv(order + 2, 1e-20))

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
