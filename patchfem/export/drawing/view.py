"""Draw the pressed pieces in a window or a picture: von Mises stress, motion, interface stress.

Pictures are drawn by matplotlib (`flat`), the window by pyvista. A
child process checks whether OpenGL can draw the window, because VTK 9.7 crashes without a working
driver.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from ...core import Missing, PatchfemError
from ...disk.atomic_write import write_atomically
from ...formatting import choose_axis_unit
from ..fields.series import Frame, Series
from ..summary import read_summary
from . import film, flat
from .panels import Panel, interface_curves, make_panels, outer_edges

PICTURE_EXTENSIONS = (".png", ".svg", ".pdf")
# Time limit [s] of the test picture; starting PyVista takes up to 9 s on a busy machine.
MAX_PROBE_SECONDS = 60
PROBE = """\
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Plane(), color="red")
assert plotter.screenshot(None, return_img=True).std() > 0, "the picture is empty"
"""
WINDOW_SIZE = (1800, 1000)
COLOURS = "viridis"
FONT_SIZE = 20


def view(
    folder: Path, out: Path | None, frame: int | None = None, magnify: float | None = None
) -> None:
    """Show the fields of a results folder in a window, or draw them into a file.

    Parameters
    ----------
    folder : Path
    out : Path or None
        Picture, or film (.gif, .mp4) of the last cycle (of a bench: the whole slide); None for a window.
    frame : int, optional
        Number of the frame; by default the last.
    magnify : float, optional
        Factor of the motion; by default one that makes it visible.

    Raises
    ------
    Missing
        If there are no fields, no screen for the window, no program that writes .mp4, or if `out`
        cannot be written.
    PatchfemError
        For an impossible suffix, frame or factor, and for a film of a single frame.
    """
    if magnify is not None and not (np.isfinite(magnify) and magnify >= 0):
        raise PatchfemError(f"--magnify: {magnify} must be 0 or more")
    if out is not None and Path(out).suffix in film.FILM_EXTENSIONS:
        _write_film(folder, Path(out), frame, magnify)
        return
    if out is not None and Path(out).suffix not in PICTURE_EXTENSIONS:
        raise PatchfemError(
            f"{out}: pictures are written as {', '.join(PICTURE_EXTENSIONS)}, films as {', '.join(film.FILM_EXTENSIONS)}"
            " or .html"
        )
    with Series(folder) as series:
        frame_fields = series.frame(-1 if frame is None else frame)
        head = _find_title(series)
        if len(series) > 1:
            last = len(series) - 1
            place = f"of 0 to {last}" if frame_fields.number < last else "the last"
            head += f", frame {frame_fields.number} ({place}), {frame_fields.time:.6g} s"
    if out is None:
        _open_window(frame_fields, head, magnify)
        return
    with write_atomically(Path(out)) as partial:
        flat.draw_frame(frame_fields, head, magnify, partial)
    print(f"{out}: {head}")


def _find_title(series: Series) -> str:
    """Return the title of the scene of a results folder, or the name of the folder if it has none."""
    folder = series.path.parent.resolve()
    try:
        title = read_summary(folder / "summary.json")["title"]
    except (OSError, ValueError):
        title = ""
    return title or folder.name


def _write_film(folder: Path, out: Path, frame: int | None, magnify: float | None) -> None:
    """Write the last cycle of a results folder as an animation."""
    if frame is not None:
        raise PatchfemError(
            f"--frame: {out.suffix} shows all frames of the motion; use a .png for one frame"
        )
    film.check_ffmpeg(out)
    with Series(folder) as series:
        with write_atomically(out) as partial:
            message = film.write_film(series, _find_title(series), magnify, partial)
    print(f"{out}: {message}")


def _open_window(frame: Frame, head: str, magnify) -> None:
    """Open a window with the fields; raise Missing if there is no screen or no OpenGL."""
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise Missing(
            "view: there is no screen for a window (DISPLAY is not set); write a picture with -o FILE.png"
        )
    why = explain_missing_opengl()
    if why is not None:
        raise Missing(
            f"view: no working OpenGL for a window ({why}); write a picture with -o FILE.png"
        )
    make_plotter(frame, head, magnify).show(title=f"patchfem: {head}")


def explain_missing_opengl() -> str | None:
    """Return the reason why OpenGL is not available, or None if it is available.

    A child process draws a tiny picture.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", PROBE],
            capture_output=True,
            text=True,
            timeout=MAX_PROBE_SECONDS,
        )
    except subprocess.TimeoutExpired:
        return f"the test drawing of a small picture took more than {MAX_PROBE_SECONDS:g} s"
    if done.returncode == 0:
        return None
    if done.returncode < 0:
        return f"the test drawing of a small picture was killed by signal {-done.returncode}"
    last = [line for line in done.stderr.splitlines() if line.strip()][-1:]
    return (
        last[0].strip()
        if last
        else f"the test drawing of a small picture ended with exit code {done.returncode}"
    )


def make_plotter(frame: Frame, head: str, magnify: float | None, off_screen: bool = False):
    """Return the pyvista Plotter of the window: both pieces, their contact, and the stresses.

    Parameters
    ----------
    frame : Frame
    head : str
        First line of the title.
    magnify : float or None
        Magnification of the motion; None selects one that makes it visible.
    off_screen : bool
    """
    import pyvista as pv
    from vtkmodules.vtkCommonCore import vtkLogger

    # VTK would report every display that it does not find.
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    plotter = pv.Plotter(
        off_screen=off_screen,
        window_size=WINDOW_SIZE,
        shape=(2, 2),
        groups=[(slice(None), 0)],
        border=False,
    )
    plotter.set_background("white")
    whole_panel, close = make_panels(frame, magnify)
    plotter.subplot(0, 0)
    _draw_pieces(plotter, frame, whole_panel, f"{head}\n{whole_panel.title()}", True)
    plotter.subplot(0, 1)
    _draw_pieces(plotter, frame, close, f"where they touch, {close.title(False)}", False)
    plotter.subplot(1, 1)
    _draw_stresses(plotter, frame)
    return plotter


def _draw_pieces(plotter, frame: Frame, panel: Panel, text: str, has_colour_bar: bool) -> None:
    """Draw both pieces of a frame in a panel of the window."""
    import pyvista as pv

    unit, scale = choose_axis_unit([panel.top], "Pa")
    places = np.column_stack([panel.places, np.zeros(len(panel.places))])
    sizes = np.diff(frame.offsets)
    faces = np.insert(frame.connectivity, frame.offsets[:-1], sizes)
    mesh = pv.PolyData(places, faces=faces[np.repeat(panel.cells, sizes + 1)])
    mesh.cell_data["von Mises"] = frame.cell_data["von_mises"][panel.cells] * scale
    plotter.add_mesh(
        mesh,
        scalars="von Mises",
        cmap=COLOURS,
        clim=(0, max(panel.top * scale, 1e-12)),
        lighting=False,
        show_scalar_bar=False,
    )
    if has_colour_bar:  # the other panel has the same colour scale
        plotter.add_scalar_bar(
            f"von Mises\n[{unit}]\n",
            mapper=plotter.mapper,
            vertical=True,
            color="black",
            title_font_size=FONT_SIZE,
            label_font_size=FONT_SIZE,
            fmt="%.3g",
            n_labels=5,
            width=0.045,
            height=0.56,
            position_x=0.87,
            position_y=0.2,
            unconstrained_font_size=True,
        )
    for edges, colour in zip(outer_edges(frame, panel.cells), ("black", "white")):
        if len(edges):
            lines = pv.PolyData(places, lines=np.insert(edges, 0, 2, axis=1).ravel())
            plotter.add_mesh(lines, color=colour, line_width=2, lighting=False)
    title_actor = plotter.add_text(
        text, font_size=FONT_SIZE * 0.6, color="black", position=(0.03, 0.98), viewport=True
    )
    title_actor.GetTextProperty().SetVerticalJustificationToTop()
    plotter.view_xy()
    plotter.enable_parallel_projection()
    plotter.show_bounds(
        bounds=(*panel.window, 0, 0),
        xtitle="x [mm]",
        ytitle="y [mm]",
        font_size=FONT_SIZE - 6,
        bold=False,
        location="outer",
        show_zaxis=False,
        show_zlabels=False,
    )
    plotter.reset_camera(bounds=(*panel.window, 0, 0))
    plotter.camera.zoom(0.95)  # leaves space for the colour bar


def _draw_stresses(plotter, frame: Frame) -> None:
    """Draw the stresses along the interface in the window."""
    import pyvista as pv

    x, curves, unit = interface_curves(frame)
    chart = pv.Chart2D(x_label="x [mm]", y_label=f"stress on the interface [{unit}]")
    for (label, values), colour in zip(curves, ("#1f5f99", "#c8551b")):
        chart.line(x, values, color=colour, width=3, label=label)
    for axis in (chart.x_axis, chart.y_axis):
        axis.label_size = FONT_SIZE
        axis.tick_label_size = FONT_SIZE - 3
        axis.label_font_size = FONT_SIZE
    chart.legend_visible = True
    chart.background_color = "white"
    plotter.add_chart(chart)
