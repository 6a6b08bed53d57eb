"""The estimated time of a sweep, compared with plans of its cases and with measured times."""

from pathlib import Path

import pytest
from scene_texts import BENCH, COULOMB, POINT, SHORT, SMALL_PATCH

from patchfem import plan
from patchfem.campaigns import (
    Request,
    SweepScene,
    estimate_sweep,
    read_cases,
    warn_of_invalid_cases,
)
from patchfem.campaigns.sweeps.estimate import SWEEP_SECONDS


@pytest.mark.parametrize(
    "text, over",
    [(SMALL_PATCH, "contact.element_size=0.3 mm,1 mm,0.5 mm"), (BENCH, "slide.cycles=1,400,20")],
)
def test_exact_sweep_time_is_sum_of_cases(text, over):
    """The estimated time of a sweep is the sum of its cases without work that is done once.

    The memory is that of the largest case.
    """
    scene = SweepScene(Path("a.toml"), text)
    cases = read_cases(scene, Request([over]))
    estimate = estimate_sweep(scene, cases)
    plans = [plan(scene.build_model(cases.assignments(number))) for number in range(3)]
    seconds = [one.seconds for one in plans]
    margin = 0.05  # time [s] for the work that no plan contains
    assert (
        max(seconds) <= estimate["seconds"] + margin
        and estimate["seconds"] <= sum(seconds) + margin
    )
    assert sum(seconds) - 3 * SWEEP_SECONDS <= estimate["seconds"] + margin
    assert estimate["bytes"] == max(one.bytes for one in plans) > min(one.bytes for one in plans)


def test_always_estimate_distinguishes_batched_and_single_cases():
    """Cases that are marched together are estimated at about 0.055 s, and single ones at 0.47 s.

    Both figures were measured.
    """
    path = Path(__file__).parents[3] / "studies/rig/rig.toml"
    scene = SweepScene(path, path.read_text("utf-8"))

    def seconds_per_case(*over, count=64):
        """Return the estimated seconds per case of a sweep."""
        return estimate_sweep(scene, read_cases(scene, Request(over, None, count, count > 0)))[
            "seconds_per_case"
        ]

    batched = seconds_per_case("friction.static=0.25..0.35", "contact.load=20 lbf..30 lbf")
    single = seconds_per_case(
        "friction.static=0.25..0.35", "structure.mode.axial.damping=0.002..0.004"
    )
    assert 0.03 < batched < 0.13 and 0.25 < single < 1.0  # Measured 0.055 and 0.47 s.
    # Cases with different tilt are computed one at a time.
    assert (
        0.25
        < seconds_per_case(
            "contact.tilt.angle=0.02 mrad..0.5 mrad:8", "contact.load=20 lbf,30 lbf", count=0
        )
        < 1.0
    )


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

    The estimate counts the failing cases and is still made.
    """
    scene = SweepScene(Path("a.toml"), POINT + COULOMB + more + SHORT)
    cases = read_cases(
        scene,
        Request(["friction.static=0.2..0.4", "drive.acceleration=8 g..9 g"], None, count, True),
    )
    message = warn_of_invalid_cases(scene, cases)
    assert message.startswith(f"{of} will fail: a.toml:" if of else "")
    assert bool(message) == bool(of)
    assert helps in message
    assert estimate_sweep(scene, cases)["cases"] == count
