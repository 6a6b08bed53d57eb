"""A piece of any mesh condensed by sparse factors: dense inverse, grid condensation, layers, and balanced fields."""

from __future__ import annotations

import numpy as np
import pytest
from any_mesh_cases import mesh_of_grid
from pieces import CARBIDE, COATED, COATING, HEIGHT, LENGTH, TITANIUM
from stiffness import free_stiffness

from patchfem.core import NotConverged
from patchfem.elasticity import (
    Layers,
    Substructure,
    centre_stress,
    compute_displacement,
    elasticity,
    get_cells,
)
from patchfem.elasticity import interface_compliance as condense
from patchfem.elasticity.condense import MAX_REFINEMENT_CHANGE
from patchfem.mesh import graded_grid


@pytest.mark.parametrize("split", [0.0, 0.5])
def test_exact_mesh_compliance_equals_dense_inverse(split):
    """The compliance of a mesh is the interface block of the dense inverse, symmetric and positive definite."""
    mesh = mesh_of_grid(graded_grid(4e-3, 2e-3, 2e-4, COATING), split, seed=7)
    piece = Substructure(mesh, COATED)
    m = 2 * mesh.interface.size
    expected = np.linalg.inv(free_stiffness(piece).toarray())[-m:, -m:]
    nn, tt, nt = condense(piece)
    for computed, reference in (
        (nn, expected[1::2, 1::2]),
        (tt, expected[::2, ::2]),
        (nt, expected[1::2, ::2]),
    ):
        assert np.abs(computed - reference).max() <= 1e-10 * np.abs(expected).max()
    assert np.array_equal(nn, nn.T) and np.array_equal(tt, tt.T)
    assert np.linalg.eigvalsh(np.block([[nn, nt], [nt.T, tt]])).min() > 0


def test_exact_stiff_coating_compliance_within_round_off_bound():
    """For a very stiff coating the grid and mesh compliances differ by no more than their stated round-off errors."""
    layers = Layers((TITANIUM[0] * 1e5, CARBIDE[1]), TITANIUM, "strain")
    grid = graded_grid(LENGTH, HEIGHT, LENGTH / 40, 1e-6)
    grid_piece = elasticity.Piece(grid, layers)
    mesh_piece = Substructure(mesh_of_grid(grid, seed=1), layers)
    expected = condense(grid_piece)[0]
    computed = condense(mesh_piece)[0]
    assert 1e-12 < mesh_piece.round_off_error <= MAX_REFINEMENT_CHANGE
    bound = 3 * (grid_piece.round_off_error + mesh_piece.round_off_error) * np.abs(expected).max()
    assert 1e-3 * bound < np.abs(computed - expected).max() <= bound


@pytest.mark.parametrize("split", [0.0, 0.5, 1.0])
def test_exact_mesh_fields_agree_with_compliance_and_grid(split):
    """Displacements and stresses of a mesh agree with its compliance, balance the load, and equal those of the grid."""
    grid = graded_grid(4e-3, 2e-3, 2e-4, COATING)
    mesh = mesh_of_grid(grid, split, seed=5)
    piece = Substructure(mesh, COATED)
    nn, tt, nt = condense(piece)
    shear, normal = np.random.default_rng(1).normal(size=(2, 3, grid.x.size))
    u = compute_displacement(piece, shear, normal)
    assert (
        np.abs(u[:, mesh.interface, 1] - (normal @ nn.T + shear @ nt.T)).max()
        <= 1e-10 * np.abs(u).max()
    )
    assert (
        np.abs(u[:, mesh.interface, 0] - (normal @ nt + shear @ tt.T)).max()
        <= 1e-10 * np.abs(u).max()
    )
    assert np.all(u[:, mesh.far] == 0)
    stress = centre_stress(get_cells(piece), u)
    volume = mesh.areas()
    # virtual work of a displacement linear in depth: the mean stress carries the load
    relative_height = (grid.height - mesh.points[:, 1]) / grid.height
    for component, load in ((1, normal), (3, shear)):
        assert stress[:, :, component] @ volume == pytest.approx(
            -grid.height * load.sum(axis=1), rel=1e-9
        )
    assert relative_height[mesh.interface] == pytest.approx(1)
    if split == 0:
        grid_piece = elasticity.Piece(grid, COATED)
        expected = elasticity.von_mises(
            centre_stress(get_cells(grid_piece), compute_displacement(grid_piece, shear, normal))
        )
        computed = elasticity.von_mises(centre_stress(get_cells(piece), u))
        assert np.abs(computed - expected).max() <= 1e-9 * expected.max()


def test_refuses_slender_piece_with_short_elements():
    """A column of 0.1 mm x 20 m with short elements is refused; longer elements give the compliance H/(E L)."""
    young = 200e9
    nu = 0.0
    length = 1e-4
    height = 2.0
    layers = Layers((young, nu), (young, nu), "stress")
    fine, coarse = (
        mesh_of_grid(graded_grid(length, height, length / cells), seed=1) for cells in (96, 3)
    )
    with pytest.raises(
        NotConverged, match=r"shortest cell is 1.04 um in a piece of 100 um x 2 m: use longer"
    ):
        condense(Substructure(fine, layers))
    normal, *_ = condense(Substructure(coarse, layers))
    weights = coarse.tributary_lengths() / length
    assert weights @ normal @ weights == pytest.approx(height / (young * length), rel=1e-3)
