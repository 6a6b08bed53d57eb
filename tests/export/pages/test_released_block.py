"""Headline of a block that is released: its first swing, its time of rest, and the total work of friction."""

import re
from math import pi

import numpy as np
import pytest
from command_line import run_cli

from patchfem.export import draw_charts
from patchfem.export.drawing.charts import history_charts
from patchfem.export.page_data import Motion, RunData, SceneText, Verdict
from patchfem.export.pages.released import describe_swing
from patchfem.export.report import find_picture
from patchfem.scene import read_template


def test_exact_headline_of_coulomb_oscillator_agrees_with_closed_form(tmp_path):
    """Swings, reversals, time of rest and work in the headline agree with the closed form within 0.5 %.

    Each half swing reduces the amplitude by 2 mu N/k, and the block stops where the spring force is
    below mu N.
    """
    scene = tmp_path / "free.toml"
    text = read_template("rig")
    text = re.sub(
        r"\[drive\].*?(?=\n\[)",
        '[drive]\nkind = "free"\nduration = "0.3 s"\n[structure.start]\n'
        'displacement = ["0.5 mm"]\n',
        text,
        flags=re.S,
    )
    scene.write_text(re.sub(r"damping = \S+", "damping = 0", text), "utf-8")
    answer = run_cli("run", scene, "-o", tmp_path / "out", "--no-page")
    headline = next(line for line in answer.out.splitlines() if line.startswith("Released at "))
    match = re.match(
        r"Released at 500 um, the output first swings to -(\S+) um, reverses (\d+) times and comes to "
        r"rest at (\S+) um after (\S+) ms; friction dissipates (\S+) (\S+) during the whole run\.$",
        headline,
    )
    assert match, headline
    load, mass, static = (
        float(re.search(pattern, text)[1])
        for pattern in (r'load = "(\S+) N"', r'moving_mass = "(\S+) kg"', r"static = (\S+)")
    )
    stiffness = mass * (2 * pi * 143) ** 2
    stick_limit = static * load / stiffness
    reversals = [5e-4]
    while reversals[-1] > stick_limit:
        reversals.append(reversals[-1] - 2 * stick_limit)
    rest_position = abs(reversals[-1])
    assert float(match[1]) * 1e-6 == pytest.approx(reversals[1], rel=5e-3)
    assert abs(abs(float(match[3])) * 1e-6 - rest_position) < 5e-3 * 5e-4
    # the last reversal may lie within 1 % of the rest position and is then not counted
    assert int(match[2]) in (len(reversals) - 2, len(reversals) - 1)
    assert float(match[4]) == pytest.approx(1e3 * (len(reversals) - 1) / (2 * 143), rel=5e-3)
    work = stiffness * (5e-4**2 - rest_position**2) / 2
    assert float(match[5]) * {"mJ": 1e-3, "J": 1.0}[match[6]] == pytest.approx(work, rel=1e-3)
    assert "± 0" not in headline and "half peak-to-peak" not in headline


def test_exact_description_of_unfinished_decay():
    """The description of a decay that does not end states the first swing and the amplitude at the end."""
    time = np.linspace(0, 1, 2001)
    description = describe_swing(time, 1e-3 * np.cos(2 * pi * 20 * time) * np.exp(-time))
    assert description.startswith(
        "released at 1 mm, the output first swings to -975 um and at the end, after 1 s, still "
        "moves with an amplitude (half peak-to-peak of its last whole cycle) of "
    )
    assert (
        describe_swing(time, np.full(2001, 5e-4)) == "released at 500 um, the output does not move"
    )
    assert describe_swing(time, 1e-3 * np.exp(-50 * time)).startswith(
        "released at 1 mm, the output goes to "
    )


def test_exact_history_chart_shows_all_reversals():
    """The chart of the whole run is one line from the release, through the stored reversals, to the last cycles."""
    last_times = np.linspace(0.27, 0.3, 5001)  # more points than a line of the page has
    time = np.r_[0, 3.5, 7, 10.5, 14, 17.5] * 1e-3
    swing = np.array([500, -399, 299, -200, 102, -5]) * 1e-6
    zeros = np.zeros(last_times.size)
    history = {
        "time": np.r_[time, last_times],
        "displacement": np.r_[swing, zeros - 5e-6],
        "force": np.zeros(5007),
    }
    window = {
        "time": last_times,
        "displacement": zeros - 5e-6,
        "acceleration": zeros,
        "base": zeros,
    }
    motion = Motion(history, {}, window, 1 / 143)
    data = RunData(SceneText("a", "", ""), Verdict({}, "", 43.0, "released"), {}, motion=motion)
    picture = find_picture("history", data)
    first_line, last_line = history_charts(*picture.values)[0]["marks"]
    assert {first_line["kind"], last_line["kind"]} == {"line"}
    assert first_line["x"].size == 7
    assert first_line["x"][-1] == last_line["x"][0]
    assert np.allclose(first_line["y"][:6], 1e6 * swing)
    assert "turning points and stops were kept" in picture.caption
    drawn_line = draw_charts.figure(picture.charts(*picture.values)).axes[0].lines[0].get_ydata()
    assert np.allclose(drawn_line[:6], 1e6 * swing)


def test_exact_output_is_at_rest_within_its_error():
    """An output is at rest if it moves by less than its error."""
    time = np.linspace(0, 1, 4001)
    # the amplitude at the end is 0.05 to 0.1 um
    output = 1e-4 + 1e-3 * np.exp(-10 * time) * np.cos(2 * pi * 20 * time)
    assert "comes to rest at 100 um after" in describe_swing(time, output)
    assert "still moves" in describe_swing(time, output - 1e-4)
    assert "comes to rest" in describe_swing(
        time, output - 1e-4, 2e-7
    ) and "still moves" in describe_swing(time, output - 1e-4, 1e-8)
