"""Stiffness of tensor grids and other meshes compared with `skfem.models.elasticity`, which the package does not use."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from any_mesh_cases import mesh_of_grid
from hypothesis import given
from hypothesis import strategies as st
from pieces import CARBIDE, COATED, COATING, TITANIUM
from skfem import Basis, ElementQuad1, ElementTriP1, ElementVector, MeshQuad, MeshTri
from skfem.models.elasticity import linear_elasticity
from stiffness import free_stiffness, make_matrix, make_stencil

from patchfem.elasticity import Layers, Piece, Substructure, get_cells, lame
from patchfem.elasticity.tensor_stiffness import apply_stencil
from patchfem.mesh import TensorGrid, graded_grid

SPACINGS = st.lists(st.floats(0.01, 10.0), min_size=2, max_size=9)


def assemble_with_skfem(shape, element, points, cells, coated, layers, degree=2):
    """Return the stiffness of all nodes by scikit-fem's linear elasticity, unknowns (along x, inward) node by node."""
    basis = Basis(shape(points.T.copy(), cells.T.copy()), ElementVector(element()), intorder=degree)
    pairs = np.array([lame(*layers.substrate, layers.plane), lame(*layers.coating, layers.plane)])
    lam, mu = (
        np.broadcast_to(part[:, None], basis.dx.shape) for part in pairs[coated.astype(int)].T
    )
    order = basis.nodal_dofs.T.ravel()
    return linear_elasticity(lam, mu).assemble(basis)[order][:, order]


def assemble_quad_stencil(piece):
    """Return the stencil of a piece of quadrilaterals, assembled by scikit-fem."""
    cells = get_cells(piece)
    columns, rows = piece.grid.x.size, piece.grid.depth.size
    is_free = np.arange(columns * rows) % rows < rows - 1
    free = (2 * np.flatnonzero(is_free)[:, None] + [0, 1]).ravel()
    matrix = assemble_with_skfem(
        MeshQuad, ElementQuad1, cells.points, cells.blocks[0], cells.is_coating, piece.layers
    )
    return make_stencil(matrix[free][:, free], columns)


@given(
    column_widths=SPACINGS,
    row_heights=SPACINGS,
    coating=st.integers(0, 9),
    plane=st.sampled_from(["strain", "stress"]),
)
def test_exact_grid_stiffness_equals_scikit_fem(column_widths, row_heights, coating, plane):
    """The stiffness of a tensor grid equals that of scikit-fem's linear elasticity to round-off."""
    x, depth = (
        np.append(0, np.cumsum(spacings)) * 1e-4 for spacings in (column_widths, row_heights)
    )
    layers = Layers(CARBIDE, TITANIUM, plane)
    coating = min(coating, len(row_heights))
    computed = Piece(TensorGrid(x, depth, coating), layers)
    stencil = computed.stencil
    expected = assemble_quad_stencil(computed)
    scale = np.abs(expected).max()
    # scikit-fem computes element lengths from its mapping, with the round-off of the coordinates
    aspect = max(np.ptp(points) / np.diff(points).min() for points in (x, depth))
    assert np.abs(stencil - expected).max() <= 2e-15 * aspect * scale
    u = np.random.default_rng(0).normal(size=(x.size, depth.size - 1, 2, 2))
    product = free_stiffness(computed) @ u.reshape(-1, 2)
    assert np.abs(apply_stencil(stencil, u).reshape(-1, 2) - product).max() <= 1e-13 * scale
    assert np.array_equal(
        make_matrix(make_stencil(free_stiffness(computed), x.size)).toarray(),
        free_stiffness(computed).toarray(),
    )


def test_exact_scikit_fem_is_imported_only_without_cache(tmp_path):
    """Only the first run on a machine imports scikit-fem; later runs read the cached element matrices."""
    code = (
        "import sys; from patchfem.elasticity.tensor_stiffness import tensor_stencil as f; "
        "print(f([0, 0.1, 0.3], [0, 0.2, 0.7], [1, 2], [3, 5]).tolist(), 'skfem' in sys.modules)"
    )
    environment = os.environ | {"PATCHFEM_CACHE": str(tmp_path)}
    first, second = (
        subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for _ in range(2)
    )
    assert first.endswith("True\n") and second == first.replace("True", "False")


@pytest.mark.parametrize("split", [0.0, 0.4, 1.0])
def test_exact_mesh_stiffness_equals_scikit_fem(split):
    """The stiffness of a mesh of triangles and quads equals that of scikit-fem's linear elasticity to round-off."""
    mesh = mesh_of_grid(graded_grid(4e-3, 2e-3, 3e-4, COATING), split, seed=4)
    piece = Substructure(mesh, COATED)
    first = len(mesh.triangles)
    expected = 0
    for shape, element, cells, coated, degree in (
        (MeshTri, ElementTriP1, mesh.triangles, mesh.is_coating[:first], 1),
        (MeshQuad, ElementQuad1, mesh.quads, mesh.is_coating[first:], 2),
    ):
        if len(cells):
            expected = expected + assemble_with_skfem(
                shape, element, mesh.points, cells, coated, COATED, degree
            )
    free = (2 * piece.order[:, None] + [0, 1]).ravel()
    assert (
        np.abs((expected[free][:, free] - free_stiffness(piece)).toarray()).max()
        <= 1e-14 * np.abs(expected.data).max()
    )
