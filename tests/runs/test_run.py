"""Scenes of every kind through the command line: exit codes, the results folder and the consistency
of its files."""

import json
import resource
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import run_successfully
from scene_texts import (
    BENCH,
    COULOMB,
    NONLOCAL,
    POINT,
    SHEAR,
    SLIDE,
    SMALL_PATCH,
    STRUCTURE,
)
from vtk_frames import read_with_vtk

from patchfem.effects import EFFECTS
from patchfem.runs.plan import plan
from patchfem.scene import load

STUDIES = Path(__file__).parents[2] / "studies"
LOAD, WIDTH = 115.653761996773, 0.0127
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
            answer = run_successfully("run", path, "-o", base / name, "--json")
            results[name] = base / name, answer
        return results[name]

    return run_once


def read_netcdf(folder):
    """Return the dataset result.nc of a results folder."""
    with xr.open_dataset(folder / "result.nc", engine="h5netcdf") as data:
        return data.load()


# Files that every run writes.


@pytest.mark.parametrize("name", WITH_FIELDS)
def test_exact_netcdf_file_has_units_and_balanced_fields(run_case, name):
    """All variables of the dataset have units, and its pressure balances the load and excludes gaps."""
    folder, answer = run_case(name)
    data = read_netcdf(folder)
    measures = answer.content["measures"]
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
    frames = read_with_vtk(folder / "fields.vtkhdf")
    data = read_netcdf(folder)
    for step in (0, len(frames) - 1):
        lower, upper, interface = (
            frames[step][1][part] for part in ("lower", "upper", "interface")
        )
        lower_nodes, upper_nodes = (np.flatnonzero(one.points[:, 1] == 0) for one in (lower, upper))
        for piece, nodes in ((lower, lower_nodes), (upper, upper_nodes)):
            np.testing.assert_allclose(piece.points[nodes], interface.points, atol=1e-15)
        below, above = lower["displacement"][lower_nodes], upper["displacement"][upper_nodes]
        np.testing.assert_allclose(interface["displacement"], below, atol=1e-15)
        opening = above[:, 1] - below[:, 1]
        np.testing.assert_allclose(opening, interface["gap"], atol=1e-12)
        np.testing.assert_allclose(opening[data.normal_stress[step] > 0], 0.0, atol=1e-12)
        np.testing.assert_allclose(interface["normal_stress"], data.normal_stress[step], rtol=1e-6)
        np.testing.assert_allclose(interface["weight"], data.weight, rtol=1e-6)


@pytest.mark.parametrize("name", WITH_FIELDS)
def test_exact_every_row_of_elements_carries_the_load(run_case, name):
    """The stresses on a horizontal section through either piece balance the normal load and the
    friction force."""
    folder, _ = run_case(name)
    frames = read_with_vtk(folder / "fields.vtkhdf")
    data = read_netcdf(folder)
    for step in range(0, len(frames), 5):
        shear = (
            float((data.weight * data.shear_stress).sum("x")[step])
            if "shear_stress" in data
            else 0.0
        )
        for body in (frames[step][1][side] for side in ("lower", "upper")):
            corners = body.points[body.cell_connectivity.reshape(-1, 4)]
            width = np.ptp(corners[:, :, 0], axis=1)
            height = corners[:, :, 1].mean(axis=1)
            stress = body["stress"].astype(float)
            _, row = np.unique(height.round(9), return_inverse=True)
            assert row.max() > 5
            np.testing.assert_allclose(
                np.bincount(row, -stress[:, 1] * width) * WIDTH, LOAD, rtol=2e-6
            )
            np.testing.assert_allclose(
                np.bincount(row, stress[:, 3] * width) * WIDTH, shear, atol=1e-5 * LOAD
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


def test_refuses_run_beyond_memory_limit_in_one_line(tmp_path):
    """A run beyond the memory limit of its process ends with exit code 4 and a message of one line."""
    (tmp_path / "a.toml").write_text(POINT + COULOMB + STRUCTURE)
    limit = 150 << 20
    process = subprocess.run(
        [sys.executable, "-m", "patchfem", "run", tmp_path / "a.toml", "-o", tmp_path / "out"],
        timeout=120,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
    )
    assert process.returncode == 4 and process.stderr.count("\n") == 1, process.stderr
    assert "GB are free; free some memory" in process.stderr or "out of memory" in process.stderr
