"""Meshes of second order: the same mesh in every format, refinement, and decks whose edges are named by surfaces."""

from __future__ import annotations

from types import SimpleNamespace

import meshio
import numpy as np
import pytest
from any_mesh_cases import GRID, NAMES, make_pair, write_msh22, write_vtu
from scipy.spatial import cKDTree

from patchfem.core import PatchfemError
from patchfem.elasticity import Piece, compute_interface_compliance
from patchfem.elasticity.elasticity import Layers
from patchfem.mesh import read_pieces

LAYERS = Layers((250e9, 0.24), (121e9, 0.32), "strain")
ABAQUS = {"triangle6": "CPE6", "quad8": "CPE8R"}


def make_quadratic_pair(kind):
    """Return points (N, 2), and blocks of cells and edges of second order with their tags, from the linear pair of grids."""
    pair = make_pair("triangles" if kind == "triangle6" else "quads")
    corners, tags = (
        (pair.triangles, pair.triangle_tags)
        if kind == "triangle6"
        else (
            pair.quads,
            pair.quad_tags,
        )
    )
    points = [tuple(point) for point in pair.points]
    number = {}

    def middle(a, b):
        """Return the number of the node between two others."""
        key = min(a, b), max(a, b)
        if key not in number:
            number[key] = len(points)
            points.append(tuple((pair.points[a] + pair.points[b]) / 2))
        return number[key]

    cells = [
        [*cell, *(middle(a, b) for a, b in zip(cell, np.roll(cell, -1)))]
        for cell in corners.tolist()
    ]
    edges = [[a, b, middle(a, b)] for a, b in pair.edges.tolist()]
    blocks = [(kind, np.array(cells), tags), ("line3", np.array(edges), pair.edge_tags)]
    return SimpleNamespace(points=np.array(points), blocks=blocks)


def write_pair(folder, kind, ending, surfaces=False):
    """Write the pair to a file and return its path."""
    mesh = make_quadratic_pair(kind)
    path = folder / f"pair{ending}"
    if ending == ".inp":
        (_, cells, tags), (_, edges, edge_tags) = mesh.blocks
        points = mesh.points.tolist()
        lines = ["*NODE", *(f"{k + 1}, {x!r}, {y!r}" for k, (x, y) in enumerate(points))]
        lines.append(f"*ELEMENT, TYPE={ABAQUS[kind]}")
        lines += [", ".join(map(str, [k + 1, *(cell + 1)])) for k, cell in enumerate(cells)]
        for tag, name in NAMES.items():
            if tag < 10:
                members = np.flatnonzero(tags == tag) + 1
                lines += [f"*ELSET, ELSET={name}", *map(str, members)]
            elif surfaces:
                lines.append(f"*SURFACE, TYPE=ELEMENT, NAME={name.upper()}")
                n = 3 if kind == "triangle6" else 4
                for edge in np.sort(edges[edge_tags == tag][:, :2], axis=1):
                    for side in range(n):
                        pair = np.sort(cells[:, [side, (side + 1) % n]], axis=1)
                        lines += [
                            f"{k + 1}, S{side + 1}" for k in np.flatnonzero((pair == edge).all(1))
                        ]
            else:
                nodes = np.unique(edges[edge_tags == tag]) + 1
                lines += [f"*NSET, NSET={name}", *map(str, nodes)]
        path.write_text("\n".join(lines) + "\n")
    else:
        write = write_vtu if ending == ".vtu" else write_msh22
        write(mesh, path)
    return path


@pytest.mark.parametrize("kind", ABAQUS)
def test_exact_same_mesh_in_every_format_gives_equal_compliance(kind, tmp_path):
    """The same mesh of second order as .msh, .vtu and .inp, with edges as sets or as surfaces, is equal to 1e-12."""
    paths = [write_pair(tmp_path, kind, ending) for ending in (".msh", ".vtu", ".inp")]
    pairs = [read_pieces(path) for path in paths]
    pairs.append(read_pieces(write_pair(tmp_path, kind, ".inp", surfaces=True)))
    first = compute_interface_compliance(Piece(pairs[0].upper, LAYERS))
    for pair in pairs:
        assert pair.lower.x.size == GRID.x.size and pair.lower.is_quadratic
        assert pair.lower.interface.size == 2 * GRID.x.size - 1
        assert pair.upper.coating_thickness == pytest.approx(GRID.coating_thickness, rel=1e-12)
        for mine, other in zip(compute_interface_compliance(Piece(pair.upper, LAYERS)), first):
            assert np.abs(mine - other).max() <= 1e-12 * np.abs(first.nn).max()


@pytest.mark.parametrize("kind", ABAQUS)
@pytest.mark.parametrize(
    "axis, shift, is_refused", [(0, 0.02, 1), (0, 0.005, 0), (1, 0.12, 1), (1, 0.09, 0)]
)
def test_refuses_nodes_beside_the_middle_of_their_edge(kind, axis, shift, is_refused, tmp_path):
    """A node is refused 2 % of its edge along the edge from the middle or 12 % across, not 0.5 % along or 9 % across."""
    path = write_pair(tmp_path, kind, ".msh")
    mesh = meshio.read(path)

    # The middle of a horizontal edge within the upper piece
    edge = next(
        cell[[0, 1, 3 if kind == "triangle6" else 4]]
        for cell in mesh.cells_dict[kind]
        if mesh.points[cell[0], 1] == mesh.points[cell[1], 1] > 0
    )
    mesh.points[edge[2], axis] += shift * abs(np.diff(mesh.points[edge[:2], 0])[0])
    meshio.write(path, mesh, file_format="gmsh22")
    if not is_refused:
        assert read_pieces(path).upper.is_quadratic
        return
    x, y = mesh.points[edge[2], :2]
    message = rf"1 nodes of the upper piece are not in the middle .* x = {x:.6g} m, {y:.6g} m .* is {shift} of .*; 1% along"
    with pytest.raises(PatchfemError, match=message):
        read_pieces(path)


@pytest.mark.parametrize("kind", [*ABAQUS, "quad9"])
def test_exact_refined_mesh_of_second_order(kind, tmp_path):
    """A refined mesh of second order has four times the cells, the same area and its nodes in the middles of edges."""
    piece = read_pieces(write_pair(tmp_path, kind.replace("9", "8"), ".msh")).upper
    if kind == "quad9":
        cells = piece.blocks["quad8"]
        points = np.concatenate([piece.points, piece.points[cells[:, :4]].mean(axis=1)])
        centres = len(piece.points) + np.arange(len(cells))
        blocks = {"quad9": np.column_stack([cells, centres])}
        piece = type(piece)(points, blocks, piece.is_coating, piece.interface, piece.far)
    fine = piece.refine()
    assert fine.areas() == pytest.approx(np.repeat(piece.areas() / 4, 4), rel=1e-9)
    assert fine.x[::2] == pytest.approx(piece.x, abs=1e-15) and fine.x.size == 2 * piece.x.size - 1
    assert fine.far.size == 2 * piece.far.size - 1
    n = 3 if kind == "triangle6" else 4
    nodes = fine.blocks[kind]
    middles = (fine.points[nodes[:, :n]] + fine.points[np.roll(nodes[:, :n], -1, axis=1)]) / 2
    assert np.abs(fine.points[nodes[:, n : 2 * n]] - middles).max() <= 1e-15
    assert not cKDTree(fine.points).query_pairs(1e-9)
