"""Conversion of a results folder: another format, a picture, a film or a window."""

import os
import sys
from pathlib import Path

import numpy as np

from ..core import Missing, PatchfemError
from . import lab, pieces, store
from .charts.axes import PICTURE_ENDINGS
from .fields import grids
from .fields.vtkhdf import VTK_FIELDS, VTKHDF_FILE, Frames, find_fields, read_frames
from .lab import write

SERIES_FORMATS = (".pvd", ".vtkhdf")
FIELD_FORMATS = (*SERIES_FORMATS, ".vtu", ".csv")


def export_results(
    folder: Path, out: Path, frame: int | None = None, histories: bool = False
) -> str:
    """Write the fields, or the histories and loops, of a results folder in another format.

    Parameters
    ----------
    folder : Path
        Results folder.
    out : Path
        File whose suffix chooses the format. A .csv contains the interface, or the histories if
        `histories` is set or the folder has no fields.
    frame : int, optional
        Number of the frame of a .vtu or .csv; by default the last.
    histories : bool
        Whether a .csv contains the histories.

    Returns
    -------
    str
        A line about what was written.

    Raises
    ------
    PatchfemError
        If suffix, frame and histories do not fit together.
    """
    # a .csv contains the fields if there are any
    has_fields = (folder / VTKHDF_FILE).is_file() or not folder.is_dir()
    is_lab_format = out.suffix.lower() in lab.LAB_FILE_ENDINGS
    if is_lab_format and (out.suffix != ".csv" or histories or not has_fields):
        if frame is not None:
            raise PatchfemError(
                "--frame can be used only with fields (.vtu, .csv); a file of histories contains "
                "all times"
            )
        grids.create_folder(out.parent)
        return write.export_histories(folder, out)
    _refuse_field_format(out, frame, histories=histories)
    frames = read_frames(find_fields(folder))
    number = grids.find_frame(frames, frame)
    grids.create_folder(out.parent)
    grids.export_frames(frames, out, number)
    if out.suffix in SERIES_FORMATS:
        return f"{out}: {len(frames.times)} frames"
    return f"{out}: frame {number} of 0 to {len(frames.times) - 1}, {frames.times[number]:.6g} s"


def _refuse_field_format(out: Path, frame: int | None, *, histories: bool) -> None:
    """Raise PatchfemError if a file of fields cannot have this suffix, or not with these options.

    `frame` is the number of the only frame, or None for the default, and `histories` tells whether --histories is given.
    """
    if histories:
        raise PatchfemError(
            f"--histories: histories are written as {', '.join(lab.LAB_FILE_ENDINGS)}, not as "
            f"{out.suffix or out}"
        )
    if out.suffix == ".py":
        raise PatchfemError(
            f"{out}: the script for ParaView was removed in patchfem 1.2; open {VTKHDF_FILE} in ParaView 5.13 or "
            "newer, or write .pvd for older versions"
        )
    if out.suffix not in FIELD_FORMATS:
        raise PatchfemError(
            f"{out}: fields are exported as {', '.join(FIELD_FORMATS)}; histories and loops as .uff, "
            ".mat, .csv --histories"
        )
    if frame is not None and out.suffix in SERIES_FORMATS:
        raise PatchfemError(
            f"--frame: {out.suffix} contains all frames; use a .vtu or .csv for one frame"
        )


def view_results(
    folder: Path, out: Path | None, frame: int | None = None, magnify: float | None = None
) -> str:
    """Show the pieces of a results folder in a window, or draw them into a file.

    Parameters
    ----------
    folder : Path
        Results folder.
    out : Path or None
        File of a picture, film or page; None for a window.
    frame : int, optional
        Number of the frame; by default the last.
    magnify : float, optional
        Factor of the motion.

    Returns
    -------
    str
        A line about the file; "" for a window.

    Raises
    ------
    Missing
        If there are no fields or no screen for the window.
    PatchfemError
        For an impossible suffix, frame or factor.
    """
    if magnify is not None and not (np.isfinite(magnify) and magnify >= 0):
        raise PatchfemError(f"--magnify: {magnify} must be 0 or more")
    if out is not None and out.suffix not in PICTURE_ENDINGS + pieces.FILM_ENDINGS:
        raise PatchfemError(
            f"{out}: pictures are written as {', '.join(PICTURE_ENDINGS)}, films as "
            f"{', '.join(pieces.FILM_ENDINGS)}"
        )
    is_film = out is not None and out.suffix in pieces.FILM_ENDINGS
    if is_film and frame is not None:
        raise PatchfemError(
            f"--frame: {out.suffix} shows all frames of the motion; use a .png for one frame"
        )

    frames = read_frames(find_fields(folder))
    number = grids.find_frame(frames, frame)
    # the folder of an interface has fields alone
    has_summary = (folder / store.SUMMARY_FILE).is_file()
    title = store.read_summary(folder).title if has_summary else ""
    title = title or folder.resolve().name
    if frames.is_face and is_film:
        raise PatchfemError(
            f"{out}: a face is shown as a picture of one frame; write .png and give --frame"
        )
    if out is None:
        _open_window(frames, number, title)
        return ""
    grids.create_folder(out.parent)
    if is_film:
        return pieces.write_film(frames, title, magnify, out)
    return pieces.write_picture(frames, number, title, magnify, out)


def _open_window(frames: Frames, number: int, title: str) -> None:
    """Show a frame in a window: the von Mises stress in both pieces, or the pressure over a face.

    `number` is the index of the frame, and `title` is shown after the name of the program. Raises Missing if there is no
    screen.
    """
    has_screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if sys.platform.startswith("linux") and not has_screen:
        raise Missing(
            "view: there is no screen for a window (DISPLAY is not set); write a picture with "
            "-o FILE.png"
        )
    import pyvista as pv

    plotter = pv.Plotter(title=f"patchfem: {title}")
    for grid in grids.make_grids(grids.select_shown_blocks(frames), number):
        name = grid.active_scalars_name
        bar = {"title": f"{name.replace('_', ' ')} [{VTK_FIELDS[name].unit}]"}
        plotter.add_mesh(grid, scalar_bar_args=bar)
    plotter.view_xy()
    plotter.show()
