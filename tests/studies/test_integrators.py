"""The studies of the comparison integrators keep their word."""

import numpy as np
import pytest
from test_studies import study


@pytest.fixture(scope="module")
def failure():
    return study("integrators/failure.py")


def test_exact_two_masses_by_the_event_engine(failure):
    """The numbers of a second, 40-digit computation."""
    times = np.array([8.079711463905416, 10.00410372419476, 12.96534318337974, 15.73725378200728, 400.0])
    found = failure.exact("two", times)
    assert np.abs(failure.exact("two", np.linspace(0, 8.0797, 50)).slide).max() <= 1e-15
    assert found.slide == pytest.approx([0, 0.8994115234033145, -0.5914209838254593, 0.8835834423211487,
                                         -0.37952939486], abs=1e-10)
    assert np.abs(failure.exact("sdof", np.linspace(199, 200, 4001) * 2 * np.pi).slide).max() == pytest.approx(
        0.28704671337871602595, abs=1e-7)


def test_exact_the_sentences_on_the_report_s_failure(failure, capsys):
    rows, curves = failure.main(draw=False)
    at = {r.name: r for r in rows}
    loose, speed = at["Fig 17, 18: displacement 1e-2"], at["Fig 19, 20: velocity 1e-4"]
    assert (loose.early, loose.moves, loose.force) == pytest.approx((0.1146, 5.5, 2.56), abs=5e-3)
    assert loose.worst == pytest.approx(5.4, abs=0.05) and loose.failed == 0
    assert any("wrong by 80 of its limit" in text for text in loose.run.warnings)
    for tight in (at["displacement 1e-6"], speed):
        assert tight.early < 0.0095 and 0.3 < tight.failed < 0.37 and 0.15 < tight.jumps < 0.25
    assert 0.2 < at["force 1e-3"].failed < 0.26 and at["force 1e-3"].jumps > 0.2
    held, elastic = at["static branch, force 1e-6"], at["Fig 21, 22: elastic 0.01, velocity 1e-6"]
    assert held.early < 2e-4 and abs(held.error) < 3e-3 and held.jumps < 0.01
    assert elastic.early == pytest.approx(0.0099, abs=1e-4) and abs(elastic.error) < 5e-3 and elastic.failed == 0
    assert at["3.12 as printed, eps 0.03"].error < -90
    caught, asked = curves[1e-3, False], curves[1e-3, True]
    assert [caught[1], caught[3]] == pytest.approx([0.057, -0.19], abs=5e-3)
    assert np.all(np.array(caught[4:]) < -0.99)
    assert asked[4] == pytest.approx(-9e-4, abs=1e-4) and abs(asked[-1]) < 2e-5
    assert "Newmark" in capsys.readouterr().out


def test_exact_the_picture_of_the_failure(failure, tmp_path):
    rows = [failure.solve(*case) for case in failure.CASES if case[0] in failure.DRAWN]
    path = failure.picture(rows, {(1e-3, False): [0.1, 0.2], (1e-3, True): [0.1, 0.01]}, tmp_path / "one.svg")
    text = path.read_text()
    assert all(title in text for title in failure.DRAWN.values()) and "Newmark, stick speed" in text
