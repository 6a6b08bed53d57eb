"""Grids of Result.to_pyvista agree with the exported files, read by meshio, and with result.patch."""

import re

import meshio
import numpy as np
import pytest
import pyvista
from exported import CROWNED

import patchfem as pf

MPA = 1e6  # Pa
UNITS = dict.fromkeys(("displacement", "gap", "slip", "worn_depth"), "m")
UNITS |= dict.fromkeys(("stress", "von_mises", "normal_stress", "shear_stress"), "MPa")
UNITS |= {
    f"{name}_bond_{side}": "MPa" for name in ("normal", "shear") for side in ("lower", "upper")
}


@pytest.fixture(scope="module")
def crowned_run():
    """Return the result of a crowned pair."""
    return pf.run(CROWNED)


@pytest.fixture(scope="module")
def all_frames(crowned_run):
    """Return the blocks of all frames of the crowned pair."""
    return crowned_run.to_pyvista(frame=None)


def compare_with_file(blocks, path) -> int:
    """Compare every array of the blocks with a .vtu of one frame, and return the number of arrays."""
    mesh = meshio.read(path)
    first_point = 0
    compared = 0
    for code, name in enumerate(blocks.keys()):
        grid = blocks[name]
        points = slice(first_point, first_point + grid.n_points)
        first_point += grid.n_points
        assert np.array_equal(mesh.points[points], grid.points)
        is_in_block = [np.asarray(part) == code for part in mesh.cell_data["part"]]
        for array_name in grid.point_data:
            written = mesh.point_data[array_name][points]
            compared += compare_arrays(grid, grid.point_data[array_name], written, array_name)
        for array_name in grid.cell_data:
            parts = zip(mesh.cell_data[array_name], is_in_block, strict=True)
            written = np.concatenate([values[chosen] for values, chosen in parts])
            compared += compare_arrays(grid, grid.cell_data[array_name], written, array_name)
    assert first_point == len(mesh.points)
    return compared


def compare_arrays(grid, values, written, name: str) -> int:
    """Assert that an array of a grid is the written one, in MPa if it is a stress."""
    unit = UNITS.get(name, "1")
    assert f"{name} [{unit}]" in list(grid.field_data["units"])
    factor = MPA if unit == "MPa" else 1.0
    assert np.allclose(values * factor, written, rtol=3e-7, atol=0), name
    return 1


def test_exact_frames_agree_with_exported_file(crowned_run, all_frames, tmp_path):
    """The blocks of a frame have the arrays, times and units of the exported .vtu file."""
    crowned_run.save(tmp_path / "run")
    assert len(all_frames) == len(crowned_run.fields["time"])
    for number in (0, 1, len(all_frames) - 1):
        blocks = all_frames[number]
        assert isinstance(blocks, pyvista.MultiBlock)
        assert blocks.keys() == ["lower", "upper", "interface"]
        pf.export(tmp_path / "run", tmp_path / "frame.vtu", frame=number)
        assert compare_with_file(blocks, tmp_path / "frame.vtu") >= 15
        assert blocks["lower"].field_data["TimeValue"][0] == crowned_run.fields["time"][number]


def test_exact_the_way_of_the_guide_to_a_later_frame_reads_that_frame(
    crowned_run, all_frames, tmp_path
):
    """`pyvista.read` returns the first frame of the series, in which nothing slides."""
    path = crowned_run.save(tmp_path / "run") / "fields.vtkhdf"
    assert not pyvista.read(path)["interface"]["shear_stress"].any()
    reader = pyvista.get_reader(path)
    for number in (3, len(all_frames) - 1):
        reader.reader.SetStep(number)
        values = reader.read()["interface"]["shear_stress"]
        expected = all_frames[number]["interface"]["shear_stress"] * MPA
        assert values.any() and np.allclose(values, expected, rtol=3e-7, atol=0)


def test_exact_last_frame_agrees_with_patch(crowned_run):
    """Stresses, slip and gap of the last frame agree with result.patch within 1e-6."""
    patch = crowned_run.patch
    line = crowned_run.to_pyvista()["interface"]
    for name, values, unit in (
        ("normal_stress", patch.normal_stress, MPA),
        ("shear_stress", patch.shear_stress, MPA),
        ("slip", patch.slip, 1.0),
        ("gap", patch.gap, 1.0),
    ):
        max_value = np.abs(values).max()
        assert max_value > 0 and np.allclose(
            line[name] * unit, values, rtol=1e-6, atol=1e-6 * max_value
        ), name
    assert np.array_equal(line.points[:, 0], patch.x)


def test_always_frame_is_selected_by_number(crowned_run, all_frames):
    """A frame is selected by its number, also counted from the end; other numbers are refused."""
    count = len(all_frames)
    for number in (2, -count, np.int64(count - 1)):
        selected = crowned_run.to_pyvista(frame=number)
        for name in selected.keys():
            assert np.array_equal(
                selected[name].point_data["displacement"],
                all_frames[number][name].point_data["displacement"],
            )
    for number in (count, -count - 1, 0.5, "last"):
        with pytest.raises(pf.PatchfemError, match=rf"no frame {number}; .* 0 to {count - 1}"):
            crowned_run.to_pyvista(frame=number)


def test_refuses_grids_of_run_without_contact():
    """A run without [contact] has no grids and is refused."""
    with pytest.raises(pf.PatchfemError, match=re.escape("no [contact]")):
        pf.run(pf.new("bench")).to_pyvista()
