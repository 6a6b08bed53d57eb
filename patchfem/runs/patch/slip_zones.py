"""Slip zones of a patch under a prescribed displacement, for the grading of its mesh.

In: a solved patch and the `PrescribedSlip`. Out: zones along the interface.
"""

import numpy as np

from .jenkins_elements import elements
from .values import find_contact_edges

Zone = tuple[float, float]  # start and end [m]


def find_slip_zones(patch, slip) -> tuple[Zone, ...]:
    """Return the zones (start, end) [m] that slip at a given displacement amplitude.

    The yield displacement is interpolated linearly between nodes. At a contact edge between two
    nodes the pressure vanishes, so that points there yield at once under Coulomb's law.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    slip : PrescribedSlip
        Prescribed displacement.
    """
    if not patch.active.any():
        return ()

    jenkins_set = elements(patch, slip.static, slip.bond_length)
    edges = find_contact_edges(patch.pressed)
    positions_by_node = zip(edges.node[0].tolist(), edges.side[0].tolist(), edges.position[0])
    edge_by_node = {(node, side): position for node, side, position in positions_by_node}
    breaks = 1 + np.flatnonzero(np.diff(jenkins_set.points) > 1)
    intervals = np.split(jenkins_set.points, breaks), np.split(jenkins_set.point_yields, breaks)
    out = []

    # Each interval of neighbouring nodes in contact is interpolated by itself.
    for nodes, yield_displacements in zip(*intervals):
        positions = patch.x[nodes]
        for node, side in ((nodes[0], -1), (nodes[-1], 1)):
            edge = edge_by_node.get((int(node), side))
            if slip.bond_length == 0 and edge is not None and side * (edge - patch.x[node]) > 0:
                at = positions.size if side > 0 else 0
                positions = np.insert(positions, at, edge)
                yield_displacements = np.insert(yield_displacements, at, 0.0)
        out += _yielding_intervals(positions, yield_displacements, slip.amplitude)
    return tuple(out)


def _yielding_intervals(x, yield_displacement, amplitude: float) -> list[Zone]:
    """Return the intervals (start, end) of x [m] in which the nodes slip under a prescribed displacement.

    `x` [m] are positions of neighbouring nodes, `yield_displacement` [m] is the displacement at which each of them
    slips, and `amplitude` [m] that of the prescribed displacement. Between two nodes the yield displacement is linear.
    """
    is_yielding = np.concatenate([[False], yield_displacement < amplitude, [False]])
    ends = []
    for node in np.flatnonzero(is_yielding[1:] != is_yielding[:-1]):
        # A zone ends between two nodes, or with the interval.
        if 0 < node < x.size:
            low, high = yield_displacement[node - 1 : node + 1]
            fraction = (amplitude - low) / (high - low)
            ends.append(float(x[node - 1] + fraction * (x[node] - x[node - 1])))
        else:
            ends.append(float(x[min(node, x.size - 1)]))
    return [(start, stop) for start, stop in zip(ends[::2], ends[1::2]) if stop > start]
