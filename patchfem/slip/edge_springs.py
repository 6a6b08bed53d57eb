"""Springs at the edges of a contact that give a patch a prescribed stiffness in full stick.

A contact ends between two nodes, but the outermost loaded node has the compliance of a full cell. The patch is
therefore too stiff in full stick, and this excess belongs to the nodes at the edges, which slip first. A
spring in series with these nodes removes it; the friction forces after they have slipped stay the same.
"""

import numpy as np
from scipy.optimize import brentq

from ..core import frozen_array

# Smallest ratio of the compliance of the edge nodes to that at which the matrix becomes singular.
MIN_COMPLIANCE_RATIO = 1e-6
# Largest ratio of the added compliance to that of the edge nodes; beyond it they carry no force.
MAX_COMPLIANCE_RATIO = 1e9


def add_edge_springs(compliance: np.ndarray, loaded: np.ndarray, stiffness: float) -> np.ndarray:
    """Return a compliance matrix with springs at the edges of the contact.

    With the loaded nodes stuck, the sum of the nodal forces per displacement is K(c) = K - sum_i q_i^2 c/(1 + c
    lambda_i), where c is the added compliance relative to the diagonal of the matrix (Woodbury identity). Edges of
    one node are used, or of the smallest number of nodes that can carry the difference; if none can, the whole
    matrix is scaled.

    Parameters
    ----------
    compliance : (m, m) ndarray
        Tangential compliance of the nodes [m/N].
    loaded : (m,) ndarray of bool
        Whether a node carries a normal force.
    stiffness : float
        Tangential stiffness in full stick [N/m].

    Returns
    -------
    (m, m) ndarray
    """
    points = np.flatnonzero(loaded)
    inverse = np.linalg.inv(compliance[np.ix_(points, points)])
    forces = inverse.sum(axis=1)
    excess = forces.sum() - stiffness
    is_gap = np.diff(points) > 1
    starts = np.concatenate([[True], is_gap])
    ends = np.concatenate([is_gap, [True]])
    distance = np.minimum(_count_since(starts), _count_since(ends[::-1])[::-1])
    for width in range(1, int(distance.max()) + 2):
        nodes = points[distance < width]
        scale = np.sqrt(compliance[nodes, nodes])
        edge_inverse = inverse[np.ix_(distance < width, distance < width)]
        values, vectors = np.linalg.eigh(edge_inverse * np.outer(scale, scale))
        weight = (vectors.T @ (scale * forces[distance < width])) ** 2

        def remaining_excess(ratio: float, values=values, weight=weight) -> float:
            """Return the excess of the stiffness [N/m] for an added compliance relative to 1/lambda_max."""
            added = ratio / values[-1]
            return excess - float((weight * added / (1 + added * values)).sum())

        # The matrix stays positive definite for added compliances above -1/lambda_max.
        low, high = MIN_COMPLIANCE_RATIO - 1, MAX_COMPLIANCE_RATIO
        if remaining_excess(low) > 0 > remaining_excess(high):
            out = compliance.copy()
            out[nodes, nodes] += (
                brentq(remaining_excess, low, high, xtol=1e-15) / values[-1] * scale**2
            )
            return frozen_array(out)

    return frozen_array(compliance * (forces.sum() / stiffness))


def _count_since(is_start: np.ndarray) -> np.ndarray:
    """Return the number of entries (m,) since the last one that is True; the first one is True."""
    numbers = np.arange(is_start.size)
    return numbers - np.maximum.accumulate(np.where(is_start, numbers, 0))
