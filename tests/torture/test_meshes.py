"""The meshes of the attacks are meshes: without a wound every format is pressed alike."""

import numpy as np
import pytest
from pair_meshes import pair_mesh
from torture import meshes

from patchfem.mesh.files import read_bodies


@pytest.mark.parametrize("name, form", [("m.msh", meshes._msh), ("m.inp", meshes._inp)])
def test_exact_the_whole_mesh_is_the_grid(tmp_path, name, form):
    (tmp_path / name).write_text(form(pair_mesh(meshes.GRID)))
    lower, upper = read_bodies(tmp_path / name)
    assert upper is None and np.array_equal(lower.x, meshes.GRID.x) and np.array_equal(lower.depth, meshes.GRID.depth)
