"""Verbs that show a results folder or write it in other formats."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..export import chosen, reports
from ..export.lab import structures
from .shared import Refused, Sets, flag, model_of, out_in, word

Frame = Annotated[int | None, Parameter(help="number of the frame, such as 0 for the pressed state; the last one "
                                             "unless given")]


def export(folder: Path, /, *, out: Annotated[Path, Parameter(
        name=["-o", "--out"], help="fields.pvd (a series, for any ParaView), .vtu, .csv or .vtkhdf; cycle.py (plays "
                                   "the last cycle in ParaView); histories.uff, .mat or .csv; for a scene its "
                                   "matrices and friction elements as .mat (NLvib) or .npz (TMDSimPy, pyHarm)")],
           frame: Frame = None, sets: Sets = (),
           histories: flag("the histories and loops as .csv, not the interface") = False,
           of: word("stress that a script for ParaView colours, such as sigma_yy or tau_xy (von_mises unless given); "
                    "status shows where the interface sticks and slips",
                    "--of") = ""):
    """Write the fields of a results folder in another format, or its histories and loops; of a fit the measured loop
    beside the fitted one; of a scene its structure for other programs.

    Example: patchfem export out/rig -o histories.uff
    """
    if folder.suffix != ".toml":
        if sets:
            raise Refused("--set: belongs to a scene; a results folder has run")
        print(chosen.export(folder, out, frame, histories, of))
        return
    if frame is not None or histories or of:
        raise Refused("--frame, --histories, --of: belong to a results folder; a scene is exported as its structure")
    print(structures.export(model_of(folder, sets), out))


def view(folder: Path, /, *, out: out_in("picture.png in place of a window; .gif, .mp4, .html: the last cycle") = None,
         frame: Frame = None,
         magnify: Annotated[float | None, Parameter(help="factor on displacements, such as 1000")] = None):
    """Show the pressed pieces of a results folder in a window, or draw them into a picture or a film.

    Example: patchfem view out/rig -o cycle.gif
    """
    if told := chosen.view(folder, out, frame, magnify):
        print(told)


def report(*folders: Path, out: out_in("page.html, by default report.html here") = None,
           measured: Annotated[Path | None, Parameter(help="measured data to plot over the runs: a file of a "
                                                           "laboratory or the table that `import` made")] = None):
    """Lay the results folders of several runs, or of several sweeps over the same keys, side by side on one page for a
    browser; for a single sweep, rebuild its page.

    Example: patchfem report out/rig out/six --measured loop.csv -o both.html
    """
    print(reports.report_of(list(folders), out, measured))
