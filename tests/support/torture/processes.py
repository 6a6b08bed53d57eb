"""Commands in their own processes: repeated runs with more threads, and runs with little memory."""

import hashlib
import json
import resource
from pathlib import Path

import h5py
import numpy as np

from . import grammar
from .results import whole
from .toml import text_of
from .trial import Trial, Wrong

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def print_of(folder: Path) -> str:
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


def determinism(trial: Trial) -> None:
    """Run a scene in new processes, twice and with more threads; all results must be bit-identical."""
    for _ in range(8):
        (trial.folder / "scene.toml").write_text(text_of(grammar.scene(trial)), "utf-8")
        seconds = trial.announced("scene.toml")
        if seconds is not None and seconds < 4.0:
            break
    else:
        return
    found = {}
    for number in (1, 1, 2, 4):
        folder = f"run{len(found)}"
        ended = trial.spawn(
            "run", "scene.toml", "-o", folder, "--no-page", env=dict.fromkeys(THREADS, str(number))
        )
        if not (trial.folder / folder).exists():
            found[folder] = f"{ended.code} {ended.err}"
        else:
            found[folder] = print_of(trial.folder / folder)
    if len(set(found.values())) > 1:
        raise Wrong(f"runs of one scene differ: {found}")


def memory(trial: Trial) -> None:
    """Run a random scene with limited address space."""
    tables = grammar.scene(trial)
    tables["accuracy"]["steps_per_cycle"] = int(trial.wide(100, 1e6))
    (trial.folder / "scene.toml").write_text(text_of(tables), "utf-8")
    most = int(trial.wide(3e8, 3e9))
    ended = trial.spawn(
        trial.draw("run", "run", "plan", "check"),
        "scene.toml",
        seconds=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (most, most)),
        allowed=(0, 2, 3, 4),
    )
    if ended.code == 0 and (trial.folder / "out" / "scene").exists():
        whole(trial.folder / "out" / "scene")
