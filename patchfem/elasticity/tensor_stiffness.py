"""Stiffness of a tensor grid as the couplings of every node with its eight neighbours, from matrices of single lines.

Where the materials depend on depth only, the forms of plane elasticity are sums of products of one matrix along x and
one into the depth: K_xx = S_x (x) M_y(lambda + 2 mu) + M_x (x) S_y(mu), K_yy with x and y exchanged, and K_xy = G_x (x)
G_y^T(lambda) + G_x^T (x) G_y(mu), with S the stiffness, M the mass and G_ij = integral of N_i' N_j of linear elements.

A stencil (nx, rows, 3, 3, 2, 2) [N/m per m] holds at [c, r, 1 + dc, 1 + dr] the coupling of node (c, r) with node (c +
dc, r + dr), unknowns (along x, inward); it is zero where there is no such node. rows: those that are free.
"""

import numpy as np


def tensor_stencil(x, depth, lam, mu) -> np.ndarray:
    """Stencil (nx, ny - 1, 3, 3, 2, 2) of bilinear quadrilaterals on a tensor grid held at its last row.

    x: (nx,), depth: (ny,) [m]; lam, mu: (ny - 1,) Lame pair [Pa] of every row of cells.
    """
    x, depth = np.asarray(x, float), np.asarray(depth, float)
    one = np.ones(x.size - 1)
    stiff, mass, slope, slope_t = _line(x, one)
    rows = slice(0, depth.size - 1)
    stiff_p, mass_p = (band[rows] for band in _line(depth, lam + 2 * mu)[:2])
    stiff_m, mass_m, slope_m = (band[rows] for band in _line(depth, mu)[:3])
    slope_l, slope_lt = (band[rows] for band in _line(depth, lam)[2:])
    out = np.empty((x.size, depth.size - 1, 3, 3, 2, 2))
    out[..., 0, 0] = _product(stiff, mass_p) + _product(mass, stiff_m)
    out[..., 1, 1] = _product(mass, stiff_p) + _product(stiff, mass_m)
    out[..., 0, 1] = _product(slope, slope_lt) + _product(slope_t, slope_m)
    out[..., 1, 0] = _product(slope_t, slope_l) + _product(slope, _line(depth, mu)[3][rows])
    out[:, -1, :, 2] = 0.0  # the held row
    return out


def _product(along, inward) -> np.ndarray:
    return along[:, None, :, None] * inward[None, :, None, :]


def _line(points, weight) -> tuple:
    """Bands (n, 3) of S, M, G and G^T of linear elements between `points` (n,), with a weight per cell (n - 1,)."""
    h = np.diff(points)
    stiff, mass, half = weight / h, weight * h / 6, weight / 2
    return (
        _bands(stiff, -stiff, -stiff, stiff),
        _bands(2 * mass, mass, mass, 2 * mass),
        _bands(-half, -half, half, half),
        _bands(-half, half, -half, half),
    )


def _bands(first, up, down, last) -> np.ndarray:
    """Bands (n, 3) of the sum of 2 x 2 cell matrices [[first, up], [down, last]], each entry (n - 1,)."""
    out = np.zeros((first.size + 1, 3))
    out[:-1, 1] = first
    out[1:, 1] += last
    out[:-1, 2] = up
    out[1:, 0] = down
    return out


def applied(stencil, u) -> np.ndarray:
    """Nodal forces (nx, rows, 2, r) of the displacements u (nx, rows, 2, r) [m]."""
    columns, rows = stencil.shape[:2]
    out = np.zeros_like(u)
    for dc in (-1, 0, 1):
        for dr in (-1, 0, 1):
            here = slice(max(0, -dc), columns - max(0, dc)), slice(max(0, -dr), rows - max(0, dr))
            there = slice(max(0, dc), columns + min(0, dc)), slice(max(0, dr), rows + min(0, dr))
            out[here] += stencil[here][:, :, 1 + dc, 1 + dr] @ u[there]
    return out
