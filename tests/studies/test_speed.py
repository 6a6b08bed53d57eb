"""The sentences of the speed studies, on a small mesh always and in full when asked for."""

from __future__ import annotations

import pytest
from study_module import study

STUDY = study("speed/large_pair.py")


@pytest.mark.slow
def test_exact_the_factors_agree_on_the_peak_pressure(capsys):
    one, other = STUDY.main(("fronts", "superlu"), 40, 62)
    assert one["unknowns"] == other["unknowns"] > 4000
    assert one["peak"] == pytest.approx(other["peak"], rel=1e-9) and one["memory"] > 0
    assert capsys.readouterr().out.count("factor") == 2


@pytest.mark.slow
def test_always_a_million_unknowns_within_forty_seconds_and_eight_gigabytes():
    found = STUDY.main(("fronts",))[0]
    assert found["unknowns"] >= 1e6 and found["total"][1] < 40 and found["memory"] < 8


def test_always_lanes_answer_a_hundred_times_the_cases_of_an_integrator_as_well_as_their_bars_say():
    rows = study("speed/cases_per_second.py").main(128, 1, (100, 400), (1e-6,))
    rows = {(one["way"], one["knob"]): one for one in rows}
    lanes, whole = rows["lanes, with bars", "1e-3"], rows["DOP853 with events", "1e-06"]
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
    (one,) = study("speed/cases_per_second.py").families(3, (name,), 1, 0.064)
    assert one["cases"] == count
    assert one["rate"] > least and one["best"] == one["rate"] and one["known"] > 0.9


@pytest.mark.parametrize("axis", study("speed/growth.py").AXES)
def test_always_what_grows_runs_and_is_measured(axis):
    growth = study("speed/growth.py")
    found = growth.once(axis, growth.AXES[axis][2][0])
    assert found["seconds"] > 0 and found["bytes"] > 1000 and found["memory"] > 50
    rows = [
        {"axis": axis, "size": size} | {what: value * size**2 for what, value in found.items()}
        for size in (1, 10)
    ]
    assert (
        growth.exponent(*rows, "seconds") == pytest.approx(2)
        and "| 2.00 |" in growth.lines(rows)[-1]
    )


@pytest.mark.slow
def test_order_of_growth_is_at_most_that_of_the_table():
    """A case, a cycle, a step and an interface cost no more than linearly, a node of a dense pair less than squared."""
    growth = study("speed/growth.py")
    for axis, most in (
        ("cases", 1.1),
        ("cycles", 1.1),
        ("cycles of tanh", 1.1),
        ("steps", 1.2),
        ("elements", 2.2),
    ):
        rows = growth.main(axes=(axis,))
        assert growth.exponent(*rows[-2:], "seconds") < most
