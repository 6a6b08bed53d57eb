"""Memory of a run: its parts, the limits, and refusals before large arrays are allocated."""

import os
import tracemalloc

import pytest
from scene_texts import BENCH, COULOMB, PATCH, POINT, STRUCTURE

from patchfem import plan
from patchfem.runs import memory
from patchfem.scene import loads

TANH = COULOMB.replace("coulomb", "tanh") + 'reference_speed = "1 mm/s"\n'
RIG = POINT + TANH + STRUCTURE
MARCH, GIGABYTE = "accuracy.method=march", 10**9


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
    monkeypatch.setattr(memory, "free_bytes", lambda: GIGABYTE)
    tracemalloc.start()
    run_plan = plan_text(text, *sets)
    reason = memory.reason_for_refusal(run_plan)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert reason.startswith("about ") and f"{key}" in reason and "1 GB are free" in reason
    # The plan of a bench generates its samples to count them.
    assert peak < (7e8 if run_plan.kind == "bench" else 3e7)


def test_exact_free_memory_of_control_group(tmp_path):
    """The free memory is that of the system, at most the limit of the control group less what others use of it."""
    page = os.sysconf("SC_PAGE_SIZE")
    (tmp_path / "self").mkdir()
    files = {"meminfo": "MemTotal: 90 kB\nMemAvailable: 20 kB", "self/statm": "70 3 1", "memory.max": "9000",
             "memory.current": "5000", "memory.stat": "anon 1\ninactive_file 600"}  # fmt: skip
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert memory.free_bytes(tmp_path, tmp_path) == 9000 - 5000 + 600 + 3 * page
    (tmp_path / "memory.max").write_text("max")
    assert memory.free_bytes(tmp_path, tmp_path) == 20 * 1024 + 3 * page
    assert memory.free_bytes(tmp_path / "none", tmp_path) == float("inf")
