"""Multifrontal Cholesky factors of a sparse stiffness, in dense fronts (Duff and Reid 1983).

Each leaf or cut of a nested dissection has a front, a dense matrix of the unknowns of its nodes
(the own unknowns of the front) and of all later unknowns that are coupled with them. Eliminating
the own unknowns leaves an update, which is added to the front that owns the first later node. The
last front is the interface. It receives all updates, so its matrix is the Schur complement S, and
S^-1 is the compliance.
"""

from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from scipy.linalg import eigvalsh
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf, dtfsm, dtfttr, dtrttf
from scipy.sparse import csc_matrix, csr_matrix, tril

from ..core import NotConverged
from .dissect import dissect_nodes, graph_coordinates
from .lapack import cho_inverse

UNKNOWNS_PER_NODE = 2  # number of unknowns of a node, which are consecutive
# Smallest number of nodes of an update that is added by runs of consecutive nodes; a smaller update
# is added by one indexed assignment
MIN_SLICED_NODES = 40
# Mean length [nodes] of runs of consecutive node numbers from which an update is added run by run;
# with shorter runs it is added column by column
MIN_MEAN_RUN_LENGTH = 24


@dataclass(frozen=True, eq=False, slots=True)
class Fronts:
    """Cholesky factors of a matrix (n, n), stored in frontal matrices.

    - ``triangles``: triangle of L for the own unknowns of each front, in LAPACK's rectangular format
    - ``lower_blocks``: (later, own) columns of L below each triangle
    - ``first_unknowns``: (f + 1,) first own unknown of each front, and n
    - ``later_unknowns``: later unknowns that are coupled with the own unknowns of each front
    """

    triangles: list
    lower_blocks: list
    first_unknowns: np.ndarray
    later_unknowns: list

    @property
    def n_entries(self) -> int:
        """Number of stored floating-point numbers of 8 bytes."""
        return sum(part.size for part in (*self.triangles, *self.lower_blocks))

    def compliance(self) -> np.ndarray:
        """Return the diagonal block (k, k) of the inverse that belongs to the last front."""
        size = self.first_unknowns[-1] - self.first_unknowns[-2]
        low, _ = dtfttr(size, self.triangles[-1], uplo="L")
        return cho_inverse(low)

    def solve(self, load) -> np.ndarray:
        """Solve the equations for loads (n, r) by forward and back substitution."""
        x = np.array(load, dtype=float, order="C")
        starts = self.first_unknowns
        fronts = list(
            zip(self.triangles, self.lower_blocks, starts, starts[1:], self.later_unknowns)
        )
        for triangle, lower_block, start, stop, later in fronts:
            x[start:stop] = dtfsm(1.0, triangle, x[start:stop], uplo="L")
            x[later] -= lower_block @ x[start:stop]
        for triangle, lower_block, start, stop, later in reversed(fronts):
            right = x[start:stop] - lower_block.T @ x[later]
            x[start:stop] = dtfsm(1.0, triangle, right, uplo="L", trans="T")
        return x


class ZeroEnergyMotion(NotConverged):
    """Exception for a stiffness matrix that has a rigid-body mode or another zero-energy mode."""


class SparseFactor:
    """Cholesky factors of a sparse matrix that does not come from a mesh.

    The order of elimination follows from the graph of the matrix (`dissect.graph_coordinates`).
    Unknowns with the same neighbours form one node of this graph. `min_pivot` and the
    exceptions are those of `factorise`.
    """

    def __init__(self, matrix, min_pivot: float = 0.0):
        pattern = csr_matrix(matrix != 0)
        # Rows with the same pattern have the same sum of random numbers.
        numbers = np.random.default_rng(0).integers(2**62, size=matrix.shape[0])
        row_hash = pattern.astype(np.int64) @ numbers
        _, first, node = np.unique(row_hash, return_index=True, return_inverse=True)
        graph = pattern[first][:, first]
        pairs = np.stack(tril(graph, -1).nonzero(), axis=1)
        node_order, firsts = dissect_nodes(graph_coordinates(graph), pairs)
        position = np.argsort(node_order)[node]
        self.order = np.argsort(position, kind="stable")
        first_unknowns = np.searchsorted(position[self.order], firsts)
        matrix = csc_matrix(matrix[self.order][:, self.order])
        self.fronts = factorise(matrix, first_unknowns, 1, min_pivot)

    def solve(self, load) -> np.ndarray:
        """Solve the equations for loads (n,) or (n, r)."""
        load = np.asarray(load, float)
        solution = self.fronts.solve(load[self.order].reshape(len(load), -1))
        out = np.empty_like(load)
        out[self.order] = solution.reshape(load.shape)
        return out


def factorise(
    matrix: csc_matrix, firsts, per_node: int = UNKNOWNS_PER_NODE, min_pivot: float = 0.0
) -> Fronts:
    """Factorise a symmetric positive definite matrix; its unknowns are eliminated in the given order.

    Parameters
    ----------
    matrix : (n, n) csc_matrix
    firsts : (f + 1,) sequence of int
        Front k owns the nodes firsts[k]:firsts[k + 1].
    per_node : int
        Unknowns of a node, which follow one another.
    min_pivot : float
        Every pivot must exceed this fraction of the diagonal entry of the matrix [1].

    Returns
    -------
    Fronts

    Raises
    ------
    ZeroEnergyMotion
        If a pivot is too small but no motion has negative energy.
    NotConverged
        If the matrix is not positive definite.
    """
    lower = tril(matrix, format="csc")
    diagonal = matrix.diagonal()
    later_nodes = _find_later_nodes(lower, firsts, per_node)
    n_fronts = len(later_nodes)
    front_of_node = np.repeat(np.arange(n_fronts), np.diff(firsts))
    position = np.empty(firsts[-1], np.int64)  # position of a node within the present front
    updates = [[] for _ in range(n_fronts)]
    triangles = []
    lower_blocks = []
    for number, (start, stop) in enumerate(pairwise(firsts)):
        later = later_nodes[number]
        nodes = np.concatenate([np.arange(start, stop), later])
        position[nodes] = np.arange(nodes.size)
        own = per_node * (stop - start)
        front = _make_front(lower, start, stop, per_node * nodes.size, position, per_node)
        for rows, update in updates[number]:
            _add_update(front, update, position[rows], per_node)
        updates[number] = None  # the update is no longer needed and its memory is freed
        triangle, fault = dpotrf(front[:own, :own], lower=1)
        size = diagonal[per_node * start : per_node * stop]
        if fault or (np.diag(triangle) ** 2 <= min_pivot * size).any():
            raise _describe_fault(front[:own, :own], size, min_pivot)
        lower_block = np.empty((0, own), order="F")
        if later.size:
            lower_block = dtrsm(1.0, triangle, front[own:, :own], side=1, lower=1, trans_a=1)
            remainder = np.asfortranarray(front[own:, own:])
            update = dsyrk(-1.0, lower_block, beta=1.0, c=remainder, lower=1, overwrite_c=1)
            updates[front_of_node[later[0]]].append((later, update))
        triangles.append(dtrttf(triangle, uplo="L")[0])
        lower_blocks.append(lower_block)
    later_unknowns = [_list_unknowns(nodes, per_node) for nodes in later_nodes]
    return Fronts(triangles, lower_blocks, per_node * np.asarray(firsts), later_unknowns)


def _describe_fault(block, diagonal, min_pivot: float) -> NotConverged:
    """Return the exception for a frontal matrix that cannot be factorized.

    block: (k, k), of which the lower half is read; diagonal: (k,) entries of the matrix there.
    """
    scale = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    if eigvalsh(block / np.outer(scale, scale))[0] > -min_pivot:
        return ZeroEnergyMotion("the piece can move without any strain")
    return NotConverged("the stiffness of the piece is not positive definite")


def _add_update(front, update, nodes, per_node: int) -> None:
    """Add the lower triangle of an update matrix to a frontal matrix.

    nodes: ascending positions of its nodes in the front. A small update is added by one indexed
    assignment, a large one in rectangles of successive nodes, or by columns if few nodes are
    successive.
    """
    unknowns = _list_unknowns(nodes, per_node)
    if nodes.size < MIN_SLICED_NODES:
        # Both are stored by rows, so their transposes are added.
        front.T[unknowns[:, None], unknowns] += update.T
        return
    cuts = np.flatnonzero(np.diff(nodes) > 1) + 1
    if (cuts.size + 1) * MIN_MEAN_RUN_LENGTH > nodes.size:
        for column, target in enumerate(unknowns):
            front[unknowns[column:], target] += update[column:, column]
        return
    starts = per_node * np.append(0, cuts)
    stops = per_node * np.append(cuts, nodes.size)
    runs = [
        (slice(start, stop), slice(unknowns[start], unknowns[start] + stop - start))
        for start, stop in zip(starts, stops)
    ]
    for (columns, target_columns), (rows, target_rows) in product(runs, runs):
        if rows.start >= columns.start:
            front[target_rows, target_columns] += update[rows, columns]


def _list_unknowns(nodes, per_node: int) -> np.ndarray:
    return (per_node * nodes[:, None] + np.arange(per_node)).ravel()


def _find_later_nodes(lower: csc_matrix, firsts, per_node: int) -> list:
    """Return the uneliminated nodes to which each front is coupled (symbolic factorization).

    A later node may be coupled with a front only once earlier nodes are eliminated. Each list is in
    ascending order.
    """
    n_fronts = len(firsts) - 1
    front_of_node = np.repeat(np.arange(n_fronts), np.diff(firsts))
    pointer = lower.indptr[::per_node]
    rows = lower.indices // per_node
    from_updates = [[] for _ in range(n_fronts)]
    later_nodes = []
    for number, (start, stop) in enumerate(pairwise(firsts)):
        coupled = [rows[pointer[start] : pointer[stop]], *from_updates[number]]
        nodes = np.unique(np.concatenate(coupled))
        later = nodes[np.searchsorted(nodes, stop) :]
        from_updates[number] = None  # the update is no longer needed and its memory is freed
        if later.size:
            from_updates[front_of_node[later[0]]].append(later)
        later_nodes.append(later)
    return later_nodes


def _make_front(
    lower: csc_matrix, start: int, stop: int, size: int, position, per_node: int
) -> np.ndarray:
    """Assemble a frontal matrix from the matrix columns of the nodes that are eliminated in it."""
    front = np.zeros((size, size), order="F")
    pointer = lower.indptr[per_node * start : per_node * stop + 1]
    entries = slice(pointer[0], pointer[-1])
    nodes, components = np.divmod(lower.indices[entries], per_node)
    rows = per_node * position[nodes] + components
    columns = np.repeat(np.arange(pointer.size - 1), np.diff(pointer))
    front[rows, columns] = lower.data[entries]
    return front
