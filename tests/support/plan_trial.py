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
from torture.toml import text_of
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


class Told(NamedTuple):
    """Scene with its seed, kind and engine; seconds and bytes as planned and as measured."""

    seed: int
    kind: str
    engine: str
    planned: tuple
    measured: tuple

    def within(self, time: float = 1.5, memory: float = 1.3) -> tuple:
        """Return whether the plan agrees in time and in memory within these factors."""
        ratios = [a / b for a, b in zip(self.planned, self.measured)]
        return tuple(1 / most <= ratio <= most for ratio, most in zip(ratios, (time, memory)))


def text(seed: int) -> str:
    """Return the scene of a seed."""
    trial = Trial(np.random.default_rng(seed), None, None, None)
    out = grammar.scene(trial)
    contact = out.get("contact")
    if contact:
        elements = trial.draw(0, 0, 0, 100, 200, 400)
        contact.pop("element_size", None)
        if elements:
            contact["element_size"] = f"{float(contact['length'].split()[0]) / elements:.4g} m"
    for table in ("slide", "drive"):
        if "cycles" in out.get(table, {}):
            out[table]["cycles"] = int(out[table]["cycles"] * trial.wide(1, 100))
    out["accuracy"]["tolerance"] = trial.draw(1e-2, 3e-3, 1e-3)
    return text_of(out)


def planned(seed: int):
    """Return the plan of a seed; None if it is refused or too long."""
    try:
        found = pf.plan(text(seed))
    except pf.PatchfemError:
        return None
    return found if found.seconds <= MOST else None


def told(first: int, count: int, folder: Path):
    """Yield `count` scenes, from a first seed on, as `PlannedRun`; refused runs are left out.

    A scene that disagrees with its plan is run again, and the smaller numbers are taken, because
    the first run may have compiled code.
    """
    seed = first - 1
    while count:
        seed += 1
        found = planned(seed)
        if found is None:
            continue
        path = folder / f"{seed}.toml"
        path.write_text(text(seed), encoding="utf-8")
        numbers = _measured(path, folder / str(seed))
        if numbers is None:
            continue
        one = Told(seed, found.kind, found.engine, (found.seconds, float(found.bytes)), numbers)
        if not all(one.within()):
            again = _measured(path, folder / str(seed))
            one = one._replace(measured=tuple(map(min, numbers, again)))
        count -= 1
        yield one


def _measured(path: Path, out: Path) -> tuple | None:
    """Return CPU seconds, at most 120, and peak memory [bytes] of `patchfem run`; None if it is refused."""
    words = [
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
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    code, seconds, size = done.stdout.split()
    return None if code in ("2", "4") else (float(seconds), 1024.0 * float(size))
