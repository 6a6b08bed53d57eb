"""Many models at once against single runs of each."""

import numpy as np
import pytest
from scene_texts import BENCH, COULOMB, PLASTIC, POINT, SHORT

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.runs import FAILED_OUTCOME, CaseResults
from patchfem.runs.batch import batches

RIG = POINT + COULOMB + SHORT


class StandIn(batches.Batch):
    """Batch whose functions a test gives."""

    def __init__(self, name, refuses, group, solve):
        super().__init__(name, "")
        for key, function in (("refuses", refuses), ("group", group), ("solve", solve)):
            object.__setattr__(self, key, function)


@pytest.fixture(autouse=True)
def use_batches(monkeypatch):
    """Return a function that sets the only batch; without a call each case runs by itself."""

    def use(*given) -> None:
        monkeypatch.setattr(batches, "BATCHES", (StandIn(*given),))

    monkeypatch.setattr(batches, "BATCHES", ())
    return use


def same(found: CaseResults, case: int, single) -> None:
    """The case has the outcome, measures, errors, floors and reasons of a single run, to the last bit."""
    assert found.outcome[case] == single.outcome
    assert {name for name in found.values if found.has(name, case)} == set(single.measures)
    for name, one in single.measures.items():
        got = found.values[name][case], found.errors[name][case], found.floors[name][case]
        want = [np.nan if part is None else part for part in (one.value, one.error, one.floor)]
        np.testing.assert_array_equal(got, want, name)
        assert found.units[name] == one.unit
        assert found.reasons.get(name, {}).get(case, "") == one.reason


def test_exact_cases_are_single_runs_in_the_order_they_were_asked():
    texts = [RIG, BENCH, POINT + PLASTIC + SHORT, RIG.replace("26 lbf", "1 N")]
    models = [pf.build(text) for text in texts]
    models.insert(1, PatchfemError("friction.static: refused here"))
    found = batches.solve_models(models)
    assert found.outcome[1] == FAILED_OUTCOME and found.messages == {
        1: "friction.static: refused here"
    }
    for case, text in zip((0, 2, 3, 4), texts):
        single = pf.run(text)
        same(found, case, single)
        assert found.warnings.get(case, []) == single.warnings
        assert found.notes.get(case, []) == single.notes
        assert found.numerics[case]["engine"] == single.extra["engine"]


@pytest.mark.parametrize(
    ("refuses", "group", "solve", "failure"),
    [
        (lambda kind: "", lambda model: 0, lambda models, say: 1 / 0, "ZeroDivisionError"),
        (lambda kind: "", lambda model: model.no_such_name, None, "AttributeError"),
        (lambda kind: 1 / 0, None, None, "ZeroDivisionError"),
    ],
    ids=["solve", "group", "refuses"],
)
def test_always_a_fault_of_a_batch_is_made_up_for_by_single_runs_and_noted(
    refuses, group, solve, failure, use_batches
):
    """Said once, and in a note of each of the benches; the rig, which the batch refuses, is not counted."""
    use_batches(
        "faulty", lambda model: "no" if model.kind == "rig" else refuses(model.kind), group, solve
    )
    texts = (BENCH, RIG, BENCH, BENCH)
    said = []
    found = batches.solve_models([pf.build(text) for text in texts], say=said.append)
    for case, text in enumerate(texts):
        same(found, case, pf.run(text))
        has_note = any(failure in note for note in found.notes.get(case, ()))
        assert has_note == (text is BENCH)
    (sentence,) = [text for text in said if "one by one" in text]
    assert sentence.startswith("3 cases are run one by one") and failure in sentence


def test_exact_the_error_of_a_case_is_no_fault_of_its_batch(use_batches):
    def refuse(models, say):
        raise PatchfemError("friction.static: refused here")

    use_batches("honest", lambda model: "", lambda model: 0, refuse)
    found = batches.solve_models([pf.build(BENCH)])
    same(found, 0, pf.run(BENCH))
    assert not found.notes


def test_exact_a_batch_gets_its_groups_and_gives_back_in_order(use_batches):
    seen = []

    def solve(models, say):
        seen.append([model.point.load for model in models])
        out = CaseResults(np.full(len(models), "done", object))
        out.measure("load", "N")
        out.values["load"][:] = seen[-1]
        return out

    loads = [1.0, 2.0, 3.0, 4.0]
    models = [pf.build(BENCH, **{"normal.load": load}) for load in loads]
    use_batches("parity", lambda model: "", lambda model: model.point.load % 2, solve)
    assert batches.solve_models(models).values["load"].tolist() == loads
    assert seen == [[1.0, 3.0], [2.0, 4.0]]


def test_always_a_fault_of_one_case_leaves_the_others(monkeypatch):
    from patchfem.runs.batch import one_by_one

    real = one_by_one.run
    monkeypatch.setattr(
        one_by_one,
        "run",
        lambda what, say, **more: 1 / 0 if what.kind == "bench" else real(what, say, **more),
    )
    found = batches.solve_models([pf.build(BENCH), pf.build(RIG)])
    assert found.outcome.tolist()[0] == FAILED_OUTCOME and "ZeroDivisionError" in found.messages[0]
    same(found, 1, pf.run(RIG))
