"""Rigs under smooth laws: which of them the integrator of high order takes, and its measures against the march."""

import numpy as np
import pytest
from scene_texts import DRIVE, MODE, NONLOCAL, POINT

import patchfem as pf
from patchfem.runs import choose_numerics

SCENE = (
    POINT
    + NONLOCAL.replace("1 um", "5 um")
    + MODE
    + DRIVE.replace("frequency", 'waveform = "sine"\nfrequency')
)
GROWTH = 'bond_length = "5 um"\nkinetic = 0.2\nrest_growth = "10 m/s^2"\nslip_growth = "0.2 um"'
LENGTH = 'bond_length = "5 um"'


SHORT = 'bond_length = "0.1 nm"\nkinetic = 0.2\nrest_growth = "10 m/s^2"\nslip_growth = "0.01 nm"'
NAME = 'law = "nonlocal"'
STEPS = "cycles = 30\n[accuracy]\n"


@pytest.mark.parametrize(
    "name, old, new",
    [
        ("smooth", LENGTH, LENGTH),
        ("smooth", LENGTH, GROWTH),
        ("smooth", LENGTH, LENGTH + "\nbreakaway = 0.3"),
        ("smooth", NAME, 'law = "lugre"\nstiffness = "1e7 N/m"\nstribeck_speed = "1 cm/s"'),
        ("smooth", NAME, 'law = "bouc-wen"\nstiffness = "1e7 N/m"'),
        ("march", LENGTH, SHORT),
        ("march", LENGTH, GROWTH + "\nbreakaway = 0.3"),
        ("march", LENGTH, LENGTH + "\norder = 0.5"),
        ("march", LENGTH, LENGTH + '\nreading = "report"'),
        ("march", "cycles = 30", STEPS + "steps_per_cycle = 400"),
        ("march", "cycles = 30", STEPS + 'method = "march"'),
        ("march", 'waveform = "sine"', 'waveform = "levels"\nlevels = ["3 g", "5 g"]'),
        ("march", "slide = 1.0", 'slide = 1.0\n[structure.stiffening]\ncubic = "1e12 N/m^3"'),
    ],
)
def test_exact_smooth_laws_are_integrated_at_high_order_and_others_marched(name, old, new):
    text = SCENE.replace(old, new)
    text = text.replace(LENGTH, "") if old == NAME else text
    text = text.replace('acceleration = "5 g"\n', "") if "levels" in new else text
    assert choose_numerics(pf.build(text)).engine == name


@pytest.mark.parametrize("law", [LENGTH, GROWTH])
def test_always_the_integrator_and_the_march_agree_within_their_bars(law):
    text = SCENE.replace(LENGTH, law)
    fine = pf.run(text)
    march = pf.run(text, **{"accuracy.steps_per_cycle": 1600})
    assert (fine.extra["engine"], march.extra["engine"]) == (
        "smooth",
        "march",
    ) and fine.outcome == march.outcome
    assert fine.measures.keys() == march.measures.keys()
    for name, one in fine.measures.items():
        other = march.measures[name]
        if one.value is not None and name not in ("work_check", "energy_balance"):
            assert abs(one.value - other.value) <= one.error + 2 * other.error + other.floor, name
    main = fine.measures["relative_displacement_amplitude"]
    assert main.error < 1e-6 * main.value and fine.measures["energy_balance"].value < 1e-8
    times = fine.window.time
    assert np.allclose(np.diff(times), times[1] - times[0], rtol=1e-6) and times.size > 400


def test_always_a_motion_that_all_but_stands_at_a_reversal_goes_on():
    """Its rate and its acceleration vanish together, so either way it seems to turn at once; a march agrees."""
    text = """
[normal]
load = "84.82758620689656 N"
[friction]
law = "nonlocal"
static = 0.3
bond_length = "1 um"
[structure]
moving_mass = "0.884 kg"
mode = [{name = "axial", frequency = "143 Hz", damping = 0.003, slide = 1.0}]
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "33.333333333333336 m/s^2"
cycles = 20
"""
    found = pf.run(text)
    marched = pf.run(text, **{"accuracy.method": "march"})
    one, other = (run.measures["relative_displacement_amplitude"] for run in (found, marched))
    assert found.extra["engine"] == "smooth"
    assert abs(one.value - other.value) <= one.error + other.error
