"""Analysis of sweeps: cases that stick but still vibrate freely, large errors, and extremes inside the range of a key."""

from dataclasses import replace

import numpy as np
import pytest
from scene_texts import ELASTIC_JOINT
from sweep_tables import make_table

import patchfem as pf
from patchfem.campaigns.sweeps.changes import analyse
from patchfem.export.sweeps.words import make_verdict

DRIVE = '[drive]\nkind = "force"\nforce = "1 N"\nfrequency = "220 Hz"\ncycles = 100\n'
JOINT = ELASTIC_JOINT + DRIVE


def find_steady_amplitude(force: float, frequency: float) -> float:
    """Return the steady amplitude [m] of the joint while it sticks, a mode of two springs with one damper."""
    omega = 2 * np.pi * frequency
    stiffness = 1.3 * (2 * np.pi * 195) ** 2 + 2e5
    damping = 2 * 0.002 * 2 * np.pi * 195 * 1.3
    return force / abs(stiffness - 1.3 * omega**2 + 1j * omega * damping)


def test_sticking_cases_that_still_vibrate_are_transient():
    """A sticking joint after 100 cycles is transient in a run and in sweeps of both kinds; its steady amplitude is right.

    After 2000 cycles it is stuck.
    """
    one = pf.run(JOINT)
    assert one.outcome == "transient"
    few = pf.sweep(pf.load(JOINT), {"drive.force": ["1 N", "2 N"]})
    many = pf.sweep(pf.load(JOINT), {"drive.force": [f"{1 + k / 100} N" for k in range(80)]})
    for sweep in (few, many):
        assert set(sweep["outcome"].values) == {"transient"}
        values = sweep["relative_displacement_amplitude_steady"].values
        errors = sweep["relative_displacement_amplitude_steady_error"].values
        forces = sweep["drive_force"].values
        true = np.array([find_steady_amplitude(force, 220.0) for force in forces])
        assert (np.abs(values - true) <= errors + 1e-6 * true).all()
    assert pf.run(JOINT, **{"drive.cycles": 2000}).outcome == "stuck"


def test_always_round_off_is_shown_as_zero_and_missed_measures_are_counted():
    """A value of round-off beside large ones is 0, and a sentence says of which measures the tolerance is missed."""
    columns = {
        "slip_amplitude": np.array([3.6e-27, 1e-6, 2e-6]),
        "loop_area": np.array([1.0, 2.0, 3.0]),
    }
    table = make_table({"normal.load": np.arange(1.0, 4.0)}, columns)
    analysis = analyse(table)
    ranges = [row for row in analysis.ranges if row[0] == "slip_amplitude"]
    verdict = make_verdict(table, replace(analysis, ranges=ranges))
    assert "slip amplitude changes most: from 0 at 1 to" in verdict[0]

    missed = {"slip_amplitude": {"count": 2, "worst": 1.0}, "loop_area": {"count": 1, "worst": 1.0}}
    over = replace(analysis, cases=analysis.cases | {"over_tolerance": missed})
    text = "2 over the tolerance in slip amplitude (1 other measure also above it in some cases)"
    assert text in make_verdict(table, over)[-1]


def test_exact_values_that_miss_the_tolerance_carry_their_error():
    """The ends of a range and an extreme inside it are stated with their error where it exceeds the tolerance."""
    errors = np.array([1e-9, 1e-9, 0.2, 1e-9, 0.03])
    values = [1.0, 2.0, 4.0, 3.0, 0.5]
    table = make_table(
        {"normal.load": np.arange(1.0, 6.0)}, {"slip_amplitude": values}, errors=errors
    )
    (text, *_) = make_verdict(table, analyse(table))
    assert "from 0.500 ± 0.030 at 5 to 4.00 ± 0.20 at 3" in text
    exact = make_table({"normal.load": np.arange(1.0, 6.0)}, {"slip_amplitude": values})
    assert "from 0.5 at 5 to 4 at 3" in make_verdict(exact, analyse(exact))[0]


def test_exact_peak_over_frequency_is_stated_once():
    """A resonance over the drive frequency has its own sentence, and the range states no second estimate of it."""
    frequency = np.linspace(90.0, 110.0, 21)
    values = 1 / np.abs(1 - (frequency / 100.3) ** 2 + 0.04j)
    table = make_table(
        {"drive.frequency": frequency}, {"relative_displacement_amplitude": values}, unit="Hz"
    )
    analysis = analyse(table)
    assert analysis.peaks and analysis.extremes
    verdict = make_verdict(table, analysis)
    assert "(largest" not in verdict[0] and "peaks at 100." in verdict[1]


def test_exact_single_settled_case_has_no_range():
    """A sweep of which one case settled states no range and no limit, also of a measure that only unsettled cases have."""
    outcome = np.array(["steady", "transient", "transient", "transient"], object)
    columns = {
        "loop_area": np.array([np.nan, 1.0, 2.0, 3.0]),
        "slip_amplitude": np.arange(1.0, 5.0),
    }
    table = make_table({"normal.load": np.arange(1.0, 5.0)}, columns, outcome=outcome)
    analysis = analyse(table)
    assert analysis.ranges == analysis.limits == []
    verdict = make_verdict(table, analysis)
    assert verdict[0] == "Only one of 4 cases settled, so that no change is known."
    table.outcome[:] = "steady"
    assert (
        "slip amplitude changes most: from 1 at 1 to 4 at 4"
        in make_verdict(table, analyse(table))[0]
    )


def test_exact_steady_estimate_of_an_unsettled_case_counts():
    """An unsettled case counts with its steady estimate and error, unless the error is above half of it."""
    outcome = np.array(["steady", "transient", "transient", "transient"], object)
    steady = np.array([np.nan, 4.0, 2.0, 99.0])
    columns = {"slip_amplitude": np.arange(1.0, 5.0), "slip_amplitude_steady": steady}
    table = make_table({"normal.load": np.arange(1.0, 5.0)}, columns, outcome=outcome, errors=0.01)
    table.measures["slip_amplitude_steady"].errors[3] = 60.0
    assert np.array_equal(table.select_trusted("slip_amplitude").values, [1, 4, 2, np.nan], True)
    verdict = make_verdict(table, analyse(table))
    assert (
        "slip amplitude changes most: from 1.000 ± 0.010 at 1 to 4.000 ± 0.010 at 2" in verdict[0]
    )
    assert "3 unsettled (of which 2 with a steady estimate that counts)" in verdict[-1]

    # the largest amplitude of a case that does not count is not left unsaid
    columns = {f"relative_displacement_{name[5:]}": one for name, one in columns.items()}
    columns["relative_displacement_amplitude"][3] = 7.0
    table = make_table({"normal.load": np.arange(1.0, 5.0)}, columns, outcome=outcome, errors=0.01)
    table.measures["relative_displacement_amplitude_steady"].errors[3] = 60.0
    words = "; the relative displacement amplitude of the others is up to 7 at the end)"
    assert words in make_verdict(table, analyse(table))[-1]


# ---- extremes inside the range of a key


def find_extremes(x, y, errors=0.0):
    """Return the extremes of two main measures with values y over a load x; the second one is their negative."""
    columns = {"loop_area": y, "relative_displacement_amplitude": -np.asarray(y)}
    analysis = analyse(make_table({"normal.load": x}, columns, errors=errors))
    return {one.measure: one for one in analysis.extremes}


def test_exact_parabola_has_its_vertex_and_band():
    """A parabola has its vertex to round-off; its band ends where linear interpolation leaves 5 % of the value."""
    x = np.linspace(0.0, 10.0, 21)
    found = find_extremes(x, 100.0 - 4.0 * (x - 4.2) ** 2)
    for name, sign in (("loop_area", 1), ("relative_displacement_amplitude", -1)):
        one = found[name]
        assert one.is_largest == (sign > 0) and one.place == pytest.approx(4.2, rel=1e-12)
        assert one.value == pytest.approx(sign * 100.0, rel=1e-12)
        assert one.interval == pytest.approx((4.2, 4.2), rel=1e-9)
        ends = np.array([4.2 - 1.25**0.5, 4.2 + 1.25**0.5])
        assert np.abs(np.array(one.band) - ends).max() < 0.03


def test_always_interval_contains_the_extreme():
    """Of 400 smooth curves with errors, at least 95 % have place and value inside interval and error, over either key."""
    rng = np.random.default_rng(104)
    n_found = 0
    n_held = 0
    has_value = []
    for _ in range(400):
        n = int(rng.integers(5, 40))
        u = np.linspace(-1, 1, n)
        top, skew, width = rng.uniform(-0.6, 0.6), rng.uniform(-0.4, 0.4), rng.uniform(0.3, 2.0)
        is_log = rng.random() < 0.5
        to_key = (lambda u: 10.0**u) if is_log else (lambda u: 3.0 + u)
        true = 1 / (1 + ((u - top) / width) ** 2 * (1 + skew * (u - top)))
        error = 10.0 ** rng.uniform(-6, -2.5)
        noisy = true + error * rng.uniform(-1, 1, n)
        one = find_extremes(to_key(u), noisy, errors=error).get("loop_area")
        if one is not None and one.is_largest:
            n_found += 1
            n_held += one.interval[0] <= to_key(top) <= one.interval[1]
            if one.band is not None:
                assert one.band[0] <= one.place <= one.band[1]
                has_value.append(abs(one.value - 1) <= one.error)
    assert n_found > 300 and n_held >= 0.95 * n_found
    assert len(has_value) > 250 and np.mean(has_value) >= 0.95


@pytest.mark.parametrize(
    "y", [[1, 2, 3, 4], [4, 2, 1, 0], [1, 1 + 1e-6, 1], [1, 2], [1, np.nan, 1]]
)
def test_exact_monotonic_measures_have_no_extreme(y):
    """A measure that rises or falls within its errors, or has fewer than three values, has no extreme."""
    assert find_extremes(np.arange(1.0, len(y) + 1), np.array(y, float), errors=1e-6) == {}


def test_exact_minimum_between_distant_cases_has_no_value_but_its_neighbours():
    """A parabola through amplitudes of 2.36, .147 and .275 mm has a negative minimum, which no amplitude has."""
    loads = np.geomspace(10.0, 1e4, 9)
    amplitudes = np.array([4.95, 4.66, 3.98, 2.36, 0.147, 0.275, 0.627, 1.39, 3.28])
    table = make_table({"normal.load": loads}, {"relative_displacement_amplitude": amplitudes})
    (one,) = analyse(table).extremes
    assert (one.value, one.place, one.band) == (0.147, pytest.approx(loads[4]), None)
    assert one.interval == pytest.approx((loads[3], loads[5]))
    words = "(the smallest lies between 133.4 and 749.9, where more cases are needed)"
    assert words in make_verdict(table, analyse(table))[0]


def test_exact_first_sentence_names_each_main_measure():
    """The first sentence names the range of each main measure, and its extreme with interval and band."""
    x = np.linspace(1.0, 5.0, 9)
    columns = {
        "loop_area": 10 - (x - 3.1) ** 2,
        "relative_displacement_amplitude": x,
        "absolute_acceleration_peak": np.full(9, 2.0),
    }
    table = make_table({"normal.load": x}, columns, errors=9e-4)
    sentence = make_verdict(table, analyse(table))[0]
    assert sentence.startswith(
        "With normal.load, relative displacement amplitude changes most: from 1 at 1 to 5 at 5; "
    )
    words = "loop area from 5.59 at 1 to 9.99 at 3 (largest, 10.000 ± 0.021, at 3.1, 3.09"
    assert words in sentence
    assert "; within 5 % of it from 2.4" in sentence and " to 3.76" in sentence
    assert sentence.endswith("; absolute acceleration peak by no more than its error.")


def test_exact_first_sentence_of_response_curves_begins_with_their_height():
    """With peaks of response curves the displacement amplitude comes first, even if another measure changes more."""
    x = np.linspace(1.0, 5.0, 9)
    columns = {
        "friction_force_peak": 100 * x,
        "relative_displacement_amplitude": 10 + x,
        "peak_frequency": np.full(9, 2.0),
    }
    table = make_table({"normal.load": x}, columns, errors=1e-3)
    sentence = make_verdict(table, analyse(table))[0]
    assert sentence.startswith("With normal.load, relative displacement amplitude changes: from 11")
