"""The comparison of time integrators: the figures stated in its studies."""

import sys

import pytest
from command_line import read_json
from study_module import make_study_fixture

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
def table(work):
    """Saved work-precision table."""
    return read_json(work.TABLE)


@pytest.mark.parametrize("where", ["block", "two"])
def test_exact_dop853_restarted_at_events(engines, problem, where):
    """DOP853 restarted at each event has an error below 5e-9."""
    case = problem(where)
    assert case.error(engines.dop853(case, 1e-10)) < 5e-9


def test_exact_free_decay_by_the_event_driven_solver(engines, problem):
    """The event-driven solver agrees with the closed form of free decay within 1e-11."""
    run, settings, problems = engines.OURS["event_driven"]
    case = problem("decay")
    assert "decay" in problems and case.error(run(case, settings[-1])) < 1e-11


def test_saved_errors_are_reproduced(engines, problem, table):
    """The errors of the inexpensive rows of the saved table are reproduced within 2 %."""
    errors = {(row["problem"], row["engine"], row["knob"]): row["error"] for row in table["rows"]}
    for where in ("decay", "block", "two"):
        for name, settings in (
            ("march", (200, 800, 6400)),
            ("newmark, and force", (200, 800)),
            ("euler, tanh", (1000,)),
            ("duhamel, static branch", (200, 800)),
        ):
            run, _, problems = engines.OURS[name]
            for setting in settings if where in problems else ():
                case = problem(where)
                saved = errors[where, name, setting]
                assert case.error(run(case, setting)) == pytest.approx(saved, rel=0.02, abs=1e-11)


def test_saved_table_supports_the_stated_conclusions(work, table):
    """Orders, smallest errors and ratios of CPU time in the saved table are those stated."""
    curve = lambda where, name: work.curve(table["rows"], where, name)[0]  # noqa: E731
    for where in ("block", "two"):
        second = curve(where, "newmark, and force")
        assert second[0] / second[-1] > 1000  # ratio of errors for 64 times the steps
        assert curve(where, "newmark, stick speed").min() > 0.05
        assert curve(where, "DOP853 + events").min() < 1e-10
        assert curve(where, "SUNDIALS CVODE").min() < 1e-9
    assert curve("block", "euler, tanh").min() > 0.015  # error of the regularised law
    # error of the reference solution, a march of 204800 steps
    for name in ("SUNDIALS CVODE", "event_driven"):
        assert curve("patch", name).min() < 1e-7
    march = curve("patch", "march")
    assert march[0] / march[-1] > 1e4
    for where, error, stated in (
        ("block", 1e-6, {"march": 4, "SUNDIALS CVODE": 23, "DOP853 + events": 39}),
        ("block", 1e-4, {"Siconos, theta 1/2": 110}),
        ("two", 1e-6, {"SUNDIALS CVODE": 12, "DOP853 + events": 11}),
        ("two", 1e-4, {"Siconos, theta 1/2": 67}),
        ("patch", 1e-4, {"march": 3.3, "SUNDIALS CVODE": 7.7, "DOP853 + events": 16}),
        ("patch", 1e-6, {"SUNDIALS CVODE": 20, "DOP853 + events": 120}),
    ):
        found = work.ratios(table["rows"], where, "event_driven")
        for name, ratio in stated.items():
            assert float(found[name][error].strip("<> ")) == pytest.approx(ratio, rel=0.05)
