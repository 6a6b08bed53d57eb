"""Static condensation of a piece on an unstructured mesh to its interface.

scikit-fem assembles the stiffness cell by cell. With the unknowns split into the inside i and the
interface s, eliminating the inside leaves the Schur complement S = K_ss - K_si K_ii^-1 K_is. One
sparse factorisation with the interface last gives the compliance S^-1 and every field of
displacements. The inside is ordered by nested dissection (`dissect`).
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix
from skfem import Basis, ElementQuad1, ElementTriP1, ElementVector, MeshQuad, MeshTri

from ..core import NotConverged
from ..mesh.anymesh import PieceMesh, cell_edges
from .condense import estimate_round_off, irregular_load
from .dissect import dissect_nodes
from .elasticity import Layers, describe_remedy
from .fronts import Fronts, factorise
from .lapack import use_one_blas_thread
from .plane_form import plane_elasticity


@dataclass(frozen=True, eq=False, slots=True)
class Substructure:
    """Piece on an unstructured mesh with a fixed far face, whose stiffness is factorised on demand.

    A piece whose compliance is in the disk cache is never assembled.

    - ``mesh``, ``layers``: cells and materials
    - ``computed``: cached results: order, factor and round_off_error
    """

    mesh: PieceMesh
    layers: Layers
    computed: dict = field(default_factory=dict)

    @property
    def order(self) -> np.ndarray:
        """Unfixed nodes (n,) in the order of elimination; those of the interface come last, sorted by x."""
        return self._cached_value("order")

    @property
    def factor(self) -> Fronts:
        """Cholesky factors of the stiffness of the unfixed degrees of freedom.

        NotConverged, with a remedy, if the stiffness cannot be factorised.
        """
        return self._cached_value("factor")

    @property
    def round_off_error(self) -> float:
        """Relative round-off error of the compliance [1], which is 0 before the piece is factorised."""
        return self.computed.get("round_off_error", 0.0)

    def solve(self, load) -> np.ndarray:
        """Return displacements (frames, N, 2) [m] under interface loads (m, 2, frames) [N/m]."""
        n_interface, _, frames = load.shape
        full_load = np.zeros((self.order.size, 2, frames))
        full_load[-n_interface:] = load
        with use_one_blas_thread():
            u = self.factor.solve(full_load.reshape(-1, frames)).reshape(full_load.shape)
        out = np.zeros((frames, len(self.mesh.points), 2))
        out[:, self.order] = np.moveaxis(u, 2, 0)
        return out

    def _cached_value(self, name: str):
        """Return a cached result by its name; compute all results on the first call."""
        if not self.computed:
            order, firsts = elimination_order(self.mesh)
            stiffness = assemble_stiffness(self.mesh, self.layers, order)
            try:
                with use_one_blas_thread():
                    factor = factorise(stiffness, firsts)
                    load = irregular_load(stiffness.shape[0])[:, None]
                    u = factor.solve(load)
                    round_off_error = estimate_round_off(
                        load, u, load - stiffness @ u, factor.solve
                    )
            except NotConverged as error:
                mesh = self.mesh
                ends = mesh.points[cell_edges(mesh)[0]]
                min_length = np.hypot(*(ends[:, 1] - ends[:, 0]).T).min()
                size = np.ptp(mesh.points, axis=0)
                remedy = describe_remedy(
                    self.layers, min_length, size, has_coating=mesh.is_coating.any()
                )
                raise NotConverged(f"{error}; {remedy}") from None
            self.computed.update(order=order, factor=factor, round_off_error=round_off_error)
        return self.computed[name]


def elimination_order(mesh: PieceMesh) -> tuple[np.ndarray, np.ndarray]:
    """Order the unfixed nodes of a piece for elimination, with those of the interface last.

    Parameters
    ----------
    mesh : PieceMesh

    Returns
    -------
    order : (n,) ndarray of int
        Free nodes.
    firsts : (f + 1,) ndarray of int
        Position in `order` at which each front begins, and n.
    """
    is_inner = np.ones(len(mesh.points), bool)
    is_inner[mesh.interface] = False
    is_inner[mesh.far] = False
    inner = np.flatnonzero(is_inner)
    number = np.cumsum(is_inner) - 1
    pairs = []
    for cells in (mesh.triangles, mesh.quads):
        for i, j in zip(*np.tril_indices(cells.shape[1], -1)):
            pair = cells[:, [i, j]]
            pairs.append(number[pair[is_inner[pair].all(axis=1)]])
    order, firsts = dissect_nodes(mesh.points[inner], np.concatenate(pairs))
    order = np.concatenate([inner[order], mesh.interface])
    return order, np.append(firsts, order.size)


def assemble_stiffness(mesh: PieceMesh, layers: Layers, order) -> csc_matrix:
    """Assemble the stiffness of a piece with scikit-fem.

    Parameters
    ----------
    mesh : PieceMesh
    layers : Layers
    order : (n,) ndarray of int
        Free nodes, in the order of the unknowns.

    Returns
    -------
    (2 n, 2 n) csc_matrix
        Stiffness per unit width [N/m per m], two unknowns a node (along x, inward).
    """
    size = 2 * len(mesh.points)
    stiffness = csc_matrix((size, size))
    is_coating = np.split(mesh.is_coating, [len(mesh.triangles)])
    for cells, coated, mesh_class, element, degree in (
        (mesh.triangles, is_coating[0], MeshTri, ElementTriP1, 1),
        (mesh.quads, is_coating[1], MeshQuad, ElementQuad1, 2),
    ):
        if not len(cells):
            continue
        nodes, corners = np.unique(cells, return_inverse=True)
        points = np.ascontiguousarray(mesh.points[nodes].T)
        corners = np.ascontiguousarray(corners.reshape(cells.shape).T)
        basis = Basis(mesh_class(points, corners), ElementVector(element()), intorder=degree)
        lam, mu = np.repeat(layers.lame(coated)[..., None], basis.dx.shape[1], axis=2)
        entries = plane_elasticity.coo_data(basis, lam=lam, mu=mu)
        unknown = np.empty(2 * nodes.size, np.int64)
        unknown[basis.nodal_dofs.T] = 2 * nodes[:, None] + [0, 1]
        part = coo_matrix((entries.data, unknown[entries.indices]), shape=(size, size))
        stiffness = stiffness + part.tocsc()
    free = (2 * order[:, None] + [0, 1]).ravel()
    return stiffness[free][:, free].tocsc()
