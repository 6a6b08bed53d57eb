"""The targets of the dynamics: what is measured is right; times only where they have a wide margin."""

import numpy as np
import pytest
from study_module import study

from patchfem.dynamics.march.models import jenkins_model


@pytest.fixture(scope="module")
def targets():
    return study("targets/dynamics.py")


@pytest.mark.slow
def test_exact_what_is_timed_is_right(targets):
    assert targets.cycle_of_events()[1] <= 1e-12
    assert targets.steady_point()[1] <= 1e-10


@pytest.mark.slow
def test_always_many_times_faster_than_others(targets):
    assert targets.cycle_of_peer("DOP853") > 300 * targets.cycle_of_events()[0]


def test_exact_the_numpy_march_is_the_compiled_one():
    march, plain = study("targets/dynamics_march.py"), study("targets/dynamics_plain.py")
    modes = march.basis(10)
    _, slides = plain.plain(modes, plain.soft(200))
    assert slides == pytest.approx(march.marched(modes, march.bonded(200)), abs=1e-10)
    _, slides = plain.plain(modes, plain.sharp(30))
    mine = march.marched(modes, jenkins_model(*march.elements(30)))
    assert np.abs(slides - mine).max() < 1e-3 * np.abs(mine).max() and np.abs(mine).max() > 0.15
    assert np.isfinite(march.marched(modes, march.bonded(200, 16))).all()


def test_always_the_table_says_what_is_missed(targets, capsys):
    def absent():
        raise targets.Missing("nothing there")

    rows = (targets.Target("fine", lambda: 1e-6, 2e-6, "s", "other", lambda: 4e-6, 3),
            targets.Target("slow", lambda: 1e-6, 2e-6, "s", "other", lambda: 2e-6, 3),
            targets.Target("wrong", lambda: 1e-6, 1e-9, ""), targets.Target("alone", lambda: 1e-3, 1.0, "s", "peer",
                                                                            absent, 3))
    found = targets.main(rows)
    assert [met for _, _, met in found.values()] == [True, False, False, True]
    said = capsys.readouterr().out.splitlines()
    assert "4  other (wanted 3)" in said[1] and "NO" in said[2] and "nothing there" in said[4]
    at_once = targets.main((targets.Target("at once", lambda: 0.0, 1.0, "s", "other", lambda: 1e-3, 3),))
    assert at_once["at once", "other"] == (0.0, np.inf, True)  # a busy clock may tell no time at all
    assert [targets.text_of(v, "s") for v in (2e-9, 3e-6, 0.5)] == ["2 ns", "3 us", "500 ms"]


def test_always_every_row_names_its_limit(targets):
    assert len({(t.text, t.beside) for t in targets.TARGETS}) == len(targets.TARGETS) == 11
    for one in targets.TARGETS:
        assert one.limit > 0 and one.unit in ("s", "") and bool(one.beside) == (one.other is not None)
