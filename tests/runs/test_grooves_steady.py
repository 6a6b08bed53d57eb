"""Steady states over grooves found directly (`accuracy.method = "harmonic"`) agree with time
integrations from rest."""

import numpy as np
import pytest
from scene_texts import GROOVED, KEYS, STRUCTURE

import patchfem as pf
from patchfem import build
from patchfem.scene import loads

RIG = GROOVED + STRUCTURE + '[accuracy]\nmethod = "harmonic"\n'
MAIN_MEASURES = ("relative_displacement_amplitude", "loop_area", "friction_force_peak")


def load_rig(law, *sets):
    """Return the scene of the rig with a friction law and --set options."""
    return loads(RIG.replace('"coulomb"', f'"{law}"\n{KEYS[law]}'), sets=sets)


def test_exact_coulomb_steady_state_closes_to_round_off():
    """The residual of the cycle is below 1e-8, its energy balance closes within 1e-9, and it agrees
    with a long run within 1e-7."""
    result = pf.run(load_rig("coulomb"))
    assert result.motion.steady.residual < 1e-8 and result.settings.map == "shooting"
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
    multipliers = pf.run(scene_to_run).motion.steady.multipliers
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
