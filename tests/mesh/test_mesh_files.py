"""Refusals of mesh files that do not exist or have another suffix."""

from __future__ import annotations

import pytest

from patchfem.core import Missing, PatchfemError
from patchfem.mesh import make_graded_grid, read_pieces, write_mesh

SMALL = make_graded_grid(2e-3, 1e-3, 5e-4, 1e-4)


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
        write_mesh(SMALL, tmp_path / "nowhere/pair.msh")
