"""Nested dissection of a mesh by the coordinates of its nodes: small cuts halve it again and again.

All parts of a level are cut at once, so the cost is a few sorts per level: 1 s for 2.5e5 nodes. Nodes of which only
the neighbours are known are placed by their distances, counted in neighbours, from a few nodes far apart.
"""

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra, maximum_bipartite_matching

LEAF = 48  # nodes below which a part is not cut any further
LANDMARKS = 4  # nodes far apart by which the others are placed


def distances(graph) -> np.ndarray:
    """Coordinates (n, LANDMARKS) of the nodes of a graph, a sparse symmetric (n, n): steps from nodes far apart.

    Each of these is farthest from those before. Parts without a path between them lie one behind the other.
    """
    part = connected_components(graph, directed=False)[1]

    def steps(node: int) -> np.ndarray:
        found = dijkstra(graph, directed=False, indices=node, unweighted=True)
        far = np.isinf(found)
        return np.where(far, found[~far].max() + 1 + part, found)

    out = [steps(int(np.argmax(steps(0))))]
    while len(out) < LANDMARKS:
        out.append(steps(int(np.argmax(np.min(out, axis=0)))))
    return np.array(out).T


def dissection(points, pairs) -> tuple:
    """Order of elimination of the nodes: (n,) nodes, and (f + 1,) where each part or cut begins in it.

    points: (n, d) [m]; pairs: (e, 2) neighbours. A part is cut at the median of one coordinate, that which parts the
    fewest pairs.
    Its cut is the least set of nodes that touches all of those pairs; it is eliminated after both halves. Nodes of a
    cut lie in sequence along it.
    """
    count = len(points)
    if not count:
        return np.empty(0, np.int64), np.zeros(1, np.int64)
    key = np.zeros(count, np.int64)  # digits of base 3: 0 and 1 the halves, 2 the cut
    nodes = np.arange(count)
    rising = np.argsort(points, axis=0, kind="stable").T.copy()
    while nodes.size:
        _, part, sizes = np.unique(key[nodes], return_inverse=True, return_counts=True)
        key *= 3
        big = sizes[part] > LEAF
        nodes, part = nodes[big], np.unique(part[big], return_inverse=True)[1]
        if not nodes.size:
            break
        of = np.full(count, -1)
        of[nodes] = part
        pairs = pairs[(of[pairs[:, 0]] == of[pairs[:, 1]]) & (of[pairs[:, 0]] >= 0)]
        side = _sides(rising, pairs, of)
        key[nodes] += side[nodes]
        cut = least_cover(pairs[side[pairs[:, 0]] != side[pairs[:, 1]]], side)
        key[cut] += 2 - side[cut]
        nodes = np.setdiff1d(nodes, cut, assume_unique=True)
    return _in_sequence(points, key)


def _sides(rising, pairs, of) -> np.ndarray:
    """Half of its part, 0 or 1, for each node, by the best of the medians. rising: all nodes by each coordinate."""
    sizes = np.bincount(of[of >= 0])
    sides, severed = (
        np.zeros((len(rising), of.size), np.int64),
        np.empty((len(rising), sizes.size), np.int64),
    )
    # short integers are sorted by their digits
    small = np.uint16 if sizes.size < 2**16 else np.int64
    for axis in range(len(rising)):
        nodes = rising[axis][of[rising[axis]] >= 0]
        nodes = nodes[np.argsort(of[nodes].astype(small), kind="stable")]
        rank = np.arange(nodes.size) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        sides[axis, nodes] = rank >= np.repeat(sizes // 2, sizes)
        apart = sides[axis, pairs[:, 0]] != sides[axis, pairs[:, 1]]
        severed[axis] = np.bincount(of[pairs[apart, 0]], minlength=sizes.size)
    return sides[np.argmin(severed, axis=0)[of], np.arange(of.size)]


def least_cover(pairs, side) -> np.ndarray:
    """The fewest nodes that touch every one of the pairs (e, 2) between nodes of side 0 and of side 1.

    Koenig's theorem: the nodes of one side that alternating paths from the unmatched nodes do not reach, and those of
    the other side that they do reach.
    """
    if not len(pairs):
        return np.empty(0, np.int64)
    swap = side[pairs[:, 0]] == 1
    left, a = np.unique(np.where(swap, pairs[:, 1], pairs[:, 0]), return_inverse=True)
    right, b = np.unique(np.where(swap, pairs[:, 0], pairs[:, 1]), return_inverse=True)
    graph = csr_matrix((np.ones(a.size, np.int8), (a, b)), shape=(left.size, right.size))
    mate = maximum_bipartite_matching(graph, perm_type="column")  # of every left node, -1: none
    back = np.full(right.size, -1)
    back[mate[mate >= 0]] = np.flatnonzero(mate >= 0)
    reached, met = mate < 0, np.zeros(right.size, bool)
    while True:
        fresh = np.zeros(right.size, bool)
        fresh[b[reached[a]]] = True
        fresh &= ~met
        if not fresh.any():
            return np.concatenate([left[~reached], right[met]])
        met |= fresh
        reached[back[fresh]] = True


def _in_sequence(points, key) -> tuple:
    """The nodes in order of key and, within one key, along its longer extent; and where each key begins."""
    _, own, sizes = np.unique(key, return_inverse=True, return_counts=True)
    order = np.argsort(own, kind="stable")
    firsts = np.concatenate([[0], np.cumsum(sizes)])
    extent = np.maximum.reduceat(points[order], firsts[:-1]) - np.minimum.reduceat(
        points[order], firsts[:-1]
    )
    along = points[np.arange(len(points)), np.argmax(extent, axis=1)[own]]
    return np.lexsort((along, own)), firsts
