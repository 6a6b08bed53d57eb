"""The steady motion over grooves found directly, `accuracy.method = "harmonic"`, beside marches from rest."""

import numpy as np
import pytest
from scene_texts import BLOCK, KEYS

import patchfem as pf
from patchfem.core import NotConverged, Outcome
from patchfem.dynamics.march.march import march
from patchfem.model.model import build
from patchfem.runs.rig import interface
from patchfem.runs.rig.numerics import choose
from patchfem.scene.scene import loads

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
EVERY = [("coulomb", 139), ("coulomb", 143), ("coulomb", 150), ("elastic-plastic", 139), ("elastic-plastic", 143),
         ("elastic-plastic", 150), ("nonlocal", 143), ("tanh", 150)]


def scene(law, *sets):
    return loads(RIG.replace('"coulomb"', f'"{law}"\n{KEYS[law]}'), sets=sets)


def contact_of(text):
    model = build(text)
    return model, interface.contact_of(model, choose(model), None)


def marched(text, cycles=40, steps=400):
    """(half the swing of the last cycle, work of the friction in it, its largest force) of a march from rest."""
    model, contact = contact_of(text)
    done = march(model.rig.modes, model.rig.drive, contact, cycles, steps, window=1)
    assert done.outcome is None
    return float(np.ptp(done.amplitudes[-1])) / 2, done.window_work, float(np.abs(done.window.force).max())


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


@pytest.mark.slow
@pytest.mark.parametrize("law", ["coulomb", "elastic-plastic", "nonlocal", "tanh"])
@pytest.mark.parametrize("frequency", [130, 139, 143, 150, 165])
def test_always_the_steady_motion_with_a_lifted_mass_is_that_of_a_march(law, frequency):
    """Elastic-plastic elements under a force that changes slip a little further in every cycle of a march."""
    asked = scene(law, f"drive.frequency={frequency} Hz", "normal.grooves.lifted_mass=0.3 kg")
    try:
        found = pf.run(asked)
    except NotConverged:
        assert law == "elastic-plastic"
        return
    assert found.outcome is Outcome.STEADY or law == "elastic-plastic"
    for name, true in zip(SHOWN, marched(asked, 200, 1600)):
        one = found.measures[name]
        assert abs(one.value - true) <= (one.error or 0.0) + 1.5e-3 * abs(true), name


def test_exact_coulombs_steady_motion_closes_to_round_off():
    """From stop to release the steps leave 1e-11; the books of the cycle close and the map repeats."""
    found = pf.run(scene("coulomb"))
    assert found.extra["residual"] < 1e-8 and found.extra["map"] == "march"
    assert found.measures["energy_balance"].value < 1e-9
    true = marched(scene("coulomb"), 40)
    for name, value in list(zip(SHOWN, true))[:2]:
        assert found.measures[name].value == pytest.approx(value, rel=1e-7)


@pytest.mark.share(0)
@pytest.mark.parametrize("law", ["elastic-plastic", "tanh"])
def test_always_multipliers_tell_how_a_march_forgets(law):
    """A march that starts beside the steady motion comes back at the rate of the largest multiplier."""
    asked = scene(law, "drive.frequency=150 Hz")
    found, (model, contact) = pf.run(asked), contact_of(asked)
    largest = np.abs(found.extra["multipliers"]).max()
    steps = found.extra["steps_per_cycle"]
    done = march(model.rig.modes, model.rig.drive, contact, 70, steps, window=70).window
    ends = done.modal[::steps, 0] + 1j * done.modal_rate[::steps, 0] / model.rig.drive.omega
    miss = np.abs(ends - ends[-1])
    late = np.flatnonzero((miss < 1e-2 * miss[0]) & (miss > 1e-6 * miss[0]))
    seen = (miss[late[-1]] / miss[late[0]])**(1 / (late[-1] - late[0]))
    assert seen == pytest.approx(largest, abs=5e-3)


def test_exact_the_multipliers_of_next_to_no_friction_are_those_of_the_valley():
    """A small motion about the bottom of the grooves: a linear oscillator of the stiffness N k^2 A beside its mode."""
    asked = scene("tanh", "friction.static=1e-9", "normal.grooves.amplitude=0.5 um", "drive.acceleration=1e-3 m/s^2")
    found, (model, _) = pf.run(asked).extra["multipliers"], contact_of(asked)
    modes, drive, kept = model.rig.modes, model.rig.drive, 0.003 * model.rig.modes.omega[0]
    own = np.sqrt(modes.omega[0]**2 + model.grooves.stiffness(115.0) / modes.mass - kept**2)
    np.testing.assert_allclose(np.abs(found), np.exp(-kept * drive.period), rtol=1e-4)
    assert np.abs(np.angle(found)) == pytest.approx(np.abs(np.angle(np.exp(1j * own * drive.period))), abs=1e-3)


@pytest.mark.slow
def test_always_levels_begin_where_the_last_one_ended_and_what_sticks_is_said():
    text = RIG.replace('acceleration = "5 g"', 'waveform = "levels"\nlevels = ["2 g", "5 g", "6 g"]')
    found = pf.run(loads(text))
    shown = found.extra["curve"]["amplitude"]
    alone = pf.run(scene("coulomb", "drive.acceleration=6 g")).measures["relative_displacement_amplitude"]
    assert shown[0] < 1e-15 and shown[-1] == pytest.approx(alone.value, rel=1e-6)
    assert pf.run(scene("coulomb", "drive.acceleration=2 g")).outcome is Outcome.STUCK


@pytest.mark.slow
def test_always_a_curve_over_frequency_passes_the_points_of_single_runs():
    text = RIG.replace('frequency = "143 Hz"\nacceleration', 'waveform = "sweep"\nfrom = "135 Hz"\nto = "155 Hz"\n'
                       'rate = "1 Hz/s"\nacceleration').replace("cycles = 30\n", "")
    curve = pf.run(loads(text)).extra["curve"]
    at = int(np.argmin(np.abs(curve["frequency"] - 150)))
    single = pf.run(scene("coulomb", f"drive.frequency={float(curve['frequency'][at])!r} Hz"))
    assert curve["amplitude"][at] == pytest.approx(single.measures["relative_displacement_amplitude"].value, rel=1e-6)


def test_always_the_plan_says_how():
    said = "the steady motion is found by a time integration whose initial state is corrected until the motion repeats"
    assert all(said in pf.plan(scene(law)).verdict for law in ("coulomb", "elastic-plastic"))


def test_always_pieces_that_give_way_move_as_a_march_has_them():
    """Points behind the shear modes of a patch: the march at the same steps."""
    pieces = BLOCK + 'element_size = "2 mm"\ngrooves = {wavelength = "80 um", amplitude = "7.5 um"}\n[contact.shear]\n'
    text = pieces + RIG[RIG.index("[friction]"):].replace('"coulomb"', '"elastic-plastic"\nbond_length = "1 um"')
    steps = ["accuracy.steps_per_cycle=100"]
    balanced = pf.run(loads(text, sets=steps))
    marched = pf.run(loads(text, sets=[*steps, "accuracy.method=march", "drive.cycles=40"]))
    assert balanced.extra["map"] == "march" and balanced.outcome is Outcome.STEADY
    for name in SHOWN[:2]:
        assert balanced.measures[name].value == pytest.approx(marched.measures[name].value, rel=1e-5)
    area = balanced.patch.pieces.interface.weight
    fields, time = balanced.fields["shear_stress"], balanced.fields["time"]
    force = np.interp(time, balanced.response.time, balanced.response.force)
    np.testing.assert_allclose(fields[1:] @ area, force[1:], rtol=1e-6, atol=1e-6 * 115)
