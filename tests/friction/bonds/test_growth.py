"""Growth of new bonds: its path ratio has the limits of eq. 2.10 and does not depend on units."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.friction import BondGrowth, Bonds
from patchfem.friction.bonds.parameters import growth_path_ratio

SPEEDS = st.floats(1e-6, 1e2)


def make_law(metre: float = 1.0, second: float = 1.0, **options) -> Bonds:
    """Return a law whose bonds grow, with its numbers in other units of length and time."""
    return Bonds(
        0.3,
        2e-6 * metre,
        ratio=0.4,
        growth=BondGrowth(3e-3 * metre / second**2, 5e-6 * metre),
        **options,
    )


@given(SPEEDS)
def test_exact_path_ratio_of_constant_bonds_and_of_rest_is_zero(speed):
    """Bonds of constant length do not grow, and at rest there is no path."""
    assert growth_path_ratio(Bonds(0.3, 2e-6), speed) == 0.0
    assert growth_path_ratio(make_law(), 0.0) == 0.0


@given(SPEEDS, st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_exact_path_ratio_has_no_unit(speed, metre, second):
    """The ratio is the same in every unit of length and time."""
    expected = growth_path_ratio(make_law(), speed)
    assert growth_path_ratio(make_law(metre, second), speed * metre / second) == pytest.approx(
        expected, rel=1e-12
    )


@given(SPEEDS)
def test_exact_path_ratio_grows_with_speed_to_that_of_weakening(speed):
    """The ratio rises with the speed from v^2/(a_s eps_0) towards l_k/eps_k, the ratio without healing."""
    law = make_law()
    ratio, faster = (growth_path_ratio(law, factor * speed) for factor in (1.0, 2.0))
    limit = law.growth.slip_growth / (law.ratio * law.length)
    assert 0 < ratio <= faster <= limit * (1 + 1e-12)
    assert growth_path_ratio(law, 1e9) == pytest.approx(limit, rel=1e-9)
    slow = 1e-7 * np.sqrt(law.growth.rest_growth * law.growth.slip_growth)
    assert growth_path_ratio(law, slow) == pytest.approx(
        slow**2 / (law.growth.rest_growth * law.length), rel=1e-9
    )
