"""The picture of the pressed pieces without OpenGL: the panels of export.panels drawn by matplotlib."""

from pathlib import Path

import matplotlib
import numpy as np

from ..fields.series import Frame
from ..scales import axis_unit
from .panels import Panel, borders, curves, panels
from .pictures import BLUE, ORANGE, STYLE


def draw(frame: Frame, head: str, magnify: float | None, path: Path) -> None:
    """Draw both pieces whole and near their contact, and the stress along the interface, as the ending of `path`
    says."""
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE | {"axes.grid": False}):
        figure = Figure(figsize=(18, 10))
        grid = figure.add_gridspec(2, 2)
        whole, close = panels(frame, magnify)
        _bodies(figure, figure.add_subplot(grid[:, 0]), frame, whole, f"{head}\n{whole.title()}")
        _bodies(figure, figure.add_subplot(grid[0, 1]), frame, close, f"where they touch, {close.title()}")
        axes = figure.add_subplot(grid[1, 1])
        x, shown, unit = curves(frame)
        for (label, values), colour in zip(shown, (BLUE, ORANGE)):
            axes.plot(x, values, color=colour, label=label)
        axes.set(xlabel="x [mm]", ylabel=f"stress on the interface [{unit}]")
        axes.legend()
        figure.savefig(path, dpi=100)


def _bodies(figure, axes, frame: Frame, panel: Panel, text: str) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    unit, scale = axis_unit([panel.top], "Pa")
    size, polygons, values = np.diff(frame.offsets), [], []
    for count in np.unique(size[panel.cells]):
        mine = panel.cells & (size == count)
        corners = frame.connectivity[frame.offsets[:-1][mine][:, None] + np.arange(count)]
        polygons += list(panel.places[corners])
        values.append(frame.cell_data["von_mises"][mine] * scale)
    drawn = PolyCollection(polygons, array=np.concatenate(values), cmap="viridis", edgecolors="none",
                           antialiaseds=False, rasterized=True)
    drawn.set_clim(0, max(panel.top * scale, 1e-12))
    axes.add_collection(drawn)
    for edges, colour in zip(borders(frame, panel.cells), ("black", "white")):
        axes.add_collection(LineCollection(panel.places[edges], colors=colour, linewidths=1.2))
    left, right, bottom, top = panel.window
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal", xlabel="x [mm]", ylabel="y [mm]", title=text)
    figure.colorbar(drawn, ax=axes, label=f"von Mises stress [{unit}]", shrink=0.7)
