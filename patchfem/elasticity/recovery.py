"""Stress inside a pressed piece, recovered at the nodes, and an estimate of its error.

A plane is fitted to the stresses at the cell centres around a node (superconvergent patch recovery,
Zienkiewicz and Zhu, Int. J. Numer. Meth. Eng. 33, 1992, 1331), in coating and substrate separately,
because the stress jumps between them. The recovered field minus the computed one estimates the
error (Zienkiewicz and Zhu 1987).
"""

from dataclasses import dataclass

import numpy as np

from ..core import frozen_array
from ..mesh.nodal_averages import Patches, collect_patches
from .elasticity import Layers, Piece, hooke
from .lapack import use_one_blas_thread
from .reference_cells import ElementValues, element_values

# Smallest determinant of the correlations of (1, x, y) for which a patch determines a plane; a
# patch with a smaller one is extended by the neighbouring cells
MIN_PLANE_DETERMINANT = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """Cells of one piece, in blocks of the same element type.

    - ``points``: (N, 2) x and depth [m] of the nodes
    - ``blocks``: arrays (c, 3) or (c, 4) of node numbers; the cells are numbered block after block
    - ``is_coating``: (t,) bool
    - ``layers``: the materials
    """

    points: np.ndarray
    blocks: tuple
    is_coating: np.ndarray
    layers: Layers

    def cell_of_corner(self) -> np.ndarray:
        """Return the cell number of every cell corner."""
        sizes = np.concatenate([np.full(len(block), block.shape[1]) for block in self.blocks])
        return np.repeat(np.arange(sizes.size), sizes)

    def corners(self) -> np.ndarray:
        """Return the node number of every cell corner."""
        return np.concatenate([block.ravel() for block in self.blocks])

    def centres(self) -> np.ndarray:
        """Return the centres of the cells (t, 2) [m] as x and depth."""
        return np.concatenate([self.points[block].mean(axis=1) for block in self.blocks])


def get_cells(piece) -> Cells:
    """Return the cells of an elasticity.Piece or a substructure.Substructure."""
    if isinstance(piece, Piece):
        x = piece.grid.x
        depth = piece.grid.depth
        points = np.stack(np.broadcast_arrays(x[:, None], depth), axis=-1).reshape(-1, 2)
        # A cell has the nodes (column, row), (column + 1, row), (column + 1, row + 1) and
        # (column, row + 1); cells and nodes are numbered column by column.
        first = (np.arange(x.size - 1)[:, None] * depth.size + np.arange(depth.size - 1)).ravel()
        corners = np.stack([first, first + depth.size, first + depth.size + 1, first + 1], axis=1)
        return Cells(points, (corners,), piece.grid.is_coating_cell().ravel(), piece.layers)
    mesh = piece.mesh
    blocks = tuple(block for block in (mesh.triangles, mesh.quads) if len(block))
    return Cells(mesh.points, blocks, mesh.is_coating, piece.layers)


@dataclass(frozen=True, eq=False, slots=True)
class CellPoints:
    """Points in the cells of one block, with the values of the shape functions of scikit-fem.

    - ``corners``: (n, c) nodes of the cells
    - ``element``: values of the element at the points of its reference cell
    - ``inverse_jacobian``: (2, 2, g, c) derivative of local coordinate j along axis i at [i, j]
      [1/m]
    - ``weight``: (g, c) weights for integrals over the cells [m2]
    """

    corners: np.ndarray
    element: ElementValues
    inverse_jacobian: np.ndarray
    weight: np.ndarray

    def strain(self, u) -> np.ndarray:
        """Return the plane strains exx, eyy, exy (3, g, c) [1] of displacements u (N, 2) [m]."""
        local_slopes = _local_slopes(self.element, self.corners, u)
        slopes = np.einsum("glkc,ilgc->kigc", local_slopes, self.inverse_jacobian)
        return np.stack([slopes[0, 0], slopes[1, 1], (slopes[0, 1] + slopes[1, 0]) / 2])

    def interpolate(self, values) -> np.ndarray:
        """Interpolate values (n, ..., c) at the corners; returns (g, ..., c) at the points."""
        return _combine_corners(self.element.shape, values)


def _local_slopes(element: ElementValues, corners, values) -> np.ndarray:
    """Return the derivatives (g, 2, 2, c) of nodal values (N, 2) with respect to the local coordinates.

    The second axis is the local coordinate, the third the component of the values.
    """
    by_component = np.ascontiguousarray(np.transpose(values))
    corner_values = np.stack([by_component.take(nodes, axis=1) for nodes in corners])
    return _combine_corners(element.gradient, corner_values)


def _combine_corners(factors, values) -> np.ndarray:
    """Return the products (..., c) of factors (..., n) with values (n, ..., c) at the corners."""
    # Several BLAS threads only wait for each other in products with so few rows.
    with use_one_blas_thread():
        return np.tensordot(factors, values, axes=1)


def make_points(cells: Cells, kind: str) -> list[CellPoints]:
    """Return the Gauss points or the centres of the cells of each block.

    Parameters
    ----------
    cells : Cells
    kind : {"gauss", "centre"}
        Gauss points, with which the stiffness is integrated, or the centres.

    Returns
    -------
    list of CellPoints
    """
    points = []
    for block in cells.blocks:
        corners = np.ascontiguousarray(block.T)
        element = element_values(len(corners), kind)
        jacobian = _local_slopes(element, corners, cells.points)
        (x_by_first, y_by_first), (x_by_second, y_by_second) = np.moveaxis(jacobian, 0, 2)
        determinant = x_by_first * y_by_second - y_by_first * x_by_second
        adjugate = np.array([[y_by_second, -y_by_first], [-x_by_second, x_by_first]])
        weight = element.weight[:, None] * determinant
        points.append(CellPoints(corners, element, adjugate / determinant, weight))
    return points


def centre_stress(cells: Cells, u: np.ndarray) -> np.ndarray:
    """Compute the stress at the centres of cells, the superconvergent points of bilinear quads.

    Parameters
    ----------
    cells : Cells
    u : (frames, nodes, 2) ndarray
        Displacements [m] along x and inward.

    Returns
    -------
    (frames, t, 4) ndarray
        xx, yy, zz, xy [Pa], positive in tension. y is the inward axis, so xy changes its sign for
        a piece that is drawn at y < 0.
    """
    centres = make_points(cells, "centre")
    out = np.empty((len(u), cells.is_coating.size, 4))
    for frame, motion in zip(out, u):
        strains = [points.strain(motion)[:, 0] for points in centres]
        frame[:] = hooke(np.concatenate(strains, axis=1), cells.is_coating, cells.layers)
    return out


@dataclass(frozen=True, eq=False, slots=True)
class Recovery:
    """Linear map of cell-centre stresses to nodes, separately for each material.

    A node on the border of coating and substrate has two recovery points.

    - ``cells``: the Cells
    - ``node``, ``is_coating``: (s,) node number and material of each recovery point
    - ``recovery_point``: recovery point of every corner, in the order of `Cells.corners`
    - ``fit``: cells and weights of every recovery point; the weights add up to 1
    """

    cells: Cells
    node: np.ndarray
    is_coating: np.ndarray
    recovery_point: np.ndarray
    fit: Patches

    def __call__(self, values) -> np.ndarray:
        """Map values (..., t, k) at cell centres to recovery points (..., s, k).

        Linear fields are recovered exactly.
        """
        values = np.asarray(values)
        by_cell = np.moveaxis(values, -2, 0)
        out = self.fit @ by_cell.reshape(len(by_cell), -1)
        return np.moveaxis(out.reshape(-1, *by_cell.shape[1:]), 0, -2)


def fit_recovery(cells: Cells) -> Recovery:
    """Fit a plane to the cell-centre stresses around every node, separately for each material.

    A patch that is too thin for a plane, as at edges and corners, takes in the cells around it. If
    it stays thin, as in a coating of one row, the fit has no slope across it.
    """
    cell_of_corner = cells.cell_of_corner()
    key, recovery_point = np.unique(
        2 * cells.corners() + cells.is_coating[cell_of_corner], return_inverse=True
    )
    node = key // 2
    patches = collect_patches(recovery_point, cell_of_corner)
    centres = cells.centres()
    fit, is_thin = _fit_planes(patches, cells.points[node], centres)
    if is_thin.any():
        thin_points = np.flatnonzero(is_thin)
        thin_patches = patches.select(thin_points)
        # These are the points whose patches contain the cells of the thin patches.
        neighbour_points = collect_patches(patches.cells, patches.point_of_entry).select(
            thin_patches.cells
        )
        neighbour_patches = patches.select(neighbour_points.cells)
        wide_patches = collect_patches(
            thin_patches.point_of_entry[neighbour_points.point_of_entry][
                neighbour_patches.point_of_entry
            ],
            neighbour_patches.cells,
        )
        wide_fit, _ = _fit_planes(wide_patches, cells.points[node[thin_points]], centres)
        is_kept = ~is_thin[fit.point_of_entry]
        fit = collect_patches(
            np.concatenate([fit.point_of_entry[is_kept], thin_points[wide_fit.point_of_entry]]),
            np.concatenate([fit.cells[is_kept], wide_fit.cells]),
            np.concatenate([fit.weights[is_kept], wide_fit.weights]),
        )
    return Recovery(cells, node, key % 2 == 1, recovery_point, fit)


def _fit_planes(patches: Patches, points, centres) -> tuple[Patches, np.ndarray]:
    """Fit a plane to the values at the cell centres around each node by least squares.

    Returns the weights of the cells of each patch, and whether it is too thin for a plane.

    points: (s, 2) [m] at which the planes are evaluated.
    """
    starts = patches.starts[:-1]
    counts = np.diff(patches.starts)
    row = patches.point_of_entry
    offset = centres[patches.cells] - points[row]
    size = np.maximum.reduceat(np.abs(offset), starts)
    offset /= np.where(size > 0, size, 1.0)[row]
    terms = np.column_stack([np.ones(row.size), offset])
    gram = np.add.reduceat(terms[:, :, None] * terms[:, None], starts)
    scale = np.sqrt(np.einsum("sii->si", gram))
    scale = np.where(scale > 0, scale, 1.0)
    correlations = gram / (scale[:, :, None] * scale[:, None])
    is_thin = np.linalg.det(correlations) < MIN_PLANE_DETERMINANT
    mean = gram[:, 0, 1:] / counts[:, None]
    deviation = offset - mean[row]
    spread = np.add.reduceat(deviation[:, :, None] * deviation[:, None], starts)
    # Cells in one line determine no slope across it; the pseudo-inverse sets this slope to zero.
    inverse = np.linalg.pinv(spread, rcond=1e-8, hermitian=True)
    slope = np.einsum("sij,sj->si", inverse, -mean)
    weights = 1 / counts[row] + np.einsum("ni,ni->n", deviation, slope[row])
    return Patches(patches.starts, patches.cells, weights), is_thin


@dataclass(frozen=True, eq=False, slots=True)
class StressError:
    """Estimate of the error of the stress in the energy norm.

    - ``error``: (frames, t) squared norm of the error of every cell [J/m]
    - ``energy``: (frames,) squared norm of the computed stress, twice the stored energy [J/m]
    """

    error: np.ndarray
    energy: np.ndarray

    def relative_error(self, *others: "StressError") -> tuple[np.ndarray, np.ndarray]:
        """Return the errors divided by the energy norm of the stress in all pieces.

        Parameters
        ----------
        *others : StressError
            Errors of the pieces that are pressed together with this piece.

        Returns
        -------
        cells : (frames, t) ndarray [1]
        total : (frames,) ndarray [1]
            Its square is the sum of the squares of the cells.
        """
        total = self.error.sum(axis=1)
        norm = np.zeros(total.size)
        for piece in (self, *others):
            norm = norm + piece.energy + piece.error.sum(axis=1)
        norm = np.where(norm > 0, norm, 1.0)
        return np.sqrt(self.error / norm[:, None]), np.sqrt(total / norm)


def estimate_error(recovery: Recovery, u, stress, gauss_points: list) -> StressError:
    """Estimate the error of the stress by the method of Zienkiewicz and Zhu.

    ||sigma* - sigma||^2 = integral of (sigma* - sigma) : C^-1 : (sigma* - sigma) per metre of
    width. sigma* is the recovered stress, interpolated by the shape functions. The integrals are
    sums over the Gauss points. The components (xx + yy) / (2 sqrt(lam + mu)),
    (xx - yy) / (2 sqrt(mu)) and xy / sqrt(mu) of a stress have squares that add up to the
    integrand.

    Parameters
    ----------
    recovery : Recovery
    u : (frames, N, 2) ndarray
        Displacements [m].
    stress : (frames, t, 4) ndarray
        Stress at the cell centres [Pa] (`centre_stress`).
    gauss_points : list of CellPoints

    Returns
    -------
    StressError
    """
    lam, mu = recovery.cells.layers.lame(recovery.cells.is_coating)
    bulk = np.sqrt(lam + mu)
    shear = np.sqrt(mu)
    recover = recovery.fit.group_by_size()
    error = np.zeros((len(u), mu.size))
    energy = np.zeros(len(u))
    for frame, motion in enumerate(u):
        xx, yy, _, xy = stress[frame].T
        recovered = recover(np.stack([(xx + yy) / (2 * bulk), (xx - yy) / (2 * shear), xy / shear]))
        first_cell = 0
        first_corner = 0
        for points in gauss_points:
            n_corners, n_cells = points.corners.shape
            cells = slice(first_cell, first_cell + n_cells)
            corners = slice(first_corner, first_corner + n_cells * n_corners)
            nodes = recovery.recovery_point[corners].reshape(n_cells, n_corners).T
            at_corners = np.stack([recovered.take(node, axis=1) for node in nodes])
            at_points = points.interpolate(at_corners)
            exx, eyy, exy = points.strain(motion)
            components = (
                bulk[cells] * (exx + eyy),
                shear[cells] * (exx - eyy),
                shear[cells] * (2 * exy),
            )
            for k, component in enumerate(components):
                energy[frame] += (points.weight * component**2).sum()
                difference = at_points[:, k] - component
                error[frame, cells] += np.einsum("gc,gc->c", points.weight, difference**2)
            first_cell = cells.stop
            first_corner = corners.stop
    return StressError(frozen_array(error), frozen_array(energy))
