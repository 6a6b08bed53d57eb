"""The tensor grid behind a piece of any mesh, how much of its far face is held, and the holes inside it."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..core import frozen_array
from .anymesh import PairMesh, PieceMesh, cell_edges
from .grading import CLOSE
from .tensor import TensorGrid

LEVEL = 1e-7  # of a piece: coordinates of one grid line differ by less, those of two lines by more
# two edges of the border that turn by more are of different faces
CORNER = np.cos(np.radians(30.0))


def grids(pair: PairMesh) -> tuple | None:
    """Both pieces of a pair as tensor grids (lower, upper or None where it is alike).

    None where one of them is no tensor grid, or where their columns differ by more than 1e-9 of the length. `pair` has
    passed every check of `anymesh.pieces`.
    """
    low, high = tensor_grid(pair.lower), tensor_grid(pair.upper)
    if low is None or high is None or not pair.matching:
        return None
    alike = (
        low.depth.size == high.depth.size
        and low.coating_rows == high.coating_rows
        and np.abs(low.depth - high.depth).max() <= CLOSE * low.length
    )
    return low, None if alike else TensorGrid(low.x, high.depth, high.coating_rows)


def tensor_grid(mesh: PieceMesh) -> TensorGrid | None:
    """The tensor grid that a checked piece is, None where it is none.

    Its cells are the quads between columns and rows of nodes, its interface is the first row, its coating whole rows
    below it; its far face is the last row and held at every node.
    """
    span = np.ptp(mesh.points, axis=0).max()
    x, depth = (_levels(mesh.points[:, axis], span) for axis in (0, 1))
    columns, rows = x.size - 1, depth.size - 1
    if (
        len(mesh.triangles)
        or len(mesh.quads) != columns * rows
        or len(mesh.points) != x.size * depth.size
    ):
        return None
    corner = mesh.points[mesh.quads]
    low, high = corner.min(axis=1), corner.max(axis=1)
    column = np.minimum(np.searchsorted(x, low[:, 0] - CLOSE * span), columns - 1)
    row = np.minimum(np.searchsorted(depth, low[:, 1] - CLOSE * span), rows - 1)
    even = all(
        np.abs(found - line).max() <= CLOSE * span
        for found, line in (
            (low[:, 0], x[column]),
            (low[:, 1], depth[row]),
            (high[:, 0], x[column + 1]),
            (high[:, 1], depth[row + 1]),
        )
    )
    if not even or np.unique(column * rows + row).size < column.size or mesh.rise.any():
        return None
    count = int(row[mesh.is_coating].max(initial=-1)) + 1
    last = np.flatnonzero(mesh.points[:, 1] > depth[-1] - CLOSE * span)
    if not np.array_equal(mesh.is_coating, row < count) or not np.array_equal(
        np.unique(mesh.far), last
    ):
        return None
    return TensorGrid(frozen_array(x), frozen_array(np.append(0.0, depth[1:])), count)


def _levels(values, span: float) -> np.ndarray:
    ordered = np.sort(values)
    return ordered[np.concatenate([[True], np.diff(ordered) > LEVEL * span])]


def held_share(mesh: PieceMesh) -> tuple:
    """Length [m] of the far face that is held, and the length [m] of the whole of it.

    The whole is every face of the border, from corner to corner, on which an edge is held, and the deepest face. An
    edge is held where both of its ends are.
    """
    border = _border(mesh)
    border = border[~np.isin(border, mesh.interface).all(axis=1)]
    span = mesh.points[border[:, 1]] - mesh.points[border[:, 0]]
    length = np.hypot(*span.T)
    face = _faces(mesh, border, span / length[:, None])
    held = np.isin(border, mesh.far).all(axis=1)
    depth = mesh.points[border, 1].min(axis=1)
    deepest = depth >= depth.max() * (1 - CLOSE)
    whole = np.isin(face, np.unique(face[held | deepest]))
    return float(length[held].sum()), float(length[whole].sum())


def holes(mesh: PieceMesh) -> tuple:
    """Number of the holes inside a piece and the area [m2] of them all; a notch of its outline is none.

    The area is the shoelace of each stretch of border, which runs clockwise round a hole. Holes that touch at a node
    count as one, and one that touches the outline there as a notch.
    """
    border, count = _border(mesh), len(mesh.points)
    links = coo_matrix((np.ones(len(border)), border.T), shape=(count, count))
    (ax, ay), (bx, by) = mesh.points[border[:, 0]].T, mesh.points[border[:, 1]].T
    loop = connected_components(links, False)[1][border[:, 0]]
    area = np.bincount(loop, (ax * by - bx * ay) / 2)
    return int((area < 0).sum()), float(-area[area < 0].sum())


def _border(mesh: PieceMesh) -> np.ndarray:
    """Edges (b, 2) that belong to one cell alone, counter-clockwise round it."""
    ends, _ = cell_edges(mesh)
    _, first, times = np.unique(
        np.sort(ends, axis=1), axis=0, return_index=True, return_counts=True
    )
    return ends[np.sort(first[times == 1])]


def _faces(mesh: PieceMesh, border, along) -> np.ndarray:
    """Number (b,) of the face of each border edge (b, 2) of direction along (b, 2): no corner and no end of the
    interface lies inside a face."""
    # counter-clockwise every edge ends where another begins
    begins = np.argsort(border[:, 0], kind="stable")
    place = np.searchsorted(border[begins, 0], border[:, 1])
    place = np.minimum(place, len(border) - 1)
    following = begins[place]
    smooth = (border[following, 0] == border[:, 1]) & (
        (along * along[following]).sum(axis=1) > CORNER
    )
    smooth &= ~np.isin(border[:, 1], mesh.interface)
    one = np.flatnonzero(smooth)
    links = coo_matrix((np.ones(one.size), (one, following[one])), shape=(len(border), len(border)))
    return connected_components(links, False)[1]
