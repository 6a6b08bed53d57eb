"""The steady motion over grooves found directly, `accuracy.method = "harmonic"`, beside marches from rest."""

import numpy as np
import pytest
from scene_texts import BLOCK, KEYS

import patchfem as pf
from patchfem import build
from patchfem.core import Outcome
from patchfem.dynamics.march.march import march
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
SHOWN = ("relative_displacement_amplitude", "loop_area", "friction_force_peak")
EVERY = [
    ("coulomb", 139),
    ("coulomb", 143),
    ("coulomb", 150),
    ("elastic-plastic", 139),
    ("elastic-plastic", 143),
    ("elastic-plastic", 150),
    ("nonlocal", 143),
    ("tanh", 150),
]


def scene(law, *sets):
    return loads(RIG.replace('"coulomb"', f'"{law}"\n{KEYS[law]}'), sets=sets)


def contact_of(text):
    model = build(text)
    return model, interface.make_contact(model, choose_numerics(model), None)


def marched(text, cycles=40, steps=400):
    """(half the swing of the last cycle, work of the friction in it, its largest force) of a march from rest."""
    model, contact = contact_of(text)
    done = march(model.rig.modes, model.rig.drive.signal, contact, cycles, steps, window=1)
    assert done.outcome is None
    return (
        float(np.ptp(done.amplitudes[-1])) / 2,
        done.window_work,
        float(np.abs(done.window.force).max()),
    )


@pytest.mark.share(1, 4, 6)
@pytest.mark.parametrize(("law", "frequency"), EVERY)
def test_always_the_steady_motion_is_that_of_a_march(law, frequency):
    asked = scene(law, f"drive.frequency={frequency} Hz")
    found = pf.run(asked)
    assert found.outcome is Outcome.STEADY and found.measures["energy_balance"].value < 2e-3
    for name, true in zip(SHOWN, marched(asked, steps=1600 if "bond_length" in KEYS[law] else 400)):
        one = found.measures[name]
        assert abs(one.value - true) <= one.error + 1.5e-3 * abs(true), name
        assert one.error < 5e-3 * abs(one.value)


def test_exact_coulombs_steady_motion_closes_to_round_off():
    """From stop to release the steps leave 1e-11; the books of the cycle close and the map repeats."""
    found = pf.run(scene("coulomb"))
    assert found.extra["residual"] < 1e-8 and found.extra["map"] == "march"
    assert found.measures["energy_balance"].value < 1e-9
    true = marched(scene("coulomb"), 40)
    for name, value in list(zip(SHOWN, true))[:2]:
        assert found.measures[name].value == pytest.approx(value, rel=1e-7)


def test_exact_the_multipliers_of_next_to_no_friction_are_those_of_the_valley():
    """A small motion about the bottom of the grooves: a linear oscillator of the stiffness N k^2 A beside its mode."""
    asked = scene(
        "tanh",
        "friction.static=1e-9",
        "normal.grooves.amplitude=0.5 um",
        "drive.acceleration=1e-3 m/s^2",
    )
    found, (model, _) = pf.run(asked).extra["multipliers"], contact_of(asked)
    modes = model.rig.modes
    drive = model.rig.drive.signal
    kept = 0.003 * model.rig.modes.omega[0]
    own = np.sqrt(modes.omega[0] ** 2 + model.grooves.stiffness(115.0) / modes.mass - kept**2)
    np.testing.assert_allclose(np.abs(found), np.exp(-kept * drive.period), rtol=1e-4)
    assert np.abs(np.angle(found)) == pytest.approx(
        np.abs(np.angle(np.exp(1j * own * drive.period))), abs=1e-3
    )


def test_always_elastic_pieces_move_as_in_a_march():
    """Points behind the shear modes of a patch: the march at the same steps."""
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
    for name in SHOWN[:2]:
        assert balanced.measures[name].value == pytest.approx(
            marched.measures[name].value, rel=1e-5
        )
    area = balanced.patch.pieces.interface.weight
    fields = balanced.fields["shear_stress"]
    time = balanced.fields["time"]
    force = np.interp(time, balanced.response.time, balanced.response.force)
    np.testing.assert_allclose(fields[1:] @ area, force[1:], rtol=1e-6, atol=1e-6 * 115)
