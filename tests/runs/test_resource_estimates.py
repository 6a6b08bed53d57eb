"""Memory of a run: its parts, the limits, and refusals before large arrays are allocated."""

import mmap
import re
import tracemalloc

import numpy as np
import pytest
from scene_texts import (
    BENCH,
    COULOMB,
    DRIVE,
    MODE,
    PATCH,
    POINT,
    STRUCTURE,
)

from patchfem import plan
from patchfem.core import Missing
from patchfem.runs import plan as memory
from patchfem.scene import loads

TANH = COULOMB.replace("coulomb", "tanh") + 'reference_speed = "1 mm/s"\n'
RIG = POINT + TANH + STRUCTURE
MARCH, GIGABYTE = "accuracy.method=march", 10**9


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
    ],
)
def test_refuses_large_run_before_allocation_with_key(text, sets, key, monkeypatch):
    """A run that needs more memory than is free is refused with the key to change, before large arrays are allocated."""
    monkeypatch.setattr(memory, "free_bytes", lambda: GIGABYTE)
    tracemalloc.start()
    run_plan = plan(loads(text, "a.toml", sets))
    with pytest.raises(Missing, match=f"^about .* 1 GB are free.*{re.escape(key)}"):
        memory.refuse_insufficient_memory(run_plan)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # The plan of a bench generates its samples to count them.
    assert peak < (7e8 if run_plan.kind == "bench" else 3e7)


def test_exact_memory_of_drive_and_modes(tmp_path):
    """The rows of a drive and the modes of a file count, and the largest of them is named.

    Measured: 400 bytes for each row, 125 for each pair of modes.
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


DRIVE_REMEDY = "give fewer rows in drive.file, or lower drive.duration"


def _find_largest(scene):
    """Return the largest contribution that the scene determines."""
    return next(part for part in memory.list_memory_parts(plan(scene)) if part.remedy)


def test_exact_free_memory_of_control_groups(tmp_path):
    """The free memory is that of the system, at most the limit of a control group along the path of the process less what
    others use of it."""
    groups = {
        "": ("max", 9000),
        "user.slice": ("8000", 7000),
        "user.slice/job": ("max", 500),
        "other": ("1", 0),
    }
    files = {
        "self/cgroup": "9:name=systemd:/other\n0::/user.slice/job\n",
        "self/statm": "70 3 1",
        "meminfo": "MemTotal: 90 kB\nMemAvailable: 20 kB",
    }
    for name, (limit, used) in groups.items():
        for file, text in (("max", limit), ("current", str(used)), ("stat", "inactive_file 10")):
            files[f"cgroup/{name}/memory.{file}"] = text
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    own = 3 * mmap.PAGESIZE
    folder = tmp_path / "cgroup"
    assert memory.free_bytes(tmp_path, folder) == 8000 - 7000 + 10 + own
    (folder / "user.slice/job/memory.max").write_text("900")
    assert memory.free_bytes(tmp_path, folder) == 900 - 500 + 10 + own
    for name in ("user.slice", "user.slice/job"):
        (folder / name / "memory.max").write_text("max")
    assert memory.free_bytes(tmp_path, folder) == 20 * 1024 + own
    assert memory.free_bytes(tmp_path / "none", folder) == float("inf")


def test_refuses_run_above_the_memory_of_its_scene():
    """A run above accuracy.max_memory is refused with the key; one above the default only says what it needs."""
    sets = [MARCH, "drive.cycles=4e7"]
    run_plan = plan(loads(RIG, "a.toml", sets))
    said = []
    memory.refuse_insufficient_memory(run_plan, said.append)
    (sentence,) = said
    assert "accuracy.max_memory allows 2 GB" in sentence and "lower drive.cycles" in sentence

    given = plan(loads(RIG, "a.toml", [*sets, "accuracy.max_memory=300 MB"]))
    refusal = "allows 0\\.3 GB.*lower drive\\.cycles, or raise accuracy\\.max_memory"
    with pytest.raises(Missing, match=refusal):
        memory.refuse_insufficient_memory(given)
