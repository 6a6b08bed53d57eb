"""Bars of the measures of random rigs against what is true: an independent program, or the same one much finer.

`python tests/support/motion_bars.py FIRST COUNT FILE` writes a line for each scene to FILE; `--read FILE` prints the
coverage and the sharpness of the bars in it.
"""

import json
import signal
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np
from motion_read import measures
from motion_reference import Motion
from motion_scenes import spec, written

from patchfem.core import Missing, NotConverged, PatchfemError
from patchfem.model.model import build
from patchfem.response.rows import TABLE, of_first
from patchfem.runs.rig.numerics import choose
from patchfem.runs.run import run
from patchfem.scene.scene import SceneError, load

FINER = 16  # times the steps of the run that stands for the truth
LONGEST = 240  # seconds of a scene
MOST_STEPS = 8000  # of DOP853, some three seconds
LEFT_OUT = ("energy_balance", "work_check", "normal_load", "energy_created", "jump_level", "level_hysteresis",
            "relative_displacement_amplitude_steady")
SHARP = 1e-8  # of the value: a bar that is narrower is as sharp as anybody can use


def referable(s: dict, end: float) -> bool:
    """Whether the independent program has the equations of a spec, and the time for a run to end [s]."""
    if s["law"] in ("order", "report") or "load_amplitude" in s or (s["patch"] or {}).get("shear"):
        return False
    if (s["law"] == "convolution" and s["patch"]) or (s["several"] and s["law"] == "iwan"):
        return False
    return end / Motion(s).step() < MOST_STEPS


def truth_of(s: dict, path, result) -> tuple:
    """(truth by name, what it is itself uncertain by, its kind) of a scene and its Result."""
    model, extra = build(load(path)), result.extra
    numerics, rig = choose(model), model.rig
    end = numerics.cycles * rig.drive.period
    if referable(s, end) and s.get("method") != "harmonic":
        motion = Motion(s)
        stretches = motion.run(end, 1e-10)
        found = measures(motion, stretches, rig.drive.period, numerics.cycles, numerics.window)
        return found, doubts(found), "reference"
    sets = [f"accuracy.tolerance={model.accuracy.tolerance / 10:g}"]
    if s.get("method") == "harmonic":
        return _values(load(path, [*sets, "accuracy.harmonics=129"])), {}, "harmonics"
    steps = extra.get("steps_per_cycle") or 400
    runs = [_values(load(path, [*sets, "accuracy.method=march", f"accuracy.steps_per_cycle={share * steps}"]))
            for share in ((FINER,) if "steps_per_cycle" in extra else (FINER // 2, FINER))]
    doubt = {name: abs(value - runs[0][name]) for name, value in runs[-1].items() if name in runs[0]}
    return runs[-1], doubt, "finer"


def doubts(found: dict) -> dict:
    """What the independent program leaves open itself: a drift is a difference of means of the motion."""
    return {"drift_per_cycle": 1e-9 * found["relative_displacement_amplitude"]}


def _values(scene) -> dict:
    found = run(scene, estimate=False).measures
    return {name: m.value for name, m in found.items() if m.value is not None}


def compared(seed: int, folder: Path) -> dict:
    """What a random scene found: law, drive, engine, kind of truth, rows [name, value, error, floor, truth, doubt]."""
    s = spec(seed)
    path = written(s, folder)
    out = {"seed": seed, "law": s["law"], "drive": s["drive"], "rows": []}
    try:
        result = run(load(path))
    except (PatchfemError, SceneError, Missing, NotConverged) as error:
        return out | {"refused": str(error)}
    out |= {"engine": result.extra["engine"], "outcome": str(result.outcome),
            "steps": result.extra.get("steps_per_cycle")}
    if str(result.outcome) in ("grows", "not_converged"):
        return out
    truth, doubt, out["truth"] = truth_of(s, path, result)
    for name, m in result.measures.items():
        if m.value is None or m.error is None or name not in truth or of_first(name) not in TABLE or name in LEFT_OUT:
            continue
        out["rows"].append([name, m.value, m.error, m.floor, truth[name], doubt.get(name, 0.0)])
    return out


def apart(name: str, value: float, truth: float) -> float:
    """True error of a measure; a phase is compared modulo pi."""
    gap = abs(truth - value)
    return min(gap, abs(np.pi - gap)) if name == "slip_start_phase" else gap


def held(row) -> bool:
    """Whether a bar holds the truth; what the truth itself does not know does not count."""
    name, value, error, floor, truth, doubt = row
    return apart(name, value, truth) <= error + doubt + max(1e-3 * floor, 1e-9 * abs(value))


def sharp(row) -> bool | None:
    """Whether a bar is within five times the true error, or narrower than anybody can use; None where the truth does
    not say."""
    name, value, error, floor, truth, doubt = row
    if error <= max(floor, SHARP * abs(value)):
        return True
    true = apart(name, value, truth)
    return None if true <= 2 * doubt else error <= 5 * true


def score(lines) -> dict:
    """Coverage by measure, share of scenes with every bar right, share of bars within five times the true error."""
    by, scenes, misses = defaultdict(list), [], []
    for one in lines:
        rows = one["rows"]
        if not rows:
            continue
        scenes.append(all(map(held, rows)))
        for row in rows:
            first = row[0].rpartition("_")[0] if row[0][-1].isdigit() else row[0]
            by[first].append((held(row), sharp(row)))
            if not held(row):
                misses.append((one["seed"], one["law"], one["drive"], one["engine"], one["truth"], *row))
    bars = [pair for pairs in by.values() for pair in pairs]
    return {"scenes": len(scenes), "right": float(np.mean(scenes)), "bars": len(bars),
            "coverage": float(np.mean([ok for ok, _ in bars])),
            "sharp": float(np.mean([near for _, near in bars if near is not None])),
            "by": {name: (len(pairs), float(np.mean([ok for ok, _ in pairs])),
                          float(np.mean([near for _, near in pairs if near is not None] or [np.nan])))
                   for name, pairs in sorted(by.items())}, "misses": misses}


def _late(*_) -> None:
    raise TimeoutError


def main(arguments) -> None:
    signal.signal(signal.SIGALRM, _late)
    if arguments[0] == "--read":
        lines = [json.loads(line) for name in arguments[1:] for line in Path(name).read_text("utf-8").splitlines()]
        found = score(lines)
        for miss in found.pop("misses"):
            print("missed", *miss)
        for name, (count, cover, near) in found.pop("by").items():
            print(f"{name:34s} {count:5d} bars, {100 * cover:5.1f} % hold, {100 * near:5.1f} % within five times")
        print(found, "refused:", [one["seed"] for one in lines if "refused" in one])
        return
    first, count, name = int(arguments[0]), int(arguments[1]), arguments[2]
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            signal.alarm(LONGEST)
            try:
                line = compared(seed, Path(folder))
            except (TimeoutError, RuntimeError, AssertionError, ValueError) as error:
                line = {"seed": seed, "rows": [], "refused": f"failed {error!r}"}
            signal.alarm(0)
            with open(name, "a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
