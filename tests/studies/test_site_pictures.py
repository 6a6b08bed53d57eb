"""Pictures of README and site show the results of current runs; an outdated picture is reported."""

import struct
import sys
from pathlib import Path

import pytest

SITE = Path(__file__).parents[2] / "studies/site"
sys.path.insert(0, str(SITE))
pictures = __import__("pictures")


def test_always_committed_pictures_match_their_numbers():
    """Every committed picture belongs to its stored numbers and has the stated width and size."""
    assert pictures.find_foreign() == []
    for path in pictures.FOLDER.glob("*.png"):
        content = path.read_bytes()
        assert len(content) < pictures.MAX_BYTES
        assert struct.unpack(">II", content[16:24])[0] == round(pictures.WIDTH * pictures.DPI)


@pytest.mark.slow
def test_always_committed_pictures_are_up_to_date():
    """All committed pictures show the curves of current runs."""
    assert pictures.find_stale(pictures.figures()) == []
