"""How far a key may go until a measure is off by 5 %: places known from a closed form, and ends that errors widen."""

from math import log

import numpy as np
import pytest
from page_data import own_part
from test_changes import TILT, key

from patchfem.export.pages.allowed import allowed, sentence
from patchfem.export.pages.sweep import page, within

SETTLED = ("steady",)


def found(values, errors=0.0, tilt=TILT, factors=False, **more):
    one = key(tilt) | {"unit": "rad", "log": factors}
    outcome = more.pop("outcome", ["steady"] * len(tilt))
    measures = {"loop_area": (np.array(values, float), np.zeros(len(values)) + errors)}
    return allowed([one], measures, outcome, SETTLED)


def test_exact_a_straight_line_leaves_where_it_is_a_twentieth_off():
    """E = 1 + 0.25 t - 0.0125 of a tilt t [mrad] from 0.05 on: 5 % are reached at t = 0.25."""
    _, (one,) = found(1 + 0.25 * (np.array(TILT) - 0.05))
    assert (one.inside, one.beyond) == (2, 3) and one.value == pytest.approx(0.25)
    assert one.changed == pytest.approx(0.25 * 0.95)
    assert sentence(*found(1 + 0.25 * (np.array(TILT) - 0.05))) == \
        "Within 5 % of their values at 0.05 mrad stay: loop area up to 0.25 mrad."


def test_exact_a_key_of_factors_is_read_along_its_logarithm():
    """E = 1 - 0.02 ln(t/t0) has fallen by 5 % at t0 e^2.5."""
    tilt = np.geomspace(1e-6, 1e-2, 9)
    _, (one,) = found(1 - 0.02 * np.log(tilt / 1e-6), tilt=tilt, factors=True)
    assert log(one.value / 1e-6) == pytest.approx(2.5) and (one.inside, one.beyond) == (2, 3)


def test_exact_errors_widen_the_ends_and_then_no_place_between_is_told():
    """5 % of 1 with the errors of both: 1.04 +- 0.02 is open, 1.09 +- 0.02 is beyond."""
    values = [1, 1.001, 1.04, 1.09, 1.2]
    _, (one,) = found(values, 0.01)
    assert (one.inside, one.beyond) == (1, 3) and np.isnan(one.about)
    assert "up to 0.1 mrad" in sentence(*found(values, 0.01))
    assert (found(values)[1][0].inside, found(values)[1][0].beyond) == (2, 3)


def test_exact_what_never_leaves_or_has_no_first_value_is_not_in_the_sentence():
    assert sentence(*found([1, 1.01, 1.02, 1.03, 0.96])) == ""
    assert found([0, 1, 2, 3, 4])[1] == [] and found([np.nan, 1, 2, 3, 4])[1] == []
    _, (one,) = found([1, 1.01, 1.04, 1.06, 1.2], 0.1)
    assert one.beyond is None and one.inside == 0


def test_exact_cases_that_did_not_settle_are_passed_over():
    """The case at 0.2 mrad did not settle: the place lies somewhere between 0.1 and 0.5."""
    outcome = ["steady", "steady", "grows", "steady", "steady"]
    _, (one,) = found([1, 1.01, 7, 1.2, 1.3], outcome=outcome)
    assert (one.inside, one.beyond) == (1, 3) and np.isnan(one.about)


def test_exact_of_several_lines_the_one_that_allows_least():
    """E = 1 + s (t - 0.05) leaves at 0.05 + 0.05/s: 0.25 and 0.15 for slopes of 0.25 and 0.5."""
    tilt, slope = (grid.ravel() for grid in np.meshgrid(TILT, [0.25, 0.5], indexing="ij"))
    keys = [key(tilt) | {"unit": "rad", "log": False}, key(slope, "normal.load", "N") | {"unit": "N", "log": False}]
    values = 1 + slope * (tilt - 0.05)
    _, (one,) = allowed(keys, {"loop_area": (values, 0 * values)}, ["steady"] * 10, SETTLED)
    assert one.value == pytest.approx(0.15)
    assert allowed(keys, {"loop_area": (values, 0 * values)}, ["steady"] * 10, SETTLED, grid=False) == (None, [])


def test_exact_the_page_tells_it_in_a_sentence_and_a_table():
    values = 1 + 0.25 * (np.array(TILT) - 0.05)
    measures = {name: {"unit": unit, "means": "m", "values": each, "errors": np.zeros(5)}
                for name, unit, each in (("loop_area", "J", values), ("pressure_peak", "Pa", 1e6 * np.array(TILT)),
                                         ("contact_fraction", "1", np.ones(5)))}
    text = own_part(page({"title": "t", "version": "0", "command": "c", "scene": "s", "seconds": 1.0, "grid": True,
                          "keys": [key() | {"unit": "rad", "log": True}], "measures": measures,
                          "outcome": ["steady"] * 5, "messages": {}, "folders": None}))
    assert "Within 5 % of their values at 0.05 mrad stay: " in text and "Change against the first case" in text
    assert "between 0.2 and 0.5 mrad, at about 0.2" in text and "in no case" in text
    assert "&times; 20" in text and "+23.8 %" in text


def test_always_the_sentence_of_a_sweep_without_numbers_is_empty():
    one = key([0, 1], words=True) | {"unit": "1", "log": False, "texts": ["coulomb", "tanh"]}
    assert within([one], {"loop_area": (np.ones(2), np.zeros(2), "J")}, ["steady"] * 2) == ""
