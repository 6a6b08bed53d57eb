"""Static condensation of a plane mesh to its interface by multifrontal elimination.

The cells are halved again and again (nested dissection, George 1973). Each part has a front, the dense stiffness of its
nodes. The nodes whose cells all lie in the part are eliminated; what remains is the stiffness of the nodes that the part
shares with others, which is added to the front of the next larger part (Duff and Reid 1983). The last front is that of
the interface, the Schur complement S = K_ss - K_si K_ii^-1 K_is, and S^-1 is the compliance.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core import NotConverged
from .lapack import cho_inverse, dgemm, dpotrf, dtrsm, use_one_blas_thread

# Smallest pivot, relative to the diagonal entry before its front is eliminated, for which round-off is not examined;
# pivots lose digits where a long thin part bends
MIN_SAFE_PIVOT = 1e-6
# Largest relative change of the displacements by one step of refinement; factors with a larger
# change are rejected
MAX_REFINEMENT_CHANGE = 1e-2


class StiffCells(NamedTuple):
    """Cells of one piece; those with fewer nodes than others have the node n, which does not exist, and zeros for it.

    - nodes (t, k): node numbers from 0 to n - 1, or n.
    - matrices (t, 2 k, 2 k): stiffnesses per unit width [N/m per m].
    """

    nodes: np.ndarray
    matrices: np.ndarray


class Front(NamedTuple):
    """Eliminated nodes of one part.

    - ``own``: (a,) eliminated nodes
    - ``boundary``: (b,) nodes that remain
    - ``factor``: (2 a, 2 a) lower Cholesky factor L of the stiffness of the own nodes
    - ``coupling``: (2 a, 2 b) L^-1 K_own,boundary
    - ``smallest_pivot``: smallest pivot relative to the diagonal entry before the elimination
    """

    own: np.ndarray
    boundary: np.ndarray
    factor: np.ndarray
    coupling: np.ndarray
    smallest_pivot: float = 1.0


@dataclass(frozen=True, eq=False, slots=True)
class Fronts:
    """Factors of the stiffness of a piece with n nodes, of which m lie on the interface.

    - ``cells``: cells, in which fixed displacements are decoupled
    - ``fronts``: fronts in the order of elimination; empty if only the compliance is wanted
    - ``interface``: (m,) nodes
    - ``compliance``: (2 m, 2 m) displacements of the interface per unit force on it [m2/N], node by node along x and
      inward
    - ``n_nodes``: number of nodes
    - ``smallest_pivot``: smallest pivot relative to the diagonal entry of its front
    """

    cells: StiffCells
    fronts: list[Front]
    interface: np.ndarray
    compliance: np.ndarray
    n_nodes: int
    smallest_pivot: float

    def solve(self, load) -> np.ndarray:
        """Return the displacements (n, 2, r) [m] under loads of the same shape [N/m]."""
        u = np.array(load, float)
        frames = u.shape[-1]
        with use_one_blas_thread():
            # Forward substitution from the leaves to the interface, then back
            for own, boundary, factor, coupling, _ in self.fronts:
                half_solved = dtrsm(1.0, factor, u[own].reshape(-1, frames), lower=1)
                u[own] = half_solved.reshape(-1, 2, frames)
                u[boundary] -= (coupling.T @ half_solved).reshape(-1, 2, frames)
            forces = u[self.interface].reshape(-1, frames)
            u[self.interface] = (self.compliance @ forces).reshape(-1, 2, frames)
            for own, boundary, factor, coupling, _ in reversed(self.fronts):
                right = u[own].reshape(-1, frames) - coupling @ u[boundary].reshape(-1, frames)
                u[own] = dtrsm(1.0, factor, right, lower=1, trans_a=1).reshape(-1, 2, frames)
        return u

    def compute_forces(self, u) -> np.ndarray:
        """Return the nodal forces (n, 2, r) [N/m] that cause displacements of the same shape [m]."""
        nodes, matrices = self.cells
        out = np.zeros((len(u) + 1, *u.shape[1:]))
        out[:-1] = u
        local = out[nodes].reshape(*matrices.shape[:2], -1)
        out[:] = 0.0
        np.add.at(out, nodes, (matrices @ local).reshape(*nodes.shape, 2, -1))
        return out[:-1]

    def estimate_round_off(self) -> float:
        """Estimate the relative round-off error of the compliance from one step of iterative refinement.

        The change by this step is the error of the compliance, too: a compliance refined in double
        precision differs by as much and is no better.

        Returns
        -------
        float
            Largest change over the largest displacement; 0 if no pivot is small or the residual is at most
            1e-8 of the largest load.

        Raises
        ------
        NotConverged
            If the change is larger than `MAX_REFINEMENT_CHANGE`.
        """
        if self.smallest_pivot > MIN_SAFE_PIVOT:
            return 0.0
        load = np.zeros((self.n_nodes, 2, 1))
        # The fractional parts of k^2 (sqrt(5) - 1)/2 are equidistributed (Weyl 1916).
        number = np.arange(1, 2 * self.interface.size + 1).reshape(-1, 2, 1)
        load[self.interface] = number**2 * ((np.sqrt(5) - 1) / 2) % 1 - 0.5
        u = self.solve(load)
        residual = load - self.compute_forces(u)
        if np.abs(residual).max() <= 1e-8 * np.abs(load).max():
            return 0.0
        change = float(np.abs(self.solve(residual)).max() / np.abs(u).max())
        if not change <= MAX_REFINEMENT_CHANGE:
            raise NotConverged(
                f"the equations of the piece are solved only to a relative accuracy of {change:.1e}, but "
                f"{MAX_REFINEMENT_CHANGE:.0e} is needed"
            )
        return change


class _Part(NamedTuple):
    """Part of a mesh, of which some nodes are eliminated.

    - nodes (k,): nodes that remain.
    - counts (k,): number of cells of the part at each of them.
    - matrix (2 k + 2, 2 k + 2): stiffness [N/m per m]. Its last two rows and columns are zero.
    """

    nodes: np.ndarray
    counts: np.ndarray
    matrix: np.ndarray


def condense_to_interface(
    cells: StiffCells, positions, interface, is_fixed, *, keep_fronts: bool = True
) -> Fronts:
    """Condense a mesh to its interface.

    Parameters
    ----------
    cells : StiffCells
        Stiffnesses of the t cells, in which the fixed displacements are then decoupled.
    positions : (t, 2) ndarray
        Positions of the cells, by which they are divided.
    interface : (m,) ndarray of int
        Nodes that remain.
    is_fixed : (n, 2) ndarray of bool
        Fixed displacements; none of them belongs to the interface unless the compliance there is not used.
    keep_fronts : bool
        Whether to keep the fronts, with which displacements inside the piece are computed. They need some 3 kB per node.

    Returns
    -------
    Fronts

    Raises
    ------
    NotConverged
        If the stiffness is not positive definite.
    """
    _decouple_fixed(cells, np.append(is_fixed, [[False, False]], axis=0))
    elimination = _Elimination(cells, positions, interface, len(is_fixed), keep_fronts=keep_fronts)
    with use_one_blas_thread():
        # What remains of the whole mesh is the Schur complement; its rows are put in the order of the interface
        nodes, _, schur = elimination.condense(np.arange(len(positions)))
        unknowns = _number_unknowns(np.searchsorted(nodes, interface))
        factor, pivot = _factorise(schur.take(unknowns, 0).take(unknowns, 1))
        compliance = cho_inverse(factor)
    smallest_pivot = min(pivot, elimination.smallest_pivot)
    return Fronts(cells, elimination.fronts, interface, compliance, len(is_fixed), smallest_pivot)


class _Elimination:
    """Elimination of the inner nodes of a piece, part by part.

    Parameters
    ----------
    cells : StiffCells
        Cells with n nodes.
    positions : (t, 2) ndarray
        Positions of the cells.
    interface : (m,) ndarray of int
        Nodes that remain.
    n_nodes : int
        Number n of nodes.
    keep_fronts : bool
        Whether `fronts` lists the fronts in the order of elimination.
    """

    def __init__(self, cells: StiffCells, positions, interface, n_nodes: int, *, keep_fronts: bool):
        self.cells = cells
        self.positions = positions
        self.keep_fronts = keep_fronts
        self.fronts = []
        self.smallest_pivot = 1.0
        # A node is eliminated in the smallest part that contains all of its cells
        self.counts = np.bincount(cells.nodes.ravel(), minlength=n_nodes + 1)
        self.counts[interface] += 1
        self.position = np.empty(n_nodes + 1, np.int64)

    def condense(self, members: np.ndarray) -> _Part:
        """Return the part that consists of some cells after the elimination of its own nodes."""
        # Large parts are halved across their longer side
        # Largest number of cells in a part that is not halved further
        if members.size > 100:
            along = self.positions[members]
            along = along[:, np.argmax(np.ptp(along, axis=0))]
            cut = np.partition(along, members.size // 2)[members.size // 2]
            is_first = along < cut if (along < cut).any() else along <= cut
            terms = [self.condense(members[is_first]), self.condense(members[~is_first])]
            nodes = np.concatenate([term.nodes for term in terms])
            counts = np.concatenate([term.counts for term in terms])
            add_terms = _add_stiffnesses
        else:
            terms = StiffCells(self.cells.nodes[members], self.cells.matrices[members])
            nodes = terms.nodes[terms.nodes < self.counts.size - 1]
            counts = np.ones(nodes.size)
            add_terms = _assemble_cells

        # The different nodes; np.unique takes several times as long for few of them
        different = np.sort(nodes)
        different = different[np.diff(different, prepend=-1) > 0]
        self.position[different] = np.arange(different.size)
        counts = np.bincount(self.position[nodes], counts)
        is_own = counts == self.counts[different]
        own = different[is_own]
        boundary = different[~is_own]

        # A last node that does not exist stands for those that a term does not contain
        order = np.concatenate((own, boundary, [self.counts.size - 1]))
        front, matrix = _eliminate(own, boundary, add_terms(terms, order, self.position))
        self.smallest_pivot = min(self.smallest_pivot, front.smallest_pivot)
        if self.keep_fronts:
            self.fronts.append(front)
        return _Part(boundary, counts[~is_own], matrix)


def _decouple_fixed(cells: StiffCells, is_fixed) -> None:
    """Decouple the fixed displacements in the stiffness of each cell, with 1 on the diagonal.

    `is_fixed` (n + 1, 2) tells which displacements are 0. Their rows and columns become 0.
    """
    is_fixed = is_fixed[cells.nodes].reshape(len(cells.nodes), -1)
    held = np.flatnonzero(is_fixed.any(axis=1))
    is_free = ~is_fixed[held]
    cells.matrices[held] *= is_free[:, :, None] & is_free[:, None]
    cell, unknown = np.nonzero(is_fixed)
    cells.matrices[cell, unknown, unknown] = 1.0


def _assemble_cells(cells: StiffCells, order, position) -> np.ndarray:
    """Return the stiffness (2 k, 2 k) [N/m per m] of cells for the nodes `order` (k,); see `_add_stiffnesses`."""
    position[order] = np.arange(order.size)
    unknowns = _number_unknowns(position[cells.nodes])
    size = 2 * order.size
    entries = unknowns[:, :, None] * size + unknowns[:, None]
    return np.bincount(entries.ravel(), cells.matrices.ravel(), size**2).reshape(size, size)


def _add_stiffnesses(terms, order, position) -> np.ndarray:
    """Return the sum (2 k, 2 k) [N/m per m] of the stiffnesses of two halves for k nodes.

    `terms` are both halves, `order` (k,) are the nodes of the sum, and `position` (N + 1,) is a
    workspace for the places of all N nodes in a term.
    """
    total = None
    for nodes, _, matrix in terms:
        # Nodes that the term does not contain take the zeros in its last rows and columns
        position[order] = nodes.size
        position[nodes] = np.arange(nodes.size)
        unknowns = _number_unknowns(position[order])
        term = matrix.take(unknowns, 0).take(unknowns, 1)
        total = term if total is None else np.add(total, term, total)
    return total


def _number_unknowns(nodes) -> np.ndarray:
    """Return the numbers (..., 2 k) of the unknowns of nodes (..., k), node by node along x and inward."""
    return (2 * nodes[..., None] + np.arange(2)).reshape(*nodes.shape[:-1], 2 * nodes.shape[-1])


def _eliminate(own_nodes, boundary, matrix) -> tuple[Front, np.ndarray]:
    """Eliminate the own nodes of a part.

    With K its stiffness, K_oo = L L^T, W = L^-1 K_ob and the Schur complement S = K_bb - W^T W.

    Parameters
    ----------
    own_nodes, boundary : (a,) and (b,) ndarray of int
        Nodes that are eliminated (o), and those that remain (b).
    matrix : (2 a + 2 b + 2, 2 a + 2 b + 2) ndarray
        Stiffness of the part [N/m per m] for the own nodes, the boundary and a last node with zeros.

    Returns
    -------
    front : Front
        L and W of the eliminated nodes.
    remaining : (2 b + 2, 2 b + 2) ndarray
        S of the boundary and of the last node.
    """
    size = 2 * own_nodes.size
    own_boundary = matrix[:size, size:].copy()
    remaining = matrix[size:, size:].copy()
    factor = matrix[:size, :size].copy()
    smallest_pivot = 1.0
    # The coupling W and the remaining stiffness S overwrite their terms
    if own_nodes.size:
        factor, smallest_pivot = _factorise(factor)
        # The arrays are passed transposed, because LAPACK stores columns.
        coupling = own_boundary.T
        dtrsm(1.0, factor, coupling, side=1, lower=1, trans_a=1, overwrite_b=1)
        dgemm(-1.0, coupling, coupling, beta=1.0, c=remaining.T, trans_b=1, overwrite_c=1)

    front = Front(own_nodes, boundary, factor, own_boundary[:, : 2 * boundary.size], smallest_pivot)
    return front, remaining


def _factorise(matrix) -> tuple[np.ndarray, float]:
    """Return the lower Cholesky factor of a symmetric matrix, which is overwritten, and its smallest relative pivot."""
    diagonal = matrix.diagonal().copy()
    factor, fault = dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
    if fault:
        raise NotConverged(
            "the stiffness of the piece is not positive definite; "
            "check the elastic constants and the cells of the mesh"
        )
    return factor, float((factor.diagonal() ** 2 / diagonal).min())
