"""Figs 28 and 29: what the study says of the runs, recomputed."""

import numpy as np
import pytest
from study_module import study


def inside(text, *parts):
    """Every part stands in the text."""
    text = " ".join(text.split())
    missing = [part for part in parts if part not in text]
    assert not missing, f"{missing} not in: {text}"


@pytest.fixture(scope="module")
def figures():
    return study("report/figures_28_29.py")


@pytest.fixture(scope="module")
def drawn(figures, tmp_path_factory):
    path = tmp_path_factory.mktemp("histories") / "x.svg"
    return dict(zip(("28", "text", "29", "stable", "unstable"), figures.main(path))), path.read_text()


def test_figures_28_and_29_what_is_drawn(figures, drawn):
    """The peaks named are those of the runs; 8 g leaves, and stays with 2 % more friction."""
    runs, text = drawn
    assert [run.stays for run in runs.values()] == [True, True, True, True, False]
    for name, read in (("28", "8.4 and 0.44"), ("text", "9.5 and 0.30"), ("29", "6.0 and 0.23")):
        one = runs[name]
        inside(figures.ANSWER, f"{one.acceleration:.1f} g and {one.displacement:.2f} mil for {read}")
    stable, unstable = runs["stable"], runs["unstable"]
    inside(figures.ANSWER, f"at 8.0 g after {unstable.cycles:.0f} cycles",
           f"it at {stable.displacement:.2f} mil at 8 g")
    inside(figures.__doc__, f"is {runs['29'].distortion:.2f} of the first at 5 g and {stable.distortion:.2f} at 8 g")
    assert np.abs(unstable.seen.output).max() > 50e-6 > np.abs(stable.seen.output).max()
    inside(figures.REPRODUCED, "in part", "135 Hz")
    assert ">runs away<" in text


def test_exact_the_block_that_stays_obeys_newton(drawn):
    """m a + K x + c v + F = 0, a absolute, x and v on the base, F the force that the histories tell."""
    seen = drawn[0]["29"].seen
    mass, omega = 1.123, 2 * np.pi * 143
    pull = seen.acceleration + omega**2 * seen.output + 0.006 * omega * seen.output_rate
    np.testing.assert_allclose(mass * pull, -seen.force, atol=1e-9 * np.abs(seen.force).max())


@pytest.mark.slow
def test_figures_28_and_29_where_the_block_leaves(figures):
    at = figures.moved("", 143, 7.9, {})
    assert at.stays
    inside(figures.ANSWER, f"stays at {at.displacement:.2f} mil at 7.9 g")
    assert [figures.moved("", 135, level, {}).stays for level in (8.0, 8.1)] == [True, False]
    levels = [round(7 + 0.1 * k, 1) for k in range(14)]
    assert [figures.last_level(f, levels) for f in (135, 143)] == [8.2, 8.0]
    assert [figures.let_go(30, level) for level in (7.0, 7.5)] == [True, False]
    assert [figures.let_go(40, level) for level in (6.5, 7.0)] == [True, False]
