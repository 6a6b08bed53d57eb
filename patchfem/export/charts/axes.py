"""Panels as matplotlib Axes, for pictures and for `plot` in Python, with the traces that a page has."""

import io
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from ...core import PatchfemError
from ...disk.atomic_write import write_atomically
from ..answer import Answer, Answers
from ..rows import CHARTS
from .panel import Axis, Panel, find_unit_factor, use_units
from .panels import make_panels
from .plotly import ERROR_BAND_OPACITY, Figure, make_traces

PICTURE_ENDINGS = (".png", ".svg", ".pdf")
# Number of charts of a picture, 1 for all other kinds of answers. A backbone needs frequency, damping and force.
N_PICTURE_CHARTS = {"backbone": 3}

# colours of maps; red is positive, as in the scale of plotly.js
MATPLOTLIB_COLOURS = {"Viridis": "viridis", "RdBu": "RdBu_r"}
POINTS_PER_PIXEL = (
    0.8  # widths of lines, so that curves of usual weight have the width of a picture
)
MATPLOTLIB_MARKERS = {"circle": "o", "x": "x"}  # marker for each symbol of plotly
# style of the pictures; two drawings of the same answer are equal files
MATPLOTLIB_STYLE = {
    "svg.hashsalt": "patchfem",
    "svg.fonttype": "none",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "axes.axisbelow": True,
    "axes.titlesize": 11,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "figure.constrained_layout.use": True,
    "lines.linewidth": 1.4,
}
# metadata that leave out the date
METADATA_WITHOUT_DATE = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
# Largest ratio of the maxima of response curves that a linear axis shows
MAX_LINEAR_LEVEL_RATIO = 10.0
PANEL_SIZE_INCHES = (6.4, 4.2)  # width and height


def draw_panel(panel: Panel, axes):
    """Draw the traces of a panel on matplotlib Axes and return them.

    Of a menu the first choice is drawn, and of a film the last frame. Curves have other colours than those of the legend.
    """
    if panel.choices:
        return draw_panel(panel.choices[0], axes)
    if axes.has_data():
        _enlarge_unit(axes, panel)
        panel = use_units(panel, axes.get_xlabel(), axes.get_ylabel())
    traces = make_traces(panel, len(axes.get_legend_handles_labels()[1]))
    for trace in traces[-1:] if panel.style == "film" else traces:
        if "z" in trace:
            _draw_map(trace, axes)
        else:
            _draw_curve(trace, axes)
    for position in panel.marks:
        axes.axvline(position, color="0.5", lw=1, ls=":")
    axes.set(title=panel.title, xlabel=panel.x.label, ylabel=panel.y.label)
    axes.set(**{f"{name}scale": "log" for name in "xy" if getattr(panel, name).is_log})
    if len(axes.get_legend_handles_labels()[1]) > 1 and panel.style != "map":
        axes.legend()
    return axes


def _enlarge_unit(axes, panel: Panel) -> None:
    """Show what matplotlib axes have in the vertical unit of a panel of the same quantity, if that is larger."""
    label = axes.get_ylabel()
    factor = find_unit_factor(Axis(label).unit, panel.y.unit)
    if factor >= 1 or label.partition(" [")[0] != panel.y.label.partition(" [")[0]:
        return
    scale = np.array([1.0, factor])
    for line in _list_curves(axes):
        line.set_ydata(np.asarray(line.get_ydata()) * factor)
    for patch in axes.patches:  # bands of errors
        patch.set_xy(patch.get_xy() * scale)
    axes.set_ylabel(panel.y.label)
    axes.relim()
    axes.autoscale_view()


def _list_curves(axes) -> list:
    """Return the curves of matplotlib axes, without vertical lines."""
    return [line for line in axes.lines if line.get_transform() == axes.transData]


def _show_all_levels(axes) -> None:
    """Make the vertical axis logarithmic if the largest values of its curves differ by more than a decade."""
    heights = np.array([np.nanmax(line.get_ydata(), initial=0.0) for line in _list_curves(axes)])
    heights = heights[heights > 0]
    if heights.size and heights.max() > MAX_LINEAR_LEVEL_RATIO * heights.min():
        axes.set_yscale("log")


def _draw_curve(trace: Figure, axes) -> None:
    """Draw the trace of a curve with its error bars, or that of an error band, into matplotlib axes."""
    x, y = trace["x"], trace["y"]
    colour = trace.get("fillcolor") or trace["line"]["color"]
    filling = {"color": colour, "alpha": ERROR_BAND_OPACITY, "lw": 0}
    if trace.get("fill") == "toself":
        axes.fill(x, y, **filling)
        return

    has_points = "markers" in trace["mode"]
    if "lines" in trace["mode"]:
        width = POINTS_PER_PIXEL * trace["line"]["width"]
        axes.plot(x, y, color=colour, lw=width, label=None if has_points else trace["name"])
    if "fill" in trace:
        axes.fill_between(x, y, **filling)
    if not has_points:
        return

    # Error bars below the symbols, of which each kind is plotted by itself
    if "error_y" in trace:
        ends = np.nan_to_num([trace["error_y"][part] for part in ("arrayminus", "array")])
        axes.errorbar(x, y, ends, fmt="none", ecolor=colour)
    symbols = np.broadcast_to(trace["marker"].get("symbol", "circle"), x.shape)
    for symbol, marker in MATPLOTLIB_MARKERS.items():
        points = (values[symbols == symbol] for values in (x, y))
        label = trace["name"] if symbol == "circle" else None  # the entry of the legend
        axes.plot(*points, marker, color=colour, label=label, zorder=3)


def _draw_map(trace: Figure, axes) -> None:
    """Draw the trace of a map into matplotlib axes, with its colour bar."""
    from matplotlib.colors import ListedColormap

    colours = trace["colorscale"]
    if isinstance(colours, str):
        colours = MATPLOTLIB_COLOURS[colours]
    else:  # a colour for each code, at both ends of its range
        colours = ListedColormap([colour for _, colour in colours[::2]])
    options = {"cmap": colours, "vmin": trace["zmin"], "vmax": trace["zmax"]}
    mesh = axes.pcolormesh(trace["x"], trace["y"], trace["z"], shading="nearest", **options)
    bar = trace["colorbar"]
    drawn = axes.figure.colorbar(mesh, label=bar.get("title", {}).get("text", ""))
    if "tickvals" in bar:
        drawn.set_ticks(bar["tickvals"], labels=bar["ticktext"])


def make_figure(panels: list[Panel]):
    """Return a matplotlib figure with the panels beside and below each other, at most two in a row."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    columns = min(len(panels), 2)
    rows = -(-len(panels) // columns)
    with rc_context(MATPLOTLIB_STYLE):
        figure = Figure(figsize=(PANEL_SIZE_INCHES[0] * columns, PANEL_SIZE_INCHES[1] * rows))
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for panel, axes in zip(panels, grid, strict=False):
            draw_panel(panel, axes)
    for axes in grid[len(panels) :]:
        axes.remove()
    for element in (figure, *figure.axes):
        element._repr_svg_ = partial(_to_svg, figure)
    return figure


def save_figure(figure, target, ending: str, dpi: float = 150.0) -> None:
    """Write a figure of matplotlib such that equal figures give equal files.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure to write.
    target : str, Path or file object
        File, or stream, which is open for text if the format is "svg".
    ending : str
        Format without a dot, such as "svg".
    dpi : float
        Number of pixels per inch.
    """
    from matplotlib import rc_context

    with rc_context(MATPLOTLIB_STYLE):
        figure.savefig(target, dpi=dpi, format=ending, metadata=METADATA_WITHOUT_DATE.get(ending))


def _to_svg(figure) -> str:
    """Return a figure as SVG, the form in which a notebook shows it."""
    text = io.StringIO()
    save_figure(figure, text, "svg")
    return text.getvalue()[text.getvalue().index("<svg") :]


def find_picture_format(path: Path) -> str:
    """Return the format of a picture by the ending of its file, such as "svg"; PatchfemError for another ending."""
    if path.suffix.lower() not in PICTURE_ENDINGS:
        raise PatchfemError(f"{path}: a picture is written as {', '.join(PICTURE_ENDINGS)}")
    return path.suffix.lower()[1:]


def write_plot(answers: Answers, path: Path) -> None:
    """Write the main chart of one or several answers, and of a backbone all three charts, as .png, .svg or .pdf.

    It is the first chart of the page, and of a sweep the measure that the answer names first. Several `answers` have names.

    Raises
    ------
    PatchfemError
        For another ending, or if the answer has no chart.
    Missing
        If the file cannot be written.
    """
    ending = find_picture_format(path)
    kind = next(iter(answers.values())).kind
    panels = make_panels(answers, CHARTS[kind])
    if not panels:
        raise PatchfemError(f"{path}: this answer has no chart")
    # of a sweep, one measure in its unit comes before the ratios of all of them
    panels.sort(key=lambda panel: panel.style == "relative")
    with write_atomically(path) as partial:
        figure = make_figure(panels[: N_PICTURE_CHARTS.get(kind, 1)])
        save_figure(figure, partial, ending)


def list_titles(answer: Answer) -> list[str]:
    """Return the titles of the charts for which an answer has data, in the order of its page."""
    charts = [chart for chart in CHARTS[answer.kind] if make_panels({"": answer}, (chart,))]
    return list(dict.fromkeys(chart.title for chart in charts))


def draw_charts(answer: Answer, titles: tuple[str, ...], axes, caller: str, label: str = ""):
    """Draw the charts of an answer with some titles, and return the first Axes; None if it has none of them.

    Parameters
    ----------
    answer : Answer
        Answer of any verb.
    titles : tuple of str
        Titles in the table of charts; () for all charts.
    axes : matplotlib Axes or None
        Where to draw the first chart alone; None for a new figure with all of them.
    caller : str
        Function that the message about wrong `axes` names, such as "plot.loop".
    label : str, optional
        Name of the answer in the legend, which has one curve of this name on axes that compare several levels.

    Raises
    ------
    PatchfemError
        If `axes` are not those of matplotlib.
    """
    charts = [chart for chart in CHARTS[answer.kind] if not titles or chart.title in titles]
    if label:
        charts = [replace(chart, by="") for chart in charts]
    panels = make_panels({label: answer}, tuple(charts))
    drawn = draw_panels(panels, axes, caller) if panels else None
    if label and axes is not None and drawn is not None:
        _show_all_levels(drawn)
    return drawn


def draw_panels(panels: list[Panel], axes, caller: str):
    """Draw the first panel on Axes, or all of them in a new figure; return the first Axes.

    Parameters
    ----------
    panels : list of Panel
        At least one.
    axes : matplotlib Axes or None
        Where to draw the first panel alone; None for a new figure.
    caller : str
        Function that the message about wrong `axes` names.
    """
    check_axes(axes, caller)
    return draw_panel(panels[0], axes) if axes is not None else make_figure(panels).axes[0]


def check_axes(axes, caller: str) -> None:
    """Raise PatchfemError if the Axes for a picture are given but are not those of matplotlib."""
    if axes is not None and not hasattr(axes, "errorbar"):
        raise PatchfemError(f"{caller}: matplotlib Axes are needed as ax, not {axes!r:.60}")
