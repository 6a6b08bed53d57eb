"""The headline of a block that is released: its first swing, when it rests, and the work of friction in all."""

import re
from math import pi

import numpy as np
import pytest
from command_line import cli

import patchfem as pf
from patchfem.export import describe_release, draw_charts, headline_sentence
from patchfem.export.drawing.charts import history_charts
from patchfem.export.page_data import Motion, RunData, SceneText, Verdict
from patchfem.export.pages.released import describe_swing
from patchfem.export.report import find_picture
from patchfem.scene import read_template

IWAN = """
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "100 Hz"
damping = 0.002
slide = 1.0
[friction]
law = "iwan"
static = 0.3
stiffness = "0.2 N/um"
chi = -0.4
beta = 0.5
[normal]
load = "20 N"
[drive]
kind = "free"
displacement = "300 um"
cycles = 60
"""


def test_exact_a_block_on_a_rubbing_spring_turns_where_the_closed_form_says(tmp_path):
    """Every half swing takes 2 mu N/k off the amplitude; the block rests where the spring no longer pulls it on."""
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
    answer = cli("run", scene, "-o", tmp_path / "out", "--no-page")
    said = next(line for line in answer.out.splitlines() if line.startswith("Released at "))
    found = re.match(
        r"Released at 500 um, the output first swings to -(\S+) um, reverses (\d+) times and comes to "
        r"rest at (\S+) um after (\S+) ms; friction dissipates (\S+) (\S+) during the whole run\.$",
        said,
    )
    assert found, said
    load, mass, static = (
        float(re.search(pattern, text)[1])
        for pattern in (r'load = "(\S+) N"', r'moving_mass = "(\S+) kg"', r"static = (\S+)")
    )
    stiffness = mass * (2 * pi * 143) ** 2
    far = static * load / stiffness
    turns = [5e-4]
    while turns[-1] > far:
        turns.append(turns[-1] - 2 * far)
    rest = abs(turns[-1])
    assert float(found[1]) * 1e-6 == pytest.approx(turns[1], rel=5e-3)
    assert abs(abs(float(found[3])) * 1e-6 - rest) < 5e-3 * 5e-4
    # the last may be within a hundredth of the rest
    assert int(found[2]) in (len(turns) - 2, len(turns) - 1)
    assert float(found[4]) == pytest.approx(1e3 * (len(turns) - 1) / (2 * 143), rel=5e-3)
    work = stiffness * (5e-4**2 - rest**2) / 2
    assert float(found[5]) * {"mJ": 1e-3, "J": 1.0}[found[6]] == pytest.approx(work, rel=1e-3)
    assert "± 0" not in said and "half peak-to-peak" not in said


def test_exact_a_motion_that_has_not_come_to_rest():
    time = np.linspace(0, 1, 2001)
    said = describe_swing(time, 1e-3 * np.cos(2 * pi * 20 * time) * np.exp(-time))
    assert said.startswith(
        "released at 1 mm, the output first swings to -975 um and at the end, after 1 s, still "
        "moves with an amplitude (half peak-to-peak of its last whole cycle) of "
    )
    assert (
        describe_swing(time, np.full(2001, 5e-4)) == "released at 500 um, the output does not move"
    )
    assert describe_swing(time, 1e-3 * np.exp(-50 * time)).startswith(
        "released at 1 mm, the output goes to "
    )


def test_exact_what_the_last_cycles_leave_is_no_headline_of_a_release():
    zero = {"value": 0.0, "unit": "m", "error": 0.0}
    summary = {
        "kind": "rig",
        "outcome": "stuck",
        "measures": {
            "relative_displacement_amplitude": zero,
            "loop_area": zero | {"unit": "J"},
            "friction_work": {"value": 0.5, "unit": "J", "error": 0.01},
        },
    }
    assert (
        headline_sentence(summary, 40.0, released="released it rests")
        == "Released it rests; friction dissipates 500 ± 10 mJ during the whole run."
    )


def test_exact_the_picture_of_the_whole_run_shows_every_turn():
    """Six kept samples of a swing, a rest, and the last cycles sample by sample: one line from the release on."""
    late = np.linspace(0.27, 0.3, 5001)  # more than a line of the page has points
    time = np.r_[0, 3.5, 7, 10.5, 14, 17.5] * 1e-3
    swing = np.array([500, -399, 299, -200, 102, -5]) * 1e-6
    still = np.zeros(late.size)
    history = {
        "time": np.r_[time, late],
        "displacement": np.r_[swing, still - 5e-6],
        "force": np.zeros(5007),
    }
    window = {"time": late, "displacement": still - 5e-6, "acceleration": still, "base": still}
    motion = Motion(history, {}, window, 1 / 143)
    data = RunData(SceneText("a", "", ""), Verdict({}, "", 43.0, "released"), {}, motion=motion)
    found = find_picture("history", data)
    early, last = history_charts(*found.values)[0]["marks"]
    assert {early["kind"], last["kind"]} == {"line"}
    assert early["x"].size == 7
    assert early["x"][-1] == last["x"][0]
    assert np.allclose(early["y"][:6], 1e6 * swing)
    assert "turning points and stops were kept" in found.caption
    whole = draw_charts.figure(found.charts(*found.values)).axes[0].lines[0].get_ydata()
    assert np.allclose(whole[:6], 1e6 * swing)


@pytest.mark.parametrize("cycles", [60, 200])
def test_always_a_joint_that_still_swings_is_not_said_to_rest(cycles):
    """Sliders of law 'iwan' always slip a little, so that the swing becomes smaller, but never ends."""
    found = pf.run(re.sub(r"cycles = \d+", f"cycles = {cycles}", IWAN))
    said = describe_release(found)
    last = found.measures["relative_displacement_amplitude"].value
    assert last > 50e-9 and "comes to rest" not in said
    told = re.search(
        r"at the end, after \S+ \S+, still moves with an amplitude \(half peak-to-peak of its last whole "
        r"cycle\) of (\S+) (nm|um)",
        said,
    )
    assert float(told[1]) * {"nm": 1e-9, "um": 1e-6}[told[2]] == pytest.approx(last, rel=5e-3)


def test_exact_an_output_rests_where_it_moves_by_less_than_its_error():
    time = np.linspace(0, 1, 4001)
    # at the end 0.1 to 0.05 um
    output = 1e-4 + 1e-3 * np.exp(-10 * time) * np.cos(2 * pi * 20 * time)
    assert "comes to rest at 100 um after" in describe_swing(time, output)
    assert "still moves" in describe_swing(time, output - 1e-4)
    assert "comes to rest" in describe_swing(
        time, output - 1e-4, 2e-7
    ) and "still moves" in describe_swing(time, output - 1e-4, 1e-8)
