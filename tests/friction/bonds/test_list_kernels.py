"""Compiled bond lists of equation 2.17 (direct, truncated, merged) against the recursion, hand sums and closed forms."""

import numpy as np
import pytest
from friction_paths import (
    random_walk,
    reference_energy,
    reference_traction,
    triangle_path,
    upper_pressure,
)
from list_paths import STATUS, march_list
from scipy.special import gammainc

from patchfem.friction import Bonds

UNIT_PRESSURE = upper_pressure([1.0])
GROWTH = {"ratio": 0.6, "rest_growth": 0.3, "slip_growth": 0.4, "rest_speed": 1e-2}


# ---- direct lists


@pytest.mark.parametrize("order, tolerance", [(0.0, 1e-12), (2.0, 1e-12), (3.7, 1e-8)])
@pytest.mark.parametrize("initial", [0.0, 1.0])
def test_exact_direct_printed_law_equals_hand_sum(order, tolerance, initial):
    """The direct list of the printed law has the forces of a sum over the bonds by hand, also at rest."""
    law = Bonds(1.0, 1.0, order, "report", initial=initial)
    path = np.concatenate(
        [random_walk(3, 40, 0.7), random_walk(3, 40, 0.7)[-1] + np.array([0, 0.2, 0.4, 30, 30])]
    )
    compiled = march_list(law, path)
    for k in (3, 20, 40, 43, 45):
        expected = reference_traction(law, path[: k + 1], UNIT_PRESSURE)[0]
        assert compiled.after[k - 1] == pytest.approx(expected, abs=tolerance)
    assert compiled.ahead == pytest.approx(compiled.after, abs=tolerance)


@pytest.mark.share(0, 3, 6, 8, 11)
@pytest.mark.parametrize(
    "order, tolerance",
    [(0.0, 2e-6), (0.5, 2e-5), (0.25, 1e-4), (1.5, 2e-6), (2.0, 2e-6), (3.0, 1e-6)],
)
@pytest.mark.parametrize("growth", [{}, GROWTH])
def test_exact_direct_stretch_law_equals_hand_sum(order, tolerance, growth):
    """The direct list of the stretch law agrees with a sum by hand where the stretch of a bond vanishes inside a strip.

    Forces of order 0 were wrong by 5e-2 there before strips were split.
    """
    law = Bonds(1.0, 1.0, order, "stretch", **growth)
    path = np.concatenate([triangle_path(1.5, 3, 13), [-1.43, -0.77, 4.0, 3.3, 3.9]])
    compiled = march_list(law, path - path[0], 0.4)
    for k in (5, 17, 30, 46, *range(len(path) - 6, len(path))):
        expected = reference_traction(law, path[: k + 1] - path[0], UNIT_PRESSURE, 0.4)[0]
        assert compiled.after[k - 1] == pytest.approx(expected, abs=tolerance)
    assert compiled.ahead == pytest.approx(compiled.after, abs=tolerance)


@pytest.mark.parametrize("order, tolerance", [(-0.5, 1e-4), (1.0, 1e-5)])
@pytest.mark.parametrize("initial", [0.0, 1.0])
def test_exact_direct_growing_bonds_equal_hand_sum(order, tolerance, initial):
    """The direct list of growing bonds agrees with a sum over the bonds by hand."""
    law = Bonds(1.0, 1.0, order, "report", initial=initial, **GROWTH)
    path = random_walk(3, 60, 0.3)
    compiled = march_list(law, path, 0.4)
    for k in (5, 20, 40, 60):
        assert compiled.after[k - 1] == pytest.approx(
            reference_traction(law, path[: k + 1], UNIT_PRESSURE, 0.4)[0], abs=tolerance
        )
    assert compiled.ahead == pytest.approx(compiled.after, abs=tolerance)


@pytest.mark.share(1)
@pytest.mark.parametrize("order", [-0.5, -0.9])
def test_exact_young_growing_bonds_equal_hand_sum(order):
    """Forces of growing bonds of negative order agree with a sum by hand within 2e-6.

    The length of a young bond is proportional to its path, so its force is smooth; a quadrature
    made for a power of the path was wrong by up to 2e-4.
    """
    law = Bonds(1.0, 1.0, order, "report", initial=0.0, **GROWTH)
    path = 1.5 * np.sin(2 * np.pi * np.arange(276) / 200)
    dt = 2 * np.pi / 200
    forces = march_list(law, path, dt).after
    for k in (30, 75, 140, 190, 275):
        assert forces[k - 1] == pytest.approx(
            reference_traction(law, path[: k + 1], UNIT_PRESSURE, dt)[0], abs=2e-6
        )


@pytest.mark.parametrize("order, tolerance", [(-0.9, 1e-4), (-0.5, 1e-5), (0.5, 5e-8)])
def test_exact_fractional_order_bonds_grown_at_rest(order, tolerance):
    """The force of bonds that reached their full length at rest is the incomplete gamma function P(p + 1, R/eps_0)."""
    law = Bonds(
        1.0,
        1.0,
        order,
        "report",
        ratio=0.5,
        rest_growth=1.0,
        slip_growth=0.2,
        rest_speed=1e-2,
        initial=0.0,
    )
    path = np.append(np.linspace(0, 0.2, 11), 0.2)
    forces = march_list(law, path, np.append(np.full(10, 0.4), 1e4)).after
    assert forces[-1] == pytest.approx(gammainc(order + 1, 0.2), abs=tolerance)


@pytest.mark.parametrize(
    "reading, order, growth",
    [
        ("stretch", 0.0, {}),
        ("stretch", 0.5, {}),
        ("report", -0.5, {}),
        ("report", 2.0, GROWTH),
    ],
)
def test_exact_stored_energy_equals_hand_sum(reading, order, growth):
    """The stored energy of the list agrees with a sum over the bonds by hand."""
    law = Bonds(1.0, 1.0, order, reading, initial=0.0, **growth)
    path = random_walk(4, 30, 0.4)
    compiled = march_list(law, path, 0.4)
    for k in (3, 17, 30):
        tolerance = 1e-3 if order < 0 else 3e-5
        assert compiled.stored[k - 1] == pytest.approx(
            reference_energy(law, path[: k + 1], 0.4), abs=tolerance
        )


@pytest.mark.parametrize(
    "reading, order, tolerance",
    [("report", -0.5, 2e-3), ("report", 0.0, 1e-6), ("stretch", 2.0, 1e-5)],
)
def test_exact_force_after_step_of_million_bond_lengths(reading, order, tolerance):
    """The force after a step of a million bond lengths is the friction limit, with strips only within the cut-off."""
    law = Bonds(1.0, 1.0, order, reading, initial=0.0)
    result = march_list(law, np.array([0.0, 1e6, 1e6 + 0.05]), tail=1e-9)
    assert result.after == pytest.approx([1.0, 1.0], abs=tolerance)
    assert result.mean[0] == pytest.approx(1.0, abs=1e-4)
    assert result.status[STATUS.max_strips] <= 4 * 30 + 2


def test_exact_strips_of_tiny_growing_bonds_are_limited():
    """Steps of a million bond lengths of growing bonds keep at most 100 strips."""
    law = Bonds(
        1.0,
        1.0,
        1.0,
        "report",
        ratio=0.5,
        rest_growth=1e9,
        slip_growth=0.05,
        rest_speed=1.0,
        initial=0.0,
    )
    result = march_list(law, np.array([0.0, 1e6, 0.0]), tail=1e-9)
    assert np.isfinite(result.after).all() and result.status[STATUS.max_strips] <= 100


# ---- truncated lists


@pytest.mark.parametrize(
    "reading, order, growth",
    [
        ("report", 1.0, {}),
        ("report", 0.0, GROWTH),
        ("stretch", 2.0, {}),
        ("stretch", 1.0, GROWTH),
    ],
)
def test_always_truncation_error_is_below_tail(reading, order, growth):
    """The truncated list differs from the full list by at most its tail, and has fewer strips."""
    law = Bonds(1.0, 1.0, order, reading, initial=0.0, **growth)
    path = random_walk(9, 300, 0.6)
    full = march_list(law, path, 0.5)
    for tail in (1e-2, 1e-5):
        truncated = march_list(law, path, 0.5, tail=tail)
        assert np.abs(truncated.after - full.after).max() <= tail
        assert (
            truncated.status[STATUS.end] - truncated.status[STATUS.head]
            < full.status[STATUS.end] - full.status[STATUS.head]
        )


# ---- merged lists


@pytest.mark.parametrize("reading, order", [("report", 2.0), ("stretch", 0.5), ("stretch", 2.0)])
@pytest.mark.parametrize("growth", [{}, GROWTH])
def test_exact_joined_strips_of_long_strokes(reading, order, growth):
    """Long strokes in fine steps keep a twentieth of the strips and the forces of all bonds."""
    law = Bonds(1.0, 1.0, order, reading, initial=0.0, **growth)
    path = triangle_path(4.0, 2, 3000)
    full = march_list(law, path, 0.001)
    merged = march_list(law, path, 0.001, 0.02, 1e-9)
    bound = 6.0 if growth and reading == "report" else 1.0
    assert merged.after == pytest.approx(full.after, abs=bound * 0.02**2)
    assert merged.stored == pytest.approx(full.stored, abs=bound * 0.02**2)
    if reading == "stretch":
        assert merged.status[STATUS.max_strips] < 0.05 * full.status[STATUS.max_strips]
