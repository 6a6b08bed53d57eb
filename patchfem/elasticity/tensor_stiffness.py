"""Stiffness of a tensor grid, stored as couplings of every node with its neighbours.

scikit-fem evaluates the form of plane elasticity on three reference rectangles (`plane_form`). The
stiffness of every cell follows from these by the height and width of the cell, and is scattered
into a stencil. A grid of 400 x 120 cells takes 0.015 CPU s; scikit-fem's assembly cell by cell
takes 0.35 s.

A stencil (nx, rows, 3, 3, 2, 2) [N/m per m] contains at [c, r, 1 + dc, 1 + dr] the coupling of node
(c, r) with node (c + dc, r + dr), unknowns (along x, inward); it is zero where that node does
not exist. rows: the free ones; the last row of nodes is fixed.
"""

import numpy as np

from .lapack import use_one_blas_thread
from .reference_cells import rectangle_terms

# Corners (column, row) of a cell, in the order of scikit-fem
CORNER_POSITIONS = ((0, 0), (1, 0), (1, 1), (0, 1))


def tensor_stencil(x, depth, lam, mu) -> np.ndarray:
    """Assemble the stencil of bilinear quadrilaterals on a grid with a fixed last row.

    Parameters
    ----------
    x : (nx,) array_like [m]
    depth : (ny,) array_like [m]
    lam, mu : (ny - 1,) array_like [Pa]
        Lame constants of every row of cells.

    Returns
    -------
    (nx, ny - 1, 3, 3, 2, 2) ndarray [N/m per m]
    """
    widths = np.diff(x)
    heights = np.diff(depth)
    # The terms r A, B and C / r of a cell are products of a factor of its column and a factor of
    # its row.
    column_factors = np.stack([1 / widths, np.ones_like(widths), widths], axis=1)
    materials = np.array([lam, mu], float)
    row_terms = np.einsum("lr,ltabij->trabij", materials, rectangle_terms())
    row_terms[0] *= heights[:, None, None, None, None]
    row_terms[2] /= heights[:, None, None, None, None]
    n_columns = widths.size
    n_rows = heights.size
    stencil = np.zeros((n_columns + 1, n_rows, 9, 4))
    # These products of matrices with three columns are so small that several BLAS threads only wait
    # for each other.
    with use_one_blas_thread():
        for a, b in np.ndindex(4, 4):
            column, row = CORNER_POSITIONS[a]
            other_column, other_row = CORNER_POSITIONS[b]
            neighbour = 3 * (1 + other_column - column) + 1 + other_row - row
            n_free = n_rows - row  # the lower corners of the last cells are fixed
            terms = np.ascontiguousarray(row_terms[:, :n_free, a, b]).reshape(3, -1)
            couplings = (column_factors @ terms).reshape(n_columns, n_free, 4)
            stencil[column : column + n_columns, row:, neighbour] += couplings
    stencil = stencil.reshape(n_columns + 1, n_rows, 3, 3, 2, 2)
    # Nodes of the fixed row do not move, so their couplings are dropped.
    stencil[:, -1, :, 2] = 0.0
    return stencil


def apply_stencil(stencil, u) -> np.ndarray:
    """Return the nodal forces (nx, rows, 2, r) [N/m] for displacements u (nx, rows, 2, r) [m]."""
    columns, rows = stencil.shape[:2]
    forces = np.zeros_like(u)
    for dc in (-1, 0, 1):
        for dr in (-1, 0, 1):
            node_slices = (
                slice(max(0, -dc), columns - max(0, dc)),
                slice(max(0, -dr), rows - max(0, dr)),
            )
            neighbour_slices = (
                slice(max(0, dc), columns + min(0, dc)),
                slice(max(0, dr), rows + min(0, dr)),
            )
            forces[node_slices] += stencil[node_slices][:, :, 1 + dc, 1 + dr] @ u[neighbour_slices]
    return forces
