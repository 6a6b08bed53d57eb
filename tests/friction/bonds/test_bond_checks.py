"""Growth of the bond length (equations 2.10 and 2.11) in units of the bond length eps_0."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.friction import BondGrowth, Bonds, growth_numbers
from patchfem.friction.bonds.point_kernels import grow


def unit_bonds(**parameters):
    """Return a bond law with unit friction limit and unit bond length."""
    return Bonds(1.0, 1.0, **parameters)


def grow_length(law, length, v0, v1, path, time):
    """Return the bond length and the exponent of its growth after a step."""
    return grow(length, v0, v1, path, time, growth_numbers(law))


def test_exact_growth_exponent_during_linear_reversal():
    """The growth exponent of a bond agrees with the integral over a velocity that changes linearly from -0.3 to 0.7."""
    law = unit_bonds(growth=BondGrowth(0.3, 1e30, 0.01))
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
    law = unit_bonds(ratio=ratio, growth=BondGrowth(rest_growth, slip_growth, rest_speed))
    single_step = grow_length(law, initial_length, speed, speed, speed * time, time)[0]
    length = initial_length
    for _ in range(n_substeps):
        part = time / n_substeps
        length = grow_length(law, length, speed, speed, speed * part, part)[0]
    assert length == pytest.approx(single_step, rel=1e-12)
    assert min(initial_length, ratio) * (1 - 1e-12) <= single_step <= 1 + 1e-12


def test_exact_steady_bond_length_agrees_with_equation():
    """The bond length at constant speed converges to the steady value of equation 2.11."""
    law = unit_bonds(ratio=0.7, growth=BondGrowth(0.4, 0.1, 1e-6))
    for speed in (0.02, 0.2, 2.0):
        eps = grow_length(law, 1.0, speed, speed, 1e3, 1e3 / speed)[0]
        assert eps == pytest.approx((1 + 0.7 * speed**2 / 0.04) / (1 + speed**2 / 0.04), rel=1e-13)
