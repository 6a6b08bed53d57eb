"""The answer of `cost`: numerical error against CPU time, for several tolerances or values of a setting."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from ..campaigns import convergence
from ..campaigns.cost import (
    TOLERANCE_SETTING,
    Accuracy,
    Cost,
    Judgement,
    describe_best_setting,
    find_best_run,
    find_judged_measures,
    find_measures_with_error,
    rate_run,
)
from ..campaigns.numerical_settings import format_setting
from ..formatting import format_number
from ..model.model import Model
from ..runs.joint import find_source
from ..runs.refine import is_main
from ..runs.rig.engines import MAX_RELATIVE_STEP_ERROR, STEP_ERROR_RATIO
from . import quantities
from .answer import (
    Answer,
    JsonObject,
    Quantities,
    Quantity,
    Remarks,
    Variables,
    encode_texts,
    make_columns,
)
from .rows import make_details, make_variables
from .runs import make_origin

# Tolerances for which a convergence table names the coarsest sufficient setting, by the name of their column
SUFFICIENT_TOLERANCES = {"for_1_percent": 1e-2, "for_1_permille": 1e-3}
# Note on a motion from event to event without a mesh
TOLERANCE_CARRIES_ERROR_NOTE = (
    "No mesh and no number of steps carries the error of this motion, but the tolerance of its steps from event to event: "
    f"{STEP_ERROR_RATIO:g} times accuracy.tolerance, at most {MAX_RELATIVE_STEP_ERROR:g}. Expected is an order of about 1 "
    f"in accuracy.tolerance below {MAX_RELATIVE_STEP_ERROR / STEP_ERROR_RATIO:g}, and no change above it."
)
MINUTE = 60.0  # CPU seconds
MIN_GROWTH = (
    1.5  # smallest ratio of two CPU times from which their growth is known; timings scatter less
)
# Words for the judgement of the scene as it is.
SCENE_JUDGEMENT_WORDS = {
    Judgement.MEETS: "meets the tolerance",
    Judgement.MISSES: "misses the tolerance",
    Judgement.UNKNOWN: "does not have an error estimate of every measure",
}


class Row(NamedTuple):
    """A run whose cost and accuracy are compared with those of other runs, and its least accurate measure.

    - knob: what varies among these runs: TOLERANCE_SETTING, or the name of a numerical setting.
    - run: the run.
    - worst: accuracy of the least accurate measure of this run. Measures without an error estimate in any of these
      runs do not count.
    """

    knob: str
    run: Cost
    worst: Accuracy

    @property
    def judgement(self) -> Judgement:
        """Whether the errors are within the tolerance of the run."""
        return self.worst.judge(self.run.tolerance)


def make_cost_answer(
    curves: dict[str, list[Cost]], model: Model, notes: Sequence[str] = ()
) -> Answer:
    """Return the answer of the command `cost`: the CPU time and the accuracy of runs of a scene.

    Parameters
    ----------
    curves : dict of str to list of Cost
        The runs, from coarse to fine, by what varies: TOLERANCE_SETTING, or the name of a numerical setting.
    model : Model
        Model of the scene as it is, which no run changes.
    notes : sequence of str
        Sentences on what is computed.

    Returns
    -------
    Answer
        The verdict is on the run with the settings of the scene, or on the best run if a numerical setting varies.
    """
    tolerance = model.accuracy.tolerance
    knob, runs = next(iter(curves.items()))
    rows = []
    details = {}
    converged = []
    for one, curve in curves.items():
        names = find_judged_measures(curve)
        knob_rows = [Row(one, run, rate_run(run, names, run.tolerance)) for run in curve]
        rows += knob_rows
        # the runs of a curve of tolerances have no tolerance in common
        sentence = None if one == TOLERANCE_SETTING else describe_best_setting(curve, tolerance)
        details[one] = {"runs": [describe_run(row) for row in knob_rows], "sentence": sentence}
        # without a mesh and steps of equal length, the tolerance carries the error
        if one != TOLERANCE_SETTING or len(curves) == 1:
            converged += describe_convergence(
                curve, one, [run for part in curves.values() for run in part]
            )
    main = _find_main_measure(runs)

    # the scene as it is, or the run that the sentence names
    if knob == TOLERANCE_SETTING:
        chosen = next((run for run in runs if run.tolerance == tolerance), runs[-1])
    else:
        chosen = find_best_run(runs, tolerance)
    row = next(row for row in rows if row.run is chosen)
    sentences = _describe_scene(row, rows[: len(runs)]) if knob == TOLERANCE_SETTING else []
    # each tolerance has its own advice, but only the best value of a setting
    advice = _describe_advice(rows[: len(runs)] if knob == TOLERANCE_SETTING else [row])
    notes = [*notes, *advice]
    if model.patch is not None and model.patch.mesh.file is not None:
        notes.append("The mesh of the file is the same in all runs.")
    if converged and list(curves) == [TOLERANCE_SETTING]:
        notes.append(TOLERANCE_CARRIES_ERROR_NOTE)
    texts = [part["sentence"] for part in details.values() if part["sentence"]]
    sentences += [f"{text[0].upper()}{text[1:]}." for text in texts]
    return Answer(
        kind="cost",
        title=model.source.title,
        verdict=tuple(sentences[:4]),
        quantities=_make_quantities(row, main, tolerance),
        data=_make_data(rows, main) | _make_convergence_data(converged),
        remarks=Remarks(notes=tuple(notes)),
        details=details | ({"convergence": converged} if converged else {}),
        origin=make_origin(find_source(model), "cost"),
    )


def describe_run(row: Row) -> JsonObject:
    """Return a run as an object of cost.json, in SI units.

    It has the attributes of the `Cost`, `values`, `errors` and `floors` of its measures, `worst` {`measure`, `error`} and
    `meets_tolerance`.
    """
    parts = {}
    for part in ("value", "error", "floor"):
        numbers = {name: getattr(one, part) for name, one in row.run.measures.items()}
        parts[f"{part}s"] = {name: one for name, one in numbers.items() if one is not None}
    is_met = row.judgement is Judgement.MEETS
    worst = {"measure": row.worst.name, "error": row.worst.fraction}
    return make_details("cost_run", row, worst=worst, meets_tolerance=is_met, **parts)


def describe_convergence(
    runs: list[Cost], setting: str, every_run: Sequence[Cost] = ()
) -> list[JsonObject]:
    """Return a row for each key quantity with an error: its best value, observed order, and sufficient settings.

    Parameters
    ----------
    runs : list of Cost
        Runs with rising accuracy.
    setting : str
        Name of the setting that varies.
    every_run : sequence of Cost
        All runs of the scene, of which one may be more accurate than these.

    Returns
    -------
    list of dict
        `setting`, `measure`, CPU `seconds` of the runs with a fixed setting and their relative `changes` from the most
        accurate value, its `value`, `unit`, `error` and `text`, observed `order`, and for each of SUFFICIENT_TOLERANCES the
        coarsest sufficient setting with its CPU time, that expected from the stated errors of the two finest runs
        ("about"), or "none".
    """
    known = find_measures_with_error(runs)
    rows = []
    for name in quantities.KEY_QUANTITY_NAMES:
        if name not in known or not all(name in run.measures for run in runs):
            continue
        reference = convergence.find_reference(every_run or runs, name)
        found = convergence.measure_convergence(runs, setting, name, reference)
        if max(found.changes) < convergence.ROUND_OFF:
            continue  # the setting has no effect on this measure
        best = Quantity(found.reference.value, found.reference.unit, found.reference.error)
        row = {"setting": setting, "measure": name} | best.as_json()
        row |= {"text": quantities.format_quantity(name, best)}
        seconds = [run.seconds for run in runs if run.value is not None]
        row |= {"order": found.order, "changes": found.changes, "seconds": seconds}
        for column, tolerance in SUFFICIENT_TOLERANCES.items():
            row[column] = "none"
            if run := convergence.find_sufficient_run(runs, name, found, tolerance):
                row[column] = f"{run.label}, {format_number(run.seconds, 2)} CPU s"
            elif run := convergence.extrapolate_sufficient_run(runs, setting, name, tolerance):
                label = format_setting(setting, float(f"{run.value:.2g}"))
                row[column] = f"about {label}, {format_number(run.seconds, 1)} CPU s"
        rows.append(row)
    return rows


def _describe_scene(row: Row, rows: list[Row]) -> list[str]:
    """Return sentences on the scene as it is and on the smallest tolerance that is met."""
    run = row.run
    error = ""
    if row.worst.name:
        name = row.worst.name.replace("_", " ")
        error = (
            f", with a largest relative error of {format_number(row.worst.fraction, 2)} in {name}"
        )
    sentences = [
        f"At its tolerance {run.tolerance:g} the scene takes {format_number(run.seconds, 2)} CPU s and "
        f"{SCENE_JUDGEMENT_WORDS[row.judgement]}{error}."
    ]

    # Runs without error estimates are neither met nor missed.
    met = [one.run for one in rows if one.judgement is Judgement.MEETS]
    if met:
        best = min(met, key=lambda one: one.tolerance)
        seconds = format_number(best.seconds, 2)
        sentences.append(
            f"Of the tolerances of this table, the smallest that is met is {best.label}, in {seconds} CPU s."
        )
    elif any(one.judgement is Judgement.UNKNOWN for one in rows):
        sentences.append("No run is known to meet its tolerance.")
    else:
        sentences.append("No run meets its tolerance.")
    sentences += _describe_minute(met)
    return sentences


def _describe_minute(runs: list[Cost]) -> list[str]:
    """Return the sentence that names the tolerance at which a run takes a minute; [] where the runs show no growth.

    `runs` are those that meet their tolerance, from coarse to fine. CPU time is taken as a power of the tolerance.
    """
    if not runs:
        return []
    last = runs[-1]
    if last.seconds >= MINUTE:
        return [f"Tolerance {last.label} takes more than a minute."]
    earlier = [run for run in runs if run.seconds < last.seconds / MIN_GROWTH]
    if not earlier:
        return []
    power = math.log(last.seconds / earlier[-1].seconds) / math.log(
        earlier[-1].tolerance / last.tolerance
    )
    tolerance = last.tolerance * (MINUTE / last.seconds) ** (-1 / power)
    # Smallest tolerance that a sentence names, near round-off
    if tolerance < 1e-12:
        return []
    return [
        f"If CPU time goes on growing as from tolerance {earlier[-1].label} to {last.label}, a run takes a minute at a "
        f"tolerance of {format_number(tolerance, 1)}."
    ]


def _describe_advice(rows: list[Row]) -> list[str]:
    """Return a sentence for each piece of advice in the runs, which names all runs that have it."""
    runs: dict[tuple[str, str], list[Cost]] = {}
    for row in rows:
        # with several advices it is not known which of them belongs to the measure
        miss = ""
        if len(row.run.remedies) == 1 and row.judgement is Judgement.MISSES:
            miss = f", {row.worst.name.replace('_', ' ')} misses the tolerance"
        for advice in row.run.remedies:
            runs.setdefault((miss, advice), []).append(row.run)

    sentences = []
    for (miss, advice), (first, *others) in runs.items():
        names = ", ".join([first.words, *(run.label for run in others)])
        sentences.append(f"With {names}{miss}: {advice}.")
    return sentences


def _find_main_measure(runs: list[Cost]) -> str:
    """Return the name of the measure that the charts and the verdict show.

    It is the least accurate main measure in the first and coarsest run.
    """
    names = find_judged_measures(runs)
    return rate_run(runs[0], names, runs[0].tolerance).name or names[0]


def _make_quantities(row: Row, main: str, tolerance: float) -> Quantities:
    """Return CPU time and error of a run, the tolerance of the scene, and the main measure.

    `row` is the run with its judgement, `main` the name of the main measure, and `tolerance` the relative one of the
    scene.
    """
    run = row.run
    out = {
        "cpu_time": Quantity(run.seconds, "s"),
        "elapsed_time": Quantity(run.wall_seconds, "s"),
        "largest_error": Quantity(row.worst.fraction),
        "tolerance": Quantity(tolerance),
    }
    if main in run.measures:
        one = run.measures[main]
        out[main] = Quantity(one.value, one.unit, one.error, floor=one.floor)
    return out


def _make_data(rows: list[Row], main: str) -> Variables:
    """Return the columns of cost.csv, one element for each run; the charts and the table of the page show them too.

    `rows` are runs with their judgements, and `main` is the name of the main measure.
    """
    runs = [row.run for row in rows]
    columns = {"knob": [row.knob for row in rows], "setting": [run.label for run in runs]}
    for name in ("seconds", "wall_seconds", "timings"):
        columns[name] = [getattr(run, name) for run in runs]
    data = make_variables("cost", **columns)

    measures = {}
    units = {name: one.unit for run in runs for name, one in run.measures.items()}
    for name, unit in units.items():
        for heading, part in ((name, "value"), (f"error_{name}", "error")):
            numbers = [getattr(run.measures.get(name), part, None) for run in runs]
            measures[heading] = (numbers, unit)

    data |= make_columns("run", measures)

    # an exact run has no place on a logarithmic axis
    judged = {
        "largest_error": [row.worst.fraction or None for row in rows],
        "tolerance": [run.tolerance for run in runs],
        "worst_measure": [row.worst.name.replace("_", " ") for row in rows],
    }
    for name in ("nodes", "steps"):
        counts = [getattr(run, name) for run in runs]
        if any(counts):
            judged[name] = counts
    data |= make_variables("cost", **judged)
    data |= {"main_measure": data[main], "main_measure_error": data[f"error_{main}"]}

    # a colour for each varied setting and for runs that miss the tolerance
    texts = [row.judgement for row in rows]
    if rows[0].knob != rows[-1].knob:
        words = [text.removesuffix(" its tolerance") for text in texts]
        knobs = [row.knob.replace("_", " ") for row in rows]
        texts = [f"{knob}: {word}" for knob, word in zip(knobs, words, strict=True)]
    data["result"] = encode_texts("run", texts)
    return data


def _make_convergence_data(converged: list[JsonObject]) -> Variables:
    """Return the points of the chart of convergence, from the rows of `describe_convergence`; none without rows.

    The chart has the main measures, or all if there are none.
    """
    rows = [row for row in converged if is_main(row["measure"])] or converged
    has_several = len({row["setting"] for row in rows}) > 1
    points = {"point_seconds": [], "point_change": []}
    texts = []
    for row in rows:
        text = row["measure"] + f" over {row['setting']}" * has_several
        for seconds, change in zip(row["seconds"], row["changes"], strict=True):
            if change > 0:
                points["point_seconds"].append(seconds)
                points["point_change"].append(change)
                texts.append(text.replace("_", " "))
    if not texts:
        return {}
    return make_variables("cost", **points) | {"point_measure": encode_texts("point", texts)}
