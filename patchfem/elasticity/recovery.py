"""Stress inside a pressed piece, recovered at the nodes, and an estimate of its error.

A plane is fitted to the stresses at the cell centres around a node (superconvergent patch recovery,
Zienkiewicz and Zhu, Int. J. Numer. Meth. Eng. 33, 1992, 1331), in coating and substrate separately,
because the stress jumps between them. The recovered field minus the computed one estimates the
error (Zienkiewicz and Zhu 1987).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core import frozen_array
from ..mesh.elements import ELEMENTS, number_cells
from .elasticity import CellPoints, Layers, Piece, compute_stress, evaluate_cells

# Elements of first order by the number of their corners, by which recovered stresses are interpolated
ELEMENTS_BY_CORNERS = {3: ELEMENTS["triangle"], 4: ELEMENTS["quad"]}


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """Cells of one piece.

    - ``points``: (N, 2) x and depth of the nodes [m]
    - ``groups``: nodes (t, k) of the cells by the name of their element
    - ``is_coating``: (t,) bool, in the order of the groups
    - ``layers``: materials
    """

    points: np.ndarray
    groups: dict[str, np.ndarray]
    is_coating: np.ndarray
    layers: Layers

    @property
    def blocks(self) -> tuple[np.ndarray, ...]:
        """Corners (t, 3) or (t, 4) of the cells of each element."""
        return tuple(nodes[:, : ELEMENTS[kind].n_corners] for kind, nodes in self.groups.items())

    def cell_of_corner(self) -> np.ndarray:
        """Return the cell number of every cell corner."""
        sizes = np.concatenate([np.full(len(block), block.shape[1]) for block in self.blocks])
        return np.repeat(np.arange(sizes.size), sizes)

    def centres(self) -> np.ndarray:
        """Return the centres of the cells (t, 2) [m] as x and depth."""
        return np.concatenate([self.points[block].mean(axis=1) for block in self.blocks])


def get_cells(piece: Piece) -> Cells:
    """Return the cells of a piece with their nodes and materials."""
    mesh = piece.mesh
    return Cells(mesh.points, mesh.blocks, mesh.is_coating, piece.layers)


def make_points(cells: Cells, kind: str) -> list[CellPoints]:
    """Return points inside the cells of each element, with shape functions and weights.

    They are the Gauss points if `kind` is "gauss" and the centres if it is "centre".
    """
    out = []
    for name, nodes in cells.groups.items():
        element = ELEMENTS[name]
        local_points = element.gauss
        weights = element.weights
        if kind == "centre":
            local_points = element.centre
            weights = np.array([element.weights.sum()])
        out.append(evaluate_cells(cells.points, nodes, element, local_points, weights))
    return out


def compute_centre_stress(cells: Cells, u: np.ndarray) -> np.ndarray:
    """Compute the stress at the centres of cells, the superconvergent points of bilinear quads.

    Parameters
    ----------
    cells : Cells
        Cells of the piece.
    u : (frames, N, 2) ndarray
        Displacements [m].

    Returns
    -------
    (frames, t, 4) ndarray [Pa]
        Stresses xx, yy, zz, xy.
    """
    centres = make_points(cells, "centre")
    out = np.empty((len(u), cells.is_coating.size, 4))
    for frame, motion in zip(out, u):
        strains = [
            points.strain(np.take(motion, nodes, axis=0))[..., 0]
            for points, nodes in zip(centres, cells.groups.values())
        ]
        frame[:] = compute_stress(np.concatenate(strains, axis=1), cells.is_coating, cells.layers)
    return out


class Patches(NamedTuple):
    """Cells around each of s points, with their weights in the value at the point.

    - ``point``: (e,) point of each entry, in ascending order
    - ``cell``: (e,) cell of each entry
    - ``weight``: (e,) weight of each entry
    """

    point: np.ndarray
    cell: np.ndarray
    weight: np.ndarray

    def __matmul__(self, values) -> np.ndarray:
        """Return the weighted sums (s, k) of values (t, k) at the cells."""
        starts = np.flatnonzero(np.diff(self.point, prepend=-1))
        return np.add.reduceat(self.weight[:, None] * values[self.cell], starts)

    def list_cells(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Return the cells around given points (p,), and the position in `points` to which each belongs."""
        counts = np.bincount(self.point)
        starts = np.cumsum(counts) - counts
        owner = np.repeat(np.arange(len(points)), counts[points])
        first = np.repeat(
            starts[points] - np.cumsum(counts[points]) + counts[points], counts[points]
        )
        return self.cell[np.arange(owner.size) + first], owner


def collect_patches(points, cells) -> Patches:
    """Group pairs of a point and a cell near it by point, each pair once.

    `points` and `cells` (e,) are the numbers of both. All weights are 1.
    """
    # Sorting takes a tenth of the time of `np.unique`, which uses a hash table.
    keys = np.sort(np.asarray(points, np.int64) << 32 | cells)
    keys = keys[np.diff(keys, prepend=-1) > 0]
    return Patches(keys >> 32, keys & 0xFFFFFFFF, np.ones(keys.size))


@dataclass(frozen=True, eq=False, slots=True)
class Recovery:
    """Linear map of cell-centre stresses to the s recovery points: nodes, as seen from one material.

    - ``cells``: cells of the piece
    - ``node``: (s,) node of each recovery point
    - ``is_coating``: (s,) material of each recovery point
    - ``recovery_point``: recovery point of each cell corner, in the order of `Cells.cell_of_corner`
    - ``fit``: weights of the cells around each recovery point
    """

    cells: Cells
    node: np.ndarray
    is_coating: np.ndarray
    recovery_point: np.ndarray
    fit: Patches

    def __call__(self, values) -> np.ndarray:
        """Map values (t, k) at cell centres to recovery points (s, k)."""
        return self.fit @ values


def fit_recovery(cells: Cells) -> Recovery:
    """Fit a plane to the cell-centre stresses around every node, separately for each material.

    Where few cells of a material meet at a node, as in a coating of one row, their neighbours are
    added.

    `Patches.list_cells` returns the cells around some points, and for each of these cells the number of its point.

    Parameters
    ----------
    cells : Cells
        Cells of the piece.

    Returns
    -------
    Recovery
    """
    # A recovery point is a node together with a material, and its patch the cells of this material at the node
    cell_of_corner = cells.cell_of_corner()
    corners = np.concatenate([block.ravel() for block in cells.blocks])
    key = 2 * corners + cells.is_coating[cell_of_corner]
    key, recovery_point = np.unique(key, return_inverse=True)
    node = key // 2
    patches = collect_patches(recovery_point, cell_of_corner)
    centres = cells.centres()
    fit, is_thin = _fit_planes(patches, cells.points[node], centres)

    # A patch of too few cells gets the cells around all points of its cells
    if is_thin.any():
        thin = np.flatnonzero(is_thin)
        around, owner = patches.list_cells(thin)
        points, number = collect_patches(patches.cell, patches.point).list_cells(around)
        wide_cells, wide_number = patches.list_cells(points)
        wide = collect_patches(owner[number[wide_number]], wide_cells)
        wide_fit, _ = _fit_planes(wide, cells.points[node[thin]], centres)

        # They replace the thin patches, in the order of the points
        is_kept = ~is_thin[fit.point]
        parts = zip((part[is_kept] for part in fit), wide_fit._replace(point=thin[wide_fit.point]))
        fit = Patches(*map(np.concatenate, parts))
        order = np.argsort(fit.point, kind="stable")
        fit = Patches(*(part[order] for part in fit))

    return Recovery(cells, node, key % 2 == 1, recovery_point, fit)


def _fit_planes(patches: Patches, points, centres) -> tuple[Patches, np.ndarray]:
    """Fit a plane to the values at the cell centres around each node by least squares.

    Parameters
    ----------
    patches : Patches
        Cells around each node.
    points : (s, 2) ndarray
        Nodes [m].
    centres : (t, 2) ndarray
        Centres of the cells [m].

    Returns
    -------
    fit : Patches
        Weights of the cell values in the value of the plane at the node.
    is_thin : (s,) ndarray of bool
        Whether the cells of a node do not determine a plane well.
    """
    row = patches.point
    starts = np.flatnonzero(np.diff(row, prepend=-1))
    counts = np.bincount(row)
    offset = centres[patches.cell] - points[row]
    size = np.maximum.reduceat(np.abs(offset), starts)
    offset /= np.where(size > 0, size, 1.0)[row]

    # Normal equations of 1, x and y around each node; their correlations tell whether they determine a plane
    terms = np.column_stack([np.ones(row.size), offset])
    gram = np.add.reduceat(terms[:, :, None] * terms[:, None], starts)
    scale = np.sqrt(np.einsum("sii->si", gram))
    scale = np.where(scale > 0, scale, 1.0)
    # Smallest determinant of the correlations of (1, x, y) for which a patch determines a plane; a
    # patch with a smaller one is extended by the neighbouring cells
    is_thin = np.linalg.det(gram / (scale[:, :, None] * scale[:, None])) < 0.1

    # Value of the plane at the node: mean of the values, less the slopes times the mean offset
    mean = gram[:, 0, 1:] / counts[:, None]
    deviation = offset - mean[row]
    spread = np.add.reduceat(deviation[:, :, None] * deviation[:, None], starts)
    # Cells in one line determine no slope across it; the pseudo-inverse sets this slope to zero.
    inverse = np.linalg.pinv(spread, rcond=1e-8, hermitian=True)
    slope = np.einsum("sij,sj->si", inverse, -mean)
    weights = 1 / counts[row] + np.einsum("ni,ni->n", deviation, slope[row])
    return patches._replace(weight=weights), is_thin


@dataclass(frozen=True, eq=False, slots=True)
class StressError:
    """Estimate of the error of the stress in the energy norm.

    - ``error``: (frames, t) squared errors of the cells [N]
    - ``energy``: (frames,) squared norms of the stress of the piece [N]
    """

    error: np.ndarray
    energy: np.ndarray

    def relative_error(self, *others: "StressError") -> tuple[np.ndarray, np.ndarray]:
        """Return the errors divided by the energy norm of the stress in all pieces.

        Returns
        -------
        by_cell : (frames, t) ndarray
            Errors of the cells [1].
        in_piece : (frames,) ndarray
            Errors of the piece [1].
        """
        total = self.error.sum(axis=1)
        norm = np.zeros(total.size)
        for piece in (self, *others):
            norm = norm + piece.energy + piece.error.sum(axis=1)
        norm = np.where(norm > 0, norm, 1.0)
        return np.sqrt(self.error / norm[:, None]), np.sqrt(total / norm)


def estimate_error(recovery: Recovery, u, stress, gauss_points: list[CellPoints]) -> StressError:
    """Estimate the error of the stress by the method of Zienkiewicz and Zhu.

    Parameters
    ----------
    recovery : Recovery
        Map of the stresses at the centres to the nodes.
    u : (frames, N, 2) ndarray
        Displacements [m].
    stress : (frames, t, 4) ndarray
        From `compute_centre_stress` [Pa].
    gauss_points : list of CellPoints
        Points of `make_points`, by element, at which the error is integrated.

    Returns
    -------
    StressError
    """
    cells = recovery.cells
    lam, mu = cells.layers.lame_constants(cells.is_coating)
    # The energy is (lam + mu) (exx + eyy)^2 + mu (exx - eyy)^2 + 4 mu exy^2, in components whose squares add up.
    bulk = np.sqrt(lam + mu)
    shear = np.sqrt(mu)
    error = np.zeros((len(u), mu.size))
    energy = np.zeros(len(u))
    for frame, motion in enumerate(u):
        # The same components from the stresses at the centres, recovered at the corners of the cells
        xx, yy, _, xy = stress[frame].T
        at_centres = np.stack([(xx + yy) / (2 * bulk), (xx - yy) / (2 * shear), xy / shear], axis=1)
        recovered = recovery(at_centres).T[:, recovery.recovery_point]
        first_corner = 0
        for (kind, nodes, part), points in zip(number_cells(cells.groups), gauss_points):
            # Recovered components of the cells of one element, interpolated to the Gauss points
            n_corners = ELEMENTS[kind].n_corners
            end_corner = first_corner + n_corners * len(nodes)
            at_corners = recovered[:, first_corner:end_corner].reshape(3, len(nodes), n_corners)
            first_corner = end_corner
            shape = ELEMENTS_BY_CORNERS[n_corners].evaluate(ELEMENTS[kind].gauss).values
            at_points = at_corners @ shape.T

            # Squared difference from the computed components, integrated over each cell
            exx, eyy, exy = points.strain(np.take(motion, nodes, axis=0))
            computed = np.stack(
                [
                    bulk[part, None] * (exx + eyy),
                    shear[part, None] * (exx - eyy),
                    shear[part, None] * 2 * exy,
                ]
            )
            energy[frame] += np.vdot(points.weights, (computed**2).sum(axis=0))
            squares = ((at_points - computed) ** 2).sum(axis=0)
            error[frame, part] = (points.weights * squares).sum(axis=1)
    return StressError(frozen_array(error), frozen_array(energy))
