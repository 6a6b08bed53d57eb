"""Exports of the structure of a scene: read again they give the same rig, and their elements the same friction."""

import numpy as np
import pytest
from command_line import run_cli, run_successfully
from scene_texts import DRIVE, PAIR, PLASTIC, POINT, STRUCTURE, make_friction_table
from scipy.io import loadmat

import patchfem as pf
from patchfem import build

CUBIC = '[structure.stiffening]\ncubic = "1e12 N/m^3"\n'
WAVE = 'amplitude = "3 N"\nfrequency = "70 Hz"\n'
FRICTION_RIG = POINT + PLASTIC + STRUCTURE


def export_structure(folder, text: str):
    """Return the model of a scene and the path of its export."""
    (folder / "rig.toml").write_text(text)
    answer = run_successfully("export", folder / "rig.toml", "-o", folder / "rig.mat")
    assert "friction element" in answer.out
    return build(pf.load(folder / "rig.toml")), folder / "rig.mat"


@pytest.mark.parametrize(
    "text",
    [
        FRICTION_RIG,
        FRICTION_RIG.replace('kind = "base"', 'kind = "force"').replace(
            'acceleration = "5 g"', 'force = "40 N"'
        ),
    ],
    ids=["base", "force"],
)
def test_exact_exported_structure_gives_same_rig(tmp_path, text):
    """An exported structure, read by structure.file, gives the same modes and drive within 1e-12.

    Its run has the same measures within 1e-9.
    """
    model, path = export_structure(tmp_path, text)
    start, rest_of_scene = text.split("[structure]")
    scene_text = (
        start + f'[structure]\nfile = "{path.name}"\n[drive]' + rest_of_scene.split("[drive]")[1]
    )
    (tmp_path / "again.toml").write_text(scene_text)
    modes = model.rig.modes
    read_modes = build(pf.load(tmp_path / "again.toml")).rig.modes
    scale = np.sqrt(modes.mass)  # modes of a file have a mass of 1 kg
    for name, factor in (
        ("omega", 1.0),
        ("zeta", 1.0),
        ("slide", 1 / scale),
        ("output", 1 / scale),
    ):
        np.testing.assert_allclose(
            getattr(read_modes, name), factor * getattr(modes, name), rtol=1e-12, err_msg=name
        )
    drive_factor = scale if '"base"' in text else 1 / scale
    np.testing.assert_allclose(read_modes.base, drive_factor * modes.base, rtol=1e-12)
    before, after = (pf.run(tmp_path / f"{name}.toml") for name in ("rig", "again"))
    for name in ("relative_displacement_amplitude", "loop_area"):
        np.testing.assert_allclose(
            after.measures[name].value, before.measures[name].value, rtol=1e-9
        )


def element_force(stiffness, limit, slide):
    """Return the force (k,) of parallel Jenkins elements along a slide (k,), from a force-free start."""
    stretch = np.zeros(len(limit))
    forces = []
    previous = 0.0
    for x in slide:
        stretch = np.clip(stretch + stiffness * (x - previous), -limit, limit)
        forces.append(stretch.sum())
        previous = x
    return np.array(forces)


@pytest.mark.parametrize(("law", "tolerance"), [("elastic-plastic", 1e-9), ("iwan", 2e-6)])
def test_exact_exported_elements_agree_with_bench(tmp_path, law, tolerance):
    """Under a triangular slide the force of the exported elements agrees with the bench of the law, relative to its limit.

    The bench has the density of Iwan's law, which the elements replace with an error of 1e-6 on first loading and of 2e-6
    after a reversal (MATRICES.md).
    """
    _, path = export_structure(tmp_path, POINT + make_friction_table(law) + STRUCTURE)
    exported = loadmat(path)
    exported |= {name: exported[name].ravel() for name in ("stiffness", "limit")}
    text = (
        POINT
        + make_friction_table(law)
        + '[slide]\nkind = "triangle"\namplitude = "8 um"\nspeed = "1 mm/s"\ncycles = 2\n'
    )
    loop = pf.run(text)
    response = loop.response
    force = element_force(
        exported["stiffness"], exported["limit"], response.slide - response.slide[0]
    )
    np.testing.assert_allclose(force, response.force, atol=tolerance * exported["limit"].sum())
    np.testing.assert_allclose(exported["limit"].sum(), 0.3 * 26 * 4.4482216152605, rtol=1e-6)
    assert exported["direction"].shape == (exported["limit"].size, 1)


def test_exact_matrices_and_elements_of_several_interfaces(tmp_path):
    """The linear response of the matrices agrees with that of the modes within 1e-9; each interface has its element."""
    model, path = export_structure(tmp_path, PAIR + DRIVE)
    exported = loadmat(path)
    modes = model.rig.modes
    drive = model.rig.drive.signal
    omega = drive.omega
    dynamic_stiffness = exported["K"] + 1j * omega * exported["C"] - omega**2 * exported["M"]
    response = exported["output"].T @ np.linalg.solve(dynamic_stiffness, exported["Fex1"])
    modal_response = np.linalg.solve(
        np.diag(modes.omega**2 - omega**2) + 1j * omega * modes.damping_matrix, modes.base
    )
    np.testing.assert_allclose(
        response.item(), -drive.acceleration * (modes.output @ modal_response), rtol=1e-9
    )
    np.testing.assert_allclose(exported["direction"], modes.interfaces, rtol=1e-12)
    laws = [
        (one.numbers.static * one.load, one.numbers.bond_length)
        for one in model.rig.friction.interfaces
    ]
    np.testing.assert_allclose(exported["limit"].ravel(), [limit for limit, _ in laws], rtol=1e-12)
    stiffness = [limit / length for limit, length in laws]
    np.testing.assert_allclose(exported["stiffness"].ravel(), stiffness, rtol=1e-12)


@pytest.mark.parametrize(
    "text, ending, message",
    [
        (POINT + make_friction_table("coulomb") + STRUCTURE, ".mat", "law 'coulomb'"),
        (
            POINT + make_friction_table("bouc-wen") + STRUCTURE,
            ".mat",
            "law 'bouc-wen' cannot be written as friction elements",
        ),
        (
            POINT + make_friction_table("tanh") + STRUCTURE,
            ".mat",
            "law 'tanh' cannot be written as friction elements",
        ),
        (
            FRICTION_RIG.replace("[drive]", CUBIC + "[drive]"),
            ".mat",
            "cannot be written with [structure.stiffening]",
        ),
        (
            POINT + WAVE + PLASTIC + STRUCTURE,
            ".mat",
            "cannot be written with normal.amplitude; remove this feature",
        ),
        (
            POINT
            + '[normal.grooves]\nwavelength = "80 um"\namplitude = "1 um"\n'
            + PLASTIC
            + STRUCTURE,
            ".mat",
            "cannot be written with [normal.grooves]",
        ),
        (FRICTION_RIG, ".csv", "a structure is exported as .mat"),
        (
            POINT + PLASTIC + '[slide]\nkind = "triangle"\namplitude = "8 um"\nspeed = "1 mm/s"\n',
            ".mat",
            "this scene has none",
        ),
    ],
)
def test_refuses_structure_without_exportable_form(tmp_path, text, ending, message):
    """Friction laws, loads and structures that friction elements cannot represent are refused, and no file is written."""
    (tmp_path / "rig.toml").write_text(text)
    answer = run_cli("export", tmp_path / "rig.toml", "-o", tmp_path / f"rig{ending}")
    assert (
        answer.code == 2 and message in answer.err and not (tmp_path / f"rig{ending}").exists()
    ), answer.err
