"""Pictures and films of both pieces with their stress and magnified motion, by matplotlib."""

import re
import shutil
import subprocess
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import Missing, PatchfemError
from ..disk.atomic_write import write_atomically
from ..formatting import choose_axis_unit
from .charts.axes import save_figure
from .fields.film import find_contact_window, select_last_frames
from .fields.vtkhdf import VTK_FIELDS, Frames, collect_frames

FILM_ENDINGS = (".gif", ".mp4", ".html")
PIXELS_PER_INCH = 100
FILM_SECONDS = 2.4  # duration of a film [s] within the limits of the frame rate
FRAME_RATE_LIMITS_HZ = (3.0, 25.0)
# Fraction of the stresses that the colours cover; larger ones are peaks in corners.
COLOURED_STRESS_FRACTION = 0.998
MM_PER_M = 1e3
# Fields of the picture of a face, in the order of its panels
DRAWN_FIELDS = ("normal_stress", "gap", "shear_stress", "slip")


# left, right, bottom and top of a picture [m]
Window = tuple[float, float, float, float]


class DrawnPieces(NamedTuple):
    """Both pieces with magnified motion in a window, ready to be drawn.

    - window: left, right, bottom and top [m].
    - places (f, n, 2): positions of the nodes [mm].
    - cells (c, 4): node numbers; a triangle has its last node twice.
    - is_inside (c,): whether the centre of a cell is in the window.
    - captions: magnification of motion and slide in each frame.
    """

    window: Window
    places: np.ndarray
    cells: np.ndarray
    is_inside: np.ndarray
    captions: list[str]


def magnify_pieces(
    frames: Frames, numbers: np.ndarray, window: Window, magnify: float | None = None
) -> DrawnPieces:
    """Return both pieces with the same magnification in several frames.

    The slide of the upper piece as a rigid body has a factor of its own: the factor that makes the
    deformation visible would move it by its length. The shape of its face, which is part of the gap
    and not of the mesh, is added to its motion, so that the drawn gap is the computed one.

    Parameters
    ----------
    frames : Frames
        Fields of both pieces.
    numbers : (f,) array of int
        Frames that are drawn.
    window : tuple of float
        Left, right, bottom and top [m].
    magnify : float, optional
        Factor of the motion; by default one that makes it visible.
    """
    lower, upper, line = (frames.blocks[name] for name in ("lower", "upper", "interface"))
    # Displacements in the chosen frames. The slide of the holder is drawn with a factor of its own.
    low_motion, motion, face_motion = (
        block.point_data["displacement"][numbers, :, :2].astype(float)
        for block in (lower, upper, line)
    )
    slide = line.point_data["holder_slide"][numbers, 0].astype(float)
    motion[..., 0] -= slide[:, None]

    # the face moves to where the gap above the lower piece ends; inside the piece this part fades towards its far face
    x, y = upper.points[:, :2].T
    height = y.max()
    face = np.flatnonzero(y < 1e-9 * height)
    face = face[np.argsort(x[face])]
    surface = face_motion[..., 1] + line.point_data["gap"][numbers]
    for row, target in zip(motion[..., 1], surface):
        missing = target - np.interp(line.points[:, 0], x[face], row[face])
        row += np.interp(x, line.points[:, 0], missing) * (1 - y / height)

    points = np.concatenate([lower.points, upper.points])[:, :2]
    cells = np.concatenate([lower.cells, upper.cells + len(lower.points)])
    low, high = np.reshape(window, (2, 2)).T
    centres = points[cells].mean(axis=1)
    is_inside = ((centres >= low) & (centres <= high)).all(axis=1)

    # magnification from the motion that is seen in the window
    all_motion = np.concatenate([low_motion, motion], axis=1)
    width, depth = high - low
    if magnify is None:
        seen = all_motion[:, cells[is_inside], 1]
        # Largest motion as drawn, over the height of the contact window
        magnify = _choose_visible_factor(0.05 * depth, seen)
    # Largest slide of the upper piece as drawn, over its length
    slide_factor = min(magnify, 1.0) * _choose_visible_factor(0.03 * width, slide)
    places = points + magnify * all_motion
    places[:, len(lower.points) :, 0] += slide_factor * slide[:, None]
    slid = ", slide of {:.3g} um × {:g}" if slide.any() else ""
    captions = [f"motion × {magnify:g}" + slid.format(1e6 * one, slide_factor) for one in slide]
    return DrawnPieces(window, MM_PER_M * places, cells, is_inside, captions)


def _choose_visible_factor(length: float, motion: np.ndarray) -> float:
    """Return the factor 1, 2 or 5 times a power of ten that draws a motion [m] at most as a length [m]."""
    largest = np.abs(motion).max(initial=0.0)
    if largest == 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(length / largest))
    return float(max(step * power for step in (1, 2, 5) if step * power * largest <= length))


def draw_cells(axes, drawn: DrawnPieces, stress: np.ndarray, **style):
    """Draw the cells of a window, coloured by a stress.

    Parameters
    ----------
    axes : matplotlib Axes
        Receives cells, limits, labels and a title.
    drawn : DrawnPieces
        Both pieces in f frames.
    stress : (f, c) array
        Value of each cell in each frame, which chooses its colour.
    style : dict
        Options of the PolyCollection, such as `cmap` and `clim`.

    Returns
    -------
    cells : matplotlib PolyCollection
    show : callable
        Takes the index of the frame that is drawn; at first it is the last one.
    """
    from matplotlib.collections import PolyCollection

    cells = PolyCollection([], antialiaseds=False, rasterized=True, **style)

    def show(index: int) -> None:
        """Move the cells to their positions in a frame, and colour them by the stress in it."""
        cells.set_verts(drawn.places[index][drawn.cells[drawn.is_inside]])
        cells.set_array(stress[index, drawn.is_inside])
        axes.set_title(drawn.captions[index])

    axes.add_collection(cells)
    left, right, bottom, top = MM_PER_M * np.array(drawn.window)
    margin = 0.08 * (top - bottom)  # for the motion that leaves the window
    axes.set(xlim=(left - margin, right + margin), ylim=(bottom - margin, top + margin))
    axes.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    show(-1)
    return cells, show


def draw_pieces(
    frames: Frames, numbers: np.ndarray, title: str = "", magnify: float | None = None, onto=None
):
    """Draw the von Mises stress in both pieces, as a whole and around their contact.

    Parameters
    ----------
    frames : Frames
        Fields of both pieces.
    numbers : (f,) array of int
        Frames that share windows, colours and magnification; the last one is drawn.
    title : str
        First words of the title, before the time.
    magnify : float, optional
        Factor of the motion.
    onto : matplotlib Axes, optional
        Axes for the picture of both pieces as a whole; that of the contact is omitted.

    Returns
    -------
    figure : matplotlib Figure
    show : callable
        Takes the index of the frame that is drawn.
    """
    from matplotlib.figure import Figure

    low, high = frames.blocks["lower"].points.min(axis=0), frames.blocks["upper"].points.max(axis=0)
    windows = ((low[0], high[0], low[1], high[1]), find_contact_window(frames))
    # Width and height; with PIXELS_PER_INCH they give even numbers of pixels, which video formats
    # need
    figure = Figure(figsize=(12.0, 5.2), dpi=PIXELS_PER_INCH, layout="constrained")
    panels = figure.subplots(1, 2) if onto is None else [onto]

    # All frames and panels have the same colours.
    parts = [frames.blocks[side].cell_data["von_mises"] for side in ("lower", "upper")]
    stress = np.concatenate([values[numbers] for values in parts], axis=1)
    limit = np.quantile(stress, COLOURED_STRESS_FRACTION)
    unit, scale = choose_axis_unit([limit], "Pa")
    changes = []
    for axes, window in zip(panels, windows):
        drawn = magnify_pieces(frames, numbers, window, magnify)
        style = {"cmap": "viridis", "clim": (0, scale * limit or 1.0)}
        cells, change = draw_cells(axes, drawn, scale * stress, **style)
        changes.append(change)
    extend = "max" if stress.max() > limit else "neither"
    label = f"von Mises stress [{unit}]"
    panels[0].figure.colorbar(cells, ax=panels, extend=extend, label=label, shrink=0.7)

    def show(index: int) -> None:
        """Change title, positions and colours of the figure to those of a frame."""
        figure.suptitle(f"{title}, {frames.times[numbers[index]]:.6g} s")
        for change in changes:
            change(index)

    show(-1)
    return figure, show


def draw_result(result, onto=None):
    """Draw the pieces or the face of a run at its end; return the Axes, which are `onto` if it is given."""
    figure = draw_frame(collect_frames(result), -1, onto=onto)
    return onto or figure.axes[0]


def draw_frame(frames: Frames, number: int, title: str = "", magnify=None, onto=None):
    """Draw the pieces with their stress, or the fields over a face, in one frame, and return the figure.

    Parameters
    ----------
    frames : Frames
        Fields of a run.
    number : int
        Number of the frame.
    title : str
        First words of the title.
    magnify : float, optional
        Factor of the motion of pieces; None for one that makes it visible.
    onto : matplotlib Axes, optional
        Axes for the pieces, or for the pressure over a face.
    """
    if not frames.is_face:
        figure, _ = draw_pieces(
            frames, np.array([number % len(frames.times)]), title, magnify, onto
        )
        return figure
    block = frames.blocks["interface"]
    panels = {name: block.cell_data[name] for name in DRAWN_FIELDS if name in block.cell_data}
    if onto is not None:
        axes_list = [onto]
    else:
        from matplotlib.figure import Figure

        # Width and height of the maps of a face
        figure = Figure(figsize=(11.0, 8.0), dpi=PIXELS_PER_INCH, layout="constrained")
        axes_list = figure.subplots(2, 2).ravel()
        figure.suptitle(f"{title}, {frames.times[number]:.6g} s")

    # A map of each field
    x, y = (np.unique(block.points[:, k]) for k in (0, 1))
    length_unit, length_scale = choose_axis_unit([x[-1]], "m")
    for axes, (name, values) in zip(axes_list, panels.items()):
        values = values[number % len(values)].reshape(y.size - 1, x.size - 1)
        unit, scale = choose_axis_unit([np.abs(values).max()], VTK_FIELDS[name].unit)
        cells = axes.pcolormesh(length_scale * x, length_scale * y, scale * values, cmap="viridis")
        axes.figure.colorbar(cells, ax=axes, label=f"{name.replace('_', ' ')} [{unit}]")
        axes.set(aspect="equal", xlabel=f"x [{length_unit}]", ylabel=f"y [{length_unit}]")
    for axes in axes_list[len(panels) :]:
        axes.set_axis_off()
    return axes_list[0].figure


def write_picture(frames: Frames, number: int, title: str, magnify: float | None, out: Path) -> str:
    """Write a picture of one frame, and return a line on it.

    Parameters
    ----------
    frames : Frames
        Fields of a run.
    number : int
        Number of the frame.
    title : str
        First words of the title.
    magnify : float or None
        Factor of the motion; None for one that makes it visible.
    out : Path
        File to write.
    """
    with write_atomically(out) as partial:
        figure = draw_frame(frames, number, title, magnify)
        save_figure(figure, partial, out.suffix[1:].lower(), 1.5 * PIXELS_PER_INCH)
    last = len(frames.times) - 1
    return f"{out}: {title}, frame {number} of 0 to {last}, {frames.times[number]:.6g} s"


def _make_page(player: str, title: str) -> str:
    """Return the page of a player of matplotlib, with words for the icons that it would load from the network."""
    player = re.sub(r"<link[^>]*>", "", player)
    player = re.sub(r'(<button title="([^"]*)"[^>]*>)\s*<i [^>]*></i>', r"\1\2", player)
    player = player.replace("width: 36px", "padding: 4px")
    return f'<!DOCTYPE html><meta charset="utf-8"><title>{escape(title)}</title>{player}'


def write_film(frames: Frames, title: str, magnify: float | None, out: Path) -> str:
    """Write the last cycle as .gif or .mp4, or as a page with a slider, and return a line on it.

    Parameters
    ----------
    frames : Frames
        Fields of both pieces.
    title : str
        First words of the title.
    magnify : float or None
        Factor of the motion; None for one that makes it visible.
    out : Path
        File to write.

    Raises
    ------
    PatchfemError
        For a film of a single frame.
    Missing
        If ffmpeg, which writes .mp4, is not installed or fails.
    """
    from matplotlib import animation, rcParams

    numbers = select_last_frames(frames.times)
    if len(numbers) < 2 and out.suffix != ".html":
        raise PatchfemError(
            f"{frames.path}: contains only one frame, so there is no motion to show; write a "
            "picture with -o FILE.png"
        )
    if out.suffix == ".mp4":
        rcParams["animation.ffmpeg_path"] = _find_ffmpeg(out)
    # `show` draws the frame with a given number in the figure.
    figure, show = draw_pieces(frames, numbers, title, magnify)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # so that the panels stay at their places
    film = animation.FuncAnimation(figure, show, len(numbers))
    rate = float(np.clip(len(numbers) / FILM_SECONDS, *FRAME_RATE_LIMITS_HZ))
    with write_atomically(out) as partial:
        if out.suffix == ".html":
            partial.write_text(_make_page(film.to_jshtml(rate), title), "utf-8")
        else:
            writer = animation.PillowWriter if out.suffix == ".gif" else animation.FFMpegWriter
            try:
                film.save(partial, writer=writer(fps=rate))
            except (BrokenPipeError, subprocess.CalledProcessError):
                raise Missing(
                    f"{out}: ffmpeg could not write this file; write .gif or .html"
                ) from None
    first, last = frames.times[numbers[[0, -1]]]
    return f"{out}: {len(numbers)} frames, {first:.6g} s to {last:.6g} s"


def _find_ffmpeg(out: Path) -> str:
    """Return the path of the program ffmpeg, or else of that in imageio-ffmpeg.

    Missing is raised if there is neither.
    """
    program = shutil.which("ffmpeg")
    if program is None and find_spec("imageio_ffmpeg"):
        from imageio_ffmpeg import get_ffmpeg_exe

        program = get_ffmpeg_exe()
    if program is None:
        raise Missing(
            f"{out}: writing .mp4 needs ffmpeg, which is not installed; run pip install "
            "imageio-ffmpeg, or write .gif or .html"
        )
    return program
