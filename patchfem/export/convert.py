"""Conversion of a results folder: another format, a picture or a page, chosen by the suffix."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..core import Missing, PatchfemError
from ..disk.atomic_write import explain_mkdir_error
from . import lab
from .drawing import paraview
from .drawing import view as viewer
from .fields import vtu
from .lab import write
from .pages import player


def export_results(
    folder: Path, out: Path, frame: int | None = None, histories: bool = False, of: str = ""
) -> str:
    """Write the fields, or the histories and loops, of a results folder in another format.

    Parameters
    ----------
    folder : Path
    out : Path
        File whose suffix chooses the format. A .csv contains the interface, or the histories if
        `histories` is set or the folder has no fields.
    frame : int, optional
        Number of the frame, for fields at a single time.
    histories : bool
        Whether a .csv contains the histories.
    of : str
        Stress that the script for ParaView colours; by default the von Mises stress.

    Returns
    -------
    str
        A line about what was written.

    Raises
    ------
    PatchfemError
        If suffix, frame and histories do not fit together.
    """
    fields = (folder / lab.FIELDS).is_file() or not folder.is_dir()
    if out.suffix.lower() in lab.ENDINGS and (out.suffix != ".csv" or histories or not fields):
        if frame is not None:
            raise PatchfemError(
                "--frame can be used only with fields (.vtu, .csv); a file of histories contains all "
                "times"
            )
        with _create_parent_folder(out):
            return write.export_histories(folder, out)
    if histories:
        raise PatchfemError(
            f"--histories: histories are written as {', '.join(lab.ENDINGS)}, not as "
            f"{out.suffix or out}"
        )
    if of and out.suffix != ".py":
        raise PatchfemError(
            "--of can be used only with a ParaView script, -o play.py; other files contain every "
            "component"
        )
    if out.suffix == ".py":
        if frame is not None:
            raise PatchfemError(
                "--frame: cannot be used with a script, which plays all frames of the motion"
            )
        with _create_parent_folder(out):
            return paraview.write_script(folder, out, of or "von_mises")
    with _create_parent_folder(out):
        return vtu.export_fields(folder, out, frame)


def view_results(
    folder: Path, out: Path | None, frame: int | None = None, magnify: float | None = None
) -> str:
    """Show the pieces of a results folder in a window, or draw them into a file.

    Parameters
    ----------
    folder : Path
    out : Path or None
        File of a picture, film or page; None for a window.
    frame : int, optional
        Number of the frame; by default the last.
    magnify : float, optional
        Factor of the motion.

    Returns
    -------
    str
        A line about the page; "" for anything else.
    """
    if out is None or out.suffix != ".html":
        with _create_parent_folder(out):
            viewer.view(folder, out, frame, magnify)
        return ""
    if frame is not None or magnify is not None:
        raise PatchfemError(
            "--frame, --magnify: cannot be used with a page, which shows the motion and has "
            "sliders for frame and magnification"
        )
    with _create_parent_folder(out):
        return player.write_page(folder, out)


@contextmanager
def _create_parent_folder(out: Path | None) -> Iterator[None]:
    """Create the folder of an output file; remove it again if nothing was written into it.

    Missing if it cannot be created.
    """
    new_folders = [] if out is None else [parent for parent in out.parents if not parent.exists()]
    try:
        if new_folders:
            _make_folder(new_folders[0], out)
        yield
    finally:
        with suppress(OSError):  # folders with files are kept
            for folder in new_folders:
                folder.rmdir()


def _make_folder(folder: Path, out: Path) -> None:
    """Create a folder; raise Missing if this fails."""
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise Missing(
            f"{out}: the folder of this file cannot be made ({explain_mkdir_error(error)})"
        ) from None
