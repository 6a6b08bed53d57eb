"""[structure.reduced] of a scene: its error estimates compared with runs of the full matrices, and refusals."""

import numpy as np
import pytest
from command_line import run_cli, run_successfully
from scene_texts import find_line
from scipy import sparse
from scipy.io import mmwrite

import patchfem as pf
from patchfem.measures import ERROR_MEASURES

COUNT = 16
SCENE = """\
[structure]
output_mass = 2
[structure.reduced]
stiffness = "k.mtx"
mass = "both.npz"
damping = "both.npz"
boundary = [16, 11]
modes = 4
[[structure.interface]]
between = [1, 0]
law = "elastic-plastic"
static = 0.4
load = "50 N"
bond_length = "1 um"
[drive]
kind = "base"
frequency = "100 Hz"
acceleration = "5 g"
cycles = 4
"""
WHOLE = SCENE[: SCENE.index("[structure.reduced]")].replace(
    "output_mass = 2", 'file = "whole.npz"'
) + SCENE[SCENE.index("[[structure.interface]]") :].replace("[1, 0]", "[16, 0]")

ONCE = {"accuracy.max_seconds": 1e-3}  # a run is not repeated with smaller steps


@pytest.fixture
def matrix_folder(tmp_path):
    """Return a folder with the matrices of a chain of 16 masses that is fixed at one end."""
    k = 2e6
    m = 0.02
    K = k * (2 * np.eye(COUNT) - np.eye(COUNT, k=1) - np.eye(COUNT, k=-1))
    K[-1, -1] = k
    M = m * np.eye(COUNT)
    C = 1e-6 * K
    mmwrite(tmp_path / "k.mtx", sparse.coo_array(K), symmetry="symmetric")
    mmwrite(tmp_path / "mm.mtx", sparse.coo_array(K / 1e3), symmetry="symmetric")
    np.savez(tmp_path / "both.npz", M=M, C=C)
    np.savez(tmp_path / "milli.npz", M=M / 1e3, C=C / 1e3)
    np.savez(tmp_path / "whole.npz", M=M, K=K, C=C, output=np.eye(COUNT)[10])
    np.savez(tmp_path / "small.npz", M=M[:9, :9])
    skew = M.copy()
    skew[0, 3] = 1.0
    np.savez(tmp_path / "skew.npz", M=skew)
    np.savez(tmp_path / "minus.npz", M=-M)
    (tmp_path / "named.mtx").write_text(
        "\n".join(
            f"{i + 1},{1 + i % 2},{j + 1},{1 + j % 2},{K[i, j]:.17g}"
            for i, j in zip(*np.nonzero(K))
        )
    )
    return tmp_path


def run_scene(matrix_folder, text, **sets):
    """Write a scene into the folder, run it and return the result."""
    (matrix_folder / "scene.toml").write_text(text)
    return pf.run(matrix_folder / "scene.toml", **sets)


@pytest.mark.share(0)
@pytest.mark.parametrize("method", ["craig-bampton", "free-interface"])
def test_always_reduction_errors_cover_full_matrices(matrix_folder, method):
    """At least 95 % of the errors of a reduced chain cover the values of the full matrices.

    The drive is the motion of the base or a force.
    """
    is_covered = []
    for old, new, pushed in (
        ("", "", ""),
        ('kind = "base"', 'kind = "force"', 'acceleration = "5 g"'),
    ):
        pairs = [(SCENE, f'method = "{method}"\nmodes = 4'), (WHOLE, "")]
        found = []
        for text, put in pairs:
            mass = "mass = 1" if text is SCENE else "mass = 16"
            text = text.replace("modes = 4", put).replace(old or "\0", new)
            text = text.replace(pushed or "\0", f'force = "60 N"\n{mass}')
            found.append(run_scene(matrix_folder, text))
        reduced, full = found
        # difference of the two runs, and error estimate of the reduced run
        errors = {
            name: (abs(measure.value - full.measures[name].value), measure.error)
            for name, measure in reduced.measures.items()
            if measure.error is not None
            and full.measures.get(name) is not None
            and name not in ERROR_MEASURES
        }
        assert len(errors) > 10
        is_covered += [gap <= bar + 1e-9 * gap for gap, bar in errors.values()]
        assert errors["relative_displacement_amplitude"][0] > 0
    assert np.mean(is_covered) >= 0.95
    assert any("keeps 2 boundary coordinates and 4 " in note for note in reduced.notes)


def test_exact_reduction_with_all_modes_equals_full_matrices(matrix_folder):
    """With all modes kept, the measures agree with those of the full matrices within 1e-6."""
    reduced = run_scene(matrix_folder, SCENE, **ONCE, **{"structure.reduced.modes": 100})
    note = next(note for note in reduced.notes if "reduced keeps" in note)
    first = reduced.plan.model.rig.structure.frequencies[0]
    assert f"the first frequency of the reduced structure is {first:.5g} Hz" in note
    full = run_scene(matrix_folder, WHOLE, **ONCE)
    for name, measure in full.measures.items():
        if measure.value is not None:
            np.testing.assert_allclose(
                reduced.measures[name].value,
                measure.value,
                rtol=1e-6,
                atol=measure.floor,
                err_msg=name,
            )
    assert "reduced" not in reduced.measures["relative_displacement_amplitude"].parts


def test_exact_units_and_node_names_give_same_structure(matrix_folder):
    """Matrices in N, mm and tonne, and rows given by node and direction, give the same modes within 1e-9."""
    plain, milli, named = (
        pf.build(pf.load(write_scene(matrix_folder, text))).rig.modes
        for text in (
            SCENE,
            SCENE.replace("k.mtx", "mm.mtx")
            .replace("both", "milli")
            .replace("modes = 4", 'modes = 4\nunit = "1 mm"'),
            SCENE.replace("modes = 4", 'modes = 4\nmoved = ["1..8", "9..15:4", "10..16:4"]'),
        )
    )
    for other in (milli, named):
        np.testing.assert_allclose(other.omega, plain.omega, rtol=1e-9)
        np.testing.assert_allclose(other.zeta, plain.zeta, rtol=1e-9)
        # The sign of a mode is free.
        for name in ("slide", "base", "output"):
            products = (getattr(modes, name) * modes.slide for modes in (other, plain))
            np.testing.assert_allclose(*products, rtol=1e-8, atol=1e-12)


def write_scene(matrix_folder, text):
    """Write a scene into the folder and return its path."""
    (matrix_folder / "scene.toml").write_text(text)
    return matrix_folder / "scene.toml"


REFUSED = {
    (
        "boundary",
        "[16, 11]",
        "[16, 17]",
    ): "there is no coordinate 17: the matrices have 16, numbered from 1",
    ("boundary", "[16, 11]", "[16, 16]"): "names 16 twice; name each coordinate once",
    ("boundary", "[16, 11]", '["16:x", 2]'): "'16:x' names a node, but the files name no nodes",
    (
        "mass",
        '"both.npz"',
        '"k.mtx"',
    ): "contains the same numbers as the stiffness; give the file of the mass",
    ("stiffness", "k.mtx", "whole.mtx"): "there is no file",
    ("mass", "both.npz", "small.npz"): "the matrices differ in size: 16 x 16 and 9 x 9",
    (
        "mass",
        "both.npz",
        "skew.npz",
    ): "the mass is not symmetric: entries differ from the transpose by 1",
    (
        "mass",
        "both.npz",
        "minus.npz",
    ): "the mass matrix is not positive semidefinite: the diagonal entry of coordinate 1 is -0.02",
    ("mass", "both.npz", "named.mtx"): "name nodes and directions and others do not",
    (
        "moved",
        "modes = 4",
        'modes = 4\nmoved = ["1..60"]',
    ): "'1..60' is not a range of rows from 1 to 16",
    ("slide", "modes = 4", "modes = 4\nslide = [1, 0]"): "applies only to [friction]",
}


@pytest.mark.parametrize("key, old, new", REFUSED)
def test_refuses_invalid_reduction_keys_at_their_lines(matrix_folder, key, old, new):
    """Invalid keys of the reduction are refused with their lines."""
    assert old in SCENE
    text = SCENE.replace(old, new, 1)
    answer = run_cli("run", write_scene(matrix_folder, text), "-o", matrix_folder / "out")
    assert answer.code == 2, answer.err
    line = f"scene.toml:{find_line(text, f'{key} = ')}: structure.reduced.{key}: "
    assert line in answer.err and REFUSED[key, old, new] in answer.err, answer.err


PATCH = (
    '[contact]\nlength = "10 mm"\nwidth = "10 mm"\nheight = "5 mm"\nload = "50 N"\n'
    'substrate = "Ti-8Al-1Mo-1V"\n[contact.shear]\n'
)
OTHER = '[[structure.interface]]\nbetween = [2, 0]\nlaw = "coulomb"\nstatic = 0.4\nload = "9 N"\n[drive]'


def test_refuses_patch_beside_interfaces(matrix_folder):
    """A patch beside interfaces is refused, and the proposed scene is valid."""
    for text in (SCENE, SCENE.replace("[drive]", OTHER)):
        answer = run_cli("check", write_scene(matrix_folder, PATCH + text))
        assert answer.code == 2
        assert "move [contact] into the interface that it presses" in answer.err
        own = PATCH.replace("[contact", "[structure.interface.contact")
        for load in ('load = "50 N"\n', 'load = "9 N"\n'):
            text = text.replace(load, "")
        text = text.replace(
            "[[structure.interface]]\nbetween = [2", own + "[[structure.interface]]\nbetween = [2"
        )
        answer = run_successfully(
            "check", write_scene(matrix_folder, text.replace("[drive]", own + "[drive]"))
        )
