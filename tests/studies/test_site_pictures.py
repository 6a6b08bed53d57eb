"""Pictures of README and site show the numbers of today's runs; a stale picture is named."""

import struct
import sys
from pathlib import Path

import pytest

import patchfem as pf

SITE = Path(__file__).parents[2] / "studies" / "site"
sys.path.insert(0, str(SITE))
pictures = __import__("pictures")


def loop_of(friction: str):
    """Return the picture of a friction loop at a friction coefficient."""
    return pictures.draw_loop(pf.run(pf.new("bench"), **{"friction.static": friction}))


def test_always_the_committed_pictures_belong_to_their_numbers():
    assert pictures.find_foreign() == []
    for path in pictures.FOLDER.glob("*.png"):
        content = path.read_bytes()
        assert len(content) < pictures.MAX_BYTES
        assert struct.unpack(">II", content[16:24])[0] == round(pictures.WIDTH * pictures.DPI)


def test_always_a_picture_of_other_numbers_is_stale():
    first = pictures.read_numbers(loop_of("0.3"))
    assert pictures.find_changes(first, pictures.read_numbers(loop_of("0.3"))) == []
    changes = pictures.find_changes(first, pictures.read_numbers(loop_of("0.302")))
    assert "a curve differs by 0.67 % of its largest value" in changes  # 0.302 for 0.3
    assert any("is no longer shown" in change for change in changes)
    assert pictures.find_stale([("loop", loop_of("0.3"))])  # the committed loop is that of the rig


def test_always_a_curve_of_round_off_does_not_make_a_picture_stale():
    """A picture with one large curve and a second curve that changes by a factor of two."""
    figure, (axis,) = pictures.new_figure(2)
    large = axis.plot([0, 1, 2], [0, 1, 2])
    (small,) = axis.plot([0, 1, 2], [0, 1e-10, 2e-10])
    assert large
    numbers = {}
    for size in (1e-10, 2e-10, 1e-7, 2e-7):
        small.set_ydata([0, size, 2 * size])
        numbers[size] = pictures.read_numbers(figure)
    assert pictures.find_changes(numbers[1e-10], numbers[2e-10]) == []
    assert pictures.find_changes(numbers[1e-7], numbers[2e-7])


@pytest.mark.slow
def test_always_no_committed_picture_is_stale():
    assert pictures.find_stale(pictures.figures()) == []
