"""Verbs that show a results folder or write it in other formats."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from .shared import Out, Refused, say


def export(folder: Path, /, *, out: Annotated[Path, Parameter(name=["-o", "--out"])], frame: int | None = None):
    """Write the fields of a results folder as .pvd (series, for any ParaView), .vtu or .csv (last or --frame), or
    .vtkhdf."""
    from ..export.fields.vtu import export as write

    print(write(folder, out, frame))


def view(folder: Path, /, *, out: Out = None,
         frame: int | None = None, magnify: float | None = None):
    """Show the pressed pieces of a results folder in a window, or draw them into -o PICTURE.png."""
    from ..export.drawing.view import view as show

    show(folder, out, frame, magnify, say)


def report(*folders: Path, out: Out = None):
    """Lay the results folders of several runs, or of several sweeps over the same keys, side by side on one page for a
    browser (-o PAGE.html, by default report.html here); of one sweep its own page is made again."""
    from ..export.reports import report_of

    if not folders:
        raise Refused("report: name at least one results folder")
    print(report_of(list(folders), out))
