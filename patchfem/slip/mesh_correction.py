"""Correction of partial slip for the mesh by a spread of the yield displacements.

Slip grows node by node from where a contact carries least. For a slide shorter than the first yield slide a mesh shows no
slip at all, nor does a mesh of half its nodes, although the joint dissipates energy with the third power of a small slide
(Mindlin and Deresiewicz, J. Appl. Mech. 20, 327, 1953). The region that a node represents slips over a range of yield
slides, which its neighbours bound; the change when the elements are spread over that range estimates the error.
"""

from typing import NamedTuple

import numpy as np

# error of a measure / its change when the elements are spread (tests/README.md)
SPREAD_FACTOR = 1.5
N_ELEMENT_PARTS = 4  # number of parts into which an element is split; the first element has as many per halving of its range
N_HALVINGS = 8  # number of these halvings; even displacements down to a 256th of the first element then show slip
# relative difference of yield displacements below which nodes at both ends of a contact count as one
SAME_YIELD_TOL = 1e-6


class SpreadElements(NamedTuple):
    """Stiffness [N/m] and rising yield displacements [m] of parallel elements."""

    stiffness: np.ndarray
    yield_displacement: np.ndarray


def spread_elements(stiffness, yield_displacement) -> SpreadElements:
    """Spread parallel elements evenly over ranges around their yield displacements.

    The sum of the stiffnesses and the friction limit stay. A range is as wide as the distance to the farther neighbour,
    because the nearer one may be at the other end of the contact. A single element stays as it is.

    Parameters
    ----------
    stiffness, yield_displacement : (t,) array_like
        [N/m] and, increasing, [m].
    """
    k, y = np.asarray(stiffness, float), np.asarray(yield_displacement, float)
    starts = np.flatnonzero(np.diff(y, prepend=-np.inf) > SAME_YIELD_TOL * y)
    total = np.add.reduceat(k, starts)
    y = np.add.reduceat(k * y, starts) / total
    if y.size < 2:
        return SpreadElements(total, y)
    distance, width = np.diff(y), np.empty(y.size)
    width[1:-1] = np.maximum(distance[1:], distance[:-1])
    width[-1] = distance[-1]
    # the second element may be at the other end of the contact
    width[0] = 2 * min(y[0], y[min(2, y.size - 1)] - y[0])
    width = np.minimum(width, 2 * y)
    even = (np.arange(N_ELEMENT_PARTS) + 0.5) / N_ELEMENT_PARTS - 0.5
    borders = np.append(
        2.0 ** (-np.arange(N_ELEMENT_PARTS * N_HALVINGS + 1) / N_ELEMENT_PARTS), 0.0
    )
    fraction = -np.diff(borders)
    position = (borders[1:] + borders[:-1]) / 2 - 0.5
    first = y[0] + width[0] * position
    others = (y[1:, None] + width[1:, None] * even).ravel()
    spread_slides = np.concatenate([first, others])
    parts = np.concatenate(
        [total[0] * fraction, np.repeat(total[1:] / N_ELEMENT_PARTS, N_ELEMENT_PARTS)]
    )
    order = np.argsort(spread_slides, kind="stable")
    return SpreadElements(parts[order], spread_slides[order])
