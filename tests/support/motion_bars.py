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
from time import process_time

import numpy as np
from motion_read import measures, works
from motion_reference import Motion, TooLong
from motion_scenes import spec, written
from motion_steady import periodic

from patchfem.core import Missing, NotConverged, PatchfemError
from patchfem.model.model import build
from patchfem.response.errors import change
from patchfem.response.rows import TABLE, of_first
from patchfem.runs.rig.engines import PIECES
from patchfem.runs.rig.numerics import choose
from patchfem.runs.run import run
from patchfem.scene.scene import SceneError, load

FINER = 16  # times the steps of the run that stands for the truth
LONGEST = 1500  # seconds of a scene, on a machine that others use
MOST_STEPS = 12000  # of DOP853, some six seconds
SURE = 5.0  # times the change at the last halving of the steps, what the finer run may be off
ROUGH, FINE = (0.04, 1e-10), (0.025, 1e-12)  # longest step over the shortest period and relative error of a step
SHARPEST = ("exact", "piecewise", "smooth")  # engines whose bars ask for both
LEFT_OUT = ("energy_balance", "work_check", "normal_load", "energy_created", "jump_level", "level_hysteresis",
            "relative_displacement_amplitude_steady")
SHARP = 1e-8  # of the value: a bar that is narrower is as sharp as anybody can use


def referable(s: dict) -> bool:
    """Whether the independent program has the equations of a spec."""
    if s["law"] == "order" or "load_amplitude" in s or (s["patch"] or {}).get("shear"):
        return False
    return not ((s["law"] == "convolution" and s["patch"]) or (s["several"] and s["law"] == "iwan"))


def truth_of(s: dict, path, result) -> tuple:
    """(truth by name, what it is itself uncertain by, its kind) of a scene and its Result."""
    model = build(load(path))
    if referable(s):
        try:
            return _steady(s, model, cycles_kept(model, result)) if s.get("method") == "harmonic" else \
                _moved(s, model, result.extra["window"])
        except TooLong:
            pass
    return _finer(s, path, model, result.extra)


def _moved(s: dict, model, window: int) -> tuple:
    """Truth by the independent program; what a second, more careful run of it changes is what it does not know.

    window: cycles over which the measures are told.
    """
    numerics, period, runs = choose(model), model.rig.drive.period, []
    for share, rtol in (ROUGH, FINE) if numerics.engine in SHARPEST else (ROUGH,):
        motion = Motion(s, share)
        stretches = motion.run(numerics.cycles * period, rtol, most=MOST_STEPS)
        runs.append(measures(motion, stretches, period, numerics.cycles, window))
    return runs[-1], doubts(*runs), "reference"


def cycles_kept(model, result) -> int:
    """Cycles that a steady motion keeps, over which its works are told."""
    time = result.response.time
    return round(float(time[-1] - time[0]) / model.rig.drive.period)


def _steady(s: dict, model, kept: int) -> tuple:
    """Truth of a steady motion by the independent program: its periodic state, or a run that has settled.

    kept: cycles over which the works are told.
    """
    period, motion = model.rig.drive.period, Motion(s)
    start = periodic(motion, period)
    if start is not None:
        stretches = motion.run(kept * period, 1e-11, start)
        return measures(motion, stretches, period, kept, 1) | works(motion, stretches, 0.0, kept * period), {}, \
            "reference"
    motion = Motion(s)
    each = 25 * max(1.0, motion.plant.fastest / s["frequency"])
    cycles, runs = next((k for k in (320, 160, 80) if k * each < MOST_STEPS), 40), []
    stretches = motion.run(cycles * period, 1e-10, most=MOST_STEPS)
    for count in (cycles // 4, cycles // 2, cycles - 3, cycles - 2, cycles - 1, cycles):
        end = count * period
        runs.append(measures(motion, stretches, period, count, 1) | works(motion, stretches, end - kept * period, end))
    last = runs[-1]
    open_ = [unsettled(*runs[:2], last), *(change(last, one) for one in runs[2:-1])]  # what swings from cycle to cycle
    return last, doubts(last) | {name: max(one.get(name, 0.0) for one in open_) for name in last}, "reference"


def unsettled(quarter: dict, half: dict, whole: dict) -> dict:
    """What is left of a decay after a run, by name, from its values after a quarter, half and all of it: with r the
    decay over a quarter, two changes are as r (1 + r), and r^2/(1 - r^2) of the last one is left."""
    out, early = change(whole, half), change(half, quarter)
    for name, last in out.items():
        rate = min((np.sqrt(1 + 4 * last / max(early.get(name, last), 1e-300)) - 1) / 2, 0.99)
        out[name] = last * max(1.0, 2 * rate**2 / (1 - rate**2))
    return out


def _finer(s: dict, path, model, extra: dict) -> tuple:
    """Truth by the program itself: elements from yield to yield where it marched, else many more steps."""
    sets = [f"accuracy.tolerance={model.accuracy.tolerance / 10:g}"]
    if extra.get("map") == "yields":  # its density in more cells
        return _values(load(path, sets)), {}, "cells"
    if s.get("method") == "harmonic":
        found = run(load(path, [*sets, "accuracy.harmonics=129"])).measures
        known = {name: m for name, m in found.items() if m.value is not None}
        return {k: m.value for k, m in known.items()}, {k: m.error or 0.0 for k, m in known.items()}, "harmonics"
    if extra["engine"] == "march" and not PIECES.lacks(model):
        return _values(load(path, [*sets, "accuracy.method=exact"])), {}, "pieces"
    steps = extra.get("steps_per_cycle") or 400
    runs = [_values(load(path, [*sets, "accuracy.method=march", f"accuracy.steps_per_cycle={share * steps}"]))
            for share in (FINER // 2, FINER)]
    doubt = {name: SURE * gap for name, gap in change(*runs[::-1]).items()}
    return runs[-1], doubt, "finer"


def doubts(rough: dict, fine: dict | None = None) -> dict:
    """What the independent program leaves open itself: a drift is a difference of means of the motion.

    rough, fine: measures of one run, or of a second one that is more careful.
    """
    out = {} if fine is None else change(fine, rough)
    least = 1e-9 if fine is None else 1e-14
    return out | {"drift_per_cycle": out.get("drift_per_cycle", 0.0)
                  + least * rough["relative_displacement_amplitude"]}


def _values(scene) -> dict:
    found = run(scene, estimate=False).measures
    return {name: m.value for name, m in found.items() if m.value is not None}


def compared(seed: int, folder: Path) -> dict:
    """What a random scene found: law, drive, engine, kind of truth, rows [name, value, error, floor, truth, doubt]."""
    s = spec(seed)
    path = written(s, folder)
    out = {"seed": seed, "law": s["law"], "drive": s["drive"], "rows": []}
    begin = process_time()
    try:
        result = run(load(path))
    except (PatchfemError, SceneError, Missing, NotConverged) as error:
        return out | {"refused": str(error)}
    out |= {"engine": result.extra["engine"], "outcome": str(result.outcome),
            "steps": result.extra.get("steps_per_cycle"), "seconds": process_time() - begin}
    if str(result.outcome) in ("grows", "not_converged"):
        return out
    begin = process_time()
    truth, doubt, out["truth"] = truth_of(s, path, result)
    out["truth_seconds"] = process_time() - begin
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
