"""What a plan foresees of a tolerance: it says so where runs miss it, and its cure makes them meet it."""

import pytest
from command_line import cli
from scene_texts import BENCH, POINT
from tolerance_forecasts import cured, misses

import patchfem as pf
from patchfem.scene import read_template

MODE = """\
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
[drive]
kind = "base"
waveform = "sine"
frequency = "150 Hz"
acceleration = "5 g"
cycles = 60
"""
TANH = POINT + '[friction]\nlaw = "tanh"\nstatic = 0.3\nreference_speed = "10 mm/s"\n' + MODE
SPRING = POINT + '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nstiffness = "10 N/um"\n' + MODE
SOFT = (
    """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "steel"
[contact.tilt]
angle = "0.02 mrad"
[contact.shear]
[friction]
law = "nonlocal"
reading = "stretch"
static = 0.3
bond_length = "1 um"
"""
    + MODE
)
BONDS = BENCH.replace('law = "coulomb"', 'law = "nonlocal"\nbond_length = "1 um"')
PATCH = read_template("patch").partition("[accuracy]")[0]


def asked(text: str, tolerance: float, keys: str = "") -> str:
    return f"{text}[accuracy]\ntolerance = {tolerance:g}\n{keys}"


def foreseen(text: str) -> dict:
    return pf.plan(pf.load(text)).as_json()["tolerance"]


@pytest.mark.parametrize(
    "text, cure",
    [
        pytest.param(
            asked(TANH, 1e-3, "steps_per_cycle = 100\n"),
            {"accuracy.steps_per_cycle": None},
            id="tanh rig",
        ),
        pytest.param(
            asked(SPRING, 1e-4, "steps_per_cycle = 200\n"),
            {"accuracy.steps_per_cycle": None},
            id="spring rig",
        ),
        pytest.param(
            asked(BONDS, 1e-4, "steps_per_cycle = 100\n"),
            {"accuracy.steps_per_cycle": 2600},
            id="bench",
        ),
        pytest.param(
            asked(PATCH.replace("[contact]\n", '[contact]\nelement_size = "0.1 mm"\n'), 1e-3),
            {"contact.element_size": None},
            id="patch",
        ),
        pytest.param(
            asked(SOFT, 1e-3, "steps_per_cycle = 200\n"),
            {"accuracy.steps_per_cycle": 1600},
            id="rig with shear",
        ),
    ],
)
def test_exact_what_is_foreseen_as_missed_is_missed_and_its_cure_meets_the_tolerance(
    text, cure, tmp_path
):
    found = foreseen(text)
    assert found["missed"] and found["cure"].items() >= cure.items() and misses(text)
    better = cured(text, found["cure"])
    assert not misses(better)
    assert foreseen(better) | {"asked": 0} == {
        "asked": 0,
        "missed": False,
        "cure": {},
        "sentence": "",
    }
    scene = tmp_path / "scene.toml"
    scene.write_text(text, "utf-8")
    assert f"says     {found['sentence']}\n" in cli("plan", scene).out


@pytest.mark.share(1, 2, 3)
@pytest.mark.parametrize(
    "text",
    [
        asked(TANH, 1e-3),
        asked(BONDS, 1e-4, "steps_per_cycle = 2600\n"),
        asked(PATCH, 1e-4),
        asked(SOFT, 1e-2, "steps_per_cycle = 800\n"),
        read_template("rig"),
        read_template("linear"),
        read_template("joint"),
    ],
)
def test_always_nothing_is_foreseen_of_a_tolerance_that_is_met(text):
    assert not foreseen(text)["missed"] and not misses(text)


def test_exact_a_tolerance_below_any_mesh_is_cured_by_the_tolerance():
    found = foreseen(asked(PATCH, 1e-8))
    assert found["cure"] == {"accuracy.tolerance": 1e-3} and "by any mesh" in found["sentence"]
    assert not misses(cured(asked(PATCH, 1e-8), found["cure"]))
