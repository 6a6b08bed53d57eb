"""Rigs with smooth friction laws: the choice of the engine `event_driven`, and its agreement with the march."""

import numpy as np
import pytest
from scene_texts import DRIVE, MODE, NONLOCAL, POINT

import patchfem as pf

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


STICKING_BONDS = """
[normal]
load = "310 N"
[friction]
law = "nonlocal"
static = 0.38
kinetic = 0.3
bond_length = "0.7 um"
rest_growth = "0.3 mm/s^2"
slip_growth = "0.25 um"
rest_speed = "0.08 mm/s"
[structure]
moving_mass = "1.1 kg"
[[structure.mode]]
name = "axial"
frequency = "97 Hz"
damping = 0.007
slide = 1.0
[[structure.mode]]
name = "second"
frequency = "190 Hz"
damping = 0.01
slide = 0.5
base = 0.0
output = 0.4
[drive]
kind = "base"
frequency = "93 Hz"
acceleration = "4 g"
cycles = 80
"""


@pytest.mark.parametrize("acceleration, length", [("0.9653 g", "1.2 um"), ("0.5 g", "0.1311 um")])
def test_exact_slip_of_round_off_length_is_no_slip(acceleration, length):
    """An interface that slips for 1e-9 of a cycle at a reversal sticks, and has no phase of slip."""
    sets = {"drive.acceleration": acceleration, "friction.bond_length": length}
    measures = pf.run(STICKING_BONDS, **sets).measures
    assert measures["stick_fraction"].value == 1.0
    assert measures["slip_start_phase"].value is None
    assert "no slip starts" in measures["slip_start_phase"].reason


REVERSING_HYSTERESIS = """
[normal]
load = "73.50593665108302 N"
[friction]
static = 0.3
law = "bouc-wen"
stiffness = "1232443.3094957205 N/m"
exponent = 1.5
shape = 0.8
[structure]
moving_mass = "0.5004130900691659 kg"
[[structure.mode]]
name = "m0"
frequency = "34.428065768473836 Hz"
damping = 0.05
slide = 1.0
base = 0.7881787925704327
output = 1.0
[[structure.mode]]
name = "m1"
frequency = "18.325535978247927 Hz"
damping = 0.01
slide = -0.0999888216581975
base = 0.15399888344197826
output = -0.1453868053313141
[[structure.mode]]
name = "m2"
frequency = "18.940634822131983 Hz"
damping = 0.05
slide = 0.03556741264627589
base = 0.13685350100013466
output = 0.023458311372880236
[drive]
kind = "base"
frequency = "42.552560837248095 Hz"
acceleration = "72.61584730157395 m/s^2"
cycles = 12
"""


def test_exact_slip_starts_do_not_depend_on_round_off():
    """Stick of round-off length at a reversal is not followed by a start of slip."""
    phases = []
    for tolerance in ("1e-3", "1e-9"):
        result = pf.run(REVERSING_HYSTERESIS, **{"accuracy.tolerance": tolerance})
        phases.append(result.measures["slip_start_phase"])
    assert phases[0].value == pytest.approx(phases[1].value, abs=phases[0].error + phases[1].error)


def test_exact_run_that_ends_in_first_cycle_has_rising_times():
    """A run that reaches the travel in its first cycle, with an event of the growing bonds at t = 0, has samples at
    different times and the travel as its largest output."""
    text = SCENE.replace(CONSTANT_BONDS, GROWING_BONDS)
    result = pf.run(text.replace("[structure]\n", '[structure]\ntravel = "20 um"\n'))
    assert (result.settings.engine, result.outcome) == ("event_driven", "exceeds_travel")
    for histories in (result.window, result.response):
        assert (np.diff(histories.time) > 0).all()
    assert np.abs(result.window.output).max() == pytest.approx(20e-6, rel=1e-9)
