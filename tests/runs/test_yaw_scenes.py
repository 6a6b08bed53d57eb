"""Strips under a yaw mode: exact engine against the march, and the limit without yaw."""

import numpy as np
import pytest
from scene_texts import DRIVE, MODE, PIECE

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
{strips}
[friction]
static = 0.3
law = {law}
"""
    + MODE.replace("0.003", "0.05")
    + """\
{yaw}
"""
    + DRIVE.replace("cycles = 30", "cycles = 2")
    + """\
[accuracy]
steps_per_cycle = 100
method = "{method}"
"""
)
STRIPS = '[contact.strips]\ncount = 4\nroll = "{}"\n'
YAW_MODE = '[[structure.mode]]\nname = "yaw"\nfrequency = "129 Hz"\ndamping = 0.003\nslide = 0.0\nyaw = "30 rad/m"\n'
FRICTION_LAWS = pytest.mark.parametrize(
    "law",
    ['"coulomb"', '"elastic-plastic"\nbond_length = "1 um"'],
    ids=["coulomb", "elastic-plastic"],
)


def run_sheared_strips(law, strips="", yaw="", method="march"):
    """Return the result of a patch with shear, with or without strips and a yaw mode."""
    return run(
        load(SHEARED_TEXT.format(law=law, strips=strips, yaw=yaw, method=method)), estimate=False
    )


@FRICTION_LAWS
@pytest.mark.parametrize("roll", ["0.2 mrad"])
def test_exact_rolled_strips_with_shear_agree_with_separate_elements(law, roll):
    """The friction force of each strip agrees with contact elements of the compliance 4 C_t
    computed here, under the displacement q - y yaw. The yaw moment is sum y f; at a roll of 0.2
    mrad some strips are not in contact."""
    result = run_sheared_strips(law, STRIPS.format(roll), YAW_MODE)
    extra = result.response.extra
    patch = result.patch
    response = result.response
    assert response.time.size == 201 and (patch.strips.force.sum(axis=1) == 0).any() == (
        roll == "0.2 mrad"
    )
    y = (np.arange(4) - 1.5) * 12.7e-3 / 4
    np.testing.assert_allclose(
        extra["slides"],
        response.modal[:, :1] - 30 * np.outer(response.modal[:, 1], y),
        atol=1e-13 * np.abs(extra["slides"]).max(),
    )
    length = 1e-6 if "elastic" in law else 0.0
    peak_force = np.abs(extra["forces"]).max()
    for k, normal in enumerate(patch.strips.force):
        force = step_yielding_points(
            4 * patch.pair.compliance.tangential, 0.3 * normal, length, extra["slides"][:, k]
        )
        np.testing.assert_allclose(extra["forces"][:, k], force, atol=1e-9 * peak_force)
    np.testing.assert_allclose(extra["yaw_moment"], extra["forces"] @ y, atol=1e-15)
    assert np.abs(extra["yaw_moment"]).max() > 0.05
    np.testing.assert_array_equal(collect_data(result)["yaw_moment"].values, extra["yaw_moment"])
    assert result.measures["energy_balance"].value < 1e-10
    assert "shear_stress" not in result.fields and any("no common" in note for note in result.notes)


def step_yielding_points(compliance, limit, length, slide):
    """Return the force (k,) [N] of points that yield at `limit` (m,) [N] along a relative
    displacement `slide` (k,) [m].

    The points have the compliance (m, m) [m/N] and stretch by `length` [m] at the limit; each step
    is a linear problem with bounds that is solved by an active-set method.
    """
    points = np.flatnonzero(limit > 0)
    limits = limit[points]
    forces = np.zeros(points.size)
    history = [0.0]
    if not points.size:
        return np.zeros(slide.size)
    flexibility = compliance[np.ix_(points, points)] + np.diag(length / limits)
    for increment in np.diff(slide):
        free = np.ones(points.size, bool)
        remaining = increment
        while remaining:
            rate = np.zeros(points.size)
            rate[free] = (
                np.linalg.solve(flexibility[np.ix_(free, free)], np.ones(free.sum()))
                if free.any()
                else 0.0
            )
            direction = np.sign(remaining) * rate
            with np.errstate(divide="ignore", invalid="ignore"):
                max_steps = np.where(
                    free & (direction != 0),
                    (np.sign(direction) * limits - forces) / direction,
                    np.inf,
                )
            step = min(max_steps.min(), abs(remaining))
            forces = forces + direction * step
            free &= max_steps > step * (1 + 1e-12)
            remaining = 0.0 if step == abs(remaining) else remaining - np.sign(remaining) * step
        history.append(forces.sum())
    return np.array(history)
