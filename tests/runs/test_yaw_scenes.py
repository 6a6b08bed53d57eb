"""Strips that a mode yaws: scenes by the event engine, by the march, and where the yaw vanishes."""

import numpy as np
import pytest
from scene_texts import DRIVE, MODE, PIECE, mistakes

from patchfem.runs.plan import plan
from patchfem.runs.run import run
from patchfem.scene.scene import loads

TEXT = PIECE + """\
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
""" + MODE + """\
[[structure.mode]]
name = "yaw"
frequency = "129 Hz"
damping = 0.003
slide = 0.0
yaw = "{yaw}"
""" + DRIVE + """\
[accuracy]
method = "{method}"
"""


def found(law="coulomb", keys="", yaw="30 rad/m", roll="0.01 mrad", method="auto"):
    result = run(plan(loads(TEXT.format(law=law, keys=keys, yaw=yaw, roll=roll, method=method))))
    return result, result.measures


def test_exact_strips_by_events_and_by_the_march():
    """Rolled strips, Coulomb: the two engines agree within their errors; the yaw moment is sum y f of the friction."""
    result, exact = found()
    _, march = found(method="march")
    for name in ("relative_displacement_amplitude", "loop_area", "friction_work", "absolute_acceleration_peak"):
        a, b = exact[name], march[name]
        assert abs(a.value - b.value) <= a.error + 3 * b.error + 1e-3 * abs(a.value), name
    extra = result.window.extra
    assert extra["slides"].shape[1] == 4
    offsets = (np.arange(4) - 1.5) * 12.7e-3 / 4
    np.testing.assert_allclose(extra["yaw_moment"], extra["forces"] @ offsets, atol=1e-12)
    np.testing.assert_allclose(result.window.force, extra["forces"].sum(axis=1), atol=1e-9)
    yawed = (extra["slides"][:, 0] - extra["slides"][:, -1]) / (offsets[-1] - offsets[0])  # q_j = q - y_j yaw
    assert np.abs(yawed).max() > 1e-4


@pytest.mark.parametrize("law, keys", [("coulomb", ""), ("elastic-plastic", 'bond_length = "1 um"'),
                                       ("nonlocal", 'bond_length = "1 um"')])
def test_exact_strips_that_do_not_roll_do_not_yaw(law, keys):
    """Even loads: nothing turns the patch, the motion is that of the patch as one."""
    _, turned = found(law, keys, roll="0 rad")
    _, alone = found(law, keys, yaw="0 rad/m", roll="0 rad")
    for name in ("relative_displacement_amplitude", "loop_area", "friction_work"):
        assert turned[name].value == pytest.approx(alone[name].value, rel=2e-3)


def test_refuses_a_yaw_without_strips_and_with_laws_a_strip_cannot_have():
    bare = TEXT.format(law="coulomb", keys="", yaw="30 rad/m", roll="0 rad", method="auto")
    assert any("structure.mode.yaw.yaw" in line and "contact.strips" in line
               for line in mistakes(bare.replace('[contact.strips]\ncount = 4\nroll = "0 rad"\n', "")))
    listed = TEXT.format(law="nonlocal", keys='bond_length = "1 um"\norder = 2', yaw="30 rad/m", roll="0 rad",
                         method="auto")
    assert any("structure.mode.yaw.yaw" in line for line in mistakes(listed))
