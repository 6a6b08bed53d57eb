"""Cases that miss their tolerance, compared with the rule evaluated by hand."""

import numpy as np
import pytest
from page_data import make_sweep_key, make_sweep_table

from patchfem.export import summarise_sweep
from patchfem.export.tolerance_misses import (
    count_over_tolerance,
    is_over_tolerance,
    is_within_by_floor,
    tolerance_sentence,
)

NAN = np.nan


def make_measure(values, errors, floors=0.0) -> dict:
    """Return a measure with its values, errors and floors."""
    return {"values": np.array(values, float), "errors": np.array(errors, float), "floors": floors}


def test_exact_case_misses_tolerance_and_floor():
    """A case misses its tolerance if its error exceeds tolerance times value plus floor."""
    measure = make_measure(
        [1, -1, 0, 0, NAN, 2],
        [0.011, 0.009, 1e-9, 1e-3, 0.1, NAN],
        np.array([0, 0, 1e-6, 1e-6, 0, NAN]),
    )
    assert is_over_tolerance(measure, 0.01).tolist() == [True, False, False, True, False, False]
    assert is_over_tolerance(measure, NAN).sum() == 0
    assert (
        is_over_tolerance(measure, np.full(6, 0.02)).tolist() == [False] * 3 + [True] + [False] * 2
    )
    assert count_over_tolerance({"a": measure, "b": make_measure([1], [0])}, 0.01) == {
        "a": {"count": 2, "worst": pytest.approx(0.011)}
    }
    assert count_over_tolerance({"a": make_measure([0, 0], [1, 0])}, 0.01) == {
        "a": {"count": 1, "worst": None}
    }


def test_exact_largest_relative_error_is_named():
    """The sentence names the largest relative error with its case, not the largest absolute error."""
    loop = make_measure([2e-7, 5e-6, 0.19], [4.4e-7, 5e-7, 2e-5])
    case_label = ["slide.amplitude 0.05 um", "", ""].__getitem__
    assert tolerance_sentence({"loop_area": loop}, 0.01, case_label) == (
        "2 of 3 cases miss the tolerance of 1 % in loop area; the largest error, at slide.amplitude 0.05 um, is 220 "
        "% of its value."
    )
    measures = {
        "loop_area": loop,
        "moment": make_measure([1, 1, 1], [9, 9, 9]),
        "rotation": make_measure([1] * 3, [0, 0, 1]),
    }
    assert tolerance_sentence(measures, 0.01, case_label).endswith(
        "220 % of its value; 2 other measures miss the tolerance in some cases."
    )
    near_zero = {
        "energy": make_measure([1e-15, 1, 1], [1e-11, 0, 0], 1e-12),
        "moment": make_measure([1, 1, 1], [0.5, 0, 0]),
    }
    # the energy is zero within its floor, so its error of 10 times the floor is not the largest
    assert "in moment; the largest error, at slide.amplitude 0.05 um, is 50" in tolerance_sentence(
        near_zero, 0.01, case_label
    )
    assert tolerance_sentence({"energy": near_zero["energy"]}, 0.01, case_label).endswith(
        "0.05 um, is larger than the value."
    )
    assert (
        tolerance_sentence(
            {"loop_area": make_measure([1, NAN, 1], [1e-3, NAN, 0])}, 0.01, case_label
        )
        == "2 of 3 cases have an answer; all of these meet the tolerance of 1 %."
    )
    assert tolerance_sentence({"loop_area": loop}, NAN, case_label) == ""


def test_exact_sentence_states_floor_if_decisive():
    """If cases meet the tolerance only by the floor of a measure, the sentence states the floor.

    A loop of 0.16 nJ with an error of 60 % meets a tolerance of 0.1 % by the floor of 0.1 nJ.
    """
    loop = make_measure([1.6e-10, 1e-3], [0.96e-10, 1e-7], 1e-10) | {"unit": "J"}
    assert is_within_by_floor(loop, 1e-3).tolist() == [True, False]
    assert tolerance_sentence({"loop_area": loop}, 1e-3, str) == (
        "All 2 cases meet the tolerance of 0.1 % or the floor of their "
        "measure, such as 0.1 nJ of loop area."
    )
    keys = [make_sweep_key("slide.amplitude", [1e-7, 1e-6], "m", ["0.1 um", "1 um"], log=True)]
    table = make_sweep_table(keys, {"loop_area": loop | {"means": ""}}, outcome=["done"] * 2)
    table["tolerance"] = 1e-3
    assert summarise_sweep(table).texts.span == (
        "Loop area ranges from 0.16 nJ (slide.amplitude 0.1 um) to 1 mJ (slide.amplitude 1 um), with errors of at most "
        "0.01 % or 0.1 nJ, the floor of this measure."
    )
