"""Interfaces with non-matching nodes: transfer by quadrature, patch tests, Hertz, pressure ripples and balances."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from any_mesh_cases import mesh_of_grid
from pieces import HEIGHT, LENGTH, TITANIUM, make_bare_layers, make_refined_grid
from pressed import press
from support.pieces import compute_row_heights

from patchfem.contact.gaps import crown
from patchfem.core import Compliance, Interface
from patchfem.elasticity import PieceInterface, elasticity, mortar, recovery
from patchfem.mesh import TensorGrid, tributary_lengths

HALF_WIDTH = 0.1e-3  # half-width of the Hertz contact [m]
LOAD = 9107.0  # per metre of width [N/m]
PEAK = 2 * LOAD / (np.pi * HALF_WIDTH)
YOUNG = TITANIUM[0]


def make_nodes(element_sizes, length=LENGTH):
    """Return increasing node positions for given element sizes, centred at 0."""
    x = np.concatenate([[0.0], np.cumsum(element_sizes)])
    x = (x / x[-1] - 0.5) * length
    x[0] = -length / 2
    x[-1] = length / 2
    return x


def hat_function(mesh_nodes, j, positions):
    """Return the hat function of node j at positions within the mesh."""
    return np.interp(positions, mesh_nodes, np.eye(mesh_nodes.size)[j])


def dual_function(x, i, positions):
    """Return the biorthogonal function of node i at positions that are not nodes."""
    cell = np.searchsorted(x, positions) - 1
    side = np.where(cell == i, 1, np.where(cell == i - 1, 0, -1))
    other = np.where(side == 1, i + 1, i - 1).clip(0, x.size - 1)
    values = np.array(
        [2 * hat_function(x, i, p) - hat_function(x, k, p) for p, k in zip(positions, other)]
    )
    return np.where(side >= 0, values, 0.0)


def quadrature_rule(x, mesh_nodes):
    """Return points and weights that are exact for products of piecewise linear functions of both meshes."""
    breakpoints = np.unique(
        np.concatenate([x, mesh_nodes[(mesh_nodes > x[0]) & (mesh_nodes < x[-1])]])
    )
    gauss, weight = np.polynomial.legendre.leggauss(3)
    half = np.diff(breakpoints)[:, None] / 2
    return ((breakpoints[:-1] + breakpoints[1:])[:, None] / 2 + half * gauss).ravel(), (
        half * weight
    ).ravel()


def block_compliance(x, young):
    """Return (nn, tt, nt) of a block of uniform material on these columns, with rows that grow downwards."""
    depth = np.concatenate([[0.0], np.cumsum(compute_row_heights(np.diff(x).min(), 6e-3, 1.1))])
    return elasticity.compute_interface_compliance(
        elasticity.Piece(TensorGrid(x, depth, 0), make_bare_layers((young, TITANIUM[1]), "strain"))
    )


def press_pair(x, nn, gap):
    """Return the contact state of the pair."""
    return press(Compliance(Interface(x, tributary_lengths(x), 1.0), nn, nn), gap, LOAD)


def distorted_mesh(sizes, seed):
    """Return a mesh of a block in which half of the quads are split and the inner nodes are moved at random."""
    x = make_nodes(sizes)
    depth = np.linspace(0, HEIGHT, 7)
    piece = mesh_of_grid(TensorGrid(x, depth, 0), 0.5)
    points = piece.points.copy()
    inner = (points > [x[0], 0]).all(axis=1) & (points < [x[-1], HEIGHT]).all(axis=1)
    shifts = np.random.default_rng(seed).uniform(-0.2, 0.2, (inner.sum(), 2))
    points[inner] += shifts * [np.diff(x).min(), depth[1]]
    return replace(piece, points=points)


def distorted_pair(poisson=0.0, stiff=100.0):
    """Return two distorted blocks of 12 and 9 columns, the upper one `stiff` times as stiff, and their compliances."""
    rng = np.random.default_rng(4)
    pair = [
        elasticity.Piece(
            distorted_mesh(rng.uniform(0.5, 1.0, count), count), make_bare_layers((young, poisson))
        )
        for count, young in ((12, YOUNG), (9, stiff * YOUNG))
    ]
    return pair, [elasticity.compute_interface_compliance(piece) for piece in pair]


@pytest.mark.parametrize("stiff", [0.01, 1.0, 100.0])
def test_exact_patch_test_with_distorted_blocks(stiff):
    """A uniform pressure gives uniform stress in both distorted blocks (patch test)."""
    pair, (low, high) = distorted_pair(0.0, stiff)
    joined = mortar.join_pieces(
        PieceInterface(pair[0].mesh.x, low), PieceInterface(pair[1].mesh.x, high)
    )
    state = press_pair(joined.x, joined.compliance.nn, np.zeros(joined.x.size))
    for piece, force in zip(
        pair, joined.distribute_forces(state.sigma_n * joined.tributary_lengths)
    ):
        assert force == pytest.approx(piece.mesh.tributary_lengths() * LOAD / LENGTH, rel=1e-12)
        u = elasticity.compute_displacement(piece, 0 * force, force)
        stress = recovery.compute_centre_stress(recovery.get_cells(piece), u)
        assert np.abs(stress - [0, -LOAD / LENGTH, 0, 0]).max() <= 1e-11 * LOAD / LENGTH


def test_exact_joined_compliance_equals_weighted_displacements():
    """The joined compliance equals the displacements of both bodies weighted by independent quadrature."""
    pair, (low, high) = distorted_pair(0.3, 2.0)
    bodies = PieceInterface(pair[0].mesh.x, low), PieceInterface(pair[1].mesh.x, high)
    joined = mortar.join_pieces(*bodies)
    x = joined.x
    rng = np.random.default_rng(8)
    normal, shear = rng.normal(size=(2, x.size))
    closing = np.zeros(x.size)
    slide = np.zeros(x.size)
    for piece, sign in zip(pair, (1, -1)):  # +x on the lower piece, -x on the upper one
        mesh_nodes = piece.mesh.x
        positions, weight = quadrature_rule(x, mesh_nodes)
        psi = (
            np.array([dual_function(x, i, positions) * weight for i in range(x.size)])
            / tributary_lengths(x)[:, None]
        )
        load = (
            psi
            @ np.array([hat_function(mesh_nodes, j, positions) for j in range(mesh_nodes.size)]).T
        )
        u = elasticity.compute_displacement(piece, sign * shear @ load, normal @ load)[
            0, piece.mesh.interface
        ]
        closing += load @ u[:, 1]
        slide += sign * load @ u[:, 0]
    assert (
        np.abs(joined.compliance.nn @ normal + joined.compliance.nt @ shear - closing).max()
        <= 1e-11 * np.abs(closing).max()
    )
    assert (
        np.abs(joined.compliance.tt @ shear + joined.compliance.nt.T @ normal - slide).max()
        <= 1e-11 * np.abs(slide).max()
    )


@cache
def _compute_hertz_block(per_half_width):
    """Return (x, compliance) of a Hertz block of titanium."""
    grid = make_refined_grid(1.5 * HALF_WIDTH, HALF_WIDTH / per_half_width, LENGTH, 6e-3, 1.1)
    return grid.x, elasticity.compute_interface_compliance(
        elasticity.Piece(grid, make_bare_layers(TITANIUM))
    )


def hertz_block(per_half_width, young=YOUNG):
    """Return (x, compliance) of the block of the Hertz pair with elements of a/per_half_width at the contact."""
    x, parts = _compute_hertz_block(per_half_width)
    return x, elasticity.InterfaceCompliance(*(part * (YOUNG / young) for part in parts))


def hertz_errors(x, nn, young_low, young_high):
    """Return the largest error inside 0.8 a, the error of the peak, both relative to the peak, and the state."""
    modulus = 1 / ((1 - TITANIUM[1] ** 2) * (1 / young_low + 1 / young_high))
    state = press_pair(x, nn, crown(x, np.pi * modulus * HALF_WIDTH**2 / (4 * LOAD)))
    inside = np.abs(x) < 0.8 * HALF_WIDTH
    error = state.sigma_n[inside] - PEAK * np.sqrt(1 - (x[inside] / HALF_WIDTH) ** 2)
    return np.abs(error).max() / PEAK, abs(state.sigma_n.max() / PEAK - 1), state


@pytest.mark.parametrize("young_low, young_high", [(1, 1), (1, 100), (100, 1)])
@pytest.mark.parametrize("fine", [17, 40])
def test_exact_hertz_pressure_on_nonmatching_meshes(fine, young_low, young_high):
    """The Hertz pressure on non-matching meshes is accurate within 0.4 % of the peak."""
    (x_low, low), (x_high, high) = (
        hertz_block(16, young_low * YOUNG),
        hertz_block(fine, young_high * YOUNG),
    )
    joined = mortar.join_pieces(PieceInterface(x_low, low), PieceInterface(x_high, high))
    ripple, peak, _ = hertz_errors(
        joined.x, joined.compliance.nn, young_low * YOUNG, young_high * YOUNG
    )
    assert ripple <= 4e-3 and peak <= 1e-3


@pytest.mark.share(1)
@pytest.mark.parametrize("stiff", [1.0, 0.1, 0.01])
def test_exact_grid_follows_coarser_side(stiff):
    """Where the coarser side changes along the interface, the chosen grid follows the coarser side."""
    coarse, fine = (
        make_refined_grid(1.5 * HALF_WIDTH, HALF_WIDTH / count, LENGTH, 6e-3, 1.1).x
        for count in (16, 40)
    )
    x_low = np.concatenate([fine[fine < 0], coarse[coarse >= 0]])
    x_high = -x_low[::-1]
    low = block_compliance(x_low, YOUNG)
    high = block_compliance(x_high, stiff * YOUNG)
    joined = mortar.join_pieces(PieceInterface(x_low, low), PieceInterface(x_high, high))
    assert hertz_errors(joined.x, joined.compliance.nn, YOUNG, stiff * YOUNG)[0] <= 4e-3
