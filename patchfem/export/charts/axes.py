"""Panels as matplotlib Axes, for pictures and for `plot` in Python."""

import io
from functools import partial
from pathlib import Path

import numpy as np

from ...core import PatchfemError
from ...disk.atomic_write import write_atomically
from ..answer import Answer
from ..rows import CHARTS
from .panels import Curve, Panel, make_panels
from .plotly import CURVE_COLOURS, ERROR_BAND_OPACITY, STATE_COLOURS

PICTURE_ENDINGS = (".png", ".svg", ".pdf")
# Number of charts of a picture, 1 for all other kinds of answers. A backbone needs frequency, damping and force.
N_PICTURE_CHARTS = {"backbone": 3}

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
PANEL_SIZE_INCHES = (6.4, 4.2)  # width and height


def draw_panel(panel: Panel, axes):
    """Draw a panel on matplotlib Axes and return them; of a menu, the first choice."""
    if panel.choices:
        return draw_panel(panel.choices[0], axes)
    if panel.style in ("map", "film"):
        _draw_map(panel, axes)
    else:
        for number, curve in enumerate(panel.curves):
            _draw_curve(curve, panel.style, CURVE_COLOURS[number % len(CURVE_COLOURS)], axes)
    for position in panel.marks:
        axes.axvline(position, color="0.5", lw=1, ls=":")
    axes.set(title=panel.title, xlabel=panel.x.label, ylabel=panel.y.label)
    axes.set(**{f"{name}scale": "log" for name in "xy" if getattr(panel, name).is_log})
    if sum(bool(curve.name) for curve in panel.curves) > 1 and panel.style != "map":
        axes.legend()
    return axes


def _draw_curve(curve: Curve, style: str, colour: str, axes) -> None:
    """Draw points with error bars, or a line with its band, into matplotlib axes.

    The data are in display units. `style` is that of the panel, and `colour` applies to line, symbols and band.
    """
    if style in ("points", "dots") and not curve.is_line:
        if style == "dots":
            axes.plot(curve.x, curve.y, color=colour, lw=1)

        # Error bars below the symbols, of which each kind is plotted by itself
        if curve.low is not None:
            ends = np.nan_to_num([curve.y - curve.low, curve.high - curve.y])
            axes.errorbar(curve.x, curve.y, ends, fmt="none", ecolor=colour)
        symbols = np.full(curve.x.size, "circle") if curve.symbols is None else curve.symbols
        for symbol, marker in MATPLOTLIB_MARKERS.items():
            points = (values[symbols == symbol] for values in (curve.x, curve.y))
            label = curve.name if symbol == "circle" else None  # the entry of the legend
            axes.plot(*points, marker, color=colour, label=label, zorder=3)
        return

    # A heavier line lies above the others.
    options = {
        "lw": MATPLOTLIB_STYLE["lines.linewidth"] * curve.weight,
        "zorder": 2 + curve.weight / 10,
    }
    axes.plot(curve.x, curve.y, color=colour, label=curve.name, **options)
    filling = {"color": colour, "alpha": ERROR_BAND_OPACITY, "lw": 0}
    if curve.low is not None:
        axes.fill_between(curve.x, curve.low, curve.high, **filling)
    if style == "area":
        axes.fill_between(curve.x, curve.y, **filling)


def _draw_map(panel: Panel, axes) -> None:
    """Draw a map with its colour bar; of a film, the last frame."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    curve = panel.curves[-1]
    options = {"cmap": "viridis"}
    if curve.meanings:
        count = len(curve.meanings)
        edges = np.arange(count + 1) - 0.5
        options = {
            "cmap": ListedColormap(STATE_COLOURS[:count]),
            "norm": BoundaryNorm(edges, count),
        }
    elif np.nanmin(curve.y) < 0 < np.nanmax(curve.y):
        limit = np.nanmax(np.abs(curve.y))
        # red is positive, as in the scale of plotly.js on the page
        options = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit}
    mesh = axes.pcolormesh(curve.x, curve.rows, curve.y, shading="nearest", **options)
    bar = axes.figure.colorbar(mesh, label="" if curve.meanings else panel.colour_label)
    if curve.meanings:
        bar.set_ticks(range(len(curve.meanings)), labels=curve.meanings)


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


def write_plot(answer: Answer, path: Path) -> None:
    """Write the first chart of an answer, and of a backbone all three charts, as .png, .svg or .pdf.

    Raises
    ------
    PatchfemError
        For another ending, or if the answer has no chart.
    Missing
        If the file cannot be written.
    """
    ending = find_picture_format(path)
    panels = make_panels({"": answer}, CHARTS[answer.kind])
    if not panels:
        raise PatchfemError(f"{path}: this answer has no chart")
    with write_atomically(path) as partial:
        figure = make_figure(panels[: N_PICTURE_CHARTS.get(answer.kind, 1)])
        save_figure(figure, partial, ending)


def draw_charts(answer: Answer, titles: tuple[str, ...], axes, caller: str):
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

    Raises
    ------
    PatchfemError
        If `axes` are not those of matplotlib.
    """
    charts = [chart for chart in CHARTS[answer.kind] if not titles or chart.title in titles]
    panels = make_panels({"": answer}, tuple(charts))
    return draw_panels(panels, axes, caller) if panels else None


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
