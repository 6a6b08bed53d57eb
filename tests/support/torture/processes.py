"""Commands in their own processes: repeated runs with more threads, and runs with little memory."""

import hashlib
import json
import resource
from pathlib import Path

import h5py
import numpy as np

from . import grammar
from .results import check_results
from .toml import to_toml
from .trial import Trial, TrialFailure

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def hash_results(folder: Path) -> str:
    """Return a hash of every number of a run except its computing times."""
    out = hashlib.sha256()
    summary = json.loads((folder / "summary.json").read_text("utf-8"))
    out.update(
        json.dumps({k: v for k, v in summary.items() if k not in ("seconds", "effects")}).encode()
    )
    if (folder / "result.nc").exists():
        with h5py.File(folder / "result.nc") as file:
            for name in sorted(file):
                if isinstance(file[name], h5py.Dataset) and file[name].dtype.kind in "fiu":
                    out.update(name.encode() + np.ascontiguousarray(file[name][()]).tobytes())
    return out.hexdigest()


def run_determinism_trial(trial: Trial) -> None:
    """Run a scene in new processes, twice and with more threads; all results must be bit-identical."""
    for _ in range(8):
        (trial.folder / "scene.toml").write_text(to_toml(grammar.draw_scene(trial)), "utf-8")
        seconds = trial.planned_seconds("scene.toml")
        if seconds is not None and seconds < 4.0:
            break
    else:
        return
    hashes = {}
    for number in (1, 1, 2, 4):
        folder = f"run{len(hashes)}"
        result = trial.spawn(
            "run", "scene.toml", "-o", folder, "--no-page", env=dict.fromkeys(THREADS, str(number))
        )
        if not (trial.folder / folder).exists():
            hashes[folder] = f"{result.code} {result.err}"
        else:
            hashes[folder] = hash_results(trial.folder / folder)
    if len(set(hashes.values())) > 1:
        raise TrialFailure(f"runs of one scene differ: {hashes}")


def run_memory_trial(trial: Trial) -> None:
    """Run a random scene with limited address space."""
    tables = grammar.draw_scene(trial)
    tables["accuracy"]["steps_per_cycle"] = int(trial.log_uniform(100, 1e6))
    (trial.folder / "scene.toml").write_text(to_toml(tables), "utf-8")
    max_bytes = int(trial.log_uniform(3e8, 3e9))
    result = trial.spawn(
        trial.draw("run", "run", "plan", "check"),
        "scene.toml",
        seconds=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (max_bytes, max_bytes)),
        allowed=(0, 2, 3, 4),
    )
    if result.code == 0 and (trial.folder / "out" / "scene").exists():
        check_results(trial.folder / "out" / "scene")
