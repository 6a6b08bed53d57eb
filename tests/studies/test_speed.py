"""The speed studies: their statements, from few cases."""

import pytest
from study_module import load_study


def test_always_cases_together_are_faster_than_dop853_and_cover_their_errors():
    """Cases that are marched together run at more than 30 times the rate of DOP853.

    Few of them lie outside their error estimates.
    """
    rows = load_study("speed/cases_per_second.py").main(128, 1, (100, 400), (1e-6,))
    rows = {(row["way"], row["knob"]): row for row in rows}
    together = rows["together, with bars", "1e-3"]
    dop853 = rows["DOP853 with events", "1e-06"]
    assert together["outside"] <= 4 and together["rms"] < 1e-4 and dop853["median"] < 1e-4
    # ratio of rates; 2000 with 10 000 cases, where the set-up matters less
    assert together["rate"] > 30 * dop853["rate"]
    coarse, fine = (rows["loop of thirty lines", steps]["median"] for steps in ("100", "400"))
    assert fine < coarse / 10 < 1e-4


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
