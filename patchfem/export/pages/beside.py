"""Several runs on one page: what differs in their scenes, their measures side by side, their curves in one picture."""

import math
import tomllib
from html import escape
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...scales import LADDERS, axis_unit
from ..drawing.charts import COLOURS, mark
from ..readback import numeric, readable, variables, wanted
from ..summary import read_summary
from ..written import NUMBER
from .document import Section, document, prose, table
from .sweep import label
from .words import linked, meaning, pair

TALL = 410  # pixels of a picture
POINTS = 4000  # of one line in a picture
KNOWN = {"time": "time", "displacement": "relative_displacement", "acceleration": "absolute_acceleration",
         "force": "friction_force"}  # columns of a measurement that are shown
UNITS = {"time": "s", "displacement": "m", "acceleration": "m s-2", "force": "N"}
IN_PHASE = ("relative_displacement", "absolute_acceleration")
MEASURED = "measured"
MANY = 10.0  # times the first value, from which a change is told as a factor
CYCLES = 2.0  # of the last motion that are shown: result.nc keeps so many whole
CHARTS = (  # title, x: (variable, label), y: (variable, label); only the last cycles of what stands on time
    ("Pressure", ("x", "place"), ("normal_stress", "normal stress")),
    ("Friction loop", ("relative_displacement", "displacement"), ("friction_force", "friction force")),
    ("Displacement", ("time", "time before the end"), ("relative_displacement", "displacement")),
    ("Acceleration", ("time", "time before the end"), ("absolute_acceleration", "acceleration")),
    ("Levels", ("level_drive", "level"), ("relative_displacement_amplitude", "displacement amplitude")),
    ("Steady motions", ("curve_frequency", "frequency"), ("curve_amplitude", "displacement amplitude")))


class FinishedRun(NamedTuple):
    """A finished run as its folder holds it.

    name: of the folder; summary: of summary.json; resolved: the scene with every default, as nested tables; arrays:
    variable -> (values, unit), the first frame of what has frames.
    """

    name: str
    summary: dict
    resolved: dict
    arrays: dict


def read(folder: Path) -> FinishedRun:
    """The run in a results folder; PatchfemError where there is none."""
    folder = Path(folder)
    try:
        summary = read_summary(folder / "summary.json")
        resolved = tomllib.loads((folder / "scene.resolved.toml").read_text(encoding="utf-8"))
        if not isinstance(resolved.get("drive", {}), dict):
            raise ValueError("scene.resolved.toml: drive is not a table")
    except FileNotFoundError as fault:
        raise PatchfemError(f"{folder}: not a results folder: it has no {Path(fault.filename).name}") from None
    except (ValueError, OSError, RecursionError) as fault:
        raise PatchfemError(f"{folder}: its results cannot be read: {fault}") from None
    return FinishedRun(folder.resolve().name, summary, resolved, _arrays(folder / "result.nc"))


def _arrays(path: Path) -> dict:
    if not path.is_file():
        return {}
    shown, out = {name for _, *axes in CHARTS for name, _ in axes}, {}
    for name, one in variables(path, shown)[1].items():
        with readable(path, "results of a run"):
            wanted(numeric(one.values) and one.values.ndim in (1, 2) and one.values.size > 0,
                   f"{name} contains {one.values.ndim}-dimensional {one.values.dtype}")
        values = one.values[0] if one.values.ndim == 2 else one.values
        if np.isfinite(values).any():
            out[name] = (values.astype(float), one.unit)
    return out


def measured(name: str, values: dict, like: FinishedRun) -> FinishedRun:
    """A measurement as a FinishedRun without measures, shown beside runs like `like`.

    values: name -> (k,) in SI as `inputs.laboratory` reads them: time, displacement, acceleration, force. Where both
    move under a sine its time is shifted until the first harmonics of both displacements, or accelerations, agree in
    phase.
    """
    arrays = {KNOWN[key]: (np.asarray(rows, float), UNITS[key]) for key, rows in values.items() if key in KNOWN}
    one = FinishedRun(name, {"kind": like.summary["kind"], "measures": {}, "outcome": MEASURED}, like.resolved, arrays)
    if "time" in arrays:
        end = like.arrays["time"][0][-1] if "time" in like.arrays else arrays["time"][0][-1]
        one.arrays["time"] = (arrays["time"][0] + _lag(one, like) - end, "s")  # 0 is the end of the run
    return one


def _lag(one: FinishedRun, like: FinishedRun) -> float:
    """Time [s] that a measurement is shifted by: its end to that of the run, then on to the same phase."""
    shift = like.arrays["time"][0][-1] - one.arrays["time"][0][-1] if "time" in like.arrays else 0.0
    period = period_of(like)
    both = next((key for key in IN_PHASE if key in one.arrays and key in like.arrays), None)
    if period is None or both is None or like.summary["kind"] == "bench":
        return shift
    turns = []
    for run, more in ((one, shift), (like, 0.0)):
        late = _late(run)
        angle = 2 * np.pi * (run.arrays["time"][0][late] + more) / period
        parts = np.linalg.lstsq(np.stack([np.cos(angle), np.sin(angle), np.ones(angle.size)], axis=1),
                                run.arrays[both][0][late], rcond=None)[0]
        turns.append(math.atan2(parts[0], parts[1]) / (2 * np.pi))
    return shift + ((turns[0] - turns[1] + 0.5) % 1.0 - 0.5) * period


def page(runs: list, read: FinishedRun | None = None) -> str:
    """The whole HTML page of several `FinishedRun`s, in their order; differences are from the first.

    read: a measurement, of `measured`, laid over their pictures.
    """
    names = distinct([run.name for run in runs])
    told, shown = (names, runs) if read is None else ([f"measured: {read.name}", *names], [read, *runs])
    charts = [one for one in (_chart(number, *chart, shown, told) for number, chart in enumerate(CHARTS)) if one]
    if read is not None:
        charts = [_over(one) for one in charts if any(mark["name"] in names for mark in one["marks"])]
    outcomes = "; ".join(f"{escape(name)}: {escape(run.summary['outcome'])}" for name, run in zip(names, runs))
    sections = [Section("scenes", "What differs in the scenes", _differences(runs, names)),
                Section("measures", "Measures side by side", _measures(runs, names))]
    sections += [Section(one["anchor"] + "-part", one["title"], f'<div id="{one["anchor"]}" class=chart role=img '
                         f'aria-label="{escape(one["told"])}"></div><p class=soft>{prose(one["told"])}</p>')
                 for one in charts]
    known = dict.fromkeys(name for run in runs for name in run.summary["measures"])
    means = [(f" id='measure-{escape(name)}'", [escape(label(name)), prose(meaning(name))]) for name in known]
    sections.append(Section("means", "What the measures are", table(("", ""), means)))
    title = " and ".join(names) if len(names) < 4 else f"{len(names)} runs side by side"
    return document(title, f"<p class=verdict>{outcomes}.</p>", sections, {"charts": charts} if charts else None,
                    ("figures.js", "curves.js") if charts else ())


def _over(chart: dict) -> dict:
    """A chart whose first line, where it is the measured one, lies broad and grey under the others."""
    first, *rest = chart["marks"]
    if not first["name"].startswith("measured: "):
        return chart
    marks = [mark | {"colour": colour} for mark, colour in zip(rest, COLOURS * len(rest))]
    return chart | {"marks": [first | {"colour": "soft", "width": 3, "alpha": 0.55}, *marks]}


def distinct(names: list) -> list:
    """The names, numbered where several are the same."""
    return [name if names.count(name) == 1 else f"{name} ({number})" for number, name in enumerate(names, 1)]


def _chart(number: int, title: str, x: tuple, y: tuple, runs: list, names: list) -> dict | None:
    """One picture of all runs that have both variables, in units that suit the largest values."""
    lines = []
    for run, name in zip(runs, names):
        if x[0] not in run.arrays or y[0] not in run.arrays:
            continue
        (a, unit_a), (b, unit_b) = run.arrays[x[0]], run.arrays[y[0]]
        if a.shape != b.shape or not a.size:
            continue
        if "time" in run.arrays and run.arrays["time"][0].shape == a.shape:
            late = _late(run)
            a, b = a[late], b[late]
            a = a - a[-1] if x[0] == "time" and run.summary["outcome"] != MEASURED else a
        step = -(-a.size // POINTS)
        lines.append((name, a[::step], b[::step]))
    if not lines:
        return None
    (unit_a, scale_a), (unit_b, scale_b) = (
        axis_unit(np.concatenate([line[k] for line in lines]), unit) if unit in LADDERS else (unit, 1.0)
        for k, unit in ((1, unit_a), (2, unit_b)))
    peaks = ", ".join(f"{name} from {np.nanmin(b) * scale_b:.4g} to {np.nanmax(b) * scale_b:.4g}"
                      for name, _, b in lines)
    return {"anchor": f"chart{number}", "title": title, "height": TALL,
            "x": {"label": x[1], "unit": unit_a, "log": False}, "y": {"label": y[1], "unit": unit_b, "log": False},
            "told": f"{y[1].capitalize()} [{unit_b}] over {x[1]}: {peaks}.",
            "marks": [mark("dots" if x[0] == "level_drive" else "line", colour, name, x=a * scale_a, y=b * scale_b)
                      for colour, (name, a, b) in zip(COLOURS * len(lines), lines)]}


def period_of(run: FinishedRun) -> float | None:
    """Period [s] of the sine that drives a run; None where none does."""
    written = NUMBER.match(str(run.resolved.get("drive", {}).get("frequency", "")))
    return 1 / float(written[1]) if written and float(written[1]) > 0 else None


def _late(run: FinishedRun) -> np.ndarray:
    """Which samples lie in the last CYCLES cycles of a sine, or in the last tenth of a run without one."""
    time, period = run.arrays["time"][0], period_of(run)
    span = CYCLES * period if period else np.ptp(time) / 10
    if run.summary["kind"] == "bench":
        span = np.ptp(time)
    return time >= time[-1] - span * (1 + 1e-9)


def _flat(table, at: str = "") -> dict:
    """Nested tables as one: "contact.tilt.angle" -> value; entries of lists by their name or number."""
    if isinstance(table, dict):
        pairs = table.items()
    elif isinstance(table, list) and table and isinstance(table[0], dict):
        pairs = [(one.get("name", number), one) for number, one in enumerate(table, 1)]
    else:
        return {at: table}
    return {key: value for name, one in pairs for key, value in _flat(one, f"{at}.{name}" if at else str(name)).items()}


def _differences(runs: list, names: list) -> str:
    """A table of the keys of the resolved scenes that are not the same in all of them."""
    flat = [_flat(run.resolved) for run in runs]
    keys = [key for key in dict.fromkeys(key for one in flat for key in one)
            if any(one.get(key) != flat[0].get(key) for one in flat)]
    if not keys:
        return "<p>There is no difference: the resolved scenes are the same.</p>"
    rows = [[escape(key), *(_written(one.get(key)) for one in flat)] for key in keys]
    return ("<p class=soft>The table lists the keys whose values differ between the resolved scenes, in SI.</p>"
            + table(("key", *map(escape, names)), rows))


def _written(value) -> str:
    text = "&ndash;" if value is None else f"{value:.8g}" if isinstance(value, float) else escape(str(value))
    return text if len(text) < 80 else text[:76] + " …"


def _measures(runs: list, names: list) -> str:
    """A table of the measures of all runs; what differs from the first by more than both errors is marked."""
    rows = []
    for name in dict.fromkeys(name for run in runs for name in run.summary["measures"]):
        found = [run.summary["measures"].get(name) for run in runs]
        rows.append([linked(label(name), name),
                     *(_cell(name, one, found[0] if number else None) for number, one in enumerate(found))])
    return ("<p class=soft>Each cell shows a value and its estimated numerical error. Bold values differ from the "
            "first run by more than the sum of both errors. The change from the first run is in brackets: in per "
            "cent; as a factor if the value is ten times the first value or more; as a dash if the first value is "
            "smaller than its error.</p>"
            + table(("measure", *(f">{escape(name)}" for name in names)), rows, "across side"))


def _cell(name: str, one: dict | None, first: dict | None) -> str:
    if one is None or one["value"] is None or not math.isfinite(one["value"]):
        return "&ndash;"
    text = escape(pair(name, one))
    alone = first is None or first["value"] is None
    if alone or abs(one["value"] - first["value"]) <= (one["error"] or 0.0) + (first["error"] or 0.0):
        return f"<span class=v>{text}</span>"
    return f"<b class=v>{text}</b> <span class=v>({_share(one['value'], first)})</span>"


def _share(value: float, first: dict) -> str:
    """The change from the first value: in per cent, as a factor where it is many times as large, a dash where the first
    is 0 within its error, so that any number would tell of that error."""
    if abs(first["value"]) <= (first["error"] or 0.0):
        return "&ndash;"
    factor = value / first["value"]
    if abs(factor) < MANY:
        return f"{(value - first['value']) / abs(first['value']):+.2%}"
    return f"&times; {float(f'{factor:.2g}'):.7g}"  # two digits, and 150 as it is
