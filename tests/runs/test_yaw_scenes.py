"""Strips under a yaw mode: exact engine against the march, and the limit without yaw."""

import numpy as np
import pytest
from scene_texts import DRIVE, MODE, PIECE, list_mistakes

from patchfem import load
from patchfem.runs.run import run

TEXT = (
    PIECE
    + """\
load = "26 lbf"
element_size = "1 mm"
substrate = "Ti-8Al-1Mo-1V"
[contact.strips]
count = 4
roll = "{roll}"
[friction]
law = "{law}"
static = 0.3
{keys}
"""
    + MODE
    + """\
[[structure.mode]]
name = "yaw"
frequency = "129 Hz"
damping = 0.003
slide = 0.0
yaw = "{yaw}"
"""
    + DRIVE
    + """\
[accuracy]
method = "{method}"
"""
)


def run_with_measures(law="coulomb", keys="", yaw="30 rad/m", roll="0.01 mrad", method="auto"):
    """Return the result of a scene and its measures."""
    result = run(load(TEXT.format(law=law, keys=keys, yaw=yaw, roll=roll, method=method)))
    return result, result.measures


def test_exact_yawing_strips_agree_between_engines():
    """For rolled strips with Coulomb's law the exact engine and the march agree within their
    errors; the yaw moment is sum y f of the friction forces."""
    result, exact = run_with_measures()
    _, march = run_with_measures(method="march")
    for name in (
        "relative_displacement_amplitude",
        "loop_area",
        "friction_work",
        "absolute_acceleration_peak",
    ):
        a = exact[name]
        b = march[name]
        assert abs(a.value - b.value) <= a.error + 3 * b.error + 1e-3 * abs(a.value), name
    extra = result.window.extra
    assert extra["slides"].shape[1] == 4
    offsets = (np.arange(4) - 1.5) * 12.7e-3 / 4
    np.testing.assert_allclose(extra["yaw_moment"], extra["forces"] @ offsets, atol=1e-12)
    np.testing.assert_allclose(result.window.force, extra["forces"].sum(axis=1), atol=1e-9)
    # Displacement of strip j: q_j = q - y_j yaw.
    yaw_angle = (extra["slides"][:, 0] - extra["slides"][:, -1]) / (offsets[-1] - offsets[0])
    assert np.abs(yaw_angle).max() > 1e-4


def test_refuses_yaw_without_strips_or_with_bond_list():
    """A yaw mode is refused without strips and with a law that needs a list of bonds."""
    text = TEXT.format(law="coulomb", keys="", yaw="30 rad/m", roll="0 rad", method="auto")
    assert any(
        "structure.mode.yaw.yaw" in line and "contact.strips" in line
        for line in list_mistakes(text.replace('[contact.strips]\ncount = 4\nroll = "0 rad"\n', ""))
    )
    with_bond_list = TEXT.format(
        law="nonlocal",
        keys='bond_length = "1 um"\norder = 2',
        yaw="30 rad/m",
        roll="0 rad",
        method="auto",
    )
    assert any("structure.mode.yaw.yaw" in line for line in list_mistakes(with_bond_list))


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


@pytest.mark.parametrize("law", ['"elastic-plastic"\nbond_length = "1 um"'])
@pytest.mark.parametrize("method", ["march", "exact", "harmonic"])
def test_exact_level_strips_with_shear_agree_with_patch(law, method):
    """With four strips, each is four times as compliant and carries a quarter of the load: the
    measures agree with those of the patch."""
    patch_measures = run_sheared_strips(law, method=method).measures
    cases = [run_sheared_strips(law, STRIPS.format("0 rad"), method=method)]
    if method == "march":
        cases.append(run_sheared_strips(law, STRIPS.format("0 rad"), YAW_MODE))
    for result in cases:
        for name in (
            "relative_displacement_amplitude",
            "absolute_acceleration_peak",
            "loop_area",
            "friction_work",
            "slip_amplitude",
            "friction_force_peak",
            "tangential_stiffness",
        ):
            assert result.measures[name].value == pytest.approx(
                patch_measures[name].value, rel=5e-12
            ), name


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
    assert result.measures["energy_balance"].value < 1e-10
    assert "shear_stress" not in result.fields and any(
        "no common" in note for note in result.extra["notes"]
    )


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


def test_refuses_unsupported_strips_with_shear():
    """Strips with [contact.shear] are refused with nonlocal friction, kinetic friction or a holder spring."""
    for law, key in (
        ('"nonlocal"\nbond_length = "1 um"', "contact.strips"),
        ('"coulomb"\nkinetic = 0.2', "kinetic"),
    ):
        text = SHEARED_TEXT.format(
            law=law, strips=STRIPS.format("0 rad"), yaw=YAW_MODE, method="auto"
        )
        assert any(key in line for line in list_mistakes(text))
    with_holder = SHEARED_TEXT.format(
        law='"coulomb"',
        strips=STRIPS.format("0 rad") + '[contact.holder]\ntangential_stiffness = "5e6 N/m"\n',
        yaw="",
        method="auto",
    )
    assert any("contact.strips" in line for line in list_mistakes(with_holder))
