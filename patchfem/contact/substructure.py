"""One piece of any mesh condensed to its interface: assembled by scikit-fem, factorised once with the interface last.

With the unknowns split into inside i and interface s and K = L U, the trailing blocks of the factors are the Schur
complement S = K_ss - K_si K_ii^-1 K_is = L_ss U_ss, so one sparse factorisation gives the compliance S^-1 and serves
every displacement field after it. The inside is ordered by nested dissection of its coordinates.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dtrtri
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad1, ElementTriP1, ElementVector, MeshQuad, MeshTri
from skfem.helpers import ddot, sym_grad, trace
from threadpoolctl import threadpool_limits

from ..core import NotConverged, frozen_array
from .elasticity import Layers, hooke, lame

LEAF = 24  # nodes below which a part is not cut any further
RESIDUAL = 1e-8  # of a solve with random loads, relative


@dataclass(frozen=True, eq=False, slots=True)
class Substructure:
    """Assembled piece. mesh: as mesh.anymesh.PieceMesh; order: (n,) free nodes as eliminated, interface last by x;
    matrix: stiffness per unit width in that order, two unknowns per node (along x, inward); factor: of the matrix."""

    mesh: object
    layers: Layers
    order: np.ndarray
    matrix: csc_matrix
    factor: object


def assemble(mesh, layers: Layers) -> Substructure:
    """Stiffness per unit width [N/m per m] of one piece held at its far face, and its factors.

    mesh: points (N, 2) as x and depth [m], triangles, quads, is_coating, interface, far as in mesh.anymesh.PieceMesh.
    NotConverged when the factors do not solve the system.
    """
    order = np.concatenate([dissected(mesh), mesh.interface])
    unknowns = (2 * order[:, None] + [0, 1]).ravel()
    matrix = _stiffness(mesh, layers)[unknowns][:, unknowns].tocsc()
    with threadpool_limits(1, "blas"):
        try:
            factor = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError as error:
            raise NotConverged(f"the stiffness of the piece cannot be factorised ({error})") from None
    load = np.random.default_rng(0).normal(size=matrix.shape[0])
    miss = np.abs(matrix @ factor.solve(load) - load).max() / np.abs(load).max()
    if not miss <= RESIDUAL:
        raise NotConverged(f"the stiffness of the piece is solved to {miss:.1e} only, wanted {RESIDUAL:.0e}")
    return Substructure(mesh, layers, order, matrix, factor)


def _stiffness(mesh, layers: Layers):
    pairs = np.array([lame(*layers.substrate, layers.plane), lame(*layers.coating, layers.plane)])

    @BilinearForm
    def energy(u, v, w):
        return w.lam * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * w.mu * ddot(sym_grad(u), sym_grad(v))

    size, total, first = 2 * len(mesh.points), None, 0
    for cells, shape, element, order in ((mesh.triangles, MeshTri, ElementTriP1, 1),
                                         (mesh.quads, MeshQuad, ElementQuad1, 2)):
        coat = mesh.is_coating[first:first + len(cells)]
        first += len(cells)
        if not len(cells):
            continue
        used, own = np.unique(cells, return_inverse=True)
        part = shape(np.ascontiguousarray(mesh.points[used].T), np.ascontiguousarray(own.reshape(cells.shape).T))
        basis = Basis(part, ElementVector(element()), intorder=order)
        lam, mu = (np.repeat(pairs[coat.astype(int), k][:, None], basis.X.shape[-1], axis=1) for k in (0, 1))
        stiff = energy.assemble(basis, lam=lam, mu=mu).tocoo()
        place = np.empty(2 * used.size, np.int64)
        place[basis.nodal_dofs] = 2 * used + np.array([[0], [1]])
        stiff = coo_matrix((stiff.data, (place[stiff.row], place[stiff.col])), shape=(size, size)).tocsr()
        total = stiff if total is None else total + stiff
    return total


def dissected(mesh) -> np.ndarray:
    """Free nodes off the interface in the order of elimination: both halves of a part, then the cut between them.

    A part is halved at the median of its longer side; the nodes of one half that touch the other are the cut. All
    parts of a level are cut at once, so the cost is a sort per level: 0.3 s for 1e5 nodes.
    """
    count = len(mesh.points)
    inside = np.ones(count, bool)
    inside[mesh.interface] = inside[mesh.far] = False
    pairs = np.concatenate([cells[:, [i, j]] for cells in (mesh.triangles, mesh.quads)
                            for i in range(cells.shape[1]) for j in range(i)])
    pairs = pairs[inside[pairs].all(axis=1)]
    key = np.zeros(count, np.int64)  # digits of base 3: 0 and 1 the halves, 2 the cut
    active = inside.copy()
    while active.any():
        nodes = np.flatnonzero(active)
        _, part, sizes = np.unique(key[nodes], return_inverse=True, return_counts=True)
        key *= 3
        side = np.zeros(count, np.int64)
        side[nodes] = _halves(mesh.points[nodes], part, sizes)
        big = np.zeros(count, bool)
        big[nodes] = sizes[part] > LEAF
        pairs = pairs[big[pairs].all(axis=1) & (key[pairs[:, 0]] == key[pairs[:, 1]])]
        apart = pairs[side[pairs[:, 0]] != side[pairs[:, 1]]]
        cut = np.where(side[apart[:, 0]] == 0, apart[:, 0], apart[:, 1])
        key[big] += side[big]
        active = big
        key[cut] += 2
        active[cut] = False
    inside = np.flatnonzero(inside)
    return inside[np.lexsort((mesh.points[inside, 0], mesh.points[inside, 1], key[inside]))]


def _halves(points, part, sizes) -> np.ndarray:
    """0 or 1 for every point: the half of its part, cut at the median of the part's longer side."""
    order = np.argsort(part, kind="stable")
    starts = np.cumsum(sizes) - sizes
    extent = np.maximum.reduceat(points[order], starts) - np.minimum.reduceat(points[order], starts)
    along = np.where(extent[part, 0] >= extent[part, 1], points[:, 0], points[:, 1])
    order = np.lexsort((along, part))
    rank = np.empty(len(part), np.int64)
    rank[order] = np.arange(len(part)) - np.repeat(starts, sizes)
    return (rank >= sizes[part] // 2).astype(np.int64)


def condense(piece: Substructure) -> tuple:
    """Compliance of one piece at its interface per unit width: (nn, tt, nt), each (m, m) [m2/N], read-only.

    nn: inward motion per inward force; tt: motion along x per force along x; nt: inward motion per force along x.
    """
    m = 2 * len(piece.mesh.interface)
    size = piece.matrix.shape[0]
    if np.array_equal(piece.factor.perm_c[-m:], np.arange(size - m, size)) and \
            np.array_equal(piece.factor.perm_r, piece.factor.perm_c):
        low = piece.factor.L[size - m:, size - m:].toarray()
        pivots = piece.factor.U.diagonal()[size - m:]
        inverse, _ = dtrtri(low, lower=1, unitdiag=1)
        both = inverse.T @ (inverse / pivots[:, None])
    else:
        unit = np.zeros((size, m))
        unit[size - m:] = np.eye(m)
        both = piece.factor.solve(unit)[size - m:]
    both = (both + both.T) / 2
    return tuple(frozen_array(part) for part in (both[1::2, 1::2], both[0::2, 0::2], both[1::2, 0::2]))


def joined(lower: tuple, upper: tuple) -> tuple:
    """Compliance of the pair (nn, tt, nt) from those of its pieces: pressure acts inward on both, shear is opposed.

    nn: closing per pressure force; tt: slide upper - lower undone per shear; nt: closing per shear force along +x on
    the lower piece, exactly zero for mirrored pieces.
    """
    return tuple(frozen_array(part) for part in (lower[0] + upper[0], lower[1] + upper[1], lower[2] - upper[2]))


def displacement(piece: Substructure, shear: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(frames, N, 2) displacement [m] (along x, inward) under nodal interface forces per unit width [N/m].

    shear, normal: (frames, m) acting on the piece along +x and inward; the factors of the piece are used again.
    """
    shear, normal = np.atleast_2d(shear), np.atleast_2d(normal)
    frames, m = normal.shape
    load = np.zeros((piece.order.size, 2, frames))
    load[-m:, 0], load[-m:, 1] = shear.T, normal.T
    with threadpool_limits(1, "blas"):
        u = piece.factor.solve(load.reshape(-1, frames)).reshape(-1, 2, frames)
    out = np.zeros((frames, len(piece.mesh.points), 2))
    out[:, piece.order] = np.moveaxis(u, 2, 0)
    return out


def _gradients(corner) -> np.ndarray:
    """(cells, n, 2) gradients of the shape functions at the middle of triangles or quads with corners (cells, n, 2)."""
    local = np.array([[-1, -1], [1, 0], [0, 1]]) if corner.shape[1] == 3 else \
        np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 4
    jacobian = np.einsum("ni,cnj->cij", local, corner)
    return np.einsum("ni,cji->cnj", local, np.linalg.inv(jacobian))


def cell_stress(piece: Substructure, u: np.ndarray) -> tuple:
    """Stress at cell middles, tension > 0: (frames, t + q, 4) as xx, yy, zz, xy [Pa] and von Mises (frames, t + q).

    u: (frames, N, 2); triangles first. The inward axis is kept, so xy changes sign for the piece drawn at y < 0.
    """
    mesh = piece.mesh
    slope = np.concatenate([np.einsum("cnj,fcni->fcij", _gradients(mesh.points[cells]), u[:, cells])
                            for cells in (mesh.triangles, mesh.quads) if len(cells)], axis=1)
    shear = (slope[..., 0, 1] + slope[..., 1, 0]) / 2
    return hooke(slope[..., 0, 0], slope[..., 1, 1], shear, mesh.is_coating, piece.layers)
