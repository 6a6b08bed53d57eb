"""Memory of a run: its parts, the limits, and refusals before large arrays are allocated."""

import resource
import subprocess
import sys
import tracemalloc

import pytest
from scene_texts import BENCH, COULOMB, MODE, PATCH, POINT, STRUCTURE

from patchfem import plan
from patchfem.runs import choose_numerics, memory, run
from patchfem.runs.plan import SKIPPING_NOTE
from patchfem.runs.rig import costs
from patchfem.scene import loads

TANH = COULOMB.replace("coulomb", "tanh") + 'reference_speed = "1 mm/s"\n'
RIG = POINT + TANH + STRUCTURE
MARCH, GIGABYTE = "accuracy.method=march", 10**9


def sum_bytes(run_plan) -> float:
    """Return the memory [bytes] of a plan."""
    return sum(part.bytes for part in run_plan.sizes.parts)


def plan_text(text, *sets):
    """Return the plan of a scene with --set options."""
    return plan(loads(text, "a.toml", sets))


@pytest.mark.share(0, 2, 3)
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
def test_refuses_large_run_before_allocation_with_key(text, sets, key, monkeypatch):
    """A run that needs more memory than is free is refused with the key to change, before large arrays are allocated."""
    monkeypatch.setattr(memory, "free_bytes", lambda **_: GIGABYTE)
    tracemalloc.start()
    run_plan = plan_text(text, *sets)
    reason = memory.reason_for_refusal(run_plan.sizes.parts)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert reason.startswith("about ") and f"{key}" in reason and "1 GB are free" in reason
    # The plan of a bench generates its samples to count them.
    assert peak < (7e8 if run_plan.kind == "bench" else 3e7)


@pytest.mark.share(1)
@pytest.mark.parametrize("method", ["march", "exact"])
def test_always_plan_estimates_memory_of_histories(method):
    """The memory of the histories of 3e5 cycles, beyond that of 1000 cycles, is estimated within a
    factor of 2.5. An earlier plan estimated a tenth."""
    text = POINT + COULOMB + STRUCTURE
    cycles = 3e5
    code = (
        "import sys; import patchfem as pf; pf.run(sys.argv[1], say=lambda text: None, "
        "**{'drive.cycles': float(sys.argv[2]), 'accuracy.method': sys.argv[3]}); "
        "print(open('/proc/self/status').read().partition('VmHWM:')[2].split()[0])"
    )
    peak_bytes = [
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
    short_plan, long_plan = (
        plan_text(text, f"accuracy.method={method}", f"drive.cycles={n}") for n in (1000.0, cycles)
    )
    assert (
        0.4 < (sum_bytes(long_plan) - sum_bytes(short_plan)) / (peak_bytes[1] - peak_bytes[0]) < 2.5
    )
    assert any("drive.cycles sets their size" in text_line for text_line in long_plan.verdict)
    assert SKIPPING_NOTE in long_plan.verdict
    assert SKIPPING_NOTE not in plan_text(text, "drive.cycles=50").verdict


def test_exact_free_memory_of_control_group(tmp_path):
    """The free memory of a control group is its limit minus the used memory plus the inactive file
    cache, for versions 1 and 2."""
    groups = tmp_path / "cgroup"
    root = tmp_path / "fs"
    for place, limit, used, inactive in (("a", 9000, 5000, 600), ("a/b", "max", 4000, 0)):
        (root / place).mkdir(parents=True)
        (root / place / "memory.max").write_text(f"{limit}\n")
        (root / place / "memory.current").write_text(f"{used}\n")
        (root / place / "memory.stat").write_text(f"anon 1\ninactive_file {inactive}\n")
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
@pytest.mark.parametrize("law, limit_mib", [(COULOMB, 150), (TANH, 200), (TANH, 300)])
def test_refuses_run_beyond_memory_limit_in_one_line(tmp_path, law, limit_mib):
    """A run beyond the memory limit of its process ends with exit code 4 and a message of one line."""
    path = tmp_path / "a.toml"
    path.write_text(POINT + law + MODE + STRUCTURE[len(MODE) :])
    process = subprocess.run(
        [sys.executable, "-m", "patchfem", "run", path, "-o", tmp_path / "out"],
        timeout=120,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_AS, (limit_mib << 20, limit_mib << 20)
        ),
    )
    assert process.returncode == 4 and process.stderr.count("\n") == 1, process.stderr
    assert "GB are free; free some memory" in process.stderr or "out of memory" in process.stderr


RANDOM_VIBRATION = """[structure]
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


def test_always_random_run_stores_planned_number_of_samples():
    """A random vibration stores as many samples per cycle as the engine needs, whatever the band
    demands of a march: 60 s take 3 GB, not 11 GB."""
    run_plan = plan_text(RANDOM_VIBRATION.format(2))
    expected = costs.count_stored_samples(choose_numerics(run_plan.model))
    assert run.run(run_plan).window.time.size == pytest.approx(expected, rel=0.01)
    assert 1e9 < sum_bytes(plan_text(RANDOM_VIBRATION.format(60))) < 4e9
