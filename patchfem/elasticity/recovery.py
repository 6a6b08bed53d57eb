"""Stress inside a pressed piece, recovered at the nodes, and an estimate of its error.

A plane is fitted to the stresses at the cell centres around a node (superconvergent patch recovery,
Zienkiewicz and Zhu, Int. J. Numer. Meth. Eng. 33, 1992, 1331), in coating and substrate separately,
because the stress jumps between them. The recovered field minus the computed one estimates the
error (Zienkiewicz and Zhu 1987).
"""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from ..core import frozen_array
from ..mesh.nodal_averages import GroupedPatches, Patches, collect_patches
from .elasticity import Layers, Piece, hooke

# A patch whose correlations of (1, x, y) have a smaller determinant takes in the cells around it.
MIN_PLANE_DETERMINANT = 0.1
GAUSS_COORDINATE = 1 / np.sqrt(3)  # local coordinate of the points of 2 x 2 Gauss quadrature
CORNER_COORDINATES = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """The cells of one piece.

    - ``points``: (N, 2) x and depth [m] of the nodes
    - ``blocks``: arrays (c, 3) or (c, 4) of node numbers; the cells are numbered block after block
    - ``is_coating``: (t,) bool
    - ``layers``: the materials
    """

    points: np.ndarray
    blocks: tuple
    is_coating: np.ndarray
    layers: Layers

    def owner(self) -> np.ndarray:
        """Return the cell number of every corner, block after block."""
        sizes = np.concatenate([np.full(len(block), block.shape[1]) for block in self.blocks])
        return np.repeat(np.arange(sizes.size), sizes)

    def corners(self) -> np.ndarray:
        """Return the node number of every corner, block after block."""
        return np.concatenate([block.ravel() for block in self.blocks])

    def centres(self) -> np.ndarray:
        """Return the centres of the cells (t, 2) [m] as x and depth."""
        return np.concatenate([self.points[block].mean(axis=1) for block in self.blocks])


def get_cells(piece) -> Cells:
    """Return the cells of an elasticity.Piece or a substructure.Substructure."""
    if isinstance(piece, Piece):
        return Cells(piece.nodes, (piece.cells,), piece.is_coating, piece.layers)
    mesh = piece.mesh
    blocks = tuple(block for block in (mesh.triangles, mesh.quads) if len(block))
    return Cells(mesh.points, blocks, mesh.is_coating, piece.layers)


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
    strains = []
    for block in cells.blocks:
        first, second = _axis_changes(cells.points, block)
        u_first, u_second = _axis_changes(u, block)
        area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        exx = (u_first[..., 0] * second[:, 1] - u_second[..., 0] * first[:, 1]) / area
        eyy = (u_second[..., 1] * first[:, 0] - u_first[..., 1] * second[:, 0]) / area
        along_by_depth = u_second[..., 0] * first[:, 0] - u_first[..., 0] * second[:, 0]
        inward_by_x = u_first[..., 1] * second[:, 1] - u_second[..., 1] * first[:, 1]
        strains.append((exx, eyy, (along_by_depth + inward_by_x) / (2 * area)))
    strain = [np.concatenate(parts, axis=1) for parts in zip(*strains)]
    return hooke(strain, cells.is_coating, cells.layers)


def _axis_changes(values, block) -> tuple[np.ndarray, np.ndarray]:
    """Return the changes (..., c, k) of nodal values (..., N, k) along both local axes of cells.

    For a quad these are twice the differences between the midpoints of opposite sides.
    """
    corners = [values.take(nodes, axis=-2) for nodes in block.T]
    if len(corners) == 3:
        return corners[1] - corners[0], corners[2] - corners[0]
    diagonal = corners[2] - corners[0]
    other_diagonal = corners[1] - corners[3]
    return diagonal + other_diagonal, diagonal - other_diagonal


@dataclass(frozen=True, eq=False, slots=True)
class Recovery:
    """Linear map from cell centres to recovery points, one for each node and material.

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
        """Recover values (..., s, k) at the recovery points from (..., t, k) at cell centres.

        Linear fields are recovered exactly.
        """
        values = np.asarray(values)
        by_cell = np.moveaxis(values, -2, 0)
        out = self.fit @ by_cell.reshape(len(by_cell), -1)
        return np.moveaxis(out.reshape(-1, *by_cell.shape[1:]), 0, -2)


def fit_recovery(cells: Cells) -> Recovery:
    """Fit a plane to the cell centres around every node, in each of its materials.

    A patch that is too thin for a plane, as at edges and corners, takes in the cells around it. If
    it stays thin, as in a coating of one row, the fit has no slope across it.
    """
    owner = cells.owner()
    key, recovery_point = np.unique(
        2 * cells.corners() + cells.is_coating[owner], return_inverse=True
    )
    node = key // 2
    near = collect_patches(recovery_point, owner)
    centres = cells.centres()
    fit, is_thin = _fit_planes(near, cells.points[node], centres)
    if is_thin.any():
        thin = np.flatnonzero(is_thin)
        own = near.select(thin)
        touched = collect_patches(near.cells, near.point_of_entry).select(
            own.cells
        )  # points near these cells
        beyond = near.select(touched.cells)
        widened = collect_patches(
            own.point_of_entry[touched.point_of_entry][beyond.point_of_entry], beyond.cells
        )
        more, _ = _fit_planes(widened, cells.points[node[thin]], centres)
        is_kept = ~is_thin[fit.point_of_entry]
        fit = collect_patches(
            np.concatenate([fit.point_of_entry[is_kept], thin[more.point_of_entry]]),
            np.concatenate([fit.cells[is_kept], more.cells]),
            np.concatenate([fit.weights[is_kept], more.weights]),
        )
    return Recovery(cells, node, key % 2 == 1, recovery_point, fit)


def _fit_planes(near: Patches, points, centres) -> tuple[Patches, np.ndarray]:
    """Fit a plane to the cell centres of each patch by least squares.

    Returns the weights of the cells of each patch, and whether it is too thin for a plane.

    points: (s, 2) [m] at which the planes are evaluated.
    """
    starts = near.starts[:-1]
    counts = np.diff(near.starts)
    row = near.point_of_entry
    offset = centres[near.cells] - points[row]
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
    # cells in one line determine no slope across it, which the pseudo-inverse sets to zero
    inverse = np.linalg.pinv(spread, rcond=1e-8, hermitian=True)
    slope = np.einsum("sij,sj->si", inverse, -mean)
    weights = 1 / counts[row] + np.einsum("ni,ni->n", deviation, slope[row])
    return Patches(near.starts, near.cells, weights), is_thin


@dataclass(frozen=True, eq=False, slots=True)
class Quadrature:
    """Gauss points of one block of cells.

    - ``block``: (c, n) nodes of the cells
    - ``shape``: (g, n) shape functions at the points
    - ``gradient``: (c, g, n, 2) their derivatives [1/m]
    - ``weight``: (c, g) [m2]
    """

    block: np.ndarray
    shape: np.ndarray
    gradient: np.ndarray
    weight: np.ndarray

    def strain(self, u) -> np.ndarray:
        """Return the plane strains exx, eyy, exy (3, c, g) [1] of displacements u (N, 2) [m]."""
        slope = np.einsum("cgnj,cni->ijcg", self.gradient, u[self.block], optimize=True)
        return np.stack([slope[0, 0], slope[1, 1], (slope[0, 1] + slope[1, 0]) / 2])


def make_quadratures(cells: Cells) -> list[Quadrature]:
    """Return the Gauss points of each block with which the stiffness is integrated.

    These are 2 x 2 points in quadrilaterals and 3 points in triangles.
    """
    rules = []
    for block in cells.blocks:
        if block.shape[1] == 3:
            at = np.array([[4, 1], [1, 4], [1, 1]]) / 6
            shape = np.column_stack([1 - at.sum(axis=1), at])
            local_gradient = np.broadcast_to(np.array([[-1, -1], [1, 0], [0, 1]]), (3, 3, 2))
            local_weight = 1 / 6
        else:
            at = GAUSS_COORDINATE * CORNER_COORDINATES
            factors = 1 + at[:, None] * CORNER_COORDINATES
            shape = factors.prod(axis=2) / 4
            local_gradient = CORNER_COORDINATES * factors[..., ::-1] / 4
            local_weight = 1.0
        jacobian = np.einsum("gni,cnj->cgij", local_gradient, cells.points[block], optimize=True)
        inverse = np.linalg.inv(jacobian)
        gradient = np.einsum("gni,cgji->cgnj", local_gradient, inverse, optimize=True)
        weight = local_weight * np.linalg.det(jacobian)
        rules.append(Quadrature(block, shape, gradient, weight))
    return rules


def quadrature_stress(cells: Cells, rules: list, u) -> list[np.ndarray]:
    """Compute the plane stresses at the Gauss points of each block.

    Parameters
    ----------
    cells : Cells
    rules : list of Quadrature
    u : (N, 2) ndarray
        Displacements [m] along x and inward.

    Returns
    -------
    list of (c, g, 3) ndarray
        xx, yy, xy [Pa], positive in tension.
    """
    out = []
    first = 0
    for rule in rules:
        is_coating = cells.is_coating[first : first + len(rule.block)]
        first += len(rule.block)
        strain = np.swapaxes(rule.strain(u), 1, 2)  # the materials belong to the last axis
        stress = hooke(strain, is_coating, cells.layers)
        out.append(np.swapaxes(stress, 0, 1)[..., [0, 1, 3]])
    return out


@dataclass(frozen=True, eq=False, slots=True)
class StressError:
    """Estimated error of the stress in the energy norm.

    - ``error``: (frames, t) squared norm of the error of every cell [J/m]
    - ``energy``: (frames,) squared norm of the computed stress, twice the stored energy [J/m]
    """

    error: np.ndarray
    energy: np.ndarray

    def relative(self, *others: "StressError") -> tuple[np.ndarray, np.ndarray]:
        """Return the errors relative to the energy norm of the stress in all pieces.

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


class EnergyNorms(NamedTuple):
    """Squared energy norms of the error of each cell (t,) and of the whole stress [J/m]."""

    error: np.ndarray
    energy: float


def estimate_error(recovery: Recovery, u, stress, rules: list) -> StressError:
    """Estimate the error of the stress by the method of Zienkiewicz and Zhu.

    ||sigma* - sigma||^2 = integral of (sigma* - sigma) : C^-1 : (sigma* - sigma) per metre of
    width. sigma* is the recovered stress, interpolated by the shape functions.

    Parameters
    ----------
    recovery : Recovery
    u : (frames, N, 2) ndarray
        Displacements [m].
    stress : (frames, t, 4) ndarray
        Stress at the cell centres [Pa] (`centre_stress`).
    rules : list of Quadrature

    Returns
    -------
    StressError
    """
    cells = recovery.cells
    lam, mu = cells.layers.lame(cells.is_coating)
    sides = _rectangle_sides(cells)
    if sides is None:
        frame_norms = partial(_compute_quadrature_norms, recovery, rules)
    else:
        rectangles = Rectangles(
            recovery.fit.group_by_size(),
            np.ascontiguousarray(recovery.recovery_point.reshape(-1, 4).T),
            np.ascontiguousarray(cells.blocks[0].T),
            sides,
        )
        frame_norms = partial(_compute_rectangle_norms, rectangles)
    norms = [
        frame_norms(motion, centre[:, [0, 1, 3]], lam, mu) for motion, centre in zip(u, stress)
    ]
    return StressError(
        frozen_array([norm.error for norm in norms]), frozen_array([norm.energy for norm in norms])
    )


def _rectangle_sides(cells: Cells) -> np.ndarray | None:
    """Return the lengths (2, t) [m] of rectangles along x and inward; None for other cells.

    The first corner of each has the least coordinates, as on a tensor grid.
    """
    if len(cells.blocks) != 1 or cells.blocks[0].shape[1] != 4:
        return None
    first, second, third, fourth = np.moveaxis(cells.points[cells.blocks[0]], 1, 0)
    sides = (third - first).T
    corners = np.stack([third[:, 0], first[:, 1]]), np.stack([first[:, 0], third[:, 1]])
    deviation = max(np.abs(second.T - corners[0]).max(), np.abs(fourth.T - corners[1]).max())
    return sides if 1e9 * deviation < sides.min() else None


class Rectangles(NamedTuple):
    """Recovery on cells that are rectangles.

    - ``fit``: weights of the recovery
    - ``recovery_points``, ``nodes``: (4, t) recovery points and nodes of the corners
    - ``sides``: (2, t) lengths [m] along x and inward
    """

    fit: GroupedPatches
    recovery_points: np.ndarray
    nodes: np.ndarray
    sides: np.ndarray


def _compute_rectangle_norms(rectangles: Rectangles, u, stress, lam, mu) -> EnergyNorms:
    """Compute the `EnergyNorms` of the stress at one instant on rectangles, in closed form.

    Both fields are split into 1, xi, eta and xi eta, which are orthogonal with the mean squares 1,
    1/3, 1/3 and 1/9, and into (xx + yy) / (2 sqrt(lam + mu)), (xx - yy) / (2 sqrt(mu)) and
    xy / sqrt(mu), whose squares add up to the complementary energy. Arrays have the three
    components first, because NumPy is slow along an axis of three.

    u: (N, 2) [m]; stress: xx, yy, xy (t, 3) [Pa] at the cell centres.
    """
    width, height = rectangles.sides
    bulk = np.sqrt(lam + mu)
    shear = np.sqrt(mu)
    xx, yy, xy = stress.T
    constant = np.stack([(xx + yy) / (2 * bulk), (xx - yy) / (2 * shear), xy / shear])
    recovered = rectangles.fit(constant)
    a, b, c, d = (recovered.take(points, axis=1) for points in rectangles.recovery_points)
    displacement = np.ascontiguousarray(u.T)
    u_a, u_b, u_c, u_d = (displacement.take(nodes, axis=1) for nodes in rectangles.nodes)
    # twice the coefficients of the term xi eta of the bilinear displacements, which give the part of the stresses that is
    # linear in xi or eta
    along, inward = (u_a - u_b + u_c - u_d) / 2
    by_xi = np.stack([bulk * inward, -shear * inward, shear * along]) / height
    by_eta = np.stack([bulk * along, shear * along, shear * inward]) / width
    upper_sum = a + b
    lower_sum = c + d
    upper_difference = b - a
    lower_difference = c - d
    error = sum(
        np.einsum("kt,kt->t", part, part) * mean_square
        for part, mean_square in (
            ((upper_sum + lower_sum) / 4 - constant, 1),
            ((upper_difference + lower_difference) / 4 - by_xi, 1 / 3),
            ((lower_sum - upper_sum) / 4 - by_eta, 1 / 3),
            ((lower_difference - upper_difference) / 4, 1 / 9),
        )
    )
    energy = sum(
        np.einsum("kt,kt->t", part, part) * mean_square
        for part, mean_square in ((constant, 1), (by_xi, 1 / 3), (by_eta, 1 / 3))
    )
    area = width * height
    return EnergyNorms(area * error, float(area @ energy))


def _compute_quadrature_norms(recovery: Recovery, rules: list, u, stress, lam, mu) -> EnergyNorms:
    """Compute the `EnergyNorms` of the stress at one instant by quadrature, on cells of any shape."""
    at_corners = recovery(stress)[recovery.recovery_point]
    errors = []
    energy = 0.0
    first_corner = 0
    first_cell = 0
    for rule, computed in zip(rules, quadrature_stress(recovery.cells, rules, u)):
        n_cells, n_corners = rule.block.shape
        cells = slice(first_cell, first_cell + n_cells)
        corners = slice(first_corner, first_corner + n_cells * n_corners)
        nodal = at_corners[corners].reshape(n_cells, n_corners, 3)
        recovered = np.einsum("gn,cnk->cgk", rule.shape, nodal)
        density = _complementary_energy(recovered - computed, lam[cells], mu[cells])
        errors.append((rule.weight * density).sum(axis=1))
        energy += (rule.weight * _complementary_energy(computed, lam[cells], mu[cells])).sum()
        first_corner = corners.stop
        first_cell = cells.stop
    return EnergyNorms(np.concatenate(errors), energy)


def _complementary_energy(stress, lam, mu) -> np.ndarray:
    """Return the density s : C^-1 : s (c, g) [Pa] of plane stresses (c, g, 3); lam, mu: (c,)."""
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    lam = lam[:, None]
    mu = mu[:, None]
    return (xx**2 + yy**2 + 2 * xy**2 - lam / (2 * (lam + mu)) * (xx + yy) ** 2) / (2 * mu)


def choose_rounding_step(recovery: Recovery, error: StressError, rules: list, fraction: float):
    """Choose a rounding step for stresses that is small compared with their estimated error.

    Rounding to multiples of q changes xx, yy and xy by q / sqrt(12) in the root mean square, whose
    complementary energy is at most q^2 / (6 mu) per volume.

    Parameters
    ----------
    recovery : Recovery
    error : StressError
    rules : list of Quadrature
    fraction : float
        Change by rounding over the estimated error of any loaded frame, in the energy norm [1].

    Returns
    -------
    float
        Step [Pa]; 0 if no frame has an estimated error.
    """
    total = error.error.sum(axis=1)
    if not total.any():
        return 0.0
    area = np.concatenate([rule.weight.sum(axis=1) for rule in rules])
    _, mu = recovery.cells.layers.lame(recovery.cells.is_coating)
    smallest = total[total > 0].min()
    return float(fraction * np.sqrt(6 * smallest / (area / mu).sum()))
