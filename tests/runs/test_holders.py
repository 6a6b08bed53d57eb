"""Holders and pieces of a patch: springs, approach, unlike pieces, and a step."""

import pytest
from scene_texts import COATING, PIECE

from patchfem import build
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch.values import compute_static_values
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


def solve_patch(keys=LOAD, tables=""):
    """Return the solved patch of a scene and its values."""
    model = build(scene.loads(TEXT.format(keys, tables))).patch
    patch = solve_with_coarser(model, TOLERANCE, False)[0]
    return patch, compute_static_values(patch)


def test_exact_holder_limits_are_free_and_clamped():
    """A holder with a very small rotational stiffness acts as a free piece, one with a very large
    stiffness as a clamp."""
    load_line = '[contact.load_line]\noffset = "0.5 mm"\n'
    tilt = '[contact.tilt]\nangle = "0.1 mrad"\n'
    spring = '[contact.holder]\nrotational_stiffness = "{} N m/rad"\n'
    free = solve_patch(tables=load_line)[1]
    clamped = solve_patch(tables=tilt)[1]
    soft_holder = solve_patch(tables=load_line + spring.format("1e-6"))[1]
    stiff_holder = solve_patch(tables=tilt + spring.format("1e13"))[1]
    for name in ("contact_fraction", "rotation", "moment", "approach", "pressure_peak"):
        assert soft_holder[name] == pytest.approx(free[name], rel=1e-8)
        assert stiff_holder[name] == pytest.approx(clamped[name], rel=1e-6)


UNLIKE = '[contact.{}]\nheight = "9 mm"\nsubstrate = "steel"\ncoating = "none"\n'


def test_exact_compliances_of_unlike_pieces_add():
    """The compliance of two unlike pieces is the mean of those of the like pairs, and exchanging
    the pieces changes nothing."""
    tilt = '[contact.tilt]\nangle = "0.1 mrad"\n'
    (a, upper_values), (_, lower_values) = (
        solve_patch(tables=tilt + UNLIKE.format("upper")),
        solve_patch(tables=tilt + UNLIKE.format("lower")),
    )
    for name, value in upper_values.items():
        assert lower_values[name] == pytest.approx(value, rel=1e-9, abs=1e-15)
    assert a.pair.upper_grid.height == 9e-3
    assert a.pair.grid.height == 6.35e-3
    assert a.pair.upper_grid.coating_rows == 0
    like_patch = solve_patch(tables=tilt)[0]
    other_patch = solve_patch(tables=tilt + UNLIKE.format("upper") + UNLIKE.format("lower"))[0]
    assert a.pieces.normal == pytest.approx(
        (like_patch.pieces.normal + other_patch.pieces.normal) / 2, rel=1e-9
    )
