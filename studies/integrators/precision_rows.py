"""Measuring every engine on every problem, and comparing their times at equal error."""

import sys
from importlib.metadata import version
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from engine_peers import PEERS
from engine_problems import ALL, problem
from engines import OURS
from peer import Peer, interpolate_seconds, ratio_text

from patchfem.core import Missing, PatchfemError

EQUAL = (1e-2, 1e-3, 1e-4, 1e-6)  # errors at which CPU times are compared
FLOOR = 1e-13  # smaller errors are drawn and compared as this error


def run_once(work, one, knob) -> tuple:
    """Run an engine of this package once; return the slide and the CPU seconds.

    Parameters
    ----------
    work : callable
    one : Problem
    knob : int or float
        Steps per cycle or tolerance.
    """
    start = process_time()
    slide = work(one, knob)
    return slide, process_time() - start


def measure(names=ALL, ours=OURS, peers=PEERS, repeats: int = 3) -> tuple:
    """Measure the error of each engine and the smallest CPU seconds of several runs.

    Parameters
    ----------
    names : sequence of str
        Problems.
    ours, peers : dict
        Engines of this package and other programs.
    repeats : int
        Number of turns.

    Returns
    -------
    tuple
        Rows, versions of the peers, and absent peers with the reason.
    """
    children = {}
    versions = {"scipy": version("scipy")}
    absent = {}
    found = {}
    try:
        for name, (_, _, _, script, variable, remedy) in peers.items():
            try:
                children[name] = Peer(name, script, variable, sys.executable, remedy)
                versions[name] = children[name].version
            except Missing as missing:
                absent[name] = f"skipped: {name} is not installed ({variable}: {remedy})"
                print(missing, file=sys.stderr)
        tasks = [
            (p, name, knob, work, None)
            for name, (work, knobs, where) in ours.items()
            for p in names
            if p in where
            for knob in knobs
        ]
        tasks += [
            (p, name, knob, peers[name][0], child)
            for name, child in children.items()
            for p in names
            if p in peers[name][2]
            for knob in peers[name][1]
        ]
        for _ in range(repeats):
            for where, name, knob, work, child in tasks:
                _turn(found, where, name, knob, work, child)
    finally:
        for child in children.values():
            child.__exit__()
    return list(found.values()), versions, absent


def _turn(found: dict, where: str, name: str, knob, work, child) -> None:
    one = problem(where)
    try:
        slide, seconds = run_once(work, one, knob) if child is None else work(child, one, knob)
    except (PatchfemError, RuntimeError) as error:
        found[where, name, knob] = {
            "problem": where,
            "engine": name,
            "knob": knob,
            "error": None,
            "seconds": None,
            "failed": str(error),
        }
        return
    error = max(one.error(slide), FLOOR) if np.all(np.isfinite(slide)) else None
    row = found.setdefault(
        (where, name, knob),
        {"problem": where, "engine": name, "knob": knob, "error": error, "seconds": seconds},
    )
    row["seconds"] = min(row["seconds"], seconds) if row["seconds"] is not None else seconds


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
