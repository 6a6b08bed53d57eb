"""Rows of points as fine as a measured trace: waves of a layer in closed form, free ends, edges and stiffnesses."""

from __future__ import annotations

import contact_forms as closed_forms
import numpy as np
import pytest

from patchfem.contact import (
    PointCompliance,
    end_compliance,
    layer_compliance,
    make_patch_problem,
    smooth_modes,
    solve_by_gradients,
)
from patchfem.contact.half_space.point_compliance import find_edges, set_stiffness
from patchfem.elasticity import Layers, Piece
from patchfem.mesh import TensorGrid

LENGTH, HEIGHT, THICKNESS = 12.7e-3, 6.35e-3, 0.1524e-3
COATED = Layers((250e9, 0.24), (120e9, 0.32), "strain")


def test_exact_short_wave_compliance_equals_coated_half_plane():
    """The compliance of a coated strip for short waves equals that of a coated half-plane."""
    k = np.geomspace(1e2, 1e7, 50)
    expected = closed_forms.layered_compliance(k, COATED.coating, COATED.substrate, THICKNESS)
    assert layer_compliance(k, 1.0, THICKNESS, COATED)[0] == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize("component", [0, 1])
def test_order_of_strip_compliance_on_finite_elements(component, plane):
    """The finite-element compliance of a strip between frictionless walls converges to the closed form with order two.

    Normal (component 0) and tangential (component 1) waves of a coated piece are compared; a
    uniform load has the compliance of a bar to round-off.
    """
    layers = Layers(COATED.coating, COATED.substrate, plane)
    errors = []
    for cells in (40, 80):
        x = np.linspace(0, LENGTH, cells + 1)
        depth = np.concatenate(
            [
                np.linspace(0, THICKNESS, cells // 10 + 1)[:-1],
                THICKNESS + (HEIGHT - THICKNESS) * np.linspace(0, 1, cells // 2) ** 1.8,
            ]
        )
        piece = Piece(TensorGrid(x, depth, cells // 10), layers, guided=component)
        face = piece.factor.compliance[1 - component :: 2, 1 - component :: 2]
        weight = np.full(x.size, x[1])
        weight[[0, -1]] /= 2
        k = np.array([0.0, 2.0, 5.0]) * np.pi / LENGTH
        expected = layer_compliance(k, HEIGHT, THICKNESS, layers)[component]
        computed = [np.ptp(face @ (weight * np.cos(wave_number * x))) / 2 for wave_number in k[1:]]
        errors.append(np.abs(np.array(computed) / expected[1:] - 1).max())
        assert face @ weight == pytest.approx(np.full(x.size, expected[0]), rel=1e-9)
    assert errors[1] < 4e-3 and 1.8 <= np.log2(errors[0] / errors[1]) <= 2.4, errors


def make_points(n_points: int, length: float = LENGTH) -> PointCompliance:
    """Return two uncoated pieces between frictionless walls as points, per metre of width."""
    k = np.arange(n_points) * np.pi / LENGTH
    layers = Layers((120e9, 0.32), (120e9, 0.32), "strain")
    x = ((np.arange(n_points) + 0.5) / n_points - 0.5) * LENGTH
    return PointCompliance(
        x,
        length / n_points,
        2 * layer_compliance(k, HEIGHT, 0.0, layers)[0],
        np.zeros((n_points, 0)),
        np.zeros(0),
    )


def test_exact_point_compliance_is_symmetric_and_invertible():
    """The compliance product is symmetric, and the solve on a contact set inverts it."""
    points = make_points(300)
    rng = np.random.default_rng(1)
    first, second = rng.normal(size=(2, 300))
    assert first @ points.product(second) == pytest.approx(
        second @ points.product(first), rel=1e-12
    )
    in_contact = rng.random(300) < 0.4
    force = points.solve_forces(in_contact, first)
    assert points.product(force)[in_contact] == pytest.approx(first[in_contact], abs=1e-8)
    assert not force[~in_contact].any()


def press_points(points, gap, load: float) -> tuple:
    """Return the positions of the contact edges of equally spaced points, and the stiffness."""
    force, _ = solve_by_gradients(
        points, make_patch_problem(points.x, gap - gap.min(), load), 1e-10, 3000
    )
    in_contact = force > 0
    ones = np.ones(points.x.size)
    opening = gap + points.product(force)
    gap_after = np.where(in_contact, 0.0, opening - opening[in_contact].mean())
    edges = find_edges(points, force, gap_after, points.solve_forces(in_contact, ones))
    return [edge.position for edge in edges], set_stiffness(points, in_contact, ones, edges)


def test_exact_point_edges_agree_with_refined_points(n_points: int = 721):
    """Edges agree with points eight times as dense within 0.03 of a spacing, and the stiffness within 7e-5."""
    coarse, fine = (
        press_points(points, (points.x - 0.123e-3) ** 2 / (2 * 0.3), 2e4)
        for points in (make_points(n_points), make_points(8 * n_points))
    )
    assert coarse[0] == pytest.approx(fine[0], abs=0.03 * LENGTH / n_points)
    assert coarse[1] == pytest.approx(fine[1], rel=7e-5)


def test_exact_smooth_modes_reproduce_end_compliance():
    """The smooth modes reproduce the change of compliance by the free ends within 1e-7."""
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 41)
    piece = Piece(TensorGrid(x, HEIGHT * np.linspace(0, 1, 21) ** 1.5, 0), COATED)
    end_change = end_compliance(piece)[0]
    modes, weights = smooth_modes(x, end_change, x)
    assert modes * weights @ modes.T == pytest.approx(
        end_change, abs=1e-7 * np.abs(end_change).max()
    )
