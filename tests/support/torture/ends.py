"""Commands that are killed, or that run out of disk or memory: what is on the disk is whole or not there at all."""

import os
import resource
import shutil
import signal
import subprocess
import time
from pathlib import Path

from . import grammar
from .hostile import device
from .results import left_over, whole
from .scenes import damage
from .toml import text_of
from .trial import Trial, Wrong, process

BENCH = {"normal": {"load": "20 N"}, "friction": {"law": "nonlocal", "static": 0.3, "bond_length": "1 um"},
         "slide": {"kind": "triangle", "amplitude": "10 um", "speed": "5 mm/s", "cycles": 3}}
PATCH = {"contact": {"length": "10 mm", "width": "10 mm", "height": "5 mm", "load": "50 N", "substrate": "steel",
                     "element_size": "0.2 mm", "tilt": {"angle": "1 urad"}}}


def kills(trial: Trial) -> None:
    """A run, a sweep or a write that is ended at a random time, by any signal, over older results or none."""
    _scene(trial, trial.draw(BENCH, PATCH))
    older = trial.chance(0.5)
    words = trial.draw(["run", "scene.toml", "-o", "out"], ["run", "scene.toml", "-o", "out", "--no-page"],
                       ["mesh", "scene.toml", "-o", "out.vtu"],
                       ["sweep", "scene.toml", "--over", f"{_load(trial)}=20 N,30 N", "-o", "out"])
    if words[0] == "mesh":
        _scene(trial, PATCH)
    if older:
        trial.spawn(*words)
    before = _tree(trial.folder)
    sent = trial.draw(signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
    _ended(trial, words, sent)
    _kept(trial, words, before if older else None)
    trial.spawn(*words, *(["--resume"] if words[0] == "sweep" else []))
    _kept(trial, words, None)
    _clean(trial.folder)


def _ended(trial: Trial, words: list, sent: int) -> None:
    """A command that gets a signal at a random time of its two seconds."""
    trial.tell(f"patchfem {' '.join(words)}, then signal {sent}")
    done = subprocess.Popen(process(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(trial.wide(0.02, 2.5))
    done.send_signal(sent)
    try:
        _, said = done.communicate(timeout=20)
    except subprocess.TimeoutExpired:
        done.kill()
        raise Wrong(f"no end within 20 s of signal {sent}") from None
    if sent != signal.SIGKILL and b"Traceback" in said:
        raise Wrong(f"a traceback after signal {sent}: {said[-300:].decode('utf-8', 'replace')}")
    if done.returncode not in (0, 130, -sent):
        raise Wrong(f"exit code {done.returncode} after signal {sent}: {said[-300:].decode('utf-8', 'replace')}")


def _kept(trial: Trial, words: list, before: dict | None) -> None:
    """Results are whole, and the older ones are still there where the new ones are not."""
    out = trial.folder / "out"
    if words[0] == "run" and out.exists():
        whole(out)
    if before is not None and not (trial.folder / words[words.index("-o") + 1]).exists():
        raise Wrong("older results are gone and no new ones are there")


def _tree(folder: Path) -> dict:
    return {str(path.relative_to(folder)): path.stat().st_size for path in folder.rglob("*") if path.is_file()}


def _clean(folder: Path) -> None:
    """Wrong for what the last whole command left unfinished."""
    left_over(folder)


def _scene(trial: Trial, tables: dict) -> None:
    (trial.folder / "scene.toml").write_text(text_of(tables), "utf-8")
    trial.load = "contact.load" if "contact" in tables else "normal.load"


def _load(trial: Trial) -> str:
    return trial.load


WRITES = (["run", "scene.toml", "-o", "out"], ["run", "scene.toml", "-o", "out"], ["mesh", "scene.toml", "-o", "m.msh"],
          ["mesh", "scene.toml", "-o", "m.vtu"], ["schema", "-o", "s.json"], ["new", "joint", "-o", "n.toml"],
          ["sweep", "scene.toml", "--over", "contact.load=20 N,30 N", "-o", "out"], ["export", "old", "-o", "f.pvd"],
          ["export", "old", "-o", "f.vtu"], ["report", "old", "-o", "r.html"], ["export", "old", "-o", "f.csv"])


def disks(trial: Trial) -> None:
    """A command that may write no file beyond a random size, or to a device that is full."""
    _scene(trial, PATCH)
    words = list(trial.draw(*WRITES))
    if "old" in words:
        trial.spawn("run", "scene.toml", "-o", "old")
    most = int(trial.wide(1, 400_000))

    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    cache = trial.folder / "cache"
    plain = {"PYTHONDONTWRITEBYTECODE": "1"}  # the limit would cut short the bytecode that later processes load
    options = {"env": plain | {"PATCHFEM_CACHE": str(cache)}, "seconds": 600.0} if trial.chance(0.1) else {"env": plain}
    if trial.chance(0.2):
        limited = None
        device("full", 7)
        words[words.index("-o") + 1] = trial.draw("full", "/proc/x", "/sys/x", "no/such/folder/x")
    ended = trial.spawn(*words, preexec_fn=limited, **options)
    shutil.rmtree(cache, ignore_errors=True)
    if ended.code == 0 and words[0] == "run" and limited is not None:
        whole(trial.folder / "out")
    out = trial.folder / words[words.index("-o") + 1]
    kept = words[0] == "sweep" and any(out.glob("cases/[0-9a-f]*/summary.json"))  # a sweep keeps its whole cases
    if ended.code not in (0, 3) and limited is not None and out.exists() and not kept:
        raise Wrong(f"exit code {ended.code}, and {out.name} is there")
    if limited is not None:
        _clean(trial.folder)


def memory(trial: Trial) -> None:
    """A run of any scene under a limit of its address space."""
    tables = grammar.scene(trial)
    tables["accuracy"]["steps_per_cycle"] = int(trial.wide(100, 1e6))
    (trial.folder / "scene.toml").write_text(text_of(tables), "utf-8")
    most = int(trial.wide(3e8, 3e9))
    ended = trial.spawn(trial.draw("run", "run", "plan", "check"), "scene.toml", seconds=60,
                        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (most, most)),
                        allowed=(0, 2, 3, 4))
    if ended.code == 0 and (trial.folder / "out" / "scene").exists():
        whole(trial.folder / "out" / "scene")


def together(trial: Trial) -> None:
    """Two commands at one instant on one folder, or on one cold cache of compiled code: one at least holds, both in
    words."""
    _scene(trial, BENCH)
    cache = trial.folder / "cache"
    shared = {"PATCHFEM_CACHE": str(cache)} if trial.chance(0.3) else {}
    same = trial.chance(0.6)
    trial.tell("patchfem run scene.toml, twice at one instant" + (", cold cache" if shared else ""))
    runs = [subprocess.Popen(process("run", "scene.toml", "-o", "out" if same else f"out{k}", "--no-page"),
                             stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=os.environ | shared)
            for k in range(2)]
    ends = [(one.communicate(timeout=500)[1].decode("utf-8", "replace"), one.returncode) for one in runs]
    codes = sorted(code for _, code in ends)
    if codes not in ([0, 0], [0, 4]) or (codes != [0, 0] and not same) or any("Traceback" in said for said, _ in ends):
        raise Wrong(f"exit codes {codes}: {' | '.join(said[-200:] for said, _ in ends)}")
    for name in ("out",) if same else ("out0", "out1"):
        whole(trial.folder / name)
    if shared:
        _damaged(trial, cache)
        trial.spawn("run", "scene.toml", "-o", "again", "--no-page", seconds=500.0, allowed=(0,), env=shared)
        whole(trial.folder / "again")
        shutil.rmtree(cache)
    _clean(trial.folder)


def _damaged(trial: Trial, cache: Path) -> None:
    """Half of the files of a cache cut, emptied or with bytes turned."""
    for path in sorted(one for one in cache.rglob("*") if one.is_file()):
        if trial.chance(0.5):
            data = bytearray(path.read_bytes())
            damage(trial, data)
            path.write_bytes(data)
