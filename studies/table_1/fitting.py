"""A variant of the ladder fitted: its numbers, scores and cells, and where they are kept. The recipe is in `rungs`."""

import json
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from derived import Worn, by_row
from null_models import fit_null_model
from rungs import (
    CONTAINED_READINGS,
    CONTAINS,
    FOLDER,
    PREDICTED_ROWS,
    ROOT2,
    RUNGS,
    SCREEN,
    SEED,
    STUCK_READING,
    TABLE,
)

from patchfem.campaigns.held_out import select_held_out
from patchfem.campaigns.rows.cells import compute_rms_scores, read_response_table
from patchfem.campaigns.rows.model_readings import ModelReadings
from patchfem.core import G_N
from patchfem.identify.descent import Descent, UnitCubeResidual, descend, make_search_space

MIL = 25.4e-6
SCORES = FOLDER / "scores.json"
SAME_VALLEY_FACTOR = (
    1.01  # fits to one optimum have at most this multiple of the smallest training score
)
TIED_FACTOR = (
    # optima below this multiple of the smallest training score are in the record beside the best
    1.05
)
# rms difference of the training logarithms above which two fits are different optima
VALLEY_DISTANCE = 0.01
# Largest distance from a bound at which a parameter counts as on the bound, relative to its range
NEAR_BOUND_FRACTION = 1e-3
DRAWS = 4000  # number of bootstrap draws of rows
PERCENT = (5, 95)  # percentiles of the bootstrap intervals
# start values of parameters that a smaller model does not have
NEUTRAL = {
    "worn.factor": 1.0,
    "rods.share": 0.05,
    "rods.mass": 0.01,
}
NULLS = {"constant": "constant", "strong": "power_input_frequency"}


def make_residual(cells, computed: ModelReadings, seen):
    """Return the function that computes the log ratios (r,) of the readings of a mask from values (n,).

    A reading flagged U has no residual where the computed value is larger.

    Parameters
    ----------
    cells : Readings
        Measured readings (n,).
    computed : ModelReadings
        Readings of the model.
    seen : (n,) array of bool
        Readings that are fitted.
    """
    conditions = sorted(set(cells.condition[seen].tolist()))

    def residual(values) -> np.ndarray:
        logs = cells.compute_logs(cells.select_computed(*computed(values, conditions)))
        return np.where(cells.unstable, np.minimum(logs, 0.0), logs)[seen]

    return residual


def run_descents(model: UnitCubeResidual, points, before_descent) -> list[Descent]:
    """Return the descents from points (n,) of the unit cube; `before_descent` is called before each."""
    ends = []
    for point in points:
        before_descent()
        ends.append(descend(model, point))
    return ends


def training(cells, protocol: str) -> np.ndarray:
    """Return a mask (n,) of the readings that a protocol fits: "143", "all" or "without FREQUENCY"."""
    if protocol == "all":
        return np.ones(cells.row.size, bool)
    held = PREDICTED_ROWS if protocol == "143" else f"frequency={protocol.split()[1]} Hz"
    return ~select_held_out(held, cells.path, cells.columns)


def stuck_gain(cells, seen) -> float:
    """Return the reading of an accelerometer over the input for a block that sticks, from the readings `seen`.

    It is the mean at the lowest level of the frequency where it is smallest.
    """
    here = seen & cells.is_acceleration
    frequency, level = cells.conditions[cells.condition[here]].T
    ratio = cells.measured[here] / level
    return float(
        min(
            ratio[(frequency == one) & (level <= 1.001 * level[frequency == one].min())].mean()
            for one in set(frequency)
        )
    )


def cells_for(rung: str):
    """Return the readings of Table 1 for a model."""
    cells = read_response_table(TABLE)
    return by_row(cells) if RUNGS[rung].worn else cells


def computed_for(rung: str, reading: str, cells, seen, placebo: str = "") -> ModelReadings:
    """Return the function that computes the conditions of a rung under a reading.

    Parameters
    ----------
    rung, reading : str
    cells : Cells
    seen : (n,) array of bool
        Readings from which the gain of a stuck block is taken.
    placebo : str
    """
    sets = []
    if reading == STUCK_READING:
        sets.append(f"measured.acceleration_gain={stuck_gain(cells, seen)!r}")
    if placebo:
        sets.append(placebo)
    one = RUNGS[rung]
    question = one.question(reading, *sets)
    return (Worn if one.worn else ModelReadings)(question.make_condition_models(cells.conditions))


def fit_rung(
    rung: str, reading: str, protocol: str, placebo: str = "", starts: int = 0, most: int = 0
) -> dict:
    """Fit a model with an interpretation to the readings of a protocol; return a record of numbers that JSON can store.

    starts, most: first and last number of random starts, 0 takes those of the recipe. Returns names and values of what
    is free and which bound each touches, the gain that was taken from the training readings or fitted to them, scores
    of the readings that were fitted and of the others, their bootstrap over rows, all cells (acceleration [g] with the
    reading, displacement [mil] at every condition), the valleys, the training rms at the end of every start, motions
    computed and CPU seconds.
    """
    begin = time.process_time()
    one = RUNGS[rung]
    cells = cells_for(rung)
    seen = training(cells, protocol)
    computed = computed_for(rung, reading, cells, seen, placebo)
    begins = []
    if not placebo:
        wanted = computed.models.ranges
        begins = _contained_starts(rung, reading, protocol, wanted, read_records())
    first = starts or (one.starts if protocol in ("143", "without 143") else (one.starts + 1) // 2)
    values, ends, valleys = search_starts(
        cells, computed, seen, first, most or starts or one.most, begins
    )
    computed.reset_motions()
    answer = np.array(computed(values, range(len(cells.conditions))))
    logs = cells.compute_logs(cells.select_computed(*answer))
    return {
        "rung": rung,
        "reading": reading,
        "protocol": protocol,
        "placebo": placebo,
        "keys": [free.key for free in computed.models.ranges],
        "values": round_digits(values, 6),
        "at_bound": bounds(computed.models.ranges, values),
        "gain": gain(computed, reading, values),
        "fitted": round_digits(compute_rms_scores(cells, logs, seen)),
        "others": round_digits(compute_rms_scores(cells, logs, ~seen)),
        "bootstrap": _bootstrap(cells, logs, seen),
        "logs": round_digits(logs),
        "cells": round_digits(answer / np.array([[G_N], [MIL]])),
        "valleys": valleys,
        "starts": round_digits(ends),
        "motions": computed.n_motions,
        "seconds": round(time.process_time() - begin, 1),
    }


def _contained_starts(rung: str, reading: str, protocol: str, wanted, rows: dict) -> list:
    """Return values (n,) to start from, taken from the records `rows` of known fits.

    These are the records of the rungs and readings that are this one with some numbers fixed, fitted to the same rows,
    and of this one fitted to 143 Hz if that is a part of these rows.
    """
    places = [(other, reading, protocol) for other in CONTAINS.get(rung, ())]
    places += [(rung, other, protocol) for other in CONTAINED_READINGS.get(reading, ())]
    places += [(rung, reading, "143")] * (protocol not in ("143", "without 143"))
    out = []
    for other, under, fitted_to in places:
        row = rows.get((other, under, fitted_to, ""))
        if row is not None:
            kept = {
                one.partition("=")[0]: float(one.partition("=")[2].split()[0])
                for one in RUNGS[other].sets
            }
            gain = {"peak": 1.0, ROOT2: 2**0.5}.get(under) or row["gain"]
            given = (
                NEUTRAL
                | kept
                | {"measured.acceleration_gain": gain}
                | dict(zip(row["keys"], row["values"]))
            )
            out.append([given.get(one.key, 0.0) for one in wanted])
    return out


def search_starts(cells, computed, seen, starts: int, most: int, begins=()) -> tuple:
    """Minimise from many starts until two end in the best minimum; return values, training rms and minima.

    The starts are `begins`, random ones, twice as many each time, and the best end with each number that may be 0 at 0.

    Parameters
    ----------
    cells : Cells
    computed : ModelReadings
    seen : (n,) array of bool
        Training readings.
    starts, most : int
        First and largest number of random starts.
    begins : (b, n) array

    Returns
    -------
    tuple
        Values (n,), training rms at the end of every start, and a dict: starts, number of ends in the best valley, and
        the valleys tied with it.
    """
    wanted = computed.models.ranges
    residual = make_residual(cells, computed, seen)
    box = make_search_space([one.low for one in wanted], [one.high for one in wanted])
    quick = UnitCubeResidual(residual, box, is_expensive=True)
    rng = np.random.default_rng(SEED)
    random = 0
    ends = run_descents(
        quick, [box.to_unit_cube(one) for one in begins], before_descent=computed.reset_motions
    )
    while True:
        points = rng.random((starts - random, SCREEN, len(wanted)))
        ends += run_descents(
            quick,
            [_screen_points(quick, some, computed.reset_motions) for some in points],
            before_descent=computed.reset_motions,
        )
        top = min(ends, key=lambda one: one.cost).u
        zeros = [
            np.where(np.arange(top.size) == k, 0.0, top)
            for k, one in enumerate(wanted)
            if one.low == 0 and top[k] > NEAR_BOUND_FRACTION
        ]
        ends += run_descents(quick, zeros, before_descent=computed.reset_motions)
        last = run_descents(
            UnitCubeResidual(residual, box),
            [min(ends, key=lambda one: one.cost).u],
            before_descent=computed.reset_motions,
        )[0]
        best, others = group_valleys(
            cells, computed, seen, last, [(box.to_values(one.u), end_rms(one)) for one in ends]
        )
        random = starts
        if best > 1 or 2 * starts > most:
            valleys = {"starts": len(ends), "best": best, "tied": others}
            return box.to_values(last.u), [end_rms(one) for one in ends], valleys
        starts *= 2


def _screen_points(quick, points, forget) -> np.ndarray:
    """Return the point (n,) of the unit cube with the least sum of squares among some points, each computed from rest."""
    costs = []
    for u in points:
        forget()
        found = quick(u)
        costs.append(np.inf if found is None else float(found @ found))
    return points[int(np.argmin(costs))]


def end_rms(end: Descent) -> float:
    """Return the rms of the residual at the end of a descent; NaN if the model failed at its start."""
    return float(np.sqrt(end.cost / end.rows)) if np.isfinite(end.cost) else np.nan


def group_valleys(cells, computed, seen, last, ends) -> tuple:
    """Return the number of searches that end in the best minimum, and the other minima close to it.

    Parameters
    ----------
    cells : Cells
    computed : ModelReadings
    seen : (n,) array of bool
    last : Descent
        Descent to the bottom of the best valley.
    ends : list
        (values, rms) at the ends of the starts.
    """
    wanted = computed.models.ranges
    residual = make_residual(cells, computed, seen)
    box = make_search_space([one.low for one in wanted], [one.high for one in wanted])

    def at(values) -> np.ndarray:
        computed.reset_motions()
        return residual(values)

    least = at(box.to_values(last.u))
    least_rms = end_rms(last)
    count = 0
    valleys = []
    for values, score in sorted(ends, key=lambda one: (not one[1] < np.inf, one[1])):
        if not score <= TIED_FACTOR * least_rms:
            continue
        here = at(values)
        if score <= SAME_VALLEY_FACTOR * least_rms and rms(here - least) < VALLEY_DISTANCE:
            count += 1
        elif rms(here - least) >= VALLEY_DISTANCE and all(
            rms(here - other) >= VALLEY_DISTANCE for other, _ in valleys
        ):
            logs = cells.compute_logs(
                cells.select_computed(*computed(values, range(len(cells.conditions))))
            )
            valleys.append(
                (here, [score, *(compute_rms_scores(cells, logs, ~seen) or {}).values()])
            )
    return count, round_digits([row for _, row in valleys])


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def bounds(wanted, values) -> list:
    """Return "low", "high" or "" for every value: whether it lies within a thousandth of its range from an end."""
    u = make_search_space([one.low for one in wanted], [one.high for one in wanted]).to_unit_cube(
        np.asarray(values)
    )
    return [
        "low" if x < NEAR_BOUND_FRACTION else "high" if x > 1 - NEAR_BOUND_FRACTION else ""
        for x in u
    ]


def gain(computed, reading: str, values) -> float | None:
    """Return the factor of the accelerometer from training readings; None if there is none.

    Parameters
    ----------
    computed : ModelReadings
    reading : str
    values : (n,) array
    """
    if computed.free_gains[0] is not None:
        return round_digits(float(values[computed.free_gains[0]]), 6)
    return round_digits(computed.gains[0], 6) if reading == STUCK_READING else None


def _bootstrap(cells, logs, seen) -> dict:
    """Return the 5 and 95 % quantiles of the scores if rows are resampled and the fit is kept.

    The result is {"fitted", "others": {kind: [low, high]}, "better": {null: {kind: fraction of
    samples in which the model scores better}}}; None if nothing can be resampled.
    """
    out = {"fitted": intervals(cells, logs, seen), "others": intervals(cells, logs, ~seen)}
    nulls = {name: fit_null_model(cells, null, seen)[0] for name, null in NULLS.items()}
    return out | {
        "better": {name: better(cells, logs, null, ~seen) for name, null in nulls.items()}
    }


def draw_rows(cells, among) -> np.ndarray:
    """Return how often (DRAWS, n) each reading counts if the rows with readings among `among` (n,) bool are resampled."""
    rows = np.unique(cells.row[among])
    draws = np.random.default_rng(0).integers(0, rows.size, (DRAWS, rows.size))
    often = np.zeros((DRAWS, len(cells.rows)))
    np.add.at(often, (np.arange(DRAWS)[:, None], rows[draws]), 1)
    return often[:, cells.row] * among


def _resample_scores(cells, logs, often, kind: str) -> np.ndarray:
    """Return the scores (DRAWS,) of a kind of reading in resampled rows; NaN if none was drawn."""
    weight = (
        often
        * {"all": 1, "acceleration": cells.is_acceleration, "displacement": ~cells.is_acceleration}[
            kind
        ]
    )
    square = np.where(weight.sum(axis=0) > 0, np.square(np.asarray(logs, float)), 0.0)
    with np.errstate(invalid="ignore"):
        return np.sqrt(weight @ square / weight.sum(axis=1))


KIND = ("all", "acceleration", "displacement")


def intervals(cells, logs, among) -> dict | None:
    """Return {kind: [low, high]} of the scores of readings (n,) bool, as in `_bootstrap`."""
    if not among.any():
        return None
    often = draw_rows(cells, among)
    out = dict.fromkeys(KIND)
    for kind in KIND:
        found = _resample_scores(cells, logs, often, kind)
        if np.isfinite(found).any():
            out[kind] = round_digits(list(np.nanpercentile(found, PERCENT)))
    return out


def better(cells, logs, null, among) -> dict | None:
    """Return how often a model scores better than a null model in resampled rows.

    The result is {kind: fraction of samples}; None if the null model predicts nothing.
    """
    if not among.any():
        return None
    often = draw_rows(cells, among)
    out = {}
    for kind in KIND:
        one, other = (_resample_scores(cells, each, often, kind) for each in (logs, null))
        there = np.isfinite(one) & np.isfinite(other)
        out[kind] = (
            round_digits(float(np.mean(one[there] < other[there])), 3) if there.any() else None
        )
    return out


def round_digits(given, digits: int = 4):
    """Round all numbers of nested containers to a number of significant digits; values that are not finite become None."""
    if given is None or isinstance(given, str):
        return given
    if isinstance(given, dict):
        return {name: round_digits(one, digits) for name, one in given.items()}
    if isinstance(given, (list, tuple, np.ndarray)):
        return [round_digits(one, digits) for one in given]
    return float(f"{given:.{digits}g}") if np.isfinite(given) else None


def read_records() -> dict:
    """Read all records: {(model, interpretation, protocol, placebo): record}."""
    rows = json.loads(SCORES.read_text("utf-8")) if SCORES.exists() else []
    return {(row["rung"], row["reading"], row["protocol"], row["placebo"]): row for row in rows}


def keep(rows: dict) -> None:
    """Write the records, one per line."""
    lines = ",\n".join(json.dumps(row) for row in rows.values())
    partial = SCORES.with_suffix(".partial")
    partial.write_text(f"[\n{lines}\n]\n", "utf-8")
    partial.replace(SCORES)
