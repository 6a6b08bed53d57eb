"""Interfaces that slide in a plane (`lateral`): rotated directions, independent integration,
energies, refusals."""

import json

import numpy as np
import pytest
import xarray as xr
from command_line import run_cli
from plane_chains import compare_chain, draw_chain
from plane_chains import format_scene as text_of

import patchfem as pf

NODES = """\
[structure]
[structure.reduced]
stiffness = "{name}.npz"
mass = "{name}.npz"
damping = "{name}.npz"
boundary = [1, 2, 3, 4]
modes = 0
[[structure.interface]]
between = [3, 0]
{lateral}law = "elastic-plastic"
static = 0.4
stiffness = "60 kN/m"
load = "50 N"
[drive]
kind = "force"
mass = 1
force = "40 N"
frequency = "31 Hz"
cycles = 20
[accuracy]
method = "march"
steps_per_cycle = 400
"""
LATERAL = "lateral = [4, 0]\n"
ROTATION = np.pi / 6


def write_matrices(folder, name: str, angle: float, stiffness_ratio: float = 1.0) -> None:
    """Write the matrices of two nodes with x and y each; the directions of the second are rotated by `angle` [rad].

    `stiffness_ratio` is the stiffness along y over that along x.
    """
    ground = np.diag([5e4, 5e4 * stiffness_ratio])
    link = np.diag([8e4, 8e4 * stiffness_ratio])
    c = np.cos(angle)
    s = np.sin(angle)
    R = np.eye(4)
    R[2:, 2:] = [[c, s], [-s, c]]  # Directions of the second node in terms of x and y.
    K = R @ np.block([[ground + link, -link], [-link, link]]) @ R.T
    K = (K + K.T) / 2
    np.savez(folder / f"{name}.npz", K=K, M=np.eye(4), C=1e-4 * K)


def run_scene(folder, name: str, text: str):
    """Return the result of a scene that is written to a folder."""
    (folder / f"{name}.toml").write_text(text)
    return pf.run(folder / f"{name}.toml")


def test_exact_plane_motion_along_line_agrees_with_line_engine(tmp_path):
    """A motion along one direction gives the same measures with the engine of one direction and
    with that of the plane, in any rotated frame."""
    results = {}
    for name, angle, lateral in (
        ("line", 0.0, ""),
        ("plane", 0.0, LATERAL),
        ("turned", ROTATION, LATERAL),
    ):
        write_matrices(tmp_path, name, angle)
        results[name] = run_scene(tmp_path, name, NODES.format(name=name, lateral=lateral))
    line, plane, rotated = results.values()
    assert line.measures.slip_amplitude.value > 1e-4
    assert line.extra["engine"] == plane.extra["engine"] == "march"
    for name, measure in line.measures.items():
        if measure.value is not None:
            assert plane.measures[name].value == pytest.approx(
                measure.value, rel=1e-9, abs=measure.floor + 1e-15
            ), name
    for name in (
        "relative_displacement_amplitude",
        "absolute_acceleration_peak",
        "friction_force_peak",
        "slip_amplitude",
        "stick_fraction",
        "slip_start_phase",
        "loop_area",
        "friction_work",
        "energy_dissipated",
    ):
        assert rotated.measures[name].value == pytest.approx(line.measures[name].value, rel=1e-9), (
            name
        )
        assert rotated.measures[name].error == pytest.approx(
            line.measures[name].error, rel=1e-3, abs=1e-9 * line.measures[name].value
        ), name
    r = rotated.response
    np.testing.assert_allclose(
        r.extra["lateral_forces"], -np.tan(ROTATION) * r.extra["forces"], atol=1e-9 * 20
    )
    assert "defined only for one direction" in rotated.measures.equivalent_stiffness.reason


def test_always_errors_of_plane_chains_cover_independent_integration(tmp_path):
    """The errors of a random chain of three interfaces cover an independent integration of the rate equations."""
    rows = compare_chain(2, tmp_path)["rows"]
    assert len(rows) >= 7 and all(row.holds for row in rows)


def test_exact_plane_friction_closes_energy_and_stays_in_circle(tmp_path):
    """The energies of a plane interface balance, and the friction force stays within the circle of
    radius mu N."""
    spec = draw_chain(2)
    result = run_scene(tmp_path, "chain", text_of(spec))
    assert result.measures.energy_balance.value < 1e-9
    assert result.measures.energy_created.value < 1e-12
    assert result.measures.work_check.value < 1e-4
    extra, (friction_work, stored, dissipated, created) = (
        result.window.extra,
        result.window.extra["ledger"],
    )
    for k, (*_, load) in enumerate(spec["faces"]):
        assert np.hypot(
            extra["forces"][:, k], extra["lateral_forces"][:, k]
        ).max() <= 0.4 * load * (1 + 1e-9)
    np.testing.assert_allclose(friction_work, stored + dissipated - created, rtol=1e-9)
    elastic = sum(
        (extra["forces"][:, k] ** 2 + extra["lateral_forces"][:, k] ** 2) / (2 * stiffness)
        for k, (*_, stiffness, _) in enumerate(spec["faces"])
    )
    np.testing.assert_allclose(stored, elastic, rtol=1e-9)


def test_always_files_contain_both_directions(tmp_path):
    """The command run supports plane interfaces, and the files contain both directions."""
    path = tmp_path / "chain.toml"
    path.write_text(text_of(draw_chain(2)))
    run_answer = run_cli("run", path, "-o", tmp_path / "out")
    assert run_answer.code == 0, run_answer.err
    assert (
        "slip_amplitude_3"
        in json.loads((tmp_path / "out" / "summary.json").read_text())["measures"]
    )
    assert (
        "Friction force across the sliding direction"
        in (tmp_path / "out" / "report.html").read_text()
    )
    with xr.open_dataset(tmp_path / "out" / "result.nc") as data:
        force = np.hypot(data.friction_force, data.lateral_force)
        assert force.shape == data.lateral_displacement.shape and float(force.max()) > 0.5
        assert data.lateral_velocity.attrs["units"] == "m s-1"


FAULTY_PAIRS = {
    "lateral = [3, 3]": "joins mass 3 to itself",
    "lateral = [9, 0]": "there is no mass 9",
    "lateral = [1, 0]": "mass 1 is already in `between`",
    'lateral = [2, 0]\n[structure.bonded]\nstiffness = "1 N/m"': "not supported yet with [structure.bonded]",
}
LAWS = {
    '"coulomb"': "law 'elastic-plastic' with a short bond_length",
    '"tanh"': "use law 'elastic-plastic', or leave",
    '"nonlocal"': "use law 'elastic-plastic', or leave lateral out",
}
MASSES = """\
[structure]
masses = ["1 kg", "1 kg", "1 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "40 kN/m"
[[structure.interface]]
between = [1, 0]
law = "elastic-plastic"
static = 0.4
stiffness = "60 kN/m"
load = "50 N"
lateral = [2, 0]
[drive]
kind = "base"
acceleration = "5 m/s^2"
frequency = "35 Hz"
cycles = 4
"""


@pytest.mark.parametrize("keys", FAULTY_PAIRS)
def test_refuses_faulty_lateral_pairs(keys, tmp_path):
    """A lateral pair that is not a second direction of the interface is refused."""
    with pytest.raises(pf.SceneError, match=r"lateral|bonded") as error:
        run_scene(tmp_path, "bad", MASSES.replace("lateral = [2, 0]", keys))
    assert FAULTY_PAIRS[keys] in str(error.value)


@pytest.mark.parametrize("law", LAWS)
def test_refuses_laws_without_plane_form(law, tmp_path):
    """A friction law without a form in a plane is refused with an alternative."""
    keys = {'"tanh"': 'reference_speed = "1 mm/s"', '"nonlocal"': 'bond_length = "1 um"'}.get(
        law, ""
    )
    with pytest.raises(pf.SceneError) as error:
        run_scene(
            tmp_path,
            "bad",
            MASSES.replace('"elastic-plastic"', law).replace('stiffness = "60 kN/m"', keys),
        )
    assert LAWS[law] in str(error.value)


def test_refuses_plane_interface_with_patch_file_or_backbone(tmp_path):
    """Plane interfaces are refused with a patch, a structure file, a backbone and an export of friction elements."""
    patch = MASSES.replace(
        'load = "50 N"\nlateral = [2, 0]',
        "lateral = [2, 0]\n[structure.interface.contact]\n"
        'length = "10 mm"\nwidth = "10 mm"\nheight = "5 mm"\nload = "50 N"\nsubstrate = "steel"',
    )
    with pytest.raises(
        pf.SceneError, match=r"lateral: not supported yet with \[structure.interface.contact\]"
    ):
        run_scene(tmp_path, "bad", patch)
    np.savez(tmp_path / "whole.npz", M=np.eye(3), K=np.diag([4e4] * 3))
    file = '[structure]\nfile = "whole.npz"\n' + MASSES[MASSES.index("[[structure.interface]]") :]
    with pytest.raises(pf.SceneError, match=r"lateral: not supported yet with structure\.file"):
        run_scene(tmp_path, "bad", file)
    (tmp_path / "good.toml").write_text(MASSES)
    with pytest.raises(
        pf.PatchfemError, match="a backbone with interfaces that slide in a plane is not supported"
    ):
        pf.backbone(tmp_path / "good.toml")
    answer = run_cli("export", tmp_path / "good.toml", "-o", tmp_path / "rig.mat")
    assert answer.code == 2 and "cannot be written with structure.interface.lateral" in answer.err
