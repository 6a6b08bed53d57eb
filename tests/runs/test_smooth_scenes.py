"""Rigs with smooth friction laws: the choice of the high-order integrator, and its agreement with
the march."""

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
GROWING_BONDS = (
    'bond_length = "5 um"\nkinetic = 0.2\nrest_growth = "10 m/s^2"\nslip_growth = "0.2 um"'
)
CONSTANT_BONDS = 'bond_length = "5 um"'


SHORT_BONDS = (
    'bond_length = "0.1 nm"\nkinetic = 0.2\nrest_growth = "10 m/s^2"\nslip_growth = "0.01 nm"'
)
LAW_NAME = 'law = "nonlocal"'
ACCURACY_TABLE = "cycles = 30\n[accuracy]\n"


@pytest.mark.parametrize(
    "name, old, new",
    [
        ("smooth", CONSTANT_BONDS, GROWING_BONDS),
        ("smooth", CONSTANT_BONDS, CONSTANT_BONDS + "\nbreakaway = 0.3"),
        ("smooth", LAW_NAME, 'law = "lugre"\nstiffness = "1e7 N/m"\nstribeck_speed = "1 cm/s"'),
        ("march", CONSTANT_BONDS, SHORT_BONDS),
        ("march", CONSTANT_BONDS, GROWING_BONDS + "\nbreakaway = 0.3"),
        ("march", CONSTANT_BONDS, CONSTANT_BONDS + "\norder = 0.5"),
        ("march", "cycles = 30", ACCURACY_TABLE + "steps_per_cycle = 400"),
        ("march", 'waveform = "sine"', 'waveform = "levels"\nlevels = ["3 g", "5 g"]'),
        ("march", "slide = 1.0", 'slide = 1.0\n[structure.stiffening]\ncubic = "1e12 N/m^3"'),
    ],
)
def test_exact_smooth_laws_use_high_order_integrator(name, old, new):
    """Smooth friction laws are integrated by the engine `smooth`; laws and drives with jumps, and
    prescribed steps, by the march."""
    text = SCENE.replace(old, new)
    text = text.replace(CONSTANT_BONDS, "") if old == LAW_NAME else text
    text = text.replace('acceleration = "5 g"\n', "") if "levels" in new else text
    assert choose_numerics(pf.build(text)).engine == name


@pytest.mark.parametrize("law", [CONSTANT_BONDS, GROWING_BONDS])
def test_always_smooth_engine_and_march_agree_within_errors(law):
    """The high-order integrator and a march of 1600 steps per cycle agree within their errors."""
    text = SCENE.replace(CONSTANT_BONDS, law)
    smooth = pf.run(text)
    march = pf.run(text, **{"accuracy.steps_per_cycle": 1600})
    assert (smooth.extra["engine"], march.extra["engine"]) == (
        "smooth",
        "march",
    ) and smooth.outcome == march.outcome
    assert smooth.measures.keys() == march.measures.keys()
    for name, smooth_measure in smooth.measures.items():
        march_measure = march.measures[name]
        if smooth_measure.value is not None and name not in ("work_check", "energy_balance"):
            assert (
                abs(smooth_measure.value - march_measure.value)
                <= smooth_measure.error + 2 * march_measure.error + march_measure.floor
            ), name
    main = smooth.measures["relative_displacement_amplitude"]
    assert main.error < 1e-6 * main.value and smooth.measures["energy_balance"].value < 1e-8
    times = smooth.window.time
    assert np.allclose(np.diff(times), times[1] - times[0], rtol=1e-6) and times.size > 400


def test_always_vanishing_acceleration_at_reversal_agrees_with_march():
    """A motion whose velocity and acceleration vanish together, so that it would reverse at once in
    either direction, continues and agrees with a march."""
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
    smooth = pf.run(text)
    marched = pf.run(text, **{"accuracy.method": "march"})
    smooth_measure, march_measure = (
        run.measures["relative_displacement_amplitude"] for run in (smooth, marched)
    )
    assert smooth.extra["engine"] == "smooth"
    assert (
        abs(smooth_measure.value - march_measure.value)
        <= smooth_measure.error + march_measure.error
    )
