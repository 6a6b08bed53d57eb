"""Charts and other pictures drawn by matplotlib as SVG; equal numbers produce equal bytes."""

import io
import re
from functools import partial, wraps

from ...formatting import format_number

BLUE = "#1f5f99"
ORANGE = "#c8551b"
GREY = "#8a8a8a"
WIDTH = 9.6  # width of a figure [inch], which the page scales to the width of its text
STYLE = {
    "svg.hashsalt": "patchfem",
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "axes.axisbelow": True,
    "axes.titlesize": 11,
    "axes.formatter.useoffset": False,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "figure.constrained_layout.use": True,
    "lines.linewidth": 1.4,
}
COLOURS = {"accent": BLUE, "warm": ORANGE, "soft": GREY}  # colours by the name of their role
SHAPES = {"circle": "o", "square": "s", "diamond": "D", "triangle": "^"}
HEIGHT = 3.6  # height of a chart [inch]
# Ratio of the ends of a logarithmic axis below which three numbers per decade are printed.
MAX_PLAIN_RATIO = 1e3


def make_figure(columns: int = 1, height: float = 3.2, axes_to_use=None, **layout):
    """Return a figure of the page width with axes side by side.

    Parameters
    ----------
    columns : int
        Number of axes.
    height : float
        [inch]
    axes_to_use : Axes, optional
        Axes that replace all of them.
    **layout
        Passed to `subplots`.

    Returns
    -------
    tuple
        Figure and list of Axes.
    """
    if axes_to_use is not None:
        return axes_to_use.figure, [axes_to_use]
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height))
    FigureCanvasSVG(figure)
    axes = figure.subplots(1, columns, squeeze=False, **layout)[0]
    if columns > 1:
        for axis in axes:
            axis.locator_params(axis="x", nbins=8 - columns)
    return figure, axes


def _figure_svg(figure) -> str:
    """Return the SVG text of a figure without date and program name.

    The only addresses left are those of the XML namespaces.
    """
    import matplotlib

    text = io.StringIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(text, format="svg", dpi=180, metadata={"Date": None})
    body = text.getvalue()
    return re.sub(r"\s*<metadata>.*?</metadata>", "", body[body.index("<svg") :], flags=re.DOTALL)


def returns_svg(draw):
    """Wrap a function that draws a Figure so that it returns SVG text.

    The attribute `figure` of the result returns the Figure itself, which a notebook shows as the
    same SVG, as it does each of its axes.
    """

    @wraps(draw)
    def figure(*args, **kwargs):
        """Return the drawn Figure."""
        import matplotlib

        with matplotlib.rc_context(STYLE):
            drawn = draw(*args, **kwargs)
        if kwargs.get("axes_to_use") is None:  # otherwise the figure belongs to the caller
            for element in (drawn, *drawn.axes):
                element._repr_svg_ = partial(_figure_svg, drawn)
        return drawn

    @wraps(draw)
    def svg(*args, **kwargs) -> str:
        """Return the SVG text of the drawn Figure."""
        return _figure_svg(figure(*args, **kwargs))

    svg.figure = figure
    return svg


@returns_svg
def draw_charts(chart_list: list, axes_to_use=None, height: float = HEIGHT):
    """Draw charts side by side into one figure.

    Parameters
    ----------
    chart_list : list of dict
    axes_to_use : Axes, optional
        Axes for the first chart alone.
    height : float
        [inch]
    """
    figure, axes = make_figure(len(chart_list), height, axes_to_use)
    for axis, chart in zip(axes, chart_list):
        for mark in chart["marks"]:
            MARKS[mark["kind"]](axis, mark)
        for name in ("x", "y"):
            settings = chart[name]
            axis.set(
                **{
                    f"{name}label": f"{settings['label']} [{settings['unit']}]"
                    if settings["unit"]
                    else settings["label"]
                }
            )
            if settings.get("log"):
                axis.set(**{f"{name}scale": "log"})
            if "ticks" in settings:
                axis.set(
                    **dict(zip((f"{name}ticks", f"{name}ticklabels"), zip(*settings["ticks"])))
                )
            if "range" in settings:
                axis.set(**{f"{name}lim": settings["range"]})
            if settings.get("log"):
                _write_plain_numbers(getattr(axis, f"{name}axis"))
        for label in chart.get("labels", ()):
            _write_label(axis, label)
        axis.set_title(chart["title"])
        handles = dict(zip(*axis.get_legend_handles_labels()[::-1]))
        if handles:
            axis.legend(
                handles.values(), handles.keys(), frameon=True, framealpha=0.7, edgecolor="none"
            )
    return figure


def _write_plain_numbers(axis) -> None:
    """Label a logarithmic axis with decimal numbers or powers of ten."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = sorted(axis.get_view_interval())
    axis.set_major_locator(
        LogLocator(subs=(1.0, 2.0, 5.0) if high < MAX_PLAIN_RATIO * low else (1.0,))
    )
    axis.set_major_formatter(FuncFormatter(lambda value, _: format_number(value, 3)))
    axis.set_minor_formatter(NullFormatter())


def _write_label(axis, label: dict) -> None:
    """Write a label beside a point of a chart."""
    on_left = label.get("side") == "left"
    axis.annotate(
        label["text"],
        (label["x"], label["y"]),
        xytext=(-2 if on_left else 8, 7 + label["raised"]),
        textcoords="offset points",
        ha="center" if on_left else "left",
        fontsize=9,
        color="0.2",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5},
    )


def _mark_colour(mark: dict) -> str:
    """Return the colour in which a chart mark is drawn."""
    return COLOURS.get(mark["colour"], mark["colour"])


def _draw_line(axis, mark: dict) -> None:
    """Draw the line of a chart mark on axes."""
    axis.plot(
        mark["x"],
        mark["y"],
        color=_mark_colour(mark),
        label=mark["name"] or None,
        linewidth=mark.get("width"),
        linestyle=mark.get("dash", "solid"),
        alpha=mark.get("alpha"),
    )


def _draw_dots(axis, mark: dict) -> None:
    """Draw the points and error bars of a chart mark on axes."""
    axis.errorbar(
        mark["x"],
        mark["y"],
        mark.get("errors"),
        fmt=SHAPES[mark.get("shape", "circle")],
        ms=mark.get("size", 5),
        capsize=2,
        color=_mark_colour(mark),
        label=mark["name"] or None,
        markerfacecolor="white" if mark.get("hollow") else None,
    )


def _draw_band(axis, mark: dict) -> None:
    """Draw the band of a chart mark between two curves."""
    axis.fill_between(
        mark["x"],
        mark["low"],
        mark["high"],
        color=_mark_colour(mark),
        alpha=0.22,
        lw=0,
        label=mark["name"] or None,
    )


def _draw_span(axis, mark: dict) -> None:
    """Draw a shaded vertical strip across a chart."""
    axis.axvspan(
        mark["left"],
        mark["right"],
        color=_mark_colour(mark),
        alpha=0.12,
        lw=0,
        label=mark["name"] or None,
    )


def _draw_rule(axis, mark: dict) -> None:
    """Draw a vertical line across a chart."""
    axis.axvline(
        mark["x"],
        color=_mark_colour(mark),
        lw=0.9,
        ls=mark.get("dash", "dashdot"),
        label=mark["name"] or None,
    )


def _draw_arrow(axis, mark: dict) -> None:
    """Draw a line of a chart with an arrowhead in its middle."""
    _draw_line(axis, mark)
    (a, b), (c, d) = mark["x"], mark["y"]
    tail, tip = (
        ((1 - s) * a + s * b, c ** (1 - s) * d**s if "floor" in mark else (1 - s) * c + s * d)
        for s in (0.45, 0.58)
    )
    axis.annotate(
        "",
        xy=tip,
        xytext=tail,
        arrowprops={"arrowstyle": "-|>", "color": _mark_colour(mark), "lw": 1.2},
    )


def _draw_cells(axis, mark: dict) -> None:
    """Draw the rectangular cells of a chart, coloured by their values."""
    first = not axis.collections
    drawn = axis.pcolormesh(
        mark["x"], mark["y"], mark["value"].T, vmin=0.0, vmax=mark["top"], rasterized=True
    )
    if first:
        axis.figure.colorbar(drawn, ax=axis, label=mark["unit"])
        axis.grid(visible=False)


MARKS = {
    "cells": _draw_cells,
    "line": _draw_line,
    "dots": _draw_dots,
    "band": _draw_band,
    "span": _draw_span,
    "rule": _draw_rule,
    "arrow": _draw_arrow,
}
