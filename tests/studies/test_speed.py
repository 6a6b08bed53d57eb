"""The study of speeds: its sweeps, its bound for a step, and the figures that pages quote."""

from pathlib import Path

import numpy as np
import pytest
from study_module import make_study_fixture

ROOT = Path(__file__).parents[2]
study = make_study_fixture("speed/speed.py")


@pytest.mark.parametrize(
    "name, fraction",
    [
        ("elastic-plastic", 90),
        pytest.param("static patch, load", 80, marks=pytest.mark.slow),
        pytest.param("shipped rig, load", 50, marks=pytest.mark.slow),
    ],
)
def test_always_sweeps_have_rate_and_reach_tolerance(name, fraction, study):
    """A sweep has a rate, and most of its cases meet the tolerance with their main measures."""
    row = study.measure_sweep(name, 0.064, 3)
    assert row.name == name and row.value > 0 and fraction < row.other <= 100


def test_exact_bound_marches_linear_block(study):
    """The straight-line code of the bound computes the motion of a linear block under a sine, from rest."""
    n_steps = 480
    h = 2 * np.pi / 12
    nodes = np.r_[study.DOP853.C[:12], 1.0, study.DOP853.C_EXTRA] * h
    march = study.compile_steps(study.Law("", 0, {}, "0.0", "v{i}"))
    found, _ = march(n_steps, h, np.cos(nodes), np.sin(nodes))
    t = n_steps * h
    w = np.sqrt(1 - 0.005**2)
    decay = np.exp(-0.005 * t) * (100 * np.cos(w * t) + 0.5 / w * np.sin(w * t))
    assert found == pytest.approx(decay - 100 * np.cos(t), rel=1e-7)


def test_always_step_takes_longer_than_its_bound(study):
    """A step of the engine takes longer than its arithmetic alone, but less than 200 times."""
    row = study.measure_step("tanh")
    assert 0 < row.other < row.value < 200 * row.other


@pytest.mark.slow
def test_always_dop853_takes_longer(study):
    """SciPy's DOP853 with events takes at least ten times as long as the event-driven engine, for an equal error."""
    row = study.measure_dop853()
    assert row.other > 10 * row.value


def read_tables() -> dict[tuple[str, str], list[float]]:
    """Return the numbers of the printed tables by heading and name of the row."""
    page = (ROOT / "studies/speed/README.md").read_text("utf-8")
    block = page.partition("<!-- speeds -->")[2].partition("<!-- end -->")[0]
    numbers = {}
    for table in block.strip().split("\n\n")[1:]:
        heading, _, *rows = (line.strip("| ").split(" | ") for line in table.splitlines())
        numbers |= {(heading[0], row[0]): list(map(float, row[1:])) for row in rows}
    return numbers


def test_always_printed_tables_are_complete(study):
    """The printed tables contain every scene, law and sweep of the study."""
    numbers = read_tables()
    names = {"first": study.FIRST_RUNS, "step": study.LAWS, "cases": study.SWEEPS}
    for kind, expected in names.items():
        heading = study.HEADINGS[kind][0]
        assert [name for first, name in numbers if first == heading] == list(expected)
