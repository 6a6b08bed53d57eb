"""Page with several runs: differences of the scenes, measures side by side, and curves."""

import math
import tomllib
from html import escape
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import Missing, PatchfemError
from ...formatting import UNIT_LADDERS, choose_axis_unit
from ..drawing.charts import COLOURS, make_mark
from ..read_results import is_real, read_variables, reading_errors, require_valid
from ..summary import read_summary
from ..written import NUMBER_PATTERN, measure_label
from .document import Section, document_html, sentence_html, table_html
from .sentences import format_with_error, measure_link, measure_meaning

CHART_HEIGHT = 410  # height of a figure [px]
MAX_LINE_POINTS = 4000  # largest number of points of a line in a figure
MIN_FACTOR = 10.0  # smallest ratio to the value of the first run that is written as a factor
N_SHOWN_CYCLES = 2.0  # number of last cycles that are shown, as many as result.nc stores completely
# Title, x (variable, label) and y (variable, label) of each chart; charts over
# time show only the last cycles.
CHARTS = (
    ("Pressure", ("x", "place"), ("normal_stress", "normal stress")),
    (
        "Friction loop",
        ("relative_displacement", "displacement"),
        ("friction_force", "friction force"),
    ),
    ("Displacement", ("time", "time before the end"), ("relative_displacement", "displacement")),
    ("Acceleration", ("time", "time before the end"), ("absolute_acceleration", "acceleration")),
    (
        "Levels",
        ("level_drive", "level"),
        ("level_relative_displacement_amplitude", "displacement amplitude"),
    ),
    (
        "Steady motions",
        ("curve_frequency", "frequency"),
        ("curve_amplitude", "displacement amplitude"),
    ),
)


class FinishedRun(NamedTuple):
    """Finished run, as read from its results folder.

    Attributes
    ----------
    name : str
        Name of the folder.
    summary : dict
        Content of summary.json.
    resolved : dict
        The scene with all defaults, as nested tables.
    arrays : dict
        Variable -> (values, unit); of variables with frames only the first.
    """

    name: str
    summary: dict
    resolved: dict
    arrays: dict


def read_run(folder: Path) -> FinishedRun:
    """Read the run in a results folder; raise PatchfemError if there is none."""
    folder = Path(folder)
    if not folder.exists():
        raise Missing(f"{folder}: no such results folder")
    try:
        summary = read_summary(folder / "summary.json")
        resolved = tomllib.loads((folder / "scene.resolved.toml").read_text(encoding="utf-8"))
        if not isinstance(resolved.get("drive", {}), dict):
            raise ValueError("scene.resolved.toml: drive is not a table")
    except FileNotFoundError as fault:
        raise PatchfemError(
            f"{folder}: not a results folder: it has no {Path(fault.filename).name}"
        ) from None
    except (ValueError, OSError, RecursionError) as fault:
        raise PatchfemError(f"{folder}: its results cannot be read: {fault}") from None
    return FinishedRun(folder.resolve().name, summary, resolved, _read_arrays(folder / "result.nc"))


def _read_arrays(path: Path) -> dict:
    """Read the variables that charts of several runs need."""
    if not path.is_file():
        return {}
    drawn_names = {name for _, *axes in CHARTS for name, _ in axes}
    arrays = {}
    for name, variable in read_variables(path, drawn_names)[1].items():
        with reading_errors(path, "results of a run"):
            require_valid(
                is_real(variable.values)
                and variable.values.ndim in (1, 2)
                and variable.values.size > 0,
                f"{name} contains {variable.values.ndim}-dimensional {variable.values.dtype}",
            )
        values = variable.values[0] if variable.values.ndim == 2 else variable.values
        if np.isfinite(values).any():
            arrays[name] = (values.astype(float), variable.unit)
    return arrays


def page_html(runs: list) -> str:
    """Return the HTML page that compares several runs with the first of them."""
    names = number_duplicates([run.name for run in runs])
    charts = []
    for title, x, y in CHARTS:
        for units, lines in _lines_by_units(x[0], y[0], runs, names).items():
            charts.append(_chart_figure(len(charts), title, (x, y), units, lines))
    outcomes = "; ".join(
        f"{escape(name)}: {escape(run.summary['outcome'])}" for name, run in zip(names, runs)
    )
    sections = [
        Section("scenes", "What differs in the scenes", _differences_table(runs, names)),
        Section("measures", "Measures side by side", _measures_table(runs, names)),
    ]
    sections += [
        Section(
            chart["anchor"] + "-part",
            chart["title"],
            f'<div id="{chart["anchor"]}" class=chart role=img '
            f'aria-label="{escape(chart["told"])}"></div><p class=soft>{sentence_html(chart["told"])}</p>',
        )
        for chart in charts
    ]
    measure_names = dict.fromkeys(name for run in runs for name in run.summary["measures"])
    meaning_rows = [
        (
            f" id='measure-{escape(name)}'",
            [escape(measure_label(name)), sentence_html(measure_meaning(name))],
        )
        for name in measure_names
    ]
    sections.append(Section("means", "What the measures are", table_html(("", ""), meaning_rows)))
    title = " and ".join(names) if len(names) < 4 else f"{len(names)} runs side by side"
    return document_html(
        title,
        f"<p class=verdict>{outcomes}.</p>",
        sections,
        {"charts": charts} if charts else None,
        ("figures.js", "curves.js") if charts else (),
    )


def number_duplicates(names: list) -> list:
    """Append a number to names that occur more than once."""
    return [
        name if names.count(name) == 1 else f"{name} ({number})"
        for number, name in enumerate(names, 1)
    ]


class Line(NamedTuple):
    """Line of a chart: the name of its run and its coordinates [SI]."""

    name: str
    x: np.ndarray
    y: np.ndarray


def _lines_by_units(x: str, y: str, runs: list, names: list) -> dict:
    """Group the chart lines of all runs by the units of their two variables.

    The units of runs can differ: the levels of a drive are forces in one run and accelerations in
    another one. Such lines cannot share an axis.

    Parameters
    ----------
    x, y : str
        Names of the variables.
    runs : list of FinishedRun
    names : list of str
        Names of the runs on the page.

    Returns
    -------
    dict
        (unit of x, unit of y) -> list of Line, in the order of the runs.
    """
    lines = {}
    for run, name in zip(runs, names):
        if x not in run.arrays or y not in run.arrays:
            continue
        (a, unit_a), (b, unit_b) = run.arrays[x], run.arrays[y]
        if a.shape != b.shape or not a.size:
            continue
        if "time" in run.arrays and run.arrays["time"][0].shape == a.shape:
            late = _select_last_cycles(run)
            a = a[late]
            b = b[late]
            a = a - a[-1] if x == "time" else a
        step = -(-a.size // MAX_LINE_POINTS)
        lines.setdefault((unit_a, unit_b), []).append(Line(name, a[::step], b[::step]))
    return lines


def _chart_figure(number: int, title: str, axes: tuple, units: tuple, lines: list) -> dict:
    """Return the chart of several runs as an HTML figure.

    Parameters
    ----------
    number : int
        Number of the figure.
    title : str
    axes : tuple
        (variable, label) of x and of y.
    units : tuple
        Units of x and y that all lines have.
    lines : list of Line
    """
    x, y = axes
    unit_a, scale_a = _axis_unit([line.x for line in lines], units[0])
    unit_b, scale_b = _axis_unit([line.y for line in lines], units[1])
    peaks = ", ".join(
        f"{name} from {np.nanmin(b) * scale_b:.4g} to {np.nanmax(b) * scale_b:.4g}"
        for name, _, b in lines
    )
    return {
        "anchor": f"chart{number}",
        "title": title,
        "height": CHART_HEIGHT,
        "x": {"label": x[1], "unit": unit_a, "log": False},
        "y": {"label": y[1], "unit": unit_b, "log": False},
        "told": f"{y[1].capitalize()} [{unit_b}] over {x[1]}: {peaks}.",
        "marks": [
            make_mark(
                "dots" if x[0] == "level_drive" else "line",
                colour,
                name,
                x=a * scale_a,
                y=b * scale_b,
            )
            for colour, (name, a, b) in zip(COLOURS * len(lines), lines)
        ],
    }


def _axis_unit(arrays: list, unit: str) -> tuple:
    """Choose unit and scale of an axis for several arrays [SI]."""
    if unit in UNIT_LADDERS:
        return choose_axis_unit(np.concatenate(arrays), unit)
    return unit, 1.0


def drive_period(run: FinishedRun) -> float | None:
    """Return the period [s] of the sine that excites a run, or None if there is none."""
    number_with_unit = NUMBER_PATTERN.match(str(run.resolved.get("drive", {}).get("frequency", "")))
    return (
        1 / float(number_with_unit[1])
        if number_with_unit and float(number_with_unit[1]) > 0
        else None
    )


def _select_last_cycles(run: FinishedRun) -> np.ndarray:
    """Return a mask of the samples in the last cycles of a sinusoidal drive signal.

    Without a sine it is the last tenth of the run; on a bench all samples.
    """
    time = run.arrays["time"][0]
    period = drive_period(run)
    span = N_SHOWN_CYCLES * period if period else np.ptp(time) / 10
    if run.summary["kind"] == "bench":
        span = np.ptp(time)
    return time >= time[-1] - span * (1 + 1e-9)


def _flatten_tables(table, prefix: str = "") -> dict:
    """Flatten nested scene tables to a dict of dotted keys.

    Entries of lists are named by their name or number.
    """
    if isinstance(table, dict):
        pairs = table.items()
    elif isinstance(table, list) and table and isinstance(table[0], dict):
        pairs = [(entry.get("name", number), entry) for number, entry in enumerate(table, 1)]
    else:
        return {prefix: table}
    return {
        key: value
        for name, entry in pairs
        for key, value in _flatten_tables(
            entry, f"{prefix}.{name}" if prefix else str(name)
        ).items()
    }


def _differences_table(runs: list, names: list) -> str:
    """Return an HTML table of the scene keys in which runs differ."""
    flat_scenes = [_flatten_tables(run.resolved) for run in runs]
    keys = [
        key
        for key in dict.fromkeys(key for flat_scene in flat_scenes for key in flat_scene)
        if any(flat_scene.get(key) != flat_scenes[0].get(key) for flat_scene in flat_scenes)
    ]
    if not keys:
        return "<p>There is no difference: the resolved scenes are the same.</p>"
    rows = [
        [escape(key), *(_format_scene_value(flat_scene.get(key)) for flat_scene in flat_scenes)]
        for key in keys
    ]
    return (
        "<p class=soft>The table lists the keys whose values differ between the resolved scenes, in SI.</p>"
        + table_html(("key", *map(escape, names)), rows)
    )


def _format_scene_value(value) -> str:
    """Format a scene value as HTML, cut if it is long."""
    if value is None:
        return "&ndash;"
    if isinstance(value, float):
        return f"{value:.8g}"
    text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return escape(text if len(text) < 80 else text[:76] + " …")


def _measures_table(runs: list, names: list) -> str:
    """Return an HTML table of the measures of all runs.

    Values that differ from those of the first run by more than both errors are marked.
    """
    rows = []
    for name in dict.fromkeys(name for run in runs for name in run.summary["measures"]):
        measures = [run.summary["measures"].get(name) for run in runs]
        rows.append(
            [
                measure_link(measure_label(name), name),
                *(
                    _format_cell(name, measure, measures[0] if number else None)
                    for number, measure in enumerate(measures)
                ),
            ]
        )
    return (
        "<p class=soft>Each cell shows a value and its estimated numerical error. Bold values differ from the "
        "first run by more than the sum of both errors. The change from the first run is in brackets: in per "
        "cent; as a factor if the value is ten times the first value or more; as a dash if the first value is "
        "smaller than its error. A value in another unit than that of the first run is not compared.</p>"
        + table_html(("measure", *(f">{escape(name)}" for name in names)), rows, "across side")
    )


def _format_cell(name: str, measure: dict | None, first: dict | None) -> str:
    """Format a measure as a table cell with its change from the first run."""
    if measure is None or measure["value"] is None or not math.isfinite(measure["value"]):
        return "&ndash;"
    text = escape(format_with_error(name, measure))
    alone = first is None or first["value"] is None or first["unit"] != measure["unit"]
    if alone or abs(measure["value"] - first["value"]) <= (measure["error"] or 0.0) + (
        first["error"] or 0.0
    ):
        return f"<span class=v>{text}</span>"
    return f"<b class=v>{text}</b> <span class=v>({_format_change(measure['value'], first)})</span>"


def _format_change(value: float, first: dict) -> str:
    """Format a change in percent, or as a factor if it is large.

    It is a dash if the first value is 0 within its error, because any ratio would then only depend
    on this error.
    """
    if abs(first["value"]) <= (first["error"] or 0.0):
        return "&ndash;"
    factor = value / first["value"]
    if abs(factor) < MIN_FACTOR:
        return f"{(value - first['value']) / abs(first['value']):+.2%}"
    return f"&times; {float(f'{factor:.2g}'):.7g}"  # two digits without an exponent, such as 150
