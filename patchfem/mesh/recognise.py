"""Shape of an unstructured piece: tensor grid or not, clamped length and holes."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..core import frozen_array
from .anymesh import PairMesh, PieceMesh, cell_edges
from .grading import LENGTH_TOL
from .tensor import TensorGrid

# Largest difference of coordinates on the same grid line, as a fraction of the size of the piece
GRID_LINE_TOL = 1e-7
# Smallest cosine of the angle (30 degrees) between successive boundary edges of the same face
MIN_FACE_COSINE = np.cos(np.radians(30.0))


def recognise_grids(pair: PairMesh) -> tuple[TensorGrid, TensorGrid | None] | None:
    """Return a checked pair as tensor grids if both pieces are tensor grids with equal columns.

    Parameters
    ----------
    pair : PairMesh
        As `anymesh.build_pair` returns it.

    Returns
    -------
    lower, upper : TensorGrid
        The upper grid is None if it equals the lower one. A single None if there are no grids.
    """
    lower = recognise_grid(pair.lower)
    upper = recognise_grid(pair.upper)
    if lower is None or upper is None or not pair.has_matching_nodes:
        return None
    if lower.depth.size == upper.depth.size and lower.coating_rows == upper.coating_rows:
        if np.abs(lower.depth - upper.depth).max() <= LENGTH_TOL * lower.length:
            return lower, None
    return lower, TensorGrid(lower.x, upper.depth, upper.coating_rows)


def recognise_grid(mesh: PieceMesh) -> TensorGrid | None:
    """Return a checked piece as a tensor grid, or None if it is not one.

    The cells are then the quads between columns and rows of nodes, the interface is the first row,
    the coating consists of whole rows below it, and the far face is the last row, fixed at every
    node.
    """
    span = np.ptp(mesh.points, axis=0).max()
    x = _grid_lines(mesh.points[:, 0], span)
    depth = _grid_lines(mesh.points[:, 1], span)
    columns = x.size - 1
    rows = depth.size - 1
    has_sizes = len(mesh.quads) == columns * rows and len(mesh.points) == x.size * depth.size
    if len(mesh.triangles) or not has_sizes or mesh.interface_depths.any():
        return None
    tolerance = LENGTH_TOL * span
    corners = mesh.points[mesh.quads]
    low = corners.min(axis=1)
    high = corners.max(axis=1)
    column = np.minimum(np.searchsorted(x, low[:, 0] - tolerance), columns - 1)
    row = np.minimum(np.searchsorted(depth, low[:, 1] - tolerance), rows - 1)
    low_lines = np.stack([x[column], depth[row]], axis=1)
    high_lines = np.stack([x[column + 1], depth[row + 1]], axis=1)
    deviation = max(np.abs(low - low_lines).max(), np.abs(high - high_lines).max())
    if deviation > tolerance or np.unique(column * rows + row).size < column.size:
        return None
    coating_rows = int(row[mesh.is_coating].max(initial=-1)) + 1
    last_row = np.flatnonzero(mesh.points[:, 1] > depth[-1] - tolerance)
    if not np.array_equal(mesh.is_coating, row < coating_rows):
        return None
    if not np.array_equal(np.unique(mesh.far), last_row):
        return None
    return TensorGrid(frozen_array(x), frozen_array(np.append(0.0, depth[1:])), coating_rows)


def _grid_lines(values, span: float) -> np.ndarray:
    """Return the distinct values among coordinates, in ascending order."""
    values = np.sort(values)
    return values[np.append(True, np.diff(values) > GRID_LINE_TOL * span)]


def measure_clamped_length(mesh: PieceMesh) -> tuple[float, float]:
    """Measure the clamped length and the whole length of the far face.

    The whole face consists of every face of the border, from corner to corner, on which an edge is
    fixed, and of the deepest face. An edge is fixed if both of its ends are.

    Returns
    -------
    fixed, whole : float
        Length of the fixed part and of the whole face [m].
    """
    border = _border_edges(mesh)
    border = border[~np.isin(border, mesh.interface).all(axis=1)]
    edges = mesh.points[border[:, 1]] - mesh.points[border[:, 0]]
    length = np.hypot(*edges.T)
    face = _number_faces(mesh, border, edges / length[:, None])
    is_fixed = np.isin(border, mesh.far).all(axis=1)
    depth = mesh.points[border, 1].min(axis=1)
    is_deepest = depth >= depth.max() * (1 - LENGTH_TOL)
    is_far = np.isin(face, np.unique(face[is_fixed | is_deepest]))
    return float(length[is_fixed].sum()), float(length[is_far].sum())


def find_holes(mesh: PieceMesh) -> tuple[int, float]:
    """Count the holes inside a piece and measure their area; a notch in the outline is not a hole.

    A loop of the border that is clockwise surrounds a hole; its area follows from the shoelace
    formula. Holes that touch at a node count as one. A hole that touches the outline is a notch.

    Returns
    -------
    count : int
    area : float
        Of all holes [m2].
    """
    border = _border_edges(mesh)
    n_points = len(mesh.points)
    links = coo_matrix((np.ones(len(border)), border.T), shape=(n_points, n_points))
    loop = connected_components(links, False)[1][border[:, 0]]
    ax, ay = mesh.points[border[:, 0]].T
    bx, by = mesh.points[border[:, 1]].T
    area = np.bincount(loop, (ax * by - bx * ay) / 2)
    is_hole = area < 0
    return int(is_hole.sum()), float(-area[is_hole].sum())


def _border_edges(mesh: PieceMesh) -> np.ndarray:
    """Return the edges (b, 2) that belong to a single cell, counterclockwise around this cell."""
    edges, _ = cell_edges(mesh)
    _, first, counts = np.unique(
        np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
    )
    return edges[np.sort(first[counts == 1])]


def _number_faces(mesh: PieceMesh, border, directions) -> np.ndarray:
    """Return the number (b,) of the face to which each boundary edge (b, 2) belongs.

    A face ends at corners and at the ends of the interface. directions: (b, 2) unit vectors.
    """
    # The boundary is counterclockwise, so every edge ends where another one begins.
    by_begin = np.argsort(border[:, 0], kind="stable")
    position = np.searchsorted(border[by_begin, 0], border[:, 1])
    following = by_begin[np.minimum(position, len(border) - 1)]
    is_continued = border[following, 0] == border[:, 1]
    is_continued &= (directions * directions[following]).sum(axis=1) > MIN_FACE_COSINE
    is_continued &= ~np.isin(border[:, 1], mesh.interface)
    edge = np.flatnonzero(is_continued)
    shape = (len(border), len(border))
    links = coo_matrix((np.ones(edge.size), (edge, following[edge])), shape=shape)
    return connected_components(links, False)[1]
