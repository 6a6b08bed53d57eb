"""Measuring every engine on every problem, and comparing their times at equal error."""

import sys
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from engine_problems import ALL, Problem, problem
from engines import OURS

from patchfem.core import PatchfemError

EQUAL = (1e-2, 1e-3, 1e-4, 1e-6)  # errors at which CPU times are compared
FLOOR = 1e-13  # smaller errors are drawn and compared as this error


def measure(names=ALL, ours=OURS, repeats: int = 3) -> list[dict]:
    """Measure the error of each engine and the smallest CPU seconds of several turns.

    Parameters
    ----------
    names : sequence of str
        Problems.
    ours : dict
        Engines, as `OURS`.
    repeats : int
        Number of turns.

    Returns
    -------
    list of dict
        A row for each problem, engine and setting.
    """
    tasks = [
        (where, name, knob, work)
        for name, (work, knobs, problems) in ours.items()
        for where in names
        if where in problems
        for knob in knobs
    ]
    rows = {}
    for _ in range(repeats):
        for where, name, knob, work in tasks:
            measure_once(rows, problem(where), name, knob, work)
    return list(rows.values())


def measure_once(rows: dict, one: Problem, name: str, knob: float, work) -> None:
    """Run an engine once; add its row, or keep the smaller CPU seconds.

    Parameters
    ----------
    rows : dict
        Rows by problem, engine and setting, which are changed.
    one : Problem
    name : str
        Engine.
    knob : float
        Steps per cycle or tolerance.
    work : callable
        work(one, knob) returns the slide.
    """
    key = one.name, name, knob
    row = {"problem": one.name, "engine": name, "knob": knob, "error": None, "seconds": None}
    start = process_time()
    try:
        slide = work(one, knob)
    except (PatchfemError, RuntimeError) as error:
        rows[key] = row | {"failed": str(error)}
        return
    row["seconds"] = process_time() - start
    if np.all(np.isfinite(slide)):
        row["error"] = max(one.error(slide), FLOOR)
    first = rows.setdefault(key, row)
    first["seconds"] = min(first["seconds"], row["seconds"])


def curve(rows: list, where: str, name: str) -> tuple:
    """Return the errors and the seconds of an engine on a problem, in the order of its setting.

    Parameters
    ----------
    rows : list of dict
    where : str
        Problem.
    name : str
        Engine.
    """
    mine = [
        r for r in rows if r["problem"] == where and r["engine"] == name and r["error"] is not None
    ]
    return np.array([r["error"] for r in mine]), np.array([r["seconds"] for r in mine])


def front(errors, seconds) -> tuple:
    """Return the points that are not dominated in error and seconds, with falling errors."""
    keep = [
        i for i in range(len(errors)) if not np.any((errors < errors[i]) & (seconds <= seconds[i]))
    ]
    keep.sort(key=lambda i: -errors[i])
    return errors[keep], seconds[keep]


def ratios(rows: list, where: str, reference: str) -> dict:
    """Return the times of all engines relative to `reference` at equal error.

    The result is {engine: {error: text}}, with "-" if an engine does not reach the error.
    """
    base = front(*curve(rows, where, reference))
    out = {}
    if not len(base[0]):
        return out
    for name in dict.fromkeys(r["engine"] for r in rows if r["problem"] == where):
        errors, seconds = front(*curve(rows, where, name))
        if name == reference or not len(errors):
            continue
        out[name] = {}
        for error in EQUAL:
            mine, sign = (
                interpolate_seconds(error, *base) if len(base[0]) > 1 else (float(base[1][0]), "")
            )
            if error < errors.min() or (len(base[0]) > 1 and error < base[0].min()):
                out[name][error] = "-"
                continue
            theirs, other = interpolate_seconds(error, errors, seconds)
            out[name][error] = ("< " if other == "<" else "") + ratio_text(
                theirs, mine, sign if other != "<" else ""
            )
    return out


def interpolate_seconds(error: float, errors, seconds) -> tuple:
    """Interpolate the seconds at which a curve of falling errors reaches `error`, log-log.

    Parameters
    ----------
    error : float
    errors, seconds : sequence of float
        Points of the curve.

    Returns
    -------
    tuple
        Seconds and a sign: "" inside the curve, "<" if its coarsest point is already better (fewer seconds suffice),
        ">" if its finest point is worse.
    """
    order = np.argsort(errors)
    e = np.asarray(errors, float)[order]
    t = np.asarray(seconds, float)[order]
    sign = ""
    if error > e[-1]:
        sign = "<"
    elif error < e[0]:
        sign = ">"
    return float(np.exp(np.interp(np.log(error), np.log(e), np.log(t)))), sign


def ratio_text(theirs: float, ours: float, sign: str) -> str:
    """Format the ratio of two times, or a bound of it if one of them is a bound.

    Parameters
    ----------
    theirs, ours : float
        [s]
    sign : {"", "<", ">"}
        From `interpolate_seconds`.
    """
    return {"<": "> ", ">": "< ", "": ""}[sign] + f"{theirs / ours:.2g}"
