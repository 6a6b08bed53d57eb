"""Curves of error against computing time: values, tables and summaries."""

from dataclasses import replace

import numpy as np
import pytest
from command_line import run_cli
from scene_texts import PIECE, POINT, STRUCTURE

import patchfem as pf
from patchfem import build
from patchfem.campaigns import (
    Cost,
    compute_costs,
    describe_best_setting,
    numerical_settings,
)
from patchfem.campaigns.backbone import cost as backbone_cost
from patchfem.campaigns.convergence import (
    extrapolate_sufficient_run,
    find_order,
    find_sufficient_run,
    measure_convergence,
)
from patchfem.core import Measure
from patchfem.export.costs import describe_convergence, make_cost_answer
from patchfem.export.show import make_lines
from patchfem.runs.patch import store
from patchfem.runs.run import run

IWAN = '[friction]\nlaw = "iwan"\nstatic = 0.3\nstiffness = "1e6 N/m"\nchi = -0.5\nbeta = 0.5\n'
TEXT = (
    PIECE
    + """\
load = "26 lbf"
substrate = "steel"
{keys}
[contact.tilt]
angle = "5e-5 rad"
[accuracy]
tolerance = {tolerance}
"""
)


def build_model(keys="", tolerance=0.05):
    """Return the Model of a tilted patch with additional keys and a tolerance."""
    return build(TEXT.format(keys=keys, tolerance=tolerance))


def make_cost(label, seconds, error, value=1.0):
    """Return the Cost of a synthetic run with two measures of equal error."""
    measures = {name: Measure(size, "1", error) for name, size in (("a", 1.0), ("b", 2.0))}
    return Cost(label, value, f"a knob at {label}", seconds, seconds, 3, measures)


def forget_errors(run_cost, *names):
    """Remove the error estimates of measures of a run."""
    for name in names:
        run_cost.measures[name] = replace(run_cost.measures[name], error=None)


@pytest.mark.share(0)
@pytest.mark.parametrize(
    "keys, own", [('element_size = "0.25 mm"', "249 um"), ("", "by tolerance")]
)
def test_exact_error_at_setting_of_scene_agrees_with_run(keys, own, monkeypatch):
    """Values and errors at the setting of the scene agree with those of its run within 1e-9."""
    monkeypatch.setattr(numerical_settings, "CELL_COUNT_FACTORS", (0.25, 1.0))
    patch = build_model(keys, 0.03)
    # The label of a row lists all settings with equal runs.
    row = next(
        one for one in compute_costs(patch, "element_size")["element_size"] if own in one.label
    )
    store.clear_cache()
    measures = run(patch).measures
    assert row.measures.keys() == measures.keys()
    for name, measure in measures.items():
        assert row.measures[name].value == pytest.approx(measure.value, rel=1e-9)
        assert row.measures[name].error == pytest.approx(measure.error, rel=1e-9)


def test_exact_summary_states_coarsest_sufficient_run_or_worst_measure():
    """The summary states the coarsest run within the tolerance, or else the measure with the largest error."""
    runs = [make_cost("2", 1, 4e-2), make_cost("4", 2, 8e-3), make_cost("8", 5, 2e-3)]
    within = "a knob at 4: 2 CPU s per run, with every measure that has an error estimate within the tolerance 0.01"
    assert describe_best_setting(runs, 1e-2) == within
    assert describe_best_setting(runs, 1e-3) == (
        "no setting is known to meet the tolerance 0.001: the best run, with a knob at 8, has a relative error of "
        "0.002 in a and takes 5 CPU s"
    )
    # a coarse run that is accurate by chance does not count
    assert describe_best_setting([make_cost("1", 0.5, 1e-4), *runs], 1e-2) == within
    # the automatic setting is judged by itself
    automatic = [*runs, make_cost("auto", 3, 5e-2, None)]
    assert describe_best_setting(automatic, 1e-2) == within
    automatic[-1] = make_cost("auto", 3, 1e-3, None)
    assert describe_best_setting(automatic, 1e-3).startswith("a knob at auto: 3 CPU s per run")


def test_exact_screen_shows_main_measure_of_every_run():
    """The table on the screen has the main measure of each run, and says where its error is unknown."""
    runs = [make_cost("2", 1, 4e-2), make_cost("400", 12, 8e-3)]
    forget_errors(runs[1], "a")
    lines = make_lines(make_cost_answer({"knob": runs}, build_model(tolerance=1e-3)))
    assert "  1.000 ± 0.040  meets" in lines[2] and "unknown errors" in lines[3]


def test_exact_screen_shows_a_main_measure_in_its_display_unit():
    """A fraction that is the main measure is in percent in the table, as above it."""
    runs = [make_cost("2", 1, 1e-2), make_cost("400", 12, 5e-3)]
    for one in runs:
        one.measures["contact_fraction"] = Measure(0.3, "1", 0.01)
    lines = make_lines(make_cost_answer({"knob": runs}, build_model(tolerance=1e-3)))
    assert "contact fraction" in lines[1] and "  30.0 ± 1.0 %  " in lines[2]


def test_exact_runs_with_unknown_errors_are_told_from_runs_that_miss():
    """A run without an error estimate neither meets nor misses its tolerance in sentences, table and page."""
    runs = [replace(make_cost(str(k), 1, 1e-4), tolerance=10.0**-k) for k in (2, 3, 4, 5)]
    forget_errors(runs[1], "b")
    answer = make_cost_answer({"tolerance": runs}, build_model(tolerance=1e-3))
    assert answer.verdict[:2] == (
        "At its tolerance 0.001 the scene takes 1 CPU s and does not have an error estimate of every measure, with a "
        "largest relative error of 0.0001 in a.",
        "Of the tolerances of this table, the smallest that is met is 4, in 1 CPU s.",
    )
    entries = answer.details["tolerance"]["runs"]
    assert [entry["meets_tolerance"] for entry in entries] == [True, False, True, False]
    for known in runs[:1] + runs[2:]:
        forget_errors(known, "b")
    runs[-1].measures["b"] = Measure(2.0, "1", 2e-3)
    runs[-1] = replace(runs[-1], remedies=("use it",))
    answer = make_cost_answer({"tolerance": runs}, build_model(tolerance=1e-3))
    assert answer.verdict[1:] == ("No run is known to meet its tolerance.",)
    # the advice of a tolerance other than that of the scene
    assert answer.remarks.notes == ("With a knob at 5, b misses the tolerance: use it.",)


def make_series(order, n_runs=5):
    """Return runs with 10, 20, 40, ... steps whose measure "a" approaches 2 with an order and states its error."""
    runs = []
    for steps in 10 * 2 ** np.arange(n_runs):
        error = 3.0 * steps**-order
        measures = {"loop_area": Measure(2.0 + error, "J", 1.1 * error)}
        runs.append(Cost(f"{steps}", float(steps), f"{steps} steps", steps / 100, 1.0, 3, measures))
    return runs


@pytest.mark.parametrize("order", [0.5, 1.0, 1.7, 4.0])
def test_exact_order_of_power_is_observed(order):
    """Values 2 + 3 n^-p have the order p to 1e-8, and the coarsest run within a tolerance follows from 3 n^-p."""
    runs = make_series(order)
    found = measure_convergence(runs, "steps_per_cycle", "loop_area")
    assert found.order == pytest.approx(order, rel=1e-8)
    changes = [
        abs(run.measures["loop_area"].value / runs[-1].measures["loop_area"].value - 1)
        for run in runs
    ]
    assert found.changes == pytest.approx(changes, abs=1e-15)
    sufficient = find_sufficient_run(runs, "loop_area", found, 1e-2)
    fits = [
        run for run in runs if 3.3 * run.value**-order <= 1e-2 * run.measures["loop_area"].value
    ]
    assert sufficient is (fits[0] if fits else None)
    # without its error the finest run is not known to be accurate
    forget_errors(runs[-1], "loop_area")
    assert find_sufficient_run(runs, "loop_area", found, 1e-2) is None


def test_exact_order_towards_a_better_value_bears_a_change_of_sign():
    """Differences +-3 n^-1.7 from a more accurate value have the order 1.7, though the values swing around it."""
    runs = make_series(1.7)
    for k, row in enumerate(runs):
        one = row.measures["loop_area"]
        row.measures["loop_area"] = replace(one, value=2.0 + (-1) ** k * (one.value - 2.0))
    assert measure_convergence(runs, "steps_per_cycle", "loop_area").order is None
    best = Measure(2.0, "J", 0.0)
    found = measure_convergence(runs, "steps_per_cycle", "loop_area", best)
    assert found.order == pytest.approx(1.7, rel=1e-8)


def test_sufficient_setting_is_extrapolated_from_stated_errors():
    """Errors 3.3 n^-p are within 1e-4 of 2 from n = (3.3/2e-4)^(1/p) on, where CPU seconds are n/100."""
    runs = make_series(1.7)
    far = extrapolate_sufficient_run(runs, "steps_per_cycle", "loop_area", 1e-4)
    steps = (3.3 / 2e-4) ** (1 / 1.7)
    assert (far.value, far.seconds) == pytest.approx((steps, steps / 100), rel=1e-3)
    assert extrapolate_sufficient_run(runs, "steps_per_cycle", "loop_area", 0.1) is None
    (row,) = describe_convergence(make_series(1.0), "steps_per_cycle")
    assert row["for_1_permille"] == "about 1700, 20 CPU s"


def test_exact_values_without_a_limit_have_no_order():
    """Values that swing, that move apart or that are equal to round-off have no order."""
    sizes = np.array([4.0, 2.0, 1.0])
    assert find_order(sizes, np.array([1.0, 2.0, 1.5])) is None
    assert find_order(sizes, np.array([1.0, 1.1, 1.3])) is None
    runs = make_series(1.0, 3)
    for k, one in enumerate(runs):
        one.measures["loop_area"] = Measure(1.0 + 1e-14 * 2.0**-k, "J", 0.0)
    assert measure_convergence(runs, "steps_per_cycle", "loop_area").order is None


def test_exact_answer_states_when_a_run_takes_a_minute():
    """CPU times of 1 and 4 s at 1e-2 and 1e-4 grow as tolerance^-.301, so that a minute is taken near 1e-8."""
    runs = [
        replace(make_cost(label, seconds, 1e-9), tolerance=float(label))
        for label, seconds in (("0.01", 1.0), ("0.0001", 4.0))
    ]
    sentence = make_cost_answer({"tolerance": runs}, build_model(tolerance=0.01)).verdict[2]
    expected = 1e-4 * 15 ** (-np.log(100) / np.log(4))
    assert sentence.endswith(
        f"a run takes a minute at a tolerance of {expected:.0e}.".replace("e-0", "e-")
    )


@pytest.mark.parametrize(
    "words, message",
    [
        (["--over", "colour"], "use one of element_size"),
        (["--over", "steps_per_cycle"], "possible settings: element_size"),
        (["--over", "accuracy.steps_per_cycle"], "possible settings: element_size"),
    ],
)
def test_refuses_settings_that_do_not_apply_to_scene(tmp_path, words, message):
    """Settings that do not apply to the scene are refused with a list of those that do."""
    scene = tmp_path / "a.toml"
    scene.write_text(TEXT.format(keys="", tolerance=0.05), "utf-8")
    answer = run_cli("cost", scene, *words)
    assert answer.code == 2 and message in answer.err


def test_exact_key_of_the_scene_names_its_setting():
    """`cost` takes the keys of a scene as a sweep does, besides its own short names."""
    curves = [
        pf.cost(pf.new("bench"), over=name, say=lambda line: None)
        for name in ("steps_per_cycle", "accuracy.steps_per_cycle")
    ]
    labels = [[run["label"] for run in curve["steps_per_cycle"]["runs"]] for curve in curves]
    assert labels[0] == labels[1]


@pytest.mark.parametrize("law", ["coulomb", "elastic-plastic"])
def test_always_convergence_of_motion_from_event_to_event_is_over_the_tolerance(law):
    """A rig without a mesh has a table over the tolerance; its error is of first order in that of a step, or smaller."""
    bond = 'bond_length = "1 um"\n' * (law != "coulomb")
    text = POINT + f'[friction]\nlaw = "{law}"\nstatic = 0.3\n{bond}' + STRUCTURE
    answer = pf.cost(text, say=lambda line: None)
    assert {row["setting"] for row in answer["convergence"]} == {"tolerance"}
    (amplitude,) = [
        row for row in answer["convergence"] if row["measure"] == "relative_displacement_amplitude"
    ]
    assert 0.7 < amplitude["order"] < 2.0
    assert amplitude["for_1_permille"].startswith("0.1, ")
    assert max(amplitude["changes"]) < 1e-6


def test_exact_cost_of_backbone_has_values_of_backbone(monkeypatch):
    """`cost` of a backbone has the values and the errors of its curve, and a scene without [drive] has a backbone."""
    ends = np.array([4e-7, 1e-3])
    monkeypatch.setattr(backbone_cost, "TOLERANCES", (1e-3,))
    monkeypatch.setattr(backbone_cost, "N_AMPLITUDES", 2)
    monkeypatch.setattr(backbone_cost, "find_default_range", lambda _: ends)
    text = POINT + IWAN + STRUCTURE.partition("[drive]")[0]
    answer = pf.cost(text, backbone=True, say=lambda line: None)
    (run_of_curve,) = answer["tolerance"]["runs"]
    curves = pf.backbone(text, amplitudes=ends)
    for name in ("frequency", "damping", "force"):
        for k, place in ((0, "smallest"), (-1, "largest")):
            found = f"{name}_at_{place}_amplitude"
            value, error = (curves[f"balance_{one}"].values[k] for one in (name, f"{name}_error"))
            assert run_of_curve["values"][found] == pytest.approx(value, rel=1e-9)
            assert run_of_curve["errors"][found] == pytest.approx(error, rel=1e-9)
    assert run_of_curve["meets_tolerance"]


def test_exact_cost_of_backbone_leaves_out_amplitudes_without_a_motion(monkeypatch):
    """Amplitudes at which the mode does not oscillate are not looked for again in every run; the note lists the others."""
    monkeypatch.setattr(backbone_cost, "N_AMPLITUDES", 3)
    monkeypatch.setattr(backbone_cost, "find_default_range", lambda _: (1e-5, 3e-5))
    law = {"friction.law": "elastic-plastic", "friction.bond_length": "1 um"}
    model = pf.build(pf.new("rig"), **law)
    subject = backbone_cost.make_backbone_subject(model)
    assert "at these amplitudes: 10 um, 30 um." in subject.notes[0]
    measures = subject.solve(model).measures
    curves = pf.backbone(model, amplitudes=[1e-5, 3e-5], method="balance")
    for k, place in enumerate(("smallest", "largest")):
        found = measures[f"frequency_at_{place}_amplitude"].value
        assert found == pytest.approx(curves["balance_frequency"].values[k], rel=1e-12)
