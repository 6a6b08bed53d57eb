"""One picture of a study: axes in the style of the package, saved as SVG with the same bytes for the same numbers."""

import re
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

from matplotlib import rc_context
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from patchfem.export.charts.axes import MATPLOTLIB_STYLE

# colours of two curves that are compared, and of what is beside them
BLUE = "#1f5f99"
ORANGE = "#c8551b"
GREY = "#8a8a8a"


@contextmanager
def drawing(
    path: Path, size: tuple, rows: int = 1, columns: int = 1, saving: dict | None = None, **how
):
    """Draw a figure with `rows` by `columns` axes, and write it to `path` when the block ends.

    Parameters
    ----------
    path : Path
    size : tuple of float
        Width and height in inches.
    rows, columns : int
    saving : dict, optional
        Arguments of `savefig`.
    **how
        Arguments of `Figure.subplots`.
    """
    with rc_context(MATPLOTLIB_STYLE):
        figure = Figure(figsize=size)
        FigureCanvasSVG(figure)
        yield figure, figure.subplots(rows, columns, **how)
        text = StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None}, **(saving or {}))
        Path(path).write_text(compact(text.getvalue()), "utf-8")


def compact(text: str) -> str:
    """Shorten an SVG of matplotlib to half its lines.

    Positions are rounded to 0.01 pt, and a path or a row of markers takes one line.
    """

    def places(path) -> str:
        return f'd="{" ".join(re.sub(r"-?[0-9]+[.][0-9]+", lambda one: f"{float(one[0]):.2f}", path[1]).split())}"'

    text = re.sub(r"(?<= )d=\"([^\"]*)\"", places, text)
    text = re.sub(
        r"font-family: [^;\"]*sans-serif", "font-family: 'DejaVu Sans', Verdana, sans-serif", text
    )
    return re.sub(r"(?<=>)\s+(?=<(/|use|path|text|clipPath|rect|/clipPath))", "", text)
