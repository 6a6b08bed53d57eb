"""Random scenes of all kinds, each run once as a command: CPU time and peak memory against those of its plan.

A scene comes from `torture.grammar`, with more cycles, finer patches and smaller tolerances, so
that its cost exceeds that of starting the program. A scene that the program refuses, or plans at
more than MOST seconds, is replaced by the next seed.
"""

import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from torture import grammar
from torture.toml import to_toml
from torture.trial import Trial

import patchfem as pf

MOST = 60.0  # Longest planned CPU time of a scene [s].
# The peak memory of a new process includes that of its parent, so a small process starts the run.
SMALL = """\
import resource, subprocess, sys
resource.setrlimit(resource.RLIMIT_CPU, (120, 120))
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(code, used.ru_utime + used.ru_stime, used.ru_maxrss)
"""

# Runs a scene with compiled code only; a short run would use none that is not stored yet.
COMPILE = """\
import sys
from patchfem import compiled
compiled.MAX_PYTHON_SECONDS = -1.0
from patchfem import run
run(sys.argv[1])
"""


class PlannedRun(NamedTuple):
    """Scene with its seed, kind and engine; seconds and bytes as planned and as measured."""

    seed: int
    kind: str
    engine: str
    planned: tuple
    measured: tuple

    def is_within(self, time: float = 1.5, memory: float = 1.3) -> tuple:
        """Return whether the plan agrees in time and in memory within these factors."""
        ratios = [a / b for a, b in zip(self.planned, self.measured)]
        return tuple(1 / factor <= ratio <= factor for ratio, factor in zip(ratios, (time, memory)))


def draw_scene(seed: int) -> str:
    """Return the scene of a seed."""
    trial = Trial(np.random.default_rng(seed), None, None, None)
    out = grammar.draw_scene(trial)
    contact = out.get("contact")
    if contact:
        elements = trial.draw(0, 0, 0, 100, 200, 400)
        contact.pop("element_size", None)
        if elements:
            contact["element_size"] = f"{float(contact['length'].split()[0]) / elements:.4g} m"
    for table in ("slide", "drive"):
        if "cycles" in out.get(table, {}):
            out[table]["cycles"] = int(out[table]["cycles"] * trial.log_uniform(1, 100))
    out["accuracy"]["tolerance"] = trial.draw(1e-2, 3e-3, 1e-3)
    return to_toml(out)


def make_plan(seed: int):
    """Return the plan of a seed; None if it is refused or too long."""
    try:
        plan = pf.plan(draw_scene(seed))
    except pf.PatchfemError:
        return None
    return plan if plan.seconds <= MOST else None


def measure_scenes(first: int, count: int, folder: Path):
    """Yield `count` scenes, from a first seed on, as `PlannedRun`; refused runs are left out.

    A scene that disagrees with its plan is compiled, planned and run again, because the first run may
    have compiled code, or, if it is short, may have used none, while a plan assumes compiled code.
    """
    seed = first - 1
    while count:
        seed += 1
        plan = make_plan(seed)
        if plan is None:
            continue
        path = folder / f"{seed}.toml"
        path.write_text(draw_scene(seed), encoding="utf-8")
        numbers = _measure_run(path, folder / str(seed))
        if numbers is None:
            continue
        run = PlannedRun(seed, plan.kind, plan.engine, (plan.seconds, float(plan.bytes)), numbers)
        if not all(run.is_within()):
            subprocess.run([sys.executable, "-c", COMPILE, path], capture_output=True)
            plan = make_plan(seed)
            run = run._replace(
                planned=(plan.seconds, float(plan.bytes)),
                measured=_measure_run(path, folder / str(seed)),
            )
        count -= 1
        yield run


def _measure_run(path: Path, out: Path) -> tuple | None:
    """Return CPU seconds, at most 120, and peak memory [bytes] of `patchfem run`; None if it is refused."""
    command = [
        sys.executable,
        "-c",
        SMALL,
        sys.executable,
        "-m",
        "patchfem",
        "run",
        path,
        "-o",
        out,
        "-q",
    ]
    process = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    code, seconds, kibibytes = process.stdout.split()
    return None if code in ("2", "4") else (float(seconds), 1024.0 * float(kibibytes))
