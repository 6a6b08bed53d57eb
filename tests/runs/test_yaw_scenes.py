"""Strips that a mode yaws: scenes by the event engine, by the march, and where the yaw vanishes."""

import numpy as np
import pytest
from march_paths import share_one_loop
from scene_texts import DRIVE, MODE, PIECE, mistakes

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


@pytest.fixture
def one_loop(monkeypatch):
    share_one_loop(monkeypatch)


def found(law="coulomb", keys="", yaw="30 rad/m", roll="0.01 mrad", method="auto"):
    result = run(load(TEXT.format(law=law, keys=keys, yaw=yaw, roll=roll, method=method)))
    return result, result.measures


def test_exact_strips_by_events_and_by_the_march(one_loop):
    """Rolled strips, Coulomb: the two engines agree within their errors; the yaw moment is sum y f of the friction."""
    result, exact = found()
    _, march = found(method="march")
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
    # q_j = q - y_j yaw
    yawed = (extra["slides"][:, 0] - extra["slides"][:, -1]) / (offsets[-1] - offsets[0])
    assert np.abs(yawed).max() > 1e-4


def test_refuses_a_yaw_without_strips_and_with_laws_a_strip_cannot_have():
    bare = TEXT.format(law="coulomb", keys="", yaw="30 rad/m", roll="0 rad", method="auto")
    assert any(
        "structure.mode.yaw.yaw" in line and "contact.strips" in line
        for line in mistakes(bare.replace('[contact.strips]\ncount = 4\nroll = "0 rad"\n', ""))
    )
    listed = TEXT.format(
        law="nonlocal",
        keys='bond_length = "1 um"\norder = 2',
        yaw="30 rad/m",
        roll="0 rad",
        method="auto",
    )
    assert any("structure.mode.yaw.yaw" in line for line in mistakes(listed))


SOFT = (
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
TURNS = '[[structure.mode]]\nname = "yaw"\nfrequency = "129 Hz"\ndamping = 0.003\nslide = 0.0\nyaw = "30 rad/m"\n'
BEHIND = pytest.mark.parametrize(
    "law",
    ['"coulomb"', '"elastic-plastic"\nbond_length = "1 um"'],
    ids=["coulomb", "elastic-plastic"],
)


def behind_shear(law, strips="", yaw="", method="march"):
    return run(load(SOFT.format(law=law, strips=strips, yaw=yaw, method=method)), estimate=False)


@BEHIND
@pytest.mark.parametrize("method", ["march", "exact", "harmonic"])
def test_exact_even_strips_behind_shear_are_the_patch_behind_shear(law, method, one_loop):
    """Every strip is as many times as compliant as the width, under as many parts of the load."""
    whole = behind_shear(law, method=method).measures
    cases = [behind_shear(law, STRIPS.format("0 rad"), method=method)]
    if method == "march":
        cases.append(behind_shear(law, STRIPS.format("0 rad"), TURNS))
    for found in cases:
        for name in (
            "relative_displacement_amplitude",
            "absolute_acceleration_peak",
            "loop_area",
            "friction_work",
            "slip_amplitude",
            "friction_force_peak",
            "tangential_stiffness",
        ):
            assert found.measures[name].value == pytest.approx(whole[name].value, rel=5e-12), name


@BEHIND
@pytest.mark.parametrize("roll", ["0.01 mrad", "0.2 mrad"])
def test_exact_rolled_strips_behind_shear_turn_by_the_forces_of_their_own_elements(
    law, roll, one_loop
):
    """Slide q - y yaw, force of a set of elements made by hand of C = 4 C_t and the strip's own forces, torque
    sum y f, and a yaw mode that this torque alone drives; at 0.2 mrad strips are open."""
    result = behind_shear(law, STRIPS.format(roll), TURNS)
    extra = result.response.extra
    patch = result.patch
    found = result.response
    assert found.time.size == 201 and (patch.strips.force.sum(axis=1) == 0).any() == (
        roll == "0.2 mrad"
    )
    y = (np.arange(4) - 1.5) * 12.7e-3 / 4
    np.testing.assert_allclose(
        extra["slides"],
        found.modal[:, :1] - 30 * np.outer(found.modal[:, 1], y),
        atol=1e-13 * np.abs(extra["slides"]).max(),
    )
    length = 1e-6 if "elastic" in law else 0.0
    most = np.abs(extra["forces"]).max()
    for k, normal in enumerate(patch.strips.force):
        force = by_hand(
            4 * patch.pair.compliance.tangential, 0.3 * normal, length, extra["slides"][:, k]
        )
        np.testing.assert_allclose(extra["forces"][:, k], force, atol=1e-9 * most)
    np.testing.assert_allclose(extra["yaw_moment"], extra["forces"] @ y, atol=1e-15)
    assert np.abs(extra["yaw_moment"]).max() > 0.05
    assert result.measures["energy_balance"].value < 1e-10
    assert "shear_stress" not in result.fields and any(
        "no common" in one for one in result.extra["notes"]
    )


def by_hand(compliance, limit, length, slide):
    """Force [N] along a slide (k,) [m] of points that yield at limit (m,) [N] behind compliance (m, m) [m/N] and a
    stretch of `length` [m] at the limit: each step a linear problem with bounds, solved set by set."""
    points = np.flatnonzero(limit > 0)
    most = limit[points]
    carried = np.zeros(points.size)
    out = [0.0]
    if not points.size:
        return np.zeros(slide.size)
    inner = compliance[np.ix_(points, points)] + np.diag(length / most)
    for move in np.diff(slide):
        free = np.ones(points.size, bool)
        left = move
        while left:
            rate = np.zeros(points.size)
            rate[free] = (
                np.linalg.solve(inner[np.ix_(free, free)], np.ones(free.sum()))
                if free.any()
                else 0.0
            )
            way = np.sign(left) * rate
            with np.errstate(divide="ignore", invalid="ignore"):
                room = np.where(free & (way != 0), (np.sign(way) * most - carried) / way, np.inf)
            step = min(room.min(), abs(left))
            carried = carried + way * step
            free &= room > step * (1 + 1e-12)
            left = 0.0 if step == abs(left) else left - np.sign(left) * step
        out.append(carried.sum())
    return np.array(out)


def test_refuses_strips_beside_shear_that_no_set_of_elements_stands_for():
    for law, said in (
        ('"nonlocal"\nbond_length = "1 um"', "contact.strips"),
        ('"coulomb"\nkinetic = 0.2', "kinetic"),
    ):
        text = SOFT.format(law=law, strips=STRIPS.format("0 rad"), yaw=TURNS, method="auto")
        assert any(said in line for line in mistakes(text))
    held = SOFT.format(
        law='"coulomb"',
        strips=STRIPS.format("0 rad") + '[contact.holder]\ntangential_stiffness = "5e6 N/m"\n',
        yaw="",
        method="auto",
    )
    assert any("contact.strips" in line for line in mistakes(held))
