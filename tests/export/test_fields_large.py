"""A large series of fields: packed and rounded as it says, written frame after frame, whole up to a kill."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from time import process_time

import h5py
import numpy as np
import pytest
import pyvista
from exported import at, write_small
from vtkmodules.vtkIOHDF import vtkHDFReader

from patchfem.disk.whole import unfinished
from patchfem.export.fields import vtkhdf
from patchfem.export.fields.blocks import Block
from patchfem.export.fields.series import Series
from patchfem.export.fields.vtkhdf import NAME, rounded

KILLED = """\
import os, sys
from pathlib import Path
from patchfem.export.fields import vtkhdf
sys.path[:0] = {paths!r}
from exported import write_small
from test_fields_large import write_waves
calls, inner, vtkhdf.LARGE = [0], vtkhdf.rounded, 0
def rounded(*of):
    calls[0] += 1
    if calls[0] > {calls}:
        os.kill(os.getpid(), 9)
    return inner(*of)
vtkhdf.rounded = rounded
{write}
"""


def killed(write: str, calls: int, folder) -> None:
    """Write a series in a process that is killed after so many arrays of frames."""
    paths = [path for path in sys.path if "tests" in path] + [os.path.dirname(__file__)]
    done = subprocess.run([sys.executable, "-c", KILLED.format(paths=paths, calls=calls, write=write)], cwd=folder,
                          check=False)
    assert done.returncode == -signal.SIGKILL


def by_vtk(path):
    """The grids of every block in every frame that VTK finds in a file."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for number in range(reader.GetNumberOfSteps()):
        reader.SetStep(number)
        reader.Update()
        yield pyvista.wrap(reader.GetOutputDataObject(0)).copy()


@pytest.mark.parametrize("bits", [1, 7, 14, 22])
def test_exact_rounding_is_to_the_nearest_with_so_many_bits(bits):
    values = np.random.default_rng(bits).normal(size=5000) * 10.0**np.arange(-25, 25).repeat(100)
    values = values.astype(np.float32)
    found = rounded(values, bits)
    mantissa, _ = np.frexp(found.astype(float))
    assert np.array_equal(mantissa * 2.0**(bits + 1), np.round(mantissa * 2.0**(bits + 1)))
    assert (abs(found.astype(float) - values) <= abs(values.astype(float)) * 2.0**-(bits + 1)).all()
    odd = np.array([0.0, -0.0, np.inf, -np.inf, np.nan], np.float32)
    assert np.array_equal(rounded(odd, bits), odd, equal_nan=True)


def test_exact_a_large_series_holds_every_frame_rounded_as_it_says(tmp_path, monkeypatch):
    monkeypatch.setattr(vtkhdf, "LARGE", 0)
    given = write_small(tmp_path / "out", 5)
    for number, grids in enumerate(by_vtk(tmp_path / "out" / NAME)):
        for name, block in given.blocks.items():
            for data, theirs in ((grids[name].point_data, block.point_data), (grids[name].cell_data, block.cell_data)):
                for array, values in theirs.items():
                    wanted = at(values, number)
                    if wanted.dtype == np.float32:
                        wanted = rounded(wanted, vtkhdf.BITS.get(array, vtkhdf.MOST_BITS))
                    assert np.array_equal(data[array], wanted), array
    assert number == 4
    with Series(tmp_path / "out") as series:
        assert np.array_equal(series.times, given.times) and len(series) == 5
        bits = series.root["upper/CellData/stress"].attrs["significant_bits"]
        assert np.array_equal(series.frame(3).blocks["upper"].cell_data["stress"],
                              rounded(given.blocks["upper"].cell_data["stress"][3], bits))


def test_always_a_killed_writer_leaves_its_whole_frames_and_no_file_of_the_name(tmp_path):
    killed("write_small(Path('out'), 6)", 47, tmp_path)
    [left] = (tmp_path / "out").iterdir()
    assert unfinished(left.name) and left.name.startswith(".fields.") and left.suffix == ".vtkhdf"
    with h5py.File(left) as file:
        count = int(file["VTKHDF/Steps"].attrs["NSteps"])
        packed = [one for block in ("lower", "upper", "interface") for kind in ("PointData", "CellData")
                  for one in file[f"VTKHDF/{block}/{kind}"].values() if one.chunks]
        assert count == 47 // len(packed) - 1 > 0  # the frame before the one that was cut off stands behind them
    given = write_small(tmp_path / "whole", 6)
    for number, grids in enumerate(by_vtk(left)):
        wanted = rounded(given.blocks["upper"].cell_data["von_mises"][number], vtkhdf.MOST_BITS)
        assert np.array_equal(grids["upper"].cell_data["von_mises"], wanted)
    assert number == count - 1


def waves(frames: int, across: int, deep: int) -> Block:
    """Quads with a smooth field that wanders, as a rubbing piece has."""
    x, y = np.meshgrid(np.linspace(0, 12.7e-3, across + 1), np.linspace(0, 6.35e-3, deep + 1), indexing="ij")
    node = np.arange(x.size).reshape(x.shape)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    at, turn = points[quads].mean(axis=1), np.sin(2 * np.pi * np.arange(frames) / frames)[:, None]
    mises = 8e6 * np.exp(-((at[:, 0] - 2e-3 * (2 + turn)) / 3e-3)**2 - at[:, 1] / 2e-3)
    move = np.zeros((frames, x.size, 3), np.float32)
    move[..., 0] = 1e-5 * turn + 1e-7 * np.cos(300 * points[:, 0]) * np.exp(-points[:, 1] / 3e-3)
    move[..., 1] = -1e-6 * np.exp(-((points[:, 0] - 2e-3 * (2 + turn)) / 4e-3)**2) * (1 - points[:, 1] / 7e-3)
    return Block(points, quads.ravel(), np.arange(len(quads) + 1) * 4, np.full(len(quads), 9, np.uint8),
                 {"displacement": move}, {"von_mises": mises.astype(np.float32),
                                          "stress_error": (0.03 + 1e-9 * mises).astype(np.float32)})


def write_waves(path, frames: int, across: int, deep: int) -> Block:
    """A series of one block of `waves`."""
    block = waves(frames, across, deep)
    vtkhdf.write_series(path, {"lower": block}, np.arange(frames) * 1e-4, {"displacement": "m", "von_mises": "Pa"})
    return block


@pytest.mark.slow
def test_always_200_frames_of_100_000_cells_are_small_quick_and_survive_a_kill(tmp_path):
    """A vector at the points, two numbers in the cells: 105 MB and 4.3 s of a CPU when this was written, of 402 MB. A
    pair of a rubbing rig tiled to 106 680 cells took 177 MB and 6.1 s, with the stress tensor beside 386 MB and 12.4
    s."""
    begin = process_time()
    block = write_waves(tmp_path / NAME, 200, 400, 250)
    assert process_time() - begin < 25 and (tmp_path / NAME).stat().st_size < 200e6
    killed("write_waves(Path('fields.vtkhdf'), 200, 400, 250)", 3 * 120 + 1, tmp_path)
    for number, grids in enumerate(by_vtk(next(tmp_path.glob(".fields*")))):
        assert np.array_equal(grids["lower"].cell_data["von_mises"], rounded(block.cell_data["von_mises"][number], 14))
    assert number == 118
