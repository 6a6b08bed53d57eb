"""Pairs of alike tensor grids as tagged meshes, the way a mesh file holds them."""

from patchfem.mesh.files import _codes
from patchfem.mesh.pairs import blocks
from patchfem.mesh.tensor import TensorGrid


def pair_mesh(grid: TensorGrid) -> dict:
    """Both pieces of a pair of alike grids as points (2N, 2) [m], quads (t, 4) and edges with their tags.

    Node j*ny + i of a piece is column j, row i; the upper piece follows the lower one.
    """
    points, ((_, quads, names), (_, edges, ends)) = blocks(grid, grid)
    return {
        "points": points,
        "quads": quads,
        "tags": _codes(names),
        "edges": edges,
        "edge_tags": _codes(ends),
    }
