"""A variant of the ladder fitted: its numbers, scores and cells, and where they are kept. The recipe is in `rungs`."""

import json
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from derived import Worn, by_row
from rungs import HELD, HERE, RUNGS, SEED, STUCK, TABLE

from patchfem.campaigns.rows.cells import cells_of, scores
from patchfem.campaigns.rows.computed import Computed
from patchfem.campaigns.rows.nulls import predicted
from patchfem.campaigns.rows.search import Search, residual_of, searched
from patchfem.core import G_N
from patchfem.identify.least_squares import NEAR
from patchfem.identify.space import space

MIL = 25.4e-6
SCORES = HERE / "scores.json"
ALIKE, TIED = 1.01, 1.05  # times the least training score: of the ends of one valley, and of valleys told beside it
APART = 0.01              # rms difference of the training logarithms of two ends from which they are two valleys
DRAWS, PERCENT = 4000, (5, 95)  # of the bootstrap over rows
NULLS = {"constant": "constant", "strong": "power_input_frequency"}


def training(cells, protocol: str) -> np.ndarray:
    """Which readings (n,) a protocol fits: "143", "all" or "without FREQUENCY"."""
    if protocol == "all":
        return np.ones(cells.row.size, bool)
    held = HELD if protocol == "143" else f"frequency={protocol.split()[1]} Hz"
    return ~cells.chosen(held)


def stuck_gain(cells, seen) -> float:
    """What an accelerometer shows of a block that does not slide, from the readings `seen` (n,) bool: the mean of
    acceleration over input at the lowest level of the frequency where that is least."""
    here = seen & cells.felt
    frequency, level = cells.conditions[cells.condition[here]].T
    ratio = cells.measured[here] / level
    return float(min(ratio[(frequency == one) & (level <= 1.001 * level[frequency == one].min())].mean()
                     for one in set(frequency)))


def cells_for(rung: str):
    """The readings of Table 1 as a rung is asked for them."""
    cells = cells_of(TABLE)
    return by_row(cells) if RUNGS[rung].worn else cells


def computed_for(rung: str, reading: str, cells, seen, placebo: str = "") -> Computed:
    """What computes the conditions of a rung under a reading, the gain of stuck readings taken from those `seen`."""
    more = [f"measured.acceleration_gain={stuck_gain(cells, seen)!r}"] if reading == STUCK else []
    one = RUNGS[rung]
    question = one.question(reading, *more, *([placebo] if placebo else []))
    return (Worn if one.worn else Computed)(question.asked(cells.conditions))


def fitted(rung: str, reading: str, protocol: str, placebo: str = "", starts: int = 0, most: int = 0) -> dict:
    """Fit a rung under a reading to the readings of a protocol, as a record of numbers that JSON keeps.

    starts, most: first and last number of random starts, 0 takes those of the recipe. Returns names and values of what
    is free and which bound each touches, the gain that was taken from the training readings or fitted to them, scores
    of the readings that were fitted and of the others, their bootstrap over rows, all cells (acceleration [g] with the
    reading, displacement [mil] at every condition), the valleys, the training rms at the end of every start, motions
    computed and CPU seconds.
    """
    begin, one, cells = time.process_time(), RUNGS[rung], cells_for(rung)
    seen = training(cells, protocol)
    computed = computed_for(rung, reading, cells, seen, placebo)
    found, valleys = best_of(cells, computed, seen, starts or one.starts, most or starts or one.most)
    computed.forget()
    answer = np.array(computed(found.fit.values, range(len(cells.conditions))))
    logs, values = cells.logs(*answer), found.fit.values
    return {"rung": rung, "reading": reading, "protocol": protocol, "placebo": placebo,
            "keys": [free.key for free in computed.asked.wanted], "values": rounded(values, 6),
            "at_bound": bounds(computed.asked.wanted, values), "gain": gain(computed, reading, values),
            "fitted": rounded(scores(cells, logs, seen)), "others": rounded(scores(cells, logs, ~seen)),
            "bootstrap": bootstrap(cells, logs, seen), "logs": rounded(logs),
            "cells": rounded(answer / np.array([[G_N], [MIL]])), "valleys": valleys, "starts": rounded(found.rms),
            "motions": computed.runs, "seconds": round(time.process_time() - begin, 1)}


def best_of(cells, computed, seen, starts: int, most: int) -> tuple:
    """(Found, valleys) of twice as many starts again and again, until two end in the best valley or `most` is reached.

    valleys: {"starts", "best": how many of them ended in the best valley, "tied": of every other valley within TIED of
    the best training score its training score and the scores of the readings that were not fitted}.
    """
    kept = {}
    while True:
        found = searched(cells, computed, seen, Search(starts, SEED, kept=lambda name, *row: kept.setdefault(
            name, *row) if row else kept.get(name)), "")
        best, others = valleys_of(cells, computed, seen, found)
        if best > 1 or 2 * starts > most:
            return found, {"starts": starts, "best": best, "tied": others}
        starts *= 2


def valleys_of(cells, computed, seen, found) -> tuple:
    """(number of ends in the best valley, the other valleys near it) of a Found."""
    residual = residual_of(cells, computed, seen, "bound")

    def at(values) -> np.ndarray:
        computed.forget()
        return residual(values)

    least, count, known = at(found.fit.values), 0, []
    for k in np.argsort(found.rms):
        if not found.rms[k] <= TIED * found.fit.rms:
            continue
        here = at(found.ends[k])
        if found.rms[k] <= ALIKE * found.fit.rms and rms(here - least) < APART:
            count += 1
        elif rms(here - least) >= APART and all(rms(here - other[0]) >= APART for other in known):
            logs = cells.logs(*computed(found.ends[k], range(len(cells.conditions))))
            known.append((here, [found.rms[k], *(scores(cells, logs, ~seen) or {}).values()]))
    return count, rounded([row for _, row in known])


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def bounds(wanted, values) -> list:
    """"low", "high" or "" of every value: whether it lies within a thousandth of its range from an end."""
    u = space([one.low for one in wanted], [one.high for one in wanted]).unit(np.asarray(values))
    return ["low" if x < NEAR else "high" if x > 1 - NEAR else "" for x in u]


def gain(computed, reading: str, values) -> float | None:
    """The factor of the accelerometer that came from training readings, by a fit or as that of a stuck block; None
    where it is none of them."""
    if computed.free_gain is not None:
        return rounded(float(values[computed.free_gain]), 6)
    return rounded(computed.gain, 6) if reading == STUCK else None


def bootstrap(cells, logs, seen, rows=None) -> dict:
    """5 and 95 % of the scores of the others (n,) bool when rows are drawn with replacement, the fit kept:
    {"fitted", "others": {kind: [low, high]}, "better": {null: {kind: share of draws in which the model scores the
    others better}}}; None where there is nothing to draw."""
    out = {"fitted": intervals(cells, logs, seen), "others": intervals(cells, logs, ~seen)}
    nulls = {name: predicted(cells, null, seen)[0] for name, null in NULLS.items()}
    return out | {"better": {name: better(cells, logs, null, ~seen) for name, null in nulls.items()}}


def drawn(cells, among) -> np.ndarray:
    """How often (DRAWS, n) each reading counts when the rows with readings among `among` (n,) bool are drawn anew."""
    rows = np.unique(cells.row[among])
    draws = np.random.default_rng(0).integers(0, rows.size, (DRAWS, rows.size))
    often = np.zeros((DRAWS, len(cells.rows)))
    np.add.at(often, (np.arange(DRAWS)[:, None], rows[draws]), 1)
    return often[:, cells.row] * among


def resampled(cells, logs, often, kind: str) -> np.ndarray:
    """Scores (DRAWS,) of a kind of reading in drawn rows; NaN where none was drawn."""
    weight = often * {"all": 1, "acceleration": cells.felt, "displacement": ~cells.felt}[kind]
    square = np.where(weight.sum(axis=0) > 0, np.square(np.asarray(logs, float)), 0.0)
    with np.errstate(invalid="ignore"):
        return np.sqrt(weight @ square / weight.sum(axis=1))


KIND = ("all", "acceleration", "displacement")


def intervals(cells, logs, among) -> dict | None:
    """{kind: [low, high]} of the scores among readings (n,) bool, as `bootstrap` has them."""
    if not among.any():
        return None
    often = drawn(cells, among)
    return {kind: rounded(list(np.nanpercentile(found, PERCENT))) if np.isfinite(found).any() else None
            for kind, found in ((kind, resampled(cells, logs, often, kind)) for kind in KIND)}


def better(cells, logs, null, among) -> dict | None:
    """{kind: share of draws in which logs (n,) score better than those of a null}, None where that predicts nothing."""
    if not among.any():
        return None
    often, out = drawn(cells, among), {}
    for kind in KIND:
        one, other = (resampled(cells, each, often, kind) for each in (logs, null))
        there = np.isfinite(one) & np.isfinite(other)
        out[kind] = rounded(float(np.mean(one[there] < other[there])), 3) if there.any() else None
    return out


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
