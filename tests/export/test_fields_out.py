"""fields.vtkhdf back in and out as .pvd, .vtu and .csv, read by VTK, pyvista, meshio and csv to the last bit."""

from __future__ import annotations

import csv
import json
import subprocess
import sys

import meshio
import numpy as np
import pytest
import pyvista
from command_line import cli
from exported import UNITS, at, write_small
from scene_texts import BENCH
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDataArray
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from patchfem.core import Missing, PatchfemError
from patchfem.export.fields.vtkhdf import NAME, Series
from patchfem.export.fields.vtu import BLOCK, _packed, export
from patchfem.export.results import FILES


def through_vtk(path):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def test_exact_a_series_is_read_back_as_written(tmp_path):
    given = write_small(tmp_path / "out", 4)
    with Series(tmp_path / "out") as series:
        assert np.array_equal(series.times, given.times) and series.units == UNITS and len(series) == 4
        for number in range(4):
            frame = series.frame(number)
            assert np.array_equal(frame.points, given.points) and frame.time == given.times[number]
            for kind in ("point_data", "cell_data"):
                mine, theirs = getattr(frame, kind), getattr(given, kind)
                assert mine.keys() == theirs.keys()
                for name, values in theirs.items():
                    assert np.array_equal(mine[name], at(values, number), equal_nan=values.dtype.kind == "f"), name
            for part, blocks in ((0, given.blocks[:2]), (1, given.blocks[2:4]), (2, given.blocks[4:])):
                assert all(np.array_equal(a, b) for a, b in zip(frame.cells(part), blocks, strict=True))
        assert series.frame(-1).number == 3
        assert np.all(np.diff(frame.points[frame.interface(), 0]) > 0) and frame.interface().min() >= 24


@pytest.mark.parametrize("number", [None, 0, 1])
def test_exact_vtu_is_read_by_vtk_and_by_meshio(tmp_path, number):
    given = write_small(tmp_path / "out")
    words = ["export", tmp_path / "out", "-o", tmp_path / "one.vtu"] + ([] if number is None else ["--frame", number])
    assert cli(*words).code == 0
    frame = 2 if number is None else number
    grid, mesh = through_vtk(tmp_path / "one.vtu"), meshio.read(tmp_path / "one.vtu")
    assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), given.points)
    assert np.array_equal(mesh.points, given.points)
    nodes = np.concatenate([block.ravel() for block in given.blocks])
    assert np.array_equal(vtk_to_numpy(grid.GetCells().GetConnectivityArray()), nodes)
    assert np.array_equal(np.concatenate([block.data.ravel() for block in mesh.cells]), nodes)
    assert vtk_to_numpy(grid.GetFieldData().GetArray("TimeValue")) == given.times[frame]
    for data, theirs, other in ((grid.GetPointData(), given.point_data, mesh.point_data),
                                (grid.GetCellData(), given.cell_data, mesh.cell_data)):
        assert data.GetNumberOfArrays() == len(theirs) and other.keys() == theirs.keys()
        for name, values in theirs.items():
            array, wanted = data.GetArray(name), at(values, frame)
            read, again = vtk_to_numpy(array), other[name]
            again = np.concatenate(again) if isinstance(again, list) else again
            assert read.dtype == again.dtype == wanted.dtype
            assert np.array_equal(read, wanted, equal_nan=wanted.dtype.kind == "f"), name
            assert np.array_equal(again, wanted, equal_nan=wanted.dtype.kind == "f"), name
            assert array.GetInformation().Get(vtkDataArray.UNITS_LABEL()) == UNITS[name]


def test_exact_pvd_is_read_by_pyvista(tmp_path):
    given = write_small(tmp_path / "out", 12)
    out = tmp_path / "out" / "fields.pvd"
    assert cli("export", tmp_path / "out", "-o", out).code == 0
    reader = pyvista.PVDReader(str(out))
    assert reader.time_values == list(given.times)
    for number in range(12):
        reader.set_active_time_point(number)
        grid = reader.read()[0]
        assert np.array_equal(grid.points, given.points)
        for name, values in given.point_data.items():
            assert np.array_equal(grid.point_data[name], at(values, number), equal_nan=values.dtype.kind == "f")
        for name, values in given.cell_data.items():
            assert np.array_equal(grid.cell_data[name], at(values, number), equal_nan=values.dtype.kind == "f")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {NAME, "fields.pvd", "fields_frames"} <= set(FILES)
    write_small(tmp_path / "out", 2)  # a shorter series leaves no frames of the longer one
    assert cli("export", tmp_path / "out", "-o", out).code == 0
    assert sorted(path.name for path in (tmp_path / "out" / "fields_frames").iterdir()) == \
        ["frame_0000.vtu", "frame_0001.vtu"]


def test_exact_arrays_of_several_blocks_and_none_are_unpacked_by_vtk(tmp_path):
    """Sizes at the edges of a block: the last one empty, full, one byte long."""
    for count in (0, 1, BLOCK // 8 - 1, BLOCK // 8, BLOCK // 8 + 1, 3 * BLOCK // 8):
        values = np.random.default_rng(count).normal(size=count)
        path = tmp_path / "field.vtu"
        path.write_text(f'''<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"
 compressor="vtkZLibDataCompressor"><UnstructuredGrid><FieldData>
<DataArray type="Float64" Name="a" NumberOfTuples="{count}" format="binary">{_packed(values)}</DataArray></FieldData>
<Piece NumberOfPoints="0" NumberOfCells="0"/></UnstructuredGrid></VTKFile>''', "ascii")
        array = through_vtk(path).GetFieldData().GetArray("a")
        assert np.array_equal(vtk_to_numpy(array), values)


def test_exact_csv_holds_the_interface_to_the_last_bit(tmp_path):
    given = write_small(tmp_path / "out")
    assert cli("export", tmp_path / "out", "-o", tmp_path / "rows.csv", "--frame", 1).code == 0
    with open(tmp_path / "rows.csv", newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    columns = dict(zip(head, zip(*rows)))
    nodes = np.arange(24, 28)
    assert np.array_equal(np.array(columns.pop("x [m]"), float), given.points[nodes, 0])
    for name, values in given.point_data.items():
        wanted = at(values, 1)[nodes]
        for k, axis in enumerate(("_x", "_y", "_z") if wanted.ndim > 1 else ("",)):
            read = np.array(columns.pop(f"{name}{axis} [{UNITS[name]}]")).astype(wanted.dtype)
            assert np.array_equal(read, wanted[:, k] if axis else wanted)
    assert not columns


def test_exact_vtkhdf_is_copied_and_not_onto_itself(tmp_path):
    write_small(tmp_path / "out")
    assert cli("export", tmp_path / "out", "-o", tmp_path / "copy.vtkhdf").code == 0
    assert (tmp_path / "copy.vtkhdf").read_bytes() == (tmp_path / "out" / NAME).read_bytes()
    assert cli("export", tmp_path / "out", "-o", tmp_path / "out" / NAME).code == 2


@pytest.mark.parametrize("words, code, says", [
    (["-o", "a.mat"], 2, "export of .mat is not yet built"), (["-o", "a.uff"], 2, "export of UFF58 is not yet built"),
    (["-o", "a.xlsx"], 2, ".pvd, .vtu, .csv, .vtkhdf"), (["-o", "a"], 2, ".pvd"),
    (["-o", "a.vtu", "--frame", "3"], 2, "frames 0 to 2"), (["-o", "a.vtu", "--frame", "-4"], 2, "frames 0 to 2"),
    (["-o", "a.pvd", "--frame", "1"], 2, "whole series"), (["-o", "nowhere/a.vtu"], 4, "cannot be written"),
    (["-o", "nowhere/a.pvd"], 4, "cannot be written"), ([], 2, "-o")])
def test_refuses_exports_by_name(tmp_path, monkeypatch, words, code, says):
    write_small(tmp_path / "out")
    monkeypatch.chdir(tmp_path)
    answer = cli("export", "out", *words)
    assert answer.code == code and says in answer.err and "internal fault" not in answer.err
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_refuses_folders_without_fields_and_spoilt_files(tmp_path):
    with pytest.raises(Missing, match="no such results folder"):
        export(tmp_path / "nowhere", tmp_path / "a.vtu")
    with pytest.raises(Missing, match=r"only a run with \[contact\]"):
        export(tmp_path, tmp_path / "a.vtu")
    (tmp_path / NAME).write_bytes(b"\x89HDF\r\n\x1a\n spoilt")
    with pytest.raises(PatchfemError, match="not a readable HDF5 file"):
        export(tmp_path, tmp_path / "a.vtu")
    write_small(tmp_path / "out")
    (tmp_path / "a_frames").mkdir()
    (tmp_path / "a_frames" / "mine.txt").write_text("kept")
    with pytest.raises(PatchfemError, match=r"mine\.txt"):
        export(tmp_path / "out", tmp_path / "a.pvd")
    assert (tmp_path / "a_frames" / "mine.txt").read_text() == "kept"


def test_exact_bond_line_of_a_run_carries_load_and_friction_in_every_frame(bench):
    with Series(bench) as series:
        for number in range(len(series)):
            frame = series.frame(number)
            line = frame.interface()
            x = frame.points[line, 0]
            share = np.convolve(np.diff(x), [0.5, 0.5])
            size = 1e-6 * share @ frame.point_data["normal_stress"][line]
            for inside, outside in (("normal_bond", "normal_stress"), ("shear_bond", "shear_stress")):
                top, bond = (share @ frame.point_data[name][line].astype(float) for name in (outside, inside))
                assert bond == pytest.approx(top, abs=size)
                upper = np.unique(np.concatenate([block.ravel() for block in frame.cells(1)]))
                upper = upper[frame.points[upper, 1] == 0]
                assert share @ frame.point_data[inside][upper].astype(float) == pytest.approx(bond, abs=size)
                inner = frame.points[:, 1] != 0
                assert np.isnan(frame.point_data[inside][inner]).all()
        assert np.abs(frame.point_data["shear_stress"][line]).max() > 0
        assert series.units["stress_error"] == "1" and series.units["shear_bond"] == "Pa"
        error = frame.cell_data["stress_error"]
        assert np.isnan(error[frame.cell_data["part"] == 2]).all()
        assert 0.01 < np.sqrt(np.nansum(error.astype(float)**2)) < 0.5


def test_refuses_a_run_without_contact(tmp_path):
    (tmp_path / "point.toml").write_text(BENCH, "utf-8")
    assert cli("run", tmp_path / "point.toml", "-o", tmp_path / "out", "-q").code == 0
    for words in (("export", tmp_path / "out", "-o", tmp_path / "a.pvd"), ("view", tmp_path / "out")):
        answer = cli(*words)
        assert answer.code == 4 and "only a run with [contact]" in answer.err


def test_always_export_needs_neither_pyvista_nor_meshio_nor_elements(bench, tmp_path):
    code = ("import json, sys; from patchfem.__main__ import main\ntry:\n    main(sys.argv[1:])\n"
            "except SystemExit as end:\n    assert not end.code\nprint(json.dumps(sorted(sys.modules)))")
    for words in (("export", bench, "-o", tmp_path / "a.pvd"), ("view", bench, "-o", tmp_path / "a.svg")):
        command = [sys.executable, "-c", code, *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        modules = set(json.loads(done.stdout.splitlines()[-1]))
        assert not {"pyvista", "meshio", "skfem", "numba", "vtkmodules"} & modules
