"""Memory and time foreseen: what takes them, the limits that are seen, and refusals before anything is made."""

import json
import os
import resource
import subprocess
import sys
import tracemalloc
from dataclasses import replace

import plan_trial
import pytest
from scene_texts import BENCH, COULOMB, MODE, PATCH, POINT, STRUCTURE

from patchfem import plan
from patchfem.core import Missing
from patchfem.runs import choose_numerics, memory, run
from patchfem.runs.plan import UPPER_LIMIT_NOTE, refuse_large_run
from patchfem.runs.rig import costs
from patchfem.scene import loads

TANH = COULOMB.replace("coulomb", "tanh") + 'reference_speed = "1 mm/s"\n'
RIG = POINT + TANH + STRUCTURE
MARCH, GIGABYTE = "accuracy.method=march", 10**9


def planned(text, *sets):
    return plan(loads(text, "a.toml", sets))


@pytest.mark.share(0, 1, 2, 3, 5)
@pytest.mark.parametrize(
    "text, sets, key",
    [
        (PATCH, ["contact.element_size=0.5 um"], "make contact.element_size larger"),
        (RIG, [MARCH, "accuracy.steps_per_cycle=10000000"], "lower accuracy.steps_per_cycle"),
        (RIG, ["accuracy.method=harmonic", "accuracy.harmonics=10000"], "lower accuracy.harmonics"),
        (RIG, [MARCH, "drive.cycles=3e7"], "lower drive.cycles"),
        (POINT + COULOMB + STRUCTURE, ["drive.cycles=2e7"], "lower drive.cycles"),
        (
            BENCH,
            [
                "slide.cycles=15000",
                "slide.kind=sine",
                "slide.frequency=1 Hz",
                "accuracy.steps_per_cycle=1000",
            ],
            "lower accuracy.steps_per_cycle",
        ),
        (
            PATCH,
            ["contact.strips.count=10000", "contact.element_size=50 um"],
            "lower contact.strips.count",
        ),
    ],
)
def test_refuses_before_anything_is_made_with_the_key_that_drives_it(text, sets, key):
    tracemalloc.start()
    found = planned(text, *sets)
    said = memory.reason_of_refusal(found.cost.parts, GIGABYTE)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert said.startswith("about ") and f"{key}" in said and "1 GB are free" in said
    # a bench counts its samples by making them
    assert peak < (7e8 if found.kind == "bench" else 3e7)


@pytest.mark.parametrize("method, cycles", [("march", 3e6), ("exact", 3e6)])
def test_always_the_plan_estimates_the_memory_of_the_histories(method, cycles):
    """What 1000 cycles take is left out. Over 3e6 cycles the plan said as little as over 1000: a tenth."""
    text = POINT + COULOMB + STRUCTURE
    code = (
        "import sys; import patchfem as pf; pf.run(sys.argv[1], say=lambda text: None, "
        "**{'drive.cycles': float(sys.argv[2]), 'accuracy.method': sys.argv[3]}); "
        "print(open('/proc/self/status').read().partition('VmHWM:')[2].split()[0])"
    )
    taken = [
        1024
        * int(
            subprocess.run(
                [sys.executable, "-c", code, text, str(n), method],
                check=True,
                capture_output=True,
                text=True,
            ).stdout
        )
        for n in (1000.0, cycles)
    ]
    few, many = (
        planned(text, f"accuracy.method={method}", f"drive.cycles={n}") for n in (1000.0, cycles)
    )
    assert 0.4 < (many.bytes - few.bytes) / (taken[1] - taken[0]) < 2.5
    assert any("drive.cycles sets their size" in one for one in many.verdict)
    assert UPPER_LIMIT_NOTE in many.verdict
    assert UPPER_LIMIT_NOTE not in planned(text, "drive.cycles=50").verdict


def test_exact_memory_grows_with_the_square_of_the_nodes_and_with_the_steps_of_the_window():
    few, many = (planned(PATCH, f"contact.element_size={size} um").bytes for size in (2, 1))
    assert 3.6 < many / few < 4.0
    few, many = (planned(RIG, MARCH, f"accuracy.steps_per_cycle={n}00000").bytes for n in (2, 4))
    # 30 cycles keep the last 3
    assert many - few == pytest.approx(costs.MARCH_HISTORY.sample * 20 * 3 * 2e5, rel=0.01)


def test_exact_a_run_of_centuries_is_refused_with_its_key():
    with pytest.raises(Missing, match=r"computing time of about .* s .*; lower drive\.cycles$"):
        long = planned(RIG, MARCH, "drive.cycles=1e15")
        # the memory is refused before
        refuse_large_run(replace(long, cost=replace(long.cost, parts=())))


def test_exact_a_group_with_a_limit_leaves_what_it_has_not_used(tmp_path):
    groups = tmp_path / "cgroup"
    root = tmp_path / "fs"
    for place, most, used, old in (("a", 9000, 5000, 600), ("a/b", "max", 4000, 0)):
        (root / place).mkdir(parents=True)
        (root / place / "memory.max").write_text(f"{most}\n")
        (root / place / "memory.current").write_text(f"{used}\n")
        (root / place / "memory.stat").write_text(f"anon 1\ninactive_file {old}\n")
    groups.write_text("0::/a/b\n")
    assert memory.free_in_control_group(50.0, groups, root) == 9000 - 5000 + 600 + 50
    groups.write_text("5:cpu:/a\n4:memory:/c\n0::/\n")
    place = root / "memory" / "c"
    place.mkdir(parents=True)
    for name, text in (
        ("limit_in_bytes", "700"),
        ("usage_in_bytes", "300"),
        ("stat", "total_inactive_file 20"),
    ):
        (place / f"memory.{name}").write_text(text + "\n")
    assert memory.free_in_control_group(50.0, groups, root) == 700 - 300 + 20 + 50
    assert memory.free_in_control_group(50.0, tmp_path / "none", root) == float("inf")


@pytest.mark.share(1)
@pytest.mark.parametrize("law, least", [(COULOMB, 150), (TANH, 200), (TANH, 300)])
def test_refuses_in_one_line_a_run_beyond_the_memory_limit(tmp_path, law, least):
    path = tmp_path / "a.toml"
    path.write_text(POINT + law + MODE + STRUCTURE[len(MODE) :])
    done = subprocess.run(
        [sys.executable, "-m", "patchfem", "run", path, "-o", tmp_path / "out"],
        timeout=120,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (least << 20, least << 20)),
    )
    assert done.returncode == 4 and done.stderr.count("\n") == 1, done.stderr
    assert "GB are free; free some memory" in done.stderr or "out of memory" in done.stderr


@pytest.mark.slow
def test_always_plans_hold_in_most_scenes(tmp_path):
    """CPU time within 1.5 and memory within 1.3 of scenes of all kinds in 9 of 10.

    Held out when the numbers of `runs.memory`, of the grids foreseen and of the plans were fixed: of 80 scenes from
    seed 6000 time held in 75 (94 %) and memory in 76 (95 %). What was missed: comparison methods (two of the five in
    time, two of the four in memory), a march of two masses, and two patches whose mesh climbs further or less far than
    foreseen.

    Held out when the bonds of held blocks were counted anew: of 40 from seed 20261130 time held in 37, of 40 of the
    grammar as they are in 34, in all 80 within twice, and memory in all 80. What was missed was planned too long. All
    these plans are as they were before. Of twelve scenes where the printed law holds a block, from the same seed, time
    held in 5 (in 1 before), in 6 within twice (in 4), and the worst plan is 33 times too long at least.
    """
    scores = [one.within() for one in plan_trial.told(6000, 80, tmp_path)]
    time, memory_ = (sum(column) / len(scores) for column in zip(*scores))
    assert time >= 0.9 and memory_ >= 0.9


RUBBED = """[structure]
masses = ["1 kg", "2 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1 N/um"
[[structure.spring]]
between = [2, 1]
stiffness = "2 N/um"
[[structure.interface]]
between = [1, 0]
load = "30 N"
law = "coulomb"
static = 0.3
[[structure.interface]]
between = [2, 1]
load = "20 N"
law = "coulomb"
static = 0.3
[drive]
kind = "base"
acceleration = "2 m/s^2"
frequency = "100 Hz"
cycles = 2
"""


def test_always_a_short_run_of_several_interfaces_is_planned(tmp_path):
    """As a user plans it: a short run is not compiled, but runs as Python."""
    (tmp_path / "scene.toml").write_text(RUBBED, "utf-8")
    command = [sys.executable, "-m", "patchfem", "plan", tmp_path / "scene.toml", "--json"]
    environment = os.environ | {"PATCHFEM_CACHE": str(tmp_path)}  # nothing is compiled yet
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    found = json.loads(done.stdout)
    assert found["engine"] == "exact" and found["compile_seconds"] == 0
    assert 7e7 < found["bytes"] < 2e8


SHAKEN = """[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
slide = 1.0
frequency = "100 Hz"
damping = 0.02
[drive]
kind = "base"
waveform = "random"
spectrum = "0.01 g^2/Hz"
from = "5 Hz"
to = "1000 Hz"
duration = "{} s"
"""


def test_always_a_random_run_keeps_as_many_samples_as_are_foreseen():
    """Of every cycle as many as the engine keeps, whatever the band asks of a march: 60 s took 1.5 GB, not 11."""
    found = planned(SHAKEN.format(2))
    kept = costs.count_kept_samples(choose_numerics(found.model))
    assert run.run(found).window.time.size == pytest.approx(kept, rel=0.01)
    assert 1e9 < planned(SHAKEN.format(60)).bytes < 2e9
