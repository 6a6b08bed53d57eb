"""A variant of the ladder fitted: its numbers, scores and cells, and where they are kept. The recipe is in `rungs`."""

import json
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from rungs import HELD, HERE, RUNGS, SEED, TABLE

from patchfem.campaigns.rows.cells import cells_of, scores
from patchfem.campaigns.rows.computed import Computed
from patchfem.campaigns.rows.search import Search, searched
from patchfem.core import G_N

MIL = 25.4e-6
SCORES = HERE / "scores.json"


def training(cells, protocol: str) -> np.ndarray:
    """Which readings (n,) a protocol fits: "143", with or without more starts, "all" or "without FREQUENCY"."""
    if protocol == "all":
        return np.ones(cells.row.size, bool)
    held = HELD if protocol.startswith("143") else f"frequency={protocol.split()[1]} Hz"
    return ~cells.chosen(held)


def fitted(rung: str, reading: str, protocol: str, placebo: str = "", starts: int = 0) -> dict:
    """Fit a rung under a reading to the readings of a protocol, as a record of numbers that JSON keeps.

    starts: random ones, 0 takes those of the recipe, or of a protocol "143, 12 starts". Returns names and values of
    what is free, scores of the readings that were fitted and of the others, all cells (acceleration [g] with the
    reading, displacement [mil] at every condition), the training rms at the end of every start, motions computed and
    CPU seconds.
    """
    begin, cells, one = time.process_time(), cells_of(TABLE), RUNGS[rung]
    if protocol.endswith(" starts"):
        starts = int(protocol.split()[1])
    question = one.question(reading, *([placebo] if placebo else []))
    computed, seen = Computed(question.asked(cells.conditions)), training(cells, protocol)
    found = searched(cells, computed, seen, Search(starts or one.starts, SEED), "")
    computed.forget()
    answer = np.array(computed(found.fit.values, range(len(cells.conditions))))
    logs = cells.logs(*answer)
    return {"rung": rung, "reading": reading, "protocol": protocol, "placebo": placebo,
            "keys": [free.key for free in question.wanted], "values": rounded(found.fit.values, 6),
            "at_bound": list(found.fit.at_bound), "fitted": rounded(scores(cells, logs, seen)),
            "others": rounded(scores(cells, logs, ~seen)), "logs": rounded(logs),
            "cells": rounded(answer / np.array([[G_N], [MIL]])), "starts": rounded(found.rms),
            "motions": computed.runs, "seconds": round(time.process_time() - begin, 1)}


def rounded(given, digits: int = 4):
    """The numbers of a tree to so many significant digits; what is not finite is None."""
    if given is None or isinstance(given, str):
        return given
    if isinstance(given, dict):
        return {name: rounded(one, digits) for name, one in given.items()}
    if isinstance(given, (list, tuple, np.ndarray)):
        return [rounded(one, digits) for one in given]
    return float(f"{given:.{digits}g}") if np.isfinite(given) else None


def known() -> dict:
    """What was computed: (rung, reading, protocol, placebo) -> record."""
    rows = json.loads(SCORES.read_text("utf-8")) if SCORES.exists() else []
    return {(row["rung"], row["reading"], row["protocol"], row["placebo"]): row for row in rows}


def keep(rows: dict) -> None:
    """Write the records, one a line."""
    lines = ",\n".join(json.dumps(row) for row in rows.values())
    partial = SCORES.with_suffix(".partial")
    partial.write_text(f"[\n{lines}\n]\n", "utf-8")
    partial.replace(SCORES)
