"""Random scenes of all kinds: share of errors that hold, and of main measures inside the tolerance.

    python tests/support/scene_campaign.py draw FOLDER SCENES        # FOLDER: a checkout of version 1.11
    python tests/support/scene_campaign.py run SCENES OUT TOLERANCE...
    python tests/support/scene_campaign.py score REFERENCES OUT...

Recipe: the grammar of version 1.11 (`tests/support/torture/grammar.py`) draws a scene for each seed from FIRST_SEED on; the
first N_SCENES that `plan` accepts are kept. The key contact.element_size is left out, because a mesh that a scene fixes has
the error that it has. The references are runs with tolerance 1e-5, with their errors as doubts; they show errors that are
too small, but no fault that all tolerances share. A scene has MAX_CPU_SECONDS.
"""

import json
import signal
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from time import process_time

import numpy as np
from campaigns import Row, strip_number

import patchfem as pf
from patchfem.runs.refine import is_main

FIRST_SEED = 20301400
N_SCENES = 200
MAX_CPU_SECONDS = 20.0
DRAW = """
import json, sys
import numpy as np
sys.path[:0] = [sys.argv[1], sys.argv[1] + "/tests/support"]
from torture.grammar import draw_scene
from torture.toml import to_toml
from torture.trial import Trial
for seed in range(int(sys.argv[2]), int(sys.argv[2]) + 4 * int(sys.argv[3])):
    tables = draw_scene(Trial(np.random.default_rng(seed), None, None, None))
    tables.get("contact", {}).pop("element_size", None)
    print(json.dumps([seed, to_toml(tables)]))
"""


def draw(folder: str, file: str) -> None:
    """Write the first N_SCENES scenes that `plan` accepts, a line [seed, text] for each."""
    command = [sys.executable, "-c", DRAW, folder, str(FIRST_SEED), str(N_SCENES)]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    kept = []
    with tempfile.TemporaryDirectory() as work:
        path = Path(work) / "scene.toml"
        for line in lines:
            path.write_text(json.loads(line)[1])
            try:
                pf.plan(pf.load(path))
            except pf.PatchfemError:
                continue
            kept.append(line)
    Path(file).write_text("\n".join(kept[:N_SCENES]))


def stop_scene(*_) -> None:
    """Raise TimeoutError in a scene that takes too long (a signal handler)."""
    raise TimeoutError


def run(file: str, out: str, *tolerances: str) -> None:
    """Append a line with the measures of each scene at each tolerance, as soon as it is computed."""
    signal.signal(signal.SIGPROF, stop_scene)
    with tempfile.TemporaryDirectory() as work, Path(out).open("a") as rows:
        path = Path(work) / "scene.toml"
        for seed, text in map(json.loads, Path(file).read_text().splitlines()):
            path.write_text(text)
            for tolerance in tolerances:
                begin = process_time()
                signal.setitimer(signal.ITIMER_PROF, MAX_CPU_SECONDS)
                row = {"seed": seed, "tol": float(tolerance)}
                try:
                    result = pf.run(path, **{"accuracy.tolerance": float(tolerance)})
                    row["measures"] = {
                        name: [one.value, one.error, one.floor]
                        for name, one in result.measures.items()
                    }
                except (pf.PatchfemError, TimeoutError) as error:
                    row["failed"] = f"{type(error).__name__}: {error}"
                finally:
                    signal.setitimer(signal.ITIMER_PROF, 0)
                rows.write(json.dumps(row | {"cpu": process_time() - begin}, default=float) + "\n")
                rows.flush()


def read_rows(file: str) -> list[dict]:
    """Read the lines of scenes that have measures."""
    rows = map(json.loads, Path(file).read_text().splitlines())
    return [row for row in rows if "measures" in row]


def score(references: str, *files: str) -> None:
    """Print the share of errors that hold by measure, and of main measures inside their tolerance."""
    truths = {row["seed"]: row["measures"] for row in read_rows(references)}
    holds = defaultdict(list)
    inside = defaultdict(list)
    for row in [row for file in files for row in read_rows(file)]:
        truth = truths.get(row["seed"], {})
        for name, (value, error, floor) in row["measures"].items():
            if value is None:
                continue
            if is_main(name):
                allowed = row["tol"] * abs(value) + floor
                inside[row["tol"]].append(error is not None and error <= allowed)
            known = truth.get(name, (None, None))[:2]
            if error is not None and None not in known:
                one = Row(name, value, error, floor, *known)
                for group in (strip_number(name), "all"):
                    holds[group].append(one.holds)
                if not one.holds:
                    print(f"too small: seed {row['seed']}, tolerance {row['tol']}", *one)
    for name, values in sorted(holds.items()):
        print(f"{name:34s} {len(values):5d} errors, {np.mean(values):7.2%} hold")
    for tolerance, values in sorted(inside.items(), reverse=True):
        print(f"{tolerance}: {np.mean(values):.1%} of {len(values)} main measures are inside")


if __name__ == "__main__":
    {"draw": draw, "run": run, "score": score}[sys.argv[1]](*sys.argv[2:])
