"""How `patchfem compare` does on areal pairs of known truth (`known_scans`): verdicts, errors, intervals, cost.

    python tests/support/scans_score.py --seeds 1000-1059 [--points 1000x1000] [--table FILE.json]

Every pair is written as two X3P files and compared by the command line in this process. A verdict is "right"; "missed"
where a true change is not shown, two scans of one place are called not comparable, or a fault of the files is not
named; "false" where something is said that is not so; "refused" where the command ends with an error. An interval holds
the truth of a volume also where every point counts as a whole pixel. Seeds below 1000 serve to build the method. With
--points, start a process for each size. Memory is the peak above what the process held before the command.
"""

import argparse
import contextlib
import io
import json
import tempfile
import time
from pathlib import Path

import numpy as np
from known_scans import make
from surfaces import x3p_of

from patchfem.__main__ import main

PLACED = ("shift_x", "shift_y", "rotation")
COVERED = ("worn_volume", "grown_volume", "worn_share", "worn_depth_mean", "worn_depth_max", *PLACED)
ORDER = ("wrong order", "exchanged")


def written(path: Path, scan: tuple) -> Path:
    """A scan (x, y, z) as an X3P file."""
    x, y, z = scan
    path.write_bytes(x3p_of(z, steps=(x[1], y[1])))
    return path


def peak(reset: bool = False) -> float:
    """Largest memory [MB] of this process since it was reset; NaN where the system does not tell."""
    try:
        if reset:
            Path("/proc/self/clear_refs").write_text("5")
        return next(float(line.split()[1]) / 1024 for line in Path("/proc/self/status").read_text().splitlines()
                    if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        return np.nan


def answered(before: tuple, after: tuple) -> dict:
    """What compare says as JSON of two scans, or its `error`; with seconds `cpu` and `clock`, and `memory` [MB]."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with tempfile.TemporaryDirectory() as folder:
        files = [written(Path(folder) / name, scan) for name, scan in (("before.x3p", before), ("after.x3p", after))]
        start, clock, least = time.process_time(), time.perf_counter(), peak(reset=True)
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                main(["compare", *map(str, files), "--json", "-o", str(Path(folder) / "out")])
            except SystemExit as end:
                code = end.code or 0
            except Exception as fault:  # a crash is a result of the examination
                code, _ = 70, err.write(f"{type(fault).__name__}: {fault}")
        cost = {"cpu": time.process_time() - start, "clock": time.perf_counter() - clock, "memory": peak() - least}
    if code:
        lines = err.getvalue().strip().splitlines()
        return cost | {"error": lines[-1] if lines else f"exit code {code}"}
    return cost | json.loads(out.getvalue())


def quantity(said: dict, name: str) -> tuple:
    """(value, low, high) of a quantity of the answer or of its registration, None where there is none."""
    one = said.get(name)
    if one is None:
        one = (said.get("registration") or {}).get(name)
    if not isinstance(one, dict):
        return one, one, one
    return one.get("value"), one.get("low"), one.get("high")


def shown(said: dict, name: str) -> bool:
    """Whether a volume is shown to be above zero."""
    value, low, _ = quantity(said, name)
    return value is not None and low is not None and low > 0


def verdict(kind: str, truth: dict, said: dict) -> tuple:
    """("right", "missed", "false" or "refused", the reasons) of an answer."""
    if "error" in said:
        return "refused", [said["error"]]
    headline = said.get("verdict", "").lower()
    text = " ".join((headline, *said.get("sentences", []))).lower()
    registration = said.get("registration") or {}
    lies_on = quantity(said, "shift_x")[0] is not None and not headline.startswith("not comparable")
    if not truth["comparable"]:
        return ("false", ["registered two places that are apart"]) if lies_on else ("right", [])
    worn, grown = truth["worn_volume"] > 0 and not truth["hidden"], truth["grown_volume"] > 0
    false = [f"{word} shown where there is none" for word, is_true, name in
             (("wear", worn, "worn_volume"), ("growth", grown, "grown_volume")) if shown(said, name) and not is_true]
    false += [f"called {word}" for word in ("mirrored", "turned")
              if bool(registration.get(word)) and not truth[word]]
    exchanged = any(word in text for word in ORDER)
    if exchanged and kind not in ("exchanged", "deposits"):
        false.append("called exchanged")
    missed = [] if lies_on else ["called not comparable"]
    missed += [f"no {word} shown" for word, is_true, name in
               (("wear", worn, "worn_volume"), ("growth", grown, "grown_volume")) if is_true and not shown(said, name)]
    missed += [f"not called {word}" for word in ("mirrored", "turned")
               if truth[word] and not bool(registration.get(word))]
    if kind == "exchanged" and not exchanged:
        missed.append("not called exchanged")
    if truth["hidden"]:
        missed += [] if "hidden_wear" in said else ["hidden wear is not told"]
        high = quantity(said, "hidden_wear")[2]
        if high is not None and high < truth["worn_depth_mean"]:
            false.append(f"hidden wear limited to {high:.3g} m where {truth['worn_depth_mean']:.3g} m is true")
    return ("false", false + missed) if false else ("missed", missed) if missed else ("right", [])


def errors(truth: dict, said: dict) -> dict:
    """Of each quantity: its error, whether that is relative to the truth, whether the interval holds the truth.

    The place, and a volume that is truly zero, have absolute errors.
    """
    found = {}
    for name in COVERED if truth["comparable"] and "error" not in said and not truth["hidden"] else ():
        value, low, high = quantity(said, name)
        if value is None or (truth["mirrored"] and name in PLACED):
            continue
        true = [truth[name]]
        if name in ("worn_volume", "grown_volume"):
            true.append(truth["by_pixels"][name == "grown_volume"])
        low, high = -np.inf if low is None else low, np.inf if high is None else high
        relative = name not in PLACED and true[0] > 0
        found[name] = {"error": float(value / true[0] - 1 if relative else value - true[0]), "relative": relative,
                       "inside": bool(low <= max(true) and high >= min(true))}
    return found


def examined(seed: int, points: tuple | None = None) -> dict:
    """The row of a seed."""
    kind, before, after, truth = make(seed, points)
    said = answered(before, after)
    word, reasons = verdict(kind, truth, said)
    return {"seed": seed, "kind": kind, "style": truth["style"], "points": before[2].shape, "verdict": word,
            "reasons": reasons, "said": said.get("verdict", ""), "errors": errors(truth, said),
            "depth": None if truth["worn_depth_max"] is None else truth["worn_depth_max"] / truth["rms"],
            "noise": truth["noise"] / truth["rms"], "pixel": float(before[0][1]), "missing": [
                float(np.isnan(scan[2]).mean()) for scan in (before, after)],
            **{name: said[name] for name in ("cpu", "clock", "memory")}}


def line(row: dict) -> str:
    """A row of the table."""
    cells = [f"{row['seed']:>5} {row['kind']:<12} {row['style']:<8} {row['verdict']:<7}"]
    for name in COVERED:
        one, scale = row["errors"].get(name), {"rotation": 1e3}.get(name, 1 / row["pixel"])
        if one is None:
            cells.append(f"{'-':>9} ")
            continue
        scale = scale if name in PLACED else 100 if one["relative"] else 1e18 if "volume" in name else 1e6
        cells.append(f"{one['error'] * scale:>9.{3 if name in PLACED else 1}f}{' ' if one['inside'] else '!'}")
    return " ".join((*cells, f"{row['cpu']:>6.1f} {row['memory']:>6.0f}", "; ".join(row["reasons"]))).rstrip()


HEAD = (f"{'seed':>5} {'kind':<12} {'style':<8} {'verdict':<7} {'worn %':>9}  {'grown %':>9}  {'share %':>9}  "
        f"{'mean %':>9}  {'largest %':>9}  {'dx pixel':>9}  {'dy pixel':>9}  {'turn mrad':>9}  "
        f"{'CPU s':>6} {'MB':>6}   (! outside its interval; where zero is true um3 and um)")


def summary(rows: list) -> list:
    """Verdicts by kind, size of the errors and share of intervals that hold, as lines."""
    out = [f"{word}: {sum(row['verdict'] == word for row in rows)} of {len(rows)}"
           for word in ("right", "missed", "false", "refused")]
    for kind in sorted({row["kind"] for row in rows}):
        words = [row["verdict"] for row in rows if row["kind"] == kind]
        out.append(f"  {kind:<12} " + ", ".join(f"{words.count(word)} {word}" for word in sorted(set(words))))
    for name in COVERED:
        for relative in (True, False):
            found = [one for row in rows if (one := row["errors"].get(name)) and one["relative"] == relative]
            if found:
                size = np.abs([one["error"] for one in found])
                out.append(f"{name:<16} {'relative' if relative else 'absolute':<8} median {np.median(size):.3g}, 90 % "
                           f"below {np.quantile(size, 0.9):.3g}; {sum(one['inside'] for one in found)} of {len(found)} "
                           "intervals hold the truth")
    cpu, memory = ([row[name] for row in rows] for name in ("cpu", "memory"))
    return [*out, f"CPU s: median {np.median(cpu):.1f}, most {max(cpu):.1f}; memory at most {max(memory):.0f} MB"]


def scored(seeds, points: tuple | None = None) -> list:
    """The rows of many seeds, printed as they come."""
    print(HEAD)
    rows = []
    for seed in seeds:
        rows.append(examined(seed, points))
        print(line(rows[-1]), flush=True)
    print("\n".join(summary(rows)))
    return rows


if __name__ == "__main__":
    wanted = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    wanted.add_argument("--seeds", default="1000-1059")
    wanted.add_argument("--points")
    wanted.add_argument("--table", type=Path)
    asked = wanted.parse_args()
    first, _, last = asked.seeds.partition("-")
    answers = scored(range(int(first), int(last or first) + 1),
                     tuple(map(int, asked.points.split("x"))) if asked.points else None)
    if asked.table:
        asked.table.write_text(json.dumps(answers))
