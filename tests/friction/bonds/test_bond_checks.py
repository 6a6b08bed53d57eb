"""Numerical consequences of equations 2.8 to 2.21 of the report, compared with closed forms or a second computation.

Lengths are in bond lengths eps_0, forces in mu_s N. Path steps are exact for these laws, so that a
few uneven steps suffice.
"""

import numpy as np
import pytest
from friction_forms import reversal_force, virgin_force
from friction_paths import march_bonds, upper_pressure
from hypothesis import given
from hypothesis import strategies as st

from patchfem.friction import Bonds, growth_numbers
from patchfem.friction.bonds.point_kernels import grow

UNIT_PRESSURE = upper_pressure([1.0])
UNEVEN_PATH = np.array([0.0, 0.02, 0.5, 0.7, 1.0, 1.9, 2.0, 3.3, 4.0])


def unit_bonds(order=1.0, reading="stretch", initial=1.0, **parameters):
    """Return a bond law with unit friction limit and unit bond length."""
    return Bonds(1.0, 1.0, order, reading, initial=initial, **parameters)


def list_tails(order, reading):
    """Return the sums over the bonds of a law: a list of all bonds, and moments (None) if they suffice."""
    return (0.0, None) if reading == "stretch" and order == 1 else (0.0,)


def find_tolerance(reading, tail):
    """Return the error of a sum: that of two Gauss points per strip for a list of the stretch law, else round-off."""
    return 3e-8 if reading == "stretch" and tail is not None else 1e-12


# ---- first loading


@pytest.mark.parametrize(
    "order, reading, initial, expected",
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
def test_exact_virgin_force_agrees_with_closed_form(order, reading, initial, expected):
    """The friction force of a first loading agrees with the closed form, for both directions of sliding."""
    law = unit_bonds(order, reading, initial)
    for tail in list_tails(order, reading):
        for sign in (1, -1):
            run = march_bonds(law, sign * UNEVEN_PATH, UNIT_PRESSURE, tail=tail)
            force = np.append(0.0, sign * run.traction[:, 0])
            assert np.interp([0.5, 1, 2, 4], UNEVEN_PATH, force) == pytest.approx(
                expected, abs=1e-6
            )
            tolerance = find_tolerance(reading, tail)
            expected_force = virgin_force(UNEVEN_PATH, 1.0, order, initial)
            assert force == pytest.approx(expected_force, abs=tolerance)


# ---- reversal


@pytest.mark.parametrize(
    "order, reading, expected",
    [
        (0, "report", [0.637462, 0, -0.5, -0.729329, -0.995042]),
        (1, "stretch", [0.809675, 0.414214, 0, -0.264241, -0.900426]),
    ],
)
def test_exact_reversal_force_after_long_sliding(order, reading, expected):
    """The force after a reversal from steady sliding agrees with the closed form."""
    back = np.array([0.1, np.log(2) / 2, np.log(2), 1, 3])
    path = np.concatenate([np.linspace(0, 40, 9), 40 - back])
    law = unit_bonds(order, reading, 1.0 if reading == "stretch" else 0.0)
    for tail in list_tails(order, reading):
        force = march_bonds(law, path, UNIT_PRESSURE, tail=tail).traction[-5:, 0]
        assert force == pytest.approx(expected, abs=1e-6)
        expected_force = reversal_force(back, 1.0, order, reading)
        assert force == pytest.approx(expected_force, abs=find_tolerance(reading, tail))


# ---- growth of the bond length


def grow_length(law, length, v0, v1, path, time):
    """Return the bond length and the exponent of its growth after a step."""
    return grow(length, v0, v1, path, time, growth_numbers(law))


def test_exact_growth_exponent_during_linear_reversal():
    """The growth exponent of a bond agrees with the integral over a velocity that changes linearly from -0.3 to 0.7."""
    law = unit_bonds(rest_growth=0.3, slip_growth=1e30, rest_speed=0.01)
    rest = grow_length(law, 1.0, 1.0, -1.0, 0.0, 2.0)[1]
    assert np.exp(-rest) == pytest.approx(0.03462767, abs=1e-8)
    rest = grow_length(law, 1.0, -0.3, 0.7, 0.2, 1.0)[1]
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
def test_always_growth_is_independent_of_substeps(
    speed, time, n_substeps, ratio, rest_growth, slip_growth, rest_speed, initial_length
):
    """Bond growth at constant speed is the same in one step and in several substeps, and stays between its bounds."""
    law = unit_bonds(
        ratio=ratio, rest_growth=rest_growth, slip_growth=slip_growth, rest_speed=rest_speed
    )
    single_step = grow_length(law, initial_length, speed, speed, speed * time, time)[0]
    length = initial_length
    for _ in range(n_substeps):
        part = time / n_substeps
        length = grow_length(law, length, speed, speed, speed * part, part)[0]
    assert length == pytest.approx(single_step, rel=1e-12)
    assert min(initial_length, ratio) * (1 - 1e-12) <= single_step <= 1 + 1e-12


def test_exact_steady_bond_length_agrees_with_equation():
    """The bond length at constant speed converges to the steady value of equation 2.11."""
    law = unit_bonds(ratio=0.7, rest_growth=0.4, slip_growth=0.1, rest_speed=1e-6)
    for speed in (0.02, 0.2, 2.0):
        eps = grow_length(law, 1.0, speed, speed, 1e3, 1e3 / speed)[0]
        assert eps == pytest.approx((1 + 0.7 * speed**2 / 0.04) / (1 + speed**2 / 0.04), rel=1e-13)
