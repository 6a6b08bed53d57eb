"""A results folder in another format, or shown, as the ending of a file says."""

from pathlib import Path

from ..core import PatchfemError
from . import lab
from .drawing import paraview
from .drawing import view as viewer
from .fields import vtu
from .lab import write
from .pages import player


def export(folder: Path, out: Path, frame: int | None = None, histories: bool = False, of: str = "") -> str:
    """Write the fields of a results folder, or its histories and loops, as the ending of `out` says; one line on what
    was written.

    A .csv has the interface, or the histories where these are asked for or the folder has no fields. PatchfemError for
    an ending, a frame or histories that do not stand together. of: the stress that a script colours, von Mises' unless
    given.
    """
    fields = (folder / lab.FIELDS).is_file() or not folder.is_dir()
    if out.suffix.lower() in lab.ENDINGS and (out.suffix != ".csv" or histories or not fields):
        if frame is not None:
            raise PatchfemError("--frame can be used only with fields (.vtu, .csv); a file of histories contains all "
                                "times")
        return write.export(folder, out)
    if histories:
        raise PatchfemError(f"--histories: histories are written as {', '.join(lab.ENDINGS)}, not as "
                            f"{out.suffix or out}")
    if of and out.suffix != ".py":
        raise PatchfemError("--of can be used only with a ParaView script, -o play.py; other files contain every "
                            "component")
    if out.suffix == ".py":
        if frame is not None:
            raise PatchfemError("--frame: cannot be used with a script, which plays the whole last cycle")
        return paraview.write_script(folder, out, of or "von_mises")
    return vtu.export(folder, out, frame)


def view(folder: Path, out: Path | None, frame: int | None = None, magnify: float | None = None) -> str:
    """Show the pieces of a results folder in a window, or draw them into `out`; one line on a page, "" for others."""
    if out is None or out.suffix != ".html":
        viewer.view(folder, out, frame, magnify)
        return ""
    if frame is not None or magnify is not None:
        raise PatchfemError("--frame, --magnify: cannot be used with a page, which shows the last cycle and has "
                            "sliders for frame and magnification")
    return player.write_page(folder, out)
