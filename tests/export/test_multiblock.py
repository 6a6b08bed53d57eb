"""Result.to_pyvista: the grids have the numbers of the files, read by meshio, and those of result.patch."""

import re
import subprocess
import sys

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
def crowned():
    return pf.run(CROWNED)


@pytest.fixture(scope="module")
def frames(crowned):
    return crowned.to_pyvista(frame=None)


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
        in_block = [np.asarray(part) == code for part in mesh.cell_data["part"]]
        for array_name in grid.point_data:
            written = mesh.point_data[array_name][points]
            compared += compare_arrays(grid, grid.point_data[array_name], written, array_name)
        for array_name in grid.cell_data:
            parts = zip(mesh.cell_data[array_name], in_block, strict=True)
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


def test_exact_every_frame_has_the_numbers_of_the_written_file(crowned, frames, tmp_path):
    crowned.save(tmp_path / "run")
    assert len(frames) == len(crowned.fields["time"])
    for number in (0, 1, len(frames) - 1):
        blocks = frames[number]
        assert isinstance(blocks, pyvista.MultiBlock)
        assert blocks.keys() == ["lower", "upper", "interface"]
        pf.export(tmp_path / "run", tmp_path / "frame.vtu", frame=number)
        assert compare_with_file(blocks, tmp_path / "frame.vtu") >= 15
        assert blocks["lower"].field_data["TimeValue"][0] == crowned.fields["time"][number]


def test_exact_the_way_of_the_guide_to_a_later_frame_reads_that_frame(crowned, frames, tmp_path):
    """`pyvista.read` returns the first frame of the series, in which nothing slides."""
    path = crowned.save(tmp_path / "run") / "fields.vtkhdf"
    assert not pyvista.read(path)["interface"]["shear_stress"].any()
    reader = pyvista.get_reader(path)
    for number in (3, len(frames) - 1):
        reader.reader.SetStep(number)
        values = reader.read()["interface"]["shear_stress"]
        expected = frames[number]["interface"]["shear_stress"] * MPA
        assert values.any() and np.allclose(values, expected, rtol=3e-7, atol=0)


def test_exact_the_last_frame_is_that_of_the_patch(crowned):
    patch = crowned.patch
    line = crowned.to_pyvista()["interface"]
    for name, values, unit in (
        ("normal_stress", patch.normal_stress, MPA),
        ("shear_stress", patch.shear_stress, MPA),
        ("slip", patch.slip, 1.0),
        ("gap", patch.gap, 1.0),
    ):
        size = np.abs(values).max()
        assert size > 0 and np.allclose(line[name] * unit, values, rtol=1e-6, atol=1e-6 * size), (
            name
        )
    assert np.array_equal(line.points[:, 0], patch.x)


def test_always_a_frame_is_chosen_by_its_number(crowned, frames):
    count = len(frames)
    for number in (2, -count, np.int64(count - 1)):
        chosen = crowned.to_pyvista(frame=number)
        for name in chosen.keys():
            assert np.array_equal(
                chosen[name].point_data["displacement"],
                frames[number][name].point_data["displacement"],
            )
    for number in (count, -count - 1, 0.5, "last"):
        with pytest.raises(pf.PatchfemError, match=rf"no frame {number}; .* 0 to {count - 1}"):
            crowned.to_pyvista(frame=number)


def test_exact_the_stress_balances_the_load(frames, crowned):
    """Pressed, the vertical stress near the far face carries the load; independent of the files."""
    upper = frames[0]["upper"]
    centres = upper.cell_centers().points
    height = centres[:, 1].max()
    row = np.isclose(centres[:, 1], height, rtol=1e-6)
    areas = upper.compute_cell_sizes(length=False, volume=False)["Area"][row]
    load = crowned.plan.model.nominal_load
    mean = -(upper["stress"][row, 1] * areas).sum() / areas.sum()
    pieces = crowned.plan.model.patch.pieces
    length = upper.points[:, 0].max() - upper.points[:, 0].min()
    assert mean * MPA == pytest.approx(load / length / pieces.width, rel=0.01)


def test_refuses_a_run_without_pieces():
    with pytest.raises(pf.PatchfemError, match=re.escape("no [contact]")):
        pf.run(pf.new("bench")).to_pyvista()


def test_always_pyvista_is_imported_only_when_it_is_asked_for():
    code = (
        "import sys, patchfem as pf; run = pf.run(pf.new('patch'));"
        "assert 'pyvista' not in sys.modules; run.to_pyvista(); assert 'pyvista' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
