"""Lumped cases that are integrated together (in lanes) agree with the exact engine within their
errors.

Cases whose errors are too large are solved by the exact engine. The long campaign against single
runs is `lanes` of tests/support/campaigns.py.
"""

import numpy as np
import pytest
from lane_cases import LAWS, SCENE, compare_answers, draw_points
from test_lumped import solve_by_group

from patchfem.api import build, get_base_scene, load
from patchfem.runs import CaseResults
from patchfem.runs.batch import batches, one_by_one
from patchfem.runs.batch.lumped import (
    lane_check,
    lane_numbers,
    lane_refinement,
    lane_runs,
)

# Laws with an exact batch; other laws are compared with single runs.
LAWS_WITH_EXACT_BATCH = ("coulomb", "weakening", "elastic-plastic", "iwan")


def draw_models(law: str, seed: int, count: int) -> list:
    """Return random models with a friction law that lanes support."""
    return draw_points(law, seed, count)


def count_deviating_cases(lanes, reference) -> int:
    """Return the number of cases with another outcome, or with a measure that differs by more than
    the sum of both errors."""
    return sum(
        lanes.outcome[case] != reference.outcome[case] or not all(row.holds for row in case_rows)
        for case, case_rows in enumerate(compare_answers(lanes, reference))
    )


def assert_lanes_agree(law: str, seed: int, count: int, max_cases: int | None = None) -> None:
    """Assert that 97 % of the measures of random cases in lanes agree with the reference within
    both errors.

    At most `max_cases` of the cases in lanes are compared; None compares all.
    """
    cases = draw_models(law, seed, count)
    results = batches.solve_models(cases)
    in_lanes = [case for case in range(count) if results.numerics[case]["engine"] == "lanes"]
    assert len(in_lanes) > count / 3 and not any(
        "the fast" in note for notes in results.notes.values() for note in notes
    )
    in_lanes = in_lanes[:max_cases]
    compared = [cases[case] for case in in_lanes]
    reference = (
        solve_by_group(compared) if law in LAWS_WITH_EXACT_BATCH else one_by_one.solve(compared)
    )
    lanes = results.select(np.array(in_lanes))
    assert (lanes.outcome == reference.outcome).all()
    assert (
        np.mean([row.holds for compared in compare_answers(lanes, reference) for row in compared])
        >= 0.97
    )


# The other laws need two more compiled loops each: one for lanes and one for single runs.
@pytest.mark.share(2, 4, 5)
@pytest.mark.parametrize("law", LAWS)
def test_always_97_of_100_measures_lie_within_both_errors(law):
    """At least 97 % of the measures of random cases in lanes agree with the exact engine within the
    sum of both errors."""
    # References for the Iwan law and single runs take seconds.
    is_slow = law not in LAWS_WITH_EXACT_BATCH[:3]
    assert_lanes_agree(law, 1, 64 if is_slow else 150, 12 if is_slow else None)


def test_exact_chunks_of_study_agree_with_whole():
    """The values of a case do not depend on the other cases of its chunk: chunks of 1, 29 and 50
    cases agree with the whole study to the last bit."""
    cases = draw_models("coulomb", 4, 80)
    whole_study = batches.solve_models(cases)
    parts = [
        batches.solve_models(part, n_study_cases=80)
        for part in (cases[:1], cases[1:30], cases[30:])
    ]
    for name, values in whole_study.values.items():
        concatenated = np.concatenate(
            [part.values.get(name, np.full(len(part), np.nan)) for part in parts]
        )
        np.testing.assert_array_equal(concatenated, values)


@pytest.fixture
def falsify(monkeypatch):
    """Return a function that makes the lanes give some models a loop area that is 1 % too large."""

    def falsify_models(wrong_models: list) -> None:
        collect_runs = lane_runs.collect_runs

        def collect_wrong_runs(models, *arguments):
            runs, *further = collect_runs(models, *arguments)
            is_wrong = [any(model is wrong for wrong in wrong_models) for model in models]
            runs.values["loop_area"][is_wrong] *= 1.01
            return runs, *further

        monkeypatch.setattr(lane_runs, "collect_runs", collect_wrong_runs)

    return falsify_models


def test_always_failed_lane_check_makes_batch_exact(falsify):
    """If the checked cases differ from the exact engine, all cases are solved by the exact engine,
    and a note says so."""
    cases = draw_models("coulomb", 5, 64)
    falsify(cases)
    results = batches.solve_models(cases)
    exact = solve_by_group(cases)
    assert all(numerics["engine"] == "exact" for numerics in results.numerics.values())
    assert all(
        "checked against the exact engine and" in notes[-1] and "loop_area" in notes[-1]
        for notes in results.notes.values()
    )
    assert len(results.notes) == 64
    np.testing.assert_array_equal(results.values["loop_area"], exact.values["loop_area"])


def test_always_single_failed_lane_check_replaces_only_this_case(falsify):
    """If a single checked case differs from the exact engine, only this case is solved again; the
    others keep their values."""
    cases = draw_models("coulomb", 7, 96)
    untouched = batches.solve_models(cases)
    numbers = np.column_stack(lane_numbers.make_cases(cases)[0])
    is_fast = np.array([untouched.numerics[case]["engine"] == "lanes" for case in range(96)])
    checked = lane_check.select_checked_cases(numbers, is_fast)[0]
    falsify([cases[checked]])
    results = batches.solve_models(cases)
    assert results.numerics[checked]["engine"] == "exact"
    assert "differed from it in 1, in loop_area of this case" in results.notes[checked][-1]
    unchecked = np.arange(96) != checked
    for name, values in untouched.values.items():
        np.testing.assert_array_equal(results.values[name][unchecked], values[unchecked])


@pytest.mark.parametrize("law", LAWS_WITH_EXACT_BATCH[:3])
def test_exact_stuck_cases_in_lanes_agree_with_exact_batch(law):
    """Cases that end stuck, with free vibration, agree with the exact batch within the errors and
    have the same measures."""
    base = get_base_scene(load(SCENE.format(law=LAWS[law])))
    cases = [
        build(base.override([f"normal.load={load} N", f"structure.mode.axial.damping={damping}"]))
        for load in (300, 1000, 3000)
        for damping in (0.003, 0.03)
    ]
    lanes = batches.solve_models(cases, n_study_cases=64)
    exact = solve_by_group(cases)
    assert np.sum(lanes.outcome == "stuck") > 2 and all(
        numerics["engine"] == "lanes" for numerics in lanes.numerics.values()
    )
    assert count_deviating_cases(lanes, exact) == 0
    assert ("ring_frequency" in lanes.values) == (law == "elastic-plastic")


def test_always_unbounded_motions_need_no_loop_area():
    """Motions that grow have no friction loop. The check of their errors must not need `loop_area`,
    otherwise the whole batch fails."""
    cases = draw_models("lugre", 5, 3)
    results = CaseResults.blank(3)
    results.add_measure("equivalent_damping", "1")
    assert "loop_area" not in results.values
    assert not lane_refinement.has_excessive_error(cases, results).any()
