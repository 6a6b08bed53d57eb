"""The tagged mesh of a pair: geometry, round trips through files, and refusals of unusable files."""

from __future__ import annotations

import time

import meshio
import numpy as np
import pytest
from any_mesh_cases import make_pair, write_msh22
from pair_meshes import make_pair_mesh

from patchfem.core import Missing, PatchfemError
from patchfem.mesh import PieceMesh, TensorGrid, graded_grid, read_bodies, write_mesh
from patchfem.mesh.files import CELL_TAGS, EDGE_TAGS

GRIDS = {
    "coated": graded_grid(12.7e-3, 6.35e-3, 0.4e-3, 152.4e-6),
    "plain": graded_grid(5e-3, 2e-3, 0.5e-3),
    "uneven columns": TensorGrid(
        np.array([-2e-3, -0.5e-3, 0.1e-3, 2e-3]), np.array([0, 1e-4, 3e-4, 1e-3]), 1
    ),
}
SMALL = graded_grid(2e-3, 1e-3, 5e-4, 1e-4)

each_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS.keys())


def store_pair(path, pair):
    """Write points, quads and tags without checks, so that an invalid pair can be made."""
    points = np.column_stack([pair["points"], np.zeros(len(pair["points"]))])
    mesh = meshio.Mesh(points, [("quad", pair["quads"]), ("line", pair["edges"])])
    tags = [np.asarray(pair[name], np.int32) for name in ("tags", "edge_tags")]
    mesh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    mesh.field_data = {k: np.array([v, 2]) for k, v in CELL_TAGS.items()}
    mesh.field_data |= {k: np.array([v, 1]) for k, v in EDGE_TAGS.items()}
    meshio.write(path, mesh, file_format="gmsh22", binary=True)
    return path


def read_grid(path):
    """Return the grid of a file whose pieces are equal tensor grids."""
    low, high = read_bodies(path)
    assert isinstance(low, TensorGrid) and high is None
    return low


@each_grid
def test_exact_grid_round_trip_through_msh(grid, tmp_path):
    """A grid is written to an .msh file and read back with its nodes and coating."""
    write_mesh(grid, tmp_path / "pair.msh")
    read_back = read_grid(tmp_path / "pair.msh")
    assert read_back.coating_rows == grid.coating_rows
    assert np.abs(read_back.x - grid.x).max() <= 1e-12 * grid.length
    assert np.abs(read_back.depth - grid.depth).max() <= 1e-12 * grid.height


def test_refuses_missing_mesh_file_and_unknown_suffix(tmp_path):
    """A missing mesh file, an unknown suffix and a missing folder are refused."""
    with pytest.raises(PatchfemError, match="no such mesh file"):
        read_grid(tmp_path / "nowhere.msh")
    (tmp_path / "pair.stl").write_text("solid")
    with pytest.raises(PatchfemError, match=r"from \.msh, \.vtu, \.inp or \.med"):
        read_bodies(tmp_path / "pair.stl")
    with pytest.raises(PatchfemError, match=r"\.msh or \.vtu"):
        write_mesh(SMALL, tmp_path / "pair.stl")
    with pytest.raises(Missing, match="cannot be written"):
        write_mesh(SMALL, tmp_path / "nowhere" / "pair.msh")


def test_refuses_impossible_node_count_quickly(tmp_path, capsys):
    """A node count larger than the file is refused within 1 s, and reading prints nothing to stdout."""
    path = tmp_path / "pair.msh"
    write_mesh(SMALL, path)
    read_grid(path)
    assert capsys.readouterr().out == ""
    content = path.read_bytes()
    offset = content.index(b"$Nodes") + 7
    path.write_bytes(content[:offset] + b"100000000" + content[content.index(b"\n", offset) :])
    start_time = time.process_time()
    with pytest.raises(PatchfemError, match="announces 100000000"):
        read_grid(path)
    assert time.process_time() - start_time < 1.0


def test_always_irregular_coating_is_read_as_mesh(tmp_path):
    """A coating that is not a uniform layer is read as a general mesh and not as a tensor grid."""
    pair = make_pair_mesh(SMALL)
    tags = pair["tags"].copy()
    tags[np.flatnonzero(tags == CELL_TAGS["upper_coating"])[2]] = CELL_TAGS["upper_substrate"]
    low, high = read_bodies(store_pair(tmp_path / "pair.msh", {**pair, "tags": tags}))
    assert isinstance(low, PieceMesh) and isinstance(high, PieceMesh)


@pytest.mark.parametrize(
    "upper_grid",
    [graded_grid(2e-3, 1.2e-3, 5e-4, 1e-4), graded_grid(2e-3, 1e-3, 5e-4)],
    ids=["taller", "uncoated"],
)
def test_exact_different_pieces_on_same_columns_are_two_grids(upper_grid, tmp_path):
    """Pieces of different height or coating on the same columns are read as two grids."""
    write_mesh(SMALL, tmp_path / "pair.msh", upper_grid)
    low, high = read_bodies(tmp_path / "pair.msh")
    for read_piece, grid in ((low, SMALL), (high, upper_grid)):
        assert read_piece.coating_rows == grid.coating_rows and read_piece.depth == pytest.approx(
            grid.depth, rel=1e-12
        )
        assert read_piece.x == pytest.approx(SMALL.x, rel=1e-12)


def test_exact_different_coating_thicknesses_are_two_grids(tmp_path):
    """Coatings of different thickness on the same grid are read as two grids."""
    pair = make_pair_mesh(SMALL)
    deepest = np.abs(pair["points"][pair["quads"], 1]).max(axis=1) > SMALL.depth[
        SMALL.coating_rows - 1
    ] * (1 + 1e-9)
    tags = pair["tags"].copy()
    tags[deepest & (tags == CELL_TAGS["upper_coating"])] = CELL_TAGS["upper_substrate"]
    low, high = read_bodies(store_pair(tmp_path / "pair.msh", {**pair, "tags": tags}))
    assert (low.coating_rows, high.coating_rows) == (SMALL.coating_rows, SMALL.coating_rows - 1)


@pytest.mark.parametrize("node_number", ["0", "-1"])
def test_refuses_node_number_below_one(node_number, tmp_path):
    """An element or edge with a node number below 1 is refused with its number.

    Negative indices of Python would take node 0 as the last node, which is in the upper piece.
    """
    path = tmp_path / "pair.msh"
    mesh = make_pair("quads")
    write_msh22(mesh, path, binary=False)
    assert read_grid(path)
    lines = path.read_text().split("\n")
    first = lines.index("$Elements") + 2
    for line_number in (
        first,
        first + len(mesh.quads) + len(mesh.edges) - 1,
    ):  # the first quad and the last edge
        words = lines[line_number].split()
        path.write_text(
            "\n".join(
                [
                    *lines[:line_number],
                    " ".join([*words[:-1], node_number]),
                    *lines[line_number + 1 :],
                ]
            )
        )
        with pytest.raises(
            PatchfemError,
            match=rf"pair.msh: cell {words[0]} names node {node_number}; nodes count from 1",
        ):
            read_bodies(path)
