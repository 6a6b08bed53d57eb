"""A results folder in another format, or shown, as the ending of a file says."""

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


def export(
    folder: Path, out: Path, frame: int | None = None, histories: bool = False, of: str = ""
) -> str:
    """Write the fields of a results folder, or its histories and loops, as the ending of `out` says; one line on what
    was written.

    A .csv has the interface, or the histories where these are asked for or the folder has no fields. PatchfemError for
    an ending, a frame or histories that do not stand together. of: the stress that a script colours, von Mises' unless
    given.
    """
    fields = (folder / lab.FIELDS).is_file() or not folder.is_dir()
    if out.suffix.lower() in lab.ENDINGS and (out.suffix != ".csv" or histories or not fields):
        if frame is not None:
            raise PatchfemError(
                "--frame can be used only with fields (.vtu, .csv); a file of histories contains all "
                "times"
            )
        with _beside(out):
            return write.export(folder, out)
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
                "--frame: cannot be used with a script, which plays the whole last cycle"
            )
        with _beside(out):
            return paraview.write_script(folder, out, of or "von_mises")
    with _beside(out):
        return vtu.export(folder, out, frame)


def view(
    folder: Path, out: Path | None, frame: int | None = None, magnify: float | None = None
) -> str:
    """Show the pieces of a results folder in a window, or draw them into `out`; one line on a page, "" for others."""
    if out is None or out.suffix != ".html":
        with _beside(out):
            viewer.view(folder, out, frame, magnify)
        return ""
    if frame is not None or magnify is not None:
        raise PatchfemError(
            "--frame, --magnify: cannot be used with a page, which shows the last cycle and has "
            "sliders for frame and magnification"
        )
    with _beside(out):
        return player.write_page(folder, out)


@contextmanager
def _beside(out: Path | None) -> Iterator[None]:
    """The folder of a file to write is made, as `run -o` makes its own, and goes where nothing was written into it;
    Missing where it cannot be made."""
    places = [] if out is None else [one for one in out.parents if not one.exists()]
    try:
        if places:
            _made(places[0], out)
        yield
    finally:
        with suppress(OSError):  # it holds what was written
            for one in places:
                one.rmdir()


def _made(place: Path, out: Path) -> None:
    try:
        place.mkdir(parents=True)
    except OSError as error:
        raise Missing(
            f"{out}: the folder of this file cannot be made ({explain_mkdir_error(error)})"
        ) from None
