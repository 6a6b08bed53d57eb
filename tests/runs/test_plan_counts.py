"""Plans agree with the run: strips of bonds, sticking, and the measured probe."""

import json
from time import perf_counter

import numpy as np
import pytest
from command_line import run_cli

from patchfem import load, plan
from patchfem.runs.run import run

APPROACH_WITH_MOMENT = """[contact]
length = "11.85 mm"
width = "18.38 mm"
height = "6.926 mm"
substrate = "steel"
element_size = "0.2 mm"
[contact.approach]
distance = "42.73 nm"
[contact.load_line]
moment = "10.78 kN m"
[friction]
law = "tanh"
static = 0.552
reference_speed = "2.391 mm/s"
[structure]
moving_mass = "0.821 kg"
[[structure.mode]]
name = "m0"
frequency = "57.41 Hz"
damping = 0.2
slide = 1.0
base = 0.8
[drive]
kind = "base"
acceleration = "6.357 m/s^2"
frequency = "218.5 Hz"
cycles = 14
[accuracy]
tolerance = 0.003
"""


BARELY_STUCK = """[normal]
load = "12.9 N"
[friction]
law = "nonlocal"
static = 0.3
bond_length = "0.3 um"
order = {order}
[structure]
moving_mass = "0.38 kg"
[[structure.mode]]
name = "m0"
frequency = "113 Hz"
damping = 0.01
slide = 1.0
[drive]
kind = "base"
frequency = "100 Hz"
acceleration = "9 m/s^2"
cycles = 4
[accuracy]
tolerance = 0.01
"""


@pytest.mark.parametrize("order", ["0.0", "0.5"])
def test_always_plan_estimates_bond_list_near_friction_limit(order):
    """The plan estimates the strips of a block whose friction limit is 1.13 times the load within a
    factor of 3. Bonds of order 0 have a constant force, so that the velocity reverses in every step
    and each reversal adds a strip."""
    scene = load(BARELY_STUCK.format(order=order))
    run_plan = plan(scene)
    counts = run(scene, estimate=False).extra["book"]
    assert counts["strips"] / 3 <= run_plan.unknowns["bond_list_about"] <= 3 * counts["strips"]
    assert any(
        "bonds of order 0 keep the block from sliding" in text for text in run_plan.verdict
    ) == (order == "0.0")


FORCED_BLOCK = """[normal]
load = "100 N"
[friction]
law = "coulomb"
static = 0.9
kinetic = {kinetic}
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "50 Hz"
damping = 0.02
slide = 1.0
[drive]
kind = "force"
frequency = "50 Hz"
force = "100 N"
cycles = 200
"""


@pytest.mark.parametrize("kinetic, sticks", [(0.2, False), (0.85, True)])
def test_exact_kinetic_coefficient_decides_about_sticking(kinetic, sticks):
    """Whether a sliding block sticks again depends on the kinetic coefficient, in the run and in
    the verdict of the plan."""
    text = FORCED_BLOCK.format(kinetic=kinetic)
    run_plan = plan(text)
    result = run(load(text))
    sentence = next(line for line in run_plan.verdict if line.startswith("D = 0.9 is below 1"))
    assert (
        (result.measures["stick_fraction"].value > 0)
        == sticks
        == ("alternates between stick and slip" in sentence)
    )
    assert ("does not limit the amplitude" in sentence) != sticks
    assert run_plan.groups["D"] == pytest.approx(0.9) and run_plan.groups[
        "D_kinetic"
    ] == pytest.approx(kinetic)
    assert run_plan.groups["knee_force"] == pytest.approx(4 / np.pi * kinetic * 100)


PROBED = """[contact]
length = "10 mm"
width = "10 mm"
height = "5 mm"
load = "100 N"
substrate = "steel"
element_size = "1 mm"
[friction]
law = "coulomb"
static = 0.3
[slide]
kind = "sine"
amplitude = "5 um"
frequency = "50 Hz"
cycles = 2
"""


def test_exact_probe_measures_what_the_plan_does_not_predict(tmp_path, monkeypatch):
    """`plan` predicts no time; with `--probe` it states the measured time of a run, in all and by stage, the static
    measures of this run, and what each setting multiplies."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text(PROBED)
    described = json.loads(run_cli("plan", "a.toml", "--json").out)
    for name in ("seconds", "bytes", "compile_seconds", "steps"):
        assert described[name] is None
    begin = perf_counter()
    probed = json.loads(run_cli("plan", "a.toml", "--probe", "--json").out)
    elapsed = perf_counter() - begin
    stages = probed["probe"]["seconds"]
    assert 0 < stages["contact"] <= stages["total"] == probed["seconds"] <= elapsed
    found = run(load(PROBED), estimate=False).measures["normal_stiffness"].value
    assert probed["probe"]["normal_stiffness"] == pytest.approx(found, rel=1e-9)
    text = " ".join(probed["probe"]["sentences"])
    assert "slide.cycles" in text and "contact.element_size" in text and "drive.cycles" not in text
