"""Rows of points as fine as a trace: the waves of a layer in closed form, what free ends change, edges, stiffnesses."""

from __future__ import annotations

import numpy as np
import pytest

from patchfem.closed_forms import contact as closed_forms
from patchfem.contact import (
    PointCompliance,
    end_compliance,
    layer_compliance,
    patch_problem,
    smooth_modes,
    solve_by_gradients,
)
from patchfem.contact.half_space.point_compliance import find_edges, set_stiffness
from patchfem.elasticity import Layers, make_piece
from patchfem.elasticity.condense import condense

LENGTH, HEIGHT, THICK = 12.7e-3, 6.35e-3, 0.1524e-3
COATED = Layers((250e9, 0.24), (120e9, 0.32), "strain")


def test_exact_short_waves_of_a_strip_are_those_of_a_coated_half_plane():
    k = np.geomspace(1e2, 1e7, 50)
    known = closed_forms.layered_compliance(k, COATED.coating, COATED.substrate, THICK)
    assert layer_compliance(k, 1.0, THICK, COATED)[0] == pytest.approx(known, rel=1e-13)


def hold_ends(stencil, component: int) -> np.ndarray:
    """Return the stencil of a grid whose first and last column keep this component of their displacement at zero."""
    out = stencil.copy()
    for column, neighbour, side in ((0, 1, 0), (-1, -2, 2)):
        diagonal = stencil[column, :, 1, 1, component, component]
        out[column, :, :, :, component] = 0.0
        out[column, :, 1, :, :, component] = 0.0
        out[neighbour, :, side, :, :, component] = 0.0
        out[column, :, 1, 1, component, component] = diagonal
    return out


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize("held", [0, 1])
def test_order_waves_of_a_strip_are_those_of_cells_between_lines_without_friction(held, plane):
    """Pressure (held 0) and shear (held 1) of a coated piece; an even face moves as bars do to round-off."""
    layers = Layers(COATED.coating, COATED.substrate, plane)
    errors = []
    for cells in (40, 80):
        x = np.linspace(0, LENGTH, cells + 1)
        depth = np.concatenate(
            [
                np.linspace(0, THICK, cells // 10 + 1)[:-1],
                THICK + (HEIGHT - THICK) * np.linspace(0, 1, cells // 2) ** 1.8,
            ]
        )
        piece = make_piece(x, depth, cells // 10, layers)
        stencil = hold_ends(piece.stencil, held)
        face = condense(stencil, False).compliance()[1 - held :: 2, 1 - held :: 2]
        weight = np.full(x.size, x[1])
        weight[[0, -1]] /= 2
        k = np.array([0.0, 2.0, 5.0]) * np.pi / LENGTH
        known = layer_compliance(k, HEIGHT, THICK, layers)[held]
        seen = [np.ptp(face @ (weight * np.cos(one * x))) / 2 for one in k[1:]]
        errors.append(np.abs(np.array(seen) / known[1:] - 1).max())
        assert face @ weight == pytest.approx(np.full(x.size, known[0]), rel=1e-9)
    assert errors[1] < 4e-3 and 1.8 <= np.log2(errors[0] / errors[1]) <= 2.4, errors


def row(count: int, area: float = LENGTH) -> PointCompliance:
    """Two bare pieces between lines without friction, per metre of width."""
    k = np.arange(count) * np.pi / LENGTH
    layers = Layers((120e9, 0.32), (120e9, 0.32), "strain")
    x = ((np.arange(count) + 0.5) / count - 0.5) * LENGTH
    return PointCompliance(
        x,
        area / count,
        2 * layer_compliance(k, HEIGHT, 0.0, layers)[0],
        np.zeros((count, 0)),
        np.zeros(0),
    )


def test_exact_products_are_symmetric_and_their_equations_solved():
    points = row(300)
    draw = np.random.default_rng(1)
    one, other = draw.normal(size=(2, 300))
    assert one @ points.product(other) == pytest.approx(other @ points.product(one), rel=1e-12)
    active = draw.random(300) < 0.4
    force = points.solve_forces(active, one)
    assert points.product(force)[active] == pytest.approx(one[active], abs=1e-8)
    assert not force[~active].any()


@pytest.mark.parametrize("count", [721, pytest.param(2967, marks=pytest.mark.slow)])
def test_exact_edges_between_points_are_those_of_a_row_eight_times_as_fine(count):
    """To 0.03 of a cell; the stiffness of so many points to 7e-5."""
    found = []
    for points in (row(count), row(8 * count)):
        gap = (points.x - 0.123e-3) ** 2 / (2 * 0.3)
        force, _ = solve_by_gradients(
            points, patch_problem(points.x, gap - gap.min(), 2e4), 1e-10, 3000
        )
        active = force > 0
        one = np.ones(points.x.size)
        moved = gap + points.product(force)
        edges = find_edges(
            points,
            force,
            np.where(active, 0.0, moved - moved[active].mean()),
            points.solve_forces(active, one),
        )
        found.append(
            (*(edge.position for edge in edges), set_stiffness(points, active, one, edges))
        )
    assert found[0][:2] == pytest.approx(found[1][:2], abs=0.03 * LENGTH / count)
    assert found[0][2] == pytest.approx(found[1][2], rel=7e-5)


def test_exact_what_free_ends_change_is_added_back():
    """Functions between the columns of a piece give its own compliance at them, to the part that is left out."""
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 41)
    depth = HEIGHT * np.linspace(0, 1, 21) ** 1.5
    piece = make_piece(x, depth, 0, COATED)
    change = end_compliance(piece)[0]
    modes, sizes = smooth_modes(x, change, x)
    assert modes * sizes @ modes.T == pytest.approx(change, abs=1e-7 * np.abs(change).max())
