"""Stress inside a pressed piece, recovered node by node, with an estimate of its error.

Recovery: a plane is fitted to the stresses at the cell middles around a node (Zienkiewicz and Zhu, Int. J. Numer. Meth.
Eng. 33, 1992, 1331), coating and substrate apart, because stress jumps between them. The recovered field less the
computed one estimates the error (Zienkiewicz and Zhu 1987).
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..core import frozen_array
from ..mesh.nodal_averages import Gathered, Patches, patches
from .elasticity import Layers, hooke

SPREAD = 0.1  # determinant of the correlations of (1, x, y) over a patch below which it takes in its neighbours
GAUSS = 1 / np.sqrt(3)
CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """The cells of one piece.

    points: (N, 2) as x and depth [m]; blocks: arrays (c, 3 or 4) of node numbers, in the order of the cell stresses;
    is_coating: (t,); layers: the two materials.
    """

    points: np.ndarray
    blocks: tuple
    is_coating: np.ndarray
    layers: Layers

    def owner(self) -> np.ndarray:
        """Cell number of every corner (corners,), block after block."""
        sizes = np.concatenate([np.full(len(block), block.shape[1]) for block in self.blocks])
        return np.repeat(np.arange(sizes.size), sizes)

    def corners(self) -> np.ndarray:
        """Node number of every corner (corners,), block after block."""
        return np.concatenate([block.ravel() for block in self.blocks])

    def middles(self) -> np.ndarray:
        """Middles of the cells (t, 2) [m], as x and depth."""
        return np.concatenate([self.points[block].mean(axis=1) for block in self.blocks])


def cells_of(piece) -> Cells:
    """The cells of an assembled piece, be it an elasticity.Piece or a substructure.Substructure."""
    if hasattr(piece, "mesh"):
        mesh = piece.mesh
        blocks = tuple(block for block in (mesh.triangles, mesh.quads) if len(block))
        return Cells(mesh.points, blocks, mesh.is_coating, piece.layers)
    return Cells(piece.nodes, (piece.cells,), piece.is_coating, piece.layers)


def middle_stress(piece, u: np.ndarray) -> np.ndarray:
    """Return the stress (frames, t, 4) at the middles of cells as xx, yy, zz, xy [Pa], tension > 0.

    The inward axis is kept, so xy changes sign for the piece drawn at y < 0. The middle of a bilinear quad is its
    superconvergent point.

    Parameters
    ----------
    piece : elasticity.Piece or substructure.Substructure
    u : (frames, nodes, 2) ndarray
        Displacements [m] along x and inward.
    """
    cells = cells_of(piece)
    strains = []
    for block in cells.blocks:
        a, b = _spans(cells.points, block)
        along, inward = _spans(u, block)
        area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        exx = (along[..., 0] * b[:, 1] - inward[..., 0] * a[:, 1]) / area
        eyy = (inward[..., 1] * a[:, 0] - along[..., 1] * b[:, 0]) / area
        by_depth = inward[..., 0] * a[:, 0] - along[..., 0] * b[:, 0]
        by_x = along[..., 1] * b[:, 1] - inward[..., 1] * a[:, 1]
        strains.append((exx, eyy, (by_depth + by_x) / (2 * area)))
    strain = [np.concatenate(parts, axis=1) for parts in zip(*strains)]
    return hooke(strain, cells.is_coating, cells.layers)


def _spans(values, block) -> tuple:
    """Return the changes (..., c, 2) of nodal values (..., N, 2) along both local axes of cells (c, 3 or 4).

    Of a quad they are twice the changes between the middles of opposite sides.
    """
    corners = [values.take(nodes, axis=-2) for nodes in block.T]
    if len(corners) == 3:
        return corners[1] - corners[0], corners[2] - corners[0]
    rise, fall = corners[2] - corners[0], corners[1] - corners[3]
    return rise + fall, rise - fall


@dataclass(frozen=True, eq=False, slots=True)
class Recovery:
    """A linear map from cell middles to places; a node has one place in each material that it touches.

    node, coating: (s,) node number and material of each place; fit: weights that sum to one; place: (corners,)
    of every corner of every cell, in the order of Cells.corners.
    """

    cells: Cells
    node: np.ndarray
    coating: np.ndarray
    place: np.ndarray
    fit: Patches

    def __call__(self, values) -> np.ndarray:
        """Values (..., s, k) at the places from values (..., t, k) at the cell middles; linear fields are recovered
        exactly."""
        values = np.asarray(values)
        flat = np.moveaxis(values, -2, 0)
        out = self.fit @ flat.reshape(len(flat), -1)
        return np.moveaxis(out.reshape(-1, *flat.shape[1:]), 0, -2)


def recovery(cells: Cells) -> Recovery:
    """Fit a plane to the cell middles around every node, per material.

    Patches too thin for a plane (edges, corners) take in their neighbours. One that stays thin is fitted along itself
    alone.
    """
    owner, corners = cells.owner(), cells.corners()
    key, place = np.unique(2 * corners + cells.is_coating[owner], return_inverse=True)
    near = patches(place, owner)
    node, middle = key // 2, cells.middles()
    fit, thin = _planes(near, cells.points[node], middle)
    if thin.any():
        pick = np.flatnonzero(thin)
        own = near.of(pick)
        # the places that touch the cells of a thin patch
        touched = patches(near.cells, near.row).of(own.cells)
        beyond = near.of(touched.cells)
        more, _ = _planes(
            patches(own.row[touched.row][beyond.row], beyond.cells),
            cells.points[node[pick]],
            middle,
        )
        keep = ~thin[fit.row]
        fit = patches(
            *(
                np.concatenate(both)
                for both in (
                    (fit.row[keep], pick[more.row]),
                    (fit.cells[keep], more.cells),
                    (fit.weights[keep], more.weights),
                )
            )
        )
    return Recovery(cells, node, key % 2 == 1, place, fit)


def _planes(near, at, middle) -> tuple:
    """Weights of the cells of every patch by least squares, and whether the patch is too thin for a plane: equal shares
    then."""
    starts, counts, row = near.starts[:-1], np.diff(near.starts), near.row
    offset = middle[near.cells] - at[row]
    size = np.maximum.reduceat(np.abs(offset), starts)
    offset /= np.where(size > 0, size, 1.0)[row]
    terms = np.column_stack([np.ones(row.size), offset])
    gram = np.add.reduceat(terms[:, :, None] * terms[:, None], starts)
    scale = np.sqrt(np.einsum("sii->si", gram))
    scale = np.where(scale > 0, scale, 1.0)
    thin = np.linalg.det(gram / (scale[:, :, None] * scale[:, None])) < SPREAD
    mean = gram[:, 0, 1:] / counts[:, None]
    apart = offset - mean[row]
    spread = np.add.reduceat(apart[:, :, None] * apart[:, None], starts)
    # cells in one line fix no slope across it: the pseudo-inverse leaves that one out
    slope = np.einsum("sij,sj->si", np.linalg.pinv(spread, rcond=1e-8, hermitian=True), -mean)
    share = 1 / counts[row] + np.einsum("ni,ni->n", apart, slope[row])
    return Patches(near.starts, near.cells, share), thin


@dataclass(frozen=True, eq=False, slots=True)
class Quadrature:
    """Points of integration in one block of cells.

    block: its nodes (c, n); shape: (g, n); slope: (c, g, n, 2) [1/m]; weight: (c, g) [m2].
    """

    block: np.ndarray
    shape: np.ndarray
    slope: np.ndarray
    weight: np.ndarray

    def strain(self, u) -> tuple:
        """Plane strains (exx, eyy, exy) [1], each (c, g), of displacements u (N, 2) [m] along x and inward."""
        slope = np.einsum("cgnj,cni->cgij", self.slope, u[self.block], optimize=True)
        return slope[..., 0, 0], slope[..., 1, 1], (slope[..., 0, 1] + slope[..., 1, 0]) / 2


def quadratures(cells: Cells) -> list:
    """One Quadrature per block: the points that the stiffness is built with.

    2 x 2 Gauss points in quadrilaterals, 3 points in triangles.
    """
    out = []
    for block in cells.blocks:
        if block.shape[1] == 3:
            at = np.array([[4, 1], [1, 4], [1, 1]]) / 6
            shape = np.column_stack([1 - at.sum(axis=1), at])
            local = np.broadcast_to(np.array([[-1, -1], [1, 0], [0, 1]]), (3, 3, 2))
            weight = 1 / 6
        else:
            at = GAUSS * CORNERS
            both = 1 + at[:, None] * CORNERS
            shape = both.prod(axis=2) / 4
            local = CORNERS * both[..., ::-1] / 4
            weight = 1.0
        jacobian = np.einsum("gni,cnj->cgij", local, cells.points[block], optimize=True)
        slope = np.einsum("gni,cgji->cgnj", local, np.linalg.inv(jacobian), optimize=True)
        out.append(Quadrature(block, shape, slope, weight * np.linalg.det(jacobian)))
    return out


def stresses(cells: Cells, rules: list, u) -> list:
    """Plane stresses (c, g, 3) as xx, yy, xy [Pa], tension > 0, at the points of integration of each block.

    rules: the `quadratures` of the cells; u: (N, 2) [m] along x and inward.
    """
    out, first = [], 0
    for rule in rules:
        coat = cells.is_coating[first : first + len(rule.block)]
        first += len(rule.block)
        strain = [part.T for part in rule.strain(u)]  # cells last: the materials stand there
        stress = hooke(strain, coat, cells.layers)
        out.append(np.swapaxes(stress, 0, 1)[..., [0, 1, 3]])
    return out


@dataclass(frozen=True, eq=False, slots=True)
class Indicator:
    """Estimated error of the stress in energy norm.

    error: (frames, t) squared norm of the error of every cell [J/m]; energy: (frames,) squared norm of the computed
    stress, which is twice the stored energy [J/m].
    """

    error: np.ndarray
    energy: np.ndarray

    def shares(self, *others) -> tuple:
        """Estimated errors over the energy norm of the whole [1]: (frames, t) of each cell, (frames,) of all of them.

        others: the Indicators of the pieces pressed together with this one. The squares of the cells add up to that of
        all.
        """
        total = self.error.sum(axis=1)
        whole = sum(
            (one.energy + one.error.sum(axis=1) for one in (self, *others)), np.zeros(total.size)
        )
        whole = np.where(whole > 0, whole, 1.0)
        return np.sqrt(self.error / whole[:, None]), np.sqrt(total / whole)


def indicator(found: Recovery, u, stress, rules: list | None = None) -> Indicator:
    """Zienkiewicz-Zhu indicator of displacements u (frames, N, 2) [m] with stress (frames, t, 4) at the cell middles.

    ||sigma* - sigma||^2 = integral of (sigma* - sigma) : C^-1 : (sigma* - sigma), sigma* the recovered stress carried
    by the shape functions; per metre of width. rules: the `quadratures` of the cells, made here where None.
    """
    cells, sides = found.cells, _sides(found.cells)
    if sides is None:
        each = partial(_by_points, found, quadratures(cells) if rules is None else rules)
    else:
        corner = found.place.reshape(-1, 4).T, found.cells.blocks[0].T
        each = partial(
            _by_modes, found.fit.gathered(), [np.ascontiguousarray(one) for one in corner], sides
        )
    material = cells.layers.lame(cells.is_coating)
    errors, energies = zip(
        *(each(motion, middle[:, [0, 1, 3]], *material) for motion, middle in zip(u, stress))
    )
    return Indicator(frozen_array(errors), frozen_array(energies))


def _sides(cells: Cells) -> tuple | None:
    """Lengths (t,) [m] of the sides of all cells along x and inward where each is a rectangle with its first corner at
    the least of both; None where one is not."""
    if len(cells.blocks) != 1 or cells.blocks[0].shape[1] != 4:
        return None
    a, b, c, d = np.moveaxis(cells.points[cells.blocks[0]], 1, 0)
    wide, tall = c[:, 0] - a[:, 0], c[:, 1] - a[:, 1]
    off = np.abs(
        np.concatenate([b[:, 0] - c[:, 0], d[:, 0] - a[:, 0], b[:, 1] - a[:, 1], d[:, 1] - c[:, 1]])
    ).max()
    return (wide, tall) if 1e9 * off < min(wide.min(), tall.min()) else None


def _by_modes(fit: Gathered, corner: list, sides: tuple, u, middle, lam, mu) -> tuple:
    """Squared norms of the error (t,) and of the stress [J/m] of rectangles under one motion.

    Both fields are taken apart into 1, xi, eta and xi eta, which are orthogonal with the mean squares 1, 1/3, 1/3 and
    1/9, and into (xx + yy)/(2 sqrt(lam + mu)), (xx - yy)/(2 sqrt(mu)) and xy/sqrt(mu), whose squares add up to the
    complementary energy. fit: of the recovery; corner: the places (4, t) and the nodes (4, t) of the corners of every
    cell; u: (N, 2) [m]; middle: stress xx, yy, xy (t, 3) at the cell middles [Pa]; sides: of `_sides`.
    """
    bulk, shear, (wide, tall) = np.sqrt(lam + mu), np.sqrt(mu), sides
    xx, yy, xy = middle.T
    whole = np.stack([(xx + yy) / (2 * bulk), (xx - yy) / (2 * shear), xy / shear])
    # rows: loops over three numbers would be slow
    smooth, moves = (
        fit(whole),
        np.ascontiguousarray(u.T),
    )
    a, b, c, d = (smooth.take(places, axis=1) for places in corner[0])
    one, two, three, four = (moves.take(nodes, axis=1) for nodes in corner[1])
    along, inward = (one - two + three - four) / 2  # twice what goes with xi eta
    xi = np.stack([bulk * inward, -shear * inward, shear * along]) / tall
    eta = np.stack([bulk * along, shear * along, shear * inward]) / wide
    low, high, apart, other = a + b, c + d, b - a, c - d
    parts = (
        ((low + high) / 4 - whole, 1),
        ((apart + other) / 4 - xi, 3),
        ((high - low) / 4 - eta, 3),
        ((other - apart) / 4, 9),
    )
    error, energy = (
        sum(np.einsum("kt,kt->t", part, part) / share for part, share in of)
        for of in (parts, ((whole, 1), (xi, 3), (eta, 3)))
    )
    return wide * tall * error, float((wide * tall) @ energy)


def _by_points(found: Recovery, rules: list, u, middle, lam, mu) -> tuple:
    """As `_by_modes`, of cells of any shape, at the points of integration."""
    smooth = found(middle)[found.place]
    errors, energy, corner, cell = [], 0.0, 0, 0
    for rule, rough in zip(rules, stresses(found.cells, rules, u)):
        count, nodes = rule.block.shape
        mine = slice(cell, cell + count)
        best = np.einsum(
            "gn,cnk->cgk",
            rule.shape,
            smooth[corner : corner + count * nodes].reshape(count, nodes, 3),
        )
        errors.append((rule.weight * _complementary(best - rough, lam[mine], mu[mine])).sum(axis=1))
        energy += (rule.weight * _complementary(rough, lam[mine], mu[mine])).sum()
        corner, cell = corner + count * nodes, cell + count
    return np.concatenate(errors), energy


def harmless_step(found: Recovery, error: Indicator, rules: list, share: float) -> float:
    """Step [Pa] to which the stresses of a piece may be rounded; 0 where no frame has an estimated error.

    What rounding changes is then, in energy norm, at most `share` [1] of the estimated error of any loaded frame: a
    multiple of q nearest to xx, yy and xy errs by q/sqrt(12) in the mean square, whose complementary energy is at most
    q^2/(6 mu) per volume. rules: the `quadratures` of the cells.
    """
    cells, total = found.cells, error.error.sum(axis=1)
    area = np.concatenate([rule.weight.sum(axis=1) for rule in rules])
    least = total[total > 0].min(initial=np.inf)
    return (
        float(share * np.sqrt(6 * least / (area / cells.layers.lame(cells.is_coating)[1]).sum()))
        if total.any()
        else 0.0
    )


def _complementary(stress, lam, mu) -> np.ndarray:
    """Complementary energy density s : C^-1 : s (c, g) [Pa] of plane stresses (c, g, 3); lam and mu (c,)."""
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    lam, mu = lam[:, None], mu[:, None]
    return (xx**2 + yy**2 + 2 * xy**2 - lam / (2 * (lam + mu)) * (xx + yy) ** 2) / (2 * mu)
