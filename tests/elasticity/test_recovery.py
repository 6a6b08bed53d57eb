"""Recovered stress, its error estimate and the traction on the coating interface: linear fields, Hertz and balances."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from any_mesh_cases import mesh_of_grid, triangulate_graded_rows
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import CARBIDE, COATED, COATING, TITANIUM, make_bare_layers, make_refined_grid
from support.pieces import compute_row_heights

from patchfem.elasticity import (
    Cells,
    Layers,
    compute_centre_stress,
    compute_coating_traction,
    elasticity,
    estimate_error,
    fit_recovery,
    get_cells,
    make_points,
)
from patchfem.mesh import TensorGrid, make_graded_grid

HALF_WIDTH, LOAD = 0.1e-3, 9107.0
P0 = 2 * LOAD / (np.pi * HALF_WIDTH)
TOUGH = (121e9, 0.3)
SMALL = make_graded_grid(2e-3, 1e-3, 2e-4, COATING)


def mesh_cells(mesh) -> Cells:
    """Return the cells of a mesh."""
    return Cells(mesh.points, mesh.blocks, mesh.is_coating, COATED)


def grid_piece(grid, layers=COATED):
    """Return the piece of a tensor grid."""
    return elasticity.Piece(grid, layers)


@cache
def triangle_mesh():
    """Return triangles of a coated piece that grow from its interface."""
    return triangulate_graded_rows(1e-3, 1e-3, lambda x, y: 8e-5 + 0.1 * y + 0 * x, COATING)


@cache
def all_cells():
    """Return the cells of a tensor grid, of mixed quads and triangles, and of triangles alone, all coated."""
    return (
        get_cells(grid_piece(SMALL)),
        mesh_cells(mesh_of_grid(SMALL, 0.5, seed=2)),
        mesh_cells(triangle_mesh()),
    )


@pytest.mark.parametrize("mesh_index", range(3))
@given(seed=st.integers(0, 2**32 - 1))
@settings(settings.get_profile("costly"))
def test_exact_linear_stress_is_recovered_at_each_node(mesh_index, seed):
    """A linear stress in each material is recovered exactly at every node, separately for coating and substrate."""
    recovery = fit_recovery(all_cells()[mesh_index])
    slopes = (
        np.random.default_rng(seed).normal(size=(2, 3, 4)) * 1e8
    )  # independent fields in the two materials
    slopes[:, 1:] *= 1e3

    def field(at, coat):
        return np.einsum(
            "ni,nik->nk", np.column_stack([np.ones(len(at)), at]), slopes[coat.astype(int)]
        )

    cells = recovery.cells
    recovered = recovery(field(cells.centres(), cells.is_coating))
    assert (
        np.abs(recovered - field(cells.points[recovery.node], recovery.is_coating)).max()
        <= 1e-12 * np.abs(slopes[:, 0]).max() + 1e-12 * np.abs(slopes[:, 1:]).max() * 1e-3
    )
    corners = np.concatenate([block.ravel() for block in cells.blocks])
    is_coating = cells.is_coating[cells.cell_of_corner()]
    coating_nodes, substrate_nodes = np.unique(corners[is_coating]), np.unique(corners[~is_coating])
    assert (
        recovery.node.size
        == len(cells.points) + np.intersect1d(coating_nodes, substrate_nodes).size
    )


def recover_with_error(piece, u) -> tuple:
    """Return the integration points of a piece, and its recovered stress under displacements with the estimated error."""
    cells = get_cells(piece)
    rules = make_points(cells, "gauss")
    return rules, estimate_error(fit_recovery(cells), u, compute_centre_stress(cells, u), rules)


@pytest.mark.parametrize("split", [None, 0.5])
def test_exact_strain_energy_equals_work_and_errors_add_up(split):
    """The strain energy equals the work of the load, and the element errors add up to the total error."""
    force = np.random.default_rng(4).normal(size=(2, 3, SMALL.x.size)) * 1e3
    if split is None:
        piece = grid_piece(SMALL)
        face = np.arange(SMALL.x.size) * SMALL.depth.size
    else:
        mesh = mesh_of_grid(SMALL, split, seed=2)
        piece = elasticity.Piece(mesh, COATED)
        face = mesh.interface
    u = elasticity.compute_displacement(piece, *force)
    rules, recovery = recover_with_error(piece, u)
    work = (force.transpose(1, 2, 0) * u[:, face]).sum(axis=(1, 2))
    area = sum(rule.weights.sum() for rule in rules)
    assert area == pytest.approx(2e-3 * 1e-3, rel=1e-12)
    assert recovery.energy == pytest.approx(work, rel=1e-9)
    element_errors, total_error = recovery.relative_error(recovery)
    assert (element_errors**2).sum(axis=1) == pytest.approx(total_error**2, rel=1e-12)
    assert total_error**2 == pytest.approx(recovery.relative_error()[1] ** 2 / 2, rel=1e-12)
    assert (recovery.relative_error()[1] < 1).all() and (
        recovery.relative_error()[1] > total_error
    ).all()


def hertz_axis_stress(depth):
    """Return the stresses (n, 4) on the axis under Hertz's pressure in plane strain (Johnson 1985, 4.46)."""
    z = depth / HALF_WIDTH
    root = np.sqrt(1 + z**2)
    xx = -P0 * ((1 + 2 * z**2) / root - 2 * z)
    yy = -P0 / root
    return np.stack([xx, yy, TOUGH[1] * (xx + yy), 0 * z], axis=-1)


@cache
def solve_hertz_block(per_half_width):
    """Return a large block under Hertz's pressure: piece, nodal forces, displacements and stresses."""
    grid = make_refined_grid(1.5 * HALF_WIDTH, HALF_WIDTH / per_half_width, 150e-3, 70e-3, 1.1)
    uniform_depth = np.arange(0, 2 * per_half_width + 1) * HALF_WIDTH / per_half_width
    depth = np.concatenate(
        [
            uniform_depth,
            2 * HALF_WIDTH
            + np.cumsum(
                compute_row_heights(1.1 * HALF_WIDTH / per_half_width, 70e-3 - 2 * HALF_WIDTH)
            ),
        ]
    )
    piece = grid_piece(TensorGrid(grid.x, depth, 0), make_bare_layers(TOUGH))
    fine_x = np.linspace(-HALF_WIDTH, HALF_WIDTH, 20001)
    p = P0 * np.sqrt(np.maximum(1 - (fine_x / HALF_WIDTH) ** 2, 0)) * (fine_x[1] - fine_x[0])
    element = np.searchsorted(grid.x, fine_x, side="right") - 1
    fraction = (fine_x - grid.x[element]) / (grid.x[element + 1] - grid.x[element])
    force = np.bincount(element, p * (1 - fraction), grid.x.size) + np.bincount(
        element + 1, p * fraction, grid.x.size
    )
    u = elasticity.compute_displacement(piece, 0 * force[None], force[None])
    return piece, force, u, compute_centre_stress(get_cells(piece), u)


def test_hertz_subsurface_stress_peaks():
    """The recovered stress peaks as in Hertz: shear 0.300 p0 at 0.786 a, von Mises 0.558 p0 at 0.704 a."""
    depth = np.linspace(0.2, 2, 200001) * HALF_WIDTH
    axis = hertz_axis_stress(depth)
    piece, _, _, stress = solve_hertz_block(16)
    recovery = fit_recovery(get_cells(piece))
    for measure, expected, expected_depth in (
        (lambda s: np.hypot((s[..., 0] - s[..., 1]) / 2, s[..., 3]), 0.300, 0.786),
        (elasticity.von_mises, 0.558, 0.704),
    ):
        values = measure(axis)
        assert values.max() / P0 == pytest.approx(expected, abs=5e-4)
        assert depth[values.argmax()] / HALF_WIDTH == pytest.approx(expected_depth, abs=5e-4)
        recovered = measure(recovery(stress[0]))
        points = recovery.cells.points[recovery.node]
        peak_point = points[int(np.argmax(recovered))]
        assert recovered.max() == pytest.approx(values.max(), rel=5e-3)
        assert peak_point == pytest.approx(
            [0.0, depth[values.argmax()]], abs=HALF_WIDTH / 16
        )  # within one element


@pytest.mark.parametrize("mesh_kind", ["tensor", "mixed", "triangles"])
@given(seed=st.integers(0, 2**32 - 1), plane=st.sampled_from(["strain", "stress"]))
@settings(settings.get_profile("costly"))
def test_exact_coating_traction_balances_load_and_moment(mesh_kind, seed, plane):
    """The traction on the coating interface balances the load and its moment for all kinds of meshes."""
    layers = Layers(CARBIDE, TITANIUM, plane)
    if mesh_kind == "tensor":
        piece = grid_piece(SMALL, layers)
        x = SMALL.x
    else:
        mesh = mesh_of_grid(SMALL, 0.5, seed=2) if mesh_kind == "mixed" else triangle_mesh()
        piece = elasticity.Piece(mesh, layers)
        x = mesh.x
    shear, normal = np.random.default_rng(seed).normal(size=(2, 2, x.size))
    cells = get_cells(piece)
    traction = compute_coating_traction(
        cells, elasticity.compute_displacement(piece, shear, normal)
    )
    total_load = np.abs(shear).sum() + np.abs(normal).sum()
    assert (
        np.abs(
            traction.force.sum(axis=1) - np.stack([shear.sum(axis=1), normal.sum(axis=1)], axis=1)
        ).max()
        <= 1e-10 * total_load
    )
    x_traction, depth = cells.points[traction.node].T
    moment = (traction.force[..., 1] * x_traction - traction.force[..., 0] * depth).sum(axis=1)
    assert np.abs(moment - normal @ x).max() <= 1e-10 * total_load * np.ptp(x)
    assert traction.length.sum() == pytest.approx(2e-3, rel=1e-12)
    assert depth == pytest.approx(COATING, rel=1e-12) and (np.diff(x_traction) > 0).all()
    assert (traction.normal * traction.length).sum(axis=1) == pytest.approx(
        normal.sum(axis=1), abs=1e-10 * total_load
    )
    assert (traction.shear * traction.length).sum(axis=1) == pytest.approx(
        shear.sum(axis=1), abs=1e-10 * total_load
    )


@pytest.mark.parametrize("split", [0.5, None])
def test_exact_error_estimate_agrees_with_refined_energy(split):
    """The error estimate agrees with the energy that refinement adds within 30 %.

    Both meshes have the same pressure, so the squared error is the difference of their energies
    (Galerkin orthogonality).
    """
    mesh = (
        mesh_of_grid(make_graded_grid(2e-3, 1e-3, 1e-4, COATING), split, seed=2)
        if split is not None
        else triangle_mesh()
    )
    finest = mesh.refine().refine()
    pressure = 1e8 * np.maximum(1 - (finest.x / 0.6e-3) ** 2, 0)
    step = np.diff(finest.x)
    force = np.zeros(finest.x.size)
    force[:-1] += step * (2 * pressure[:-1] + pressure[1:]) / 6
    force[1:] += step * (2 * pressure[1:] + pressure[:-1]) / 6
    hats = np.array([np.interp(finest.x, mesh.x, unit) for unit in np.eye(mesh.x.size)])
    fine = elasticity.Piece(finest, COATED)
    energy = force @ elasticity.compute_displacement(fine, 0 * force, force)[0, finest.interface, 1]
    piece = elasticity.Piece(mesh, COATED)
    load = hats @ force
    u = elasticity.compute_displacement(piece, 0 * load, load)
    expected = (energy - load @ u[0, mesh.interface, 1]) * 16 / 15
    _, recovery = recover_with_error(piece, u)
    assert 0.8 <= np.sqrt(recovery.error.sum() / expected) <= 1.3
