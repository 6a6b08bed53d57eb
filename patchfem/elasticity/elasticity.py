"""Plane elasticity of one piece on any mesh of triangles and quadrilaterals.

The unknowns of a node are its displacements along x and into the piece, so both pieces of a pair
obey the same equations.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..core import NotConverged, frozen_array
from ..formatting import format_length
from ..mesh import pieces
from ..mesh.elements import ELEMENTS, Element, number_cells
from .fronts import MIN_SAFE_PIVOT, Fronts, StiffCells, condense_to_interface

# Cells whose stiffness is integrated at once: the terms of this many cells need 40 MB
MAX_INTEGRATED_CELLS = 20_000


@dataclass(frozen=True, eq=False, slots=True)
class Layers:
    """Elastic constants of the substrate and the coating of a piece.

    - ``coating``, ``substrate``: Young's modulus [Pa] and Poisson's ratio
    - ``plane``: "strain" or "stress"
    """

    coating: tuple[float, float]
    substrate: tuple[float, float]
    plane: str

    def lame_constants(self, is_coating) -> np.ndarray:
        """Return lambda and mu (2, ...) [Pa] of cells; `is_coating` (...) marks those of the coating."""
        constants = [lame_constants(*pair, self.plane) for pair in (self.substrate, self.coating)]
        return np.moveaxis(np.array(constants)[np.asarray(is_coating, int)], -1, 0)


def lame_constants(young: float, poisson: float, plane: str) -> tuple[float, float]:
    """Return the Lame constants lambda and mu of a plane problem.

    Those of plane stress give the stresses in the plane from the strains in the plane.

    Parameters
    ----------
    young : float
        Young's modulus [Pa].
    poisson : float
        Poisson's ratio [1], below 0.5.
    plane : {"strain", "stress"}
        No strain, or no stress, across the plane.

    Returns
    -------
    lam, mu : float
        [Pa]
    """
    mu = young / (2 * (1 + poisson))
    if plane == "stress":
        return young * poisson / (1 - poisson**2), mu
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu


class CellPoints(NamedTuple):
    """Points in cells of one element, with g points in each of t cells of k nodes.

    - ``values``: (g, k) shape functions
    - ``gradients``: (t, g, 2, k) derivatives of the shape functions along x and inward [1/m]
    - ``weights``: (t, g) areas [m2]
    """

    values: np.ndarray
    gradients: np.ndarray
    weights: np.ndarray

    def strain(self, u) -> np.ndarray:
        """Return the plane strains exx, eyy, exy (3, t, g) [1] of displacements u (t, k, 2) [m] at the nodes."""
        # One product per cell: products per point would take three times as long.
        n_cells, n_points, _, n_nodes = self.gradients.shape
        slopes = self.gradients.reshape(n_cells, 2 * n_points, n_nodes) @ u
        slopes = slopes.reshape(n_cells, n_points, 2, 2)
        return np.stack(
            [slopes[..., 0, 0], slopes[..., 1, 1], (slopes[..., 0, 1] + slopes[..., 1, 0]) / 2]
        )


def evaluate_cells(points, cells, element: Element, local_points, weights) -> CellPoints:
    """Evaluate the shape functions at the same local points of all cells.

    Parameters
    ----------
    points : (N, 2) ndarray
        Nodes [m].
    cells : (t, k) ndarray of int
        Nodes of the cells.
    element : Element
        Reference element of all cells.
    local_points : (g, 2) ndarray
        Points in its local coordinates.
    weights : (g,) ndarray
        Of the integration in local coordinates.

    Returns
    -------
    CellPoints
    """
    values, local_gradients = element.evaluate(local_points)
    jacobian = local_gradients @ points[cells][:, None]
    (a, b), (c, d) = np.moveaxis(jacobian, (-2, -1), (0, 1))
    determinant = a * d - b * c
    inverse = np.stack([np.stack([d, -b], -1), np.stack([-c, a], -1)], -2)
    gradients = (inverse / determinant[..., None, None]) @ local_gradients
    return CellPoints(values, gradients, determinant * weights)


def compute_stiffness(points, cells, element: Element, lam, mu) -> np.ndarray:
    """Integrate the stiffness of cells, sigma(u) : eps(v) with sigma = lam tr(eps) I + 2 mu eps.

    Parameters
    ----------
    points : (N, 2) ndarray
        Nodes [m].
    cells : (t, k) ndarray of int
        Nodes of the cells.
    element : Element
        Reference element of all cells.
    lam, mu : (t,) ndarray
        Lame constants [Pa].

    Returns
    -------
    (t, 2 k, 2 k) ndarray [N/m per m]
        Unknowns node by node along x and inward.
    """
    # Integrals of the products of the gradients of two nodes, by which the stiffness is (lam + 2 mu) xx + mu yy along x
    corners = points[cells]
    is_linear = element.n_corners == 4 and not element.is_quadratic
    if is_linear and np.array_equal(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 3]):
        xx, yy, xy = _integrate_over_parallelograms(corners, element)
    else:
        cell_points = evaluate_cells(points, cells, element, element.gauss, element.weights)
        along, inward = np.moveaxis(cell_points.gradients, 2, 0)
        weighted_along = along * cell_points.weights[..., None]
        weighted_inward = inward * cell_points.weights[..., None]
        xx = weighted_along.swapaxes(1, 2) @ along
        yy = weighted_inward.swapaxes(1, 2) @ inward
        xy = weighted_along.swapaxes(1, 2) @ inward
    lam = lam[:, None, None]
    mu = mu[:, None, None]

    n_cells, k = cells.shape
    out = np.empty((n_cells, k, 2, k, 2))
    out[:, :, 0, :, 0] = (lam + 2 * mu) * xx + mu * yy
    out[:, :, 1, :, 1] = (lam + 2 * mu) * yy + mu * xx
    out[:, :, 0, :, 1] = lam * xy + mu * xy.swapaxes(1, 2)
    out[:, :, 1, :, 0] = out[:, :, 0, :, 1].swapaxes(1, 2)
    return out.reshape(n_cells, 2 * k, 2 * k)


class GradientProducts(NamedTuple):
    """Integrals (t, k, k) [1] of the products of the gradients of two nodes of t cells.

    - xx, yy: of the derivatives along x, and of those inward.
    - xy: of the derivative of the first node along x and that of the second one inward.
    """

    xx: np.ndarray
    yy: np.ndarray
    xy: np.ndarray


def _integrate_over_parallelograms(corners, element: Element) -> GradientProducts:
    """Integrate products of gradients over cells whose map from the reference element is linear.

    The integrals are combinations of those over the reference element. They take a third of the time of an integration
    at the points of each cell, which was a tenth of the time of condensing a fine mesh.

    Parameters
    ----------
    corners : (t, 4, 2) ndarray
        Corners of the cells [m].
    element : Element
        Reference element with four corners.
    """
    _, local = element.evaluate(element.gauss)
    products = np.einsum("g,gai,gbj->abij", element.weights, local, local).reshape(4, 16)
    jacobian = local[0] @ corners
    (a, b), (c, d) = np.moveaxis(jacobian, (-2, -1), (0, 1))
    determinant = a * d - b * c
    along = np.stack([d, -b])
    inward = np.stack([-c, a])

    def integrate(first, second) -> np.ndarray:
        """Integrate the products of two directions, given by rows (2, t) of the adjugate Jacobian."""
        factors = (first[:, None] * second).reshape(4, -1) / determinant
        return (factors.T @ products).reshape(-1, 4, 4)

    return GradientProducts(
        integrate(along, along), integrate(inward, inward), integrate(along, inward)
    )


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """Piece whose far face is fixed, and whose stiffness is factorised on demand.

    - ``mesh``: TensorGrid or PieceMesh
    - ``layers``: materials
    - ``guided``: displacement that is also fixed at both ends of a rectangle (0 along x, 1 inward), or None
    - ``computed``: "factor" and "round_off_error" once they are computed
    """

    mesh: "pieces.Mesh"
    layers: Layers
    guided: int | None = None
    computed: dict[str, Fronts | float] = field(default_factory=dict)

    @property
    def factor(self) -> Fronts:
        """Factors of the stiffness after condensation to the interface.

        Raises
        ------
        NotConverged
            If the stiffness is singular to working precision; the message says what to change.
        """
        if "factor" not in self.computed:
            self.computed["factor"] = self._condense(keep_fronts=True)
        return self.computed["factor"]

    def compute_compliance(self) -> np.ndarray:
        """Return the compliance (2 m, 2 m) [m2/N] of the interface without keeping the factors of the piece.

        The order of its rows is that of `Fronts.compliance`.
        """
        if "factor" in self.computed:
            return self.factor.compliance
        condensed = self._condense(keep_fronts=False)
        # Only the factors show the round-off error, and a piece with one needs them.
        if condensed.smallest_pivot <= MIN_SAFE_PIVOT:
            return self.factor.compliance
        return condensed.compliance

    def _condense(self, *, keep_fronts: bool) -> Fronts:
        """Condense the piece to its interface; with fronts, also estimate its round-off error."""
        mesh = self.mesh
        is_fixed = np.zeros((mesh.n_nodes, 2), bool)
        is_fixed[mesh.far] = True
        if self.guided is not None:
            x = mesh.points[:, 0]
            is_fixed[(x == x.min()) | (x == x.max()), self.guided] = True
        try:
            condensed = condense_to_interface(
                self._compute_cells(),
                mesh.cell_positions,
                mesh.interface,
                is_fixed,
                keep_fronts=keep_fronts,
            )
            if keep_fronts:
                self.computed["round_off_error"] = condensed.estimate_round_off()
        except NotConverged as error:
            raise NotConverged(f"{error}; {self._describe_remedy()}") from None
        return condensed

    @property
    def round_off_error(self) -> float:
        """Relative round-off error of the compliance [1], which is 0 before the piece is factorised."""
        return self.computed.get("round_off_error", 0.0)

    def _compute_cells(self) -> StiffCells:
        """Return the stiffness matrices of all cells."""
        mesh = self.mesh
        lam, mu = self.layers.lame_constants(mesh.is_coating)
        n_corners = max(cells.shape[1] for cells in mesh.blocks.values())
        nodes = np.full((lam.size, n_corners), mesh.n_nodes)
        matrices = np.zeros((lam.size, 2 * n_corners, 2 * n_corners))
        for kind, cells, numbers in number_cells(mesh.blocks):
            size = cells.shape[1]
            nodes[numbers, :size] = cells
            for begin in range(0, len(cells), MAX_INTEGRATED_CELLS):
                part = slice(begin, begin + MAX_INTEGRATED_CELLS)
                rows = numbers[part]
                matrices[rows, : 2 * size, : 2 * size] = compute_stiffness(
                    mesh.points, cells[part], ELEMENTS[kind], lam[rows], mu[rows]
                )
        return StiffCells(nodes, matrices)

    def solve(self, load) -> np.ndarray:
        """Return displacements (frames, N, 2) [m] under interface loads (m, 2, frames) [N/m]."""
        mesh = self.mesh
        full_load = np.zeros((mesh.n_nodes, *load.shape[1:]))
        full_load[mesh.interface] = np.einsum("ij,i...->j...", compute_spread_matrix(mesh), load)
        u = self.factor.solve(full_load)
        if self.round_off_error:
            u += self.factor.solve(full_load - self.factor.compute_forces(u))
        return np.moveaxis(u, 2, 0)

    def _describe_remedy(self) -> str:
        """Return a sentence that says what to change if the stiffness is singular."""
        mesh = self.mesh
        layers = self.layers
        ratio = layers.coating[0] / layers.substrate[0]
        if mesh.coating_thickness and not 1e-3 < ratio < 1e3:
            return (
                f"the Young's moduli of coating and substrate differ by a factor of {max(ratio, 1 / ratio):.2g}: bring "
                "the moduli closer together, make the coating thicker, or leave the coating out"
            )
        shortest = min(mesh.tributary_lengths().min(), mesh.first_row_height)
        return (
            f"the shortest cell is {format_length(shortest, 3)} in a piece of {format_length(mesh.length, 3)} x "
            f"{format_length(mesh.height, 3)}, so that round-off spoils the stiffness: use longer cells "
            "(contact.element_size, or the cells of contact.mesh)"
        )


def compute_spread_matrix(mesh) -> np.ndarray:
    """Return the matrix T that converts forces f at m pressure nodes into forces T^T f on the n interface nodes.

    f_i is the pressure at a node times the tributary length of the node. On elements of first order T = 1. On elements
    of second order T_ij = int psi_i N_j / tributary length with the shape functions N and the dual functions psi of the
    hat functions between corners (`mortar`), for which T = 1 on elements of first order, too. A pressure for each node,
    or one that is linear between corners, would ripple beside free ends.

    Parameters
    ----------
    mesh : TensorGrid or PieceMesh
        Mesh with m pressure nodes and n interface nodes.

    Returns
    -------
    (m, n) ndarray
        [1]
    """
    m = mesh.x.size
    if mesh.interface.size == m:
        return np.eye(m)
    out = np.zeros((m, mesh.interface.size))
    # int psi_i N_j over an edge of length 1 with its nodes at 0, 1/2 and 1
    integrals = np.array([[1 / 3, 1 / 3, -1 / 6], [-1 / 6, 1 / 3, 1 / 3]])
    for edge, length in enumerate(np.diff(mesh.x)):
        out[edge : edge + 2, 2 * edge : 2 * edge + 3] += integrals * length
    return out / mesh.tributary_lengths()[:, None]


def compute_displacement(piece: Piece, shear: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Compute the displacements of a piece under forces on its interface.

    Parameters
    ----------
    piece : Piece
        Piece with N nodes, of which m carry pressure.
    shear, normal : (frames, m) or (m,) ndarray
        Forces per unit width along x and inward [N/m].

    Returns
    -------
    (frames, N, 2) ndarray [m]
        Along x and inward.
    """
    load = np.stack([np.atleast_2d(shear).T, np.atleast_2d(normal).T], axis=1)
    return piece.solve(load.astype(float))


def compute_stress(strain, is_coating, layers: Layers) -> np.ndarray:
    """Compute the stresses for given plane strains by Hooke's law.

    Parameters
    ----------
    strain : (3, ...) array_like
        exx, eyy, exy [1].
    is_coating : (...) ndarray of bool
        Whether a strain is one of the coating.
    layers : Layers
        Materials of coating and substrate.

    Returns
    -------
    (..., 4) ndarray [Pa]
        Stresses xx, yy, zz, xy; zz = 0 in plane stress.
    """
    exx, eyy, exy = strain
    lam, mu = layers.lame_constants(is_coating)
    sxx = lam * (exx + eyy) + 2 * mu * exx
    syy = lam * (exx + eyy) + 2 * mu * eyy
    szz = np.zeros_like(sxx)
    if layers.plane == "strain":
        poisson = np.where(is_coating, layers.coating[1], layers.substrate[1])
        szz = poisson * (sxx + syy)
    return np.stack([sxx, syy, szz, 2 * mu * exy], axis=-1)


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Return the von Mises stress (...) [Pa] of stresses (..., 4) [Pa] given as xx, yy, zz, xy."""
    xx, yy, zz, xy = np.moveaxis(stress, -1, 0)
    return np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * xy**2)


class InterfaceCompliance(NamedTuple):
    """Compliances of interface nodes per unit width, each (m, m) and read-only [m2/N].

    - ``nn``: inward displacement per inward force
    - ``tt``: displacement along x per force along x
    - ``nt``: inward displacement per force along x
    """

    nn: np.ndarray
    tt: np.ndarray
    nt: np.ndarray


def compute_interface_compliance(piece: Piece, *, keep_factor: bool = True) -> InterfaceCompliance:
    """Compute the compliances of a piece at its interface, per unit width.

    `keep_factor` tells whether the piece keeps its factors, with which the displacements inside it are computed.
    """
    both = piece.factor.compliance if keep_factor else piece.compute_compliance()
    along = slice(0, None, 2)
    inward = slice(1, None, 2)
    blocks = (both[inward, inward], both[along, along], both[inward, along])
    spread = compute_spread_matrix(piece.mesh)
    if spread.shape[0] < spread.shape[1]:
        blocks = [spread @ block @ spread.T for block in blocks]
    return InterfaceCompliance(*(frozen_array(block) for block in blocks))
