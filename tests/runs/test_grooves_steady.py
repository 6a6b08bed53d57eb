"""Steady states over grooves found directly (`accuracy.method = "harmonic"`) agree with time
integrations from rest."""

import numpy as np
import pytest
from scene_texts import BLOCK, KEYS

import patchfem as pf
from patchfem import build
from patchfem.core import Outcome
from patchfem.points.time_march import march
from patchfem.runs import choose_numerics
from patchfem.runs.rig import interface
from patchfem.scene import loads

RIG = """
[normal]
load = "115 N"
grooves = {wavelength = "80 um", amplitude = "7.5 um"}
[friction]
law = "coulomb"
static = 0.4
[structure]
moving_mass = "1.2 kg"
mode = [{name = "axial", frequency = "143 Hz", damping = 0.003, slide = 1.0}]
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 30
[accuracy]
method = "harmonic"
"""
MAIN_MEASURES = ("relative_displacement_amplitude", "loop_area", "friction_force_peak")
LAW_AND_FREQUENCY = [
    ("elastic-plastic", 139),
    ("elastic-plastic", 143),
    ("elastic-plastic", 150),
    ("nonlocal", 143),
]


def load_rig(law, *sets):
    """Return the scene of the rig with a friction law and --set options."""
    return loads(RIG.replace('"coulomb"', f'"{law}"\n{KEYS[law]}'), sets=sets)


def make_model_and_contact(text):
    """Return the model of a scene and the contact of its time integration."""
    model = build(text)
    return model, interface.make_contact(model, choose_numerics(model), None)


def march_last_cycle(text, cycles=40, steps=400):
    """Return half of the peak-to-peak displacement, the friction work and the largest force of the
    last cycle of a march from rest."""
    model, contact = make_model_and_contact(text)
    run = march(model.rig.modes, model.rig.drive.signal, contact, cycles, steps, window=1)
    assert run.outcome is None
    return (
        float(np.ptp(run.extremes[-1])) / 2,
        run.window_work,
        float(np.abs(run.window.force).max()),
    )


@pytest.mark.share(4, 6)
@pytest.mark.parametrize(("law", "frequency"), LAW_AND_FREQUENCY)
def test_always_steady_state_agrees_with_march(law, frequency):
    """Steady states of laws with memory agree with a march from rest within their errors plus 0.15 %."""
    scene_to_run = load_rig(law, f"drive.frequency={frequency} Hz")
    result = pf.run(scene_to_run)
    assert result.outcome is Outcome.STEADY and result.measures["energy_balance"].value < 2e-3
    for name, reference in zip(
        MAIN_MEASURES,
        march_last_cycle(scene_to_run, steps=1600 if "bond_length" in KEYS[law] else 400),
    ):
        measure = result.measures[name]
        assert abs(measure.value - reference) <= measure.error + 1.5e-3 * abs(reference), name
        assert measure.error < 5e-3 * abs(measure.value)


def test_exact_coulomb_steady_state_closes_to_round_off():
    """The residual of the cycle is below 1e-8, its energy balance closes within 1e-9, and it agrees
    with a long run within 1e-7."""
    result = pf.run(load_rig("coulomb"))
    assert result.extra["residual"] < 1e-8 and result.extra["map"] == "shooting"
    assert result.measures["energy_balance"].value < 1e-9
    run = pf.run(load_rig("coulomb", "accuracy.method=exact", "drive.cycles=100"))
    for name in MAIN_MEASURES[:2]:
        assert result.measures[name].value == pytest.approx(run.measures[name].value, rel=1e-7)


def test_exact_multipliers_agree_with_linear_groove_stiffness():
    """With hardly any friction, a small motion at the bottom of the grooves has the Floquet
    multipliers of a linear oscillator with the added stiffness N k^2 A."""
    scene_to_run = load_rig(
        "tanh",
        "friction.static=1e-9",
        "normal.grooves.amplitude=0.5 um",
        "drive.acceleration=1e-3 m/s^2",
    )
    multipliers = pf.run(scene_to_run).extra["multipliers"]
    model = build(scene_to_run)
    modes = model.rig.modes
    drive = model.rig.drive.signal
    decay_rate = 0.003 * model.rig.modes.omega[0]
    omega = np.sqrt(
        modes.omega[0] ** 2 + model.grooves.stiffness(115.0) / modes.mass - decay_rate**2
    )
    np.testing.assert_allclose(np.abs(multipliers), np.exp(-decay_rate * drive.period), rtol=1e-4)
    assert np.abs(np.angle(multipliers)) == pytest.approx(
        np.abs(np.angle(np.exp(1j * omega * drive.period))), abs=1e-3
    )


def test_always_sheared_patch_on_grooves_agrees_with_march():
    """A patch with [contact.shear] on grooves agrees with a march of the same steps, and its
    tractions add up to the friction force."""
    pieces = (
        BLOCK
        + 'element_size = "2 mm"\ngrooves = {wavelength = "80 um", amplitude = "7.5 um"}\n[contact.shear]\n'
    )
    text = pieces + RIG[RIG.index("[friction]") :].replace(
        '"coulomb"', '"elastic-plastic"\nbond_length = "1 um"'
    )
    steps = ["accuracy.steps_per_cycle=100"]
    balanced = pf.run(loads(text, sets=steps))
    marched = pf.run(loads(text, sets=[*steps, "accuracy.method=march", "drive.cycles=40"]))
    assert balanced.extra["map"] == "march" and balanced.outcome is Outcome.STEADY
    for name in MAIN_MEASURES[:2]:
        assert balanced.measures[name].value == pytest.approx(
            marched.measures[name].value, rel=1e-5
        )
    area = balanced.patch.pieces.interface.weight
    fields = balanced.fields["shear_stress"]
    time = balanced.fields["time"]
    force = np.interp(time, balanced.response.time, balanced.response.force)
    np.testing.assert_allclose(fields[1:] @ area, force[1:], rtol=1e-6, atol=1e-6 * 115)
