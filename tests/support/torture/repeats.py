"""The same run again: alone, under other numbers of threads, in other tongues and encodings."""

import hashlib
import json
import subprocess
from pathlib import Path

import h5py
import numpy as np

from . import grammar
from .results import whole
from .tables import RUBS
from .toml import text_of
from .trial import CODES, Trial, Wrong, process

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
ENVIRONMENTS = (
    {"LC_ALL": "C"}, {"LC_ALL": "POSIX", "PYTHONUTF8": "0"}, {"PYTHONIOENCODING": "ascii"}, {"PYTHONUTF8": "0"},
    {"PYTHONIOENCODING": "latin-1"}, {"PYTHONIOENCODING": "utf-16"}, {"LC_ALL": "tr_TR.UTF-8"}, {"LC_ALL": "nowhere"},
    {"LC_ALL": "de_DE.UTF-8"}, {"COLUMNS": "1"}, {"TERM": "dumb", "NO_COLOR": "1"}, {"HOME": "/nowhere"},
    {"TMPDIR": "/no"}, {"PYTHONWARNINGS": "error"}, {"PYTHONHASHSEED": "7"}, {"TZ": "Asia/Kathmandu"}, {"LANG": ""},
    {"PYTHONOPTIMIZE": "2"}, {"PYTHONDONTWRITEBYTECODE": "1"}, {"MPLBACKEND": "nonsense"},
    {"MPLCONFIGDIR": "/dev/null"}, {"PATH": ""})
NAMES = ("scène.toml", "摩擦.toml", "a b.toml", "-x.toml", "a\nb.toml", "é" * 60 + ".toml", "%s.toml", "x'y\".toml",
         "\udcff.toml", "tab\t.toml", "\u202e.toml", "$(x).toml", "a;b.toml", "#.toml", "[x].toml", "{}.toml",
         "a=b.toml")


def print_of(folder: Path) -> str:
    """Hash of every number of a run but its seconds."""
    out = hashlib.sha256()
    summary = json.loads((folder / "summary.json").read_text("utf-8"))
    out.update(json.dumps({k: v for k, v in summary.items() if k not in ("seconds", "effects")}).encode())
    if (folder / "result.nc").exists():
        with h5py.File(folder / "result.nc") as file:
            for name in sorted(file):
                if isinstance(file[name], h5py.Dataset) and file[name].dtype.kind in "fiu":
                    out.update(name.encode() + np.ascontiguousarray(file[name][()]).tobytes())
    return out.hexdigest()


def determinism(trial: Trial) -> None:
    """One scene in fresh processes: by itself, again, and with more threads; every bit is the same."""
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
        ended = trial.spawn("run", "scene.toml", "-o", folder, "--no-page", env=dict.fromkeys(THREADS, str(number)))
        if not (trial.folder / folder).exists():
            found[folder] = f"{ended.code} {ended.err}"
        else:
            found[folder] = print_of(trial.folder / folder)
    if len(set(found.values())) > 1:
        raise Wrong(f"runs of one scene differ: {found}")


def tongues(trial: Trial) -> None:
    """A scene with letters of any kind, under a name of any bytes, in any locale and encoding of the streams."""
    title = trial.draw("Prüfstand", "摩擦 ±5 µm", "\u202eabc", "\U0001f600", "é" * 200)
    tables = {"title": title, "normal": {"load": "20 N"}, "friction": {"law": "coulomb", "static": 0.3},
              "slide": {"kind": "sine", "amplitude": "10 µm", "frequency": "5 Hz"}}
    name = trial.draw("scene.toml", *NAMES)
    try:
        (trial.folder / name).write_text(text_of(tables), trial.draw("utf-8", "utf-8", "utf-8", "utf-8-sig", "utf-16"))
    except OSError:  # the file system has no such names
        return
    verb = trial.draw("run", "run", "check", "plan", "cite", "doctor", "new", "profile", "--help")
    words = [verb] if verb in ("doctor", "new", "--help") else [verb, f"./{name}"]
    ended = trial.spawn(*words, *(["-o", "out"] if verb == "run" else []), env=trial.draw(*ENVIRONMENTS))
    if verb == "run" and ended.code == 0:
        if whole(trial.folder / "out")["title"] != title:
            raise Wrong("the title is another one in summary.json")


def streams(trial: Trial) -> None:
    """Commands whose streams are full, closed, or read no further."""
    tables = RUBS | {"slide": {"kind": "sine", "amplitude": "10 um", "frequency": "5 Hz"}}
    (trial.folder / "scene.toml").write_text(text_of(tables), "utf-8")
    verb = trial.draw(["run", "scene.toml", "-o", "out"], ["check", "scene.toml"], ["plan", "scene.toml", "--json"],
                      ["--help"], ["run", "nowhere.toml"], ["schema"], ["doctor"])
    shape = trial.draw(">&-", "2>&-", ">&- 2>&-", ">/dev/full", "2>/dev/full", ">/dev/full 2>/dev/full", "| head -c 1",
                       "<&-", "2>&1 | head -c 1")
    line = " ".join(f"'{word}'" for word in process(*verb))
    trial.tell(f"patchfem {' '.join(verb)} {shape}")
    done = subprocess.run(["bash", "-c", f"set -o pipefail; {line} {shape}"], capture_output=True, timeout=60)
    said = done.stderr.decode("utf-8", "replace")
    if done.returncode not in (*CODES, 120) or "Traceback" in said or "Exception ignored" in said:
        raise Wrong(f"exit code {done.returncode} with {shape}: {said[-300:]}")
