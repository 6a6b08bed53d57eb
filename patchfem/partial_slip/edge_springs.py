"""Springs at the edges of a contact that give a patch a prescribed stiffness in full stick.

A contact ends between two nodes, but the outermost loaded node has the compliance of a full cell. The patch is
therefore too stiff or too soft in full stick, and the difference belongs to the nodes at these edges, which slip
first. A spring in series with them corrects it; the friction forces after they have slipped stay the same.
"""

import numpy as np

from ..core import frozen_array

# Largest compliance of a spring relative to that of its node, which then carries no force.
MAX_SPRING_COMPLIANCE_RATIO = 1e6


def add_edge_springs(compliance: np.ndarray, is_loaded: np.ndarray, stiffness: float) -> np.ndarray:
    """Return a compliance matrix with springs at the edges of the contact, by which it has a given stiffness in full stick.

    The stiffness with springs is K(c) = K - sum_i q_i^2 c/(1 + c lambda_i), where c is the compliance of a spring
    relative to the diagonal of the matrix (Woodbury identity). Without an edge inside the interface, or if no spring
    gives the stiffness, the whole matrix is scaled instead.

    Parameters
    ----------
    compliance : (m, m) ndarray
        Tangential compliance of the nodes [m/N].
    is_loaded : (m,) ndarray of bool
        Whether a node carries a normal force.
    stiffness : float
        Tangential stiffness in full stick [N/m].

    Returns
    -------
    (m, m) ndarray
        Compliance with the springs [m/N].
    """
    points = np.flatnonzero(is_loaded)
    inverse = np.linalg.inv(compliance[np.ix_(points, points)])
    forces = inverse.sum(axis=1)
    excess = forces.sum() - stiffness
    # Loaded nodes beside an unloaded one; the ends of the interface have no neighbour.
    neighbours = np.pad(is_loaded, 1, mode="edge")
    is_edge = ~(neighbours[:-2] & neighbours[2:])[points]
    nodes = points[is_edge]
    scale = np.sqrt(compliance[nodes, nodes])
    values, vectors = np.linalg.eigh(inverse[np.ix_(is_edge, is_edge)] * np.outer(scale, scale))
    weight = (vectors.T @ (scale * forces[is_edge])) ** 2

    def remaining_excess(ratio: float) -> float:
        """Return how much the stiffness [N/m] exceeds its target with springs of a given compliance.

        `ratio` is the compliance of the springs relative to that of their nodes [1].
        """
        return excess - float((weight * ratio / (1 + ratio * values)).sum())

    # The matrix is positive definite above -1/lambda_max, and no node becomes much stiffer
    low = max(-0.5, -0.5 / values.max(initial=1.0))
    if not remaining_excess(low) > 0 > remaining_excess(MAX_SPRING_COMPLIANCE_RATIO):
        return frozen_array(compliance * (forces.sum() / stiffness))

    # Bisection to the last digit: the sum has a term per edge, and the import of scipy.optimize takes half a second.
    high = MAX_SPRING_COMPLIANCE_RATIO
    ratio = (low + high) / 2
    while low < ratio < high:
        if remaining_excess(ratio) > 0:
            low = ratio
        else:
            high = ratio
        ratio = (low + high) / 2

    out = compliance.copy()
    out[nodes, nodes] += ratio * scale**2
    return frozen_array(out)
