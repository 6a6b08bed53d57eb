"""Figures 28 and 29: the stated figures of the time histories, computed again."""

import numpy as np
import pytest
from study_module import assert_contains, make_study_fixture

figures = make_study_fixture("report/figures_28_29.py")


@pytest.fixture(scope="module")
def runs_and_picture(figures, tmp_path_factory):
    """Runs of the two least expensive cases, and their picture."""
    path = tmp_path_factory.mktemp("histories") / "x.svg"
    return figures.main(path, [figures.CASES[2], figures.CASES[4]]), path.read_text()


def check_peaks(figures, name, run):
    """Check that the answer states the peaks of a run beside those of the rig."""
    measured = {
        "Fig. 28: 135 Hz, 5 g": "8.4 g and 0.44 mil",
        "Fig. 28 (text): 135 Hz, 6 g": "9.5 g and 0.30 mil",
        "Fig. 29: 143 Hz, 5 g": "6.0 g and 0.23 mil",
    }[name]
    assert run.stays
    assert_contains(
        figures.ANSWER, f"{run.acceleration:.1f} g and {run.displacement:.2f} mil ({measured})"
    )


def test_exact_stable_motion_satisfies_the_equation_of_motion(runs_and_picture):
    """The histories satisfy m a + K x + c v + F = 0, with a absolute and x, v relative to the base."""
    histories = runs_and_picture[0][0].seen
    mass = 1.123
    omega = 2 * np.pi * 143
    acceleration = (
        histories.acceleration + omega**2 * histories.output + 0.006 * omega * histories.output_rate
    )
    np.testing.assert_allclose(
        mass * acceleration, -histories.force, atol=1e-9 * np.abs(histories.force).max()
    )


@pytest.mark.slow
def test_figures_28_and_29_all_runs_have_stated_figures(figures, tmp_path, capsys):
    """All five runs have the stated peaks and distortion."""
    runs = figures.main(tmp_path / "x.svg")
    assert [run.stays for run in runs] == [True, True, True, True, False]
    for run in runs[:3]:
        check_peaks(figures, run.title, run)
    more = runs[3]
    assert_contains(
        figures.ANSWER, f"friction the amplitude stays at {more.displacement:.2f} mil at 8 g"
    )
    assert_contains(figures.__doc__, f"of the first at 5 g and {more.distortion:.2f} at 8 g")
    assert figures.ANSWER in capsys.readouterr().out


@pytest.mark.slow
def test_figures_28_and_29_level_of_runaway(figures):
    """The block runs away at the stated levels, from rest and released beside its valley."""
    run = figures.run_block("", 143, 7.9, {})
    assert run.stays
    assert_contains(
        figures.ANSWER, f"7.9 g the amplitude of the block stays at {run.displacement:.2f} mil;"
    )
    assert [figures.run_block("", 135, level, {}).stays for level in (8.0, 8.1)] == [True, False]
    levels = [round(7 + 0.1 * k, 1) for k in range(14)]
    assert [figures.last_level(f, levels) for f in (135, 143)] == [8.2, 8.0]
    assert [figures.let_go(30, level) for level in (7.0, 7.5)] == [True, False]
    assert [figures.let_go(40, level) for level in (6.5, 7.0)] == [True, False]
