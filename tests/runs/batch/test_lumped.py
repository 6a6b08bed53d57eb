"""Lumped cases that are marched together agree with single runs of each case."""

import numpy as np
import pytest
from point_cases import LAWS, MANY, SCENE, compare_answers, draw_points

from patchfem.api import build, get_base_scene, load
from patchfem.runs.batch import batches, lumped, one_by_one


def count_marched(results) -> int:
    """Return the number of cases that were marched together."""
    return sum(numerics["engine"] == lumped.ENGINE for numerics in results.numerics.values())


@pytest.mark.share(2, 4, 5)
@pytest.mark.parametrize("law", LAWS)
def test_always_95_of_100_measures_lie_within_both_errors(law):
    """Outcomes are those of single runs, and at least 95 % of the measures agree within the sum of both errors."""
    cases = draw_points(law, 11, 12)
    results = batches.solve_models(cases, n_study_cases=MANY)
    assert count_marched(results) >= 4 and not results.notes
    singles = one_by_one.solve(cases)
    assert (results.outcome == singles.outcome).all()
    rows = [row for case_rows in compare_answers(results, singles) for row in case_rows]
    assert np.mean([row.holds for row in rows]) >= 0.95


def test_exact_chunks_of_study_agree_with_whole():
    """The values of a case do not depend on the other cases of its chunk."""
    cases = draw_points("coulomb", 4, 80)
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


def test_exact_few_cases_equal_single_runs():
    """Fewer than 32 cases run one by one, so that they equal single runs to the last bit."""
    cases = draw_points("elastic-plastic", 8, 3)
    assert batches.find_group(cases[0], 31).key is None
    results, singles = batches.solve_models(cases), one_by_one.solve(cases)
    assert results.numerics == singles.numerics
    for name, values in singles.values.items():
        np.testing.assert_array_equal(results.values[name], values)
        np.testing.assert_array_equal(results.errors[name], singles.errors[name])


@pytest.mark.parametrize("law", ["coulomb", "elastic-plastic"])
def test_exact_stuck_cases_have_the_measures_of_single_runs(law):
    """Cases that end stuck have the outcome and the names of the measures of single runs, free vibration included."""
    base = get_base_scene(load(SCENE.format(law=LAWS[law])))
    cases = [
        build(base.override([f"normal.load={size} N", f"structure.mode.axial.damping={damping}"]))
        for size in (300, 1000, 3000)
        for damping in (0.003, 0.03)
    ]
    results = batches.solve_models(cases, n_study_cases=MANY)
    singles = one_by_one.solve(cases)
    assert (results.outcome == singles.outcome).all() and "stuck" in results.outcome
    for case in range(len(cases)):
        names = {name for name in singles.values if singles.has(name, case)}
        assert {name for name in results.values if results.has(name, case)} == names


def test_always_cases_that_miss_the_tolerance_run_alone(monkeypatch):
    """With few steps a case misses its tolerance, and equals its single run."""
    monkeypatch.setattr(lumped, "STEPS", (32,))
    cases = draw_points("tanh", 3, 2)
    results, singles = lumped.solve(cases), one_by_one.solve(cases)
    assert count_marched(results) < 2
    for case in range(2):
        if results.numerics[case]["engine"] != lumped.ENGINE:
            for name, values in singles.values.items():
                np.testing.assert_array_equal(results.values[name][case], values[case])
