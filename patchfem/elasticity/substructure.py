"""One piece of any mesh condensed to its interface: assembled by scikit-fem, factorised once with the interface last.

With the unknowns split into inside i and interface s, eliminating the inside leaves the Schur complement
S = K_ss - K_si K_ii^-1 K_is, so one sparse factorisation gives the compliance S^-1 and serves every displacement field
after it. The inside is ordered by nested dissection.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix
from skfem import Basis, ElementQuad1, ElementTriP1, ElementVector, MeshQuad, MeshTri

from ..core import NotConverged
from ..mesh.anymesh import cell_edges
from .condense import CORRECTION, RESIDUAL, rough
from .dissect import dissection
from .elasticity import Layers, lame, remedy
from .fronts import factorise
from .lapack import one_thread
from .plane_form import plane_elasticity


@dataclass(frozen=True, eq=False, slots=True)
class Substructure:
    """One piece of any mesh, held at its far face; assembled and factorised when first needed.

    A piece whose compliance is kept on disk is never assembled. Factors that do not solve the system raise
    NotConverged: one step of refinement then moves the solution for a `rough` load by more than 1e-2; a smaller move is
    the `rounding`. mesh: mesh.anymesh.PieceMesh; layers: its Layers; made: what has been assembled.
    """

    mesh: object
    layers: Layers
    made: dict = field(default_factory=dict)

    @property
    def order(self) -> np.ndarray:
        """Free nodes (n,) in the order of elimination, the interface last by x."""
        return self._part("order")

    @property
    def factor(self):
        """Factors of the matrix, with `solve` and `compliance` as `fronts.Fronts` has them."""
        return self._part("factor")

    @property
    def rounding(self) -> float:
        """Relative error of the compliance by round-off [1], as far as it is known: 0 before anything is factorised."""
        return self.made.get("rounding", 0.0)

    def displaced(self, load) -> np.ndarray:
        """Return displacements (frames, N, 2) [m] under interface loads (m, 2, frames) [N/m]."""
        whole = np.zeros((self.order.size, 2, load.shape[-1]))
        whole[-len(load) :] = load
        with one_thread():
            u = self.factor.solve(whole.reshape(-1, load.shape[-1])).reshape(whole.shape)
        out = np.zeros((load.shape[-1], len(self.mesh.points), 2))
        out[:, self.order] = np.moveaxis(u, 2, 0)
        return out

    def _part(self, name: str):
        if not self.made:
            self.made.update(
                zip(("order", "factor", "rounding"), _assembled(self.mesh, self.layers))
            )
        return self.made[name]


def _assembled(mesh, layers: Layers) -> tuple:
    order, firsts = elimination(mesh)
    matrix = _stiffness(mesh, layers, order)
    with one_thread():
        found = factorise(matrix, firsts)
        load = rough(matrix.shape[0])[:, None]
        u = found.solve(load)
        rest = load - matrix @ u
        change = (
            0.0
            if np.abs(rest).max() <= RESIDUAL * np.abs(load).max()
            else np.abs(found.solve(rest)).max() / np.abs(u).max()
        )
    if not change <= CORRECTION:
        ends = mesh.points[np.unique(np.sort(cell_edges(mesh)[0], axis=1), axis=0)]
        least = np.hypot(*(ends[:, 1] - ends[:, 0]).T).min()
        raise NotConverged(
            f"the equations of the piece are solved only to a relative accuracy of {change:.1e}, but "
            f"{CORRECTION:.0e} is needed; "
            + remedy(layers, mesh.is_coating.any(), least, np.ptp(mesh.points, axis=0))
        )
    return order, found, float(change)


def elimination(mesh) -> tuple:
    """Free nodes (n,) in the order of elimination, the interface last by x, and (f + 1,) where each front begins in
    it."""
    inside = np.ones(len(mesh.points), bool)
    inside[mesh.interface] = inside[mesh.far] = False
    nodes, new = np.flatnonzero(inside), np.cumsum(inside) - 1
    pairs = [
        cells[:, [i, j]]
        for cells in (mesh.triangles, mesh.quads)
        for i in range(cells.shape[1])
        for j in range(i)
    ]
    pairs = np.concatenate([new[pair[inside[pair].all(axis=1)]] for pair in pairs])
    order, firsts = dissection(mesh.points[nodes], pairs)
    return np.concatenate([nodes[order], mesh.interface]), np.append(
        firsts, nodes.size + mesh.interface.size
    )


def _stiffness(mesh, layers: Layers, order) -> csc_matrix:
    """Stiffness (2 n, 2 n) per unit width [N/m per m] of the free nodes `order` (n,), assembled by scikit-fem."""
    pairs, whole = (
        np.array([lame(*layers.substrate, layers.plane), lame(*layers.coating, layers.plane)]),
        0,
    )
    kinds = (mesh.triangles, MeshTri, ElementTriP1, 1), (mesh.quads, MeshQuad, ElementQuad1, 2)
    coating = np.split(mesh.is_coating.astype(int), [len(mesh.triangles)])
    for (cells, shape, element, degree), coated in zip(kinds, coating, strict=True):
        if not len(cells):
            continue
        used, own = np.unique(cells, return_inverse=True)
        part = shape(
            np.ascontiguousarray(mesh.points[used].T),
            np.ascontiguousarray(own.reshape(cells.shape).T),
        )
        basis = Basis(part, ElementVector(element()), intorder=degree)
        lam, mu = (np.broadcast_to(one[:, None], basis.dx.shape) for one in pairs[coated].T)
        found = plane_elasticity.coo_data(basis, lam=lam, mu=mu)
        place = np.empty(2 * used.size, np.int64)
        place[basis.nodal_dofs.T] = 2 * used[:, None] + [0, 1]
        whole = (
            whole
            + coo_matrix(
                (found.data, place[found.indices]), shape=2 * (2 * len(mesh.points),)
            ).tocsc()
        )
    free = (2 * order[:, None] + [0, 1]).ravel()
    return whole[free][:, free].tocsc()
