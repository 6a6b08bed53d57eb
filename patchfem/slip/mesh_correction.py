"""What the nodes of a mesh leave open of partial slip: their elements spread over the yield slides between them.

Slip grows node by node from where a contact carries least. Of a slide that is shorter than the first node's yield slide
a mesh sees no slip at all, nor does a mesh of half its nodes, although the joint loses heat (Mindlin and Deresiewicz,
J. Appl. Mech. 20, 327, 1953: with the third power of a small slide). What a node stands for slips over a range of
yield slides, which its neighbours bound; the change by going over that range is the grain of the mesh.
"""

import numpy as np

SPREAD_FACTOR = 1.5  # times the change by `spread`, as an error (tests/README.md)
PARTS = 4  # of an element, and of each halving of the first one
OCTAVES = 8  # of the first element: slides down to a 256th of it are told
TOGETHER = 1e-6  # of a yield slide, within which nodes at both ends of a contact count as one


def spread(stiffness, yield_slide) -> tuple:
    """(stiffness [N/m], yield slide [m]) of parallel elements (t,) spread evenly over the ranges about their own.

    yield_slide: increasing. The sum of the stiffnesses and the friction limit stay. One element alone stays as it is.
    A range is as wide as the gap to the farther neighbour: the nearer may be at the other end of the contact.
    """
    k, y = np.asarray(stiffness, float), np.asarray(yield_slide, float)
    starts = np.flatnonzero(np.diff(y, prepend=-np.inf) > TOGETHER * y)
    k, y = (total := np.add.reduceat(k, starts)), np.add.reduceat(k * y, starts) / total
    if y.size < 2:
        return k, y
    gap, width = np.diff(y), np.empty(y.size)
    width[1:-1] = np.maximum(gap[1:], gap[:-1])
    width[-1] = gap[-1]
    # the second may be at the other end of the contact
    width[0] = 2 * min(y[0], y[min(2, y.size - 1)] - y[0])
    width = np.minimum(width, 2 * y)
    even = (np.arange(PARTS) + 0.5) / PARTS - 0.5
    edges = np.append(2.0 ** (-np.arange(PARTS * OCTAVES + 1) / PARTS), 0.0)
    share, place = -np.diff(edges), (edges[1:] + edges[:-1]) / 2 - 0.5
    at = np.concatenate([y[0] + width[0] * place, (y[1:, None] + width[1:, None] * even).ravel()])
    part = np.concatenate([k[0] * share, np.repeat(k[1:] / PARTS, PARTS)])
    order = np.argsort(at, kind="stable")
    return part[order], at[order]
