"""Forecasts of a plan about the tolerance: they agree with runs, and their remedies make runs meet
the tolerance."""

import pytest
from command_line import run_cli
from scene_texts import BENCH, POINT
from tolerance_forecasts import apply_proposal, exceeds_tolerance

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
SHEARED_RIG = (
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


def add_tolerance(text: str, tolerance: float, keys: str = "") -> str:
    """Return a scene with a tolerance and further keys of [accuracy]."""
    return f"{text}[accuracy]\ntolerance = {tolerance:g}\n{keys}"


def forecast_tolerance(text: str) -> dict:
    """Return the forecast of the plan about the tolerance."""
    return pf.plan(pf.load(text)).as_json()["tolerance"]


@pytest.mark.parametrize(
    "text, remedy",
    [
        pytest.param(
            add_tolerance(SPRING, 1e-4, "steps_per_cycle = 200\n"),
            {"accuracy.steps_per_cycle": None},
            id="spring rig",
        ),
        pytest.param(
            add_tolerance(BONDS, 1e-4, "steps_per_cycle = 100\n"),
            {"accuracy.steps_per_cycle": 2600},
            id="bench",
        ),
        pytest.param(
            add_tolerance(
                PATCH.replace("[contact]\n", '[contact]\nelement_size = "0.1 mm"\n'), 1e-3
            ),
            {"contact.element_size": None},
            id="patch",
        ),
    ],
)
def test_exact_forecast_of_missed_tolerance_has_working_remedy(text, remedy, tmp_path):
    """If the plan predicts that a run misses its tolerance, the run misses it, and with the remedy
    it meets it."""
    prediction = forecast_tolerance(text)
    assert (
        prediction["missed"]
        and prediction["cure"].items() >= remedy.items()
        and exceeds_tolerance(text)
    )
    remedied = apply_proposal(text, prediction["cure"])
    assert not exceeds_tolerance(remedied)
    assert forecast_tolerance(remedied) | {"asked": 0} == {
        "asked": 0,
        "missed": False,
        "cure": {},
        "sentence": "",
    }
    scene = tmp_path / "scene.toml"
    scene.write_text(text, "utf-8")
    assert f"says     {prediction['sentence']}\n" in run_cli("plan", scene).out


@pytest.mark.share(1, 2)
@pytest.mark.parametrize(
    "text",
    [
        add_tolerance(TANH, 1e-3),
        add_tolerance(BONDS, 1e-4, "steps_per_cycle = 2600\n"),
        add_tolerance(PATCH, 1e-4),
        add_tolerance(SHEARED_RIG, 1e-2, "steps_per_cycle = 800\n"),
        read_template("rig"),
        read_template("linear"),
        read_template("joint"),
    ],
)
def test_always_met_tolerance_is_not_predicted_as_missed(text):
    """The plan predicts no missed tolerance for runs that meet it."""
    assert not forecast_tolerance(text)["missed"] and not exceeds_tolerance(text)


def test_exact_remedy_of_unreachable_tolerance_is_larger_tolerance():
    """A tolerance that no mesh reaches has the remedy of a larger tolerance, which a run meets."""
    prediction = forecast_tolerance(add_tolerance(PATCH, 1e-8))
    assert (
        prediction["cure"] == {"accuracy.tolerance": 1e-3}
        and "by any mesh" in prediction["sentence"]
    )
    assert not exceeds_tolerance(apply_proposal(add_tolerance(PATCH, 1e-8), prediction["cure"]))
