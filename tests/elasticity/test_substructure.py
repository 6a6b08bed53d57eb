"""A piece of any mesh condensed by sparse factors: dense inverse, grid condensation, layers, and balanced fields."""

from __future__ import annotations

import numpy as np
import pytest
from any_mesh_cases import mesh_of_grid, triangulate_graded_rows
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import CARBIDE, COATED, COATING, HEIGHT, LENGTH, TITANIUM
from scipy.sparse.linalg import spsolve
from stiffness import free_stiffness

from patchfem.closed_forms.contact import layered_compliance
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

materials = st.tuples(st.floats(1e9, 1e12), st.floats(0.0, 0.45))
planes = st.sampled_from(["strain", "stress"])


@pytest.mark.parametrize("split", [0.0, 0.5, 1.0])
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


@settings(settings.get_profile("costly"))
@given(coating=materials, substrate=materials, plane=planes, split=st.sampled_from([0.0, 0.4, 1.0]))
def test_always_compliance_is_independent_of_numbering(coating, substrate, plane, split):
    """The compliance is independent of the node numbering and does not decrease with refinement."""
    grid = graded_grid(4e-3, 2e-3, 1e-3, COATING)
    layers = Layers(coating, substrate, plane)
    base = condense(Substructure(mesh_of_grid(grid, split), layers))
    for computed, expected in zip(
        condense(Substructure(mesh_of_grid(grid, split, seed=3), layers)), base
    ):
        assert np.abs(computed - expected).max() <= 1e-9 * base[0].max()
    refined = condense(Substructure(mesh_of_grid(grid, split).refine(), layers))
    coarse_nodes = [part[::2, ::2] for part in refined]
    added_compliance = np.block(
        [
            [coarse_nodes[0] - base[0], coarse_nodes[2] - base[2]],
            [(coarse_nodes[2] - base[2]).T, coarse_nodes[1] - base[1]],
        ]
    )
    # the spaces are nested, so refinement can only increase the compliance
    assert np.linalg.eigvalsh(added_compliance).min() >= -1e-9 * base[0].max()


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


def harmonic_error(wavelength, n_elements):
    """Return the relative error of the compliance of half a wave on a coated piece of triangles."""
    min_size = wavelength / 2 / n_elements
    mesh = triangulate_graded_rows(
        wavelength / 4,
        2 * wavelength,
        lambda x, y: 0 * x + min(min_size + 0.05 * y, wavelength / 16),
        COATING,
    )
    piece = Substructure(mesh, COATED)
    x = mesh.x
    k = 2 * np.pi / wavelength
    gauss, weight = np.polynomial.legendre.leggauss(5)
    force = np.zeros(x.size)
    for node in range(x.size - 1):
        h = x[node + 1] - x[node]
        pressure = -np.sin(k * (x[node] + h * (gauss + 1) / 2)) * weight * h / 2
        force[node] += pressure @ (1 - gauss) / 2
        force[node + 1] += pressure @ (1 + gauss) / 2
    load = np.zeros((piece.order.size, 2))
    load[-x.size :, 1] = force
    free = np.ones(load.shape, bool)
    free[np.abs(mesh.points[piece.order, 0]) > wavelength / 4 * (1 - 1e-9), 0] = (
        False  # symmetry lines
    )
    free = np.flatnonzero(free.ravel())
    load = load.ravel()[free]
    energy = load @ spsolve(free_stiffness(piece)[free][:, free], load)
    return energy / (wavelength / 4) / layered_compliance(k, CARBIDE, TITANIUM, COATING) - 1


@pytest.mark.parametrize("wavelength", [0.08e-3, 0.5e-3, 2e-3])
def test_exact_triangle_layer_compliance_within_one_percent(wavelength):
    """The compliance of a coated piece of triangles is at most 1 % too stiff and never too soft."""
    assert -1e-2 <= harmonic_error(wavelength, 96) < 0


def test_refuses_slender_piece_with_short_elements():
    """A column of 0.1 mm x 20 m with short elements is refused; longer elements give the compliance H/(E L)."""
    young = 200e9
    nu = 0.0
    length = 1e-4
    height = 20.0
    layers = Layers((young, nu), (young, nu), "stress")
    fine, coarse = (
        mesh_of_grid(graded_grid(length, height, length / cells), seed=1) for cells in (96, 3)
    )
    with pytest.raises(
        NotConverged, match=r"shortest cell is 1.04 um in a piece of 100 um x 20 m: use longer"
    ):
        condense(Substructure(fine, layers))
    normal, *_ = condense(Substructure(coarse, layers))
    weights = coarse.tributary_lengths() / length
    assert weights @ normal @ weights == pytest.approx(height / (young * length), rel=1e-3)
