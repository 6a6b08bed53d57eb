"""One picture of a study: axes in the style of the package, saved as SVG with the same bytes for the same numbers."""

from contextlib import contextmanager
from pathlib import Path

from matplotlib import rc_context
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from patchfem.export.drawing.pictures import STYLE


@contextmanager
def drawing(path: Path, size: tuple, rows: int = 1, columns: int = 1, saving: dict | None = None, **how):
    """(figure, its axes) of `rows` by `columns`; written to `path` when the block ends.

    size: width and height in inches; how: arguments of `Figure.subplots`; saving: arguments of `savefig`.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=size)
        FigureCanvasSVG(figure)
        yield figure, figure.subplots(rows, columns, **how)
        figure.savefig(path, metadata={"Date": None}, **(saving or {}))
