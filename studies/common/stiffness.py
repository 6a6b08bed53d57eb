"""Stiffness of a piece as a sparse matrix, and the stencil of such a matrix on a tensor grid."""

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from patchfem.elasticity import Piece
from patchfem.elasticity.substructure import assemble_stiffness


def free_stiffness(piece):
    """Assemble the stiffness per unit width [N/m per m] of the free unknowns of a piece.

    Two unknowns per node (along x, inward) stand column by column and row by row for a `Piece`, and in the order of
    elimination for a `Substructure`.
    """
    return (
        make_matrix(piece.stencil)
        if isinstance(piece, Piece)
        else assemble_stiffness(piece.mesh, piece.layers, piece.order)
    )


def make_stencil(matrix: csr_matrix, columns: int) -> np.ndarray:
    """Return the stencil of an assembled stiffness with unknowns ordered by columns, then rows, two per node.

    ValueError where it couples nodes that are not neighbours.
    """
    whole = matrix.tocoo()
    rows = matrix.shape[0] // (2 * columns)
    (i, a), (j, b) = (np.divmod(part, 2) for part in (whole.row, whole.col))
    (c, r), (d, s) = np.divmod(i, rows), np.divmod(j, rows)
    if max(np.abs(d - c).max(initial=0), np.abs(s - r).max(initial=0)) > 1:
        raise ValueError("the matrix couples nodes that are not neighbours on the grid")
    out = np.zeros((columns, rows, 3, 3, 2, 2))
    out[c, r, 1 + d - c, 1 + s - r, a, b] = whole.data
    return out


def make_matrix(stencil) -> csr_matrix:
    """Return a stencil as a sparse matrix, with unknowns ordered by columns, then rows, two per node (along x, inward)."""
    columns, rows = stencil.shape[:2]
    c, r, dc, dr = np.ogrid[:columns, :rows, -1:2, -1:2]
    there = (c + dc >= 0) & (c + dc < columns) & (r + dr >= 0) & (r + dr < rows)
    neighbour = np.broadcast_to((c + dc) * rows + r + dr, there.shape)
    pointer = np.append(0, np.cumsum(there.sum(axis=(2, 3))))
    size = 2 * columns * rows
    return bsr_matrix((stencil[there], neighbour[there], pointer), shape=(size, size)).tocsr()
