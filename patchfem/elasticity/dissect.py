"""Nested dissection of a mesh by the coordinates of its nodes.

A part of the mesh is cut at the median of one coordinate, and the nodes on the cut are eliminated
after both halves. All parts of a level are cut at once, so the cost is a few sorts for each level:
1 s for 2.5e5 nodes. Where only the neighbours of the nodes are known, the numbers of steps from a
few nodes far apart serve as coordinates.
"""

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra, maximum_bipartite_matching

MAX_LEAF_NODES = 48  # largest number of nodes in a part that is not divided further
# Number of nodes whose graph distances serve as coordinates; four separate the nodes of a graph
# well
N_LANDMARKS = 4


def graph_coordinates(graph) -> np.ndarray:
    """Return coordinates of graph nodes, which are their graph distances to distant landmarks.

    Each landmark is the node farthest from the earlier ones. The components of the graph
    have separate ranges of coordinates.

    Parameters
    ----------
    graph : (n, n) sparse matrix
        Symmetric; its entries mark neighbours.

    Returns
    -------
    (n, N_LANDMARKS) ndarray
    """
    component = connected_components(graph, directed=False)[1]

    def count_steps(node: int) -> np.ndarray:
        """Return the graph distances (n,) from a node to all others."""
        steps = dijkstra(graph, directed=False, indices=node, unweighted=True)
        is_unreachable = np.isinf(steps)
        return np.where(is_unreachable, steps[~is_unreachable].max() + 1 + component, steps)

    coordinates = [count_steps(int(np.argmax(count_steps(0))))]
    while len(coordinates) < N_LANDMARKS:
        coordinates.append(count_steps(int(np.argmax(np.min(coordinates, axis=0)))))
    return np.array(coordinates).T


def dissect_nodes(points, pairs) -> tuple[np.ndarray, np.ndarray]:
    """Order nodes for elimination by nested dissection.

    A part is cut along the coordinate whose median separates the fewest pairs. The cut is the
    smallest set of nodes that touches all of these pairs. The nodes of a cut follow one another
    along it.

    Parameters
    ----------
    points : (n, d) ndarray
        Coordinates.
    pairs : (e, 2) ndarray of int
        Neighbours.

    Returns
    -------
    order : (n,) ndarray of int
        The nodes, both halves of a part before its cut.
    firsts : (f + 1,) ndarray of int
        Position in `order` at which each leaf or cut begins, and n.
    """
    n_nodes = len(points)
    if not n_nodes:
        return np.empty(0, np.int64), np.zeros(1, np.int64)
    # Each level adds a digit of base 3: 0 and 1 for the halves, 2 for the cut.
    key = np.zeros(n_nodes, np.int64)
    nodes = np.arange(n_nodes)
    sorted_nodes = np.argsort(points, axis=0, kind="stable").T.copy()
    while nodes.size:
        _, part, sizes = np.unique(key[nodes], return_inverse=True, return_counts=True)
        key *= 3
        is_cut = sizes[part] > MAX_LEAF_NODES
        nodes = nodes[is_cut]
        if not nodes.size:
            break
        part_of_node = np.full(n_nodes, -1)
        part_of_node[nodes] = np.unique(part[is_cut], return_inverse=True)[1]
        first, second = part_of_node[pairs].T
        pairs = pairs[(first == second) & (first >= 0)]
        side = _split_parts(sorted_nodes, pairs, part_of_node)
        key[nodes] += side[nodes]
        is_severed = side[pairs[:, 0]] != side[pairs[:, 1]]
        cut = minimum_vertex_cover(pairs[is_severed], side)
        key[cut] += 2 - side[cut]
        nodes = np.setdiff1d(nodes, cut, assume_unique=True)
    return _sort_by_key(points, key)


def _split_parts(sorted_nodes, pairs, part_of_node) -> np.ndarray:
    """Split the nodes of each part into halves 0 and 1 at the median of one coordinate.

    Each part is cut along the coordinate whose median separates the fewest pairs of neighbours.

    sorted_nodes: (d, n) all nodes by each coordinate; part_of_node: (n,) or -1.
    """
    sizes = np.bincount(part_of_node[part_of_node >= 0])
    sides = np.zeros((len(sorted_nodes), part_of_node.size), np.int64)
    n_severed = np.empty((len(sorted_nodes), sizes.size), np.int64)
    # NumPy sorts 16-bit integers by radix sort, which is faster than its sort of longer integers.
    short_int = np.uint16 if sizes.size < 2**16 else np.int64
    for side, severed, nodes in zip(sides, n_severed, sorted_nodes):
        nodes = nodes[part_of_node[nodes] >= 0]
        nodes = nodes[np.argsort(part_of_node[nodes].astype(short_int), kind="stable")]
        rank = np.arange(nodes.size) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        side[nodes] = rank >= np.repeat(sizes // 2, sizes)
        is_severed = side[pairs[:, 0]] != side[pairs[:, 1]]
        severed[:] = np.bincount(part_of_node[pairs[is_severed, 0]], minlength=sizes.size)
    best_axis = np.argmin(n_severed, axis=0)[part_of_node]
    return sides[best_axis, np.arange(part_of_node.size)]


def minimum_vertex_cover(pairs, side) -> np.ndarray:
    """Return the smallest set of nodes that contains at least one node of every pair.

    By Koenig's theorem it consists of the nodes of side 0 that alternating paths from the
    unmatched nodes of side 0 do not reach, and of the nodes of side 1 that these paths reach.

    Parameters
    ----------
    pairs : (e, 2) ndarray of int
        Each joins a node of side 0 with one of side 1.
    side : (n,) ndarray of int
        Side of every node, 0 or 1.

    Returns
    -------
    (c,) ndarray of int
    """
    if not len(pairs):
        return np.empty(0, np.int64)
    is_swapped = side[pairs[:, :1]] == 1
    pairs = np.where(is_swapped, pairs[:, ::-1], pairs)
    left, left_end = np.unique(pairs[:, 0], return_inverse=True)
    right, right_end = np.unique(pairs[:, 1], return_inverse=True)
    ones = np.ones(left_end.size, np.int8)
    graph = csr_matrix((ones, (left_end, right_end)), shape=(left.size, right.size))
    mate = maximum_bipartite_matching(graph, perm_type="column")  # an unmatched node has -1
    is_matched = mate >= 0
    mate_of_right = np.full(right.size, -1)
    mate_of_right[mate[is_matched]] = np.flatnonzero(is_matched)
    is_reached_left = ~is_matched
    is_reached_right = np.zeros(right.size, bool)
    while True:
        is_new = np.zeros(right.size, bool)
        is_new[right_end[is_reached_left[left_end]]] = True
        is_new &= ~is_reached_right
        if not is_new.any():
            return np.concatenate([left[~is_reached_left], right[is_reached_right]])
        is_reached_right |= is_new
        is_reached_left[mate_of_right[is_new]] = True


def _sort_by_key(points, key) -> tuple[np.ndarray, np.ndarray]:
    """Sort nodes by key; sort nodes with equal keys along the direction of their longest extent.

    Returns the sorted nodes (n,), and the position at which each key begins, and n.
    """
    _, group, sizes = np.unique(key, return_inverse=True, return_counts=True)
    by_group = points[np.argsort(group, kind="stable")]
    firsts = np.concatenate([[0], np.cumsum(sizes)])
    lowest = np.minimum.reduceat(by_group, firsts[:-1])
    highest = np.maximum.reduceat(by_group, firsts[:-1])
    longer_axis = np.argmax(highest - lowest, axis=1)[group]
    along = points[np.arange(len(points)), longer_axis]
    return np.lexsort((along, group)), firsts
