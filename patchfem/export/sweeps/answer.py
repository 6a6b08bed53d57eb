"""The answer of a sweep: quantities, arrays and origin from its table and its analysis."""

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from ... import __version__
from ...campaigns.sweeps.case_models import SweepScene
from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.changes import SweepAnalysis, analyse
from ...campaigns.sweeps.sweep_table import SweepTable, SweptKey
from ...core import PatchfemError, remove_interface_number
from ...formatting import format_number
from ...measures import rows
from ...runs.batch.case_results import FAILED_OUTCOME
from ...runs.results.patch_rows import PATCH_TABLE as STATIC
from ...runs.results.result import describe_measure
from ...runs.rig.motion_warnings import SAME_FREQUENCY_TOL
from ...scene.keys.lookup import find_key
from ..answer import Answer, JsonObject, Quantities, Quantity, Remarks, Variable, Variables
from ..runs import list_versions
from .words import describe_place, make_peak_quantities, make_verdict

# place of a measure in the reference
MEASURE_ORDER = {name: place for place, name in enumerate((*STATIC, *rows.MOTION_TABLE))}
MAX_MEASURE_RANGES = 3  # measures whose largest and smallest values are quantities
MAX_FAILURE_MESSAGES = 5  # messages of failed cases among the warnings
MAX_CASES_TRIED = 3  # cases that are tried until one is valid, for the tolerance of all


def make_sweep_answer(
    sweep_scene: SweepScene, cases: Cases, table: SweepTable, case_folders: Sequence[str] = ()
) -> Answer:
    """Make the answer of a sweep.

    Parameters
    ----------
    sweep_scene : SweepScene
        Scene with its table [sweep].
    cases : Cases
        Cases that were asked for.
    table : SweepTable
        Their results.
    case_folders : sequence of str
        Folders of the cases inside cases/; empty if there are none.
    """
    analysis = analyse(table)
    verdict = make_verdict(table, analysis)
    notes = [sweep_scene.note_bolted_joint()] if sweep_scene.note_bolted_joint() else []

    # Programs read the verdict from sweep.json, which has no page around it.
    details = {"answer": verdict[0], "sentences": list(verdict)}
    details |= _make_details(table, analysis) | {"of": identify_sweep(sweep_scene, cases)}
    keys = " × ".join(key.key for key in table.keys)

    return Answer(
        kind="sweep",
        title=f"Sweep of {keys} ({sweep_scene.path.stem})",
        verdict=verdict,
        quantities=_make_quantities(table, analysis),
        data=_make_data(table, case_folders),
        remarks=Remarks(
            (*_describe_failures(table), *table.faults, *_warn_of_ends(sweep_scene, cases, table)),
            tuple(notes),
        ),
        details=details,
        origin={
            "patchfem": __version__,
            "scene": sweep_scene.text,
            "command": cases.command,
            "versions": list_versions(),
        },
    )


def identify_sweep(sweep_scene: SweepScene, cases: Cases) -> dict[str, str | list[str]]:
    """Return hash of the `scene` and `keys` of a sweep, by which `--resume` identifies it."""
    return {"scene": sweep_scene.hash_common_data(), "keys": [axis.key for axis in cases.axes]}


def read_tolerance(sweep_scene: SweepScene, cases: Cases) -> float:
    """Return the tolerance of the first valid case; NaN if none of the first cases is valid."""
    for number in range(min(len(cases), MAX_CASES_TRIED)):
        with suppress(PatchfemError):
            return sweep_scene.read_scene(cases.assignments(number)).accuracy.tolerance
    return np.nan


def _make_details(table: SweepTable, analysis: SweepAnalysis) -> JsonObject:
    """Return the numbers of sweep.json."""
    peaks = []
    for entry in analysis.peaks:
        row = {"measure": entry.measure, "case": describe_place(table, entry)}
        peaks.append(row | make_peak_quantities(table, entry))
    quantiles = []
    for name, values in analysis.quantiles.items():
        unit = table.measures[name].unit
        row = {"measure": name}
        for place, one in zip(("low", "median", "high"), values, strict=True):
            low, high = (end if np.isfinite(end) else None for end in (one.low, one.high))
            row[place] = Quantity(one.value, unit, low=low, high=high)
        quantiles.append(row)

    tolerance = np.ravel(table.tolerance)
    return {
        "cases": analysis.cases,
        "ranking": analysis.ranking,
        "extremes": analysis.extremes,
        "limits": [limit for limit in analysis.limits if np.isfinite(limit.value)],
        "peaks": peaks,
        "quantiles": quantiles,
        "tolerance": tolerance[0] if np.isfinite(tolerance).tolist() == [True] else None,
    }


def _make_quantities(table: SweepTable, analysis: SweepAnalysis) -> Quantities:
    """Return the quantities of the answer of a sweep, by name.

    They are frequency, height and width of a resonance peak if there is only one, the values of the key at which
    measures have changed by a given amount, and smallest and largest value of the measures that change most.
    """
    quantities = {}
    if len(analysis.peaks) == 1:
        quantities |= make_peak_quantities(table, analysis.peaks[0])

    for extreme in analysis.extremes:
        side = "largest" if extreme.is_largest else "smallest"
        low, high = extreme.interval
        quantities[f"place_of_{side}_{extreme.measure}"] = Quantity(
            extreme.place, extreme.unit, low=low, high=high
        )

    # A limit without a value gives the reason.
    for limit in analysis.limits:
        reason = "" if np.isfinite(limit.value) else "the cases do not show where it lies"
        quantities[f"limit_{limit.measure}"] = Quantity(
            limit.value,
            limit.unit,
            low=limit.low,
            high=limit.high,
            reason="it is reached in no case" if limit.is_never_reached else reason,
        )

    for name, low, high, _ in analysis.ranges[:MAX_MEASURE_RANGES]:
        column = table.select_trusted(name)
        for word, case in (("smallest", low), ("largest", high)):
            quantities[f"{word}_{name}"] = Quantity(
                column.values[case],
                column.unit,
                column.errors[case],
                floor=float(column.floors[case]),
            )
    return quantities


def _make_data(table: SweepTable, case_folders: Sequence[str]) -> Variables:
    """Return the variables of sweep.nc: keys, measures with errors and floors, outcome, messages.

    There is a dimension for each swept key, or the dimension `case` if the cases are rows.
    """
    # Keys are the coordinates of a grid, or columns over the cases of a table.
    dims = tuple(key.name for key in table.keys) if table.is_grid else ("case",)
    data = {}
    if not table.is_grid:
        data["case"] = Variable(dims, np.arange(len(table)), "1", "number of the case")
    for axis, key in enumerate(table.keys):
        values = key.values[table.split_lines(axis)[0]] if table.is_grid else key.values
        own_dims = (key.name,) if table.is_grid else dims
        data[key.name] = Variable(own_dims, values, key.unit, _describe_key(key))

    # Each measure with its error, and with its floor unless that is 0.
    for name in sort_measures(table):
        if name in data:  # normal.load is also the name of a measure
            continue
        column = table.measures[name]
        texts = {
            "": (column.values, describe_measure(name)),
            "_error": (column.errors, f"estimated numerical half-width of {name}"),
            "_floor": (column.floors, f"error of {name} that is allowed besides the tolerance"),
        }
        for ending, (values, text) in texts.items():
            if ending != "_floor" or values.any():
                variable = Variable(dims, values.reshape(table.shape), column.unit, text)
                data[name + ending] = variable

    words = {"outcome": (table.outcome, "how the case ended")}
    if table.messages:
        messages = [table.messages.get(number, "") for number in range(len(table))]
        words["message"] = (messages, "why the case failed, did not settle or misses its tolerance")
    if len(case_folders):
        words["folder"] = (case_folders, "folder of the case inside cases/")
    for name, (values, text) in words.items():
        data[name] = Variable(dims, np.array(values, str).reshape(table.shape), "", text)
    return data


def sort_measures(table: SweepTable) -> list[str]:
    """Return the measures of a table in the order in which the reference lists them."""
    return sorted(
        table.measures,
        key=lambda name: (
            MEASURE_ORDER.get(remove_interface_number(name), len(MEASURE_ORDER)),
            name,
        ),
    )


def _describe_key(key: SweptKey) -> str:
    """Return the dotted name of a key and its meaning."""
    try:
        return f"{key.key}: {find_key(key.key).record.meaning}"
    except KeyError:
        return key.key


def _describe_failures(table: SweepTable) -> tuple[str, ...]:
    """Return the most frequent messages of failed cases, each with the number of cases."""
    failed = np.flatnonzero(table.outcome == FAILED_OUTCOME).tolist()
    counts = Counter(table.messages[number] for number in failed)
    return tuple(
        f"{message} ({count} of {len(table)} cases)"
        for message, count in counts.most_common(MAX_FAILURE_MESSAGES)
    )


def _warn_of_ends(sweep_scene: SweepScene, cases: Cases, table: SweepTable) -> list[str]:
    """Warn of response curves whose largest motion lies at an end of the swept frequencies."""
    peaks = table.measures.get("peak_frequency")
    if peaks is None or not np.isfinite(peaks.values).any():
        return []
    motions = table.measures[rows.AMPLITUDE]
    drive = sweep_scene.read_scene(cases.assignments(int(np.isfinite(peaks.values).argmax()))).drive
    ends = {"drive.from": drive.from_, "drive.to": drive.to}
    swept = {key.key: key.values for key in table.keys if key.key in ends}

    warnings = []
    for key, end in (ends | swept).items():
        is_upper = np.all(end == np.maximum(*(ends | swept).values()))
        side, move = ("upper", "raise") if is_upper else ("lower", "lower")
        at_end = np.isclose(peaks.values, end, rtol=SAME_FREQUENCY_TOL, atol=0.0)
        count = np.count_nonzero(at_end & (motions.values > motions.floors))
        where = key if key in swept else f"{key} = {format_number(end, 6)} Hz"
        if count:
            warnings.append(
                f"the largest response lies at {where}, the {side} end of the swept frequencies, in {count} of "
                f"{len(table)} cases, so that it may be no resonance; {move} {key}"
            )
    return warnings
