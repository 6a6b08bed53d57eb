"""Verbs that show a results folder or write it in other formats."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..export import lab, reports
from ..export.drawing import paraview
from ..export.drawing import view as viewer
from ..export.fields import vtu
from ..export.lab import write
from ..export.pages import player
from .shared import Refused, flag, out_in

Frame = Annotated[int | None, Parameter(help="number of the frame, such as 0, the pressed state; the last one unless "
                                             "given")]


def export(folder: Path, /, *, out: Annotated[Path, Parameter(
        name=["-o", "--out"], help="fields.pvd (a series, for any ParaView), .vtu, .csv or .vtkhdf; cycle.py (plays "
                                   "the last cycle in ParaView); histories.uff, .mat or .csv")],
           frame: Frame = None,
           histories: flag("the histories and loops as .csv, not the interface") = False):
    """Write the fields of a results folder in another format, or its histories and loops; of a fit the measured loop
    beside the fitted one.

    Example: patchfem export out/rig -o histories.uff
    """
    fields = (folder / lab.FIELDS).is_file() or not folder.is_dir()
    if out.suffix.lower() in lab.ENDINGS and (out.suffix != ".csv" or histories or not fields):
        if frame is not None:
            raise Refused("--frame: belongs to fields (.vtu, .csv); histories have all their times in one file")

        print(write.export(folder, out))
        return
    if histories:
        raise Refused(f"--histories: they are written as {', '.join(lab.ENDINGS)}, not as {out.suffix or out}")
    if out.suffix == ".py":
        if frame is not None:
            raise Refused("--frame: a script plays the whole last cycle")

        print(paraview.write_script(folder, out))
        return

    print(vtu.export(folder, out, frame))


def view(folder: Path, /, *, out: out_in("picture.png in place of a window; .gif, .mp4, .html: the last cycle") = None,
         frame: Frame = None,
         magnify: Annotated[float | None, Parameter(help="what displacements are magnified by, such as 1000")] = None):
    """Show the pressed pieces of a results folder in a window, or draw them into a picture or a film.

    Example: patchfem view out/rig -o cycle.gif
    """
    if out is not None and out.suffix == ".html":
        if frame is not None or magnify is not None:
            raise Refused("--frame, --magnify: a page shows the last cycle and has a slider for each")
        print(player.write_page(folder, out))
        return
    viewer.view(folder, out, frame, magnify)


def report(*folders: Path, out: out_in("page.html, by default report.html here") = None,
           measured: Annotated[Path | None, Parameter(help="file of a laboratory, or the table that `import` made of "
                                                           "it: laid over the pictures of runs")] = None):
    """Lay the results folders of several runs, or of several sweeps over the same keys, side by side on one page for a
    browser; for a single sweep, rebuild its page.

    Example: patchfem report out/rig out/six --measured loop.csv -o both.html
    """
    if not folders:
        raise Refused("report: name at least one results folder")
    print(reports.report_of(list(folders), out, measured))
