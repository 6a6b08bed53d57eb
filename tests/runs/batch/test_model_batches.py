"""Many models solved together agree with single runs of each model."""

import numpy as np
import pytest
from scene_texts import BENCH, COULOMB, PLASTIC, POINT, SHORT

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.runs import FAILED_OUTCOME, CaseResults
from patchfem.runs.batch import batches, lumped

RIG = POINT + COULOMB + SHORT


@pytest.fixture
def replace_lumped(monkeypatch):
    """Return a function that replaces functions of `lumped`; any number of rigs is then computed together."""

    def replace(**functions) -> None:
        monkeypatch.setattr(batches, "MIN_CASES", 1)
        for name, function in functions.items():
            monkeypatch.setattr(lumped, name, function)

    return replace


def assert_equal_to_run(results: CaseResults, case: int, single) -> None:
    """Assert that a case has the outcome, measures, errors, floors and reasons of a single run, to
    the last bit."""
    assert results.outcome[case] == single.outcome
    assert {name for name in results.values if results.has(name, case)} == set(single.measures)
    for name, measure in single.measures.items():
        actual = results.values[name][case], results.errors[name][case], results.floors[name][case]
        expected = [
            np.nan if part is None else part
            for part in (measure.value, measure.error, measure.floor)
        ]
        np.testing.assert_array_equal(actual, expected, name)
        assert results.units[name] == measure.unit
        assert results.reasons.get(name, {}).get(case, "") == measure.reason


def test_exact_mixed_cases_agree_with_single_runs_in_order():
    """Cases of different kinds keep their order and agree with single runs; a model that is an
    error fails with its message."""
    texts = [RIG, BENCH, POINT + PLASTIC + SHORT, RIG.replace("26 lbf", "1 N")]
    models = [pf.build(text) for text in texts]
    models.insert(1, PatchfemError("friction.static: refused here"))
    results = batches.solve_models(models)
    assert results.outcome[1] == FAILED_OUTCOME and results.messages == {
        1: "friction.static: refused here"
    }
    for case, text in zip((0, 2, 3, 4), texts):
        single = pf.run(text)
        assert_equal_to_run(results, case, single)
        assert results.warnings.get(case, []) == single.warnings
        assert results.notes.get(case, []) == single.notes
        assert results.numerics[case]["engine"] == single.extra["engine"]


@pytest.mark.parametrize("name", ["solve", "group_key", "refusal_reason"])
def test_always_fault_of_batch_falls_back_to_single_runs(name, replace_lumped):
    """If computing cases together fails, they run one by one. The fault is printed once and noted for each rig."""
    replace_lumped(**{name: lambda *arguments: 1 / 0})
    texts = (RIG, BENCH, RIG, RIG)
    messages = []
    results = batches.solve_models([pf.build(text) for text in texts], report=messages.append)
    for case, text in enumerate(texts):
        assert_equal_to_run(results, case, pf.run(text))
        has_note = any("ZeroDivisionError" in note for note in results.notes.get(case, ()))
        assert has_note == (text is RIG)
    (sentence,) = [text for text in messages if "one by one" in text]
    assert sentence.startswith("3 cases are run one by one") and "ZeroDivisionError" in sentence


def test_exact_case_error_is_not_noted_as_fault(replace_lumped):
    """A PatchfemError that a case raises in a batch leads to the result of a single run without a
    note."""

    def refuse(models, say):
        raise PatchfemError("friction.static: refused here")

    replace_lumped(solve=refuse)
    results = batches.solve_models([pf.build(RIG)])
    assert_equal_to_run(results, 0, pf.run(RIG))
    assert not results.notes


def test_always_fault_of_one_case_keeps_other_results(monkeypatch):
    """An internal error of one case makes this case fail; the other case has the result of a single
    run."""
    from patchfem.runs.batch import one_by_one

    run_plan = one_by_one.run
    monkeypatch.setattr(
        one_by_one,
        "run",
        lambda what, say, **more: 1 / 0 if what.kind == "bench" else run_plan(what, say, **more),
    )
    results = batches.solve_models([pf.build(BENCH), pf.build(RIG)])
    assert (
        results.outcome.tolist()[0] == FAILED_OUTCOME and "ZeroDivisionError" in results.messages[0]
    )
    assert_equal_to_run(results, 1, pf.run(RIG))
