"""fields.vtkhdf and its exports agree with the run when VTK, PyVista, meshio and h5py read them."""

import csv
import shutil

import h5py
import meshio
import numpy as np
import pytest
import pyvista
from command_line import run_cli, run_successfully
from exported import frame_values, write_small_series
from scene_texts import CROWNED_BENCH
from vtk_frames import read_with_vtk
from vtkmodules.vtkCommonCore import vtkDataArray

import patchfem as pf
from patchfem.export.fields.vtkhdf import VTK_FIELDS, VTKHDF_FILE, read_frames

PARTS = ["lower", "upper", "interface"]
MAX_ROUNDING = 1e-6  # relative error of a number in the file
MAX_ESTIMATE_ROUNDING = 1e-2  # that of stress_error, which is an estimate itself


def assert_block_equal(grid, block, number: int) -> None:
    """Assert that a grid has the mesh and the fields of a block, and no other fields."""
    sizes = np.diff(grid.cell_offsets)
    assert np.array_equal(grid.points, block.points)
    assert np.array_equal(
        grid.cell_connectivity, np.concatenate([c[:n] for c, n in zip(block.cells, sizes)])
    )
    for data, written in ((grid.point_data, block.point_data), (grid.cell_data, block.cell_data)):
        assert set(data.keys()) == written.keys()
        for name, values in written.items():
            tolerance = MAX_ESTIMATE_ROUNDING if name == "stress_error" else MAX_ROUNDING
            np.testing.assert_allclose(
                data[name], frame_values(values, number), tolerance, 0, err_msg=name
            )


def test_exact_vtk_reads_pieces(tmp_path, capfd):
    """VTK reads named blocks with the meshes, times and numbers of the pieces, and prints no error."""
    small = write_small_series(tmp_path / "out", 4)
    frames = read_with_vtk(tmp_path / "out" / VTKHDF_FILE)
    assert [time for time, _ in frames] == list(small.times) and not capfd.readouterr().err
    for number, (_, grids) in enumerate(frames):
        assert grids.keys() == PARTS
        for part in PARTS:
            assert_block_equal(grids[part], small.blocks[part], number)
        for side, piece in (("lower", small.pieces.lower), ("upper", small.pieces.upper)):
            # triangles come first, which shows that the cells have their own values
            assert list(grids[side].celltypes) == [5, 5, 9, 9, 9, 9, 9]
            stress = grids[side].cell_data["stress"]
            np.testing.assert_allclose(stress[:, :4], piece.stress[number], 2 * MAX_ROUNDING)
            assert not stress[:, 4:].any()
            assert np.array_equal(grids[side].cell_data["material"], piece.is_coating)
        worn = small.pieces.interface["worn_depth"][number]
        np.testing.assert_allclose(grids["interface"]["worn_depth"], worn, 2 * MAX_ROUNDING)


def test_exact_equal_frames_are_stored_once(tmp_path):
    """A file has the different frames of each field, and is read in all frames, also the named fields alone."""
    small = write_small_series(tmp_path / "out", 5, order=[0, 1, 0, 2, 1])
    lower = small.blocks["lower"]
    path = tmp_path / "out" / VTKHDF_FILE
    with h5py.File(path) as file:
        assert len(file["VTKHDF/lower/CellData/stress"]) == 3 * len(lower.cells)
    read = read_frames(path, {"stress"}).blocks["lower"]
    assert np.array_equal(read.cell_data["stress"], lower.cell_data["stress"])
    assert read.cell_data.keys() == {"stress"} and not read.point_data
    frames = [parts["lower"].cell_data["stress"] for _, parts in read_with_vtk(path)]
    np.testing.assert_allclose(frames, lower.cell_data["stress"], MAX_ROUNDING)


def test_exact_coating_carries_load_and_friction(bench_folder):
    """In every frame the stress below each coating carries the load and the friction force within 2e-6 of the load."""
    line = read_frames(bench_folder / VTKHDF_FILE).blocks["interface"]
    weight = line.point_data["weight"][0]
    load = weight @ line.point_data["normal_stress"].T
    for side in ("lower", "upper"):
        for name in ("normal", "shear"):
            carried = line.point_data[f"{name}_bond_{side}"].astype(float) @ weight
            acting = line.point_data[f"{name}_stress"].astype(float) @ weight
            assert np.abs(carried - acting).max() < 2e-6 * load.max()
    assert np.abs(line.point_data["shear_stress"]).max() > 0


def test_exact_file_states_units_and_codes(tmp_path):
    """Every array of the file has its unit, and those with codes the meanings of the codes."""
    write_small_series(tmp_path / "out")
    units = {"normal_stress": "Pa", "gap": "m", "stress_error": "1", "weight": "m2", "stress": "Pa"}
    with h5py.File(tmp_path / "out" / VTKHDF_FILE) as file:
        for part in PARTS:
            group = file["VTKHDF"][part]
            arrays = {**group["PointData"], **group["CellData"]}
            for name, array in arrays.items():
                assert array.attrs["units"] == units.get(name, array.attrs["units"]) != ""
        assert file["VTKHDF/lower/CellData/material"].attrs["flag_meanings"] == "substrate coating"
        status = file["VTKHDF/interface/PointData/status"].attrs
        assert status["flag_meanings"] == "open stick slip" and list(status["flag_values"]) == [
            0,
            1,
            2,
        ]


def test_exact_vtu_agrees_in_meshio(tmp_path):
    """A .vtu has the fields of both pieces in one frame, with units and time."""
    small = write_small_series(tmp_path / "out")
    out = tmp_path / "new/a.vtu"
    assert run_cli("export", tmp_path / "out", "-o", out, "--frame", 1).out.startswith(
        f"{out}: frame 1 of 0 to 2"
    )
    mesh = meshio.read(out)
    written = [small.blocks[name] for name in ("lower", "upper")]
    stress = np.concatenate([block.cell_data["von_mises"][1] for block in written])
    found = np.concatenate(mesh.cell_data["von_mises"])
    np.testing.assert_allclose(np.sort(found), np.sort(stress), MAX_ROUNDING)
    grid = pyvista.read(out)
    assert np.array_equal(grid.points, np.concatenate([block.points for block in written]))
    assert np.array_equal(grid["von_mises"], stress)
    assert grid.field_data["TimeValue"][0] == small.times[1]
    information = grid.point_data.VTKObject.GetAbstractArray("displacement").GetInformation()
    assert information.Get(vtkDataArray.UNITS_LABEL()) == "m"


def test_exact_pvd_lists_parts_of_all_frames(tmp_path):
    """A .pvd is a time series of the named parts, each a .vtu with the mesh and the fields of its block."""
    small = write_small_series(tmp_path / "out")
    run_successfully("export", tmp_path / "out", "-o", tmp_path / "a.pvd")
    reader = pyvista.get_reader(tmp_path / "a.pvd")
    assert reader.time_values == list(small.times)
    for number in range(3):
        reader.set_active_time_point(number)
        (grids,) = reader.read()
        assert grids.keys() == list(PARTS)
        for part, grid in zip(PARTS, grids, strict=True):
            assert_block_equal(grid, small.blocks[part], number)
            assert grid.field_data["TimeValue"][0] == small.times[number]


def test_exact_csv_has_interface_values(tmp_path):
    """A .csv has the points of the interface and their fields in SI, as they are in the file."""
    write_small_series(tmp_path / "out")
    run_successfully("export", tmp_path / "out", "-o", tmp_path / "a.csv", "--frame", 1)
    with open(tmp_path / "a.csv", newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    columns = dict(zip(header, np.array(rows, float).T))
    line = read_frames(tmp_path / "out" / VTKHDF_FILE).blocks["interface"]
    assert np.array_equal(columns.pop("x [m]"), line.points[:, 0])
    for k, axis in enumerate("xy"):
        moved = columns.pop(f"displacement_{axis} [m]").astype(np.float32)
        assert np.array_equal(moved, line.point_data["displacement"][1, :, k])
    for label, values in columns.items():
        name, unit = label.rstrip("]").split(" [")
        written = frame_values(line.point_data[name], 1)
        assert (
            np.array_equal(values.astype(written.dtype), written) and VTK_FIELDS[name].unit == unit
        )


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        (["-o", "a.mat"], 2, "it has no summary.json"),
        (["-o", "a.xlsx"], 2, ".pvd, .vtkhdf, .vtu, .csv"),
        (["-o", "a.vtu", "--frame", "-4"], 2, "frames 0 to 2"),
        (["-o", "a.pvd", "--frame", "1"], 2, "contains all frames"),
        ([], 2, "-o"),
        (["-o", f"out/{VTKHDF_FILE}/x/a.vtu"], 4, f"{VTKHDF_FILE} is a file"),
    ],
)
def test_refuses_unsupported_field_export(tmp_path, monkeypatch, arguments, code, message):
    """An unsupported file, a frame that does not exist or a place that is no folder is refused; no file is written."""
    write_small_series(tmp_path / "out")
    monkeypatch.chdir(tmp_path)
    answer = run_cli("export", "out", *arguments)
    assert answer.code == code and message in answer.err and "internal fault" not in answer.err
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_exact_grids_of_result_agree_with_patch_and_file(tmp_path):
    """Result.to_pyvista has the numbers of result.patch and of the file, in SI units."""
    crowned_run = pf.run(CROWNED_BENCH)
    all_frames = crowned_run.to_pyvista(frame=None)
    crowned_run.save(tmp_path / "run")
    for number, (time, written) in enumerate(read_with_vtk(tmp_path / "run" / VTKHDF_FILE)):
        grids = all_frames[number]
        assert grids.keys() == written.keys() == PARTS
        assert grids["upper"].field_data["TimeValue"][0] == time
        for part in grids.keys():
            for data, expected in (
                (grids[part].point_data, written[part].point_data),
                (grids[part].cell_data, written[part].cell_data),
            ):
                for name in expected.keys():
                    tolerance = (
                        MAX_ESTIMATE_ROUNDING if name == "stress_error" else 2 * MAX_ROUNDING
                    )
                    np.testing.assert_allclose(data[name], expected[name], tolerance, 0)
    assert number == len(all_frames) - 1

    line = crowned_run.to_pyvista()["interface"]
    patch = crowned_run.patch
    for name in ("normal_stress", "shear_stress", "slip", "gap"):
        values = getattr(patch, name)
        np.testing.assert_allclose(line[name], values, 1e-6, 1e-6 * np.abs(values).max())
    assert np.array_equal(line.points[:, 0], patch.x)


@pytest.mark.parametrize(
    "name, value, is_refused",
    [
        ("lower/Connectivity", 10**9, True),
        ("upper/Connectivity", -1, True),
        ("interface/PointData/normal_stress", -1.0, False),
    ],
)
def test_refuses_impossible_mesh_of_a_page(bench_folder, tmp_path, name, value, is_refused):
    """A page names the file whose cells have nodes that do not exist; pressures that are all below 0 are drawn."""
    folder = shutil.copytree(bench_folder, tmp_path / "out")
    with h5py.File(folder / VTKHDF_FILE, "r+") as file:
        file[f"VTKHDF/{name}"][...] = value
    answer = run_cli("report", folder, "-o", tmp_path / "page.html")
    if is_refused:
        assert answer.code == 2 and f"{folder / VTKHDF_FILE}: not the fields" in answer.err
        assert "a cell has a node that does not exist" in answer.err
    else:
        assert answer.code == 0
        assert "von Mises stress in both pieces" in (tmp_path / "page.html").read_text("utf-8")
