"""Panels as JSON of plotly.js figures; sliders and menus are part of this JSON, so that pages need no code of their own."""

import base64

import numpy as np

from .panels import Curve, Panel

COLOURS = (
    *("#2a78c0", "#d1592a", "#2f9e63", "#9166c9", "#8a8f98", "#b08a12", "#c2478f", "#3aa6a6"),
    *("#7a4b2a", "#5b6fd6", "#97b02e", "#d98cb3"),
)
CODE_COLOURS = ("#c9ced6", "#2a78c0", "#d1592a", "#2f9e63", "#9166c9")  # open, stick, slip, ...
DASHES = ("solid", "dash", "dot", "dashdot")
SYMBOLS = ("circle", "diamond", "square", "x")
BAND_OPACITY = 0.18
FRAME_MILLISECONDS = 120  # duration of a frame of a film


def draw(panel: Panel) -> dict:
    """Return the figure of a panel: `title`, `data`, `layout`, `caption`, `description`, and `frames` of a film."""
    layout = {
        "xaxis": _axis_layout(panel.x),
        "yaxis": _axis_layout(panel.y),
        "showlegend": sum(bool(curve.name) for curve in panel.curves) > 1,
    }
    if panel.y2 is not None:
        layout["yaxis2"] = _axis_layout(panel.y2) | {"overlaying": "y", "side": "right"}
    if panel.marks:
        layout["shapes"] = [_mark(position) for position in panel.marks]
    figure = {
        "title": panel.title,
        "caption": panel.caption,
        "description": panel.description,
        "data": [],
        "layout": layout,
    }
    if panel.choices:
        return _add_menu(figure, panel)
    if panel.style == "film":
        return _add_film(figure, panel)
    figure["data"] = _make_traces(panel)
    if panel.style == "map" and panel.y.label.startswith("y"):
        layout["yaxis"] |= {"scaleanchor": "x", "constrain": "domain"}
        layout["xaxis"]["constrain"] = "domain"
    return figure


def _axis_layout(axis) -> dict:
    """Return the layout of an axis."""
    return {"title": {"text": axis.label}, "type": "log" if axis.is_log else "-"}


def _mark(position: float) -> dict:
    """Return a dotted vertical line over the whole height."""
    line = {"color": "#8a8f98", "width": 1, "dash": "dot"}
    return {
        "type": "line",
        "yref": "paper",
        "x0": position,
        "x1": position,
        "y0": 0,
        "y1": 1,
        "line": line,
    }


def _make_traces(panel: Panel) -> list[dict]:
    """Return the traces of a panel."""
    traces = []
    for number, curve in enumerate(panel.curves):
        colour = choose_colour(curve, number)
        if panel.style == "overlay":
            colour = _blend(number / max(len(panel.curves) - 1, 1))
        if panel.style == "map":
            traces.append(_map_trace(curve, panel.colour_label))
        elif panel.style == "bars":
            traces.append(_bar_trace(curve, colour))
        else:
            traces += _curve_traces(curve, "line" if curve.is_line else panel.style, colour)
    return traces


def choose_colour(curve: Curve, number: int) -> str:
    """Return the colour of a curve at a place among the curves of a panel."""
    return COLOURS[(number if curve.colour < 0 else curve.colour) % len(COLOURS)]


def _blend(fraction: float) -> str:
    """Return a colour between grey-blue (first curve) and orange (last curve)."""
    ends = ((158, 178, 200), (42, 120, 192), (209, 89, 42))
    place = fraction * (len(ends) - 1)
    first = min(int(place), len(ends) - 2)
    mixed = [
        a + (b - a) * (place - first) for a, b in zip(ends[first], ends[first + 1], strict=True)
    ]
    return "rgb({:.0f},{:.0f},{:.0f})".format(*mixed)


def _curve_traces(curve: Curve, style: str, colour: str) -> list[dict]:
    """Return the trace of a curve, and that of its error band if it is drawn as a line."""
    trace = {
        "x": pack(curve.x),
        "y": pack(curve.y),
        "name": curve.name,
        "mode": {"points": "markers", "dots": "lines+markers"}.get(style, "lines"),
        "line": {"color": colour, "width": 1.7, "dash": DASHES[curve.dash % len(DASHES)]},
        "marker": {"color": colour, "size": 7, "symbol": SYMBOLS[curve.dash % len(SYMBOLS)]},
    }
    if curve.symbols is not None:
        trace["marker"]["symbol"] = [str(symbol) for symbol in curve.symbols]
    if curve.on_second_axis:
        trace |= {"yaxis": "y2", "line": {"color": colour, "width": 1.7, "dash": "dot"}}
    if style == "area":
        trace["fill"] = "tozeroy"
    if curve.low is None:
        return [trace]
    if style in ("points", "dots"):
        distances = {"array": pack(curve.high - curve.y), "arrayminus": pack(curve.y - curve.low)}
        trace["error_y"] = distances | {"symmetric": False, "thickness": 1.2, "color": colour}
        return [trace]

    # the band is a closed line around the points whose ends are known
    known = np.isfinite(curve.low) & np.isfinite(curve.high)
    band = {
        "x": pack(np.concatenate([curve.x[known], curve.x[known][::-1]])),
        "y": pack(np.concatenate([curve.high[known], curve.low[known][::-1]])),
        "mode": "lines",
        "fill": "toself",
        "fillcolor": colour,
        "opacity": BAND_OPACITY,
        "line": {"width": 0},
        "hoverinfo": "skip",
        "showlegend": False,
    }
    if curve.on_second_axis:
        band["yaxis"] = "y2"
    return [band, trace]


def _bar_trace(curve: Curve, colour: str) -> dict:
    """Return horizontal bars with their intervals; `x` has the names of the bars."""
    trace = {
        "type": "bar",
        "orientation": "h",
        "x": pack(curve.y),
        "y": [str(name) for name in curve.x],
        "name": curve.name,
        "marker": {"color": colour},
    }
    if curve.low is not None:
        distances = {"array": pack(curve.high - curve.y), "arrayminus": pack(curve.y - curve.low)}
        trace["error_x"] = distances | {"symmetric": False, "thickness": 1.2}
    return trace


def _map_trace(curve: Curve, label: str) -> dict:
    """Return a heat map; codes have one colour each, other values a scale that is symmetric if they change their sign."""
    trace = {"type": "heatmap", "x": pack(curve.x), "y": pack(curve.rows), "z": pack(curve.y)}
    if curve.meanings:
        count = len(curve.meanings)
        steps = [[(k + j) / count, CODE_COLOURS[k]] for k in range(count) for j in (0, 1)]
        bar = {"tickvals": list(range(count)), "ticktext": list(curve.meanings)}
        return trace | {"zmin": -0.5, "zmax": count - 0.5, "colorscale": steps, "colorbar": bar}
    low = float(np.nanmin(curve.y))
    high = float(np.nanmax(curve.y))
    bar = {"title": {"text": label, "side": "right"}}
    if low < 0 < high:
        limit = max(-low, high)
        return trace | {"zmin": -limit, "zmax": limit, "colorscale": "RdBu", "colorbar": bar}
    return trace | {"zmin": min(low, 0.0), "zmax": high, "colorscale": "Viridis", "colorbar": bar}


def _add_menu(figure: dict, panel: Panel) -> dict:
    """Add a menu that shows one of several panels at a time."""
    groups = [_make_traces(choice) for choice in panel.choices]
    buttons = []
    for number, choice in enumerate(panel.choices):
        visible = [k == number for k, group in enumerate(groups) for _ in group]
        axes = {
            "xaxis.title.text": choice.x.label,
            "yaxis.title.text": choice.y.label,
            "xaxis.type": "log" if choice.x.is_log else "-",
            "yaxis.type": "log" if choice.y.is_log else "-",
            "shapes": [_mark(position) for position in choice.marks],
        }
        buttons.append(
            {"label": choice.title, "method": "update", "args": [{"visible": visible}, axes]}
        )
    for number, group in enumerate(groups):
        for trace in group:
            trace["visible"] = number == 0
            figure["data"].append(trace)
    first = panel.choices[0]
    figure["layout"] |= {
        "xaxis": _axis_layout(first.x),
        "yaxis": _axis_layout(first.y),
        "showlegend": sum(bool(curve.name) for curve in first.curves) > 1,
        # the legend is below, because the menu is above
        "legend": {"orientation": "h", "x": 0, "y": -0.3, "yanchor": "top"},
        "updatemenus": [
            {"buttons": buttons, "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"}
        ],
    }
    return figure


def _add_film(figure: dict, panel: Panel) -> dict:
    """Add the frames of a film with a slider and a button; each curve of the panel is one frame of the map."""
    largest = float(max(np.nanmax(curve.y) for curve in panel.curves))
    traces = [
        _map_trace(curve, panel.colour_label) | {"zmin": 0.0, "zmax": largest}
        for curve in panel.curves
    ]
    move = {
        "frame": {"duration": FRAME_MILLISECONDS, "redraw": True},
        "transition": {"duration": 0},
        "mode": "immediate",
    }
    figure["data"] = traces[:1]
    if len(traces) > 1:
        names = [curve.name for curve in panel.curves]
        figure["frames"] = [
            {"name": name, "data": [{"z": trace["z"]}]}
            for name, trace in zip(names, traces, strict=True)
        ]
        steps = [{"label": name, "method": "animate", "args": [[name], move]} for name in names]
        stop = {"label": "stop", "method": "animate", "args": [[None], move]}
        play = {"label": "play", "method": "animate", "args": [None, move]}
        figure["layout"] |= {
            "sliders": [
                {"steps": steps, "active": 0, "pad": {"t": 40}, "currentvalue": {"prefix": "t = "}}
            ],
            "updatemenus": [
                {"type": "buttons", "direction": "right", "buttons": [play, stop]}
                | {"x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"}
            ],
        }
    # equal scales of both axes, which end at the edges of the map
    figure["layout"]["yaxis"] |= {"scaleanchor": "x", "constrain": "domain"}
    figure["layout"]["xaxis"]["constrain"] = "domain"
    figure["layout"]["showlegend"] = False
    return figure


def pack(values: np.ndarray) -> dict | list:
    """Return an array in the binary form that plotly.js reads; strings and short arrays as a list."""
    values = np.asarray(values)
    if values.dtype.kind in "UO":
        return values.tolist()
    kind = "i1" if values.dtype == np.int8 else "f4"
    values = np.ascontiguousarray(values, np.int8 if kind == "i1" else np.float32)
    content = {"dtype": kind, "bdata": base64.b64encode(values.tobytes()).decode()}
    if values.ndim > 1:
        content["shape"] = ",".join(map(str, values.shape))
    return content
