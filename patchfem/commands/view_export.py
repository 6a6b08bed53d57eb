"""Commands that show a results folder or write it in other formats."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..export import convert, page
from ..export.charts import axes
from ..export.lab import structures
from ..model import model
from .shared import (
    Plot,
    Sets,
    UsageError,
    flag_option,
    load_scene,
    note,
    out_option,
    required_out_option,
)

Frame = Annotated[
    int | None,
    Parameter(help="number of the frame, such as 0 for the pressed state; default: the last frame"),
]


def export(
    folder: Path,
    /,
    *,
    out: required_out_option(
        "file to write; fields: fields.pvd (all frames, for any version of ParaView), .vtu, .csv or .vtkhdf; "
        "histories: histories.uff, .mat or .csv; matrices and friction elements of a scene: .mat"
    ),
    frame: Frame = None,
    sets: Sets = (),
    histories: flag_option(
        "write histories and loops as .csv, instead of the fields along the interface"
    ) = False,
):
    """Write the fields, or the histories and loops, of a results folder in another format. From the folder of a fit,
    write the measured and the fitted loop. From a scene, write the matrices of the structure.

    Example: patchfem export out/rig -o histories.uff
    """
    if folder.suffix != ".toml":
        if sets:
            raise UsageError("--set can be used only with a scene, not with a results folder")
        print(convert.export_results(folder, out, frame, histories))
        return
    if frame is not None or histories:
        raise UsageError("--frame and --histories can be used only with a results folder")
    scene = load_scene(folder, sets)
    if scene.sweep:
        keys = ", ".join(axis.key for axis in scene.sweep)
        note(f"[sweep] is left out: {keys} as the scene gives it, or its first value in [sweep]")
    print(structures.export_structure(model.build_without_sweep(scene), out))


def view(
    folder: Path,
    /,
    *,
    out: out_option(
        "file to write instead of opening a window: picture.png for one frame; .gif or .mp4 for the last cycle (of a "
        "bench: the whole slide)"
    ) = None,
    frame: Frame = None,
    magnify: Annotated[
        float | None, Parameter(help="magnification of displacements, such as 1000")
    ] = None,
):
    """Show the pressed pieces of a results folder in a window, or draw them into a picture or a film.

    Example: patchfem view out/rig -o cycle.gif
    """
    if message := convert.view_results(folder, out, frame, magnify):
        print(message)


def report(
    *folders: Path,
    out: out_option(
        "page to write; default: report.html in the folder, or in the current folder for several"
    ) = None,
    plot: Plot = None,
):
    """Make the page of a results folder again from its files, or show several folders of the same kind side by side.

    Example: patchfem report out/rig out/six -o both.html
    """
    if plot is not None:
        axes.find_picture_format(plot)
    print(page.write_report(*folders, out=out))
    if plot is not None:
        axes.write_plot(page.read_answers(folders), plot)
