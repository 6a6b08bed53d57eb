"""Strips under a yaw mode: exact engine against the march, and the limit without yaw."""

import numpy as np
import pytest
from scene_texts import BLOCK, DRIVE, MODE, PIECE, make_friction_table
from yielding_points import solve_all_points

from patchfem import load, plan
from patchfem.export.run_data import collect_data
from patchfem.runs.run import run

SHEARED_TEXT = (
    PIECE
    + """\
load = "26 lbf"
element_size = "1 mm"
substrate = "Ti-8Al-1Mo-1V"
[contact.crown]
radius = "200 m"
[contact.shear]
[contact.strips]
count = 4
roll = "0.2 mrad"
[friction]
static = 0.3
law = {law}
"""
    + MODE.replace("0.003", "0.05")
    + '[[structure.mode]]\nname = "yaw"\nfrequency = "129 Hz"\ndamping = 0.003\nslide = 0.0\nyaw = "30 rad/m"\n'
    + DRIVE.replace("cycles = 30", "cycles = 2")
    + """\
[accuracy]
steps_per_cycle = 100
method = "march"
"""
)


@pytest.mark.parametrize(
    "law",
    ['"coulomb"', '"elastic-plastic"\nbond_length = "1 um"'],
    ids=["coulomb", "elastic-plastic"],
)
def test_exact_rolled_strips_with_shear_agree_with_separate_elements(law):
    """The friction force of each strip agrees with points of the compliance 4 C_t that yield, under the displacement
    q - y yaw. The yaw moment is sum y f; at a roll of 0.2 mrad some strips are not in contact."""
    result = run(load(SHEARED_TEXT.format(law=law)), estimate=False)
    extra = result.response.extra
    patch = result.patch
    response = result.response
    assert response.time.size == 201 and (patch.strips.force.sum(axis=1) == 0).any()
    y = (np.arange(4) - 1.5) * 12.7e-3 / 4
    np.testing.assert_allclose(
        extra["slides"],
        response.modal[:, :1] - 30 * np.outer(response.modal[:, 1], y),
        atol=1e-13 * np.abs(extra["slides"]).max(),
    )
    length = 1e-6 if "elastic" in law else 0.0
    peak_force = np.abs(extra["forces"]).max()
    for k, normal in enumerate(patch.strips.force):
        if not normal.any():
            assert not extra["forces"][:, k].any()
            continue
        limit = 0.3 * normal[normal > 0]
        contact = np.ix_(normal > 0, normal > 0)
        compliance = 4 * patch.pair.compliance.tangential[contact] + np.diag(length / limit)
        force = solve_all_points(compliance, limit, extra["slides"][:, k]).sum(axis=1)
        np.testing.assert_allclose(extra["forces"][:, k], force, atol=1e-9 * peak_force)
    np.testing.assert_allclose(extra["yaw_moment"], extra["forces"] @ y, atol=1e-15)
    assert np.abs(extra["yaw_moment"]).max() > 0.05
    np.testing.assert_array_equal(collect_data(result)["yaw_moment"].values, extra["yaw_moment"])
    assert result.measures["energy_balance"].value < 1e-10
    assert "shear_stress" not in result.fields and any("no common" in note for note in result.notes)


STRIPS = "[contact.strips]\ncount = 4\n"
DAMPED_LUGRE = 'micro_damping = "100 N s/m"\nviscous = "3 N s/m"\n'


def _shake_strips(law: str, yaw: str):
    """Return the text of a rig with strips under a friction law, whose only mode yaws the patch by `yaw`."""
    friction = make_friction_table(law) + (DAMPED_LUGRE if law == "lugre" else "")
    mode = MODE + f'yaw = "{yaw}"\n'
    return BLOCK + STRIPS + friction + mode + DRIVE.replace("cycles = 30", "cycles = 10")


@pytest.mark.parametrize("law", ["iwan", "bouc-wen", "lugre"])
def test_exact_strips_that_hardly_yaw_share_stiffness_and_damping_of_the_contact(law):
    """Keys that refer to the whole contact are divided among the strips, as the load is."""
    whole = run(load(_shake_strips(law, "0 rad/m")), estimate=False)
    apart = run(load(_shake_strips(law, "1e-6 rad/m")), estimate=False)
    assert apart.response.slides.shape[1] == 4
    for name in ("relative_displacement_amplitude", "loop_area", "slip_amplitude"):
        assert apart.measures[name].value == pytest.approx(whole.measures[name].value, rel=1e-4)
    plans = [plan(load(_shake_strips(law, yaw))) for yaw in ("0 rad/m", "1e-6 rad/m")]
    stuck = [planned.modes(planned.chain)[0]["stuck_frequency"] for planned in plans]
    assert stuck[1] == pytest.approx(stuck[0], rel=1e-9)


def test_exact_strips_move_in_two_modes_with_yaw():
    """A second mode that yaws the patch moves the contact too, so that there is no damping of the first mode alone."""
    second = '[[structure.mode]]\nname = "second"\nfrequency = "129 Hz"\ndamping = 0.01\nslide = 0.2\nyaw = "60 rad/m"\n'
    drive = DRIVE.replace("cycles = 30", "cycles = 10")
    text = BLOCK + STRIPS + make_friction_table("elastic-plastic") + MODE + second + drive
    measures = run(load(text), estimate=False).measures
    assert measures["loop_area"].value > 0
    assert measures["equivalent_damping"].value is None
