"""Fields as grids of PyVista, and from them as .vtu, .pvd and .csv."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...core import Missing, PatchfemError
from ...disk.atomic_write import explain_mkdir_error, write_rows, write_text
from .vtkhdf import VTK_FIELDS, Frames, collect_frames, write_blocks

if TYPE_CHECKING:
    from pyvista import MultiBlock

    from ...runs.results.result import Result

# Field of each part that PyVista colours by default.
COLOURED_FIELDS = {"lower": "von_mises", "upper": "von_mises", "interface": "normal_stress"}


def make_grids(frames: Frames, number: int) -> MultiBlock:
    """Return one frame as a pyvista.MultiBlock with a grid per block, in SI units.

    Each grid has the time [s] as its field array `TimeValue`.

    Parameters
    ----------
    frames : Frames
        Fields of a run.
    number : int
        Number of the frame.
    """
    import pyvista as pv

    grids = pv.MultiBlock()
    for part, block in frames.blocks.items():
        connectivity, starts, types = block.vtk_cells()
        cells = np.insert(connectivity, starts[:-1], np.diff(starts))
        grid = pv.UnstructuredGrid(cells, types, block.points)
        for data, fields in (
            (grid.point_data, block.point_data),
            (grid.cell_data, block.cell_data),
        ):
            for name, values in fields.items():
                data[name] = values[number % len(values)]  # a constant field has one frame
        grid.field_data["TimeValue"] = [frames.times[number]]
        grid.set_active_scalars(COLOURED_FIELDS[part])
        _label_units(grid)
        grids.append(grid, part)
    return grids


def _label_units(grid) -> None:
    """Give each array of a grid its unit as the key UNITS_LABEL of VTK, which .vtu files keep."""
    from vtkmodules.vtkCommonCore import vtkDataArray

    for data in (grid.point_data, grid.cell_data):
        for name in data.keys():
            information = data.VTKObject.GetAbstractArray(name).GetInformation()
            information.Set(vtkDataArray.UNITS_LABEL(), VTK_FIELDS[name].unit)


def make_result_grids(result: Result, numbers: Iterable[int]) -> list[MultiBlock]:
    """Return frames of a run with a patch as pyvista.MultiBlock objects, in SI units."""
    frames = collect_frames(result)
    return [make_grids(frames, number) for number in numbers]


def export_frames(frames: Frames, out: Path, number: int) -> None:
    """Write fields as .vtu or .csv of one frame, or as .pvd or .vtkhdf of all frames.

    A .vtu file contains both pieces or the face, a .csv file the interface.

    Parameters
    ----------
    frames : Frames
        Fields of a run.
    out : Path
        File whose suffix chooses the format.
    number : int
        Number of the frame of a .vtu or .csv.
    """
    if out.suffix == ".vtkhdf":
        write_blocks(out, frames.blocks, frames.times)
    elif out.suffix == ".pvd":
        _write_pvd(frames, out)
    elif out.suffix == ".vtu":
        grid = make_grids(select_shown_blocks(frames), number).combine()
        grid.field_data["TimeValue"] = [frames.times[number]]
        _write_vtu(grid, out)
    else:
        _write_csv(frames, out, number)


def _write_vtu(grid, out: Path) -> None:
    """Write a grid of PyVista.

    VTK makes the text in memory, because it ends the process where it cannot write a file.
    """
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    _label_units(grid)
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetDataModeToBinary()
    writer.SetWriteToOutputString(True)
    writer.Write()
    write_text(out, writer.GetOutputString())


def _write_pvd(frames: Frames, out: Path) -> None:
    """Write each part in each frame as .vtu in a folder beside a .pvd, which lists the frames with their times.

    A .vtm of each frame has the names of the parts, which a .pvd cannot have.
    """
    folder = out.with_name(f"{out.stem}_frames")
    create_folder(folder)
    lines = []
    for number, time in enumerate(frames.times.tolist()):
        parts = []
        for part, grid in zip(frames.blocks, make_grids(frames, number), strict=True):
            name = f"{part}_{number:04d}.vtu"
            _write_vtu(grid, folder / name)
            parts.append(f'<DataSet index="{len(parts)}" name="{part}" file="{name}"/>')
        name = f"frame_{number:04d}.vtm"
        write_text(folder / name, _format_collection("vtkMultiBlockDataSet", parts))
        lines.append(f'<DataSet timestep="{time!r}" file="{folder.name}/{name}"/>')
    write_text(out, _format_collection("Collection", lines))


def _format_collection(kind: str, entries: list[str]) -> str:
    """Return a file of VTK that lists other files, given its kind and its entries."""
    text = "\n".join(entries)
    return f'<VTKFile type="{kind}" version="1.0"><{kind}>\n{text}\n</{kind}></VTKFile>\n'


def _write_csv(frames: Frames, out: Path, number: int) -> None:
    """Write the interface of a frame as a table in SI, one row per point, or per cell of a face.

    `number` is the index of the frame.
    """
    line = frames.blocks["interface"]
    if frames.is_face:
        centres = line.points[line.cells].mean(axis=1)
        columns = {"x [m]": centres[:, 0], "y [m]": centres[:, 1]}
    else:
        columns = {"x [m]": line.points[:, 0]}
    for name, series in (line.point_data | line.cell_data).items():
        values = series[number % len(series)]
        unit = VTK_FIELDS[name].unit
        if values.ndim == 1:
            columns[f"{name} [{unit}]"] = values
        else:
            columns |= {f"{name}_{axis} [{unit}]": values[:, k] for k, axis in enumerate("xy")}
    write_rows(out, [columns, *zip(*columns.values())])


def select_shown_blocks(frames: Frames) -> Frames:
    """Return the frames with the blocks that a picture shows: both pieces, or the face."""
    if frames.is_face:
        return frames
    return frames._replace(blocks={side: frames.blocks[side] for side in ("lower", "upper")})


def create_folder(folder: Path) -> None:
    """Create the folder of an output file.

    Missing is raised if it cannot be created.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = explain_mkdir_error(error)
        raise Missing(f"{folder}: this folder cannot be made ({reason})") from None


def find_frame(frames: Frames, number: int | None) -> int:
    """Return the number of a frame from 0, for one that may count from the end; None is the last one.

    PatchfemError if there is no such frame.
    """
    count = len(frames.times)
    number = -1 if number is None else number
    if not -count <= number < count:
        raise PatchfemError(
            f"--frame: there is no frame {number}; {frames.path} has frames 0 to {count - 1}"
        )
    return number % count
