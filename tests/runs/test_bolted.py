"""Modes measured with the joint bolted: the stiffness of the joint is removed from them."""

import numpy as np
import pytest
from scene_texts import DRIVE, FORCED, PAIR, POINT, list_mistakes, make_friction_table

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.runs import joint

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
SHEARED = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
element_size = "0.5 mm"
substrate = "Ti-8Al-1Mo-1V"
[contact.crown]
radius = "1 m"
[contact.shear]
[friction]
law = "coulomb"
static = 0.3
"""
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
    """A rig whose patch sticks has the measured frequency. The stiffness that is subtracted is the
    extrapolated one that the run prints, and plan and run have the same modes."""
    measured = pf.build(SHEARED + MODES % (STUCK, 14300.0, 1.0, 1.0) + DRIVE.replace("143", "9000"))
    model, patches, _ = joint.solve_without_joint(measured)
    omega = model.rig.modes.omega[0]
    stiffness = joint.compute_full_stick_stiffness(model, patches[0])
    assert np.sqrt(omega**2 + stiffness / 0.884) == pytest.approx(2 * np.pi * 14300.0, rel=1e-12)
    run = pf.run(measured)
    printed = run.measures["tangential_stiffness"]
    assert stiffness == pytest.approx(printed.value, rel=1e-12)
    assert model.rig.structure.bolted.stiffness == pytest.approx([printed.value], rel=1e-12)
    assert run.plan.model.rig.modes.omega[0] == pytest.approx(omega, rel=1e-12)
    mode_of_plan = pf.plan(measured).as_json()["modes"][0]
    assert mode_of_plan["free_frequency"] == pytest.approx(omega / (2 * np.pi), rel=1e-12)
    assert mode_of_plan["stuck_frequency"] == pytest.approx(14300.0, rel=1e-12)
    assert any("joint bolted" in note for note in run.notes)
    outcomes = pf.run_many([measured]).outcome
    assert "failed" not in [str(outcome) for outcome in outcomes]


def test_exact_comparison_runs_stick_at_the_measured_frequency():
    """The patch on a coarser mesh has the stiffness of the joint; in one comparison run both are larger by the
    error of the printed stiffness."""
    measured = pf.build(SHEARED + MODES % (STUCK, 14300.0, 1.0, 1.0) + DRIVE.replace("143", "9000"))
    model, patches, stiffer = joint.solve_without_joint(measured)
    printed = patches[0].measures["tangential_stiffness"]
    for free, patch, expected in (
        (model, patches[1], printed.value),
        (stiffer.model, stiffer.patches[0], printed.value + printed.error),
    ):
        stiffness = joint.compute_full_stick_stiffness(free, patch)
        assert stiffness == pytest.approx(expected, rel=1e-9)
        square = free.rig.modes.omega[0] ** 2 + stiffness / 0.884
        assert np.sqrt(square) == pytest.approx(2 * np.pi * 14300.0, rel=1e-9)


@pytest.mark.parametrize("bond_length", ["1 um", "1 m"])
def test_exact_bonds_behind_elastic_pieces_stick_at_the_measured_frequency(bond_length):
    """Bonds in series with elastic pieces stick at the measured frequency, also if the pieces are rigid beside them."""
    text = SHEARED.replace("coulomb", "elastic-plastic") + f'bond_length = "{bond_length}"\n'
    measured = pf.build(text + MODES % (STUCK, 14300.0, 1.0, 1.0) + DRIVE.replace("143", "9000"))
    model, patches, stiffer = joint.solve_without_joint(measured)
    for free, patch in (
        (model, patches[0]),
        (model, patches[1]),
        (stiffer.model, stiffer.patches[0]),
    ):
        stiffness = joint.compute_full_stick_stiffness(free, patch)
        square = free.rig.modes.omega[0] ** 2 + stiffness / 0.884
        assert np.sqrt(square) == pytest.approx(2 * np.pi * 14300.0, rel=1e-9)


def test_joint_error_of_a_worn_patch_does_not_contain_its_wear():
    """The comparison run with a stiffer joint has the worn patch, so that the change by wear is no error."""
    contact = (
        SHEARED.replace("12.7 mm", "18 mm").replace("6.35 mm", "5 mm").replace("26 lbf", "240 N")
    )
    contact = contact.replace('element_size = "0.5 mm"\n', "").replace('"1 m"', '"60 m"')
    text = contact + MODES % (STUCK, 880.0, 0.12, 0.12)
    text += DRIVE.replace("143", "860").replace("5 g", "40 g")
    wear = '[wear]\ncoefficient = "%s 1/Pa"\ncycles = 1e6\n'
    unworn, worn = (pf.run(text + wear % k).measures["loop_area"] for k in ("1e-18", "3e-14"))
    assert worn.error < 0.1 * abs(worn.value - unworn.value)


@pytest.mark.parametrize(
    "text, message",
    [
        (
            POINT + make_friction_table("iwan") + MODES % (STUCK, 14.0, 1.0, 1.0) + DRIVE,
            "stiffness of the joint is .* % of the stiffness.*multiply `slide` of every mode by 0.0",
        ),
        (
            POINT + make_friction_table("coulomb") + MODES % (STUCK, 143.0, 1.0, 1.0) + DRIVE,
            "law 'coulomb' sticks rigidly",
        ),
        (
            POINT + make_friction_table("tanh") + MODES % (STUCK, 143.0, 1.0, 1.0) + DRIVE,
            "law 'tanh' has no stiffness",
        ),
        (
            SHEARED + MODES % (STUCK, 143.0, 1.0, 1.0) + DRIVE,
            "stiffness of the joint is .* % of the stiffness.*multiply `slide` of every mode by 0.0",
        ),
    ],
)
def test_refuses_stuck_modes_with_unsuitable_joint(text, message):
    """A joint that is too stiff, rigid in stick or without stiffness cannot be removed from measured modes."""
    with pytest.raises(PatchfemError, match=f"(?s)structure.m.*{message}"):
        pf.run(text)


def test_refuses_stuck_modes_without_constant_joint_stiffness():
    """Measured stuck modes are refused without friction, with masses instead of modes, and with a varying normal load."""
    assert "add [friction]" in list_mistakes(MODES % (STUCK, 143.0, 1.0, 1.0) + DRIVE)[0]
    messages = list_mistakes(PAIR.replace("[structure]", "[structure]\n" + STUCK) + FORCED)
    assert any(
        "structure.masses is not supported yet; only modes can be measured" in message
        for message in messages
    )
    assert any(
        "normal.amplitude is not supported yet" in message
        for message in list_mistakes(
            POINT
            + 'amplitude = "10 N"\nfrequency = "50 Hz"\n'
            + make_friction_table("iwan")
            + MODES % (STUCK, 143.0, 1.0, 1.0)
            + DRIVE
        )
    )
