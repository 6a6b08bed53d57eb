"""The comparison of time integrators: the figures stated in its studies."""

import json
import sys

import numpy as np
import pytest
from report_methods import accepted_force_error
from study_module import make_study_fixture

from patchfem.core import Missing

failure = make_study_fixture("integrators/failure.py")


@pytest.mark.slow
def test_exact_failures_of_the_report_method_are_those_stated(failure, capsys):
    """Early slip, force errors and failed steps of the report's method are those stated."""
    rows, curves = failure.main(draw=False)
    by_name = {r.name: r for r in rows}
    loose = by_name["Fig 17, 18: displacement 1e-2"]
    speed = by_name["Fig 19, 20: velocity 1e-4"]
    assert (loose.early, loose.moves, loose.force) == pytest.approx((0.1146, 5.5, 2.56), abs=5e-3)
    assert loose.worst == pytest.approx(5.4, abs=0.05) and loose.failed == 0
    assert (
        f"friction force reached {loose.worst:.1f}, although the friction limit is only 3"
        in failure.ANSWER
    )
    accepted = accepted_force_error(failure.TWO, 0.05, "displacement", 1e-2, 0.1)
    assert accepted == pytest.approx(80 * 3, rel=1e-3)
    for tight in (by_name["displacement 1e-6"], speed):
        assert tight.early < 0.0095 and 0.3 < tight.failed < 0.37 and 0.15 < tight.jumps < 0.25
    assert 0.2 < by_name["force 1e-3"].failed < 0.26 and by_name["force 1e-3"].jumps > 0.2
    static_branch = by_name["static branch, force 1e-6"]
    elastic = by_name["Fig 21, 22: elastic 0.01, velocity 1e-6"]
    assert (
        static_branch.early < 2e-4
        and abs(static_branch.error) < 3e-3
        and static_branch.jumps < 0.01
    )
    assert elastic.early == pytest.approx(0.0099, abs=1e-4)
    assert abs(elastic.error) < 5e-3
    assert elastic.failed == 0
    assert by_name["3.12 as printed, eps 0.03"].error < -90
    without_force = curves[1e-3, False]
    with_force = curves[1e-3, True]
    assert [without_force[1], without_force[3]] == pytest.approx([0.057, -0.19], abs=5e-3)
    assert np.all(np.array(without_force[4:]) < -0.99)
    assert with_force[4] == pytest.approx(-9e-4, abs=1e-4) and abs(with_force[-1]) < 2e-5
    assert "Newmark" in capsys.readouterr().out


work = make_study_fixture("integrators/work_precision.py")


@pytest.fixture(scope="module")
def engines(work):
    """Module of the time integrators."""
    return sys.modules["engines"]


@pytest.fixture(scope="module")
def problem(work):
    """Function that makes a test problem from its name."""
    return sys.modules["engine_problems"].problem


@pytest.fixture(scope="module")
def rows(work):
    """Module that computes the rows of the work-precision table."""
    return sys.modules["precision_rows"]


@pytest.fixture(scope="module")
def table(work):
    """Saved work-precision table."""
    return json.loads(work.TABLE.read_text())


def find_row(table, problem, name, setting):
    """Return the row of a problem, an integrator and its accuracy setting."""
    return next(
        r
        for r in table["rows"]
        if (r["problem"], r["engine"], r["knob"]) == (problem, name, setting)
    )


@pytest.mark.parametrize("where", ["block", "two"])
def test_exact_dop853_restarted_at_events(engines, problem, where):
    """DOP853 restarted at each event has an error below 5e-9."""
    case = problem(where)
    assert case.error(engines.dop853(case, 1e-10)) < 5e-9


def test_exact_free_decay_by_the_event_driven_solver(engines, problem):
    """The event-driven solver agrees with the closed form of free decay within 1e-11."""
    run, settings, problems = engines.OURS["exact"]
    case = problem("decay")
    assert "decay" in problems and case.error(run(case, settings[0])) < 1e-11


def test_exact_dop853_without_step_limit_misses_events(engines, problem):
    """Without a limit of its step, DOP853 finds 4 of 240 events and gives no warning."""
    case = problem("block")
    slide, events = engines.slide_and_events(case, 1e-8, 1e9)
    assert events == 4 and case.error(slide) > 0.5
    assert engines.slide_and_events(case, 1e-8, 1 / 8)[1] == 240


def test_exact_saved_errors_are_reproduced(engines, problem, table):
    """The errors of the inexpensive rows of the saved table are reproduced within 2 %."""
    for where in ("decay", "block", "two"):
        for name, settings in (
            ("march", (200, 800)),
            ("newmark, and force", (200, 800)),
            ("euler, tanh", (1000,)),
            ("duhamel, static branch", (200, 800)),
        ):
            run, _, problems = engines.OURS[name]
            for setting in settings if where in problems else ():
                case = problem(where)
                saved = find_row(table, where, name, setting)["error"]
                assert case.error(run(case, setting)) == pytest.approx(saved, rel=0.02, abs=1e-11)


def test_exact_saved_table_supports_the_stated_conclusions(work, table):
    """Orders, smallest errors and ratios of CPU time in the saved table are those stated."""
    curve = lambda where, name: work.curve(table["rows"], where, name)  # noqa: E731
    assert {r["problem"] for r in table["rows"]} == {"decay", "block", "two", "patch"}
    for where in ("block", "two"):
        second = curve(where, "newmark, and force")[0]
        assert second[0] / second[-1] > 1000  # ratio of errors for 64 times the steps
        assert curve(where, "newmark, stick speed")[0].min() > 0.05
        assert curve(where, "exact")[0].max() == work.FLOOR
        assert curve(where, "DOP853 + events")[0].min() < 1e-10
        assert curve(where, "SUNDIALS CVODE")[0].min() < 1e-9
    assert curve("block", "euler, tanh")[0].min() > 0.015  # error of the regularised law
    assert curve("block", "newmark, stick speed")[0][-1] == pytest.approx(1.0, abs=0.01)
    # error of the reference solution, a march of 204800 steps
    assert curve("patch", "SUNDIALS CVODE")[0].min() < 1e-7
    march = curve("patch", "march")[0]
    assert march[0] / march[-1] > 1e4
    exact = curve("block", "exact")[1][0]
    ratio = work.ratios(table["rows"], "patch", "march")["SUNDIALS CVODE"]
    assert float(ratio[1e-4].strip("<> ")) > 3
    assert curve("block", "DOP853 + events")[1].min() > 4 * exact
    assert curve("block", "SUNDIALS CVODE")[1][3] > 2 * exact
    assert curve("two", "SUNDIALS CVODE")[1].min() > 2 * curve("two", "exact")[1][0]
    error, seconds = curve("block", "exact, one mode")
    assert error[0] == work.FLOOR and curve("block", "SUNDIALS CVODE")[1].min() > 100 * seconds[0]
    assert curve("block", "DOP853 + events")[1].min() > 300 * seconds[0]


def test_refuses_missing_peer_programs_and_continues(work, engines, monkeypatch, capsys, tmp_path):
    """A missing peer program is named in a message, and the other integrators are still measured."""
    for _, _, _, _, variable, _ in work.PEERS.values():
        monkeypatch.setenv(variable, "/nowhere/python")
    integrators = {"newmark, and force": (engines.newmark_cured, (100,), ("block",))}
    table = work.main(("block",), integrators, repeats=1, path=tmp_path / "t.json")
    assert [r["engine"] for r in table["rows"]] == ["newmark, and force"]
    assert set(table["absent"]) == set(work.PEERS)
    output = capsys.readouterr()
    assert "/nowhere/python" in output.err and "PATCHFEM_SUNDIALS_PYTHON" in output.err
    assert "skipped: Siconos, theta 1/2 is not installed" in output.out


@pytest.mark.share(0, 3)
@pytest.mark.parametrize(
    "name, knob, error", [("SUNDIALS CVODE", 1e-8, 5e-6), ("Siconos, theta 1/2", 1000, 5e-4)]
)
@pytest.mark.parametrize("where", ["decay", "block", "two"])
def test_exact_peer_programs_agree_with_the_reference_motion(
    problem, work, rows, name, knob, error, where
):
    """SUNDIALS and Siconos agree with the reference motion within the stated error."""
    ask, _, _, script, variable, remedy = work.PEERS[name]
    try:
        peer = rows.Peer(name, script, variable, sys.executable, remedy)
    except Missing as absent:
        pytest.skip(str(absent))
    with peer:
        case = problem(where)
        slide, seconds = ask(peer, case, knob)
    assert case.error(slide) < error and seconds > 0


@pytest.mark.slow
def test_exact_patch_motion_by_two_integrators(engines, problem):
    """The time march and DOP853 between reversals agree on elastic-plastic elements.

    DOP853 with longer steps misses reversals.
    """
    case = problem("patch")
    assert case.error(engines.dop853(case, 1e-10)) < 1e-6
    assert case.error(engines.march(case, 3200)) < 1e-4
    slide, events = engines.slide_and_events(case, 1e-8, 1 / 8)
    assert events < 202 and case.error(slide) > 1e-2
