"""Stiffness of cells whose nodes stand anywhere, from scikit-fem's gradients of scalar shape functions and its
quadrature; and a grid of such cells in the numbers of a tensor grid."""

import numpy as np
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix
from skfem import Basis, ElementQuad1, MeshQuad

from ..core import PatchfemError
from .elasticity import Layers, Piece, grid_cells, lame
from .tensor_stiffness import stencil_of


def assemble_nodes(nodes, coating_rows: int, layers: Layers) -> Piece:
    """Assemble one piece held at its last row of nodes, with isoparametric quadrilaterals.

    nodes: (nx, ny, 2) as x and depth [m], x rising with the column and depth with the row; coating_rows: rows of cells
    in the coating; layers: its Layers. `Piece.x` are the places of the first row, `Piece.depth` the depths of the
    middle column. PatchfemError where a cell is folded.
    """
    nodes = np.asarray(nodes, float)
    columns, rows = nodes.shape[:2]
    flat = nodes.reshape(-1, 2)
    cells, coat = grid_cells(columns, rows, coating_rows)
    _refuse_folded(flat[cells])
    pairs = np.array([lame(*layers.substrate, layers.plane), lame(*layers.coating, layers.plane)])
    lam, mu = pairs[coat.astype(int)].T
    basis = Basis(MeshQuad(flat.T.copy(), cells.T.copy()), ElementQuad1(), intorder=2)
    column, row = np.divmod(np.arange(len(flat)), rows)
    place = np.empty(len(flat), np.int64)
    place[basis.nodal_dofs[0]] = np.where(row < rows - 1, column * (rows - 1) + row, -1)
    matrix = stiffness([(basis, lam, mu, place)], columns * (rows - 1))
    return Piece(nodes[:, 0, 0].copy(), nodes[columns // 2, :, 1].copy(), flat, stencil_of(matrix, columns), cells,
                 coat, layers)


def _refuse_folded(corner) -> None:
    """corner: (t, 4, 2). A quadrilateral is a map of the square where its four corners turn the same way."""
    ahead, back = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    turn = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    bad = np.flatnonzero(~(turn > 0).all(axis=1))
    if bad.size:
        x, depth = corner[bad[0]].mean(axis=0)
        raise PatchfemError(f"{bad.size} cells of the grid are folded, the first at x = {x:.4g} m, depth {depth:.4g} m")


def stiffness(parts, count: int) -> csr_matrix:
    """Stiffness (2 count, 2 count) per unit width [N/m per m], unknowns (along x, inward) node by node.

    parts: (basis, lam, mu, place) for each kind of cell: its scalar basis, Lame pair per cell [Pa], and the node number
    of each of its unknowns, -1 where it is held. Entries that vanish by symmetry are kept as zeros.
    """
    rows, columns, straight, crossed = zip(*(_lower(*part) for part in parts))
    place = tuple(np.concatenate(part) for part in (rows, columns))
    # real and imaginary part: one sum over the cells serves two entries of a block
    blocks = [coo_matrix((np.concatenate(part), place), shape=(count, count)).tocsr() for part in (straight, crossed)]
    del rows, columns, straight, crossed, place
    one, two = blocks
    block = np.empty((one.nnz, 2, 2))
    block[:, 0, 0], block[:, 1, 1], block[:, 0, 1], block[:, 1, 0] = one.data.real, one.data.imag, two.data.real, \
        two.data.imag
    row = np.repeat(np.arange(count), np.diff(one.indptr))
    below = row > one.indices
    strict = bsr_matrix((block[below], one.indices[below], np.append(0, np.cumsum(below))[one.indptr]),
                        shape=(2 * count, 2 * count))
    whole = bsr_matrix((block, one.indices, one.indptr), shape=strict.shape)
    return (whole + strict.T).tocsr()


def _lower(basis, lam, mu, place) -> tuple:
    """Free entries (row >= column) of one kind of cell: rows, columns, xx + i yy and xy + i yx of their blocks.

    With u the motion of the column and v that of the row: xx = (lambda + 2 mu) u,x v,x + mu u,y v,y; yy with x and y
    exchanged; xy = lambda u,y v,x + mu u,x v,y for v along x and u inward; yx the other way round.
    """
    node = place.astype(np.int32)[basis.element_dofs]
    slope = [field[0].grad for field in basis.basis]
    volume = lam[:, None] * basis.dx, mu[:, None] * basis.dx
    out = []
    for i, (vx, vy) in enumerate(slope):
        for j, (ux, uy) in enumerate(slope[:i + 1]):
            column = np.minimum(node[i], node[j])
            free = np.flatnonzero(column >= 0)
            x, y, xy, yx = ux * vx, uy * vy, vx * uy, vy * ux
            (lx, ly, lxy, lyx), (mx, my, mxy, myx) = (
                [np.einsum("tq,tq->t", share, part) for part in (x, y, xy, yx)] for share in volume)
            straight, crossed = np.empty((2, lam.size), complex)
            straight.real, straight.imag = lx + 2 * mx + my, ly + 2 * my + mx
            swapped = node[i] < node[j]
            crossed.real, crossed.imag = lxy + myx, lyx + mxy
            crossed[swapped] = 1j * crossed[swapped].conj()
            out.append((np.maximum(node[i], node[j])[free], column[free], straight[free], crossed[free]))
    return tuple(np.concatenate(part) for part in zip(*out))
