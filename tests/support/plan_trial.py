"""Scenes of all kinds by a seed, each run once as a command, its CPU seconds and peak memory beside those of its plan.

A scene is one of `torture.grammar`, with more cycles, finer patches and finer tolerances, so that more than the start
of the program counts. A scene that the program refuses, or plans at more than MOST seconds, gives way to the next seed.

Held out for the score of plans, none of them run before, are 40 scenes from seed 29 700 000 on, half of them of the
grammar as it is. They are drawn once, so that two states of the package have the same ones:

    python tests/support/plan_trial.py draw FOLDER
    python tests/support/plan_trial.py run FOLDER FILE.json
    python tests/support/plan_trial.py score FILE.json
"""

import json
import os
import subprocess
import sys
import tempfile
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from torture import grammar
from torture.toml import text_of
from torture.trial import Trial

import patchfem as pf

MOST = 60.0  # seconds
HELD_OUT = 29_700_000
# a process starts with the memory of the one that it is forked from as its peak: a small one stands in between
SMALL = """\
import resource, subprocess, sys
resource.setrlimit(resource.RLIMIT_CPU, (120, 120))
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(code, used.ru_utime + used.ru_stime, used.ru_maxrss)
"""


class Told(NamedTuple):
    """A scene: its seed, kind and engine, seconds and bytes as planned and as measured."""

    seed: int
    kind: str
    engine: str
    planned: tuple
    measured: tuple

    def within(self, time: float = 1.5, memory: float = 1.3) -> tuple:
        """Whether the plan holds in time and in memory, by these factors either way."""
        ratios = [a / b for a, b in zip(self.planned, self.measured)]
        return tuple(1 / most <= ratio <= most for ratio, most in zip(ratios, (time, memory)))


def text(seed: int) -> str:
    """The scene of a seed."""
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


def plain(seed: int) -> str:
    """The scene of a seed by the grammar alone."""
    return text_of(grammar.scene(Trial(np.random.default_rng(seed), None, None, None)))


def planned(seed: int, made=text):
    """The plan of a seed, None where it is refused or long."""
    try:
        found = pf.plan(made(seed))
    except pf.PatchfemError:
        return None
    return found if found.seconds <= MOST else None


def told(first: int, count: int, folder: Path, twice: bool = True, made=text):
    """`count` scenes from a seed on, as `Told`; one that ends with a refusal is left out. made(seed) -> the scene.

    twice: a scene whose plan does not hold is run once more and the smaller numbers are taken: the first time may have
    compiled code.
    """
    seed = first - 1
    while count:
        seed += 1
        found = planned(seed, made)
        if found is None:
            continue
        path = folder / f"{seed}.toml"
        path.write_text(made(seed), encoding="utf-8")
        numbers = _measured(path, folder / str(seed))
        if numbers is None:
            continue
        one = Told(seed, found.kind, found.engine, (found.seconds, float(found.bytes)), numbers)
        if twice and not all(one.within()):
            again = _measured(path, folder / str(seed))
            one = one._replace(measured=tuple(map(min, numbers, again)))
        count -= 1
        yield one


def _measured(path: Path, out: Path, environment=None) -> tuple | None:
    """CPU seconds, 120 at most, and peak memory [bytes] of `patchfem run`; None of a run that is refused."""
    words = [sys.executable, "-c", SMALL, sys.executable, "-m", "patchfem", "run", path, "-o", out, "-q"]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, env=environment)
    code, seconds, size = done.stdout.split()
    return None if code in ("2", "4") else (float(seconds), 1024.0 * float(size))


def drawn(first: int, count: int, folder: Path) -> None:
    """Write `count` scenes from a seed on that are not refused, half of them of the grammar alone, with names by their
    seeds."""
    folder.mkdir(parents=True, exist_ok=True)
    seeds = (seed for seed in range(first, first + 100 * count) if planned(seed, (text, plain)[seed % 2]) is not None)
    for seed in islice(seeds, count):
        (folder / f"{seed}.toml").write_text((text, plain)[seed % 2](seed), encoding="utf-8")


def kept(folder: Path, name: str) -> None:
    """Plan and run the scenes of a folder, a line for each to the file `name`; one that the file has is left out."""
    have = {one["scene"] for one in _lines(name)} if Path(name).exists() else set()
    for path in sorted(folder.glob("*.toml")):
        if path.stem not in have:
            line = beside(path)
            with open(name, "a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")


def beside(path: Path) -> dict:
    """Planned seconds of a scene, those of compiling apart where the plan has them, and CPU seconds of its run with an
    empty and with a full cache of its own, None of a run that is refused: all by the command line."""
    with tempfile.TemporaryDirectory() as cache:
        more = os.environ | {"PATCHFEM_CACHE": cache, "XDG_CACHE_HOME": cache}
        done = subprocess.run([sys.executable, "-m", "patchfem", "plan", str(path), "--json"], capture_output=True,
                              text=True, env=more)
        if done.returncode:
            return {"scene": path.stem, "refused": done.stderr}
        found = json.loads(done.stdout)
        empty, full = (_measured(path, Path(cache, "out"), more) for _ in range(2))
        return {"scene": path.stem, "kind": found["kind"], "engine": found.get("engine"), "planned": found["seconds"],
                "compiling": found.get("compile_seconds", 0.0), "empty": empty and empty[0], "full": full and full[0]}


def _lines(name) -> list:
    return [json.loads(line) for line in Path(name).read_text("utf-8").splitlines()]


def scored(lines: list) -> None:
    """Print the scenes whose plan is not within 2 of the real seconds, and how many are within 1.5 and within 2."""
    known = [one for one in lines if one.get("full")]
    for column, more in (("full", 0), ("empty", 1)):
        ratios = [(one["planned"] + more * one["compiling"]) / one[column] for one in known]
        for one, ratio in zip(known, ratios):
            if not 0.5 <= ratio <= 2:
                print(f"{column} cache, {ratio:.2f} times:", one)
        near = [sum(1 / most <= ratio <= most for ratio in ratios) for most in (1.5, 2.0)]
        print(f"{column} cache: {len(ratios)} scenes, within 1.5 in {near[0]}, within 2 in {near[1]}, planned over "
              f"twice in {sum(r > 2 for r in ratios)}, under half in {sum(r < 0.5 for r in ratios)}")


if __name__ == "__main__":
    verb, place, *rest = sys.argv[1:]
    if verb == "draw":
        drawn(HELD_OUT, 40, Path(place))
    elif verb == "run":
        kept(Path(place), rest[0])
    else:
        scored(_lines(place))
