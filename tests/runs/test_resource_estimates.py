"""Memory of a run: its parts, the limits, and refusals before large arrays are allocated."""

import os
import re
import tracemalloc

import numpy as np
import pytest
from scene_texts import (
    BENCH,
    COATED,
    COULOMB,
    DRIVE,
    MODE,
    NONLOCAL,
    PATCH,
    POINT,
    SHEAR,
    STRUCTURE,
)

from patchfem import plan
from patchfem.core import Missing
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
    with pytest.raises(Missing, match=f"^about .* 1 GB are free.*{re.escape(key)}"):
        memory.refuse_insufficient_memory(run_plan)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # The plan of a bench generates its samples to count them.
    assert peak < (7e8 if run_plan.kind == "bench" else 3e7)


def test_exact_memory_of_drive_modes_and_shear_modes(tmp_path):
    """The rows of a drive, the modes of a file and the shear modes count, and the largest of them is named.

    Measured: 400 bytes for each row, 125 for each pair of modes, 24 for each shear mode and node.
    """
    rows = "".join(f"{0.001 * k},{k % 2}\n" for k in range(50_001))
    (tmp_path / "shake.csv").write_text("time [s],acceleration [g]\n" + rows)
    base = DRIVE.partition("frequency")[0] + 'waveform = "file"\nfile = "shake.csv"\n'
    scene = loads(POINT + TANH + MODE + base, tmp_path / "a.toml")
    largest = _find_largest(scene)
    assert largest == (400 * 50_000, "50000 rows of the drive", DRIVE_REMEDY)

    n = 600
    np.savez(
        tmp_path / "rig.npz", M=np.eye(n), K=np.diag(np.linspace(1e4, 1e9, n)), slide=np.ones(n)
    )
    modal = '[structure]\nfile = "rig.npz"\n'
    scene = loads(POINT + TANH + modal + DRIVE, tmp_path / "a.toml", ["accuracy.method=harmonic"])
    assert _find_largest(scene) == (125 * n**2, f"{n} modes", "give fewer modes")

    shear = ["accuracy.shear_modes=2000", "accuracy.method=march", "drive.cycles=2"]
    scene = loads(COATED + SHEAR + NONLOCAL + STRUCTURE, "a.toml", shear)
    parts = {part.what: part for part in memory.list_parts(plan(scene))}
    points = plan(scene).unknowns["interface_points"]
    assert parts["2000 shear modes"] == (
        24 * 2000 * points,
        "2000 shear modes",
        "lower accuracy.shear_modes",
    )


DRIVE_REMEDY = "give fewer rows in drive.file, or lower drive.duration"


def _find_largest(scene) -> memory.MemoryPart:
    """Return the largest contribution that the scene determines."""
    return next(part for part in memory.list_parts(plan(scene)) if part.remedy)


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


def test_exact_free_memory_of_nested_control_groups(tmp_path):
    """The smallest limit of the control groups along the path of the process counts, also that of a parent."""
    groups = {
        "": ("max", 9000),
        "user.slice": ("8000", 7000),
        "user.slice/job": ("max", 500),
        "other": ("1", 0),
    }
    for name, (limit, used) in groups.items():
        folder = tmp_path / "cgroup" / name
        folder.mkdir(parents=True)
        for file, text in (("max", limit), ("current", str(used)), ("stat", "inactive_file 10")):
            (folder / f"memory.{file}").write_text(text)
    (tmp_path / "self").mkdir()
    (tmp_path / "self/cgroup").write_text("9:name=systemd:/other\n0::/user.slice/job\n")
    assert memory.free_bytes(tmp_path, tmp_path / "cgroup") == 8000 - 7000 + 10
    (tmp_path / "cgroup/user.slice/job/memory.max").write_text("900")
    assert memory.free_bytes(tmp_path, tmp_path / "cgroup") == 900 - 500 + 10
