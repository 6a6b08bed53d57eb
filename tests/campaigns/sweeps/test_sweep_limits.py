"""Limits of a key beyond which a measure changes by more than 5 %, compared with closed forms."""

import numpy as np
import pytest
from sweep_tables import make_table

from patchfem.campaigns.sweeps.changes import find_range
from patchfem.campaigns.sweeps.limits import find_limits

KEY = "contact.tilt.angle"
TILT = np.array([0.05, 0.1, 0.2, 0.5, 1.0])
LINE = 1 + 0.25 * (TILT - 0.05)


def find_limit(values, tilt=TILT, name="loop_area", **more):
    """Return the only limit of a tilt for a measure."""
    (limit,) = find_limits(make_table({KEY: tilt}, {name: values}, **more))
    return limit


def test_exact_limit_of_linear_measure():
    """The measure 1 + 0.25 (t - 0.05) of a tilt t changes by 5 % at t = 0.25, and by 23.75 % in all."""
    tilt = np.linspace(0.05, 0.45, 5)  # spaced evenly, so that it is interpolated linearly
    limit = find_limit(1 + 0.25 * (tilt - 0.05), tilt)
    assert limit.value == pytest.approx(0.25) and (limit.measure, limit.key) == ("loop_area", KEY)
    assert (limit.low, limit.high) == pytest.approx((0.15, 0.25 + 1e-12), abs=0.11)
    assert limit.change == 0.05


def test_exact_limit_of_logarithmic_key():
    """Along a logarithmic key, 1 - 0.02 ln(t/t0) changes by 5 % at t0 e^2.5, and t^0.5 doubles at 4 t0."""
    tilt = np.geomspace(1e-3, 10, 9)
    limit = find_limit(1 - 0.02 * np.log(tilt / 1e-3), tilt)
    assert np.log(limit.value / 1e-3) == pytest.approx(2.5) and limit.change == -0.05
    peak = find_limit((tilt / 1e-3) ** 0.5, tilt, "pressure_peak")
    assert peak.value == pytest.approx(4e-3) and peak.change == 1
    assert np.isnan(find_limit((tilt / 1e-3) ** -0.5, tilt, "pressure_peak").value)


def test_exact_errors_widen_limit():
    """A case counts as within or beyond the limit only if its change exceeds 5 % by less or more than both errors."""
    exact = find_limit(LINE)
    assert (exact.low, exact.high) == (0.2, 0.5)
    # The changes are 1.25, 3.75 and 11.25 %; with errors of 1 % each 3.75 % may be 5 %.
    wide = find_limit(LINE, errors=0.01, tolerance=0.1)
    assert (wide.low, wide.high) == (0.1, 0.5)
    # With errors of 4 % each only the last case, with 23.75 %, is surely beyond.
    assert find_limit(LINE, errors=0.04, tolerance=0.1).high == 1.0


def test_exact_unreached_and_unknown_limits():
    """A limit is never reached if all cases are within it, and unknown if the last ones do not count."""
    constant = find_limit(np.ones(5))
    assert constant.is_never_reached and np.isnan(constant.value) and constant.low == 1.0
    outcome = np.array(["steady"] * 3 + ["transient"] * 2, object)
    unknown = find_limit(LINE, outcome=outcome)
    assert not unknown.is_never_reached and np.isnan(unknown.value) and unknown.low == 0.2
    outcome = np.array(["transient"] + ["steady"] * 4, object)
    assert find_limits(make_table({KEY: TILT}, {"loop_area": LINE}, outcome=outcome)) == []


def test_exact_smallest_limit_over_second_key():
    """With a second key, the limit is the smallest over its values; a driving or random key has none."""
    slopes = np.array([0.1, 0.25, 0.2])
    tilt = np.linspace(0.05, 0.45, 5)
    values = 1 + slopes * (tilt[:, None] - 0.05)
    table = make_table({KEY: tilt, "normal.load": [1.0, 2.0, 3.0]}, {"loop_area": values})
    (limit,) = find_limits(table)
    assert limit.value == pytest.approx(0.25)
    assert find_limits(make_table({"drive.frequency": TILT}, {"loop_area": LINE})) == []
    random = make_table({KEY: TILT}, {"loop_area": LINE}, is_random=True)
    assert find_limits(random) == []


def test_values_that_miss_the_tolerance_count_with_their_errors():
    """A known value of 10 % error counts for the largest change and for a limit; one of 60 % error counts for neither."""
    loop_areas = np.array([1.0, 0.99, 0.5, 0.1])
    keys = {"contact.load": [1.0, 2.0, 3.0, 4.0]}
    errors = np.array([1e-4, 1e-3, 0.05, 0.06])
    table = make_table(keys, {"loop_area": loop_areas}, errors=errors)
    assert find_range(table, "loop_area")[0][1:3] == (2, 0)
    (limit,) = find_limits(table)
    assert limit.low == 2.0 and limit.high == 3.0


def test_grid_whose_first_line_fails_has_the_limits_of_the_other_lines():
    """Lines without a first case are left out; without any, the sweep says so; a driving key leaves its place to another.

    Once a grid had no limits as soon as one of its lines had none, and no reason was given.
    """
    tilt = np.linspace(0.05, 0.45, 5)
    values = np.outer(1 + 0.25 * (tilt - 0.05), np.ones(2))
    values[0, 1] = np.nan
    keys = {KEY: tilt, "normal.load": [1.0, 2.0]}
    (limit,) = find_limits(make_table(keys, {"loop_area": values}))
    assert limit.value == pytest.approx(0.25)
    values[0] = np.nan
    table = make_table(keys, {"loop_area": values})
    assert find_limits(table) == []

    driven = make_table({KEY: tilt[:2], "drive.frequency": TILT}, {"loop_area": np.ones((2, 5))})
    assert [limit.key for limit in find_limits(driven)] == [KEY]
