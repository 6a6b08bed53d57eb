"""The warning about cases of a sweep that contradict other keys."""

from pathlib import Path

import pytest
from scene_texts import COULOMB, POINT, SHORT

from patchfem.campaigns import (
    CaseRequest,
    SweepScene,
    read_cases,
)


@pytest.mark.parametrize(
    "more, count, of, helps",
    [
        (
            "kinetic = 0.3\n",
            64,
            "16 of 32 cases that were checked",
            "or sweep the contradicting key, too",
        ),
        (
            "kinetic = 0.3\n",
            8,
            "4 of 8 cases",
            "or sweep the contradicting key, too",
        ),
        ("", 64, "", ""),
    ],
)
def test_exact_contradiction_in_part_of_range_is_reported(more, count, of, helps):
    """A contradiction with another key in half of a random range is reported."""
    scene = SweepScene(Path("a.toml"), POINT + COULOMB + more + SHORT)
    cases = read_cases(
        scene,
        CaseRequest(["friction.static=0.2..0.4", "drive.acceleration=8 g..9 g"], None, count, True),
    )
    message = cases.warning
    assert message.startswith(f"{of} will fail: a.toml:" if of else "")
    assert bool(message) == bool(of)
    assert helps in message
