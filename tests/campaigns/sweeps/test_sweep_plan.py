"""The plan of a sweep, and the warning about cases that contradict other keys."""

from pathlib import Path

import pytest
from scene_texts import COULOMB, POINT, SHORT

from patchfem import plan
from patchfem.campaigns import (
    Request,
    SweepScene,
    plan_sweep,
    read_cases,
)


def test_exact_plan_of_sweep_is_that_of_first_valid_case():
    """The plan of a sweep is that of its first valid case, with the numbers of cases."""
    scene = SweepScene(Path("a.toml"), POINT + COULOMB + SHORT)
    cases = read_cases(scene, Request(["normal.load=-1 N,20 N,30 N", "friction.static=0.2,0.3"]))
    content = plan_sweep(scene, cases)
    assert content["case"] == {"normal.load": "20 N", "friction.static": "0.2"}
    assert content["cases"] == 6
    assert content["values"] == {"normal.load": 3, "friction.static": 2}
    expected = plan(scene.build_model(cases.assignments(2))).as_json()
    for name in ("kind", "effects", "unknowns", "stiffness_chain", "groups", "modes"):
        assert content[name] == expected[name]


@pytest.mark.parametrize(
    "more, count, of, helps",
    [
        (
            "kinetic = 0.3\n",
            64,
            "16 of 32 cases that were checked",
            "sweep friction.kinetic, too, remove this key from the ",
        ),
        (
            "kinetic = 0.3\n",
            8,
            "4 of 8 cases",
            "sweep friction.kinetic, too, remove this key from the scene, or give",
        ),
        ("", 64, "", ""),
    ],
)
def test_exact_contradiction_in_part_of_range_is_reported(more, count, of, helps):
    """A contradiction with another key in half of a random range is reported.

    The plan counts the failing cases and is still made.
    """
    scene = SweepScene(Path("a.toml"), POINT + COULOMB + more + SHORT)
    cases = read_cases(
        scene,
        Request(["friction.static=0.2..0.4", "drive.acceleration=8 g..9 g"], None, count, True),
    )
    message = cases.warning
    assert message.startswith(f"{of} will fail: a.toml:" if of else "")
    assert bool(message) == bool(of)
    assert helps in message
    assert plan_sweep(scene, cases)["cases"] == count
