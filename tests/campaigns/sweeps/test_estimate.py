"""What a sweep would take, beside the plans of its cases and what one leaves on disk."""

from pathlib import Path

import pytest
from scene_texts import BENCH, COULOMB, POINT, SHORT, SMALL_PATCH

from patchfem import plan
from patchfem.campaigns import Request, SweepScene, contradictions, estimate_sweep, read_cases
from patchfem.campaigns.sweeps.estimate import SWEEP_SECONDS
from patchfem.campaigns.sweeps.executors import LocalExecutor
from patchfem.export import SweepTarget, sweep_into


@pytest.mark.parametrize(
    "text, over",
    [(SMALL_PATCH, "contact.element_size=0.3 mm,1 mm,0.5 mm"), (BENCH, "slide.cycles=1,400,20")],
)
def test_exact_a_sweep_takes_what_its_cases_take_but_for_what_is_done_once(text, over):
    asked = SweepScene(Path("a.toml"), text)
    cases = read_cases(asked, Request([over]))
    told = estimate_sweep(asked, cases)
    plans = [plan(asked.model(cases.sets(number))) for number in range(3)]
    # of the work that is in no plan
    seconds = [one.seconds for one in plans]
    least = 0.05
    assert max(seconds) <= told["seconds"] + least and told["seconds"] <= sum(seconds) + least
    assert sum(seconds) - 3 * SWEEP_SECONDS <= told["seconds"] + least
    assert told["bytes"] == max(one.bytes for one in plans) > min(one.bytes for one in plans)


def test_always_a_sweep_leaves_on_disk_about_what_it_says(tmp_path):
    asked = SweepScene(Path("a.toml"), POINT + COULOMB + SHORT)
    cases = read_cases(asked, Request(["friction.static=0.05..0.6:40lin"]))
    sweep_into(asked, cases, SweepTarget(tmp_path / "a"), LocalExecutor())
    files = [
        one.stat().st_size
        for one in (tmp_path / "a").rglob("*")
        if one.is_file() and one.suffix != ".html"
    ]
    assert 0.5 < estimate_sweep(asked, cases)["disk_bytes"] / sum(files) < 2


def test_always_cases_that_march_alone_are_counted_so():
    """64 random cases of the shipped rig with other dampings each were foreseen to take 0.069 s a case, as if they
    marched side by side; they took 0.5 s. A case of a grid was foreseen to take the frames that only a run makes."""
    path = Path(__file__).parents[3] / "studies/rig/rig.toml"
    asked = SweepScene(path, path.read_text("utf-8"))

    def each(*over, count=64):
        return estimate_sweep(asked, read_cases(asked, Request(over, None, count, count > 0)))[
            "seconds_per_case"
        ]

    together = each("friction.static=0.25..0.35", "contact.load=20 lbf..30 lbf")
    alone = each("friction.static=0.25..0.35", "structure.mode.axial.damping=0.002..0.004")
    assert 0.03 < together < 0.13 and 0.25 < alone < 1.0  # 0.055 and 0.47 s were measured
    # 0.47
    assert (
        0.25
        < each("contact.tilt.angle=0.02 mrad..0.5 mrad:8", "contact.load=20 lbf,30 lbf", count=0)
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
def test_exact_a_contradiction_in_half_of_a_range_is_reported_and_leaves_a_plan(
    more, count, of, helps
):
    """static is drawn from 0.2 to 0.4 beside kinetic = 0.3. Every 8th point of Sobol's sequence is in one half: the
    plan once refused the whole sweep."""
    asked = SweepScene(Path("a.toml"), POINT + COULOMB + more + SHORT)
    cases = read_cases(
        asked,
        Request(["friction.static=0.2..0.4", "drive.acceleration=8 g..9 g"], None, count, True),
    )
    said = contradictions(asked, cases)
    assert said.startswith(f"{of} will fail: a.toml:" if of else "")
    assert bool(said) == bool(of)
    assert helps in said
    assert estimate_sweep(asked, cases)["cases"] == count
