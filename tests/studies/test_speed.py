"""The speed studies: their statements, from few cases."""

import pytest
from study_module import load_study


@pytest.mark.parametrize(
    "name, count, least",
    [
        ("elastic-plastic", 64, 20),
        pytest.param("static: load x tilt", 128, 20, marks=pytest.mark.slow),
        pytest.param("shipped rig: tilt x friction", 8, 0.5, marks=pytest.mark.slow),
    ],
)
def test_always_sweep_families_reach_rate_and_tolerance(name, count, least):
    """A family of sweeps has the expected number of cases, its minimum rate and its tolerance."""
    (row,) = load_study("speed/cases_per_second.py").families(3, (name,), 1, 0.064)
    assert row["cases"] == count
    assert row["rate"] > least and row["best"] == row["rate"] and row["known"] > 0.9
