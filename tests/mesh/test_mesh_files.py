"""The tagged mesh of a pair: geometry, round trips through files, and refusals of unusable files."""

from __future__ import annotations

import numpy as np
import pytest

from patchfem.core import Missing, PatchfemError
from patchfem.mesh import TensorGrid, graded_grid, read_pieces, write_mesh

GRIDS = {
    "coated": graded_grid(12.7e-3, 6.35e-3, 0.4e-3, 152.4e-6),
    "plain": graded_grid(5e-3, 2e-3, 0.5e-3),
    "uneven columns": TensorGrid(
        np.array([-2e-3, -0.5e-3, 0.1e-3, 2e-3]), np.array([0, 1e-4, 3e-4, 1e-3]), 1
    ),
}
SMALL = graded_grid(2e-3, 1e-3, 5e-4, 1e-4)

each_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS.keys())


@each_grid
def test_exact_grid_round_trip_through_msh(grid, tmp_path):
    """A grid is written to an .msh file and read back with its nodes, tags and coating."""
    write_mesh(grid, tmp_path / "pair.msh")
    pair = read_pieces(tmp_path / "pair.msh")
    for piece in (pair.lower, pair.upper):
        assert np.abs(piece.points - grid.points).max() <= 1e-12 * grid.length
        assert np.array_equal(piece.is_coating, grid.is_coating)
        assert np.array_equal(piece.interface, grid.interface)
        assert np.array_equal(piece.far, grid.far)


def test_refuses_missing_mesh_file_and_unknown_suffix(tmp_path):
    """A missing mesh file, an unknown suffix and a missing folder are refused."""
    with pytest.raises(PatchfemError, match="no such mesh file"):
        read_pieces(tmp_path / "nowhere.msh")
    (tmp_path / "pair.stl").write_text("solid")
    with pytest.raises(PatchfemError, match=r"from \.msh, \.vtu, \.inp or \.med"):
        read_pieces(tmp_path / "pair.stl")
    with pytest.raises(PatchfemError, match=r"\.msh or \.vtu"):
        write_mesh(SMALL, tmp_path / "pair.stl")
    with pytest.raises(Missing, match="cannot be written"):
        write_mesh(SMALL, tmp_path / "nowhere" / "pair.msh")
