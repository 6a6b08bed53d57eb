"""Bars of the measures of random rigs against what is true: an independent program, or the same one much finer.

    python tests/support/motion_bars.py run FILE [--first SEED --count N] [--every K] [--method NAME] [--truth OTHER]
    python tests/support/motion_bars.py score FILE...

`run` adds a line for each scene to FILE: the seeds from SEED on, or the held-out rigs of `motion_scenes.held_out`, of
which --every K takes each K-th, and --method NAME those that name a method, such as harmonic. A scene that FILE has is
not run again. --truth takes the truth from an earlier FILE, of the same or another state of the package, where the run
is as long and its window the same. `score` prints coverage and sharpness of the bars, of all and by engine. Only the
public names of the package are used.
"""

import argparse
import json
import signal
import tempfile
from collections import defaultdict
from pathlib import Path
from time import process_time

import numpy as np
from motion_read import measures, works
from motion_reference import Motion, TooLong
from motion_scenes import held_out, spec, written
from motion_steady import periodic

import patchfem as pf

FINER = 16  # times the steps of the run that stands for the truth
LONGEST = 60  # CPU seconds of a scene
MOST_STEPS = 12000  # of DOP853, some six seconds
SURE = 5.0  # times the change at the last halving of the steps, what the finer run may be off
ROUGH, FINE = (0.04, 1e-10), (0.025, 1e-12)  # longest step over the shortest period and relative error of a step
LEFT_OUT = ("energy_balance", "work_check", "normal_load", "energy_created", "jump_level", "level_hysteresis",
            "relative_displacement_amplitude_steady",
            # of the pressed patch, at rest
            "contact_fraction", "contact_half_width", "pressure_peak", "pressure_centre", "approach", "rotation",
            "moment", "normal_stiffness", "tangential_stiffness")
SHARP = 1e-8  # of the value: a bar that is narrower is as sharp as anybody can use


def referable(s: dict) -> bool:
    """Whether the independent program has the equations of a spec."""
    if s["law"] == "order" or "load_amplitude" in s or (s["patch"] or {}).get("shear"):
        return False
    return not ((s["law"] == "convolution" and s["patch"]) or (s["several"] and s["law"] == "iwan"))


def truth_of(s: dict, path, run: dict) -> tuple:
    """(truth by name, what it is itself uncertain by, its kind) of a scene and its run, as `ran` has it."""
    if referable(s):
        try:
            return _steady(s, run["period"], run["kept"]) if s.get("method") == "harmonic" else _moved(s, run)
        except TooLong:
            pass
    return _finer(s, path, run)


def _moved(s: dict, run: dict) -> tuple:
    """Truth by the independent program; what a second, more careful run of it changes is what it does not know."""
    cycles, period, runs = run["cycles"], run["period"], []
    for share, rtol in (ROUGH,) if run["engine"] == "march" else (ROUGH, FINE):
        motion = Motion(s, share)
        stretches = motion.run(cycles * period, rtol, most=MOST_STEPS)
        runs.append(measures(motion, stretches, period, cycles, run["window"]))
    return runs[-1], doubts(*runs), "reference"


def _steady(s: dict, period: float, kept: int) -> tuple:
    """Truth of a steady motion by the independent program: its periodic state, or a run that has settled.

    period [s]; kept: cycles over which the works are told.
    """
    motion = Motion(s)
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


def _finer(s: dict, path, run: dict) -> tuple:
    """Truth by the program itself: elements from yield to yield where it marched, else many more steps."""
    tight = {"accuracy.tolerance": f"{s['tolerance'] / 10:g}"}
    if run["map"] == "yields":  # its density in more cells
        return _values(path, tight), {}, "cells"
    if s.get("method") == "harmonic":
        found = pf.run(path, **tight, **{"accuracy.harmonics": "129"}).measures
        known = {name: found[name] for name in found if found[name].value is not None}
        return {k: m.value for k, m in known.items()}, {k: m.error or 0.0 for k, m in known.items()}, "harmonics"
    if run["engine"] == "march":
        try:
            return _values(path, tight | {"accuracy.method": "exact"}), {}, "pieces"
        except pf.PatchfemError:  # no exact engine has its equations
            pass
    steps = run["steps"] or 400
    runs = [_values(path, tight | {"accuracy.method": "march", "accuracy.steps_per_cycle": f"{share * steps}"})
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


def _values(path, sets: dict) -> dict:
    found = pf.run(path, **sets).measures
    return {name: found[name].value for name in found if found[name].value is not None}


def change(fine: dict, coarse: dict) -> dict:
    """Size of the difference by name of the measures that both runs have."""
    return {name: apart(name, fine[name], coarse[name]) for name in fine.keys() & coarse.keys()}


def ran(s: dict, path: Path) -> dict:
    """The run of a scene by the program: outcome, engine, steps, cycles, window and measures [value, error, floor]."""
    begin = process_time()
    try:
        result = pf.run(path)
    except pf.PatchfemError as error:
        return {"refused": str(error)}
    seconds, rig = process_time() - begin, pf.build(path).rig
    summary = json.loads((result.save(path.with_suffix("")) / "summary.json").read_text("utf-8"))
    chosen, time = summary["numerics"], result.to_xarray().time
    found = {name: result.measures[name] for name in result.measures}
    return {"outcome": summary["outcome"], "engine": chosen["engine"], "map": chosen.get("map"),
            "steps": chosen.get("steps_per_cycle"), "seconds": seconds, "period": rig.drive.period,
            "cycles": rig.cycles, "window": chosen["window_cycles"],
            "kept": round(float(time[-1] - time[0]) / rig.drive.period),  # cycles that a steady motion keeps
            "measures": {name: [m.value, m.error, m.floor] for name, m in found.items()
                         if m.value is not None and m.error is not None}}


def compared(s: dict, folder: Path, earlier: dict | None = None) -> dict:
    """What a random scene found: law, drive, engine, kind of truth, rows [name, value, error, floor, truth, doubt].

    earlier: what the same scene found in another run, whose truth is taken where it is of the same cycles.
    """
    path = written(s, folder)
    run = ran(s, path)
    measured = run.pop("measures", {})
    out = {"seed": s["seed"], "law": s["law"], "drive": s["drive"], "rows": []} | run
    if "refused" in out or out["outcome"] in ("grows", "not_converged"):
        return out
    begin, same = process_time(), ("cycles", "window", "kept")
    if earlier and "true" in earlier and all(earlier[key] == out[key] for key in same):
        truth, doubt, out["truth"] = (earlier[key] for key in ("true", "doubt", "truth"))
    else:
        truth, doubt, out["truth"] = truth_of(s, path, out)
    out |= {"true": truth, "doubt": doubt, "truth_seconds": process_time() - begin}
    out["rows"] = [[name, *three, truth[name], doubt.get(name, 0.0)] for name, three in measured.items()
                   if name in truth and of_first(name) not in LEFT_OUT]
    return out


def of_first(name: str) -> str:
    """Name of a measure without the number of its interface."""
    head, _, number = name.rpartition("_")
    return head if number.isdigit() else name


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
            by[of_first(row[0])].append((held(row), sharp(row)))
            if not held(row):
                misses.append((one["seed"], one["law"], one["drive"], one["engine"], one["truth"], *row))
    bars = [pair for pairs in by.values() for pair in pairs]
    return {"scenes": len(scenes), "right": _share(scenes), "bars": len(bars),
            "coverage": _share([ok for ok, _ in bars]), "sharp": _share([near for _, near in bars]),
            "by": {name: (len(pairs), _share([ok for ok, _ in pairs]), _share([near for _, near in pairs]))
                   for name, pairs in sorted(by.items())}, "misses": misses}


def _share(values: list) -> float:
    """Share of those that are true, of all but None."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else float("nan")


def printed(lines: list) -> None:
    """Print the score of lines: what missed, by measure, by engine."""
    found = score(lines)
    for miss in found["misses"]:
        print("missed", *miss)
    for name, (count, cover, near) in found["by"].items():
        print(f"{name:34s} {count:5d} bars, {100 * cover:5.1f} % hold, {100 * near:5.1f} % within five times")
    for engine in [*sorted({one["engine"] for one in lines if one["rows"]}), "all"]:
        one = score([line for line in lines if engine in ("all", line.get("engine"))])
        print(f"{engine:10s} {one['scenes']:4d} scenes, all bars right in {100 * one['right']:5.1f} %; {one['bars']} "
              f"bars, {100 * one['coverage']:5.1f} % hold, {100 * one['sharp']:5.1f} % within five times")
    none = [one for one in lines if not one["rows"]]
    print("nothing compared:", *((one["seed"], one.get("refused", one.get("outcome"))) for one in none))


def _late(*_) -> None:
    raise TimeoutError


def _lines(names) -> list:
    return [json.loads(line) for name in names for line in Path(name).read_text("utf-8").splitlines()]


def campaign(specs: list, name: str, earlier: dict, compared=compared) -> None:
    """Compare the scenes that the file of this name has not, a line for each; earlier: lines of a truth by seed;
    compared(spec, folder, earlier line or None) -> line."""
    signal.signal(signal.SIGPROF, _late)
    done = {one["seed"] for one in _lines([name])} if Path(name).exists() else set()
    for s in specs:
        if s["seed"] in done:
            continue
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
        try:
            with tempfile.TemporaryDirectory() as folder:
                line = compared(s, Path(folder), earlier.get(s["seed"]))
        except (TimeoutError, RuntimeError, AssertionError, ValueError) as error:
            line = {"seed": s["seed"], "rows": [], "refused": f"failed {error!r}"}
        signal.setitimer(signal.ITIMER_PROF, 0)
        with open(name, "a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    runs, reads = verbs.add_parser("run"), verbs.add_parser("score")
    runs.add_argument("file")
    runs.add_argument("--first", type=int)
    runs.add_argument("--count", type=int, default=300)
    runs.add_argument("--every", type=int, default=1)
    runs.add_argument("--method")
    runs.add_argument("--truth")
    reads.add_argument("files", nargs="+")
    asked = parser.parse_args()
    if asked.verb == "score":
        printed(_lines(asked.files))
        return
    specs = held_out(asked.count) if asked.first is None else \
        [spec(seed) for seed in range(asked.first, asked.first + asked.count)]
    earlier = {one["seed"]: one for one in _lines([asked.truth])} if asked.truth else {}
    campaign([s for s in specs[::asked.every] if asked.method in (None, s.get("method"))], asked.file, earlier)


if __name__ == "__main__":
    main()
