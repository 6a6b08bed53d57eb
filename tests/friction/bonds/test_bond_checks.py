"""The printed consequences of 2.8-2.21, each number known from a closed form or a second computation.

Lengths in eps_0, forces in mu_s N. Path steps are exact for these laws, so few and uneven steps must do.
"""

import numpy as np
import pytest
from friction_forms import reversal_force, virgin_force
from friction_paths import pulled, upper_pressure, walk
from hypothesis import given
from hypothesis import strategies as st

from patchfem.friction import Bonds, FirstOrderBonds, Quadrature
from patchfem.friction.bonds.parameters import grow, growth_exponents

ONE = upper_pressure([1.0])
UNEVEN = np.array([0.0, 0.02, 0.5, 0.7, 1.0, 1.9, 2.0, 3.3, 4.0])


def bonds(order=1.0, reading="stretch", initial=1.0, **more):
    return Bonds(1.0, 1.0, order, reading, initial=initial, **more)


def laws(order, reading, initial):
    law = bonds(order, reading, initial)
    both = [Quadrature(law, tail=0.0)]
    return [*both, FirstOrderBonds(law)] if reading == "stretch" and order == 1 else both


# ---- from rest


@pytest.mark.parametrize(
    "order, reading, initial, want",
    [
        (0, "report", 0, [0.393469, 0.632121, 0.864665, 0.981684]),
        (1, "report", 1, [0.393469, 0.632121, 0.864665, 0.981684]),
        (1, "stretch", 1, [0.393469, 0.632121, 0.864665, 0.981684]),
        (1, "report", 0, [0.090204, 0.264241, 0.593994, 0.908422]),
        (1, "stretch", 0, [0.090204, 0.264241, 0.593994, 0.908422]),
        (2, "report", 1, [0.090204, 0.264241, 0.593994, 0.908422]),
        (2, "stretch", 1, [0.090204, 0.264241, 0.593994, 0.908422]),
        (-0.5, "report", 0, [0.682689, 0.842701, 0.954500, 0.995322]),
    ],
)
def test_exact_virgin_force(order, reading, initial, want):
    for law in laws(order, reading, initial):
        for sign in (1, -1):
            run = walk(law, sign * UNEVEN, ONE)
            force = np.append(0.0, sign * run.traction[:, 0])
            assert np.interp([0.5, 1, 2, 4], UNEVEN, force) == pytest.approx(want, abs=1e-6)
            assert force == pytest.approx(virgin_force(UNEVEN, 1.0, order, initial), abs=1e-8)


# ---- reversal


@pytest.mark.parametrize(
    "order, reading, want",
    [
        (0, "report", [0.637462, 0, -0.5, -0.729329, -0.995042]),
        (1, "stretch", [0.809675, 0.414214, 0, -0.264241, -0.900426]),
    ],
)
def test_exact_reversal_after_a_long_slide(order, reading, want):
    back = np.array([0.1, np.log(2) / 2, np.log(2), 1, 3])
    path = np.concatenate([np.linspace(0, 40, 9), 40 - back])
    for law in laws(order, reading, 1.0 if reading == "stretch" else 0.0):
        force = pulled(law, path, ONE).traction[-5:, 0]
        assert force == pytest.approx(want, abs=1e-6)
        assert force == pytest.approx(reversal_force(back, 1.0, order, reading), abs=1e-12)


# ---- growth of the bond length


def test_exact_healing_integrals():
    """Through a linear reversal with a_s/deceleration = 0.3, v_1/v_h = 100; one step from -0.3 to 0.7."""
    law = bonds(rest_growth=0.3, slip_growth=1e30, rest_speed=0.01)
    rest, slide = growth_exponents(law, 1.0, -1.0, 0.0, 2.0)
    assert slide == 0 and np.exp(-rest) == pytest.approx(0.03462767, abs=1e-8)
    rest, slide = growth_exponents(law, -0.3, 0.7, 0.2, 1.0)
    assert rest == pytest.approx(2.89490779, abs=1e-8)
    times = np.linspace(0, 1, 1_000_001)
    middle = (times[1:] + times[:-1]) / 2
    assert rest == pytest.approx(np.mean(0.3 / np.maximum(abs(-0.3 + middle), 0.01)), rel=1e-9)


@given(
    st.floats(0, 3),
    st.floats(1e-3, 10),
    st.integers(1, 40),
    st.floats(0.1, 1.0),
    st.floats(0.01, 5),
    st.floats(0.01, 5),
    st.floats(1e-4, 1),
    st.floats(0.05, 1),
)
def test_always_growth_at_constant_speed_may_be_split(
    speed, time, parts, ratio, rest, slip, floor, start
):
    law = bonds(ratio=ratio, rest_growth=rest, slip_growth=slip, rest_speed=floor)
    whole = grow(law, start, speed, speed, speed * time, time)
    eps = start
    for _ in range(parts):
        eps = grow(law, eps, speed, speed, speed * time / parts, time / parts)
    assert eps == pytest.approx(whole, rel=1e-12)
    assert min(start, ratio) * (1 - 1e-12) <= whole <= 1 + 1e-12


def test_exact_steady_bond_length_is_2_11():
    law = bonds(ratio=0.7, rest_growth=0.4, slip_growth=0.1, rest_speed=1e-6)
    for speed in (0.02, 0.2, 2.0):
        eps = grow(law, 1.0, speed, speed, 1e3, 1e3 / speed)
        assert eps == pytest.approx((1 + 0.7 * speed**2 / 0.04) / (1 + speed**2 / 0.04), rel=1e-13)
