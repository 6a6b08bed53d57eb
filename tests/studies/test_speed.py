"""The speed studies: their statements, from few cases."""

import pytest
from study_module import load_study


@pytest.mark.parametrize(
    "name, count",
    [
        ("elastic-plastic", 64),
        pytest.param("static: load x tilt", 128, marks=pytest.mark.slow),
        pytest.param("shipped rig: tilt x friction", 8, marks=pytest.mark.slow),
    ],
)
def test_always_sweep_families_reach_tolerance(name, count):
    """A family of sweeps has the expected number of cases, a rate, and its tolerance in more than 90 % of them."""
    (row,) = load_study("speed/cases_per_second.py").families(3, (name,), 1, 0.064)
    assert row["cases"] == count
    assert row["best"] == row["rate"] > 0 and row["known"] > 0.9
