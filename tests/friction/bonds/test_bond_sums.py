"""Sums over bonds (2.17) by recursion and by lists, against explicit sums over all bonds and closed forms.

Lengths are in bond lengths eps_0, forces in mu_s N.
"""

import numpy as np
import pytest
from friction_forms import virgin_force
from friction_paths import (
    LowerPressure,
    PathHistory,
    march_bonds,
    random_walk,
    reference_energy,
    reference_traction,
    reference_with_lift_off,
    triangle_path,
    upper_pressure,
)

from patchfem.friction import BondGrowth, Bonds

UNIT_PRESSURE = upper_pressure([1.0])
GROWTH = {"ratio": 0.6, "growth": BondGrowth(0.3, 0.4, 1e-2)}
YOUNG = {"ratio": 0.5, "growth": BondGrowth(0.1, 0.2, 1e-2)}
X = np.linspace(-30, 30, 31)
WAVES = LowerPressure(X, 1.5 + np.sin(2 * np.pi * X / 7))
# Places that lose their contact again and again
BARE = LowerPressure(X, np.maximum(np.sin(2 * np.pi * X / 7) + 0.2, 0.0))

WALK = random_walk(3, 40, 0.7)
# A walk that rests, also after a step of thirty bond lengths
RESTS = np.concatenate([WALK, WALK[-1] + np.array([0, 0.2, 0.4, 30, 30])])
# Reversals, after which the stretch of a bond vanishes inside a strip
TURNS = np.concatenate([triangle_path(1.5, 3, 13), [-1.43, -0.77, 4.0, 3.3, 3.9]]) + 1.5
SINE = 1.5 * np.sin(2 * np.pi * np.arange(276) / 200)
DWELL = np.concatenate([np.linspace(0, 2, 41), [2.0, 2.05]])

# Reading, order, initial bonds, growth, path, times of its steps, pressure, tail (None: recursion), tolerance.
SUMS = [
    ("report", 0.0, 0.0, {}, RESTS, 1.0, UNIT_PRESSURE, 0.0, 1e-12),
    ("report", 2.0, 1.0, {}, RESTS, 1.0, UNIT_PRESSURE, 0.0, 1e-12),
    ("report", 3.7, 1.0, {}, RESTS, 1.0, UNIT_PRESSURE, 0.0, 1e-8),
    ("stretch", 0.0, 1.0, {}, TURNS, 0.4, UNIT_PRESSURE, 0.0, 2e-6),
    ("stretch", 0.25, 1.0, GROWTH, TURNS, 0.4, UNIT_PRESSURE, 0.0, 1e-4),
    ("stretch", 3.0, 1.0, GROWTH, TURNS, 0.4, UNIT_PRESSURE, 0.0, 1e-6),
    ("report", -0.5, 0.0, GROWTH, 0.4 * WALK, 0.4, UNIT_PRESSURE, 0.0, 1e-4),
    ("report", 1.0, 1.0, GROWTH, 0.4 * WALK, 0.4, UNIT_PRESSURE, 0.0, 1e-5),
    # A quadrature made for a power of the path was wrong by up to 2e-4 for bonds that have just formed.
    ("report", -0.9, 0.0, GROWTH, SINE, 2 * np.pi / 200, UNIT_PRESSURE, 0.0, 2e-6),
    # A dwell lengthens only the bonds that exist.
    ("report", 1.0, 0.0, YOUNG, DWELL, np.append(np.full(40, 0.5), [1.0, 0.5]), UNIT_PRESSURE, 0.0, 2e-4),
    ("report", 2.0, 0.5, {}, WALK, 1.0, WAVES, 0.0, 1e-12),
    ("stretch", 1.0, 0.5, {}, WALK, 1.0, WAVES, 0.0, 3e-8),
    ("stretch", 1.0, 0.5, {}, WALK, 0.4, BARE, None, 1e-9),
    ("stretch", 1.0, 0.8, GROWTH, WALK, 0.4, upper_pressure(1 + 0.5 * np.cos(X)), None, 1e-9),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(SUMS)))
def test_exact_traction_agrees_with_explicit_sum(number):
    """The tractions along a path are those of an explicit sum over all bonds, at every stage of the path."""
    reading, order, initial, growth, path, times, pressure, tail, tolerance = SUMS[number]
    law = Bonds(1.0, 1.0, order, reading, initial=initial, **growth)
    run = march_bonds(law, path, pressure, times, tail)
    sum_bonds = reference_traction if pressure is not BARE else reference_with_lift_off
    # The outermost points of a pressure on the lower piece leave it on the way.
    inner = slice(2, -2) if isinstance(pressure, LowerPressure) else slice(None)
    steps = np.broadcast_to(times, path.size - 1)
    for k in np.linspace(3, path.size - 1, 6).astype(int):
        expected = sum_bonds(law, path[: k + 1], pressure, steps[:k])
        assert run.traction[k - 1, inner] == pytest.approx(expected[inner], abs=tolerance)
    if pressure is UNIT_PRESSURE and path is not DWELL:
        energy = reference_energy(law, path, steps)
        if not initial:
            assert run.stored[-1] == pytest.approx(energy, abs=1e-3 if order < 0 else 3e-5)


@pytest.mark.parametrize("growth", [{}, GROWTH])
@pytest.mark.parametrize("pressure", [BARE, upper_pressure(1 + 0.5 * np.cos(X))])
def test_exact_recursion_equals_sum_over_bonds(pressure, growth):
    """The recursion has the tractions, means and energies of the list of all bonds, on random steps of all sizes."""
    rng = np.random.default_rng(2)
    steps = rng.normal(0, 1, 120) * 10.0 ** rng.uniform(-3, 0.7, 120)
    steps[rng.integers(0, 120, 10)] = 0.0
    path = np.concatenate([[0], np.cumsum(steps)])
    times = rng.uniform(0.01, 1, 120)
    law = Bonds(0.4, 1.0, initial=0.8, **growth)
    recursion, summed = (march_bonds(law, path, pressure, times, tail) for tail in (None, 0.0))
    assert recursion.traction == pytest.approx(summed.traction, abs=2e-7)
    # These are sums over the points.
    for name in PathHistory._fields[1:]:
        tolerance = 3e-7 * np.sqrt(X.size)
        assert getattr(recursion, name) == pytest.approx(getattr(summed, name), abs=tolerance), name


def test_exact_step_mean_equals_average_along_step():
    """The mean traction of a step agrees with Gauss quadrature over partial steps whose bonds are summed by hand."""
    law = Bonds(1.0, 1.0)
    path = np.array([0.0, 0.8, -0.5, 0.1, 2.0])
    run = march_bonds(law, path, UNIT_PRESSURE, 0.5)
    y, w = np.polynomial.legendre.leggauss(10)
    for k in range(1, 5):
        ends = path[k - 1] + (path[k] - path[k - 1]) * (1 + y) / 2
        parts = [
            reference_traction(law, np.append(path[:k], end), UNIT_PRESSURE, 0.5) for end in ends
        ]
        assert run.mean[k - 1] == pytest.approx((w / 2 @ np.array(parts)).sum(), abs=1e-9)


# ---- closed forms


@pytest.mark.parametrize(
    "order, reading, initial, expected",
    [
        (0, "report", 0, [0.393469, 0.632121, 0.864665, 0.981684]),
        (1, "stretch", 1, [0.393469, 0.632121, 0.864665, 0.981684]),
        (1, "report", 0, [0.090204, 0.264241, 0.593994, 0.908422]),
        (2, "stretch", 1, [0.090204, 0.264241, 0.593994, 0.908422]),
        (-0.5, "report", 0, [0.682689, 0.842701, 0.954500, 0.995322]),
    ],
)
def test_exact_virgin_force_agrees_with_closed_form(order, reading, initial, expected):
    """The friction force of a first loading agrees with the closed form, for both directions of sliding."""
    law = Bonds(1.0, 1.0, order, reading, initial=initial)
    path = np.array([0.0, 0.02, 0.5, 0.7, 1.0, 1.9, 2.0, 3.3, 4.0])
    for tail in (0.0, None) if (reading, order) == ("stretch", 1) else (0.0,):
        for sign in (1, -1):
            force = sign * march_bonds(law, sign * path, UNIT_PRESSURE, tail=tail).traction[:, 0]
            assert force[[1, 3, 5, 7]] == pytest.approx(expected, abs=1e-6)
            tolerance = 3e-8 if reading == "stretch" and tail is not None else 1e-12
            assert force == pytest.approx(
                virgin_force(path, 1.0, order, initial)[1:], abs=tolerance
            )


@pytest.mark.parametrize("order, options", [(0, (0.0, 0.0)), (1, (1e-9, 0.01))])
def test_exact_loaded_bonds_heal_at_rest(order, options):
    """The force of loaded bonds at rest is 0.5, then 0.81606 and 0.93233 after one and two growth times (check C8)."""
    law = Bonds(1.0, 1.0, order, "report", 0.5, BondGrowth(10.0, 1e-3, 1.0), 0.0)
    path = np.append(40 - np.geomspace(40, 1e-5, 1500), [40 - 1e-5] * 2)
    times = np.append(np.full(1499, 1e-9), [0.1, 0.1])
    force = march_bonds(law, path, UNIT_PRESSURE, times, *options).traction[-3:, 0]
    assert force == pytest.approx([0.5, 0.81606, 0.93233], abs=1e-3 if order == 0 else 1e-4)


# ---- properties


@pytest.mark.parametrize(
    "reading, order, growth",
    [("report", 0.0, GROWTH), ("stretch", 2.0, {}), ("stretch", 1.0, GROWTH)],
)
def test_always_truncation_error_is_below_tail(reading, order, growth):
    """The truncated list differs from the full list by at most its tail."""
    law = Bonds(1.0, 1.0, order, reading, initial=0.0, **growth)
    path = random_walk(9, 300, 0.6)
    full = march_bonds(law, path, UNIT_PRESSURE, 0.5, 0.0).traction
    for tail in (1e-2, 1e-5):
        truncated = march_bonds(law, path, UNIT_PRESSURE, 0.5, tail).traction
        assert 0 < np.abs(truncated - full).max() <= tail


@pytest.mark.parametrize(
    "reading, order, tail, growth",
    [
        ("stretch", 1.0, None, {}), ("stretch", 1.0, None, GROWTH), ("stretch", 1.0, 1e-9, GROWTH),
        ("stretch", 2.0, 1e-9, {}), ("report", -0.5, 1e-9, {}), ("report", 0.0, 1e-9, {}),
    ],
)  # fmt: skip
def test_exact_huge_steps_reach_steady_sliding(reading, order, tail, growth):
    """Steps of a million bond lengths reach steady sliding, and a rest after them changes a force only by healing."""
    law = Bonds(0.3, 1.0, order, reading, **growth)
    path = np.array([0.0, 0.0, 1e6, -1e6, -1e6, -1e6 + 1e-9])
    run = march_bonds(law, path, upper_pressure([1.0, 0.25]), 1.0, tail)
    assert all(np.isfinite(values).all() for values in run)
    assert not run.traction[0].any()
    limit = 0.3 * np.array([1.0, 0.25]) * (0.6 if growth else 1.0)
    assert run.traction[1] == pytest.approx(limit, rel=1e-4)
    assert run.traction[2] == pytest.approx(-limit, rel=1e-4)
    assert run.mean[2] == pytest.approx(-limit.sum(), rel=1e-4)
    if reading == "stretch" or not growth:
        assert run.traction[3] == pytest.approx(run.traction[2], rel=1e-12)
