"""Modes measured with the joint bolted: the stiffness of the joint is removed from them."""

import numpy as np
import pytest
from scene_texts import COATED, COULOMB, DRIVE, POINT, SHEAR, make_friction_table

import patchfem as pf

MODES = """\
[structure]
moving_mass = "0.884 kg"
%s
[[structure.mode]]
name = "axial"
frequency = "%r Hz"
damping = 0.003
slide = %r
output = %r
"""

SECOND = """\
[[structure.mode]]
name = "yaw"
frequency = "%r Hz"
damping = 0.003
slide = %r
output = %r
base = 0.0
"""
SHEARED = COATED + '[contact.crown]\nradius = "1 m"\n' + SHEAR + COULOMB
STUCK = 'measured = "stuck"'


@pytest.mark.parametrize("law", ["iwan", "lugre"])
def test_exact_stuck_frequency_of_plan_returns_free_frequency(law):
    """The stuck frequency that `plan` prints, given as a measured frequency, returns the free
    frequency of the mode."""
    contact = POINT + make_friction_table(law)
    free = pf.plan(contact + MODES % ("", 143.0, 0.8, 0.9) + DRIVE).as_json()["modes"][0]
    stuck = pf.plan(contact + MODES % (STUCK, free["stuck_frequency"], 0.8, 0.9) + DRIVE).as_json()[
        "modes"
    ][0]
    assert stuck["free_frequency"] == pytest.approx(143.0, rel=1e-10) and stuck["name"] == "axial"
    assert stuck["stuck_frequency"] == pytest.approx(free["stuck_frequency"], rel=1e-12)


def test_exact_two_stuck_modes_return_free_modes():
    """Frequencies and shapes of two modes measured with the stuck joint return the free modes; a
    bonded spring stays in both."""
    spring = '[structure.bonded]\nstiffness = "4e5 N/m"\n'
    tail = POINT + make_friction_table("iwan") + spring + DRIVE
    text = tail + MODES % ("", 143.0, 0.8, 0.9) + SECOND % (400.0, 0.5, -0.2)
    free = pf.build(text).rig.modes
    rows = free.interfaces
    k = 1e7
    square, shapes = np.linalg.eigh(np.diag(free.omega**2) + k * rows.T @ rows / free.mass)
    frequencies = (np.sqrt(square) / (2 * np.pi)).tolist()
    slide = (rows[0] @ shapes).tolist()
    output = (free.output @ shapes).tolist()
    base = (free.base @ shapes).tolist()
    stuck = (
        MODES % (STUCK, frequencies[0], slide[0], output[0])
        + f"base = {base[0]!r}\n"
        + (SECOND % (frequencies[1], slide[1], output[1])).replace(
            "base = 0.0", f"base = {base[1]!r}"
        )
    )
    modes = pf.build(tail + stuck).rig.modes
    assert modes.omega == pytest.approx(free.omega, rel=1e-10)
    for name in ("slide", "output", "base"):
        assert np.abs(getattr(modes, name)) == pytest.approx(np.abs(getattr(free, name)), rel=1e-9)
    modes_of_plan = pf.plan(tail + stuck).as_json()["modes"]
    assert [mode["stuck_frequency"] for mode in modes_of_plan] == pytest.approx(
        frequencies, rel=1e-10
    )


def test_exact_stuck_patch_has_measured_frequency():
    """A rig whose patch sticks has the measured frequency with the stiffness that the run prints; plan, run and batch
    have the same modes."""
    measured = pf.build(SHEARED + MODES % (STUCK, 14300.0, 1.0, 1.0) + DRIVE.replace("143", "9000"))
    result = pf.run(measured)
    stiffness = result.measures["tangential_stiffness"].value
    model = result.plan.model
    omega = model.rig.modes.omega[0]
    assert np.sqrt(omega**2 + stiffness / 0.884) == pytest.approx(2 * np.pi * 14300.0, rel=1e-12)
    assert model.rig.structure.bolted.subtracted.stiffness == pytest.approx([stiffness], rel=1e-12)
    mode = pf.plan(measured).as_json()["modes"][0]
    assert mode["free_frequency"] == pytest.approx(omega / (2 * np.pi), rel=1e-12)
    assert mode["stuck_frequency"] == pytest.approx(14300.0, rel=1e-12)
    assert any("joint bolted" in note for note in result.notes)
    assert pf.run_many([measured]).outcome[0] != "failed"
