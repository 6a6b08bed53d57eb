"""The answer of `cost`: numerical error against CPU time, for several tolerances or values of a setting."""

import math

import numpy as np

from ..campaigns.cost import (
    TOLERANCE,
    Cost,
    WorstError,
    describe_fastest_setting,
    find_fastest_run,
    find_fastest_settings,
    find_measures_with_error,
    find_worst_error,
    find_worst_run_error,
)
from ..formatting import format_number
from ..model.model import Model
from . import quantities
from .answer import Answer, Quantity, Remarks, Variable
from .runs import make_origin

KNOB_TEXTS = {"jumps": "jumps over the cycles of wear"}
RUN_KEYS = (
    "label",
    "value",
    "tolerance",
    "seconds",
    "wall_seconds",
    "timings",
    "values",
    "errors",
    "distances",
)


def make_answer(curves: dict[str, list[Cost]], model: Model, command: str = "") -> Answer:
    """Return the answer of `cost`.

    Parameters
    ----------
    curves : dict
        TOLERANCE or numerical setting -> its runs from coarse to fine.
    model : Model
    command : str
        Command line that repeats it; by default that without options.
    """
    tolerance = model.accuracy.tolerance
    origin = make_origin(model.source, "cost")
    knob, runs = next(iter(curves.items()))
    return Answer(
        kind="cost",
        title=model.source.title,
        verdict=_make_verdict(curves, tolerance),
        quantities=_make_quantities(knob, runs, tolerance),
        data=_collect_table(curves) | _collect_points(curves, tolerance),
        remarks=Remarks(notes=tuple(dict.fromkeys(text for run in runs for text in run.remedies))),
        details={knob: describe_runs(knob, runs, tolerance) for knob, runs in curves.items()},
        origin=origin | {"driven": "", "command": command or origin["command"]},
    )


def describe_runs(knob: str, runs: list[Cost], tolerance: float) -> dict:
    """Return the runs of a curve as an entry of cost.json, in SI units.

    `runs`: label, value of the setting, tolerance, CPU seconds, elapsed seconds, and values, errors
    and distances to the best run by measure, with `worst` {`measure`, `error`} and `meets_tolerance`. `cheapest`: by
    measure the label of the fastest run within the tolerance. `sentence`: the cost of all measures. The last two are None
    for TOLERANCE, because its runs have different tolerances.

    Parameters
    ----------
    knob : str
        TOLERANCE or a numerical setting.
    runs : list of Cost
    tolerance : float
        That of the scene.
    """
    entries = []
    for run in runs:
        worst = find_worst_run_error(run)
        entry = {name: getattr(run, name) for name in RUN_KEYS}
        entry["worst"] = {"measure": worst.name, "error": worst.fraction}
        entry["meets_tolerance"] = run.meets_tolerance()
        entry["remedies"] = list(run.remedies)
        entries.append(entry)
    is_setting = knob != TOLERANCE
    return {
        "runs": entries,
        "cheapest": find_fastest_settings(runs, tolerance) if is_setting else None,
        "sentence": describe_fastest_setting(runs, tolerance) if is_setting else None,
    }


def _find_scene_run(knob: str, runs: list[Cost], tolerance: float) -> Cost:
    """Return the run of the scene as it is, or, of a setting, the fastest run that meets the tolerance (else the last)."""
    if knob != TOLERANCE:
        return find_fastest_run(runs, tolerance) or runs[-1]
    return next((run for run in runs if run.tolerance == tolerance), runs[-1])


def _make_verdict(curves: dict[str, list[Cost]], tolerance: float) -> tuple[str, ...]:
    """Return a sentence on the scene as it is, and one on each setting."""
    sentences = []
    for knob, runs in curves.items():
        if knob != TOLERANCE:
            text = describe_fastest_setting(runs, tolerance)
            sentences.append(f"{text[0].upper()}{text[1:]}.")
            continue
        run = _find_scene_run(knob, runs, tolerance)
        worst = find_worst_run_error(run)
        meets = "meets" if run.meets_tolerance() else "misses"
        name = worst.name.replace("_", " ")
        error = f", with a largest error of {format_number(worst.fraction, 2)} in {name}"
        sentences.append(
            f"At its tolerance {tolerance:g} the scene takes {format_number(run.seconds, 2)} CPU s and {meets} the "
            f"tolerance{error if worst.name else ''}."
        )
        sentences += _describe_limits(runs)
    return tuple(sentences[:4])


def _describe_limits(runs: list[Cost]) -> list[str]:
    """Return a sentence on the smallest tolerance that is met, and one on the advice for a run that misses its own."""
    met = [run for run in runs if run.meets_tolerance()]
    sentences = ["No run meets its tolerance."]
    if met:
        best = min(met, key=lambda run: run.tolerance)
        sentences = [
            f"The smallest tolerance that is met is {best.label}, in {format_number(best.seconds, 2)} CPU s."
        ]
    advice = [(run.tolerance, text) for run in runs if run not in met for text in run.remedies]
    return sentences + [f"For the tolerance {value:g}: {text}." for value, text in advice[-1:]]


def _make_quantities(knob: str, runs: list[Cost], tolerance: float) -> dict[str, Quantity]:
    """Return CPU time and error of the scene as it is, and its main measure."""
    run = _find_scene_run(knob, runs, tolerance)
    name = _find_main_measure(runs)
    out = {
        "cpu_time": Quantity(run.seconds, "s"),
        "elapsed_time": Quantity(run.wall_seconds, "s"),
        "largest_error": Quantity(_find_worst(knob, runs, run, tolerance).fraction),
        "tolerance": Quantity(tolerance),
    }
    if name in run.values:
        unit = _find_unit(name)
        out[name] = Quantity(run.values[name], unit, run.errors.get(name), floor=run.floors[name])
    return out


def _find_main_measure(runs: list[Cost]) -> str:
    """Return the least accurate of the key quantities in the first and coarsest run, else of all measures."""
    names = find_measures_with_error(runs)
    names = [name for name in quantities.KEY if name in names] or names
    return find_worst_error(runs[0], names, runs[0].tolerance or 1.0).name or names[0]


def _find_unit(name: str) -> str:
    """Return the unit of a measure."""
    definition = quantities.find_definition(name)
    return definition.unit if definition else "1"


def _find_worst(knob: str, runs: list[Cost], run: Cost, tolerance: float) -> WorstError:
    """Return the least accurate measure of a run, of those that are compared along its curve."""
    if knob == TOLERANCE:
        return find_worst_run_error(run)
    return find_worst_error(run, find_measures_with_error(runs), tolerance)


def _collect_table(curves: dict[str, list[Cost]]) -> dict[str, Variable]:
    """Return the columns of cost.csv: each measure with its stated error and its distance to the best run."""
    rows = [(knob, run) for knob, runs in curves.items() for run in runs]
    columns = {
        "knob": [knob for knob, _ in rows],
        "setting": [run.label for _, run in rows],
        "seconds": [run.seconds for _, run in rows],
        "wall_seconds": [run.wall_seconds for _, run in rows],
        "timings": [run.timings for _, run in rows],
    }
    units = {"seconds": "s", "wall_seconds": "s"}
    for name in dict.fromkeys(name for _, run in rows for name in run.values):
        for prefix, part in (("", "values"), ("error_", "errors"), ("distance_", "distances")):
            columns[prefix + name] = [getattr(run, part).get(name, math.nan) for _, run in rows]
            units[prefix + name] = _find_unit(name)
    return {
        name: Variable(("run",), np.array(column), units.get(name, ""))
        for name, column in columns.items()
    }


def _collect_points(curves: dict[str, list[Cost]], tolerance: float) -> dict[str, Variable]:
    """Return the variables of charts and table: time, largest error and main measure of each run."""
    rows = [(knob, runs, run) for knob, runs in curves.items() for run in runs]
    worst = [_find_worst(knob, runs, run, tolerance) for knob, runs, run in rows]
    allowed = np.array([run.tolerance or tolerance for *_, run in rows])
    seconds = [run.seconds for *_, run in rows]
    name = _find_main_measure(rows[0][1])

    # one colour for each varied setting and for runs that miss the tolerance
    errors = np.array([one.fraction for one in worst])
    results = [
        f"{'meets' if error <= limit else 'misses'} its tolerance"
        for error, limit in zip(errors, allowed, strict=True)
    ]
    varied = [KNOB_TEXTS.get(knob, knob.replace("_", " ")) for knob, *_ in rows]
    texts = results
    if len(curves) > 1:
        texts = [": ".join(pair) for pair in zip(varied, results, strict=True)]
    meanings = tuple(dict.fromkeys(texts))
    codes = np.array([meanings.index(text) for text in texts], np.int8)

    def column(values, unit: str = "1", text: str = "") -> Variable:
        """Return a variable over the points."""
        return Variable(("point",), np.array(values), unit, text)

    points = {
        "label": column([run.label for *_, run in rows], ""),
        "cpu_seconds": column(seconds, "s", "CPU time of the run"),
        # an exact run has no place on a logarithmic axis
        "largest_error": column(np.where(errors > 0, errors, np.nan)),
        "worst_measure": column([one.name.replace("_", " ") for one in worst], ""),
        "allowed_seconds": Variable(("end",), np.array([min(seconds), max(seconds)]), "s"),
        "allowed_error": Variable(("end",), np.full(2, tolerance), text="tolerance of the scene"),
        "value": column(
            [run.values.get(name, math.nan) for *_, run in rows],
            _find_unit(name),
            name.replace("_", " "),
        ),
        "value_error": column([run.errors.get(name, math.nan) for *_, run in rows]),
        "result": column(results, ""),
        "outcome": Variable(("point",), codes, "", meanings=meanings),
    }
    if len(curves) > 1:
        points["varied"] = column(varied, "")
    for key, text in (("nodes", "nodes of the interface"), ("steps", "time steps per cycle")):
        counts = [getattr(run, key) or math.nan for *_, run in rows]
        if np.isfinite(counts).any():
            points[key] = column(counts, text=text)
    return points
