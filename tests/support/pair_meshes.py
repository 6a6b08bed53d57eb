"""Meshes of pairs of equal structured grids with tags, as a mesh file stores them."""

import numpy as np

from patchfem.mesh import TensorGrid
from patchfem.mesh.files import CELL_TAGS, EDGE_TAGS, join_meshes


def make_pair_mesh(grid: TensorGrid) -> dict:
    """Return the mesh of a pair of equal grids: points (2N, 2) [m], quads (t, 4), edges, and their tags.

    Node j*ny + i of a piece is column j, row i; the upper piece follows the lower one.
    """
    points, ((_, quads, names), (_, edges, ends)) = join_meshes(grid, grid)
    tags = CELL_TAGS | EDGE_TAGS
    return {
        "points": points,
        "quads": quads,
        "tags": np.array([tags[name] for name in names], np.int32),
        "edges": edges,
        "edge_tags": np.array([tags[name] for name in ends], np.int32),
    }
