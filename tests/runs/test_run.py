"""Scenes of every kind through the command line: exit codes, the results folder, and what must hold inside it."""

import json
import socket
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from command_line import cli
from limits import limited
from scene_texts import BENCH, COULOMB, NONLOCAL, POINT, SHEAR, SLIDE, SMALL_PATCH, STRUCTURE
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet
from vtkmodules.vtkIOHDF import vtkHDFReader

from patchfem.core import G_N, Outcome
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
def done(tmp_path_factory):
    """name -> (results folder, answer of --json) of every scene, each run once."""
    base = tmp_path_factory.mktemp("runs")
    out = {}

    def of(name):
        if name not in out:
            path = base / f"{name}.toml"
            path.write_text(SCENES[name], "utf-8")
            answer = cli("run", path, "-o", base / name, "--json")
            assert answer.code == 0, answer.err
            out[name] = base / name, answer
        return out[name]

    return of


@pytest.fixture
def written(tmp_path):
    def write(text, name="scene.toml"):
        path = tmp_path / name
        path.write_text(text, "utf-8")
        return path

    return write


def netcdf(folder):
    with xr.open_dataset(folder / "result.nc", engine="h5netcdf") as data:
        return data.load()


class Fields:
    """fields.vtkhdf as VTK's own reader gives it: blocks of arrays."""

    def __init__(self, folder):
        self.reader = vtkHDFReader()
        self.reader.SetFileName(str(folder / "fields.vtkhdf"))
        self.reader.UpdateInformation()
        self.steps = self.reader.GetNumberOfSteps()

    def frame(self, step):
        self.reader.SetStep(step)
        self.reader.Update()
        out = self.reader.GetOutputDataObject(0)
        named = {
            out.GetMetaData(k).Get(vtkCompositeDataSet.NAME()): self._block(out.GetBlock(k))
            for k in range(out.GetNumberOfBlocks())
        }
        return SimpleNamespace(time=self.reader.GetTimeValue(), **named)

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


# what every run leaves behind


@pytest.mark.share(0, 1, 2, 3, 4, 5)
@pytest.mark.parametrize("name", SCENES)
def test_exact_summary(done, name):
    folder, answer = done(name)
    summary = json.loads((folder / "summary.json").read_text("utf-8"))
    assert json.loads(answer.out) == summary and len(answer.out.strip().splitlines()) == 1
    always = {
        "patchfem",
        "title",
        "kind",
        "outcome",
        "measures",
        "effects",
        "not_in_scene",
        "warnings",
        "notes",
        "seconds",
        "numerics",
    }
    parts = {"contact"} if "contact_fraction" in summary["measures"] else set()
    assert set(summary) == always | parts | ({"loop"} if name == "bench patch" else set())
    assert summary["kind"] == name.split()[0] and summary["outcome"] in set(Outcome)
    for one in summary["measures"].values():
        assert set(one) == {"value", "unit", "error", "floor"} | (
            {"reason"} if one["value"] is None else set()
        )
    seconds = summary["seconds"]
    assert ("contact" in seconds) == ("[contact]" in SCENES[name])
    assert 0 < seconds.get("contact", seconds["total"]) <= seconds["total"]
    named = [one["effect"] for one in summary["effects"]]
    assert all(set(one) == {"effect", "equations", "seconds"} for one in summary["effects"])
    assert named == load(folder.with_suffix(".toml")).effect_names()
    assert set(summary["not_in_scene"]) == {*EFFECTS} - set(named)
    fields = {"fields.vtkhdf"} if name in WITH_FIELDS else set()
    assert {path.name for path in folder.iterdir()} == {
        "summary.json",
        "result.nc",
        "report.html",
        "scene.resolved.toml",
    } | fields


MEASURES = {
    "patch": "normal_load contact_fraction pressure_peak pressure_centre approach rotation moment normal_stiffness "
             "tangential_stiffness contact_half_width",
    "bench": "friction_force_peak friction_ratio_end friction_ratio_peak slip_amplitude loop_area energy_balance "
             "equivalent_stiffness secant_stiffness normal_load work_check",
    "linear": "relative_displacement_amplitude absolute_acceleration_peak energy_balance drift_per_cycle "
              "acceleration_distortion",
    "rig": "relative_displacement_amplitude absolute_acceleration_peak slip_amplitude stick_fraction normal_load "
           "friction_force_peak loop_area equivalent_stiffness equivalent_damping energy_balance drift_per_cycle "
           "slip_start_phase acceleration_distortion",
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_exact_measures_of_the_kind(done, name):
    measures = json.loads(done(name)[1].out)["measures"]
    wanted = MEASURES[name.split()[0]].split() + (
        MEASURES["patch"].split() if name in WITH_FIELDS else []
    )
    assert set(wanted) <= set(measures)
    assert all(measures[key]["value"] is not None for key in wanted)
    if "energy_balance" in measures:
        assert measures["energy_balance"]["value"] <= 1e-10
    if "normal_load" in measures:
        assert measures["normal_load"]["value"] == pytest.approx(LOAD, rel=1e-10)


@pytest.mark.parametrize("name", SCENES)
def test_exact_resolved_scene_is_the_scene(done, name):
    folder, _ = done(name)
    first = load(folder.with_suffix(".toml"))
    again = load(folder / "scene.resolved.toml")
    assert again.effect_names() == first.effect_names() and again.resolved() == first.resolved()


@pytest.mark.share(0, 1, 3, 4, 5)
@pytest.mark.parametrize("name", SCENES)
def test_exact_netcdf(done, name):
    folder, answer = done(name)
    data = netcdf(folder)
    kind = name.split()[0]
    summary = json.loads(answer.out)
    assert all(
        "units" in variable.attrs
        for variable in data.variables.values()
        if variable.dtype.kind == "f"
    )
    wanted = {"relative_displacement": "m", "relative_velocity": "m s-1"} if kind != "patch" else {}
    if kind in ("bench", "rig"):
        wanted |= {"friction_force": "N", "normal_load": "N"}
    if kind in ("linear", "rig"):
        wanted |= {
            "absolute_acceleration": "m s-2",
            "base_acceleration": "m s-2",
            "modal_coordinate": "m",
        }
        assert data.modal_coordinate.dims == ("time", "mode") and list(data.mode.values) == [
            "axial"
        ]
    if name in WITH_FIELDS:
        wanted |= {"weight": "m2", "normal_stress": "Pa", "gap": "m"}
        np.testing.assert_allclose((data.weight * data.normal_stress).sum("x"), LOAD, rtol=1e-10)
        assert float(data.weight.sum()) == pytest.approx(WIDTH * 0.0127, rel=1e-12)
        assert (data.normal_stress >= 0).all()
        assert (data.gap >= 0).all()
        assert not (data.normal_stress * data.gap).any()
        centre = float((data.x * data.weight * data.normal_stress).sum("x")[0]) / LOAD
        assert centre == pytest.approx(summary["measures"]["pressure_centre"]["value"], rel=1e-9)
        assert ((data.status == 0) == (data.normal_stress == 0)).all()
    assert {key: data[key].attrs["units"] for key in wanted} == wanted
    assert kind == "patch" or ((np.diff(data.time) > 0).all() and data.time[0] == 0)
    assert data.attrs["Conventions"].startswith("CF-")
    assert data.attrs["outcome"] == summary["outcome"]
    text = json.dumps(data.attrs)
    assert str(folder.parent) not in text and socket.gethostname() not in text.replace(
        "localhost", ""
    )


@pytest.mark.parametrize("name", ["rig", "rig march", "rig patch", "linear"])
def test_exact_newton_holds_at_every_sample(done, name):
    """m (a_abs) = -k q - c v - F at each kept sample."""
    data = netcdf(done(name)[0])
    mass = 0.884
    force = data.friction_force if name != "linear" else 0.0
    wanted = (
        -(OMEGA**2) * data.relative_displacement
        - 2 * 0.003 * OMEGA * data.relative_velocity
        - force / mass
    )
    np.testing.assert_allclose(
        data.absolute_acceleration, wanted, rtol=0, atol=1e-9 * float(np.abs(wanted).max())
    )


def test_exact_shear_frames_carry_the_friction_force(done):
    data = netcdf(done("rig patch")[0])
    total = (data.weight * data.shear_stress).sum("x").values
    at = np.interp(data.frame_time.values[1:], data.time.values, data.friction_force.values)
    np.testing.assert_allclose(total[1:], at, rtol=0, atol=1e-8 * 0.3 * LOAD)
    limit = 0.3 * data.normal_stress
    assert float((np.abs(data.shear_stress) - limit).max()) <= 1e-9 * float(limit.max())


# fields


@pytest.mark.parametrize("name", WITH_FIELDS)
def test_exact_the_interface_closes_where_it_is_pressed(done, name):
    folder, _ = done(name)
    fields = Fields(folder)
    data = netcdf(folder)
    for step in (0, fields.steps - 1):
        frame = fields.frame(step)
        low, high = (np.flatnonzero(body.place[:, 1] == 0) for body in (frame.lower, frame.upper))
        np.testing.assert_allclose(frame.lower.place[low], frame.upper.place[high], atol=1e-15)
        np.testing.assert_allclose(frame.lower.place[low], frame.interface.place, atol=1e-15)
        np.testing.assert_allclose(
            frame.interface.displacement, frame.lower.displacement[low], atol=1e-15
        )
        opening = frame.upper.displacement[high, 1] - frame.lower.displacement[low, 1]
        np.testing.assert_allclose(opening, frame.interface.gap, atol=1e-12)
        np.testing.assert_allclose(opening[data.normal_stress[step] > 0], 0.0, atol=1e-12)
        np.testing.assert_allclose(
            frame.interface.normal_stress, data.normal_stress[step], rtol=1e-6
        )


@pytest.mark.parametrize("name", WITH_FIELDS)
def test_exact_every_row_of_cells_carries_the_load(done, name):
    """A horizontal cut through either body balances the load and the friction force, tension > 0."""
    folder, _ = done(name)
    fields = Fields(folder)
    data = netcdf(folder)
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


# numbers that must agree with each other


def test_exact_pressure_on_the_upper_piece_is_one_point(monkeypatch):
    """Rigid slide, constant load: the path of every interface point gives the resultant of the lumped contact."""
    text = SMALL_PATCH + NONLOCAL + STRUCTURE + STEPS
    lumped = run(loads(text), estimate=False)
    point = run(loads(POINT + NONLOCAL + STRUCTURE + STEPS), estimate=False)
    with monkeypatch.context() as changed:
        changed.setattr(
            rig, "choose_numerics", lambda model: replace(choose_numerics(model), per_point=True)
        )
        each = run(loads(text), estimate=False)
    assert not any("the shape of the patch does not affect" in text for text in each.warnings)
    for name in (
        "relative_displacement_amplitude",
        "absolute_acceleration_peak",
        "slip_amplitude",
        "loop_area",
        "friction_force_peak",
        "equivalent_stiffness",
    ):
        assert each.measures[name].value == pytest.approx(point.measures[name].value, rel=1e-10)
    for name in ("slide", "force", "slip", "acceleration"):
        mine = getattr(each.response, name)
        other = getattr(point.response, name)
        np.testing.assert_allclose(mine, other, rtol=0, atol=1e-10 * np.abs(other).max())
    assert any("the shape of the patch does not affect" in sentence for sentence in lumped.warnings)
    assert lumped.measures["loop_area"].value == pytest.approx(
        point.measures["loop_area"].value, rel=1e-10
    )


def test_exact_mesh_round_trip(written, tmp_path):
    """The patch on the mesh that was written is the patch on the mesh that was made."""
    scene = written(SMALL_PATCH)
    answer = cli("mesh", scene, "-o", tmp_path / "pair.msh")
    assert answer.code == 0 and "pair.msh" in answer.out
    made = run(load(scene), estimate=False).measures
    read = run(load(scene, ["contact.mesh=pair.msh"]), estimate=False).measures
    for key in made:
        assert read[key].value == pytest.approx(made[key].value, rel=1e-9, abs=1e-18), key
    assert (
        cli(
            "run",
            scene,
            "--set",
            "contact.mesh=pair.msh",
            "--set",
            "contact.height=7 mm",
            "-o",
            tmp_path / "out",
        ).code
        == 2
    )


@pytest.mark.parametrize(
    "path", sorted(STUDIES.rglob("*.toml")), ids=lambda p: str(p.relative_to(STUDIES))
)
def test_always_shipped_scenes_load_and_plan(path):
    scene = load(path)
    found = plan(scene)
    assert found.kind == scene.kind and set(found.effects) <= set(EFFECTS)
    assert scene.measured is None or scene.resolve_path(scene.measured.file).is_file()


def test_exact_plan_as_json(written):
    answer = cli("plan", written(SCENES["rig patch"]), "--json")
    found = json.loads(answer.out)
    assert answer.code == 0
    assert {
        "kind",
        "effects",
        "not_in_scene",
        "unknowns",
        "steps",
        "seconds",
        "bytes",
        "stiffness_chain",
        "groups",
    } <= set(found)
    assert found["groups"]["D"] == pytest.approx(0.3 * LOAD / (0.884 * 5 * G_N), rel=1e-12)
    assert found["stiffness_chain"]["bonds"] == pytest.approx(0.3 * LOAD / 1e-6, rel=1e-12)


# exit codes


def test_refuses_mistakes_with_one_line_each(written, tmp_path):
    scene = written(SMALL_PATCH.replace('"12.7 mm"', '"12,7 mm"', 1).replace("angle", "angel"))
    answer = cli("run", scene, "-o", tmp_path / "out")
    assert answer.code == 2 and answer.out == ""
    lines = answer.err.splitlines()
    assert len(lines) >= 2 and all(line.startswith(f"{scene}:") for line in lines)
    assert cli("check", scene).err == answer.err and not (tmp_path / "out").exists()


def test_refuses_resume_and_a_mesh_without_a_patch(written, tmp_path):
    scene = written(POINT + COULOMB + STRUCTURE)
    assert "only a run with [wear]" in cli("run", scene, "--resume").err
    assert cli("mesh", scene, "-o", tmp_path / "m.msh").code == 2
    exact = cli(
        "run",
        written(POINT + NONLOCAL + STRUCTURE),
        "--set",
        "accuracy.method=exact",
        "-o",
        tmp_path / "o",
    )
    assert exact.code == 2 and "no exact solution" in exact.err


def test_refuses_what_takes_too_long_or_cannot_be_written(written, tmp_path):
    scene = written(POINT + NONLOCAL + STRUCTURE)
    costly = cli(
        "run",
        scene,
        "--set",
        "friction.reading=report",
        "--set",
        "drive.cycles=10000000",
        "-o",
        tmp_path / "out",
    )
    assert costly.code == 4 and "list of bonds" in costly.err
    assert cli("run", written(POINT + COULOMB + SLIDE), "-o", scene / "inside").code == 4


def test_exact_an_old_folder_survives_a_failing_run(written, tmp_path):
    scene = written(SCENES["rig patch"])
    out = tmp_path / "out"

    def state():
        return {path.name: path.read_bytes() for path in out.iterdir()}

    assert cli("run", scene, "-o", out, "-q", "--set", "drive.cycles=5").code == 0
    before = state()
    with limited(1000):  # room for no file of results
        full_disk = cli("run", scene, "-o", out, "-q", "--set", "drive.cycles=5")
    assert full_disk.code == 4 and state() == before
    assert cli("run", scene, "-o", out, "-q", "--set", "drive.cycles=6").code == 0
    assert state()["summary.json"] != before["summary.json"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "scene.toml"]


def test_exact_a_run_that_misses_its_residual_is_kept_and_marked(written, tmp_path, monkeypatch):
    from patchfem.dynamics.march import march as marching

    out = tmp_path / "out"
    steps = marching.Run._march_steps

    def missing(self, count, rows):  # the loop books one step that missed
        done = steps(self, count, rows)
        self.ledger[7] += 1
        return done

    monkeypatch.setattr(marching.Run, "_march_steps", missing)
    failed = cli("run", written(SCENES["rig patch"]), "-o", out, "-q", "--set", "drive.cycles=5")
    assert failed.code == 3 and "above the permitted" in failed.err
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert summary["outcome"] == "not_converged" and (out / "fields.vtkhdf").is_file()
    motion = summary["measures"]["relative_displacement_amplitude"]
    # kept, but no error is claimed for it
    assert motion["error"] is None and motion["value"] is not None


def test_refuses_to_replace_what_is_not_a_results_folder(written, tmp_path, monkeypatch):
    scene = written(POINT + COULOMB + SLIDE)
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "data.txt").write_text("years of work", "utf-8")
    for target in (mine, mine / "data.txt", tmp_path):
        refused = cli("run", scene, "-o", target)
        assert refused.code == 2 and len(refused.err.splitlines()) == 1
    assert (mine / "data.txt").read_text("utf-8") == "years of work"
    monkeypatch.chdir(mine)
    for target in (".", "..", ""):
        assert cli("run", scene, "-o", target).code == 2
    (tmp_path / ".next.writer").write_text("1", "utf-8")  # a process that lives
    busy = cli("run", scene, "-o", tmp_path / "next")
    assert busy.code == 4 and "another run" in busy.err
