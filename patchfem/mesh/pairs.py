"""Two pieces as one list of points and tagged cells, as stored in a mesh file."""

from typing import NamedTuple

import numpy as np

from .anymesh import PieceMesh, cell_edges, freeze_piece
from .tensor import TensorGrid


class CellBlock(NamedTuple):
    """Cells of one kind ("triangle", "quad", "line") as node numbers, and the tag of each."""

    kind: str
    cells: np.ndarray
    names: np.ndarray


def convert_to_piece_mesh(body) -> PieceMesh:
    """Convert a body to a PieceMesh; the cells of a TensorGrid become quads.

    The node in a column and a row has the number column * ny + row.
    """
    if not isinstance(body, TensorGrid):
        return body
    nx = body.x.size
    ny = body.depth.size
    node = np.arange(nx * ny).reshape(nx, ny)
    corners = (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:])
    quads = np.stack([corner.ravel() for corner in corners], axis=1)
    points = np.stack([np.repeat(body.x, ny), np.tile(body.depth, nx)], axis=1)
    triangles = np.empty((0, 3), np.int64)
    is_coating = body.is_coating_cell().ravel()
    piece = PieceMesh(points, triangles, quads, is_coating, node[:, 0], node[:, -1])
    return freeze_piece(piece)


def join_meshes(lower, upper) -> tuple[np.ndarray, list[CellBlock]]:
    """Join the meshes of a pair, the lower piece at y <= 0 and first.

    Parameters
    ----------
    lower, upper : TensorGrid or PieceMesh

    Returns
    -------
    points : (N, 2) ndarray [m]
    blocks : list of CellBlock
        One per kind; triangles and quads are counterclockwise.
    """
    points = []
    pieces = {"triangle": [], "quad": [], "line": []}
    n_points = 0
    for side, sign, body in (
        ("lower", -1.0, convert_to_piece_mesh(lower)),
        ("upper", 1.0, convert_to_piece_mesh(upper)),
    ):
        names = np.where(body.is_coating, f"{side}_coating", f"{side}_substrate")
        n_triangles = len(body.triangles)
        # Mirroring at y = 0 makes a cell clockwise, so the order of its corners is reversed.
        corner_order = slice(None, None, -1) if sign < 0 else slice(None)
        pieces["triangle"].append((body.triangles[:, corner_order] + n_points, names[:n_triangles]))
        pieces["quad"].append((body.quads[:, corner_order] + n_points, names[n_triangles:]))
        interface = np.stack([body.interface[:-1], body.interface[1:]], axis=1)
        for tag, edges in (("interface", interface), ("far", _far_edges(body))):
            pieces["line"].append((edges + n_points, np.full(len(edges), f"{side}_{tag}")))
        points.append(body.points * [1.0, sign])
        n_points += len(body.points)
    blocks = []
    for kind, cells_of_pieces in pieces.items():
        cells, names = (np.concatenate(arrays) for arrays in zip(*cells_of_pieces))
        if len(cells):
            blocks.append(CellBlock(kind, cells, names))
    return np.concatenate(points), blocks


def _far_edges(body: PieceMesh) -> np.ndarray:
    """Return the edges between nodes on the far face; an isolated node is connected to itself."""
    edges = np.unique(np.sort(cell_edges(body)[0], axis=1), axis=0)
    edges = edges[np.isin(edges, body.far).all(axis=1)]
    isolated_nodes = np.setdiff1d(body.far, edges)
    return np.concatenate([edges, np.stack([isolated_nodes, isolated_nodes], axis=1)])
