"""Data of a chart: the curves or maps that a row of the table selects from answers, in display units."""

from dataclasses import replace

import numpy as np

from ...formatting import format_number, needs_log_scale
from ..answer import Answers, Variable, Variables
from .panel import Axis, Curve, Panel, join_names, make_axis, thin
from .table import Chart

MAX_MAP_COLUMNS = 400  # largest number of columns; a finer map keeps every n-th one
N_SHOWN_CYCLES = 3  # number of cycles of the span "cycles"
SWEEP_STYLES = ("relative", "menu", "maps", "shares")
MARGIN_NODES = 3  # unloaded nodes beside the contact that the span "contact" shows
MAX_INTERFACES = 6  # largest number of interfaces with charts of their own


def make_panels(answers: Answers, charts: tuple[Chart, ...]) -> list[Panel]:
    """Return the panels of all charts for which the answers have data.

    Parameters
    ----------
    answers : dict of str to Answer
        Answers by their name in the legend; one answer may have the name "".
    charts : tuple of Chart
        Rows of the table of charts, in the order of the page.
    """
    panels = []
    for chart in charts:
        for part in _repeat_for_interfaces(chart, next(iter(answers.values())).data):
            # answers whose variables have other units need axes of their own
            groups = {}
            for name, answer in answers.items():
                names = (_find_x(answer.data, part), *map(_split_name, part.y.split()))
                units = tuple(answer.data[one].unit for one in names if one in answer.data)
                groups.setdefault(units, {})[name] = answer
            panels += [make_panel(group, part) for group in groups.values()]
    return [panel for panel in panels if panel is not None]


def _repeat_for_interfaces(chart: Chart, data: Variables) -> list[Chart]:
    """Return a chart over x for each interface that has a patch of its own, with the variables x_1, x_2, ..."""
    numbers = [number for number in range(1, MAX_INTERFACES + 1) if f"x_{number}" in data]
    if chart.x != "x" or "x" in data or not numbers:
        return [chart]
    charts = []
    for number in numbers:
        part = f" ({data['interface'].values[number - 1]})" if len(numbers) > 1 else ""
        y = " ".join(f"{name}_{number}" for name in chart.y.split())
        charts.append(replace(chart, title=f"{chart.title}{part}", x=f"x_{number}", y=y))
    return charts


def make_panel(answers: Answers, chart: Chart) -> Panel | None:
    """Return the panel of a chart, or None if no answer has data for it."""
    if chart.style in SWEEP_STYLES:
        # only the page of a sweep loads this module
        from .sweeps import STYLES

        return STYLES[chart.style](answers, chart)
    has_several = len(answers) > 1
    if has_several:
        chart = replace(chart, by="")
    selected = {name: _select(answer.data, chart) for name, answer in answers.items()}
    selected = {name: data for name, data in selected.items() if data}
    if not selected or (chart.style == "map" and len(selected) > 1):  # maps cannot share a chart
        return None
    first = next(iter(selected.values()))
    axes = _make_axes(list(selected.values()), chart)
    if chart.style == "map":
        return _make_map(first, chart, axes)

    curves = []
    for number, (label, data) in enumerate(selected.items()):
        own_curves = [
            curve
            for name in f"{chart.y} {chart.lines}".split()
            for curve in _make_curves(data, chart, name, axes)
        ]
        if len(own_curves) == 1:
            own_curves = [replace(own_curves[0], name="")]
        if has_several:  # a colour for each answer, and a dash for each of its curves
            own_curves = [
                replace(curve, name=join_names(label, curve.name), colour=number, dash=dash)
                for dash, curve in enumerate(own_curves)
            ]
        curves += own_curves
    if not curves:
        return None
    marks = [
        float(value) * axes[0].scale
        for name in chart.marks.split()
        if name in first
        for value in np.atleast_1d(first[name].values)
        if np.isfinite(value)
    ]
    return Panel(chart.title, chart.style, *axes, curves, chart.caption, marks)


def _make_map(data: Variables, chart: Chart, axes: tuple[Axis, Axis]) -> Panel | None:
    """Return the panel of a variable over x and its first dimension; `axes` are those of x and of the variable."""
    variable = _reduce_strips(data[chart.y])
    if not np.isfinite(_as_floats(variable)).any():
        return None
    x_axis, colours = axes
    y_axis, rows = _find_map_rows(data, variable, x_axis)
    x = _as_floats(data[_find_x(data, chart)]) * x_axis.scale
    step = -(-x.size // MAX_MAP_COLUMNS)
    # codes keep their numbers
    scale = 1 if variable.meanings else colours.scale
    values = np.atleast_2d(variable.values)[:, ::step] * scale
    curve = Curve("", x[::step], values, rows=rows, meanings=variable.meanings)
    label = colours.label
    return Panel(chart.title, "map", x_axis, y_axis, [curve], chart.caption, colour_label=label)


def _make_axes(selected: list[Variables], chart: Chart) -> tuple[Axis, Axis]:
    """Return the horizontal and the vertical axis of a chart for the selected variables of each answer."""
    first = selected[0]
    x_name = _find_x(first, chart)
    x_values = [data[_find_x(data, chart)].values for data in selected]
    x_label = chart.x_label or x_name
    names = [name for name in map(_split_name, chart.y.split()) if name in first]
    main = first[names[0]]
    y_values = [data[name].values for data in selected for name in names if name in data]
    y_label = main.text if chart.y_label == "*" else chart.y_label or names[0]
    return (
        _make_axis(x_label, first[x_name].unit, x_values, chart.log, "x"),
        _make_axis(y_label, main.unit, y_values, chart.log, "y"),
    )


def _make_axis(name: str, unit: str, arrays: list[np.ndarray], log: str, letter: str) -> Axis:
    """Return the axis for some arrays [SI]; `log` as in Chart, `letter` is "x" or "y"."""
    values = np.concatenate([np.asarray(values, float).ravel() for values in arrays])
    is_log = letter in log or ("auto" in log and needs_log_scale(values))
    return make_axis(name, unit, values, is_log)


def _find_map_rows(data: Variables, variable: Variable, x_axis: Axis) -> tuple[Axis, np.ndarray]:
    """Return the vertical axis of a map and its positions: a coordinate y in the units of x, the time, or frames."""
    if variable.dims[0] == "y" and "y" in data:
        axis = replace(x_axis, label=x_axis.label.replace("x [", "y ["))
        return axis, data["y"].values * axis.scale
    if "frame_time" in data and len(variable.values) > 1:
        times = data["frame_time"].values - data["frame_time"].values[0]
        axis = make_axis("time in the last cycle", "s", times)
        return axis, times * axis.scale
    return Axis("frame"), np.arange(len(variable.values))


def _split_name(name: str) -> str:
    """Return the variable of "NAME@X"."""
    return name.partition("@")[0]


def _find_x(data: Variables, chart: Chart) -> str:
    """Return the first of the horizontal variables that the data has, or ""."""
    return next((name for name in chart.x.split() if name in data), "")


def _select(data: Variables, chart: Chart) -> Variables:
    """Return the variables restricted to the span of a chart; {} if the chart has nothing to show."""
    x_name = _find_x(data, chart)
    names = map(_split_name, chart.y.split())
    if not x_name or not any(name in data and np.any(data[name].values) for name in names):
        return {}
    if chart.style == "line" and np.ptp(np.asarray(data[x_name].values, float)) == 0:
        return {}  # a single point, or a curve over another variable
    if chart.style == "map" and "frame_time" in data:
        # frame 0 is the pressed state; the slip rate of frame 1 would need an earlier frame of the motion
        data = _take(data, "frame", np.arange(2, data["frame_time"].values.size))
    keep = _find_span(data, chart.span, x_name)
    if keep is None:
        return data
    dimension = "time" if chart.span == "cycles" else x_name
    return _take(data, dimension, keep) if keep.size else {}


def _find_span(data: Variables, span: str, x_name: str) -> np.ndarray | None:
    """Return the indices of the span of a chart along `time` or `x`; None for the whole."""
    period = float(data["period"].values) if "period" in data else np.inf
    if span == "cycles" and np.isfinite(period):
        time = data["time"].values
        return np.flatnonzero(time >= time[-1] - N_SHOWN_CYCLES * period * (1 + 1e-6))
    if span == "run":
        # without more cycles the chart of the last cycles shows the whole run
        is_longer = np.ptp(data["time"].values) > (N_SHOWN_CYCLES + 0.5) * period
        return None if is_longer else np.arange(0)
    pressure = data.get("normal_stress" + x_name.removeprefix("x"))
    if span == "contact" and pressure is not None:
        is_loaded = (pressure.values > 0).any(axis=tuple(range(pressure.values.ndim - 1)))
        loaded = np.flatnonzero(is_loaded)
        if loaded.size:
            first = max(loaded[0] - MARGIN_NODES, 0)
            return np.arange(first, min(loaded[-1] + MARGIN_NODES + 1, is_loaded.size))
    return None


def _take(data: Variables, dimension: str, indices: np.ndarray) -> Variables:
    """Return the variables at some indices of a dimension; those without this dimension are unchanged."""
    taken = {}
    for name, one in data.items():
        if dimension in one.dims:
            values = np.take(one.values, indices, axis=one.dims.index(dimension))
            taken[name] = replace(one, values=values)
    return data | taken


def _make_curves(
    data: Variables, chart: Chart, source: str, axes: tuple[Axis, Axis]
) -> list[Curve]:
    """Return the curves of "NAME" or "NAME@X": one for each interface, case, code, or element of an overlay."""
    name, _, own_x = source.partition("@")
    own_x = own_x or _find_x(data, chart)
    if not {name, own_x} <= data.keys() or not np.isfinite(_as_floats(data[name])).any():
        return []
    x_axis, y_axis = axes
    x_values = _as_floats(data[own_x]) * x_axis.scale
    variable = _reduce_strips(data[name])
    values = _as_floats(variable)
    ends_of_band = _find_band(data, name)
    labels = [name.replace("_", " ")]
    first = variable.dims[0] if values.ndim == 2 else ""
    if first in ("interface", "case") or (first and chart.style == "overlay"):
        labels = _name_elements(data, first, labels[0])
    elif first:
        values = values[-1:]  # the last frame

    curves = []
    is_line = source in chart.lines.split()
    for number, (label, row) in enumerate(zip(labels, np.atleast_2d(values), strict=True)):
        # every case has points of its own
        keep = np.flatnonzero(np.isfinite(row)) if first == "case" else thin(row)
        ends = [np.atleast_2d(end)[number] for end in ends_of_band if first in ("case", "")]
        y, *ends = (one[keep] * y_axis.scale for one in (row, *ends))
        x_row = x_values[number] if x_values.ndim == 2 else x_values
        colour = number if first == "case" else -1
        band = ends or (None, None)
        curves.append(Curve(label, x_row[keep], y, *band, is_line=is_line, colour=colour))
        if chart.by in data and not (first or is_line):
            return _split_by_code(curves[0], data[chart.by], keep, chart.style != "points")
    return [curve for curve in curves if curve.x.size]


def _as_floats(variable: Variable) -> np.ndarray:
    """Return the values of a variable as floats."""
    return np.asarray(variable.values, float)


def _reduce_strips(variable: Variable) -> Variable:
    """Return the mean of a variable over its strips."""
    if "strip" not in variable.dims:
        return variable
    axis = variable.dims.index("strip")
    dims = tuple(dimension for dimension in variable.dims if dimension != "strip")
    return replace(variable, dims=dims, values=np.mean(variable.values, axis=axis))


def _name_elements(data: Variables, dimension: str, label: str) -> list[str]:
    """Return the legend of the elements of a dimension: the values of its coordinate, or their numbers.

    `label` is the name of the variable in words.
    """
    coordinate = data.get(dimension)
    if coordinate is None:
        places = ((one.dims, one.values.shape) for one in data.values() if dimension in one.dims)
        dims, shape = next(places)
        start = int(dimension == "interface")
        names = [str(k + start) for k in range(shape[dims.index(dimension)])]
    elif coordinate.values.dtype.kind in "UO":
        names = [str(value) for value in coordinate.values]
    else:
        title = coordinate.text or dimension.replace("_", " ")
        names = [f"{title} {format_number(float(value), 4)}" for value in coordinate.values]
    if dimension == "interface":
        return [join_names(label, f"interface {name}") for name in names]
    if dimension == "case":  # the last part of the key, such as "load 4 kN"
        key = coordinate.text.rpartition(".")[2].replace("_", " ")
        return [f"{key} {name}" for name in names]
    return names


def _find_band(data: Variables, name: str) -> tuple[np.ndarray, ...]:
    """Return both ends [SI] of the error band of a variable; () without one."""
    if {f"{name}_low", f"{name}_high"} <= data.keys():
        return _as_floats(data[f"{name}_low"]), _as_floats(data[f"{name}_high"])
    if f"{name}_error" not in data:
        return ()
    values = _as_floats(data[name])
    error = _as_floats(data[f"{name}_error"])
    # an error as large as the value, as at a fold, would only hide the curve
    error = np.where(error <= np.abs(values), error, np.nan)
    return values - error, values + error


def _split_by_code(curve: Curve, codes: Variable, keep: np.ndarray, is_joined: bool) -> list[Curve]:
    """Return a curve for each code; points of other codes are missing in it, so that its line is interrupted."""
    numbers = np.asarray(codes.values)[keep]
    curves = []
    for code in np.unique(numbers):
        is_shown = numbers == code
        if is_joined:  # the line to the next point belongs to the code of its start
            is_shown |= np.concatenate([[False], is_shown[:-1]])
        parts = {
            part: None if values is None else np.where(is_shown, values, np.nan)
            for part, values in (("y", curve.y), ("low", curve.low), ("high", curve.high))
        }
        name = codes.meanings[int(code)] if codes.meanings else str(code)
        curves.append(replace(curve, name=name, **parts))
    return curves


def make_film(frames: dict[str, np.ndarray], title: str, unit: str) -> Panel:
    """Return the panel of a map that changes over time.

    Parameters
    ----------
    frames : dict
        `x` (k,) and `y` (j,) [m], `times` (f,) [s], `values` (f, j, k).
    title : str
        Title of the chart, and name of the values.
    unit : str
        SI unit of the values.
    """
    positions = np.concatenate([frames["x"], frames["y"]])
    x_axis = make_axis("x", "m", positions)
    y_axis = make_axis("y", "m", positions)
    colours = make_axis(title, unit, frames["values"])
    times = make_axis("time", "s", frames["times"])
    curves = [
        Curve(
            name=f"{format_number(float(time) * times.scale, 5)} {times.unit}",
            x=frames["x"] * x_axis.scale,
            y=values * colours.scale,
            rows=frames["y"] * y_axis.scale,
        )
        for time, values in zip(frames["times"], frames["values"], strict=True)
    ]
    caption = "The colours are the same in all frames; the interface is at y = 0."
    return Panel(title, "film", x_axis, y_axis, curves, caption, colour_label=colours.unit)
