"""Pictures of README and site show the results of current runs; an outdated picture is reported."""

import struct
import sys
from pathlib import Path

import pytest

import patchfem as pf

SITE = Path(__file__).parents[2] / "studies" / "site"
sys.path.insert(0, str(SITE))
pictures = __import__("pictures")


def draw_loop_at(friction: str):
    """Return the picture of a friction loop at a friction coefficient."""
    return pictures.draw_loop(pf.run(pf.new("bench"), **{"friction.static": friction}))


def test_always_committed_pictures_match_their_numbers():
    """Every committed picture belongs to its stored numbers and has the stated width and size."""
    assert pictures.find_foreign() == []
    for path in pictures.FOLDER.glob("*.png"):
        content = path.read_bytes()
        assert len(content) < pictures.MAX_BYTES
        assert struct.unpack(">II", content[16:24])[0] == round(pictures.WIDTH * pictures.DPI)


def test_always_changed_curves_make_a_picture_stale():
    """A friction coefficient of 0.302 instead of 0.3 makes a picture outdated."""
    first = pictures.read_numbers(draw_loop_at("0.3"))
    assert pictures.find_changes(first, pictures.read_numbers(draw_loop_at("0.3"))) == []
    changes = pictures.find_changes(first, pictures.read_numbers(draw_loop_at("0.302")))
    assert "a curve differs by 0.67 % of its largest value" in changes  # 0.302 for 0.3
    assert any("is no longer shown" in change for change in changes)
    # the committed loop belongs to the rig, not to the bench
    assert pictures.find_stale([("loop", draw_loop_at("0.3"))])


def test_always_round_off_does_not_make_a_picture_stale():
    """A curve at the size of round-off may change by a factor of two without making a picture outdated."""
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
def test_always_committed_pictures_are_up_to_date():
    """All committed pictures show the curves of current runs."""
    assert pictures.find_stale(pictures.figures()) == []
