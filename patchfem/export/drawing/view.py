"""The pressed pieces in a window or a picture: von Mises stress, motion magnified, stress along the interface.

The one module that touches pyvista. Whether pictures can be drawn with OpenGL is found out in a child process, because
a broken driver ends the process that asks; without it a picture is drawn by matplotlib.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from ...core import Missing, PatchfemError
from ...disk.whole import whole
from ...scales import axis_unit
from ..fields.series import Frame, Series
from . import film, flat, reels
from .panels import Panel, borders, curves, panels

ENDINGS = (".png", ".svg", ".pdf")
SECONDS = 60  # for the child
PROBE = """\
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Plane(), color="red")
assert plotter.screenshot(None, return_img=True).std() > 0, "the picture is empty"
"""
SIZE = (1800, 1000)
COLOURS = "viridis"
FONT = 20
ROOM = (110, 170, 95, 105)  # pixels left, right, under and over the pieces


def view(folder: Path, out: Path | None, frame: int | None = None, magnify: float | None = None, say=print) -> None:
    """Open a window on the fields of a results folder (the last frame or `frame`), or draw them into `out`, of which
    .gif, .mp4 and .html show the last cycle.

    magnify: factor of the drawn motion, one that makes it visible by default. Missing without fields, without a screen
    for the window, without what writes .mp4 or when `out` cannot be written; PatchfemError for another ending, frame or
    factor, and for a film of one frame.
    """
    if magnify is not None and not (np.isfinite(magnify) and magnify >= 0):
        raise PatchfemError(f"--magnify: {magnify} must be 0 or more")
    if out is not None and Path(out).suffix in reels.ENDINGS:
        _film(folder, Path(out), frame, magnify)
        return
    if out is not None and Path(out).suffix not in ENDINGS:
        raise PatchfemError(f"{out}: pictures are written as {', '.join(ENDINGS)}, films as {', '.join(reels.ENDINGS)}")
    with Series(folder) as series:
        one = series.frame(-1 if frame is None else frame)
        head = series.path.parent.resolve().name
        if len(series) > 1:
            head += f", frame {one.number} of 0 to {len(series) - 1}, {one.time:.6g} s"
    if out is None:
        _window(one, head, magnify)
        return
    _picture(one, head, magnify, Path(out), say)
    print(f"{out}: {head}")


def _picture(one: Frame, head: str, magnify, out: Path, say) -> None:
    why = no_opengl() if out.suffix == ".png" else None
    with whole(out) as partial:
        if why is None and out.suffix == ".png":
            _plotter(one, head, magnify, True).screenshot(partial)
        else:
            if why is not None:
                say(f"no working OpenGL ({why}); {out} is drawn by matplotlib")

            flat.draw(one, head, magnify, partial)


def _film(folder: Path, out: Path, frame: int | None, magnify: float | None) -> None:
    if frame is not None:
        raise PatchfemError(f"--frame: {out.suffix} shows the whole last cycle; name a .png for one frame")

    reels.ready(out)
    with Series(folder) as series:
        with whole(out) as partial:
            said = film.shoot(series, series.path.parent.resolve().name, magnify, partial)
    print(f"{out}: {said}")


def _window(one: Frame, head: str, magnify) -> None:
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise Missing("view: there is no screen for a window (DISPLAY is not set); name a picture with -o FILE.png")
    why = no_opengl()
    if why is not None:
        raise Missing(f"view: no working OpenGL for a window ({why}); name a picture with -o FILE.png")
    _plotter(one, head, magnify, False).show(title=f"patchfem: {head}")


def no_opengl() -> str | None:
    """Reason why nothing can be drawn with OpenGL here, None where it can; a child process draws a tiny picture."""
    try:
        done = subprocess.run([sys.executable, "-P", "-c", PROBE], capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return f"a tiny picture took more than {SECONDS:g} s"
    if done.returncode == 0:
        return None
    if done.returncode < 0:
        return f"drawing a tiny picture ended by signal {-done.returncode}"
    last = [line for line in done.stderr.splitlines() if line.strip()][-1:]
    return last[0].strip() if last else f"drawing a tiny picture ended with code {done.returncode}"


def _plotter(one: Frame, head: str, magnify, off_screen: bool):
    import pyvista as pv
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # it reports every display it does not find
    plotter = pv.Plotter(off_screen=off_screen, window_size=SIZE, shape=(2, 2), groups=[(slice(None), 0)], border=False)
    plotter.set_background("white")
    whole, close = panels(one, magnify)
    plotter.subplot(0, 0)
    _bodies(plotter, one, whole, f"{head}\n{whole.title()}", True)
    plotter.subplot(0, 1)
    _bodies(plotter, one, close, f"where they touch, {close.title(False)}", False)
    plotter.subplot(1, 1)
    _chart(plotter, one)
    return plotter


def _bodies(plotter, one: Frame, panel: Panel, text: str, scaled: bool) -> None:
    import pyvista as pv

    unit, scale = axis_unit([panel.top], "Pa")
    places = np.column_stack([panel.places, np.zeros(len(panel.places))])
    sizes = np.diff(one.offsets)
    faces = np.insert(one.connectivity, one.offsets[:-1], sizes)
    mesh = pv.PolyData(places, faces=faces[np.repeat(panel.cells, sizes + 1)])
    mesh.cell_data["von Mises"] = one.cell_data["von_mises"][panel.cells] * scale
    plotter.add_mesh(mesh, scalars="von Mises", cmap=COLOURS, clim=(0, max(panel.top * scale, 1e-12)), lighting=False,
                     show_scalar_bar=False)
    if scaled:  # the other panel has the same colours
        plotter.add_scalar_bar(f"von Mises\n[{unit}]\n", mapper=plotter.mapper, vertical=True, color="black",
                               title_font_size=FONT, label_font_size=FONT, fmt="%.3g", n_labels=5, width=0.045,
                               height=0.56, position_x=0.87, position_y=0.2, unconstrained_font_size=True)
    for edges, colour in zip(borders(one, panel.cells), ("black", "white")):
        if len(edges):
            lines = pv.PolyData(places, lines=np.insert(edges, 0, 2, axis=1).ravel())
            plotter.add_mesh(lines, color=colour, line_width=2, lighting=False)
    said = plotter.add_text(text, font_size=FONT * 0.6, color="black", position=(0.03, 0.98), viewport=True)
    said.GetTextProperty().SetVerticalJustificationToTop()
    _axes(plotter, panel, _look(plotter, panel.window))


def _look(plotter, window: tuple) -> float:
    """The camera square on the window, with room for the axes and the scale beside it; mm per pixel."""
    left, right, bottom, top = window
    view = plotter.renderer.GetViewport()
    wide, high = ((view[k + 2] - view[k]) * SIZE[k] for k in (0, 1))
    before, after, under, over = ROOM
    per_pixel = max((right - left) / (wide - before - after), (top - bottom) / (high - under - over))
    middle = ((left + right + per_pixel * (after - before)) / 2, (bottom + top + per_pixel * (over - under)) / 2)
    plotter.view_xy()
    camera = plotter.camera
    camera.parallel_projection = True
    camera.focal_point, camera.position = (*middle, 0), (*middle, 1)
    camera.parallel_scale = per_pixel * high / 2
    return per_pixel


def _axes(plotter, panel: Panel, pixel: float) -> None:
    import pyvista as pv

    left, right, bottom, top = panel.window
    x, y = left - 12 * pixel, bottom - 12 * pixel
    lines = [((left, y), (right, y)), ((x, bottom), (x, top))]
    along, up = panel.ticks()
    lines += [((at, y), (at, y - 8 * pixel)) for at in along] + [((x, at), (x - 8 * pixel, at)) for at in up]
    ends = np.insert(np.array(lines).reshape(-1, 2), 2, 0.0, axis=1)
    plotter.add_mesh(pv.line_segments_from_points(ends), color="black", line_width=1, lighting=False)
    for places, texts, across, upright in (
            ([(at, y - 12 * pixel) for at in along], [f"{at:.6g}" for at in along], "center", "top"),
            ([(x - 12 * pixel, at) for at in up], [f"{at:.6g}" for at in up], "right", "center"),
            ([((left + right) / 2, y - 40 * pixel)], ["x [mm]"], "center", "top"),
            ([(x, top + 12 * pixel)], ["y [mm]"], "right", "bottom")):
        if texts:
            plotter.add_point_labels(np.insert(np.array(places), 2, 0.0, axis=1), texts, font_size=FONT, shape=None,
                                     text_color="black", bold=False, show_points=False, always_visible=True,
                                     justification_horizontal=across, justification_vertical=upright)


def _chart(plotter, one: Frame) -> None:
    import pyvista as pv

    x, shown, unit = curves(one)
    chart = pv.Chart2D(x_label="x [mm]", y_label=f"stress on the interface [{unit}]")
    for (label, values), colour in zip(shown, ("#1f5f99", "#c8551b")):
        chart.line(x, values, color=colour, width=3, label=label)
    for axis in (chart.x_axis, chart.y_axis):
        axis.label_size, axis.tick_label_size, axis.label_font_size = FONT, FONT - 3, FONT
    chart.legend_visible = True
    chart.background_color = "white"
    plotter.add_chart(chart)
