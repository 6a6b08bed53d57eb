"""Fields as grids of PyVista, and from them as .vtu, .pvd and .csv."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...core import Missing, PatchfemError
from ...disk.atomic_write import explain_mkdir_error, write_rows, write_text
from ...runs.pieces import compute_pieces
from .blocks import FIELDS, PARTS, Block, make_blocks
from .vtkhdf import Frames, write_blocks

if TYPE_CHECKING:
    from pyvista import MultiBlock

    from ...runs.results.result import Result

# Field of each part that PyVista colours by default.
ACTIVE_FIELDS = {"lower": "von_mises", "upper": "von_mises", "interface": "normal_stress"}


def make_grids(blocks: dict[str, Block], number: int, time: float) -> MultiBlock:
    """Return one frame of blocks as a pyvista.MultiBlock of named grids, in SI.

    Parameters
    ----------
    blocks : dict of str to Block
        Parts and their fields.
    number : int
        Number of the frame.
    time : float
        [s]; the field array `TimeValue` of every grid.
    """
    import pyvista as pv

    grids = pv.MultiBlock()
    for part, block in blocks.items():
        connectivity, starts, types = block.vtk_cells()
        cells = np.insert(connectivity, starts[:-1], np.diff(starts))
        grid = pv.UnstructuredGrid(cells, types, block.points)
        for data, fields in (
            (grid.point_data, block.point_data),
            (grid.cell_data, block.cell_data),
        ):
            for name, values in fields.items():
                data[name] = values[number % len(values)]  # a constant field has one frame
        grid.field_data["TimeValue"] = [time]
        _label_units(grid)
        grids.append(grid, part)
    return grids


def _label_units(grid) -> None:
    """Give each array of a grid its unit as the key UNITS_LABEL of VTK, which .vtu files keep."""
    from vtkmodules.vtkCommonCore import vtkDataArray

    for data in (grid.point_data, grid.cell_data):
        for name in data.keys():
            information = data.VTKObject.GetAbstractArray(name).GetInformation()
            information.Set(vtkDataArray.UNITS_LABEL(), FIELDS[name].unit)


def make_result_grids(result: Result, numbers: Iterable[int]) -> list[MultiBlock]:
    """Return frames of a run with a patch as pyvista.MultiBlock objects with stresses in MPa.

    The field array `units` of every grid lists the unit of each array.
    """
    pieces = compute_pieces(result)
    blocks = make_blocks(pieces)
    units = {name: "MPa" if field.unit == "Pa" else field.unit for name, field in FIELDS.items()}
    frames = []
    for number in numbers:
        grids = make_grids(blocks, number, float(pieces.time[number]))
        for part, grid in zip(grids.keys(), grids):
            for data in (grid.point_data, grid.cell_data):
                for name in data.keys():
                    if units[name] == "MPa":
                        data[name] = data[name] / 1e6
            names = [*grid.point_data.keys(), *grid.cell_data.keys()]
            grid.field_data["units"] = [f"{name} [{units[name]}]" for name in names]
            grid.set_active_scalars(ACTIVE_FIELDS[part])
        frames.append(grids)
    return frames


def export_frames(frames: Frames, out: Path, number: int) -> None:
    """Write fields as .vtu or .csv of one frame, or as .pvd or .vtkhdf of all frames.

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
    else:
        write = _write_vtu if out.suffix == ".vtu" else _write_csv
        write(frames, out, number)


def _write_vtu(frames: Frames, out: Path, number: int) -> None:
    """Write a frame as one mesh with the array `part`; fields that a part lacks are NaN or -1 there.

    VTK makes the text in memory, because it ends the process where it cannot write a file.
    """
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    grids = make_grids(frames.blocks, number, float(frames.times[number]))
    for code, name in enumerate(PARTS):
        grids[name].cell_data["part"] = np.full(grids[name].n_cells, code, np.int8)
    # one mesh has one list of fields, so that every part needs all of them
    for kind in ("point_data", "cell_data"):
        samples = {name: values for grid in grids for name, values in getattr(grid, kind).items()}
        for grid in grids:
            data = getattr(grid, kind)
            count = grid.n_points if kind == "point_data" else grid.n_cells
            for name in samples.keys() - set(data.keys()):
                hole = np.nan if samples[name].dtype.kind == "f" else -1
                data[name] = np.full((count, *samples[name].shape[1:]), hole, samples[name].dtype)

    merged = grids.combine()
    merged.field_data["TimeValue"] = [frames.times[number]]
    _label_units(merged)
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(merged)
    writer.SetDataModeToBinary()
    writer.SetWriteToOutputString(True)
    writer.Write()
    write_text(out, writer.GetOutputString())


def _write_pvd(frames: Frames, out: Path) -> None:
    """Write each frame as .vtu in a folder beside a .pvd, which lists them with their times."""
    folder = out.with_name(f"{out.stem}_frames")
    create_folder(folder)
    lines = []
    for number, time in enumerate(frames.times):
        name = f"frame_{number:04d}.vtu"
        _write_vtu(frames, folder / name, number)
        lines.append(f'<DataSet timestep="{float(time)!r}" file="{folder.name}/{name}"/>')
    text = "\n".join(lines)
    write_text(out, f'<VTKFile type="Collection"><Collection>\n{text}\n</Collection></VTKFile>\n')


def _write_csv(frames: Frames, out: Path, number: int) -> None:
    """Write the interface of a frame as a table in SI, one row per point."""
    line = frames.blocks["interface"]
    columns = {"x [m]": line.points[:, 0]}
    for name, series in line.point_data.items():
        values = series[number % len(series)]
        unit = FIELDS[name].unit
        if values.ndim == 1:
            columns[f"{name} [{unit}]"] = values
        else:
            columns |= {f"{name}_{axis} [{unit}]": values[:, k] for k, axis in enumerate("xy")}
    write_rows(out, [columns, *zip(*columns.values())])


def create_folder(folder: Path) -> None:
    """Create the folder of an output file; Missing if it cannot be created."""
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
