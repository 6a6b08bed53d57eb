"""Panels as JSON of plotly.js figures; sliders and menus are part of this JSON, so that pages need no code of their own."""

import base64
from itertools import chain
from operator import itemgetter
from typing import Any

import numpy as np

from ...formatting import format_number
from ..quantities import VALUE_ROUND_OFF
from .panels import Curve, Panel

CURVE_COLOURS = (
    *("#2a78c0", "#d1592a", "#2f9e63", "#9166c9", "#8a8f98", "#b08a12", "#c2478f", "#3aa6a6"),
    *("#7a4b2a", "#5b6fd6", "#97b02e", "#d98cb3"),
)
# Colours of the codes 0, 1, ... of a state, such as open, stick and slip
STATE_COLOURS = ("#c9ced6", "#2a78c0", "#d1592a", "#2f9e63", "#9166c9")
# Red, green and blue (0 to 255) of the first, the middle and the last of many overlaid curves
OVERLAID_CURVE_COLOURS = ((158, 178, 200), (42, 120, 192), (209, 89, 42))
ERROR_BAND_OPACITY = 0.18  # opacity of an error band, 1 for the colour of its curve
FILM_FRAME_MILLISECONDS = 120
# Labels of a logarithmic axis within a decade, by the number of decades up to which they have room
LABELLED_DIGITS = {0.7: (1, 1.5, 2, 3, 5, 7), 2.5: (1, 2, 5)}
# Numbers of decades between which an axis has these labels, or all powers of 10; others have the labels of plotly.js
MIN_LABELLED_DECADES = 0.3
MAX_LABELLED_DECADES = 8
# Keys of an axis that differ among the charts of a menu
AXIS_KEYS = ("type", "dtick", "tickvals", "ticktext", "range")
# figure of plotly.js, or a part of it, as an object of its JSON
Figure = dict[str, Any]
# Position of a menu, above its chart.
MENU_POSITION = {
    "x": 0,
    "xanchor": "left",
    "y": 1.02,
    "yanchor": "bottom",
}


def make_plotly_figure(panel: Panel) -> Figure:
    """Return the figure of a panel: `data`, `layout`, and `frames` of a film."""
    figure = {"data": make_traces(panel), "layout": _make_layout(panel)}
    if panel.choices:
        _add_menu(figure, panel.choices)
    elif panel.style == "film":
        _add_slider(figure, [curve.name for curve in panel.curves])
    return figure


def _make_layout(panel: Panel) -> Figure:
    """Return the layout of a panel: its axes, vertical lines, and whether it has a legend."""
    is_film = panel.style == "film"
    layout = {
        "xaxis": _make_axis_layout(panel.x, [curve.x for curve in panel.curves]),
        "yaxis": _make_axis_layout(
            panel.y, [curve.y if curve.rows is None else curve.rows for curve in panel.curves]
        ),
        "showlegend": not is_film and sum(bool(curve.name) for curve in panel.curves) > 1,
    }
    if panel.style == "area":
        # the peaks at the ends of a contact do not lie on the frame
        x = panel.curves[0].x
        # Room beside a filled curve, relative to its length; less is not seen
        room = 0.02 * np.ptp(x)
        layout["xaxis"]["range"] = [x.min() - room, x.max() + room]
    if panel.marks:
        layout["shapes"] = list(map(_make_vertical_line, panel.marks))
    if is_film or (panel.style == "map" and panel.y.label.startswith("y")):
        # equal scales of both axes, which end at the edges of the map
        layout["yaxis"] |= {"scaleanchor": "x", "constrain": "domain"}
        layout["xaxis"]["constrain"] = "domain"
    return layout


def _make_axis_layout(axis, columns) -> Figure:
    """Return the title and the scale of an `Axis` as plotly.js takes them; `columns` are the values that it shows."""
    # By default plotly.js writes 4e-14 as 40f.
    layout = {
        "title": {"text": axis.label},
        "type": "log" if axis.is_log else "-",
        "exponentformat": "power",
    }
    if axis.is_log:
        values = np.concatenate([np.ravel(column) for column in columns])
        values = values[np.isfinite(values) & (values > 0)]
        # Round-off beside large values would stretch the axis over many decades.
        is_known = values > VALUE_ROUND_OFF * values.max(initial=0.0)
        if values.size:
            low, high = np.log10([values[is_known].min(), values.max()])
            layout |= _make_log_labels(low, high)
            if not is_known.all():
                room = 0.05 * (high - low) + 0.02
                layout["range"] = [low - room, high + room]
    return layout


def _make_log_labels(low: float, high: float) -> Figure:
    """Return the labels of a logarithmic axis from `low` to `high`, both logarithms.

    By default plotly.js writes 20 as a small 2 beside 10, and the labels of many decades overlap.
    """
    if not MIN_LABELLED_DECADES < high - low < MAX_LABELLED_DECADES:
        return {}
    digits = next((digits for room, digits in LABELLED_DIGITS.items() if high - low < room), ())
    if not digits:
        return {"dtick": 1}
    powers = 10.0 ** np.arange(np.floor(low), high + 1)
    labels = np.outer(powers, digits).ravel().tolist()
    return {"tickvals": labels, "ticktext": [format_number(one, 2) for one in labels]}


def _make_vertical_line(position: float) -> Figure:
    """Return a dotted vertical line over the whole height."""
    line = {"color": "#8a8f98", "width": 1, "dash": "dot"}
    ends = {"x0": position, "x1": position, "y0": 0, "y1": 1}
    return {"type": "line", "yref": "paper", "line": line} | ends


def make_traces(panel: Panel, n_drawn: int = 0) -> list[Figure]:
    """Return the curves or maps of a panel as traces, the data objects of plotly.js, which `axes` draws as well.

    A film has a trace for each frame, all with the same range of colours. The first `n_drawn` colours are left out.
    """
    if panel.style in ("map", "film"):
        traces = [_make_map_trace(curve, panel.colour_label) for curve in panel.curves]
        if panel.style == "film":
            largest = float(max(np.nanmax(curve.y) for curve in panel.curves))
            traces = [trace | {"zmin": 0.0, "zmax": largest} for trace in traces]
        return traces
    groups = []
    for number, curve in enumerate(panel.curves):
        colour = CURVE_COLOURS[(n_drawn + number) % len(CURVE_COLOURS)]
        if panel.style == "overlay":
            place = number / max(len(panel.curves) - 1, 1)
            mixed = [np.interp(place, (0, 0.5, 1), part) for part in zip(*OVERLAID_CURVE_COLOURS)]
            colour = "#{:02x}{:02x}{:02x}".format(*map(round, mixed))
        style = "line" if curve.is_line else panel.style
        groups.append((curve.weight, _make_curve_traces(curve, style, colour)))
    # later traces lie above earlier ones
    groups.sort(key=itemgetter(0))
    return list(chain.from_iterable(group for _, group in groups))


def _make_curve_traces(curve: Curve, style: str, colour: str) -> list[Figure]:
    """Return the trace of a curve, and that of its error band if it is drawn as a line.

    The data are in display units. `style` is that of the panel, and `colour` applies to line, symbols and band.
    """
    trace = {
        "x": curve.x,
        "y": curve.y,
        "name": curve.name,
        "mode": {"points": "markers", "dots": "lines+markers"}.get(style, "lines"),
        "line": {"color": colour, "width": 1.7 * curve.weight},
        "marker": {"color": colour, "size": 7},
    }
    if curve.symbols is not None:
        trace["marker"]["symbol"] = curve.symbols
    if style == "area":
        trace["fill"] = "tozeroy"

    # Points have error bars, and a line has a band.
    if curve.low is None:
        return [trace]
    if style in ("points", "dots"):
        ends = {"array": curve.high - curve.y, "arrayminus": curve.y - curve.low}
        return [trace | {"error_y": ends | {"symmetric": False, "thickness": 1.2, "color": colour}}]

    # the band is a closed line around the points whose ends are known
    known = np.isfinite(curve.low) & np.isfinite(curve.high)
    x, low, high = (values[known] for values in (curve.x, curve.low, curve.high))
    band = {
        "x": np.concatenate([x, x[::-1]]),
        "y": np.concatenate([high, low[::-1]]),
        "mode": "lines",
        "fill": "toself",
        "fillcolor": colour,
        "opacity": ERROR_BAND_OPACITY,
        "line": {"width": 0},
        "hoverinfo": "skip",
        "showlegend": False,
    }
    return [band, trace]


def _make_map_trace(curve: Curve, label: str) -> Figure:
    """Return a heat map; codes have one colour each, other values a scale that is symmetric if they change their sign."""
    trace = {"type": "heatmap", "x": curve.x, "y": curve.rows, "z": curve.y}
    if curve.meanings:
        count = len(curve.meanings)
        steps = [[(k + j) / count, STATE_COLOURS[k]] for k in range(count) for j in (0, 1)]
        bar = {"tickvals": list(range(count)), "ticktext": curve.meanings}
        return trace | {"zmin": -0.5, "zmax": count - 0.5, "colorscale": steps, "colorbar": bar}
    low = float(np.nanmin(curve.y))
    high = float(np.nanmax(curve.y))
    scale = "Viridis"
    ends = (min(low, 0.0), high)
    if low < 0 < high:
        scale = "RdBu"
        ends = (-max(-low, high), max(-low, high))
    bar = {"title": {"text": label, "side": "right"}}
    return trace | {"zmin": ends[0], "zmax": ends[1], "colorscale": scale, "colorbar": bar}


def _add_menu(figure: Figure, choices: list[Panel]) -> None:
    """Add a menu that shows one of several panels at a time."""
    groups = [make_traces(choice) for choice in choices]
    buttons = []
    for number, choice in enumerate(choices):
        visible = [k == number for k, group in enumerate(groups) for _ in group]
        changes = {"shapes": list(map(_make_vertical_line, choice.marks))}
        layout = _make_layout(choice)
        for name in ("xaxis", "yaxis"):
            axis = layout[name]
            changes |= {f"{name}.{key}": axis.get(key) for key in AXIS_KEYS}
            changes[f"{name}.autorange"] = "range" not in axis
            changes[f"{name}.title.text"] = axis["title"]["text"]
        arguments = [{"visible": visible}, changes]
        buttons.append({"label": choice.title, "method": "update", "args": arguments})
    figure["data"] = [
        trace | {"visible": number == 0} for number, group in enumerate(groups) for trace in group
    ]
    figure["layout"] |= {
        # the legend is below, because the menu is above
        "legend": {"orientation": "h", "x": 0, "y": -0.3, "yanchor": "top"},
        "updatemenus": [MENU_POSITION | {"buttons": buttons}],
    }


def _add_slider(figure: Figure, names: list[str]) -> None:
    """Turn the traces of a figure into frames with names, with a slider and a button."""
    traces = figure["data"]
    figure["data"] = traces[:1]
    if len(traces) == 1:
        return
    figure["frames"] = [
        {"name": name, "data": [{"z": trace["z"]}]}
        for name, trace in zip(names, traces, strict=True)
    ]
    frame = {"duration": FILM_FRAME_MILLISECONDS, "redraw": True}
    move = {"frame": frame, "transition": {"duration": 0}, "mode": "immediate"}
    buttons = [
        {"label": label, "method": "animate", "args": [target, move]}
        for label, target in [("play", None), ("stop", [None]), *((name, [name]) for name in names)]
    ]
    play, stop, *steps = buttons
    slider = {"steps": steps, "active": 0, "pad": {"t": 40}, "currentvalue": {"prefix": "t = "}}
    menu = MENU_POSITION | {"type": "buttons", "direction": "right", "buttons": [play, stop]}
    figure["layout"] |= {"sliders": [slider], "updatemenus": [menu]}


def pack_array(values: np.ndarray) -> Figure | list[str]:
    """Return an array in the binary form that plotly.js reads; strings and short arrays as a list."""
    values = np.asarray(values)
    if values.dtype.kind in "UO":
        return values.tolist()
    kind = "i1" if values.dtype == np.int8 else "f4"
    values = np.ascontiguousarray(values, kind)
    content = {"dtype": kind, "bdata": base64.b64encode(values.tobytes()).decode()}
    if values.ndim > 1:
        content["shape"] = ",".join(map(str, values.shape))
    return content
