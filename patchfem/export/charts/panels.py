"""Data of a chart: the curves or maps that a row of the table selects from answers, in display units."""

from dataclasses import replace

import numpy as np

from ...formatting import format_number, needs_log_scale
from ..answer import Answer, Variable
from .panel import Axis, Curve, Panel, join_names, make_axis, thin
from .table import Chart

MAX_MAP_COLUMNS = 400  # largest number of columns; a finer map keeps every n-th one
N_SHOWN_CYCLES = 3  # number of cycles of the span "cycles"
SWEEP_STYLES = ("relative", "menu", "maps", "shares")
MARGIN_NODES = 3  # unloaded nodes beside the contact that the span "contact" shows
MAX_INTERFACES = 6  # largest number of interfaces with charts of their own


def make_panels(answers: dict[str, Answer], charts: tuple[Chart, ...]) -> list[Panel]:
    """Return the panels of all charts for which the answers have data.

    Parameters
    ----------
    answers : dict of str to Answer
        Answers by their name in the legend; one answer may have the name "".
    charts : tuple of Chart
    """
    first_data = next(iter(answers.values())).data
    all_charts = [part for chart in charts for part in _repeat_for_interfaces(chart, first_data)]
    panels = [
        make_panel(group, chart)
        for chart in all_charts
        for group in _group_by_units(answers, chart)
    ]
    return [panel for panel in panels if panel is not None]


def _group_by_units(answers: dict[str, Answer], chart: Chart) -> list[dict[str, Answer]]:
    """Return groups of answers whose variables have the same units, so that they can share the axes of a chart."""
    groups = {}
    for name, answer in answers.items():
        data = answer.data
        y_units = {data[part].unit for part in (_split_name(y)[0] for y in chart.y) if part in data}
        x_name = _find_x(data, chart)
        x_unit = data[x_name].unit if x_name else ""
        groups.setdefault((x_unit, frozenset(y_units)), {})[name] = answer
    return list(groups.values())


def _repeat_for_interfaces(chart: Chart, data: dict[str, Variable]) -> list[Chart]:
    """Return a chart over x for each interface that has a patch of its own, with the variables x_1, x_2, ..."""
    numbers = [number for number in range(1, MAX_INTERFACES + 1) if f"x_{number}" in data]
    names = data["interface"].values if "interface" in data else ()
    if chart.x != "x" or "x" in data or not numbers:
        return [chart]
    return [
        replace(
            chart,
            title=f"{chart.title} ({names[number - 1]})" if len(numbers) > 1 else chart.title,
            x=f"x_{number}",
            y=tuple(f"{name}_{number}" for name in chart.y),
        )
        for number in numbers
    ]


def make_panel(answers: dict[str, Answer], chart: Chart) -> Panel | None:
    """Return the panel of a chart, or None if no answer has data for it."""
    if len(answers) > 1:
        chart = replace(chart, by="")
    if chart.style in SWEEP_STYLES:
        # only the page of a sweep loads this module
        from .sweeps import STYLES

        return STYLES[chart.style](answers, chart)
    selections = {name: _select(answer.data, chart) for name, answer in answers.items()}
    selections = {name: data for name, data in selections.items() if data}
    if not selections:
        return None
    if chart.style == "map" and len(selections) > 1:
        return None  # maps of several runs cannot share one chart

    x_name = _find_x(next(iter(selections.values())), chart)
    first_data = next(iter(selections.values()))
    x_axis = _make_axis(
        chart.labels[0] or x_name,
        first_data[x_name].unit,
        [data[_find_x(data, chart)].values for data in selections.values()],
        chart.log,
        "x",
    )
    main = [_split_name(name)[0] for name in chart.y if _split_name(name)[0] in first_data]
    y_values = [data[name].values for data in selections.values() for name in main if name in data]
    y_label = chart.labels[1] or main[0]
    if y_label == "*":
        y_label = first_data[main[0]].text
    y_axis = _make_axis(y_label, first_data[main[0]].unit, y_values, chart.log, "y")
    second_axis = None
    # of several cases only the first axis is drawn, so that each case is one curve
    second = [name for name in chart.y2 if name in first_data and "case" not in first_data]
    if second:
        second_axis = _make_axis(
            second[0], first_data[second[0]].unit, [first_data[second[0]].values], chart.log, "y"
        )

    curves = []
    for number, (label, data) in enumerate(selections.items()):
        own_curves = []
        for name in (*chart.y, *chart.lines, *second):
            axis = second_axis if name in second else y_axis
            roles = {"on_second_axis": name in second, "is_line": name in chart.lines}
            own_curves += [
                replace(curve, **roles)
                for curve in _make_curves(data, chart, name, (x_axis, axis))
                if curve.x.size
            ]
        if len(own_curves) == 1 and not second:
            own_curves = [replace(own_curves[0], name="")]
        if len(answers) > 1:  # a colour for each answer, and a dash for each of its curves
            own_curves = [
                replace(curve, name=join_names(label, curve.name), colour=number, dash=dash)
                for dash, curve in enumerate(own_curves)
            ]
        curves += own_curves
    if not curves:
        return None
    return _finish(
        chart, Panel(chart.title, chart.style, x_axis, y_axis, curves), first_data, second_axis
    )


def _finish(chart: Chart, panel: Panel, data: dict, second_axis: Axis | None) -> Panel:
    """Add marks, caption and the colour axis of a map to a panel."""
    marks = [
        float(value) * panel.x.scale
        for name in chart.marks
        if name in data
        for value in np.atleast_1d(data[name].values)
        if np.isfinite(value)
    ]
    panel = replace(panel, marks=marks, caption=chart.caption, y2=second_axis)
    if chart.style == "map":
        axis, _ = _find_map_rows(data, _reduce_strips(data[chart.y[0]]), panel.x)
        return replace(panel, y=axis, colour_label=panel.y.label)
    return panel


def _find_map_rows(
    data: dict[str, Variable], variable: Variable, x_axis: Axis
) -> tuple[Axis, np.ndarray]:
    """Return the vertical axis of a map and its positions: a coordinate y in the units of x, the time, or frames."""
    if variable.dims[0] == "y" and "y" in data:
        label = x_axis.label.replace("x [", "y [")
        return Axis(label, x_axis.scale), data["y"].values * x_axis.scale
    if "frame_time" in data and len(variable.values) > 1:
        times = data["frame_time"].values - data["frame_time"].values[0]
        axis = _make_axis("time in the last cycle", "s", [times], "", "y")
        return axis, times * axis.scale
    return Axis("frame"), np.arange(len(variable.values))


def _split_name(name: str) -> tuple[str, str]:
    """Return the variable and its own horizontal variable of "NAME@X"; "" for none."""
    variable, _, x_name = name.partition("@")
    return variable, x_name


def _find_x(data: dict[str, Variable], chart: Chart) -> str:
    """Return the first of the horizontal variables that the data has, or ""."""
    return next((name for name in chart.x.split() if name in data), "")


def _select(data: dict[str, Variable], chart: Chart) -> dict[str, Variable]:
    """Return the variables restricted to the span of a chart; {} if the chart has nothing to show."""
    x_name = _find_x(data, chart)
    names = [_split_name(name)[0] for name in chart.y]
    shown = [name for name in names if name in data and np.any(data[name].values)]
    if not x_name or not shown:
        return {}
    if chart.style == "line" and np.ptp(np.asarray(data[x_name].values, float)) == 0:
        return {}  # a single point, or a curve over another variable
    if chart.style == "map" and "frame_time" in data:
        # frame 0 is the pressed state; the slip rate of frame 1 would need an earlier frame of the motion
        motion = np.arange(2, data["frame_time"].values.size)
        data = {name: _take(variable, "frame", motion) for name, variable in data.items()}
    keep = _find_span(data, chart, x_name)
    if keep is None:
        return data
    if not keep.size:
        return {}
    dimension = "time" if chart.span == "cycles" else x_name
    return {name: _take(variable, dimension, keep) for name, variable in data.items()}


def _find_span(data: dict[str, Variable], chart: Chart, x_name: str) -> np.ndarray | None:
    """Return the indices of the span of a chart along `time` or `x`; None for the whole."""
    pressure_name = "normal_stress" + x_name.removeprefix("x")
    if chart.span == "cycles" and "period" in data:
        time = data["time"].values
        start = time[-1] - N_SHOWN_CYCLES * float(data["period"].values) * (1 + 1e-6)
        return np.flatnonzero(time >= start)
    if chart.span == "run":
        # without more cycles the chart of the last cycles shows the whole run
        period = float(data["period"].values) if "period" in data else np.inf
        is_longer = np.ptp(data["time"].values) > (N_SHOWN_CYCLES + 0.5) * period
        return None if is_longer else np.arange(0)
    if chart.span == "contact" and pressure_name in data:
        pressure = data[pressure_name].values
        loaded = np.flatnonzero((pressure > 0).any(axis=tuple(range(pressure.ndim - 1))))
        if loaded.size:
            first = max(loaded[0] - MARGIN_NODES, 0)
            return np.arange(first, min(loaded[-1] + MARGIN_NODES + 1, pressure.shape[-1]))
    return None


def _take(variable: Variable, dimension: str, indices: np.ndarray) -> Variable:
    """Return the part of a variable at some indices of a dimension; unchanged without this dimension."""
    if dimension not in variable.dims:
        return variable
    values = np.take(variable.values, indices, axis=variable.dims.index(dimension))
    return replace(variable, values=values)


def _make_axis(name: str, unit: str, arrays: list, log: str, letter: str) -> Axis:
    """Return the axis for some arrays [SI]; `log` and `letter` as in Chart."""
    values = np.concatenate([np.asarray(values, float).ravel() for values in arrays])
    is_log = letter in log or ("auto" in log and needs_log_scale(values))
    return make_axis(name, unit, values, is_log)


def _make_curves(data: dict[str, Variable], chart: Chart, name: str, axes: tuple) -> list[Curve]:
    """Return the curves of one variable: one for each interface, code, or element of the first dimension."""
    is_line = name in chart.lines
    name, own_x = _split_name(name)
    if (
        name not in data
        or (own_x and own_x not in data)
        or not np.any(np.isfinite(np.asarray(data[name].values, float)))
    ):
        return []
    x_axis, y_axis = axes
    x_variable = data[own_x or _find_x(data, chart)]
    x_values = np.asarray(x_variable.values, float) * x_axis.scale
    variable = _reduce_strips(data[name])
    if chart.style == "map":
        rows = _find_map_rows(data, variable, x_axis)[1]
        return [_make_map(variable, x_values, y_axis, rows)]

    label = name.replace("_", " ")
    rows = [(label, x_values, np.asarray(variable.values, float))]
    first = variable.dims[0] if variable.dims else ""
    if variable.values.ndim == 2 and first == "interface":
        names = (
            data["interface"].values if "interface" in data else range(1, len(variable.values) + 1)
        )
        x_rows = x_values if x_values.ndim == 2 else [x_values] * len(variable.values)
        rows = [
            (join_names(label, f"interface {interface}"), x_row, values)
            for interface, x_row, values in zip(names, x_rows, variable.values, strict=True)
        ]
    elif variable.values.ndim == 2 and chart.style == "overlay":
        rows = [
            (text, x_values, values)
            for text, values in zip(_name_elements(data, first), variable.values, strict=True)
        ]
    elif variable.values.ndim == 2 and first == "case":
        return _make_case_curves(data, name, x_values, y_axis)
    elif variable.values.ndim == 2:
        rows = [(label, x_values, variable.values[-1])]  # the last frame

    low, high = _find_band(data, name)
    curves = []
    for text, x_row, values in rows:
        keep = thin(values)
        band = [
            None if end is None or end.shape != values.shape else (end * y_axis.scale)[keep]
            for end in (low, high)
        ]
        curves.append(Curve(text, x_row[keep], (values * y_axis.scale)[keep], *band))
    if chart.by in data and len(curves) == 1 and not is_line:
        is_joined = chart.style != "points"
        return _split_by_code(curves[0], data[chart.by], thin(rows[0][2]), is_joined)
    return curves


def _make_case_curves(
    data: dict[str, Variable], name: str, x_values: np.ndarray, y_axis: Axis
) -> list[Curve]:
    """Return a curve with its band for each case of a variable (case, x), without its missing points."""
    # the legend has the last part of the key: "load 4 kN"
    key = data["case"].text.rpartition(".")[2].replace("_", " ")
    names = [f"{key} {value}" for value in data["case"].values]
    low, high = _find_band(data, name)
    curves = []
    for number, values in enumerate(data[name].values):
        keep = np.isfinite(values)
        scaled = [
            None if end is None else end[number, keep] * y_axis.scale
            for end in (data[name].values, low, high)
        ]
        curves.append(Curve(names[number], x_values[keep], *scaled, colour=number))
    return curves


def _reduce_strips(variable: Variable) -> Variable:
    """Return the mean of a variable over its strips."""
    if "strip" not in variable.dims:
        return variable
    axis = variable.dims.index("strip")
    dims = tuple(dimension for dimension in variable.dims if dimension != "strip")
    return replace(variable, dims=dims, values=np.mean(variable.values, axis=axis))


def _name_elements(data: dict[str, Variable], dimension: str) -> list[str]:
    """Return the legend of the elements of a dimension: the values of its coordinate, or their numbers."""
    size = next(
        v.values.shape[v.dims.index(dimension)] for v in data.values() if dimension in v.dims
    )
    coordinate = data.get(dimension)
    if coordinate is None:
        return [str(k) for k in range(size)]
    if coordinate.values.dtype.kind in "UO":
        return [str(value) for value in coordinate.values]
    label = coordinate.text or dimension.replace("_", " ")
    return [f"{label} {format_number(float(value), 4)}" for value in coordinate.values]


def _find_band(data: dict[str, Variable], name: str) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the ends [SI] of the error band of a variable, None without one."""
    values = np.asarray(data[name].values, float)
    if f"{name}_low" in data and f"{name}_high" in data:
        return tuple(np.asarray(data[f"{name}_{end}"].values, float) for end in ("low", "high"))
    if f"{name}_error" in data:
        error = np.asarray(data[f"{name}_error"].values, float)
        # an error as large as the value, as at a fold, would only hide the curve
        error = np.where(error <= np.abs(values), error, np.nan)
        return values - error, values + error
    return None, None


def _split_by_code(curve: Curve, codes: Variable, keep: np.ndarray, is_joined: bool) -> list[Curve]:
    """Return a curve for each code; points of other codes are missing in it, so that its line is interrupted."""
    numbers = np.asarray(codes.values)[keep]
    curves = []
    for code in np.unique(numbers):
        is_code = numbers == code
        is_shown = is_code
        if is_joined:  # the line to the next point belongs to the code of its start
            is_shown = is_code | np.concatenate([[False], is_code[:-1]])
        parts = [
            None if values is None else np.where(is_shown, values, np.nan)
            for values in (curve.y, curve.low, curve.high)
        ]
        name = codes.meanings[int(code)] if codes.meanings else str(code)
        curves.append(replace(curve, name=name, y=parts[0], low=parts[1], high=parts[2]))
    return curves


def _make_map(variable: Variable, x_values: np.ndarray, axis: Axis, rows: np.ndarray) -> Curve:
    """Return the colours of a map at vertical positions `rows`; codes keep their numbers."""
    step = -(-x_values.size // MAX_MAP_COLUMNS)
    values = np.atleast_2d(variable.values)[:, ::step]
    meanings = variable.meanings
    if not meanings:
        values = values * axis.scale
    return Curve("", x_values[::step], values, rows=rows, meanings=meanings)


def make_film(frames: dict[str, np.ndarray], title: str, unit: str) -> Panel:
    """Return the panel of a map that changes over time.

    Parameters
    ----------
    frames : dict
        `x` (k,) and `y` (j,) [m], `times` (f,) [s], `values` (f, j, k).
    title : str
    unit : str
        SI unit of the values.
    """
    positions = np.concatenate([frames["x"], frames["y"]])
    x_axis = make_axis("x", "m", positions)
    y_axis = make_axis("y", "m", positions)
    colours = make_axis(title, unit, frames["values"])
    times = make_axis("time", "s", frames["times"])
    time_unit = times.label.partition("[")[2].rstrip("]")
    curves = [
        Curve(
            name=f"{format_number(float(time) * times.scale, 5)} {time_unit}",
            x=frames["x"] * x_axis.scale,
            y=values * colours.scale,
            rows=frames["y"] * y_axis.scale,
        )
        for time, values in zip(frames["times"], frames["values"], strict=True)
    ]
    caption = "The colours are the same in all frames; the interface is at y = 0."
    label = colours.label.partition("[")[2].rstrip("]")
    return Panel(title, "film", x_axis, y_axis, curves, caption, colour_label=label)
