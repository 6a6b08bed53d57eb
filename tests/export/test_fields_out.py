"""fields.vtkhdf back in and out as .pvd, .vtu and .csv, read by VTK, pyvista, meshio and csv to the last bit."""

from __future__ import annotations

import csv
import json
import shlex
import subprocess
import sys

import h5py
import meshio
import numpy as np
import pytest
import pyvista
from command_line import cli
from exported import CROWNED, UNITS, at, write_small
from scene_texts import BENCH
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDataArray
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from patchfem.core import Missing, PatchfemError
from patchfem.export.fields.blocks import CODES, NAMES
from patchfem.export.fields.series import Series
from patchfem.export.fields.vtkhdf import NAME
from patchfem.export.fields.vtu import export_fields
from patchfem.export.results import FILES

ON_THE_INTERFACE = {"normal_stress", "gap", "status", "normal_bond_lower", "normal_bond_upper"}


def through_vtk(path):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def same_block(grid, block, number: int) -> None:
    """A block of pyvista or VTK is the one that was written, and has no other arrays."""
    grid = pyvista.wrap(grid)
    assert np.array_equal(grid.points, block.points)
    assert np.array_equal(grid.cell_connectivity, block.connectivity) and np.array_equal(
        grid.celltypes, block.types
    )
    for data, theirs in ((grid.point_data, block.point_data), (grid.cell_data, block.cell_data)):
        assert set(data.keys()) == theirs.keys()
        for name, values in theirs.items():
            wanted = at(values, number)
            assert data[name].dtype == wanted.dtype
            assert np.array_equal(data[name], wanted, equal_nan=wanted.dtype.kind == "f"), name


def joined(given, number: int) -> tuple:
    """Points, connectivity, point data and cell data of the written blocks as one mesh, put together here anew."""
    points = np.concatenate([one.points for one in given.blocks.values()])
    nodes = np.concatenate(
        [
            given.blocks["lower"].connectivity,
            12 + given.blocks["upper"].connectivity,
            24 + given.blocks["interface"].connectivity,
        ]
    )
    at_points = {
        "displacement": np.concatenate(
            [one.point_data["displacement"][number] for one in given.blocks.values()]
        )
    }
    for name in ON_THE_INTERFACE:
        values = given.blocks["interface"].point_data[name][number]
        at_points[name] = np.concatenate(
            [np.full(24, -1 if name == "status" else np.nan, values.dtype), values]
        )
    in_cells = {"part": np.repeat(np.array([0, 1, 2], np.int8), [7, 7, 3])}
    for name in ("stress", "von_mises", "stress_error", "material"):
        values = np.concatenate(
            [at(given.blocks[side].cell_data[name], number) for side in ("lower", "upper")]
        )
        in_cells[name] = np.concatenate(
            [
                values,
                np.full((3, *values.shape[1:]), -1 if name == "material" else np.nan, values.dtype),
            ]
        )
    return points, nodes, at_points, in_cells


def test_exact_blocks_hold_what_the_pieces_gave(tmp_path):
    given = write_small(tmp_path / "out", 4)
    assert tuple(given.blocks) == NAMES
    for side, one in zip(("lower", "upper"), given.pair):
        block = given.blocks[side]
        assert not ON_THE_INTERFACE & {*block.point_data, *block.cell_data}
        assert np.array_equal(block.points[:, :2], one["points"]) and not block.points[:, 2].any()
        assert np.array_equal(
            block.point_data["displacement"][..., :2], one["displacement"].astype(np.float32)
        )
        assert np.array_equal(block.cell_data["stress"][..., :4], one["stress"].astype(np.float32))
        assert np.array_equal(block.cell_data["material"][0], one["material"])
        assert np.array_equal(
            given.blocks["interface"].point_data[f"normal_bond_{side}"],
            one["bond"]["normal_bond"].astype(np.float32),
        )
    line = given.blocks["interface"]
    assert np.array_equal(line.points[:, 0], given.pair[0]["points"][given.pair[0]["interface"], 0])
    assert np.array_equal(line.connectivity, [0, 1, 1, 2, 2, 3])
    assert np.array_equal(
        line.point_data["displacement"], given.blocks["lower"].point_data["displacement"][:, ::3]
    )
    for name, values in given.interface.items():
        assert np.array_equal(line.point_data[name], values.astype(line.point_data[name].dtype))


def test_exact_vtk_reads_three_named_blocks_at_every_time(tmp_path, capfd):
    given = write_small(tmp_path / "out", 4)
    reader = vtkHDFReader()
    reader.SetFileName(str(tmp_path / "out" / NAME))
    reader.UpdateInformation()
    for number in (0, 3, 1):
        reader.UpdateTimeStep(given.times[number])
        out = reader.GetOutputDataObject(0)
        assert [
            out.GetMetaData(k).Get(vtkCompositeDataSet.NAME())
            for k in range(out.GetNumberOfBlocks())
        ] == list(NAMES)
        for k, name in enumerate(NAMES):
            same_block(out.GetBlock(k), given.blocks[name], number)
    assert reader.GetNumberOfSteps() == 4 and not capfd.readouterr().err


def test_exact_units_and_codes_stand_in_the_file(tmp_path):
    write_small(tmp_path / "out")
    with h5py.File(tmp_path / "out" / NAME) as file:
        for block in NAMES:
            group = file["VTKHDF"][block]
            arrays = {**group["PointData"], **group["CellData"]}
            assert {name: one.attrs["units"] for name, one in arrays.items()} == {
                name: UNITS[name] for name in arrays
            }
            for name in {*arrays} & {*CODES}:
                assert (
                    dict(
                        zip(
                            arrays[name].attrs["flag_values"],
                            arrays[name].attrs["flag_meanings"].split(),
                        )
                    )
                    == CODES[name]
                )
            assert {b"gap [m]", b"stress [Pa]"} < set(group["FieldData/units"][:])
            assert {b"material 1 coating", b"status 2 slip"} < set(group["FieldData/codes"][:])


@pytest.mark.parametrize("number", [None, 0, 1])
def test_exact_vtu_is_read_by_vtk_and_by_meshio(tmp_path, number):
    given = write_small(tmp_path / "out")
    words = ["export", tmp_path / "out", "-o", tmp_path / "one.vtu"] + (
        [] if number is None else ["--frame", number]
    )
    assert cli(*words).code == 0
    frame = 2 if number is None else number
    grid = through_vtk(tmp_path / "one.vtu")
    mesh = meshio.read(tmp_path / "one.vtu")
    points, nodes, at_points, in_cells = joined(given, frame)
    assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), points) and np.array_equal(
        mesh.points, points
    )
    assert np.array_equal(vtk_to_numpy(grid.GetCells().GetConnectivityArray()), nodes)
    assert np.array_equal(np.concatenate([block.data.ravel() for block in mesh.cells]), nodes)
    assert vtk_to_numpy(grid.GetFieldData().GetArray("TimeValue")) == given.times[frame]
    for data, theirs, other in (
        (grid.GetPointData(), at_points, mesh.point_data),
        (grid.GetCellData(), in_cells, mesh.cell_data),
    ):
        assert data.GetNumberOfArrays() == len(theirs) and other.keys() == theirs.keys()
        for name, wanted in theirs.items():
            array = data.GetArray(name)
            read = vtk_to_numpy(array)
            again = other[name]
            again = np.concatenate(again) if isinstance(again, list) else again
            assert read.dtype == again.dtype == wanted.dtype
            assert np.array_equal(read, wanted, equal_nan=wanted.dtype.kind == "f"), name
            assert np.array_equal(again, wanted, equal_nan=wanted.dtype.kind == "f"), name
            assert (
                array.GetInformation().Get(vtkDataArray.UNITS_LABEL())
                == (UNITS | {"part": "1"})[name]
            )
    said = {f"unit of {name}: {unit}": 1.0 for name, unit in (UNITS | {"part": "1"}).items()} | {
        f"code of {name}: {meaning}": code
        for name, codes in CODES.items()
        for code, meaning in codes.items()
    }
    field = grid.GetFieldData()
    assert {
        field.GetArrayName(k): field.GetArray(k).GetTuple1(0)
        for k in range(field.GetNumberOfArrays())
    } == said | {"TimeValue": given.times[frame]}


def test_exact_pvd_is_read_by_pyvista_as_named_blocks(tmp_path):
    given = write_small(tmp_path / "out", 12)
    out = tmp_path / "out" / "fields.pvd"
    assert cli("export", tmp_path / "out", "-o", out).code == 0
    reader = pyvista.PVDReader(str(out))
    assert reader.time_values == list(given.times)
    for number in range(12):
        reader.set_active_time_point(number)
        blocks = reader.read()[0]
        assert blocks.keys() == list(NAMES)
        for name in NAMES:
            same_block(blocks[name], given.blocks[name], number)
            assert ("unit of gap: m" in blocks[name].field_data) == (name == "interface")
    mesh = meshio.read(tmp_path / "out" / "fields_frames" / "frame_0011_interface.vtu")
    assert np.array_equal(mesh.point_data["gap"], given.blocks["interface"].point_data["gap"][11])
    assert (
        {path.name for path in (tmp_path / "out").iterdir()}
        == {NAME, "fields.pvd", "fields_frames"}
        <= set(FILES)
    )
    (tmp_path / "out" / "fields_frames" / "frame_0007.vtu").write_text("of an earlier version")
    write_small(tmp_path / "out", 2)  # a shorter series leaves no frames of the longer one
    assert cli("export", tmp_path / "out", "-o", out).code == 0
    assert sorted(path.name for path in (tmp_path / "out" / "fields_frames").iterdir()) == sorted(
        f"frame_000{number}{end}"
        for number in (0, 1)
        for end in (".vtm", *(f"_{name}.vtu" for name in NAMES))
    )


def test_exact_csv_holds_the_interface_to_the_last_bit(tmp_path):
    given = write_small(tmp_path / "out")
    assert cli("export", tmp_path / "out", "-o", tmp_path / "rows.csv", "--frame", 1).code == 0
    with open(tmp_path / "rows.csv", newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    columns = dict(zip(head, zip(*rows)))
    line = given.blocks["interface"]
    assert np.array_equal(np.array(columns.pop("x [m]"), float), line.points[:, 0])
    for name, values in line.point_data.items():
        wanted = at(values, 1)
        for k, axis in enumerate(("_x", "_y", "_z") if wanted.ndim > 1 else ("",)):
            read = np.array(columns.pop(f"{name}{axis} [{UNITS[name]}]")).astype(wanted.dtype)
            assert np.array_equal(read, wanted[:, k] if axis else wanted)
    assert not columns


def test_exact_vtkhdf_is_copied_and_not_onto_itself(tmp_path):
    write_small(tmp_path / "out")
    assert cli("export", tmp_path / "out", "-o", tmp_path / "copy.vtkhdf").code == 0
    assert (tmp_path / "copy.vtkhdf").read_bytes() == (tmp_path / "out" / NAME).read_bytes()
    assert cli("export", tmp_path / "out", "-o", tmp_path / "out" / NAME).code == 2


@pytest.mark.parametrize(
    "words, code, says",
    [
        (["-o", "a.mat"], 4, "neither result.nc"),
        (["-o", "a.uff"], 4, "neither result.nc"),
        (["-o", "a.xlsx"], 2, ".pvd, .vtu, .csv, .vtkhdf"),
        (["-o", "a"], 2, ".pvd"),
        (["-o", "a.vtu", "--frame", "3"], 2, "frames 0 to 2"),
        (["-o", "a.vtu", "--frame", "-4"], 2, "frames 0 to 2"),
        (["-o", "a.pvd", "--frame", "1"], 2, "whole series"),
        ([], 2, "-o"),
        (["-o", f"out/{NAME}/x/a.vtu"], 4, f"{NAME} is a file"),
        (["-o", "nowhere/x/a.bmp"], 2, ".pvd, .vtu, .csv"),
    ],
)
def test_refuses_exports_by_name(tmp_path, monkeypatch, words, code, says):
    write_small(tmp_path / "out")
    monkeypatch.chdir(tmp_path)
    answer = cli("export", "out", *words)
    assert answer.code == code and says in answer.err and "internal fault" not in answer.err
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(
    "name, made",
    [
        ("a.vtu", {"a.vtu"}),
        ("fields.pvd", {"fields.pvd", "fields_frames"}),
        ("a.csv", {"a.csv"}),
        ("a.vtkhdf", {"a.vtkhdf"}),
    ],
)
def test_always_the_folder_of_an_export_is_made(tmp_path, name, made):
    """`export tp -o tp_pvd/fields.pvd`, as the answer of a run suggests it, once named fields_frames that could not be
    written."""
    write_small(tmp_path / "out")
    answer = cli("export", tmp_path / "out", "-o", tmp_path / "new" / "one" / name)
    assert answer.code == 0, answer.err
    assert {one.name for one in (tmp_path / "new" / "one").iterdir()} == made


def test_refuses_folders_without_fields_and_spoilt_files(tmp_path):
    with pytest.raises(Missing, match="no such results folder"):
        export_fields(tmp_path / "nowhere", tmp_path / "a.vtu")
    with pytest.raises(Missing, match=r"only a run with \[contact\]"):
        export_fields(tmp_path, tmp_path / "a.vtu")
    (tmp_path / NAME).write_bytes(b"\x89HDF\r\n\x1a\n spoilt")
    with pytest.raises(PatchfemError, match="not a readable HDF5 file"):
        export_fields(tmp_path, tmp_path / "a.vtu")
    write_small(tmp_path / "out")
    (tmp_path / "a_frames").mkdir()
    (tmp_path / "a_frames" / "mine.txt").write_text("kept")
    with pytest.raises(PatchfemError, match=r"mine\.txt"):
        export_fields(tmp_path / "out", tmp_path / "a.pvd")
    assert (tmp_path / "a_frames" / "mine.txt").read_text() == "kept"


def test_exact_bond_line_of_a_run_carries_load_and_friction_in_every_frame(bench):
    with Series(bench) as series:
        for number in range(len(series)):
            frame = series.frame(number)
            line = frame.interface()
            x = frame.points[line, 0]
            share = np.convolve(np.diff(x), [0.5, 0.5])
            size = 1e-6 * share @ frame.point_data["normal_stress"][line]
            for side in ("lower", "upper"):
                for inside, outside in (
                    ("normal_bond", "normal_stress"),
                    ("shear_bond", "shear_stress"),
                ):
                    top, bond = (
                        share @ frame.point_data[name][line].astype(float)
                        for name in (outside, f"{inside}_{side}")
                    )
                    assert bond == pytest.approx(top, abs=size)
        assert np.abs(frame.point_data["shear_stress"][line]).max() > 0
        assert series.units["stress_error"] == "1" and series.units["shear_bond_upper"] == "Pa"
        error = frame.cell_data["stress_error"]
        assert np.isnan(error[frame.cell_data["part"] == 2]).all()
        assert 0.01 < np.sqrt(np.nansum(error.astype(float) ** 2)) < 0.5
        meaning = series.root["lower/CellData/stress_error"].attrs["long_name"]
        assert "strain energy of the difference" in meaning and "not a bound" in meaning


def test_always_every_number_of_a_block_is_finite(bench):
    """So a colouring by any array shows that array, and nothing of the colour of NaN."""
    with Series(bench) as series:
        for number in (0, len(series) - 1):
            for one in series.frame(number).blocks.values():
                for name, values in (one.point_data | one.cell_data).items():
                    assert np.isfinite(values).all() and (
                        name not in CODES or set(np.unique(values)) <= {*CODES[name]}
                    )


def test_exact_a_run_says_where_its_fields_are_and_how_an_older_paraview_opens_them(tmp_path):
    (tmp_path / "point.toml").write_text(BENCH, "utf-8")
    (tmp_path / "pair.toml").write_text(CROWNED, "utf-8")
    assert "fields" not in cli("run", tmp_path / "point.toml", "-o", tmp_path / "point").out
    answer = cli("run", tmp_path / "pair.toml", "-o", tmp_path / "my pair")
    said = answer.out.splitlines()[-1]
    assert said.startswith(f"fields: {tmp_path / 'my pair' / NAME} ") and "ParaView 5.13" in said
    command = shlex.split(said.split("`")[1])
    assert command[0] == "patchfem" and cli(*command[1:]).code == 0
    assert pyvista.PVDReader(str(tmp_path / "my pair" / "fields.pvd")).read()[0].keys() == list(
        NAMES
    )


def test_refuses_the_single_mesh_of_an_older_version(tmp_path):
    write_small(tmp_path / "out")
    with h5py.File(tmp_path / "out" / NAME, "r+") as file:
        file["VTKHDF"].attrs["Type"] = np.bytes_("UnstructuredGrid")
    with pytest.raises(PatchfemError, match=r"older version of patchfem; run the scene again"):
        Series(tmp_path / "out")


def test_refuses_a_run_without_contact(tmp_path):
    (tmp_path / "point.toml").write_text(BENCH, "utf-8")
    assert cli("run", tmp_path / "point.toml", "-o", tmp_path / "out", "-q").code == 0
    for words in (
        ("export", tmp_path / "out", "-o", tmp_path / "a.pvd"),
        ("view", tmp_path / "out"),
    ):
        answer = cli(*words)
        assert answer.code == 4 and "only a run with [contact]" in answer.err


def test_always_export_needs_neither_pyvista_nor_meshio_nor_elements(bench, tmp_path):
    code = (
        "import json, sys; from patchfem.__main__ import main\n"
        "for verb, end in ('export', 'pvd'), ('view', 'svg'):\n"
        "    try:\n        main([verb, sys.argv[1], '-o', sys.argv[2] + end])\n"
        "    except SystemExit as ended:\n        assert not ended.code\nprint(json.dumps(sorted(sys.modules)))"
    )
    command = [sys.executable, "-c", code, str(bench), str(tmp_path / "a.")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and {one.suffix for one in tmp_path.iterdir()} >= {
        ".pvd",
        ".svg",
    }, done.stderr
    modules = set(json.loads(done.stdout.splitlines()[-1]))
    assert not {"pyvista", "meshio", "skfem", "numba", "vtkmodules"} & modules
