"""Universal files written by pyuff and read back: mode shapes with their scale."""

from dataclasses import replace

import numpy as np
import pytest
from lab_files import SI, write_universal
from scene_texts import COATED, PLASTIC

from patchfem.core import PatchfemError
from patchfem.model import build
from patchfem.scene import load, loads
from patchfem.structure import compute_receptance, masses, places, universal

FILE_RTOL = 2e-5  # dataset 55 and the frequencies of 58 have six digits
RIG = masses.build_basis(
    [1.0, 2.0, 0.5], [((1, 0), 4e5), ((2, 1), 3e5), ((3, 2), 2e5)], [], [(3, 0)], 1
)
ZETA = np.array([0.01, 0.02, 0.005])
NODES = [11, 12, 13]


# What the datasets 55 of both kinds of modes have in common
SHAPES = {"type": 55, "data_ch": 2, "spec_data_type": 8, "load_case": 1, "node_nums": NODES}


def normal_modes(modal_masses=(1.0, 4.0, 0.25), **change):
    """Return datasets 55 of the normal modes along y, each with its own scale and modal mass."""
    sets = []
    for k, modal_mass in enumerate(modal_masses):
        zeros = np.zeros(3)
        sets.append(
            SHAPES
            | {
                "analysis_type": 2,
                "mode_n": k + 1,
                "r1": zeros,
                "r2": RIG.shapes[:, k] * np.sqrt(modal_mass),
                "r3": zeros,
                "modal_m": modal_mass,
                "freq": RIG.omega[k] / 2 / np.pi,
                "modal_damp_vis": ZETA[k],
                "modal_damp_his": 0.0,
                **change,
            }
        )
    return sets


def complex_modes(scales=(1.0, 2j, 0.8 + 0.6j)):
    """Return datasets 55 of the complex modes c phi, with modal A = c^2 2i w_d."""
    sets = []
    for k, scale in enumerate(scales):
        damped_omega = RIG.omega[k] * np.sqrt(1 - ZETA[k] ** 2)
        shape = complex(scale) * RIG.shapes[:, k]
        sets.append(
            SHAPES
            | {
                "analysis_type": 3,
                "mode_n": k + 1,
                "r1": 0 * shape,
                "r2": shape + 0j,
                "r3": 0 * shape,
                "eig": complex(-ZETA[k] * RIG.omega[k], damped_omega),
                "modal_a": scale**2 * 2j * damped_omega,
                "modal_b": 0j,
            }
        )
    return sets


UNITS_MM = SI | {
    "units_code": 5,
    "units_description": "mm",
    "length": 1e3,
    "force": 1e3,
    "temp_offset": 0.0,
}


def check_modes(modes):
    """Check frequencies and shapes of the modes that were read."""
    np.testing.assert_allclose(2 * np.pi * modes.frequency, RIG.omega, rtol=FILE_RTOL)
    shapes = np.stack([modes.motion[node, 1] for node in NODES])
    expected = RIG.shapes * np.sign(RIG.shapes[0] * shapes[0])
    np.testing.assert_allclose(shapes, expected, atol=FILE_RTOL)


def test_exact_normal_modes_are_read_with_scale(tmp_path):
    """Frequencies, damping and mass-normalised shapes of normal modes are read back to six digits."""
    modes = universal.read_universal(write_universal(tmp_path / "a.uff", normal_modes()))
    check_modes(modes)
    np.testing.assert_allclose(modes.zeta, ZETA, rtol=FILE_RTOL)
    assert not modes.notes


def test_exact_complex_modes_are_made_real_with_note(tmp_path):
    """Complex modes are rotated to real shapes, with a note for each mode and for what the rotation leaves out."""
    modes = universal.read_universal(write_universal(tmp_path / "a.uff", complex_modes()))
    check_modes(modes)
    np.testing.assert_allclose(modes.zeta, ZETA, rtol=1e-4)
    assert len(modes.notes) == 3 and "mode 1 is complex" in modes.notes[0]
    sets = complex_modes()
    sets[1]["r2"] = sets[1]["r2"] * np.array([1, np.exp(0.1j), 1])
    assert (
        "leaves out" in universal.read_universal(write_universal(tmp_path / "b.uff", sets)).notes[1]
    )


def test_exact_units_of_dataset_164_are_applied(tmp_path):
    """The units of dataset 164 scale shapes, for mm and mN and for inches."""
    units = UNITS_MM
    check_modes(
        universal.read_universal(write_universal(tmp_path / "a.uff", [units, *normal_modes()]))
    )
    # mass unit lbf s^2/in = 175.1268 kg
    inches = units | {
        "length": 39.37007874,
        "force": 0.2248089431,
    }
    modes = universal.read_universal(write_universal(tmp_path / "b.uff", [inches, *normal_modes()]))
    np.testing.assert_allclose(
        np.abs(modes.motion[11, 1]), np.abs(RIG.shapes[0]) / np.sqrt(175.126835), rtol=FILE_RTOL
    )


def test_basis_from_node_directions(tmp_path):
    """The rows of the basis are those of the node directions in the scene, scaled to the moving mass."""
    shapes = universal.read_universal(write_universal(tmp_path / "a.uff", normal_modes()))
    basis = places.build_basis(
        shapes,
        2.0,
        {"slide_at": "13:+y, 11:-y", "output_at": "12:y", "base_at": "12:+y"},
        is_forced=False,
    )
    sign = np.sign(RIG.shapes[1])
    np.testing.assert_allclose(
        basis.slide, np.sqrt(2) * (RIG.shapes[2] - RIG.shapes[0]) * sign, atol=2 * FILE_RTOL
    )
    np.testing.assert_allclose(basis.output, np.sqrt(2) * RIG.shapes[1] * sign, atol=2 * FILE_RTOL)
    np.testing.assert_allclose(basis.base, basis.output, rtol=0, atol=0)
    assert np.sum(basis.base**2) == pytest.approx(1, abs=1e-4), (
        "node 12 carries 2 kg: the modes contain all of it"
    )
    forced = places.build_basis(
        shapes, 2.0, {"slide_at": "13:+y", "force_at": "11:-y"}, is_forced=True
    )
    np.testing.assert_allclose(
        forced.base * forced.slide, 2 * RIG.shapes[0] * RIG.shapes[2], atol=3 * FILE_RTOL
    )
    # the modes respond to a force as the structure itself does
    omega = np.array([300.0, 700.0])
    receptance = compute_receptance(basis, omega, basis.output, basis.slide)
    np.testing.assert_allclose(
        receptance,
        compute_receptance(
            replace(RIG, zeta=ZETA), omega, RIG.shapes[1], RIG.shapes[2] - RIG.shapes[0]
        ),
        rtol=1e-3,
    )
    assert not places.note_missing_mass(basis)
    assert (
        "contain"
        in places.note_missing_mass(
            places.build_basis(shapes, 0.5, {"slide_at": "12:+y"}, is_forced=False)
        )[0]
    )


@pytest.mark.parametrize(
    "content", [b"", b"no universal file\n", b"    -1\n    55\nbroken\n    -1\n"]
)
def test_refuses_invalid_universal_file(tmp_path, content):
    """A file that is not a universal file is refused."""
    (tmp_path / "a.uff").write_bytes(content)
    with pytest.raises(PatchfemError, match=r"cannot be read|no dataset 55"):
        universal.read_universal(tmp_path / "a.uff")


HEAVING_RIG = (
    COATED
    + PLASTIC
    + """
[structure]
file = "a.uff"
moving_mass = "0.5 kg"
slide_at = "12:+y"
normal_at = "13:+y"
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 20
"""
)


def test_exact_heave_of_modes_from_file_changes_the_load(tmp_path):
    """The motion at `normal_at` changes the load as that of listed modes does."""
    write_universal(tmp_path / "a.uff", normal_modes())
    (tmp_path / "a.toml").write_text(HEAVING_RIG)
    from_file = build(load(tmp_path / "a.toml"))
    rig = from_file.rig
    assert rig.friction.load_varies and rig.modes.normal.any()

    tables = [
        f'[[structure.mode]]\nname = "{k}"\nfrequency = "{float(rig.structure.frequencies[k])!r} Hz"\n'
        + "".join(
            f"{key} = {float(values[k])!r}\n"
            for key, values in (
                ("damping", rig.modes.zeta),
                ("slide", rig.modes.slide),
                ("base", rig.modes.base),
                ("output", rig.modes.output),
                ("normal", rig.modes.normal),
            )
        )
        for k in range(len(rig.modes.omega))
    ]
    head, _, drive = HEAVING_RIG.partition('file = "a.uff"\n')
    mass, _, drive = drive.partition('slide_at = "12:+y"\nnormal_at = "13:+y"\n')
    listed = build(loads(head + mass + "".join(tables) + drive))
    assert listed.motion == from_file.motion and listed.rig.friction.load_varies
    np.testing.assert_allclose(listed.rig.modes.normal, rig.modes.normal)
