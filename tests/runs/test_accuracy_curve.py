"""The curve of accuracy against computing time of a run by time integration agrees with the exact
solution."""

import re
from itertools import pairwise
from types import SimpleNamespace as Fake

import pytest

import patchfem as pf
from patchfem.core import ErrorCauses
from patchfem.export.drawing.accuracy import accuracy_caption
from patchfem.runs import compute_accuracy_curve

BLOCK = """
[normal]
load = "26 lbf"
[friction]
law = "elastic-plastic"
static = 0.3
bond_length = "1 um"
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 60
"""
MARCH = {"accuracy.method": "march"}
MAIN_MEASURES = ("relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area")


@pytest.fixture(scope="module")
def marched_result():
    """Return the result of the scene by time integration."""
    return pf.run(BLOCK, **MARCH)


def worst_true_error(steps: int, exact) -> float:
    """Return the largest true relative error of the main measures with some steps per cycle."""
    measures = pf.run(BLOCK, **MARCH, **{"accuracy.steps_per_cycle": steps}).measures
    return max(abs(measures[name].value / exact[name].value - 1) for name in MAIN_MEASURES)


def test_always_errors_of_curve_cover_true_errors(marched_result):
    """The errors on the curve cover the true errors and are at most ten times larger; each doubling
    of the steps has a smaller error and takes twice the time."""
    exact = pf.run(BLOCK, **{"accuracy.method": "exact"}).measures
    curve = compute_accuracy_curve(marched_result)
    settings = [*curve.coarser[::-1], curve.present, curve.finer]
    assert [setting.steps for setting in settings] == [400, 800, 1600, 3200]
    for setting in settings:
        true_error = worst_true_error(setting.steps, exact)
        assert true_error <= setting.error <= 10 * true_error, setting
    for cheaper, better in pairwise(settings):
        assert better.error < cheaper.error and better.seconds == 2 * cheaper.seconds


def test_exact_present_point_has_stated_error_and_step_time(marched_result):
    """The point of the present run has the largest stated error of the main measures and the
    computing time of its steps."""
    present = compute_accuracy_curve(marched_result).present
    measures = marched_result.measures
    tolerance = marched_result.plan.model.accuracy.tolerance
    worst = max(
        measures[name].error / (abs(measures[name].value) + measures[name].floor / tolerance)
        for name in MAIN_MEASURES
    )
    assert present.error == pytest.approx(worst, rel=1e-12) and present.measure in MAIN_MEASURES
    assert 0 < present.seconds < marched_result.seconds["total"]
    step_runs = marched_result.extra["step_runs"]
    assert present.steps == step_runs[0].steps
    assert present.seconds / present.steps == pytest.approx(
        min(run.seconds / run.steps for run in step_runs), rel=1e-12
    )


def test_exact_report_shows_neighbouring_step_counts(marched_result, tmp_path):
    """The report has one figure of the curve, which names the settings with half and with twice the
    steps."""
    text = (marched_result.save(tmp_path / "run") / "report.html").read_text("utf-8")
    assert len(re.findall('aria-label="What accuracy costs"', text)) == 1
    assert "This run: 1600 steps per cycle" in text
    assert "Next cheaper: accuracy.steps_per_cycle = 800" in text
    assert "Next better: accuracy.steps_per_cycle = 3200" in text
    axes = marched_result.plot.accuracy()
    seconds = list(axes.get_lines()[0].get_xdata())
    assert len(seconds) == 3 and seconds == sorted(seconds)
    names = axes.get_legend_handles_labels()[1]
    assert {"this run", "fewer steps per cycle"} < set(names)


def test_exact_caption_names_error_that_remains_with_more_steps():
    """The caption names the measure whose error twice the steps would not reduce, and the cause of
    this error."""
    values = [{"loop_area": area, "absolute_acceleration_peak": 1.0} for area in (1.0, 1.03, 1.12)]
    step_runs = [
        Fake(steps=steps, seconds=steps / 400, values=row)
        for steps, row in zip((400, 200, 100), values, strict=True)
    ]
    by_steps = ErrorCauses({"steps": 0.01, "mesh": 0.0}, 2.0)
    by_mesh = ErrorCauses({"steps": 0.0, "mesh": 0.0095})
    measures = {
        "loop_area": Fake(value=1.0, error=0.01, floor=0.0, causes=by_steps),
        "absolute_acceleration_peak": Fake(value=1.0, error=0.0095, floor=0.0, causes=by_mesh),
    }
    extra = {"step_runs": step_runs}
    plan = Fake(model=Fake(accuracy=Fake(tolerance=0.01)))
    curve = compute_accuracy_curve(Fake(extra=extra, measures=measures, plan=plan))
    assert curve.finer is None
    caption = accuracy_caption(curve)
    assert "that of absolute_acceleration_peak would remain, mainly because of the mesh" in caption


@pytest.mark.parametrize(
    "scene", [BLOCK, pf.new("bench"), pf.new("patch")], ids=["exact", "bench", "patch"]
)
def test_refuses_curve_if_steps_do_not_limit_accuracy(scene):
    """Runs whose error does not depend on time steps have no accuracy curve."""
    result = pf.run(scene)
    assert compute_accuracy_curve(result) is None
    with pytest.raises(pf.PatchfemError, match=r"plot\.accuracy: nothing to draw"):
        result.plot.accuracy()


def test_scene_of_guide_has_picture_of_accuracy():
    assert pf.run(pf.new("rig"), **MARCH).plot.accuracy()
