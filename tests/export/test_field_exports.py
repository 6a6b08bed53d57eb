"""Exports of fields.vtkhdf as .pvd and .csv agree to the last bit when read by VTK, PyVista and meshio."""

from __future__ import annotations

import csv

import h5py
import meshio
import numpy as np
import pytest
import pyvista
from command_line import run_cli
from exported import UNITS, frame_values, write_small_series
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet
from vtkmodules.vtkIOHDF import vtkHDFReader

from patchfem.core import Missing, PatchfemError
from patchfem.export.fields.blocks import CODES, NAMES
from patchfem.export.fields.series import Series
from patchfem.export.fields.vtkhdf import NAME
from patchfem.export.fields.vtu import export_fields
from patchfem.export.results import FILES

INTERFACE_ARRAYS = {"normal_stress", "gap", "status", "normal_bond_lower", "normal_bond_upper"}


def assert_block_equal(grid, block, number: int) -> None:
    """Assert that a grid of PyVista or VTK equals the written block and has no other arrays."""
    grid = pyvista.wrap(grid)
    assert np.array_equal(grid.points, block.points)
    assert np.array_equal(grid.cell_connectivity, block.connectivity) and np.array_equal(
        grid.celltypes, block.types
    )
    for data, expected_arrays in (
        (grid.point_data, block.point_data),
        (grid.cell_data, block.cell_data),
    ):
        assert set(data.keys()) == expected_arrays.keys()
        for name, values in expected_arrays.items():
            expected = frame_values(values, number)
            assert data[name].dtype == expected.dtype
            assert np.array_equal(data[name], expected, equal_nan=expected.dtype.kind == "f"), name


def test_exact_blocks_have_values_of_pieces(tmp_path):
    """The blocks of a file have the points, displacements, stresses, materials and bond stresses of the pieces."""
    small = write_small_series(tmp_path / "out", 4)
    assert tuple(small.blocks) == NAMES
    for side, piece in zip(("lower", "upper"), small.pair):
        block = small.blocks[side]
        assert not INTERFACE_ARRAYS & {*block.point_data, *block.cell_data}
        assert np.array_equal(block.points[:, :2], piece["points"]) and not block.points[:, 2].any()
        assert np.array_equal(
            block.point_data["displacement"][..., :2], piece["displacement"].astype(np.float32)
        )
        assert np.array_equal(
            block.cell_data["stress"][..., :4], piece["stress"].astype(np.float32)
        )
        assert np.array_equal(block.cell_data["material"][0], piece["material"])
        assert np.array_equal(
            small.blocks["interface"].point_data[f"normal_bond_{side}"],
            piece["bond"]["normal_bond"].astype(np.float32),
        )
    line = small.blocks["interface"]
    assert np.array_equal(line.points[:, 0], small.pair[0]["points"][small.pair[0]["interface"], 0])
    assert np.array_equal(line.connectivity, [0, 1, 1, 2, 2, 3])
    assert np.array_equal(
        line.point_data["displacement"], small.blocks["lower"].point_data["displacement"][:, ::3]
    )
    for name, values in small.interface.items():
        assert np.array_equal(line.point_data[name], values.astype(line.point_data[name].dtype))


def test_exact_vtk_reads_three_named_blocks(tmp_path, capfd):
    """VTK reads three named blocks with equal arrays at every time, and prints no error."""
    small = write_small_series(tmp_path / "out", 4)
    reader = vtkHDFReader()
    reader.SetFileName(str(tmp_path / "out" / NAME))
    reader.UpdateInformation()
    for number in (0, 3, 1):
        reader.UpdateTimeStep(small.times[number])
        grids = reader.GetOutputDataObject(0)
        assert [
            grids.GetMetaData(k).Get(vtkCompositeDataSet.NAME())
            for k in range(grids.GetNumberOfBlocks())
        ] == list(NAMES)
        for k, name in enumerate(NAMES):
            assert_block_equal(grids.GetBlock(k), small.blocks[name], number)
    assert reader.GetNumberOfSteps() == 4 and not capfd.readouterr().err


def test_exact_file_states_units_and_codes(tmp_path):
    """The file states the unit of every array and the meanings of the codes."""
    write_small_series(tmp_path / "out")
    with h5py.File(tmp_path / "out" / NAME) as file:
        for block in NAMES:
            group = file["VTKHDF"][block]
            arrays = {**group["PointData"], **group["CellData"]}
            assert {name: array.attrs["units"] for name, array in arrays.items()} == {
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


def test_exact_pvd_agrees_in_pyvista(tmp_path):
    """A .pvd export has the same times and blocks when read by PyVista.

    A shorter series written afterwards leaves no older frames.
    """
    small = write_small_series(tmp_path / "out", 12)
    pvd_file = tmp_path / "out" / "fields.pvd"
    assert run_cli("export", tmp_path / "out", "-o", pvd_file).code == 0
    reader = pyvista.PVDReader(str(pvd_file))
    assert reader.time_values == list(small.times)
    for number in range(12):
        reader.set_active_time_point(number)
        blocks = reader.read()[0]
        assert blocks.keys() == list(NAMES)
        for name in NAMES:
            assert_block_equal(blocks[name], small.blocks[name], number)
            assert ("unit of gap: m" in blocks[name].field_data) == (name == "interface")
    mesh = meshio.read(tmp_path / "out" / "fields_frames" / "frame_0011_interface.vtu")
    assert np.array_equal(mesh.point_data["gap"], small.blocks["interface"].point_data["gap"][11])
    assert (
        {path.name for path in (tmp_path / "out").iterdir()}
        == {NAME, "fields.pvd", "fields_frames"}
        <= set(FILES)
    )
    (tmp_path / "out" / "fields_frames" / "frame_0007.vtu").write_text("of an earlier version")
    write_small_series(
        tmp_path / "out", 2
    )  # a shorter series replaces all frames of the longer one
    assert run_cli("export", tmp_path / "out", "-o", pvd_file).code == 0
    assert sorted(path.name for path in (tmp_path / "out" / "fields_frames").iterdir()) == sorted(
        f"frame_000{number}{end}"
        for number in (0, 1)
        for end in (".vtm", *(f"_{name}.vtu" for name in NAMES))
    )


def test_exact_csv_has_interface_values(tmp_path):
    """A .csv export has the values of the interface to the last bit, with their units."""
    small = write_small_series(tmp_path / "out")
    assert run_cli("export", tmp_path / "out", "-o", tmp_path / "rows.csv", "--frame", 1).code == 0
    with open(tmp_path / "rows.csv", newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    columns = dict(zip(header, zip(*rows)))
    line = small.blocks["interface"]
    assert np.array_equal(np.array(columns.pop("x [m]"), float), line.points[:, 0])
    for name, values in line.point_data.items():
        expected = frame_values(values, 1)
        for k, axis in enumerate(("_x", "_y", "_z") if expected.ndim > 1 else ("",)):
            read = np.array(columns.pop(f"{name}{axis} [{UNITS[name]}]")).astype(expected.dtype)
            assert np.array_equal(read, expected[:, k] if axis else expected)
    assert not columns


def test_exact_vtkhdf_export_is_a_copy(tmp_path):
    """A .vtkhdf export is a copy of the fields file; a copy onto itself is refused."""
    write_small_series(tmp_path / "out")
    assert run_cli("export", tmp_path / "out", "-o", tmp_path / "copy.vtkhdf").code == 0
    assert (tmp_path / "copy.vtkhdf").read_bytes() == (tmp_path / "out" / NAME).read_bytes()
    assert run_cli("export", tmp_path / "out", "-o", tmp_path / "out" / NAME).code == 2


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        (["-o", "a.mat"], 4, "neither result.nc"),
        (["-o", "a.xlsx"], 2, ".pvd, .vtu, .csv, .vtkhdf"),
        (["-o", "a.vtu", "--frame", "-4"], 2, "frames 0 to 2"),
        (["-o", "a.pvd", "--frame", "1"], 2, "whole series"),
        ([], 2, "-o"),
        (["-o", f"out/{NAME}/x/a.vtu"], 4, f"{NAME} is a file"),
    ],
)
def test_refuses_unsupported_field_export(tmp_path, monkeypatch, arguments, code, message):
    """An unsupported file type, an invalid frame or a place that is not a folder is refused, and no file is written."""
    write_small_series(tmp_path / "out")
    monkeypatch.chdir(tmp_path)
    answer = run_cli("export", "out", *arguments)
    assert answer.code == code and message in answer.err and "internal fault" not in answer.err
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_refuses_missing_or_damaged_fields(tmp_path):
    """A missing folder, a run without fields, a damaged file and a folder with other files are refused."""
    with pytest.raises(Missing, match="no such results folder"):
        export_fields(tmp_path / "nowhere", tmp_path / "a.vtu")
    with pytest.raises(Missing, match=r"only a run with \[contact\]"):
        export_fields(tmp_path, tmp_path / "a.vtu")
    (tmp_path / NAME).write_bytes(b"\x89HDF\r\n\x1a\n spoilt")
    with pytest.raises(PatchfemError, match="not a readable HDF5 file"):
        export_fields(tmp_path, tmp_path / "a.vtu")
    write_small_series(tmp_path / "out")
    (tmp_path / "a_frames").mkdir()
    (tmp_path / "a_frames" / "mine.txt").write_text("kept")
    with pytest.raises(PatchfemError, match=r"mine\.txt"):
        export_fields(tmp_path / "out", tmp_path / "a.pvd")
    assert (tmp_path / "a_frames" / "mine.txt").read_text() == "kept"


def test_exact_bond_stresses_carry_load_and_friction(bench_folder):
    """In every frame the integral of the bond stresses equals that of the contact stresses within 1e-6 of the load."""
    with Series(bench_folder) as series:
        for number in range(len(series)):
            frame = series.frame(number)
            line = frame.interface()
            x = frame.points[line, 0]
            lengths = np.convolve(np.diff(x), [0.5, 0.5])
            tolerance = 1e-6 * lengths @ frame.point_data["normal_stress"][line]
            for side in ("lower", "upper"):
                for bond_name, stress_name in (
                    ("normal_bond", "normal_stress"),
                    ("shear_bond", "shear_stress"),
                ):
                    contact_force, bond_force = (
                        lengths @ frame.point_data[name][line].astype(float)
                        for name in (stress_name, f"{bond_name}_{side}")
                    )
                    assert bond_force == pytest.approx(contact_force, abs=tolerance)
        assert np.abs(frame.point_data["shear_stress"][line]).max() > 0
        assert series.units["stress_error"] == "1" and series.units["shear_bond_upper"] == "Pa"
        error = frame.cell_data["stress_error"]
        assert np.isnan(error[frame.cell_data["part"] == 2]).all()
        assert 0.01 < np.sqrt(np.nansum(error.astype(float) ** 2)) < 0.5
        meaning = series.root["lower/CellData/stress_error"].attrs["long_name"]
        assert "strain energy of the difference" in meaning and "not a bound" in meaning


def test_refuses_fields_of_older_version(tmp_path):
    """A fields file with the single mesh of an older version is refused."""
    write_small_series(tmp_path / "out")
    with h5py.File(tmp_path / "out" / NAME, "r+") as file:
        file["VTKHDF"].attrs["Type"] = np.bytes_("UnstructuredGrid")
    with pytest.raises(PatchfemError, match=r"older version of patchfem; run the scene again"):
        Series(tmp_path / "out")
