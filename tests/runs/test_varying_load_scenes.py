"""Rigs with modes that change the normal load (pitch, heave), and rigs with a prescribed varying
load."""

import numpy as np
import pytest
from command_line import read_json
from scene_runs import load_scene, run_scene
from scene_texts import COATED, DRIVE, MODE, RIG, make_friction_table

import patchfem as pf
from patchfem.core import Outcome

PITCH = RIG.replace("slide = 0.1", 'slide = 0.1\npitch = "40 rad/m"').replace(
    "cycles = 200", "cycles = 12"
)
COARSE_SETTINGS = "contact.element_size=400 um; accuracy.steps_per_cycle=200"

AMPLITUDE, STEADY = "relative_displacement_amplitude", "relative_displacement_amplitude_steady"
SHAKEN = """[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "a"
frequency = "50 Hz"
damping = 0.01
slide = 1.0
[normal]
load = "2 N"
amplitude = "1 N"
frequency = "{frequency} Hz"
[friction]
static = 0.4
law = {law}
[drive]
kind = "base"
frequency = "40 Hz"
acceleration = "3 m/s^2"
cycles = 300
"""


# The Coulomb and tanh cases would each compile a time loop that no other test needs.
@pytest.mark.share(2)
@pytest.mark.parametrize(
    "law",
    [
        '"nonlocal"\nbond_length = "1 um"',
        '"coulomb"',
        '"elastic-plastic"\nbond_length = "1 um"',
        '"tanh"\nreference_speed = "1 mm/s"',
    ],
)
def test_exact_pitching_mode_balances_energy_and_fields(law):
    """The energy balance closes within 1e-10, and in every frame pressure and gap exclude each
    other."""
    text = PITCH.replace('"nonlocal"', law).replace(
        'static = 0.3\nbond_length = "1 um"', "static = 0.3"
    )
    result = run_scene(text, COARSE_SETTINGS, estimate=False)
    assert result.measures["energy_balance"].value <= 1e-10
    assert result.measures["energy_created"].value == 0
    fields = result.fields
    patch = result.patch
    load = result.response.extra["normal_load"]
    sums = fields["normal_stress"] @ patch.pieces.interface.weight
    assert sums[0] == pytest.approx(patch.pressure.load) and np.ptp(sums) > 0
    assert load.min() - 1e-9 <= sums.min() and sums.max() <= load.max() + 1e-9
    assert (fields["gap"] >= 0).all() and not (fields["gap"] * fields["normal_stress"]).any()
    assert (np.abs(fields["shear_stress"]) <= 0.3 * fields["normal_stress"] + 1e-6).all()
    assert np.ptp(load) > 1e-3 * load[0]


@pytest.mark.parametrize("steps", [100, 400])
def test_always_coulomb_friction_with_heave_and_pitch_converges(steps):
    """Rigid friction that brings the slide back to rest also moves the load; its energy is part of the balance."""
    text = (
        COATED.replace("0.5 mm", "1.5 mm")
        + '[contact.crown]\nradius = "100 m"\n'
        + make_friction_table("coulomb")
        + MODE
        + 'normal = 0.3\npitch = "1 rad/m"\n'
        + DRIVE
    )
    changes = f"accuracy.method=march; drive.cycles=12; accuracy.steps_per_cycle={steps}"
    result = run_scene(text, changes, estimate=False)
    assert result.outcome is not Outcome.NOT_CONVERGED, result.message
    assert result.measures["energy_balance"].value <= 1e-10


@pytest.mark.parametrize("law", ["coulomb", "elastic-plastic", "tanh"])
def test_exact_load_that_is_zero_at_the_start(law):
    """The march and the engine from event to event agree for a load 20 N (1 - cos 2 pi f t)."""
    load = '[normal]\nload = "20 N"\namplitude = "20 N"\nfrequency = "50 Hz"\nphase = "180 deg"\n'
    text = load + make_friction_table(law) + MODE + DRIVE
    marched, exact = (
        run_scene(text, f"drive.cycles=10; accuracy.method={method}")
        for method in (
            "march; accuracy.steps_per_cycle=200; accuracy.tolerance=0.05",
            "exact",
        )
    )
    for name in ("relative_displacement_amplitude", "friction_work", "slip_amplitude"):
        first, second = marched.measures[name], exact.measures[name]
        assert abs(first.value - second.value) <= 1.5 * (first.error + second.error), name
        assert first.error <= 0.05 * second.value


@pytest.mark.parametrize("frequency", [20, 80 / 3, 60, 80])
@pytest.mark.parametrize(
    "law",
    [
        '"coulomb"',
        '"elastic-plastic"\nbond_length = "10 um"',
        '"tanh"\nreference_speed = "10 mm/s"',
    ],
)
def test_always_steady_amplitude_is_that_of_common_period(law, frequency):
    """The steady amplitude of a short run covers the amplitude of a long run, whatever the period of the load."""
    text = SHAKEN.format(law=law, frequency=frequency)
    long = run_scene(text)
    amplitude = long.measures[AMPLITUDE]
    assert long.outcome is Outcome.STEADY
    steady_values = []
    for cycles in (19, 24, 28, 45):
        found = run_scene(text, f"drive.cycles={cycles}")
        steady = found.measures.get(STEADY)
        if steady is not None and steady.value is not None:
            steady_values.append(steady.value)
            assert abs(steady.value - amplitude.value) <= steady.error + amplitude.error
    assert steady_values
    assert found.outcome is Outcome.STEADY
    assert found.measures[AMPLITUDE].value == pytest.approx(amplitude.value, rel=1e-4)


@pytest.mark.parametrize(("frequency", "cycles"), [(14.8, 100), (13.3333, 400000)])
def test_exact_no_common_period_gives_no_steady_amplitude(frequency, cycles, tmp_path):
    """A run that is shorter than the common period of load and drive is not steady, and says why."""
    text = SHAKEN.format(law='"coulomb"', frequency=frequency)
    result = pf.run(load_scene(text, "drive.cycles=60"))
    reason = f"load and drive repeat together only after {cycles} cycles of the drive"
    assert result.outcome is Outcome.TRANSIENT
    assert result.measures[STEADY].value is None
    assert result.measures[STEADY].reason.startswith(reason)
    assert result.measures["drift_per_cycle"].value is None
    result.save(tmp_path)
    verdict = read_json(tmp_path / "summary.json")["verdict"]
    assert f"Whether the motion is steady is unknown: {reason}" in str(verdict)


LOWER = """[contact]
length = "2.3 mm"
width = "11.5 mm"
height = "1 mm"
load = "194 N"
substrate = "steel"
crown = {radius = "2.34 m", on = "lower"}
[friction]
static = 0.6
law = "elastic-plastic"
stiffness = "5.45e6 N/m"
[structure]
moving_mass = "1.34 kg"
[[structure.mode]]
name = "a"
frequency = "163 Hz"
damping = 0.014
slide = 1.0
[drive]
kind = "base"
frequency = "125 Hz"
acceleration = "11 g"
cycles = 6
"""


def test_error_over_the_lower_piece_includes_the_mesh():
    """The points of the upper piece pass the edges of contact, whose place on a mesh of 25 um has an error of .1 %."""
    steps = "accuracy.steps_per_cycle=800; contact.element_size={} um"
    coarse, fine = (run_scene(LOWER, steps.format(size)).measures for size in (25, 6.25))
    for name in (AMPLITUDE, "loop_area", "absolute_acceleration_fundamental"):
        assert coarse[name].error > abs(coarse[name].value - fine[name].value), name
        assert coarse[name].error < 0.1 * coarse[name].value, name
    assert coarse[AMPLITUDE].error > 1e-4 * coarse[AMPLITUDE].value
