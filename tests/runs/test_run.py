"""Scenes of every kind through the command line: exit codes, the results folder and the consistency
of its files."""

import json
import socket
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from command_line import run_cli
from scene_texts import BENCH, COULOMB, NONLOCAL, POINT, SHEAR, SLIDE, SMALL_PATCH, STRUCTURE
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet
from vtkmodules.vtkIOHDF import vtkHDFReader

from patchfem.effects import EFFECTS
from patchfem.runs import choose_numerics
from patchfem.runs.plan import plan
from patchfem.runs.rig import rig
from patchfem.runs.run import run
from patchfem.scene import load, loads

STUDIES = Path(__file__).parents[2] / "studies"
LOAD, WIDTH, OMEGA = 115.653761996773, 0.0127, 2 * np.pi * 143
STEPS = "[accuracy]\nsteps_per_cycle = 200\n"
SCENES = {
    "patch": SMALL_PATCH, "bench": BENCH, "bench patch": SMALL_PATCH + SHEAR + COULOMB + SLIDE + STEPS,
    "linear": STRUCTURE, "rig": POINT + COULOMB + STRUCTURE, "rig march": POINT + NONLOCAL + STRUCTURE + STEPS,
    "rig patch": SMALL_PATCH + SHEAR + NONLOCAL + STRUCTURE + STEPS,
}  # fmt: skip
WITH_FIELDS = ["patch", "bench patch", "rig patch"]


@pytest.fixture(scope="module")
def run_case(tmp_path_factory):
    """Return a function name -> (results folder, answer of --json) that runs each scene once."""
    base = tmp_path_factory.mktemp("runs")
    results = {}

    def run_once(name):
        if name not in results:
            path = base / f"{name}.toml"
            path.write_text(SCENES[name], "utf-8")
            answer = run_cli("run", path, "-o", base / name, "--json")
            assert answer.code == 0, answer.err
            results[name] = base / name, answer
        return results[name]

    return run_once


@pytest.fixture
def write_scene(tmp_path):
    """Return a function that writes a scene to a file."""

    def write_text(text, name="scene.toml"):
        path = tmp_path / name
        path.write_text(text, "utf-8")
        return path

    return write_text


def read_netcdf(folder):
    """Return the dataset result.nc of a results folder."""
    with xr.open_dataset(folder / "result.nc", engine="h5netcdf") as data:
        return data.load()


class FieldReader:
    """Blocks of arrays of fields.vtkhdf as VTK's own reader returns them."""

    def __init__(self, folder):
        self.reader = vtkHDFReader()
        self.reader.SetFileName(str(folder / "fields.vtkhdf"))
        self.reader.UpdateInformation()
        self.steps = self.reader.GetNumberOfSteps()

    def frame(self, step):
        self.reader.SetStep(step)
        self.reader.Update()
        blocks = self.reader.GetOutputDataObject(0)
        blocks_by_name = {
            blocks.GetMetaData(k).Get(vtkCompositeDataSet.NAME()): self._block(blocks.GetBlock(k))
            for k in range(blocks.GetNumberOfBlocks())
        }
        return SimpleNamespace(time=self.reader.GetTimeValue(), **blocks_by_name)

    @staticmethod
    def _block(grid):
        points = grid.GetPointData()
        cells = grid.GetCellData()
        ends, nodes = (
            vtk_to_numpy(a).copy()
            for a in (grid.GetCells().GetOffsetsArray(), grid.GetCells().GetConnectivityArray())
        )
        return SimpleNamespace(
            place=vtk_to_numpy(grid.GetPoints().GetData()).copy(),
            cells=[nodes[a:b] for a, b in pairwise(ends)],
            **{
                part.GetArrayName(i): vtk_to_numpy(part.GetArray(i)).copy()
                for part in (points, cells)
                for i in range(part.GetNumberOfArrays())
            },
        )


# Files that every run writes.


@pytest.mark.parametrize("name", SCENES)
def test_exact_resolved_scene_equals_scene(run_case, name):
    """The resolved scene of a results folder has the effects and values of the original scene."""
    folder, _ = run_case(name)
    original = load(folder.with_suffix(".toml"))
    resolved = load(folder / "scene.resolved.toml")
    assert (
        resolved.effect_names() == original.effect_names()
        and resolved.resolved() == original.resolved()
    )


@pytest.mark.parametrize("name", WITH_FIELDS)
def test_exact_netcdf_file_has_units_and_balanced_fields(run_case, name):
    """All variables of the dataset have units, and its pressure balances the load and excludes gaps."""
    folder, answer = run_case(name)
    data = read_netcdf(folder)
    measures = json.loads(answer.out)["measures"]
    assert all(
        "units" in variable.attrs
        for variable in data.variables.values()
        if variable.dtype.kind == "f"
    )
    np.testing.assert_allclose((data.weight * data.normal_stress).sum("x"), LOAD, rtol=1e-10)
    assert float(data.weight.sum()) == pytest.approx(WIDTH * 0.0127, rel=1e-12)
    assert (data.normal_stress >= 0).all()
    assert (data.gap >= 0).all()
    assert not (data.normal_stress * data.gap).any()
    centre = float((data.x * data.weight * data.normal_stress).sum("x")[0]) / LOAD
    assert centre == pytest.approx(measures["pressure_centre"]["value"], rel=1e-9)
    assert ((data.status == 0) == (data.normal_stress == 0)).all()
    text = json.dumps(data.attrs)
    assert str(folder.parent) not in text and socket.gethostname() not in text.replace(
        "localhost", ""
    )


@pytest.mark.parametrize("name", ["rig", "rig march", "linear"])
def test_exact_equation_of_motion_holds_at_every_sample(run_case, name):
    """The absolute acceleration times the mass equals -k q - c v - F at each stored sample."""
    data = read_netcdf(run_case(name)[0])
    mass = 0.884
    force = data.friction_force if name != "linear" else 0.0
    expected = (
        -(OMEGA**2) * data.relative_displacement
        - 2 * 0.003 * OMEGA * data.relative_velocity
        - force / mass
    )
    np.testing.assert_allclose(
        data.absolute_acceleration, expected, rtol=0, atol=1e-9 * float(np.abs(expected).max())
    )


def test_exact_shear_stress_sums_to_friction_force(run_case):
    """The shear stress of each frame adds up to the friction force and stays within the friction limit."""
    data = read_netcdf(run_case("rig patch")[0])
    total = (data.weight * data.shear_stress).sum("x").values
    expected = np.interp(data.frame_time.values[1:], data.time.values, data.friction_force.values)
    np.testing.assert_allclose(total[1:], expected, rtol=0, atol=1e-8 * 0.3 * LOAD)
    limit = 0.3 * data.normal_stress
    assert float((np.abs(data.shear_stress) - limit).max()) <= 1e-9 * float(limit.max())


# Fields of the interface and of both pieces.


@pytest.mark.parametrize("name", WITH_FIELDS)
def test_exact_displacements_of_both_pieces_close_the_gap(run_case, name):
    """The displacements of both pieces at the interface differ by the gap, which is zero under pressure."""
    folder, _ = run_case(name)
    fields = FieldReader(folder)
    data = read_netcdf(folder)
    for step in (0, fields.steps - 1):
        frame = fields.frame(step)
        lower_nodes, upper_nodes = (
            np.flatnonzero(body.place[:, 1] == 0) for body in (frame.lower, frame.upper)
        )
        np.testing.assert_allclose(
            frame.lower.place[lower_nodes], frame.upper.place[upper_nodes], atol=1e-15
        )
        np.testing.assert_allclose(
            frame.lower.place[lower_nodes], frame.interface.place, atol=1e-15
        )
        np.testing.assert_allclose(
            frame.interface.displacement, frame.lower.displacement[lower_nodes], atol=1e-15
        )
        opening = (
            frame.upper.displacement[upper_nodes, 1] - frame.lower.displacement[lower_nodes, 1]
        )
        np.testing.assert_allclose(opening, frame.interface.gap, atol=1e-12)
        np.testing.assert_allclose(opening[data.normal_stress[step] > 0], 0.0, atol=1e-12)
        np.testing.assert_allclose(
            frame.interface.normal_stress, data.normal_stress[step], rtol=1e-6
        )


@pytest.mark.parametrize("name", WITH_FIELDS)
def test_exact_every_row_of_elements_carries_the_load(run_case, name):
    """The stresses on a horizontal section through either piece balance the normal load and the
    friction force."""
    folder, _ = run_case(name)
    fields = FieldReader(folder)
    data = read_netcdf(folder)
    for step in range(0, fields.steps, 5):
        frame = fields.frame(step)
        shear = (
            float((data.weight * data.shear_stress).sum("x")[step])
            if "shear_stress" in data
            else 0.0
        )
        for body in (frame.lower, frame.upper):
            corners = body.place[np.array(body.cells)]
            width = np.ptp(corners[:, :, 0], axis=1)
            height = corners[:, :, 1].mean(axis=1)
            stress = body.stress.astype(float)
            _, row = np.unique(height.round(9), return_inverse=True)
            assert row.max() > 5
            np.testing.assert_allclose(
                np.bincount(row, -stress[:, 1] * width) * WIDTH, LOAD, rtol=2e-6
            )
            np.testing.assert_allclose(
                np.bincount(row, stress[:, 3] * width) * WIDTH, shear, atol=1e-5 * LOAD
            )


# Results of two different ways that must agree.


def test_exact_rigid_patch_agrees_with_point_contact(monkeypatch):
    """For a rigid slide under constant load, the friction of every interface point adds up to that
    of a point contact."""
    text = SMALL_PATCH + NONLOCAL + STRUCTURE + STEPS
    lumped = run(loads(text), estimate=False)
    point = run(loads(POINT + NONLOCAL + STRUCTURE + STEPS), estimate=False)
    with monkeypatch.context() as patched:
        patched.setattr(
            rig, "choose_numerics", lambda model: replace(choose_numerics(model), per_point=True)
        )
        per_point = run(loads(text), estimate=False)
    assert not any("the shape of the patch does not affect" in text for text in per_point.warnings)
    for name in (
        "relative_displacement_amplitude",
        "absolute_acceleration_peak",
        "slip_amplitude",
        "loop_area",
        "friction_force_peak",
        "equivalent_stiffness",
    ):
        assert per_point.measures[name].value == pytest.approx(
            point.measures[name].value, rel=1e-10
        )
    for name in ("slide", "force", "slip", "acceleration"):
        actual = getattr(per_point.response, name)
        expected = getattr(point.response, name)
        np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    assert any("the shape of the patch does not affect" in sentence for sentence in lumped.warnings)
    assert lumped.measures["loop_area"].value == pytest.approx(
        point.measures["loop_area"].value, rel=1e-10
    )


@pytest.mark.parametrize(
    "path", sorted(STUDIES.rglob("*.toml")), ids=lambda p: str(p.relative_to(STUDIES))
)
def test_always_shipped_scenes_load_and_plan(path):
    """Every scene of the studies can be loaded and planned."""
    scene = load(path)
    run_plan = plan(scene)
    assert run_plan.kind == scene.kind and set(run_plan.effects) <= set(EFFECTS)
    assert scene.measured is None or scene.resolve_path(scene.measured.file).is_file()


# Exit codes.


def test_refuses_too_long_run_and_unwritable_folder(write_scene, tmp_path):
    """A run with a too long bond list, or with a results folder inside a file, ends with exit code 4."""
    scene = write_scene(POINT + NONLOCAL + STRUCTURE)
    answer = run_cli(
        "run",
        scene,
        "--set",
        "friction.reading=report",
        "--set",
        "drive.cycles=10000000",
        "-o",
        tmp_path / "out",
    )
    assert answer.code == 4 and "list of bonds" in answer.err
    assert run_cli("run", write_scene(POINT + COULOMB + SLIDE), "-o", scene / "inside").code == 4


def test_exact_unconverged_run_is_written_and_marked(write_scene, tmp_path, monkeypatch):
    """A run with a step that did not converge is written with the outcome not_converged and without errors."""
    from patchfem.points.march_rows import Total
    from patchfem.points.time_march import March

    out = tmp_path / "out"
    advance = March.advance

    def advance_with_fault(self, count):  # One step is recorded as not converged.
        samples = advance(self, count)
        self.system.totals[Total.UNSOLVED] += 1
        return samples

    monkeypatch.setattr(March, "advance", advance_with_fault)
    answer = run_cli(
        "run", write_scene(SCENES["rig patch"]), "-o", out, "-q", "--set", "drive.cycles=5"
    )
    assert answer.code == 3 and "above the permitted" in answer.err
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert summary["outcome"] == "not_converged" and (out / "fields.vtkhdf").is_file()
    amplitude = summary["measures"]["relative_displacement_amplitude"]
    # The value is written, but no error is stated.
    assert amplitude["error"] is None and amplitude["value"] is not None


def test_refuses_to_replace_other_folders(write_scene, tmp_path, monkeypatch):
    """A run does not replace a folder that is not a results folder, nor one that another run is writing."""
    scene = write_scene(POINT + COULOMB + SLIDE)
    user_folder = tmp_path / "mine"
    user_folder.mkdir()
    (user_folder / "data.txt").write_text("years of work", "utf-8")
    for target in (user_folder, user_folder / "data.txt", tmp_path):
        answer = run_cli("run", scene, "-o", target)
        assert answer.code == 2 and len(answer.err.splitlines()) == 1
    assert (user_folder / "data.txt").read_text("utf-8") == "years of work"
    monkeypatch.chdir(user_folder)
    for target in (".", "..", ""):
        assert run_cli("run", scene, "-o", target).code == 2
    (tmp_path / ".next.writer").write_text("1", "utf-8")  # The number of a running process.
    locked_answer = run_cli("run", scene, "-o", tmp_path / "next")
    assert locked_answer.code == 4 and "another run" in locked_answer.err
