"""Stiffness of a grid whose nodes stand anywhere, by scikit-fem, in the numbers of a tensor grid."""

import numpy as np
from skfem import Basis, ElementQuad1, MeshQuad

from ..core import PatchfemError
from .elasticity import Layers, Piece, grid_cells, lame
from .stiffness import stiffness
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
