"""One piece: linear fields, stresses in balance with the load, and layers compared with the harmonic closed form."""

from __future__ import annotations

import numpy as np
import pytest
from contact_forms import layered_compliance
from hypothesis import given
from hypothesis import strategies as st
from pieces import CARBIDE, COATED, COATING, TITANIUM

from patchfem.core import NotConverged
from patchfem.elasticity import (
    Layers,
    Piece,
    compute_centre_stress,
    compute_displacement,
    get_cells,
)
from patchfem.elasticity.elasticity import compute_stiffness
from patchfem.mesh import ELEMENTS, TensorGrid, make_graded_grid

materials = st.tuples(st.floats(1e9, 1e12), st.floats(0.0, 0.45))
planes = st.sampled_from(["strain", "stress"])
NONUNIFORM_GRID = TensorGrid(
    np.array([-3e-3, -1e-3, -0.8e-3, 0.5e-3, 2e-3, 3e-3]),
    np.array([0, 1e-4, 3e-4, 1e-3, 2.5e-3]),
    2,
)


def make_grid_piece(grid, layers):
    """Return the piece of a tensor grid."""
    return Piece(grid, layers)


@given(
    coating=materials,
    substrate=materials,
    plane=planes,
    slopes=st.lists(st.floats(-1, 1), min_size=4, max_size=4),
)
def test_exact_linear_field_satisfies_hooke_law(coating, substrate, plane, slopes):
    """The stress of a linear displacement field satisfies Hooke's law in plane strain and plane stress."""
    piece = make_grid_piece(NONUNIFORM_GRID, Layers(coating, substrate, plane))
    (ux, uy), (vx, vy) = np.reshape(slopes, (2, 2)) * 1e-3
    x, y = np.meshgrid(NONUNIFORM_GRID.x, NONUNIFORM_GRID.depth, indexing="ij")
    field = np.stack([ux * x + uy * y, vx * x + vy * y], axis=-1).reshape(1, -1, 2)
    cells = get_cells(piece)
    stress = compute_centre_stress(cells, field)
    for is_coating, (young, nu) in ((True, coating), (False, substrate)):
        sxx, syy, szz, sxy = stress[0, cells.is_coating == is_coating].T
        scale = 1e-11 * (np.abs(slopes).max() * 1e-3 + 1e-300) / (1 - 2 * nu)
        assert np.abs((sxx - nu * (syy + szz)) / young - ux).max() <= scale
        assert np.abs((syy - nu * (sxx + szz)) / young - vy).max() <= scale
        assert np.abs(2 * (1 + nu) * sxy / young - (uy + vx)).max() <= scale
        if plane == "strain":
            assert np.abs((szz - nu * (sxx + syy)) / young).max() <= scale
        else:
            assert np.all(szz == 0)


def half_wave_compliance(n_elements, wavelength):
    """Return the compliance of half a wave on the coated piece between symmetry lines, from the energy."""
    base = make_graded_grid(wavelength / 2, 2 * wavelength, wavelength / 16, COATING)
    depth = base.depth
    rows = base.coating_rows
    for _ in range(int(np.log2(n_elements // 8))):
        depth = np.sort(np.concatenate([depth, (depth[1:] + depth[:-1]) / 2]))
        rows *= 2
    x = np.linspace(0, wavelength / 2, n_elements + 1)
    piece = Piece(TensorGrid(x, depth, rows), COATED)
    k = 2 * np.pi / wavelength
    # consistent nodal forces of cos(kx) on straight shape functions
    h = x[1]
    force = h * np.cos(k * x) * 2 * (1 - np.cos(k * h)) / (k * h) ** 2
    force[[0, -1]] /= 2
    # no displacement along x on the symmetry lines
    piece = Piece(piece.mesh, COATED, guided=0)
    u = compute_displacement(piece, 0 * force, force)[0, piece.mesh.interface, 1]
    return force @ u / (wavelength / 4)


@pytest.mark.parametrize("wavelength", [0.08e-3, 0.5e-3, 2e-3])
def test_order_of_harmonic_layer_compliance_is_two(wavelength):
    """The compliance of a coated piece under a harmonic pressure converges from below with order two."""
    counts = np.array([8, 16, 32])
    expected = layered_compliance(2 * np.pi / wavelength, CARBIDE, TITANIUM, COATING)
    errors = np.array([half_wave_compliance(int(n), wavelength) for n in counts]) / expected - 1
    assert np.all(errors < 0)
    assert -np.polyfit(np.log(counts), np.log(-errors), 1)[0] == pytest.approx(2.0, abs=0.1)
    assert abs(errors[-1]) <= 4e-3


def test_refuses_moduli_of_coating_and_substrate_too_far_apart():
    """A stiffness that is singular to working precision is refused with the ratio of the moduli and the remedies; the
    round-off error of moduli that are less far apart is estimated."""
    grid = make_graded_grid(2e-3, 1e-3, 2e-4, COATING)
    pieces = [
        make_grid_piece(grid, Layers((e, 0.24), (1e12, 0.32), "strain")) for e in (1e30, 1e22)
    ]
    with pytest.raises(NotConverged, match=r"differ by a factor of 1e\+18: bring the moduli"):
        _ = pieces[0].factor
    assert pieces[1].factor and 1e-7 < pieces[1].round_off_error < 1e-2


def test_parallelogram_has_the_stiffness_of_the_integration_at_its_points():
    """A parallelogram has the same stiffness among other parallelograms as beside a cell without parallel sides."""
    points = np.array(
        [[0.0, 0.0], [3e-3, 1e-4], [3.5e-3, 4e-4], [5e-4, 3e-4], [6e-3, 1e-4], [6.1e-3, 9e-4]]
    )
    cells = np.array([[0, 1, 2, 3], [1, 4, 5, 2]])
    lam = np.array([1.1e11, 0.7e11])
    mu = np.array([0.5e11, 0.8e11])
    alone = compute_stiffness(points, cells[:1], ELEMENTS["quad"], lam[:1], mu[:1])
    beside = compute_stiffness(points, cells, ELEMENTS["quad"], lam, mu)
    np.testing.assert_allclose(alone[0], beside[0], rtol=0, atol=1e-14 * np.abs(alone).max())
    assert not np.allclose(alone[0], beside[1], rtol=1e-3)
