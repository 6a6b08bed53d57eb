"""The answer of a sweep: sentences, quantities and arrays from its table and its analysis."""

from __future__ import annotations

import shlex
import tomllib
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from ... import __version__
from ...campaigns.sweeps.case_models import SweepScene
from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.changes import MAIN_MEASURES, SweepAnalysis, analyse
from ...campaigns.sweeps.limits import DOUBLING, KeyLimit
from ...campaigns.sweeps.peaks import PeakOnLine
from ...campaigns.sweeps.sweep_table import FINAL_OUTCOMES, SweepTable, SweptKey
from ...core import PatchfemError
from ...formatting import format_number
from ...runs.results.result import describe_measure
from ...scene.keys import types
from ...scene.keys.lookup import find_key
from ..answer import Answer, Quantity, Remarks, Variable
from ..quantities import choose_scale, format_quantity
from ..summary import package_versions
from .tables import sort_measures

MAX_MESSAGES = 5  # messages of failed cases among the warnings
MAX_COMMAND_LENGTH = 2000  # characters of a list of values in a command; a longer list is a file
MAX_CASES_TRIED = 3  # cases that are tried until one is valid, for the tolerance of all
SMALLEST_NUMBER = 0.01  # a smaller number of a pair has a unit of its own
SMALLEST_SHARE = 0.01  # fraction of the variance below which a key is not named


def make_answer(
    sweep_scene: SweepScene, cases: Cases, table: SweepTable, case_folders: Sequence[str] = ()
) -> Answer:
    """Make the answer of a sweep.

    Parameters
    ----------
    sweep_scene : SweepScene
    cases : Cases
    table : SweepTable
    case_folders : sequence of str
        Folders of the cases inside cases/; empty if there are none.
    """
    analysis = analyse(table, sweep_scene.of)
    verdict = make_verdict(table, analysis)
    note = sweep_scene.note_bolted_joint()
    return Answer(
        kind="sweep",
        title=_make_title(sweep_scene, table),
        verdict=verdict,
        quantities=_make_quantities(table, analysis),
        data=_make_data(table, case_folders),
        remarks=Remarks(_describe_failures(table), (note,) if note else ()),
        details=_make_details(table, analysis, verdict)
        | {"of": identify_sweep(sweep_scene, cases)},
        origin={
            "patchfem": __version__,
            "scene": sweep_scene.text,
            "command": make_command(sweep_scene, cases),
            "versions": package_versions(),
        },
    )


def identify_sweep(sweep_scene: SweepScene, cases: Cases) -> dict[str, str | list[str]]:
    """Return hash of the `scene` and `keys` of a sweep, by which `--resume` identifies it."""
    return {"scene": sweep_scene.hash_common_data(), "keys": [axis.key for axis in cases.axes]}


def read_tolerance(sweep_scene: SweepScene, cases: Cases) -> float | None:
    """Return the tolerance that all cases share; None if it is swept or no case is valid."""
    if any(axis.key == "accuracy.tolerance" for axis in cases.axes):
        return None
    for number in range(min(len(cases), MAX_CASES_TRIED)):
        try:
            text = sweep_scene.read_scene(cases.assignments(number)).resolved()
        except PatchfemError:  # the case is invalid
            continue
        value = tomllib.loads(text).get("accuracy", {}).get("tolerance")
        return None if value is None else float(value)
    return None


def make_command(sweep_scene: SweepScene, cases: Cases) -> str:
    """Return the command line that computes the same cases."""
    words = ["patchfem", "sweep", sweep_scene.path.name]
    for assignment in sweep_scene.sets:
        words += ["--set", assignment]
    words += ["--of", sweep_scene.of] if sweep_scene.of else []
    if cases.is_table and cases.request_arguments:
        return shlex.join([*words, *cases.request_arguments])
    overs = []
    for axis in () if cases.is_table else cases.axes:
        overs += ["--over", f"{axis.key}={','.join(axis.texts)}"]
    is_long = sum(map(len, overs)) > MAX_COMMAND_LENGTH
    return shlex.join([*words, *(overs if overs and not is_long else ("--cases", "sweep.csv"))])


def _make_title(sweep_scene: SweepScene, table: SweepTable) -> str:
    """Return the title: the swept keys and the title of the scene."""
    scene_title = tomllib.loads(sweep_scene.text).get("title") or sweep_scene.path.stem
    return f"Sweep of {' × '.join(key.key for key in table.keys)}: {scene_title}"


def _make_details(table: SweepTable, analysis: SweepAnalysis, verdict: tuple[str, ...]) -> dict:
    """Return the contents of sweep.json."""
    outcomes = table.count_outcomes()
    tolerance = table.tolerance if np.ndim(table.tolerance) == 0 else np.nan
    return {
        "answer": verdict[0],
        "sentences": list(verdict),
        "cases": {
            "count": len(table),
            "failed": table.count_failed(),
            "unfinished": outcomes.get("", 0),
            "outcomes": outcomes,
            "over_tolerance": table.count_misses(),
        },
        "ranking": {
            name: [index._asdict() for index in indices]
            for name, indices in analysis.ranking.items()
        },
        "limits": [_limit_row(limit) for limit in analysis.limits if np.isfinite(limit.value)],
        "peaks": [_peak_row(entry) for entry in analysis.peaks],
        "quantiles": {
            name: {"unit": table.measures[name].unit, "values": values.tolist()}
            for name, values in analysis.quantiles.items()
        },
        "tolerance": None if np.isnan(tolerance) else float(tolerance),
    }


def _limit_row(limit: KeyLimit) -> dict:
    """Return a limit as a row of sweep.json, in SI."""
    return {
        "measure": limit.measure,
        "key": limit.key.key,
        "value": limit.value,
        "unit": limit.key.unit,
        "change": limit.change,
        "low": limit.low,
        "high": limit.high,
    }


def _peak_row(entry: PeakOnLine) -> dict:
    """Return a peak as a row of sweep.json; null for an unknown number."""
    numbers = {
        name: value if np.isfinite(value) else None for name, value in entry.peak._asdict().items()
    }
    others = {
        key: value if isinstance(value, str) else float(value)
        for key, value in entry.other_values.items()
    }
    return {"measure": entry.measure, "keys": others} | numbers


def _make_quantities(table: SweepTable, analysis: SweepAnalysis) -> dict[str, Quantity]:
    """Return the limits of the key, and the peak if there is only one."""
    quantities = {}
    for limit in analysis.limits:
        reason = "" if np.isfinite(limit.value) else "the cases do not show where it lies"
        if limit.is_never_reached:
            reason = "it is reached in no case"
        quantities[f"limit_{limit.measure}"] = Quantity(
            limit.value,
            limit.key.unit,
            low=limit.low if not reason else None,
            high=limit.high,
            reason=reason,
        )
    if len(analysis.peaks) == 1:
        name, _, peak = analysis.peaks[0]
        unit = table.measures[name].unit
        width_reason = "" if np.isfinite(peak.width) else "the cases do not show it"
        quantities |= {
            "peak_frequency": Quantity(peak.frequency, "Hz", peak.frequency_error),
            "peak_height": Quantity(peak.height, unit, peak.height_error),
            "half_power_width": Quantity(peak.width, "Hz", peak.width_error, reason=width_reason),
        }
    return quantities


def _make_data(table: SweepTable, case_folders: Sequence[str]) -> dict[str, Variable]:
    """Return the variables of sweep.nc: keys, measures with errors and floors, outcome, messages.

    There is a dimension for each swept key, or the dimension `case` if the cases are rows.
    """
    data = {}
    dims = ("case",)
    if table.is_grid:
        dims = tuple(key.name for key in table.keys)
    else:
        text = "number of the case"
        data["case"] = Variable(dims, np.arange(len(table)), "1", text)
    for axis, key in enumerate(table.keys):
        values = key.values
        if table.is_grid:
            values = np.moveaxis(values.reshape(table.shape), axis, 0)
            values = values.reshape(table.shape[axis], -1)[:, 0]
        own_dims = (key.name,) if table.is_grid else dims
        data[key.name] = Variable(own_dims, values, key.unit, _describe_key(key))

    for name in sort_measures(table):
        column = table.measures[name]
        if name in data:  # normal.load is also the name of a measure
            continue
        columns = {
            name: (column.values, describe_measure(name)),
            f"{name}_error": (column.errors, f"estimated numerical half-width of {name}"),
        }
        if column.floors.any():
            text = f"error of {name} that is allowed in addition to the tolerance"
            columns[f"{name}_floor"] = (column.floors, text)
        for title, (values, text) in columns.items():
            data[title] = Variable(dims, values.reshape(table.shape), column.unit, text)
    texts = {"outcome": (table.outcome, "how the case ended")}
    if table.messages:
        messages = [table.messages.get(number, "") for number in range(len(table))]
        texts["message"] = (messages, "why the case failed")
    if len(case_folders):
        texts["folder"] = (case_folders, "folder of the case inside cases/")
    for name, (values, text) in texts.items():
        data[name] = Variable(dims, np.array(values, str).reshape(table.shape), "", text)
    return data


def _describe_key(key: SweptKey) -> str:
    """Return the dotted name of a key and its meaning."""
    try:
        return f"{key.key}: {types.find_meaning(*find_key(key.key))}"
    except KeyError:
        return key.key


def _describe_failures(table: SweepTable) -> tuple[str, ...]:
    """Return a sentence for each message of failed cases, for at most MAX_MESSAGES messages."""
    cases = defaultdict(list)
    for number in sorted(table.messages):
        cases[table.messages[number]].append(number + 1)
    sentences = []
    for message, numbers in list(cases.items())[:MAX_MESSAGES]:
        others = f" and {len(numbers) - 1} more" if len(numbers) > 1 else ""
        sentences.append(f"case {numbers[0]}{others}: {message}")
    if len(cases) > MAX_MESSAGES:
        sentences.append("the messages of all failed cases are in sweep.csv")
    return tuple(sentences)


def make_verdict(table: SweepTable, analysis: SweepAnalysis) -> tuple[str, ...]:
    """Return at most four sentences: largest change, limit or peak, scatter, and what limits trust."""
    sentences = [_describe_change(table, analysis)]
    sentences += _describe_limit(analysis.limits) or _describe_peaks(table, analysis.peaks)
    sentences += _describe_ranking(table, analysis) if table.is_random else []
    return (*sentences[:3], _describe_cases(table))


def _describe_change(table: SweepTable, analysis: SweepAnalysis) -> str:
    """Return the headline: the measure that changes most, by how much, and with which key."""
    n_known = int(np.sum(table.outcome != "")) - table.count_failed()
    if not n_known:
        return "No case has a result."
    if not analysis.ranges:
        if n_known == 1:
            return "Only one case has a result, so that no change is known."
        return f"No main measure changes by more than its error over {n_known} cases."
    name, low, high, _ = analysis.ranges[0]
    column = table.measures[name]
    texts = _format_pair(name, column.unit, column.values[[low, high]].tolist())
    label = name.replace("_", " ")
    varied = [key for key in table.keys if key.count > 1]
    if len(varied) == 1:
        places = [format_key(varied[0], varied[0].values[case]) for case in (low, high)]
        return (
            f"With {varied[0].key}, {label} changes most: from {texts[0]} at {places[0]} "
            f"to {texts[1]} at {places[1]}."
        )
    indices = analysis.ranking.get(name, ())
    keys = indices[0].key if indices else " and ".join(key.key for key in varied[:2])
    share = f", {100 * indices[0].total:.0f} % of its variance" if indices else ""
    return (
        f"{label.capitalize()} changes most: {texts[0]} to {texts[1]}, mainly with {keys}{share}."
    )


def _format_pair(name: str, unit: str, values: list[float]) -> list[str]:
    """Return two values of a measure in the unit of the larger one, unless the other is too small for it."""
    label, scale = choose_scale(name, unit, max(map(abs, values)))
    texts = []
    for value in values:
        number = value * scale
        if value and abs(number) < SMALLEST_NUMBER:
            texts.append(_format_value(name, unit, value))
        else:
            texts.append(f"{format_number(number, 4)} {label}".strip() if value else "0")
    return texts


def _format_value(name: str, unit: str, value: float, digits: int = 4) -> str:
    """Return a value without an error in a readable unit."""
    label, scale = choose_scale(name, unit, abs(value))
    return f"{format_number(value * scale, digits)} {label}".strip()


def format_key(key: SweptKey, value: float | str, digits: int = 4) -> str:
    """Return a value of a swept key with its unit."""
    return _format_value(key.name, key.unit, float(value), digits) if key.is_number else str(value)


def _describe_limit(limits: list[KeyLimit]) -> list[str]:
    """Return how far the key may go before a measure of the motion or the patch changes by 5 %."""
    small = [limit for limit in limits if abs(limit.change) < DOUBLING]
    if not small:
        return []
    key = small[0].key
    reached = [limit for limit in small if np.isfinite(limit.value)]
    unknown = [
        limit for limit in small if not np.isfinite(limit.high) and not limit.is_never_reached
    ]
    if not reached and not unknown:
        names = _join_names([limit.measure for limit in small])
        return [f"{names} change by less than 5 % over all cases."]
    first = min(reached, key=lambda limit: limit.value, default=None)
    lowest = min(unknown, key=lambda limit: limit.low, default=None)
    if first is None or (lowest is not None and lowest.low < first.low):
        return [
            f"{key.key} may reach at least {format_key(key, lowest.low)} before "
            f"{_join_names([lowest.measure])} changes by 5 %; more cases are needed to find this limit."
        ]
    places = [format_key(key, value, 3) for value in (first.value, first.low, first.high)]
    return [
        f"{key.key} may reach {places[0]} before {_join_names([first.measure])} changes by 5 % "
        f"(between the cases at {places[1]} and {places[2]})."
    ]


def _join_names(names: list[str]) -> str:
    """Return names of measures as a list in words."""
    *before, last = (name.replace("_", " ") for name in names)
    return f"{', '.join(before)} and {last}" if before else last


def _describe_peaks(table: SweepTable, peaks: list[PeakOnLine]) -> list[str]:
    """Return where the first and the last of the peaks over frequency lie."""
    clauses = []
    keys = {key.key: key for key in table.keys}
    for name, others, peak in peaks if len(peaks) < 3 else (peaks[0], peaks[-1]):
        unit = table.measures[name].unit
        frequency = format_quantity("", Quantity(peak.frequency, "Hz", peak.frequency_error))
        height = format_quantity(name, Quantity(peak.height, unit, peak.height_error))
        place = "".join(
            f" with {key} {format_key(keys[key], value)}" for key, value in others.items()
        )
        width = ""
        if np.isfinite(peak.width):
            width_text = format_quantity("", Quantity(peak.width, "Hz", peak.width_error))
            width = f", half-power width {width_text}"
        clauses.append(f"{frequency}{place} ({height}{width})")
    if not clauses:
        return []
    return [f"{_join_names([peaks[0].measure]).capitalize()} peaks at {' and at '.join(clauses)}."]


def _describe_ranking(table: SweepTable, analysis: SweepAnalysis) -> list[str]:
    """Return which keys matter for the first ranked measure, and where 90 % of the random cases lie."""
    sentences = []
    if analysis.ranking:
        name, indices = next(iter(analysis.ranking.items()))
        parts = [
            f"{index.key} {100 * index.total:.0f} % ({100 * index.low:.0f} to {100 * index.high:.0f} %)"
            for index in indices[:3]
            if index.total >= SMALLEST_SHARE
        ]
        sentences.append(f"Shares of the variance of {_join_names([name])}: {', '.join(parts)}.")
    if analysis.quantiles:
        name, (low, _, high) = next(iter(analysis.quantiles.items()))
        unit = table.measures[name].unit
        ends = _format_pair(name, unit, [float(low), float(high)])
        sentences.append(f"90 % of the cases have a {_join_names([name])} of {' to '.join(ends)}.")
    return sentences


def _describe_cases(table: SweepTable) -> str:
    """Return how many cases there are, and how many are missing, failed, unsettled or over the tolerance."""
    outcomes = table.count_outcomes()
    changing = sum(
        count
        for name, count in outcomes.items()
        if name not in (*FINAL_OUTCOMES, "", "failed", "not_converged")
    )
    missed = table.count_misses()
    parts = {
        "have no result yet": outcomes.get("", 0),
        "failed": outcomes.get("failed", 0),
        "did not converge": outcomes.get("not_converged", 0),
        "did not settle": changing,
    }
    clauses = [f"{count} {text}" for text, count in parts.items() if count]
    if missed:
        main = [name for name in MAIN_MEASURES if name in missed] or list(missed)
        name = max(main, key=lambda name: missed[name]["count"])
        clauses.append(
            f"{missed[name]['count']} miss the tolerance in {_join_names([name])}"
            + (f" and {len(missed) - 1} other measures" if len(missed) > 1 else "")
        )
    if not clauses:
        return f"All {len(table)} cases settled and meet the tolerance."
    return f"Of {len(table)} cases, {', '.join(clauses)}."
