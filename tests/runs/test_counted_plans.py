"""What a plan counts beside what a run counts: the load that an approach makes, steps, strips of bonds."""

import numpy as np
import pytest

from patchfem import load, plan
from patchfem.runs import choose_numerics
from patchfem.runs.rig.lists import estimate_list_cost
from patchfem.runs.run import run

TURNED = """[contact]
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


def test_always_a_moment_beside_an_approach_is_in_the_load_that_a_plan_counts_with():
    """Without it 155 N stood for 2.6e6 N, 60 steps per cycle for 230000: 1.9 s were planned and 14 s taken."""
    scene = load(TURNED)
    foreseen = plan(scene)
    found = run(scene, estimate=False)
    assert foreseen.model.nominal_load == pytest.approx(
        found.measures["normal_load"].value, rel=0.1
    )
    assert found.extra["book"]["iterations"] <= 1.5 * foreseen.steps


PUSHED = """[normal]
load = "310.4 N"
[friction]
law = "nonlocal"
static = 0.352
bond_length = "1.023 um"
order = 0.9949
rest_growth = "29.36 m/s^2"
slip_growth = "0.199 um"
[structure]
moving_mass = "0.8552 kg"
[[structure.mode]]
name = "m0"
frequency = "261.8 Hz"
damping = 0.003
slide = 1.0
base = 0.8
[[structure.mode]]
name = "m1"
frequency = "616 Hz"
damping = 0.003
slide = 0.3
base = 0.1
[drive]
kind = "base"
waveform = "step"
acceleration = "26.94 m/s^2"
cycles = {cycles}
[accuracy]
tolerance = 0.01
"""


def test_always_the_plan_estimates_the_list_of_bonds_of_a_block_under_a_step():
    """It hardly moves on its bonds: one strip of each step, 3800 of them, was kept where 66 were planned."""
    scene = load(PUSHED.format(cycles=12))
    foreseen = plan(scene).unknowns["bond_list_about"]
    book = run(scene, estimate=False).extra["book"]
    assert book["strips"] <= 1.2 * foreseen


HELD = """[structure]
masses = ["0.3454 kg", "1.339 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1523000 N/m"
[[structure.spring]]
between = [2, 1]
stiffness = "209600 N/m"
[[structure.spring]]
between = [2, 0]
stiffness = "1670000 N/m"
[[structure.damper]]
between = [1, 0]
coefficient = "5.339 N s/m"
[[structure.damper]]
between = [2, 1]
coefficient = "44.18 N s/m"
[[structure.interface]]
between = [1, 0]
load = "34.74 N"
law = "nonlocal"
static = 0.527
bond_length = "0.1298 um"
kinetic = 0.2237
order = {order}
reading = "report"
[drive]
kind = "base"
waveform = "levels"
levels = ["24.7 m/s^2", "29.5 m/s^2"]
frequency = "257.1 Hz"
cycles = {cycles}
[accuracy]
tolerance = 0.003
"""


def test_always_the_plan_estimates_the_work_of_a_stuck_block():
    """The increments that are tried are counted, each of which takes 2.5e-7 s per strip (measured); half of the strips
    at the end are there in the mean."""
    sine = (
        HELD.format(order=1.085, cycles=4)
        .replace('levels = ["24.7 m/s^2", "29.5 m/s^2"]', 'acceleration = "29.5 m/s^2"')
        .replace('"levels"', '"sine"')
    )
    scene = load(sine)
    model = plan(scene).model
    book = run(scene, estimate=False).extra["book"]
    counted = 2.5e-7 * book["iterations"] * book["strips"] / 2
    assert counted / 12 <= estimate_list_cost(model, choose_numerics(model))[1] <= 12 * counted


JUST_HELD = """[normal]
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
def test_always_the_plan_estimates_the_list_of_bonds_of_a_barely_stuck_block(order):
    """Its limit is 1.13 times what holds it. Bonds of order 0 pull alike at any stretch: it turns back in every step,
    and each leaves a strip. 55 and 61 strips were planned."""
    scene = load(JUST_HELD.format(order=order))
    found = plan(scene)
    book = run(scene, estimate=False).extra["book"]
    assert book["strips"] / 3 <= found.unknowns["bond_list_about"] <= 3 * book["strips"]
    assert any(
        "bonds of order 0 keep the block from sliding" in text for text in found.verdict
    ) == (order == "0.0")


SLIDES = """[normal]
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
def test_exact_the_kinetic_coefficient_decides_whether_a_slipping_block_sticks_again(
    kinetic, sticks
):
    text = SLIDES.format(kinetic=kinetic)
    found = plan(text)
    run_ = run(load(text))
    said = next(one for one in found.verdict if one.startswith("D = 0.9 is below 1"))
    assert (
        (run_.measures["stick_fraction"].value > 0)
        == sticks
        == ("alternates between stick and slip" in said)
    )
    assert ("does not limit the amplitude" in said) != sticks
    assert found.groups["D"] == pytest.approx(0.9) and found.groups["D_kinetic"] == pytest.approx(
        kinetic
    )
    assert found.groups["knee_force"] == pytest.approx(4 / np.pi * kinetic * 100)
