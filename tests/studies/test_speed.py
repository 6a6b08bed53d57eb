"""The sentences of the speed studies, from few cases."""

import pytest
from study_module import load_study


def test_always_lanes_answer_a_hundred_times_the_cases_of_an_integrator_as_well_as_their_bars_say():
    rows = load_study("speed/cases_per_second.py").main(128, 1, (100, 400), (1e-6,))
    rows = {(one["way"], one["knob"]): one for one in rows}
    lanes = rows["lanes, with bars", "1e-3"]
    whole = rows["DOP853 with events", "1e-06"]
    assert lanes["outside"] <= 4 and lanes["rms"] < 1e-4 and whole["median"] < 1e-4
    # 2000 times in a run of 10 000: here the set-up counts
    assert lanes["rate"] > 30 * whole["rate"]
    coarse, fine = (rows["loop of thirty lines", steps]["median"] for steps in ("100", "400"))
    assert fine < coarse / 10 < 1e-4


@pytest.mark.parametrize(
    "name, count, least",
    [
        ("elastic-plastic", 64, 20),
        ("static: load x tilt", 128, 20),
        pytest.param("shipped rig: tilt x friction", 8, 0.5, marks=pytest.mark.slow),
    ],
)
def test_always_a_family_of_sweeps_is_measured_and_meets_its_tolerance(name, count, least):
    (one,) = load_study("speed/cases_per_second.py").families(3, (name,), 1, 0.064)
    assert one["cases"] == count
    assert one["rate"] > least and one["best"] == one["rate"] and one["known"] > 0.9
