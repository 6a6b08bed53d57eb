"""A piece of any mesh condensed by its factors: the sweep and the dense inverse, Hertz, layers, fields in balance."""

from __future__ import annotations

import numpy as np
import pytest
from any_mesh_cases import cloud, of_grid
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
def test_exact_compliance_is_the_interface_block_of_the_dense_inverse(split):
    mesh = of_grid(graded_grid(4e-3, 2e-3, 2e-4, COATING), split, seed=7)
    piece = Substructure(mesh, COATED)
    m = 2 * mesh.interface.size
    wanted = np.linalg.inv(free_stiffness(piece).toarray())[-m:, -m:]
    nn, tt, nt = condense(piece)
    for mine, theirs in ((nn, wanted[1::2, 1::2]), (tt, wanted[::2, ::2]), (nt, wanted[1::2, ::2])):
        assert np.abs(mine - theirs).max() <= 1e-10 * np.abs(wanted).max()
    assert np.array_equal(nn, nn.T) and np.array_equal(tt, tt.T)
    assert np.linalg.eigvalsh(np.block([[nn, nt], [nt.T, tt]])).min() > 0


def test_exact_compliance_of_a_stiff_coating_is_known_to_its_round_off_error():
    """The sweep of the grid and the factors of the mesh differ by the round-off of both."""
    layers = Layers((TITANIUM[0] * 1e5, CARBIDE[1]), TITANIUM, "strain")
    grid = graded_grid(LENGTH, HEIGHT, LENGTH / 40, 1e-6)
    sweep = elasticity.make_piece(grid.x, grid.depth, grid.coating_rows, layers)
    factors = Substructure(of_grid(grid, seed=1), layers)
    wanted = condense(sweep)[0]
    mine = condense(factors)[0]
    assert 1e-12 < factors.round_off_error <= MAX_REFINEMENT_CHANGE
    bound = 3 * (sweep.round_off_error + factors.round_off_error) * np.abs(wanted).max()
    assert 1e-3 * bound < np.abs(mine - wanted).max() <= bound


@settings(settings.get_profile("costly"))
@given(coating=materials, substrate=materials, plane=planes, split=st.sampled_from([0.0, 0.4, 1.0]))
def test_always_numbering_does_not_matter_and_triangles_are_stiffer_than_halved_ones(
    coating, substrate, plane, split
):
    grid = graded_grid(4e-3, 2e-3, 1e-3, COATING)
    layers = Layers(coating, substrate, plane)
    base = condense(Substructure(of_grid(grid, split), layers))
    for mine, theirs in zip(condense(Substructure(of_grid(grid, split, seed=3), layers)), base):
        assert np.abs(mine - theirs).max() <= 1e-9 * base[0].max()
    fine = condense(Substructure(of_grid(grid, split).refine(), layers))
    kept = [part[::2, ::2] for part in fine]
    more = np.block(
        [[kept[0] - base[0], kept[2] - base[2]], [(kept[2] - base[2]).T, kept[1] - base[1]]]
    )
    # nested spaces: refining only softens
    assert np.linalg.eigvalsh(more).min() >= -1e-9 * base[0].max()


@pytest.mark.parametrize("split", [0.0, 0.5, 1.0])
def test_exact_fields_are_those_of_the_compliance_and_of_the_tensor_grid(split):
    grid = graded_grid(4e-3, 2e-3, 2e-4, COATING)
    mesh = of_grid(grid, split, seed=5)
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
    # the virtual work of a uniform sinking and sliding of depth: the mean stress carries the load
    lift = (grid.height - mesh.points[:, 1]) / grid.height
    for part, load in ((1, normal), (3, shear)):
        assert stress[:, :, part] @ volume == pytest.approx(
            -grid.height * load.sum(axis=1), rel=1e-9
        )
    assert lift[mesh.interface] == pytest.approx(1)
    if split == 0:
        own = elasticity.make_piece(grid.x, grid.depth, grid.coating_rows, COATED)
        theirs = elasticity.von_mises(
            centre_stress(get_cells(own), compute_displacement(own, shear, normal))
        )
        mine = elasticity.von_mises(centre_stress(get_cells(piece), u))
        assert np.abs(mine - theirs).max() <= 1e-9 * theirs.max()


def harmonic_error(wave, cells):
    """One half wave of pressure on the coated piece of triangles, from its energy, against the layered half space."""
    fine = wave / 2 / cells
    mesh = cloud(wave / 4, 2 * wave, lambda x, y: 0 * x + min(fine + 0.05 * y, wave / 16), COATING)
    piece = Substructure(mesh, COATED)
    x = mesh.x
    k = 2 * np.pi / wave
    gauss, weight = np.polynomial.legendre.leggauss(5)
    force = np.zeros(x.size)
    for left in range(x.size - 1):
        h = x[left + 1] - x[left]
        pressure = -np.sin(k * (x[left] + h * (gauss + 1) / 2)) * weight * h / 2
        force[left] += pressure @ (1 - gauss) / 2
        force[left + 1] += pressure @ (1 + gauss) / 2
    load = np.zeros((piece.order.size, 2))
    load[-x.size :, 1] = force
    free = np.ones(load.shape, bool)
    free[np.abs(mesh.points[piece.order, 0]) > wave / 4 * (1 - 1e-9), 0] = False  # symmetric there
    free = np.flatnonzero(free.ravel())
    load = load.ravel()[free]
    energy = load @ spsolve(free_stiffness(piece)[free][:, free], load)
    return energy / (wave / 4) / layered_compliance(k, CARBIDE, TITANIUM, COATING) - 1


@pytest.mark.parametrize("wave", [0.08e-3, 0.5e-3, 2e-3])
def test_exact_layers_of_triangles_within_one_percent_and_never_too_soft(wave):
    assert -1e-2 <= harmonic_error(wave, 96) < 0


def test_refuses_a_bare_piece_too_slender_for_its_cells_by_their_length_and_longer_ones_serve():
    """A column of 0.1 mm x 20 m on cells of 1/96 and of 1/3 of its length; a unit of even load shortens it by
    H/(E L) where nu = 0."""
    young = 200e9
    nu = 0.0
    length = 1e-4
    height = 20.0
    layers = Layers((young, nu), (young, nu), "stress")
    fine, coarse = (
        of_grid(graded_grid(length, height, length / cells), seed=1) for cells in (96, 3)
    )
    with pytest.raises(
        NotConverged, match=r"shortest cell is 1.04 um in a piece of 100 um x 20 m: use longer"
    ):
        condense(Substructure(fine, layers))
    normal, *_ = condense(Substructure(coarse, layers))
    share = coarse.tributary_lengths() / length
    assert share @ normal @ share == pytest.approx(height / (young * length), rel=1e-3)
