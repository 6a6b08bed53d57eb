"""Data of a chart: the curves or maps that a row of the table selects from answers, in display units."""

from dataclasses import replace

import numpy as np

from ...formatting import format_number, needs_log_scale
from ..answer import Answers, Variable, Variables
from ..rows import Chart
from .panel import Axis, Curve, Panel, add_choices, join_names, make_axis, select_curve_points

N_SHOWN_CYCLES = 3  # number of cycles of the span "cycles"
BOLD_CURVE_WEIGHT = 1.8  # width of a recommended curve over the usual one
THIN_CURVE_WEIGHT = 0.6  # width of the other curves of its chart over the usual one
SWEEP_CHART_STYLES = ("relative", "menu", "maps")
N_MARGIN_NODES = 3  # unloaded nodes beside the contact that the span "contact" shows


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
        if len(answers) > 1 and chart.y == "curve_amplitude" and chart.x == "curve_frequency":
            panels.append(_make_curve_menu(answers, chart))
            continue
        for part in _repeat_for_interfaces(chart, next(iter(answers.values())).data):
            # answers whose variables have other units need axes of their own
            groups = {}
            for name, answer in answers.items():
                names = (_find_x(answer.data, part), *(y for y, _ in _split_names(part.y)))
                units = tuple(answer.data[one].unit for one in names if one in answer.data)
                groups.setdefault(units, {})[name] = answer
            panels += [make_panel(group, part) for group in groups.values()]
    return [panel for panel in panels if panel is not None]


def _repeat_for_interfaces(chart: Chart, data: Variables) -> list[Chart]:
    """Return a chart over x for each interface that has a patch of its own, with the variables x_1, x_2, ..."""
    # Largest number of interfaces with charts of their own
    numbers = [number for number in range(1, 6 + 1) if f"x_{number}" in data]
    if chart.x != "x" or "x" in data or not numbers:
        return [chart]
    charts = []
    for number in numbers:
        part = f" ({data['interface'].values[number - 1]})" if len(numbers) > 1 else ""
        y = " ".join(f"{name}_{number}" for name in chart.y.split())
        charts.append(replace(chart, title=f"{chart.title}{part}", x=f"x_{number}", y=y))
    return charts


def _make_curve_menu(answers: Answers, chart: Chart) -> Panel | None:
    """Return the response curves of several answers: a menu of amplitude and, under forces, compliance.

    Compliances of a linear structure coincide, so that curves that differ show the effect of the level.
    """
    titles = {"curve_amplitude": "amplitude", "curve_compliance": "compliance (amplitude / force)"}
    charts = [replace(chart, y=name, title=title) for name, title in titles.items()]
    panels = [make_panel(answers, choice) for choice in charts]
    known = [panel for panel in panels if panel is not None]
    return add_choices(replace(chart, style="menu"), known)


def make_panel(answers: Answers, chart: Chart) -> Panel | None:
    """Return the panel of a chart, or None if no answer has data for it."""
    if chart.style in SWEEP_CHART_STYLES:
        # only the page of a sweep loads this module
        from .sweeps import STYLE_FUNCTIONS

        return STYLE_FUNCTIONS[chart.style](answers, chart)
    if len(answers) > 1:
        # response curves of several drive levels are compared at all their heights
        log = "y" if chart.x == "curve_frequency" else chart.log
        chart = replace(chart, by="", log=log)
    selected = {}
    for name, answer in answers.items():
        selected[name] = _select_span(_reduce_faces(answer.data, chart), chart)
    drawn_fields = [answer.data.get(chart.y) for answer in answers.values()]
    if chart.style == "face":
        chart = replace(chart, style="map")
    elif chart.style != "map" and any(map(_is_over_face, drawn_fields)):
        caption = chart.caption.replace("the elements beside a node", "cells")
        chart = replace(chart, title=f"{chart.title}, cut at y = 0", caption=caption)
    selected = {name: data for name, data in selected.items() if data}
    if not selected or (chart.style == "map" and len(selected) > 1):  # maps cannot share a chart
        return None
    first = next(iter(selected.values()))
    if chart.style == "line" and first[_find_x(first, chart)].values.size == 1:
        chart = replace(chart, style="points")  # a line through a single point is not visible
    axes = _make_axes(list(selected.values()), chart)
    if chart.style == "map":
        return _make_map(first, chart, *axes)

    curves = []
    for label, data in selected.items():
        panel_curves = []
        for names in (chart.y, chart.lines):
            for name, own_x in _split_names(names):
                drawn = _make_curves(data, chart, name, own_x, axes)
                weight = 1.0
                if chart.thin:
                    weight = THIN_CURVE_WEIGHT if name in chart.thin.split() else BOLD_CURVE_WEIGHT
                drawing = {"is_line": names is chart.lines, "weight": weight}
                panel_curves += [replace(curve, **drawing) for curve in drawn]
        for curve in panel_curves:
            name = join_names(label, curve.name if len(panel_curves) > 1 else "")
            curves.append(replace(curve, name=name))
    marks = [_as_floats(first[name]).ravel() for name in chart.marks.split() if name in first]
    marks = np.concatenate([*marks, np.zeros(0)]) * axes[0].scale
    marks = marks[np.isfinite(marks)].tolist()
    return Panel(chart.title, chart.style, *axes, curves, chart.caption, marks) if curves else None


def _is_over_face(variable: Variable | None) -> bool:
    """Return whether the last dimensions of a variable are y and x, as those of fields over a face; False for None."""
    across = () if variable is None else variable.dims[-2:-1]
    return bool(across) and across[0].partition("_")[0] == "y"


def _reduce_faces(data: Variables, chart: Chart) -> Variables:
    """Return the variables with fields over a face as a chart shows them.

    They are the last frame for style "face", which shows no other fields, and the cut at y = 0 for lines. Maps over x and
    frames leave them out.
    """
    shown = {}
    for name, variable in data.items():
        values = variable.values
        if not _is_over_face(variable):
            if chart.style != "face" or name != chart.y:
                shown[name] = variable
        elif chart.style == "face":
            last = values.reshape(-1, *values.shape[-2:])[-1]
            shown[name] = replace(variable, dims=variable.dims[-2:], values=last)
        elif chart.style != "map":
            # An even number of rows has no row in the middle.
            last = values.shape[-2] // 2
            rows = values[..., [(values.shape[-2] - 1) // 2, last], :]
            dims = (*variable.dims[:-2], variable.dims[-1])
            shown[name] = replace(variable, dims=dims, values=rows.mean(axis=-2))
        elif values.ndim == 2:
            shown[name] = variable
    return shown


def _split_names(names: str) -> list[tuple[str, str]]:
    """Return (variable, horizontal variable) for each name in a text such as "NAME NAME@X"; "" without @X."""
    return [(name, x) for name, _, x in (word.partition("@") for word in names.split())]


def _find_x(data: Variables, chart: Chart) -> str:
    """Return the first horizontal variable in the list of a chart that the data contain, or ""."""
    return next((name for name in chart.x.split() if name in data), "")


def _as_floats(variable: Variable) -> np.ndarray:
    """Return the values of a variable as floats."""
    return np.asarray(variable.values, float)


def _make_axes(selected: list[Variables], chart: Chart) -> tuple[Axis, Axis]:
    """Return the horizontal and the vertical axis of a chart for the selected variables of each answer."""
    first = selected[0]
    x_name = _find_x(first, chart)
    names = [name for name, _ in _split_names(chart.y) if name in first]
    main = first[names[0]]
    y_label = main.text if chart.y_label == "*" else chart.y_label or names[0]
    axes = []
    for letter, label, unit, shown in (
        ("x", chart.x_label or x_name, first[x_name].unit, [x_name]),
        ("y", y_label, main.unit, names),
    ):
        arrays = [data[one].values for data in selected for one in shown if one in data]
        values = np.concatenate([np.asarray(one, float).ravel() for one in arrays])
        is_log = letter in chart.log or ("auto" in chart.log and needs_log_scale(values))
        axes.append(make_axis(label, unit, values, is_log))
    return axes[0], axes[1]


def _select_span(data: Variables, chart: Chart) -> Variables:
    """Return the variables restricted to the span of a chart; {} if the chart has nothing to show."""
    x_name = _find_x(data, chart)
    names = [name for name, _ in _split_names(chart.y)]
    if not x_name or not any(name in data and np.any(data[name].values) for name in names):
        return {}
    x_values = np.asarray(data[x_name].values, float)
    if chart.style == "line" and x_values.size > 1 and np.ptp(x_values) == 0:
        return {}  # a curve over another variable
    if chart.style == "map" and "frame_time" in data:
        # frame 0 is the pressed state; the slip rate of frame 1 would need an earlier frame of the motion
        data = _take_indices(data, "frame", np.arange(2, data["frame_time"].values.size))
    keep = _find_span(data, chart.span, x_name)
    if keep is None:
        return data
    dimension = "time" if chart.span == "cycles" else x_name
    return _take_indices(data, dimension, keep) if keep.size else {}


def _find_span(data: Variables, span: str, x_name: str) -> np.ndarray | None:
    """Return the indices of the span of a chart along `time` or `x`, or None for the whole of it.

    `data` are the variables of an answer, `span` is as in `rows.Chart`, and `x_name` names the horizontal variable.
    """
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
        size = pressure.values.shape[-1]
        loaded = np.flatnonzero((pressure.values.reshape(-1, size) > 0).any(axis=0))
        if loaded.size:
            first = max(loaded[0] - N_MARGIN_NODES, 0)
            return np.arange(first, min(loaded[-1] + N_MARGIN_NODES + 1, size))
    return None


def _take_indices(data: Variables, dimension: str, indices: np.ndarray) -> Variables:
    """Return the variables at some indices along a dimension.

    Variables without this dimension are unchanged.
    """
    taken = {
        name: replace(
            variable, values=np.take(variable.values, indices, axis=variable.dims.index(dimension))
        )
        for name, variable in data.items()
        if dimension in variable.dims
    }
    return data | taken


def _make_curves(
    data: Variables, chart: Chart, name: str, own_x_name: str, axes: tuple[Axis, Axis]
) -> list[Curve]:
    """Return the curves of a variable: one for each interface, case, code, or element of an overlay.

    `name` is the variable, and `own_x_name` that against which it is drawn, or "" for the horizontal variable of the chart.
    The scales of `axes`, the horizontal and the vertical one, apply.
    """
    own_x_name = own_x_name or _find_x(data, chart)
    if not {name, own_x_name} <= data.keys() or not np.isfinite(_as_floats(data[name])).any():
        return []
    x_values = _as_floats(data[own_x_name]) * axes[0].scale
    values = _as_floats(data[name])
    bands = _find_band(data, name)
    # All lines of such a chart are of the wear, so that a legend omits the prefix of their names, as in wear_worn_depth_max.
    labels = [name.removeprefix("wear_").replace("_", " ")]
    first = data[name].dims[0] if values.ndim == 2 else ""
    if first in ("interface", "case"):
        labels = [join_names(labels[0], element) for element in _name_elements(data, first)]
    elif first and chart.style == "overlay":
        labels = _name_elements(data, first)
    elif first:
        values = values[-1:]  # the last frame
        bands = [band[-1:] for band in bands]

    curves = []
    for number, (label, row) in enumerate(zip(labels, np.atleast_2d(values), strict=True)):
        x = x_values[number] if x_values.ndim == 2 else x_values
        # every case has points of its own
        keep = np.flatnonzero(np.isfinite(row)) if first == "case" else select_curve_points(row)
        parts = (row, *(np.atleast_2d(band)[number] for band in bands))
        curves.append(Curve(label, x[keep], *(one[keep] * axes[1].scale for one in parts)))
        if chart.by in data and not first and name == chart.y.split()[0]:
            return _split_by_code(curves[0], data[chart.by], keep, chart.style != "points")
    return [curve for curve in curves if curve.x.size]


def _name_elements(data: Variables, dimension: str) -> list[str]:
    """Return the legend of the elements of a dimension: the values of its coordinate, or their numbers."""
    coordinate = data.get(dimension)
    if coordinate is None:
        variable = next(variable for variable in data.values() if dimension in variable.dims)
        size = variable.values.shape[variable.dims.index(dimension)]
        return [f"{dimension} {number}" for number in range(1, size + 1)]
    # the last part of a key, such as "load 4 kN"
    title = coordinate.text.rpartition(".")[2].replace("_", " ") or dimension.replace("_", " ")
    values = coordinate.values.tolist()
    if coordinate.values.dtype.kind in "UO":
        return [f"{dimension if dimension == 'interface' else title} {value}" for value in values]
    return [f"{title} {format_number(float(value), 4)}" for value in values]


def _find_band(data: Variables, name: str) -> list[np.ndarray]:
    """Return both ends [SI] of the error band of a variable; [] without one."""
    ends = [f"{name}_low", f"{name}_high"]
    if data.keys() >= set(ends):
        return [_as_floats(data[end]) for end in ends]
    if f"{name}_error" not in data:
        return []
    values = _as_floats(data[name])
    error = _as_floats(data[f"{name}_error"])
    # an error as large as the value, as at a fold, would only hide the curve
    error = np.where(error <= np.abs(values), error, np.nan)
    return [values - error, values + error]


def _split_by_code(curve: Curve, codes: Variable, keep: np.ndarray, is_joined: bool) -> list[Curve]:
    """Return a curve for each code, in which the points of other codes are missing.

    This interrupts its line. `curve` has all shown points, `codes` is the variable with the code of each point, and
    `keep` has the indices of the shown points in it. `is_joined` tells whether a line joins the points.
    """
    numbers = np.asarray(codes.values)[keep]
    curves = []
    for code in np.unique(numbers):
        is_shown = numbers == code
        if is_joined:  # the line to the next point belongs to the code of its start
            is_shown |= np.concatenate([[False], is_shown[:-1]])
        hidden = np.where(is_shown, 0.0, np.nan)
        parts = {part: getattr(curve, part) for part in ("y", "low", "high")}
        parts = {part: one + hidden for part, one in parts.items() if one is not None}
        name = codes.meanings[int(code)] if codes.meanings else str(code)
        curves.append(replace(curve, name=name, **parts))
    return curves


def _make_map(data: Variables, chart: Chart, x_axis: Axis, colours: Axis) -> Panel | None:
    """Return the panel of a variable over x and its first dimension.

    The variable is `chart.y`. `colours` has the scale and the label of the colours.
    """
    variable = data[chart.y]
    values = np.atleast_2d(_as_floats(variable))
    if not np.isfinite(values).any():
        return None
    x = _as_floats(data[_find_x(data, chart)]) * x_axis.scale
    # Largest number of columns; a finer map keeps every n-th one
    step = -(-x.size // 400)

    # the rows are a coordinate y in the units of x, the time, or frames
    y_axis = Axis("frame")
    rows = np.arange(len(values))
    if _is_over_face(variable) and variable.dims[0] in data:
        label = x_axis.label.replace("x", "y", 1)
        y_axis = replace(x_axis, label=label)
        rows = data[variable.dims[0]].values * y_axis.scale
    elif "frame_time" in data and len(values) > 1:
        times = data["frame_time"].values - data["frame_time"].values[0]
        y_axis = make_axis("time in the last cycle", "s", times)
        rows = times * y_axis.scale

    if variable.meanings:  # codes keep their numbers
        values = values.astype(np.int8)
    else:
        values = values * colours.scale
    curve = Curve("", x[::step], values[:, ::step], rows=rows, meanings=variable.meanings)
    label = colours.label
    return Panel(chart.title, "map", x_axis, y_axis, [curve], chart.caption, colour_label=label)
