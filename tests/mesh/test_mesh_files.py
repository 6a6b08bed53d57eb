"""The tagged mesh of a pair: geometry, a round trip through a file, and every unusable file refused by name."""

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


def store(path, pair, names=None, extra=(), edges=None):
    """Write points, quads and tags as they stand, so that a broken pair can be made."""
    points = np.column_stack([pair["points"], np.zeros(len(pair["points"]))])
    pair = make_pair_mesh(SMALL) | pair if "edges" not in pair else pair
    blocks = [("quad", pair["quads"]), ("line", pair["edges"]), *extra]
    mesh = meshio.Mesh(points, blocks)
    tags = [
        np.asarray(pair["tags"], np.int32),
        np.asarray(pair["edge_tags"], np.int32),
        *(np.ones(len(cells), np.int32) for _, cells in extra),
    ]
    mesh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    mesh.field_data = {
        k: np.array([v, 2]) for k, v in (CELL_TAGS if names is None else names).items()
    }
    mesh.field_data |= {
        k: np.array([v, 1]) for k, v in (EDGE_TAGS if edges is None else edges).items()
    }
    meshio.write(path, mesh, file_format="gmsh22", binary=True)
    return path


def read_grid(path):
    """The grid of a file whose pieces are alike and tensor grids."""
    low, high = read_bodies(path)
    assert isinstance(low, TensorGrid) and high is None
    return low


@each_grid
def test_exact_round_trip_through_msh(grid, tmp_path):
    write_mesh(grid, tmp_path / "pair.msh")
    back = read_grid(tmp_path / "pair.msh")
    assert back.coating_rows == grid.coating_rows
    assert np.abs(back.x - grid.x).max() <= 1e-12 * grid.length
    assert np.abs(back.depth - grid.depth).max() <= 1e-12 * grid.height


def test_refuses_a_missing_file_and_a_foreign_ending(tmp_path):
    with pytest.raises(PatchfemError, match="no such mesh file"):
        read_grid(tmp_path / "nowhere.msh")
    (tmp_path / "pair.stl").write_text("solid")
    with pytest.raises(PatchfemError, match=r"from \.msh, \.vtu, \.inp or \.med"):
        read_bodies(tmp_path / "pair.stl")
    with pytest.raises(PatchfemError, match=r"\.msh or \.vtu"):
        write_mesh(SMALL, tmp_path / "pair.stl")
    with pytest.raises(Missing, match="cannot be written"):
        write_mesh(SMALL, tmp_path / "nowhere" / "pair.msh")


def test_refuses_counts_the_file_cannot_hold_and_keeps_stdout_clean(tmp_path, capsys):
    path = tmp_path / "pair.msh"
    write_mesh(SMALL, path)
    read_grid(path)
    assert capsys.readouterr().out == ""
    content = path.read_bytes()
    at = content.index(b"$Nodes") + 7
    path.write_bytes(content[:at] + b"100000000" + content[content.index(b"\n", at) :])
    start = time.process_time()
    with pytest.raises(PatchfemError, match="announces 100000000"):
        read_grid(path)
    assert time.process_time() - start < 1.0


def test_always_a_coating_that_is_no_layer_leaves_no_tensor_grid(tmp_path):
    pair = make_pair_mesh(SMALL)
    tags = pair["tags"].copy()
    tags[np.flatnonzero(tags == CELL_TAGS["upper_coating"])[2]] = CELL_TAGS["upper_substrate"]
    low, high = read_bodies(store(tmp_path / "pair.msh", {**pair, "tags": tags}))
    assert isinstance(low, PieceMesh) and isinstance(high, PieceMesh)


def together(lower, upper):
    """The lower piece of one grid and the upper piece of another as one pair."""
    lower = make_pair_mesh(lower)
    upper = make_pair_mesh(upper)
    out = {}
    for part, tags, codes in (("quads", "tags", CELL_TAGS), ("edges", "edge_tags", EDGE_TAGS)):
        kept = [
            np.isin(pair[tags], [code for name, code in codes.items() if name.startswith(side)])
            for side, pair in (("lower", lower), ("upper", upper))
        ]
        out[part] = np.concatenate(
            [lower[part][kept[0]], upper[part][kept[1]] + len(lower["points"])]
        )
        out[tags] = np.concatenate([lower[tags][kept[0]], upper[tags][kept[1]]])
    return out | {"points": np.concatenate([lower["points"], upper["points"]])}


@pytest.mark.parametrize(
    "other",
    [graded_grid(2e-3, 1.2e-3, 5e-4, 1e-4), graded_grid(2e-3, 1e-3, 5e-4)],
    ids=["taller", "uncoated"],
)
def test_exact_unlike_pieces_on_the_same_columns_are_two_grids(other, tmp_path):
    low, high = read_bodies(store(tmp_path / "pair.msh", together(SMALL, other)))
    for back, grid in ((low, SMALL), (high, other)):
        assert back.coating_rows == grid.coating_rows and back.depth == pytest.approx(
            grid.depth, rel=1e-12
        )
        assert back.x == pytest.approx(SMALL.x, rel=1e-12)


def test_exact_coatings_of_unlike_thickness_on_the_same_grid_are_two_grids(tmp_path):
    pair = make_pair_mesh(SMALL)
    deepest = np.abs(pair["points"][pair["quads"], 1]).max(axis=1) > SMALL.depth[
        SMALL.coating_rows - 1
    ] * (1 + 1e-9)
    tags = pair["tags"].copy()
    tags[deepest & (tags == CELL_TAGS["upper_coating"])] = CELL_TAGS["upper_substrate"]
    low, high = read_bodies(store(tmp_path / "pair.msh", {**pair, "tags": tags}))
    assert (low.coating_rows, high.coating_rows) == (SMALL.coating_rows, SMALL.coating_rows - 1)


@pytest.mark.parametrize("wrong", ["0", "-1"])
def test_refuses_a_text_whose_cell_names_a_node_below_one(wrong, tmp_path):
    """A reader that counts back from the end takes node 0 for the last one, which lies in the upper piece."""
    path = tmp_path / "pair.msh"
    mesh = make_pair("quads")
    write_msh22(mesh, path, binary=False)
    assert read_grid(path)
    lines = path.read_text().split("\n")
    first = lines.index("$Elements") + 2
    for at in (first, first + len(mesh.quads) + len(mesh.edges) - 1):  # a quad, an edge
        words = lines[at].split()
        path.write_text("\n".join([*lines[:at], " ".join([*words[:-1], wrong]), *lines[at + 1 :]]))
        with pytest.raises(
            PatchfemError,
            match=rf"pair.msh: cell {words[0]} names node {wrong}; nodes count from 1",
        ):
            read_bodies(path)
