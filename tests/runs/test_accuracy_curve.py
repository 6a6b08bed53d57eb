"""The curve of accuracy against computing time of a run by time integration agrees with the exact
solution."""

from dataclasses import replace
from itertools import pairwise

import pytest
from scene_texts import PLASTIC, POINT, SHORT

import patchfem as pf
from patchfem.runs import compute_accuracy_curve

BLOCK = POINT + PLASTIC + SHORT
MARCH = {"accuracy.method": "march"}
MAIN_MEASURES = ("relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area")


@pytest.fixture(scope="module")
def marched_result():
    """Return the result of the scene by time integration with 1600 steps per cycle."""
    return pf.run(BLOCK, **MARCH, **{"accuracy.steps_per_cycle": 1600})


def worst_true_error(steps: int, exact) -> float:
    """Return the largest true relative error of the main measures with some steps per cycle."""
    measures = pf.run(BLOCK, **MARCH, **{"accuracy.steps_per_cycle": steps}).measures
    return max(abs(measures[name].value / exact[name].value - 1) for name in MAIN_MEASURES)


def test_always_errors_of_curve_cover_true_errors(marched_result):
    """The errors on the curve cover the true errors and are at most ten times larger; each doubling
    of the steps has a smaller error and takes twice the time."""
    exact = pf.run(BLOCK, **{"accuracy.method": "exact"}).measures
    curve = compute_accuracy_curve(marched_result)
    assert marched_result.plot.accuracy()
    assert [setting.steps for setting in curve] == [400, 800, 1600]
    for setting in curve:
        true_error = worst_true_error(setting.steps, exact)
        assert true_error <= setting.error <= 10 * true_error, setting
    for cheaper, better in pairwise(curve):
        assert better.error < cheaper.error and better.seconds == 2 * cheaper.seconds


@pytest.mark.parametrize("scene", [BLOCK, pf.new("patch")], ids=["exact", "patch"])
def test_refuses_curve_if_steps_do_not_limit_accuracy(scene):
    """Runs whose error does not depend on time steps have no accuracy curve."""
    result = pf.run(scene)
    assert not compute_accuracy_curve(result)
    with pytest.raises(pf.PatchfemError, match=r"plot\.accuracy: nothing to draw"):
        result.plot.accuracy()


def test_exact_error_at_tolerance_is_the_tolerance_on_the_curve(marched_result):
    """A measure whose error is the tolerance times its value plus its floor has the tolerance as its error on the curve."""
    tolerance = marched_result.plan.model.accuracy.tolerance
    measures = {}
    for name, measure in marched_result.measures.items():
        if measure.value is not None and measure.error is not None:
            floor = 3 * tolerance * abs(measure.value)
            error = tolerance * abs(measure.value) + floor
            measure = replace(measure, floor=floor, error=error)
        measures[name] = measure
    curve = compute_accuracy_curve(replace(marched_result, measures=measures))
    assert curve[2].error == pytest.approx(tolerance, rel=1e-12)
