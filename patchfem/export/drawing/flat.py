"""Picture of the pressed pieces: the panels of `panels` drawn by matplotlib, without OpenGL.

A picture is drawn once; a film updates the same picture frame after frame.
"""

from pathlib import Path

import matplotlib
import numpy as np

from ...formatting import choose_axis_unit
from ..fields.series import Frame
from .panels import Panel, interface_curves, make_panels, outer_edges
from .pictures import BLUE, ORANGE, STYLE

STYLE = STYLE | {"axes.grid": False}


def draw_frame(frame: Frame, head: str, magnify: float | None, path: Path) -> None:
    """Draw both pieces, their contact and the stress along the interface into a file.

    Parameters
    ----------
    frame : Frame
    head : str
        First line of the title.
    magnify : float or None
        Magnification of the motion; None selects one that makes it visible.
    path : Path
        File whose suffix chooses the format.
    """
    with matplotlib.rc_context(STYLE):
        Picture(frame, head, make_panels(frame, magnify), (12, 20 / 3)).figure.savefig(
            path, dpi=150
        )


class Picture:
    """Figure of one frame, which can be changed to another frame of the same series.

    Axes and colours stay as they are first drawn.

    Parameters
    ----------
    frame : Frame
    head : str
        First line of the title.
    shown : tuple of Panel
        Panels of the whole pieces and of their contact.
    size : tuple
        [inch]
    reach : tuple, optional
        Minimum and maximum stress [Pa] of the axis of the curves; by default those of the frame.
    """

    def __init__(
        self, frame: Frame, head: str, panels: tuple, size: tuple, reach: tuple | None = None
    ):
        from matplotlib.figure import Figure

        self.figure = Figure(figsize=size)
        grid = self.figure.add_gridspec(2, 2)
        self.bodies = [
            _Bodies(self.figure.add_subplot(grid[at]), frame, panel)
            for at, panel in zip(((slice(None), 0), (0, 1)), panels)
        ]
        axes = self.figure.add_subplot(grid[1, 1])
        self.reach = reach
        x, stresses, unit = interface_curves(frame, reach)
        self.lines = [
            axes.plot(x, values, color=colour, label=label)[0]
            for (label, values), colour in zip(stresses, (BLUE, ORANGE))
        ]
        axes.set(xlabel="x [mm]", ylabel=f"stress on the interface [{unit}]")
        if reach is not None:
            low, high = np.array(reach) * choose_axis_unit(reach, "Pa")[1]
            axes.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
        axes.legend(loc="best" if reach is None else "upper right")
        cell_collection = self.bodies[0].cells[0][2]
        unit = choose_axis_unit([panels[0].top], "Pa")[0]
        self.figure.colorbar(
            cell_collection, ax=self.bodies[0].axes, label=f"von Mises stress [{unit}]", shrink=0.7
        )
        self._head(head, panels)

    def show(self, frame: Frame, head: str, panels: tuple) -> None:
        """Change the pieces and the curves to those of another frame.

        Parameters
        ----------
        frame : Frame
        head : str
            First line of the title.
        panels : tuple of Panel
            The whole pieces and the contact.
        """
        for bodies, panel in zip(self.bodies, panels):
            bodies.show(frame, panel)
        for line, (_, values) in zip(self.lines, interface_curves(frame, self.reach)[1]):
            line.set_ydata(values)
        self._head(head, panels)

    def freeze_layout(self, dpi: float) -> None:
        """Lay out the axes of the figure, and keep this layout for later frames."""
        self.figure.set_dpi(dpi)
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")

    def _head(self, head: str, panels: tuple) -> None:
        """Write the titles of both panels of the figure."""
        whole_bodies, contact_bodies = self.bodies
        whole_bodies.axes.set_title(f"{head}\n{panels[0].title()}")
        contact_bodies.axes.set_title(f"where they touch, {panels[1].title(False)}")


class _Bodies:
    """Drawn cells of both pieces, coloured by their stress, and the outlines of the pieces."""

    def __init__(self, axes, frame: Frame, panel: Panel):
        from matplotlib.collections import LineCollection, PolyCollection

        self.scale = choose_axis_unit([panel.top], "Pa")[1]
        self.axes = axes
        self.edges = outer_edges(frame, panel.cells)
        # (cell selection, corners, collection) of the triangles and of the quadrilaterals.
        self.cells = []
        size = np.diff(frame.offsets)
        for count in np.unique(size[panel.cells]):
            is_drawn = panel.cells & (size == count)
            corners = frame.connectivity[frame.offsets[:-1][is_drawn][:, None] + np.arange(count)]
            collection = PolyCollection(
                panel.places[corners],
                cmap="viridis",
                edgecolors="none",
                antialiaseds=False,
                rasterized=True,
            )
            collection.set_clim(0, max(panel.top * self.scale, 1e-12))
            axes.add_collection(collection)
            self.cells.append((is_drawn, corners, collection))
        self.borders = [
            LineCollection([], colors=colour, linewidths=1.2) for colour in ("black", "white")
        ]
        for border in self.borders:
            axes.add_collection(border)
        left, right, bottom, top = panel.window
        axes.set(
            xlim=(left, right), ylim=(bottom, top), aspect="equal", xlabel="x [mm]", ylabel="y [mm]"
        )
        self.show(frame, panel)

    def show(self, frame: Frame, panel: Panel) -> None:
        """Change the drawn cells and borders to those of another frame."""
        for is_drawn, corners, collection in self.cells:
            collection.set_verts(panel.places[corners])
            collection.set_array(frame.cell_data["von_mises"][is_drawn] * self.scale)
        for border, edges in zip(self.borders, self.edges):
            border.set_segments(panel.places[edges])
