"""Fixtures and bodies of a patch through its scene: springs, approach, unlike pieces, a step, any mesh."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scene_texts import COATING, PIECE

from patchfem import build
from patchfem.contact.gaps import step
from patchfem.core import Outcome
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch.values import values
from patchfem.scene import scene

TEXT = (
    PIECE
    + """\
element_size = "0.2 mm"
substrate = "Ti-8Al-1Mo-1V"
{}
"""
    + COATING
    + "{}\n"
)
LOAD = 'load = "26 lbf"'
TOLERANCE = 1e-3


def solved(keys=LOAD, tables=""):
    found = build(scene.loads(TEXT.format(keys, tables))).patch
    patch = solve_with_coarser(found, TOLERANCE, False)[0]
    return patch, values(patch)


def test_exact_a_soft_holder_is_a_free_piece_and_a_stiff_one_a_clamp():
    line = '[contact.load_line]\noffset = "0.5 mm"\n'
    tilt = '[contact.tilt]\nangle = "0.1 mrad"\n'
    spring = '[contact.holder]\nrotational_stiffness = "{} N m/rad"\n'
    free = solved(tables=line)[1]
    clamped = solved(tables=tilt)[1]
    soft = solved(tables=line + spring.format("1e-6"))[1]
    stiff = solved(tables=tilt + spring.format("1e13"))[1]
    for name in ("contact_fraction", "rotation", "moment", "approach", "pressure_peak"):
        assert soft[name] == pytest.approx(free[name], rel=1e-8)
        assert stiff[name] == pytest.approx(clamped[name], rel=1e-6)


@given(st.floats(0, 8), st.floats(-2e-4, 2e-4), st.floats(-5e-3, 5e-3))
def test_always_the_holder_carries_what_the_pressure_does_not(power, angle, offset):
    """Moment about the middle: sum f x = N offset + K (rotation - angle)."""
    stiffness = 10.0**power
    patch, found = solved(
        tables=f'[contact.tilt]\nangle = "{angle} rad"\n[contact.load_line]\noffset = "{offset} m"\n'
        f'[contact.holder]\nrotational_stiffness = "{stiffness} N m/rad"\n'
    )
    wanted = found["normal_load"] * offset + stiffness * (found["rotation"] - angle)
    assert found["moment"] == pytest.approx(
        wanted, abs=1e-9 * (found["normal_load"] * 6e-3 + stiffness * 3e-4)
    )
    assert max(patch.pressure.residuals.values()) < 1e-9


UNLIKE = '[contact.{}]\nheight = "9 mm"\nsubstrate = "steel"\ncoating = "none"\n'


def test_exact_unlike_pieces_add_their_compliances_and_may_be_swapped():
    tilt = '[contact.tilt]\nangle = "0.1 mrad"\n'
    (a, one), (_, two) = (
        solved(tables=tilt + UNLIKE.format("upper")),
        solved(tables=tilt + UNLIKE.format("lower")),
    )
    for name, value in one.items():
        assert two[name] == pytest.approx(value, rel=1e-9, abs=1e-15)
    assert a.pair.upper_grid.height == 9e-3
    assert a.pair.grid.height == 6.35e-3
    assert a.pair.upper_grid.coating_rows == 0
    like = solved(tables=tilt)[0]
    other = solved(tables=tilt + UNLIKE.format("upper") + UNLIKE.format("lower"))[0]
    assert a.pieces.normal == pytest.approx(
        (like.pieces.normal + other.pieces.normal) / 2, rel=1e-9
    )


def test_exact_a_step_lifts_one_side():
    patch, found = solved(tables='[contact.step]\nheight = "1 um"\nat = "2 mm"\n')
    x = patch.pair.grid.x
    assert patch.unloaded_gap == pytest.approx(np.where(x > 2e-3, 1e-6, 0.0))
    assert patch.pressure.sigma_n[x > 2e-3].max() == 0 and found["pressure_centre"] < 0
    assert step(np.array([-1.0, 0.0, 1.0]), 2.0, 0.0).tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("angle", [5e-6, 1e-4, 1e-3])
def test_exact_a_soft_linear_skin_is_the_wedge_on_a_foundation(angle):
    """Bodies a thousand times stiffer than the skin: contact length sqrt(2 N/(k theta b)), full below 2 p/(k L)."""
    stiffness = 1e10
    load = 26 * 4.4482216152605
    size = 12.7e-3
    found = solved(
        tables=f'[contact.tilt]\nangle = "{angle} rad"\n[contact.asperities]\nlaw = "linear"\n'
        f'normal_stiffness = "{stiffness} Pa/m"\ntangential_ratio = 0.8\n'
    )[1]
    opening = 2 * load / size**2 / (stiffness * size)
    length = min(size, np.sqrt(2 * load / (stiffness * angle * size)))
    assert (found["contact_fraction"] == 1) == (angle < opening)
    assert found["contact_fraction"] == pytest.approx(length / size, abs=0.02)
    assert found["normal_stiffness"] == pytest.approx(
        stiffness * size * found["contact_fraction"] * size, rel=2e-3
    )
    assert found["tangential_stiffness"] == pytest.approx(0.8 * found["normal_stiffness"], rel=2e-2)


TURNING = {
    "spring": '[contact.holder]\nrotational_stiffness = "1e4 N m/rad"\n[contact.tilt]\nangle = "0.01 mrad"\n',
    "offset": '[contact.load_line]\noffset = "2 mm"\n',
    "moment": '[contact.load_line]\nmoment = "0.05 N m"\n',
    "spring and offset": '[contact.holder]\nrotational_stiffness = "1e3 N m/rad"\n'
    '[contact.load_line]\noffset = "1 mm"\n',
    "smooth skin": '[contact.load_line]\noffset = "2 mm"\n[contact.asperities]\nlaw = "hertz"\nradius = "10 um"\n'
    'density = "1e8 1/m^2"\nheight_deviation = "0.05 um"\n',
    "strips": '[contact.load_line]\noffset = "2 mm"\n[contact.strips]\ncount = 4\nroll = "0.01 mrad"\n',
}


@pytest.mark.share(0, 2, 5)
@pytest.mark.parametrize("tables", TURNING.values(), ids=TURNING.keys())
def test_exact_an_approach_with_a_turning_piece_is_the_load_that_reaches_it(tables):
    """The approach that a load gives, asked for in its place, gives that load back, the rotation and the pressure."""
    _, loaded = solved(tables=tables)
    closed = solved("", tables + f'[contact.approach]\ndistance = "{loaded["approach"]!r} m"\n')[1]
    assert closed["normal_load"] == pytest.approx(loaded["normal_load"], rel=1e-7)
    for name in ("rotation", "moment", "pressure_peak", "approach"):
        assert closed[name] == pytest.approx(loaded[name], rel=1e-6, abs=1e-13), name


def test_exact_a_turning_piece_above_first_touch_is_apart():
    tables = TURNING["spring"]
    patch, found = solved(
        "", tables.replace("0.01 mrad", "0 mrad") + '[contact.approach]\ndistance = "0 m"\n'
    )
    assert patch.pressure.outcome is Outcome.NO_CONTACT and found["normal_load"] == 0
