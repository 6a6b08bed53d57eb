"""One piece: linear fields, reciprocity, stresses in balance with the load, layers against the harmonic formula."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import CARBIDE, COATED, COATING, TITANIUM
from scipy.sparse.linalg import spsolve
from stiffness import free_stiffness

from patchfem.closed_forms.contact import layered_compliance
from patchfem.elasticity import (
    Layers,
    centre_stress,
    compute_displacement,
    get_cells,
    make_piece,
    von_mises,
)
from patchfem.mesh import TensorGrid, graded_grid

materials = st.tuples(st.floats(1e9, 1e12), st.floats(0.0, 0.45))
planes = st.sampled_from(["strain", "stress"])
UNEVEN = TensorGrid(
    np.array([-3e-3, -1e-3, -0.8e-3, 0.5e-3, 2e-3, 3e-3]),
    np.array([0, 1e-4, 3e-4, 1e-3, 2.5e-3]),
    2,
)


def piece_of(grid, layers):
    return make_piece(grid.x, grid.depth, grid.coating_rows, layers)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_exact_every_row_of_cells_carries_the_load(plane):
    grid = graded_grid(4e-3, 2e-3, 2e-4, COATING)
    piece = piece_of(grid, Layers(CARBIDE, TITANIUM, plane))
    shear, normal = np.random.default_rng(2).normal(size=(2, 4, grid.x.size))
    stress = centre_stress(get_cells(piece), compute_displacement(piece, shear, normal))
    mises = von_mises(stress)
    corner = piece.cells
    ny = grid.depth.size
    wide = grid.x[corner[:, 1] // ny] - grid.x[corner[:, 0] // ny]
    row = corner[:, 0] % ny
    for k in range(ny - 1):
        carried = wide[row == k] @ stress[:, row == k].transpose(1, 0, 2).reshape(
            (row == k).sum(), -1
        )
        carried = carried.reshape(4, 4)
        assert np.abs(carried[:, 1] + normal.sum(axis=1)).max() <= 1e-10 * np.abs(normal).sum()
        assert np.abs(carried[:, 3] + shear.sum(axis=1)).max() <= 1e-10 * np.abs(shear).sum()
    full = np.zeros((*mises.shape, 3, 3))
    for k, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1)]):
        full[..., i, j] = full[..., j, i] = stress[..., k]
    deviator = full - np.trace(full, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
    assert mises == pytest.approx(np.sqrt(1.5 * (deviator**2).sum(axis=(-2, -1))), rel=1e-12)


@given(
    coating=materials,
    substrate=materials,
    plane=planes,
    slopes=st.lists(st.floats(-1, 1), min_size=4, max_size=4),
)
def test_exact_stress_of_a_linear_field_obeys_hooke_in_three_dimensions(
    coating, substrate, plane, slopes
):
    piece = piece_of(UNEVEN, Layers(coating, substrate, plane))
    (ux, uy), (vx, vy) = np.reshape(slopes, (2, 2)) * 1e-3
    x, y = np.meshgrid(UNEVEN.x, UNEVEN.depth, indexing="ij")
    field = np.stack([ux * x + uy * y, vx * x + vy * y], axis=-1).reshape(1, -1, 2)
    stress = centre_stress(get_cells(piece), field)
    for coat, (young, nu) in ((True, coating), (False, substrate)):
        sxx, syy, szz, sxy = stress[0, piece.is_coating == coat].T
        scale = 1e-11 * (np.abs(slopes).max() * 1e-3 + 1e-300) / (1 - 2 * nu)
        assert np.abs((sxx - nu * (syy + szz)) / young - ux).max() <= scale
        assert np.abs((syy - nu * (sxx + szz)) / young - vy).max() <= scale
        assert np.abs(2 * (1 + nu) * sxy / young - (uy + vx)).max() <= scale
        if plane == "strain":
            assert np.abs((szz - nu * (sxx + syy)) / young).max() <= scale
        else:
            assert np.all(szz == 0)


def half_wave_compliance(cells, wave):
    """One half wave of the coated piece between two lines of symmetry, from the energy of its pressure."""
    base = graded_grid(wave / 2, 2 * wave, wave / 16, COATING)
    depth = base.depth
    rows = base.coating_rows
    for _ in range(int(np.log2(cells // 8))):
        depth = np.sort(np.concatenate([depth, (depth[1:] + depth[:-1]) / 2]))
        rows *= 2
    x = np.linspace(0, wave / 2, cells + 1)
    piece = make_piece(x, depth, rows, COATED)
    k = 2 * np.pi / wave
    # consistent nodal forces of cos(kx) on straight shape functions
    h = x[1]
    force = h * np.cos(k * x) * 2 * (1 - np.cos(k * h)) / (k * h) ** 2
    force[[0, -1]] /= 2
    load = np.zeros((cells + 1, depth.size - 1, 2))
    load[:, 0, 1] = force
    free = np.ones(load.shape, bool)
    free[[0, -1], :, 0] = False  # no motion along x where the wave is symmetric
    free = np.flatnonzero(free.ravel())
    u = spsolve(free_stiffness(piece)[free][:, free].tocsc(), load.ravel()[free])
    return load.ravel()[free] @ u / (wave / 4)


@pytest.mark.parametrize("wave", [0.08e-3, 0.5e-3, 2e-3])
def test_order_layered_harmonic_is_two_and_the_piece_never_too_soft(wave):
    counts = np.array([8, 16, 32])
    truth = layered_compliance(2 * np.pi / wave, CARBIDE, TITANIUM, COATING)
    errors = np.array([half_wave_compliance(int(n), wave) for n in counts]) / truth - 1
    assert np.all(errors < 0)
    assert -np.polyfit(np.log(counts), np.log(-errors), 1)[0] == pytest.approx(2.0, abs=0.1)
    assert abs(errors[-1]) <= 4e-3
