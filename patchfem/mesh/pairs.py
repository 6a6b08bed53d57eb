"""Any two pieces as one list of points and tagged cells, the way a mesh file holds them."""

import numpy as np

from ..core import frozen_array
from .anymesh import PieceMesh, cell_edges
from .tensor import TensorGrid


def as_piece(body) -> PieceMesh:
    """A body as a piece of any mesh: a tensor grid becomes quads, any other piece stays as it is.

    Node j*ny + i stands in column j and row i.
    """
    if not isinstance(body, TensorGrid):
        return body
    nx, ny = body.x.size, body.depth.size
    node = np.arange(nx * ny).reshape(nx, ny)
    quads = np.stack(
        [part.ravel() for part in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:])],
        axis=1,
    )
    points = np.stack([np.repeat(body.x, ny), np.tile(body.depth, nx)], axis=1)
    return PieceMesh(
        frozen_array(points),
        frozen_array(np.empty((0, 3)), np.int64),
        frozen_array(quads, np.int64),
        frozen_array(body.cell_is_coating().ravel(), bool),
        frozen_array(node[:, 0], np.int64),
        frozen_array(node[:, -1], np.int64),
    )


def blocks(lower, upper) -> tuple:
    """Points (N, 2) [m] of a pair and its cells as [(kind, cells, names)]; lower piece first.

    kind: triangle, quad or line; names: one for every cell. lower, upper: TensorGrid or PieceMesh. The lower piece lies
    at y <= 0. Cells are counter-clockwise.
    """
    points, found, shift = [], {"triangle": [], "quad": [], "line": []}, 0
    for side, sign, body in (("lower", -1.0, as_piece(lower)), ("upper", 1.0, as_piece(upper))):
        names = np.where(body.is_coating, f"{side}_coating", f"{side}_substrate")
        count = len(body.triangles)
        # drawn downwards a cell turns the other way
        turn = slice(None, None, -1) if sign < 0 else slice(None)
        found["triangle"].append((body.triangles[:, turn] + shift, names[:count]))
        found["quad"].append((body.quads[:, turn] + shift, names[count:]))
        for end, edges in (
            ("interface", np.stack([body.interface[:-1], body.interface[1:]], axis=1)),
            ("far", _far_edges(body)),
        ):
            found["line"].append((edges + shift, np.full(len(edges), f"{side}_{end}")))
        points.append(body.points * [1.0, sign])
        shift += len(body.points)
    joined = [
        (kind, *(np.concatenate(part) for part in zip(*every))) for kind, every in found.items()
    ]
    return np.concatenate(points), [block for block in joined if len(block[1])]


def _far_edges(body: PieceMesh) -> np.ndarray:
    """Edges between nodes of the far face; a node that has none stands as an edge to itself."""
    ends = np.unique(np.sort(cell_edges(body)[0], axis=1), axis=0)
    ends = ends[np.isin(ends, body.far).all(axis=1)]
    alone = np.setdiff1d(body.far, ends)
    return np.concatenate([ends, np.stack([alone, alone], axis=1)])
