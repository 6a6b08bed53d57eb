"""Traction between a coating and its substrate, from nodal forces along their common line."""

from dataclasses import dataclass

import numpy as np

from ..mesh.elements import ELEMENTS, number_cells
from ..mesh.grading import EQUAL_LENGTH_TOL
from ..mesh.pieces import find_edges
from .elasticity import compute_stiffness
from .recovery import Cells


@dataclass(frozen=True, eq=False, slots=True)
class CoatingTraction:
    """Forces and tractions that a coating exerts on its substrate along their common line.

    - ``node``: (b,) nodes by increasing x
    - ``length``: (b,) tributary length of each node along the line [m]
    - ``force``: (frames, b, 2) nodal forces along x and inward, per unit width [N/m]
    - ``shear``, ``normal``: (frames, b) tractions along and across the line [Pa]; normal > 0 in
      compression
    """

    node: np.ndarray
    length: np.ndarray
    force: np.ndarray
    shear: np.ndarray
    normal: np.ndarray


def compute_coating_traction(cells: Cells, u) -> CoatingTraction | None:
    """Compute the forces that a coating exerts on its substrate.

    They are the nodal forces of the stress in the coating, so they balance the load on its face.

    Parameters
    ----------
    cells : Cells
        Cells of the piece.
    u : (frames, N, 2) ndarray
        Displacements [m].

    Returns
    -------
    CoatingTraction or None
        None without a coating.
    """
    # A bonded edge is shared by a coating cell, which it surrounds counterclockwise, and a substrate cell.
    edges = find_edges(cells.groups, len(cells.points))
    is_coating = cells.is_coating[edges.owner]
    n_coating = np.bincount(edges.twin, is_coating)[edges.twin]
    is_bonded = is_coating & (n_coating == 1) & ~edges.is_border
    if not is_bonded.any():
        return None

    # Fractions of the length of an edge that belong to its nodes, as for a uniform traction
    ends = edges.ends[is_bonded]
    middles = edges.middles[is_bonded]
    edge_nodes = ends
    fractions = np.array([1 / 2, 1 / 2])
    if (middles >= 0).all():
        edge_nodes = np.column_stack([ends, middles])
        fractions = np.array([1 / 6, 1 / 6, 2 / 3])

    # Each normal points into the substrate and has the length of its edge.
    along_x, inward = (cells.points[ends[:, 1]] - cells.points[ends[:, 0]]).T
    edge_normals = np.stack([inward, -along_x], axis=1)
    across = np.zeros(cells.points.shape)
    length = np.zeros(len(cells.points))
    for nodes, fraction in zip(edge_nodes.T, fractions):
        np.add.at(across, nodes, edge_normals)
        np.add.at(length, nodes, fraction * np.hypot(*edge_normals.T))

    # The nodes along the line, and the unit vectors across it and along it at each
    nodes = np.unique(edge_nodes)
    nodes = nodes[np.lexsort((cells.points[nodes, 1], cells.points[nodes, 0]))]
    length = length[nodes]
    across = across[nodes] / np.hypot(*across[nodes].T)[:, None]
    along = across[:, ::-1] * [1.0, -1.0]

    # The forces in equilibrium with the stress of the coating, divided by the length of a node
    force = -_compute_coating_forces(cells, nodes, u)[:, nodes]
    shear = (force * along).sum(axis=2) / length
    normal = (force * across).sum(axis=2) / length
    return CoatingTraction(nodes, length, force, shear, normal)


def _compute_coating_forces(cells: Cells, nodes, u) -> np.ndarray:
    """Return the nodal forces (frames, N, 2) [N/m] by which coating cells at given nodes have displacements u [m]."""
    out = np.zeros(u.shape)
    for kind, group, numbers in number_cells(cells.groups):
        # No other cell exerts a force of the coating on these nodes
        group = group[cells.is_coating[numbers] & np.isin(group, nodes).any(axis=1)]
        moduli = cells.layers.lame_constants(np.ones(len(group), bool))
        stiffness = compute_stiffness(cells.points, group, ELEMENTS[kind], *moduli)
        moved = u[:, group].reshape(*u.shape[:1], *stiffness.shape[:2], 1)
        forces = (stiffness @ moved).reshape(len(u), *group.shape, 2)
        np.add.at(out, (slice(None), group), forces)
    return out


def interpolate_coating_traction(
    cells: Cells, traction: CoatingTraction | None, x
) -> dict[str, np.ndarray]:
    """Interpolate the tractions below a coating at positions along the interface.

    Parameters
    ----------
    cells : Cells
        Cells of the piece.
    traction : CoatingTraction or None
        Tractions at the nodes of the common line, None without a coating.
    x : (m,) ndarray
        Positions along the interface [m].

    Returns
    -------
    dict
        "normal_bond" and "shear_bond" (frames, m) [Pa], NaN beyond the ends of the coating; empty
        without a coating.
    """
    if traction is None:
        return {}
    line_x = cells.points[traction.node, 0]
    tolerance = EQUAL_LENGTH_TOL * np.ptp(line_x)
    is_outside = (x < line_x[0] - tolerance) | (x > line_x[-1] + tolerance)
    out = {}
    for name, values in (("normal_bond", traction.normal), ("shear_bond", traction.shear)):
        rows = np.stack([np.interp(x, line_x, row) for row in values])
        out[name] = np.where(is_outside, np.nan, rows)
    return out
