"""Recovered stress, its error and the bond line: linear fields, Hertz under the surface, finer meshes, balance."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from any_mesh_cases import cloud, of_grid
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import CARBIDE, COATED, COATING, TITANIUM, bare, refined_middle

from patchfem.elasticity import (
    Cells,
    Layers,
    centre_stress,
    choose_rounding_step,
    compute_coating_traction,
    elasticity,
    estimate_error,
    fit_recovery,
    get_cells,
    lame,
    make_points,
    substructure,
)
from patchfem.elasticity.elasticity import hooke
from patchfem.mesh import TensorGrid, graded_grid
from patchfem.mesh.tensor import graded_rows

A, LOAD = 0.1e-3, 9107.0
P0 = 2 * LOAD / (np.pi * A)
TOUGH = (121e9, 0.3)
SMALL = graded_grid(2e-3, 1e-3, 2e-4, COATING)


def any_cells(mesh, layers=COATED) -> Cells:
    return Cells(
        mesh.points,
        tuple(b for b in (mesh.triangles, mesh.quads) if len(b)),
        mesh.is_coating,
        layers,
    )


def tensor(grid, layers=COATED):
    return elasticity.make_piece(grid.x, grid.depth, grid.coating_rows, layers)


@cache
def meshes():
    """Cells of a tensor grid, of quads and triangles in any order, and of triangles alone, all coated."""
    triangles = cloud(1e-3, 1e-3, lambda x, y: 8e-5 + 0.1 * y + 0 * x, COATING)
    return get_cells(tensor(SMALL)), any_cells(of_grid(SMALL, 0.5, seed=2)), any_cells(triangles)


@pytest.mark.parametrize("kind", range(3))
@given(seed=st.integers(0, 2**32 - 1))
@settings(settings.get_profile("costly"))
def test_exact_a_linear_stress_in_each_material_is_recovered_at_every_node(kind, seed):
    found = fit_recovery(meshes()[kind])
    slopes = np.random.default_rng(seed).normal(size=(2, 3, 4)) * 1e8  # the materials share nothing
    slopes[:, 1:] *= 1e3

    def field(at, coat):
        return np.einsum(
            "ni,nik->nk", np.column_stack([np.ones(len(at)), at]), slopes[coat.astype(int)]
        )

    cells = found.cells
    back = found(field(cells.centres(), cells.is_coating))
    assert (
        np.abs(back - field(cells.points[found.node], found.is_coating)).max()
        <= 1e-12 * np.abs(slopes[:, 0]).max() + 1e-12 * np.abs(slopes[:, 1:]).max() * 1e-3
    )
    both = np.unique(cells.corners()[cells.is_coating[cells.cell_of_corner()]])
    other = np.unique(cells.corners()[~cells.is_coating[cells.cell_of_corner()]])
    assert found.node.size == len(cells.points) + np.intersect1d(both, other).size


def test_exact_a_coating_of_one_row_is_fitted_along_itself():
    grid = TensorGrid(np.linspace(-1e-3, 1e-3, 9), np.array([0.0, 1e-4, 3e-4, 6e-4, 1e-3]), 1)
    found = fit_recovery(get_cells(tensor(grid)))
    middles = found.cells.centres()
    back = found(np.column_stack([np.ones(len(middles)), middles]))
    coat = found.is_coating
    wanted = np.column_stack([np.ones(found.node.size), found.cells.points[found.node]])
    wanted[coat, 2] = 0.5e-4  # nothing is known across the row, so its middle stands for it
    assert np.abs(back - wanted).max() <= 1e-12


@given(seed=st.integers(0, 2**32 - 1), plane=st.sampled_from(["strain", "stress"]))
@settings(settings.get_profile("costly"))
def test_exact_a_bent_grid_recovers_its_linear_stress_and_the_error_is_known(seed, plane):
    """Quadratic motion of one material: the middles of rectangles have the exact stress, the cells miss the rest."""
    layers = bare(TITANIUM, plane)
    piece = tensor(SMALL, layers)
    a, b = np.random.default_rng(seed).normal(size=(2, 3))
    cells = get_cells(piece)
    x, y = cells.points.T
    u = np.stack(
        [a[0] * x**2 + a[1] * x * y + a[2] * y**2, b[0] * x**2 + b[1] * x * y + b[2] * y**2], axis=1
    )[None]
    stress = centre_stress(get_cells(piece), u)
    found = fit_recovery(cells)
    x, y = cells.points[found.node].T
    exact = hooke(
        (
            2 * a[0] * x + a[1] * y,
            b[1] * x + 2 * b[2] * y,
            (a[1] * x + 2 * a[2] * y + 2 * b[0] * x + b[1] * y) / 2,
        ),
        found.is_coating,
        layers,
    )
    assert np.abs(found(stress)[0] - exact).max() <= 1e-11 * np.abs(exact).max()
    corner = cells.points[piece.cells]
    wide = corner[:, 1, 0] - corner[:, 0, 0]
    tall = corner[:, 3, 1] - corner[:, 0, 1]
    # a bilinear cell has the terms in x y; it misses a0 x^2 and b0 x^2 along x, a2 y^2 and b2 y^2 along y
    lam, mu = lame(*TITANIUM, plane)
    missed = (
        wide
        * tall
        / 3
        * (
            wide**2 * ((lam + 2 * mu) * a[0] ** 2 + mu * b[0] ** 2)
            + tall**2 * ((lam + 2 * mu) * b[2] ** 2 + mu * a[2] ** 2)
        )
    )
    error = estimate_error(found, u, stress, make_points(cells, "gauss")).error[0]
    assert np.abs(error / missed - 1).max() <= 1e-9


@given(seed=st.integers(0, 2**32 - 1))
@settings(settings.get_profile("costly"))
def test_always_rounding_to_the_harmless_step_adds_the_wanted_share_of_the_error(seed):
    """Of equal materials with no Poisson ratio the bound is the mean itself."""
    layers = Layers((200e9, 0.0), (200e9, 0.0), "strain")
    piece = tensor(graded_grid(4e-3, 1e-3, 4e-5, COATING), layers)
    found = fit_recovery(get_cells(piece))
    u = np.random.default_rng(seed).normal(size=(1, len(piece.nodes), 2)) * 1e-6
    stress = centre_stress(get_cells(piece), u)
    rules = make_points(found.cells, "gauss")
    error = estimate_error(found, u, stress, rules)
    step = choose_rounding_step(found, error, rules, 1e-3)
    change = np.round(stress[0] / step) * step - stress[0]
    area = np.concatenate([rule.weight.sum(axis=0) for rule in rules])
    energy = area @ (change[:, 0] ** 2 + change[:, 1] ** 2 + 2 * change[:, 3] ** 2) / 200e9
    assert energy == pytest.approx(1e-6 * error.error.sum(), rel=0.05)
    assert (
        choose_rounding_step(found, estimate_error(found, 0 * u, 0 * stress, rules), rules, 1e-3)
        == 0
    )


@pytest.mark.parametrize("split", [None, 0.5])
def test_exact_energy_is_the_work_of_the_load_and_shares_add_up(split):
    force = np.random.default_rng(4).normal(size=(2, 3, SMALL.x.size)) * 1e3
    if split is None:
        piece = tensor(SMALL)
        face = np.arange(SMALL.x.size) * SMALL.depth.size
    else:
        mesh = of_grid(SMALL, split, seed=2)
        piece = substructure.Substructure(mesh, COATED)
        face = mesh.interface
    u = elasticity.compute_displacement(piece, *force)
    cells = get_cells(piece)
    rules = make_points(cells, "gauss")
    found = estimate_error(fit_recovery(cells), u, centre_stress(cells, u), rules)
    work = (force.transpose(1, 2, 0) * u[:, face]).sum(axis=(1, 2))
    area = sum(rule.weight.sum() for rule in rules)
    assert area == pytest.approx(2e-3 * 1e-3, rel=1e-12)
    assert found.energy == pytest.approx(work, rel=1e-9)
    each, whole = found.relative_error(found)
    assert (each**2).sum(axis=1) == pytest.approx(whole**2, rel=1e-12)
    assert whole**2 == pytest.approx(found.relative_error()[1] ** 2 / 2, rel=1e-12)
    assert (found.relative_error()[1] < 1).all() and (found.relative_error()[1] > whole).all()


def hertz_axis(depth):
    """Stresses (n, 4) under the middle of Hertz's pressure, z = depth/a (Johnson 1985, 4.46), plane strain."""
    z = depth / A
    root = np.sqrt(1 + z**2)
    xx = -P0 * ((1 + 2 * z**2) / root - 2 * z)
    yy = -P0 / root
    return np.stack([xx, yy, TOUGH[1] * (xx + yy), 0 * z], axis=-1)


def greatest_shear(stress):
    return np.hypot((stress[..., 0] - stress[..., 1]) / 2, stress[..., 3])


@cache
def under_hertz(per_half_width, coating=0.0):
    """A big block of one material under Hertz's pressure; a `coating` of that same material marks a line in it."""
    grid = refined_middle(1.5 * A, A / per_half_width, 150e-3, 70e-3, 1.1)
    even = np.arange(0, 2 * per_half_width + 1) * A / per_half_width
    depth = np.concatenate(
        [even, 2 * A + np.cumsum(graded_rows(1.1 * A / per_half_width, 70e-3 - 2 * A))]
    )
    rows = round(coating / A * per_half_width)
    piece = tensor(TensorGrid(grid.x, depth, rows), bare(TOUGH))
    fine = np.linspace(-A, A, 20001)
    p = P0 * np.sqrt(np.maximum(1 - (fine / A) ** 2, 0)) * (fine[1] - fine[0])
    cell = np.searchsorted(grid.x, fine, side="right") - 1
    along = (fine - grid.x[cell]) / (grid.x[cell + 1] - grid.x[cell])
    force = np.bincount(cell, p * (1 - along), grid.x.size) + np.bincount(
        cell + 1, p * along, grid.x.size
    )
    u = elasticity.compute_displacement(piece, 0 * force[None], force[None])
    return piece, force, u, centre_stress(get_cells(piece), u)


def test_exact_hertz_stress_peaks_under_the_surface():
    """0.300 p0 at 0.786 a for the shear, 0.558 p0 at 0.704 a for von Mises with nu = 0.3."""
    depth = np.linspace(0.2, 2, 200001) * A
    axis = hertz_axis(depth)
    piece, _, _, stress = under_hertz(16)
    found = fit_recovery(get_cells(piece))
    for of, known, place in ((greatest_shear, 0.300, 0.786), (elasticity.von_mises, 0.558, 0.704)):
        values = of(axis)
        assert values.max() / P0 == pytest.approx(known, abs=5e-4)
        assert depth[values.argmax()] / A == pytest.approx(place, abs=5e-4)
        smooth = of(found(stress[0]))
        at = found.cells.points[found.node]
        top = at[int(np.argmax(smooth))]
        assert smooth.max() == pytest.approx(values.max(), rel=5e-3)
        assert top == pytest.approx([0.0, depth[values.argmax()]], abs=A / 16)  # a cell


def test_order_recovered_stress_under_hertz_is_two():
    errors = []
    for count in (4, 8, 16):
        piece, _, _, stress = under_hertz(count)
        found = fit_recovery(get_cells(piece))
        x, depth = found.cells.points[found.node].T
        mine = (np.abs(x) < 1e-9 * A) & (depth > 0.4 * A) & (depth < 1.6 * A)
        exact = hertz_axis(depth[mine])
        errors.append(np.abs(found(stress[0])[mine] - exact).max() / P0)
    assert np.log2(errors[0] / errors[-1]) / 2 == pytest.approx(2.0, abs=0.3)
    assert errors[-1] <= 4e-3


@pytest.mark.parametrize("kind", ["tensor", "mixed", "triangles"])
@given(seed=st.integers(0, 2**32 - 1), plane=st.sampled_from(["strain", "stress"]))
@settings(settings.get_profile("costly"))
def test_exact_bond_line_carries_the_load_and_its_moment(kind, seed, plane):
    layers = Layers(CARBIDE, TITANIUM, plane)
    if kind == "tensor":
        piece = tensor(SMALL, layers)
        x = SMALL.x
    else:
        mesh = (
            of_grid(SMALL, 0.5, seed=2)
            if kind == "mixed"
            else cloud(1e-3, 1e-3, lambda x, y: 8e-5 + 0.1 * y + 0 * x, COATING)
        )
        piece = substructure.Substructure(mesh, layers)
        x = mesh.x
    shear, normal = np.random.default_rng(seed).normal(size=(2, 2, x.size))
    cells = get_cells(piece)
    bond = compute_coating_traction(cells, elasticity.compute_displacement(piece, shear, normal))
    size = np.abs(shear).sum() + np.abs(normal).sum()
    assert (
        np.abs(
            bond.force.sum(axis=1) - np.stack([shear.sum(axis=1), normal.sum(axis=1)], axis=1)
        ).max()
        <= 1e-10 * size
    )
    at, depth = cells.points[bond.node].T
    moment = (bond.force[..., 1] * at - bond.force[..., 0] * depth).sum(axis=1)
    assert np.abs(moment - normal @ x).max() <= 1e-10 * size * np.ptp(x)
    assert bond.length.sum() == pytest.approx(2e-3, rel=1e-12)
    assert depth == pytest.approx(COATING, rel=1e-12) and (np.diff(at) > 0).all()
    assert (bond.normal * bond.length).sum(axis=1) == pytest.approx(
        normal.sum(axis=1), abs=1e-10 * size
    )
    assert (bond.shear * bond.length).sum(axis=1) == pytest.approx(
        shear.sum(axis=1), abs=1e-10 * size
    )


@given(seed=st.integers(0, 2**32 - 1), slope=st.floats(-0.5, 0.5))
@settings(settings.get_profile("costly"))
def test_exact_bond_line_of_a_slanted_coating_under_even_stress(seed, slope):
    """Any even strain of one material: the traction is sigma n on every inner node of the slanted line."""
    mesh = of_grid(SMALL, 0.5, seed=2)
    points = mesh.points + np.outer(slope * mesh.points[:, 0], [0.0, 1.0])
    cells = Cells(points, (mesh.triangles, mesh.quads), mesh.is_coating, bare(TITANIUM))
    strain = np.random.default_rng(seed).normal(size=(2, 2))
    bond = compute_coating_traction(cells, (points @ strain.T)[None])
    (exx, exy), (eyx, eyy) = strain
    xx, yy, _, xy = hooke((exx, eyy, (exy + eyx) / 2), np.array(0), bare(TITANIUM))
    into, along = np.array([[-slope, 1.0], [1.0, slope]]) / np.hypot(1, slope)
    traction = -np.array([[xx, xy], [xy, yy]]) @ into
    scale = np.abs([xx, yy, xy]).max()
    assert bond.length.sum() == pytest.approx(2e-3 * np.hypot(1, slope), rel=1e-12)
    assert np.abs(bond.normal[0, 1:-1] - traction @ into).max() <= 1e-10 * scale
    assert np.abs(bond.shear[0, 1:-1] - traction @ along).max() <= 1e-10 * scale


def test_exact_no_coating_no_bond_line():
    piece = tensor(graded_grid(2e-3, 1e-3, 2e-4), bare(TITANIUM))
    cells = get_cells(piece)
    assert compute_coating_traction(cells, np.zeros((1, len(cells.points), 2))) is None


@pytest.mark.parametrize("split", [0.0, 0.5, 1.0, None])
def test_exact_indicator_of_any_mesh_is_the_energy_a_finer_mesh_adds(split):
    """The load is the same pressure, so the error squared is the difference of the energies (Galerkin)."""
    mesh = (
        of_grid(graded_grid(2e-3, 1e-3, 1e-4, COATING), split, seed=2)
        if split is not None
        else cloud(1e-3, 1e-3, lambda x, y: 8e-5 + 0.1 * y + 0 * x, COATING)
    )
    finest = mesh.refine().refine()
    pressure = 1e8 * np.maximum(1 - (finest.x / 0.6e-3) ** 2, 0)
    step = np.diff(finest.x)
    force = np.zeros(finest.x.size)
    force[:-1] += step * (2 * pressure[:-1] + pressure[1:]) / 6
    force[1:] += step * (2 * pressure[1:] + pressure[:-1]) / 6
    hats = np.array([np.interp(finest.x, mesh.x, unit) for unit in np.eye(mesh.x.size)])
    fine = substructure.Substructure(finest, COATED)
    energy = force @ elasticity.compute_displacement(fine, 0 * force, force)[0, finest.interface, 1]
    piece = substructure.Substructure(mesh, COATED)
    load = hats @ force
    u = elasticity.compute_displacement(piece, 0 * load, load)
    true = (energy - load @ u[0, mesh.interface, 1]) * 16 / 15
    cells = get_cells(piece)
    rules = make_points(cells, "gauss")
    found = estimate_error(fit_recovery(cells), u, centre_stress(cells, u), rules)
    assert 0.8 <= np.sqrt(found.error.sum() / true) <= 1.3
