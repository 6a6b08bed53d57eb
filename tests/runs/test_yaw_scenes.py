"""Strips under a yaw mode: exact engine against the march, and the limit without yaw."""

import numpy as np
import pytest
from scene_texts import DRIVE, MODE, PIECE
from yielding_points import solve_all_points

from patchfem import load
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
