"""Traction between a coating and its substrate, from nodal forces along their common line."""

from dataclasses import dataclass

import numpy as np

from ..mesh.grading import LENGTH_TOL
from .elasticity import hooke
from .recovery import Cells, make_points


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
    u : (frames, N, 2) ndarray
        Displacements [m].

    Returns
    -------
    CoatingTraction or None
        None without a coating.
    """
    edges = _find_bonded_edges(cells)
    if not len(edges):
        return None
    nodes = np.unique(edges)
    nodes = nodes[np.lexsort((cells.points[nodes, 1], cells.points[nodes, 0]))]
    position = np.empty(len(cells.points), np.int64)
    position[nodes] = np.arange(nodes.size)
    along_x, inward = (cells.points[edges[:, 1]] - cells.points[edges[:, 0]]).T
    # Each normal points into the substrate and has the length of its edge.
    edge_normals = np.stack([inward, -along_x], axis=1)
    edge_lengths = np.hypot(*edge_normals.T)
    across = np.zeros((nodes.size, 2))
    length = np.zeros(nodes.size)
    for ends in position[edges].T:
        np.add.at(across, ends, edge_normals)
        np.add.at(length, ends, edge_lengths / 2)
    across /= np.hypot(*across.T)[:, None]
    along = across[:, ::-1] * [1.0, -1.0]
    coating = _select_coating(cells, nodes)
    gauss_points = make_points(coating, "gauss")
    force = np.stack([-_nodal_forces(coating, gauss_points, motion)[nodes] for motion in u])
    shear = (force * along).sum(axis=2) / length
    normal = (force * across).sum(axis=2) / length
    return CoatingTraction(nodes, length, force, shear, normal)


def _find_bonded_edges(cells: Cells) -> np.ndarray:
    """Return the edges (e, 2) that are shared by a coating cell and a substrate cell."""
    edges = np.concatenate(
        [
            np.stack([block, np.roll(block, -1, axis=1)], axis=2).reshape(-1, 2)
            for block in cells.blocks
        ]
    )
    is_coating = cells.is_coating[cells.cell_of_corner()]
    in_coating = np.zeros(len(cells.points), bool)
    in_coating[edges[is_coating]] = True
    in_substrate = np.zeros(len(cells.points), bool)
    in_substrate[edges[~is_coating]] = True
    may_be_shared = (in_coating & in_substrate)[edges].all(axis=1)
    edges = edges[may_be_shared]
    is_coating = is_coating[may_be_shared]
    key = edges.min(axis=1) * len(cells.points) + edges.max(axis=1)
    return edges[is_coating & np.isin(key, key[~is_coating])]


def _select_coating(cells: Cells, nodes) -> Cells:
    """Return the coating cells that touch given nodes.

    No other cell exerts a force of the coating on these nodes.
    """
    is_touched = np.zeros(len(cells.points), bool)
    is_touched[nodes] = True
    blocks = []
    first = 0
    for block in cells.blocks:
        is_coating = cells.is_coating[first : first + len(block)]
        first += len(block)
        blocks.append(block[is_coating & is_touched[block].any(axis=1)])
    is_coating = np.ones(sum(map(len, blocks)), bool)
    return Cells(cells.points, tuple(blocks), is_coating, cells.layers)


def _nodal_forces(coating: Cells, gauss_points: list, u) -> np.ndarray:
    """Return the nodal forces (N, 2) [N/m] in equilibrium with the stress of coating cells."""
    out = np.zeros((len(coating.points), 2))
    for points in gauss_points:
        is_coating = np.ones(points.weight.shape[1], bool)
        xx, yy, _, xy = np.moveaxis(hooke(points.strain(u), is_coating, coating.layers), -1, 0)
        tensor = np.array([[xx, xy], [xy, yy]]) * points.weight
        # The second axis of the stress tensor is along the local coordinates.
        local = np.einsum("ijgc,jkgc->gkic", tensor, points.inverse_jacobian)
        force = np.tensordot(points.element.gradient, local, axes=([0, 1], [0, 1]))
        np.add.at(out, points.corners, force.swapaxes(1, 2))
    return out


def interpolate_coating_traction(cells: Cells, traction: CoatingTraction | None, x) -> dict:
    """Interpolate the tractions below a coating at positions along the interface.

    Parameters
    ----------
    cells : Cells
    traction : CoatingTraction or None
    x : (m,) ndarray [m]

    Returns
    -------
    dict
        "normal_bond" and "shear_bond" (frames, m) [Pa], NaN beyond the ends of the coating; empty
        without a coating.
    """
    if traction is None:
        return {}
    line_x = cells.points[traction.node, 0]
    tolerance = LENGTH_TOL * np.ptp(line_x)
    is_outside = (x < line_x[0] - tolerance) | (x > line_x[-1] + tolerance)
    out = {}
    for name, values in (("normal_bond", traction.normal), ("shear_bond", traction.shear)):
        rows = np.stack([np.interp(x, line_x, row) for row in values])
        out[name] = np.where(is_outside, np.nan, rows)
    return out
