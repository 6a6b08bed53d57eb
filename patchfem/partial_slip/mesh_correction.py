"""Correct partial slip for the finite size of the elements by giving each friction element a range of yield displacements.

Slip starts where a contact carries least and proceeds from node to node. At a relative displacement below the first yield
displacement, a mesh shows no slip, and neither does a mesh of half as many nodes. The joint, however, dissipates energy
with the third power of a small displacement (Mindlin and Deresiewicz, J. Appl. Mech. 20, 327, 1953). The region that a
node represents slips over a range of displacements, which the yield displacements of its neighbours bound. The change of
a measure when the elements are spread over these ranges estimates its error.
"""

from typing import NamedTuple

import numpy as np

N_ELEMENT_PARTS = 4  # number of parts into which each element but the first is divided


class SpreadElements(NamedTuple):
    """Stiffness [N/m] and increasing yield displacements [m] of t parallel elements, (t,) each."""

    stiffness: np.ndarray
    yield_displacement: np.ndarray


def spread_elements(stiffness, yield_displacement) -> SpreadElements:
    """Spread parallel elements uniformly over ranges around their yield displacements.

    The total stiffness and the friction limit do not change. A range is as wide as the distance to the farther
    neighbour, because the nearer neighbour may be at the other end of the contact. A single element is not spread.

    Parameters
    ----------
    stiffness, yield_displacement : (t,) array_like
        Stiffness [N/m] and increasing yield displacements [m] of the elements.

    Returns
    -------
    SpreadElements
    """
    # Nodes that yield together at both ends of a contact are one element
    k = np.asarray(stiffness, float)
    y = np.asarray(yield_displacement, float)
    # Largest relative difference of yield displacements for which nodes at both ends of a contact
    # count as one
    starts = np.flatnonzero(np.diff(y, prepend=-np.inf) > 1e-6 * y)
    total = np.add.reduceat(k, starts)
    y = np.add.reduceat(k * y, starts) / total
    if y.size < 2:
        return SpreadElements(total, y)

    # Width of the range of each element
    distance = np.diff(y)
    width = np.empty(y.size)
    width[1:-1] = np.maximum(distance[1:], distance[:-1])
    width[-1] = distance[-1]
    # The second element may be at the other end of the contact.
    width[0] = 2 * min(y[0], y[min(2, y.size - 1)] - y[0])
    width = np.minimum(width, 2 * y)

    # The widths of the parts of the first element decrease by a constant ratio towards zero
    # displacement.
    # Number of times that the range of the first element is halved, with N_ELEMENT_PARTS parts per
    # halving; displacements down to 1/256 of this range then cause slip
    number = np.arange(N_ELEMENT_PARTS * 8 + 1)
    borders = np.append(2.0 ** (-number / N_ELEMENT_PARTS), 0.0)
    first_fraction = -np.diff(borders)
    first_position = (borders[1:] + borders[:-1]) / 2 - 0.5

    # The other elements have equal parts. All parts are sorted, because ranges overlap.
    position = (np.arange(N_ELEMENT_PARTS) + 0.5) / N_ELEMENT_PARTS - 0.5
    first = y[0] + width[0] * first_position
    others = (y[1:, None] + width[1:, None] * position).ravel()
    parts = np.concatenate(
        [total[0] * first_fraction, np.repeat(total[1:] / N_ELEMENT_PARTS, N_ELEMENT_PARTS)]
    )
    displacements = np.concatenate([first, others])
    order = np.argsort(displacements, kind="stable")
    return SpreadElements(parts[order], displacements[order])
