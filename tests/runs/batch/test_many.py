"""Many models at once against single runs of each."""

import numpy as np
import pytest
from scene_texts import BENCH, COULOMB, PLASTIC, POINT, SHORT

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.runs.batch import batches
from patchfem.runs.batch.case_results import FAILED_OUTCOME, CaseResults

RIG = POINT + COULOMB + SHORT


@pytest.fixture(autouse=True)
def use_batches(monkeypatch):
    """Return a function that sets the batches; without a call each case runs by itself."""

    def use(*chosen: batches.Batch) -> None:
        monkeypatch.setattr(batches, "BATCHES", chosen)

    use()
    return use


def same(found: CaseResults, case: int, single) -> None:
    """The case has the outcome, measures, errors, floors and reasons of a single run, to the last bit."""
    assert found.outcome[case] == single.outcome
    assert {name for name in found.values if found.has(name, case)} == set(single.measures)
    for name, one in single.measures.items():
        got = found.values[name][case], found.errors[name][case], found.floors[name][case]
        want = [np.nan if part is None else part for part in (one.value, one.error, one.floor)]
        np.testing.assert_array_equal(got, want, name)
        assert (
            found.units[name] == one.unit
            and found.reasons.get(name, {}).get(case, "") == one.reason
        )


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
        assert (
            found.warnings.get(case, []) == single.warnings
            and found.notes.get(case, []) == single.notes
        )
        assert found.numerics[case]["engine"] == single.extra["engine"]


def test_exact_a_failing_batch_is_made_up_for_by_single_runs(use_batches):
    def breaks(models, say):
        raise ZeroDivisionError

    models = [pf.build(RIG), pf.build(BENCH)]
    batch = batches.Batch(
        "breaks", lambda model: "" if model.kind == "rig" else "no", lambda model: 0, breaks
    )
    use_batches(batch)
    said = []
    found = batches.solve_models(models, say=said.append)
    same(found, 0, pf.run(RIG))
    same(found, 1, pf.run(BENCH))
    assert "breaks: ZeroDivisionError" in said[0]


def test_exact_a_batch_that_fails_to_look_at_a_model_leaves_it_to_a_single_run(use_batches):
    batch = batches.Batch("blind", lambda model: 1 / 0, lambda model: 0, lambda models, say: 1 / 0)
    use_batches(batch)
    said = []
    same(batches.solve_models([pf.build(BENCH)], say=said.append), 0, pf.run(BENCH))
    (sentence,) = [text for text in said if "one by one" in text]
    assert sentence.startswith("1 cases are run one by one") and "ZeroDivisionError" in sentence


def test_always_a_batch_that_cannot_group_its_models_says_so_once(use_batches):
    """Three benches whose group fails are run one by one; the rig, which the batch refuses, is not counted."""
    batch = batches.Batch(
        "groups",
        lambda model: "" if model.kind == "bench" else "no",
        lambda model: model.no_such_name,
        lambda models, say: 1 / 0,
    )
    use_batches(batch)
    models = [pf.build(text) for text in (BENCH, RIG, BENCH, BENCH)]
    said = []
    found = batches.solve_models(models, say=said.append)
    for case, text in enumerate((BENCH, RIG, BENCH, BENCH)):
        same(found, case, pf.run(text))
    (sentence,) = [text for text in said if "one by one" in text]
    assert sentence.startswith(
        "3 cases are run one by one, because running them together failed: groups: AttributeError"
    )


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
    batch = batches.Batch("parity", lambda model: "", lambda model: model.point.load % 2, solve)
    use_batches(batch)
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
