"""Many models solved together agree with single runs of each model."""

import numpy as np
import pytest
from scene_texts import BENCH, COULOMB, PLASTIC, POINT, SHORT

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.runs import FAILED_OUTCOME, CaseResults
from patchfem.runs.batch import batches

RIG = POINT + COULOMB + SHORT


class StubBatch(batches.Batch):
    """Batch with functions that a test provides."""

    def __init__(self, name, refuses, group, solve):
        super().__init__(name)
        for key, function in (("refusal_reason", refuses), ("group_key", group), ("solve", solve)):
            object.__setattr__(self, key, function)


@pytest.fixture(autouse=True)
def set_batch(monkeypatch):
    """Return a function that sets the only batch; if it is not called, each case runs by itself."""

    stub_batches = []
    monkeypatch.setattr(batches, "BATCHES", stub_batches)

    def replace_batch(*functions) -> None:
        stub_batches[:] = [StubBatch(*functions)]

    return replace_batch


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


@pytest.mark.parametrize(
    ("refuses", "group", "solve", "failure"),
    [
        (lambda kind: "", lambda model: 0, lambda models, say: 1 / 0, "ZeroDivisionError"),
        (lambda kind: "", lambda model: model.no_such_name, None, "AttributeError"),
        (lambda kind: 1 / 0, None, None, "ZeroDivisionError"),
    ],
    ids=["solve", "group", "refuses"],
)
def test_always_batch_fault_falls_back_to_single_runs(refuses, group, solve, failure, set_batch):
    """If a batch fails, its cases run one by one. The fault is printed once and noted for each
    bench; the rig, which the batch refuses, has no note."""
    set_batch(
        "faulty", lambda model: "no" if model.kind == "rig" else refuses(model.kind), group, solve
    )
    texts = (BENCH, RIG, BENCH, BENCH)
    messages = []
    results = batches.solve_models([pf.build(text) for text in texts], report=messages.append)
    for case, text in enumerate(texts):
        assert_equal_to_run(results, case, pf.run(text))
        has_note = any(failure in note for note in results.notes.get(case, ()))
        assert has_note == (text is BENCH)
    (sentence,) = [text for text in messages if "one by one" in text]
    assert sentence.startswith("3 cases are run one by one") and failure in sentence


def test_exact_case_error_is_not_noted_as_batch_fault(set_batch):
    """A PatchfemError that a case raises in a batch leads to the result of a single run without a
    note."""

    def refuse(models, say):
        raise PatchfemError("friction.static: refused here")

    set_batch("honest", lambda model: "", lambda model: 0, refuse)
    results = batches.solve_models([pf.build(BENCH)])
    assert_equal_to_run(results, 0, pf.run(BENCH))
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
