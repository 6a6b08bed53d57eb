"""The structure of a scene written for other programs: read back it is the rig, its elements give its friction."""

from pathlib import Path

import numpy as np
import pytest
from command_line import cli
from scene_texts import DRIVE, PAIR, PLASTIC, POINT, STRUCTURE, friction_of
from scipy.io import loadmat

import patchfem as pf
from patchfem import build

CUBIC = '[structure.stiffening]\ncubic = "1e12 N/m^3"\n'
WAVE = 'amplitude = "3 N"\nfrequency = "70 Hz"\n'
RUB = POINT + PLASTIC + STRUCTURE


def written(folder, text: str, ending: str):
    """(Model, path of the export) of a scene."""
    (folder / "rig.toml").write_text(text)
    answer = cli("export", folder / "rig.toml", "-o", folder / f"rig{ending}")
    assert answer.code == 0 and "friction element" in answer.out, answer.err
    return build(pf.load(folder / "rig.toml")), folder / f"rig{ending}"


@pytest.mark.parametrize("ending", [".mat", ".npz"])
@pytest.mark.parametrize(
    "text",
    [
        RUB,
        RUB.replace('kind = "base"', 'kind = "force"').replace(
            'acceleration = "5 g"', 'force = "40 N"'
        ),
    ],
    ids=["base", "force"],
)
def test_exact_an_exported_structure_is_read_back_as_the_same_rig(tmp_path, text, ending):
    """By structure.file, to 1e-12: frequency, damping, share of the drive, slide and output; and it runs alike."""
    model, path = written(tmp_path, text, ending)
    head, tail = text.split("[structure]")
    again = head + f'[structure]\nfile = "{path.name}"\n[drive]' + tail.split("[drive]")[1]
    (tmp_path / "again.toml").write_text(again)
    one = model.rig.modes
    two = build(pf.load(tmp_path / "again.toml")).rig.modes
    scale = np.sqrt(one.mass)  # modes of a file have 1 kg
    for name, factor in (
        ("omega", 1.0),
        ("zeta", 1.0),
        ("slide", 1 / scale),
        ("output", 1 / scale),
    ):
        np.testing.assert_allclose(
            getattr(two, name), factor * getattr(one, name), rtol=1e-12, err_msg=name
        )
    share = scale if '"base"' in text else 1 / scale
    np.testing.assert_allclose(two.base, share * one.base, rtol=1e-12)
    before, after = (pf.run(tmp_path / f"{name}.toml") for name in ("rig", "again"))
    for name in ("relative_displacement_amplitude", "loop_area"):
        np.testing.assert_allclose(
            after.measures[name].value, before.measures[name].value, rtol=1e-9
        )


def loop_of(stiffness, limit, slide):
    """Force (k,) of parallel elements that stretch and slip along a slide (k,), from a rest without force."""
    stretch = np.zeros(len(limit))
    out = []
    last = 0.0
    for x in slide:
        stretch = np.clip(stretch + stiffness * (x - last), -limit, limit)
        out.append(stretch.sum())
        last = x
    return np.array(out)


@pytest.mark.parametrize("law", ["elastic-plastic", "iwan"])
def test_exact_exported_elements_give_the_friction_of_a_bench(tmp_path, law):
    """A triangle over the elements, element by element, against the bench of the same law and load."""
    _, path = written(tmp_path, POINT + friction_of(law) + STRUCTURE, ".npz")
    with np.load(path) as file:
        found = {name: file[name] for name in file.files}
    text = (
        POINT
        + friction_of(law)
        + '[slide]\nkind = "triangle"\namplitude = "8 um"\nspeed = "1 mm/s"\ncycles = 2\n'
    )
    loop = pf.run(text)
    response = loop.response
    force = loop_of(found["stiffness"], found["limit"], response.slide - response.slide[0])
    np.testing.assert_allclose(force, response.force, atol=2e-3 * found["limit"].sum())
    np.testing.assert_allclose(found["limit"].sum(), 0.3 * 26 * 4.4482216152605, rtol=1e-6)
    assert found["direction"].shape == (found["limit"].size, 1) and found["form"] == "elements"


def test_exact_matlab_has_the_structures_of_nlvib(tmp_path):
    """A cell array of structures with type, direction and numbers, a D and an Fex1 of the drive; several interfaces."""
    model, path = written(tmp_path, PAIR + DRIVE, ".mat")
    found = loadmat(path)
    modes = model.rig.modes
    drive = model.rig.drive.signal
    omega = drive.omega
    stiff = found["K"] + 1j * omega * found["D"] - omega**2 * found["M"]
    moved = found["T_out"] @ np.linalg.solve(stiff, found["Fex1"])
    own = np.linalg.solve(
        np.diag(modes.omega**2 - omega**2) + 1j * omega * modes.damping_matrix, modes.base
    )
    np.testing.assert_allclose(moved.item(), -drive.acceleration * (modes.output @ own), rtol=1e-9)
    assert found["D"].shape == found["M"].shape and found["T_out"].shape == (1, 2)
    cells = found["nonlinear_elements"].ravel()
    assert len(cells) == 2 and {str(cell["type"][0, 0][0]) for cell in cells} == {
        "elasticDryFriction"
    }
    for cell, law, row in zip(
        cells, model.rig.friction.interfaces, np.eye(2)
    ):  # the slides come first
        assert float(cell["ishysteretic"][0, 0].item()) == 1 and cell["force_direction"][
            0, 0
        ].shape == (2, 1)
        np.testing.assert_allclose(cell["force_direction"][0, 0].ravel(), row, atol=1e-12)
        np.testing.assert_allclose(
            cell["friction_limit_force"][0, 0].item(), law.numbers.static * law.load, rtol=1e-12
        )
        np.testing.assert_allclose(
            cell["stiffness"][0, 0].item(),
            law.numbers.static * law.load / law.numbers.bond_length,
            rtol=1e-12,
        )


FORCED = RUB.replace('kind = "base"', 'kind = "force"').replace(
    'acceleration = "5 g"', 'force = "40 N"'
)


def test_exact_the_guide_names_every_variable_of_both_files(tmp_path):
    """Its table against files of a base, a force and tanh: the variables, their sizes, and the fields of an element."""
    page = (Path(pf.__file__).parent / "scene/MATRICES.md").read_text("utf-8")
    rows = {
        row[1].strip("` "): [cell.strip("` ") for cell in row[2:-1]]
        for row in (line.split("|") for line in page.splitlines() if line.startswith("| `"))
    }
    found = {".mat": {}, ".npz": {}}
    for text in (RUB, FORCED, POINT + friction_of("tanh") + STRUCTURE):
        for ending, one in found.items():
            path = written(tmp_path, text, ending)[1]
            values = loadmat(path) if ending == ".mat" else dict(np.load(path))
            one |= {
                name: value.shape for name, value in values.items() if not name.startswith("__")
            }
    for ending, one in found.items():
        assert set(one) == {name for name, row in rows.items() if row[0] in ("both", ending)}, (
            ending
        )
        for name, shape in one.items():
            size = rows[name][1]
            assert len(shape) == (
                2 if ending == ".mat" else 0 if size in ("1", "text") else 1 + size.count("×")
            ), name
    cell = loadmat(tmp_path / "rig.mat")["nonlinear_elements"].ravel()[0].dtype.names
    assert all(f"`{field}`" in page for field in (*cell, "stiffness"))


def test_exact_tanh_has_its_speed(tmp_path):
    _, path = written(tmp_path, POINT + friction_of("tanh") + STRUCTURE, ".mat")
    cell = loadmat(path)["nonlinear_elements"].ravel()[0]
    assert str(cell["type"][0, 0][0]) == "tanhDryFriction" and cell["eps"][0, 0].item() == 1e-3


def test_exact_a_release_has_no_excitation(tmp_path):
    text = RUB.split("[drive]")[0] + '[drive]\nkind = "free"\ndisplacement = "20 um"\ncycles = 5\n'
    with np.load(written(tmp_path, text, ".npz")[1]) as found:
        assert not found["Fex1"].any() and not {"force", "base", "Omega"} & set(found.files)


HEAD = RUB.split("[drive]")[0]
LEVELS = '[drive]\nkind = "base"\nwaveform = "levels"\nfrequency = "100 Hz"\nlevels = ["1 g", "2 g"]\ncycles = 5\n'


@pytest.mark.parametrize(
    "text, says",
    [
        (
            RUB,
            "1 coordinate, 1 friction element; in these coordinates x the output is output·x, Fex1 is the force on each "
            "of them, the slide of interface i is row i of slide·x\n",
        ),
        (
            RUB + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n',
            "; not in the file: [wear]\n",
        ),
        (
            RUB.replace("[structure]", '[structure]\ntravel = "5 mm"'),
            "; not in the file: structure.travel\n",
        ),
        (
            RUB.replace("[drive]", '[structure.start]\ndisplacement = ["5 um"]\n[drive]'),
            "; not in the file: the initial motion\n",
        ),
        (
            HEAD + LEVELS,
            "; Fex1 is the excitation for an amplitude of 1 m/s^2, not for waveform = 'levels'\n",
        ),
    ],
)
def test_always_the_line_says_what_the_file_has_not(tmp_path, text, says):
    (tmp_path / "rig.toml").write_text(text)
    answer = cli("export", tmp_path / "rig.toml", "-o", tmp_path / "rig.npz")
    assert answer.code == 0 and answer.out.endswith(says), answer.out
    with np.load(tmp_path / "rig.npz") as found:
        assert found["Omega"] == pytest.approx(
            2 * np.pi * (100 if LEVELS in text else 143), rel=1e-12
        )


@pytest.mark.parametrize(
    "text, ending, says",
    [
        (POINT + friction_of("coulomb") + STRUCTURE, ".mat", "law 'coulomb'"),
        (
            POINT + friction_of("bouc-wen") + STRUCTURE,
            ".npz",
            "law 'bouc-wen' cannot be written as friction elements",
        ),
        (
            POINT + friction_of("tanh") + STRUCTURE.replace("[drive]", CUBIC + "[drive]"),
            ".mat",
            "cannot be written with [structure.stiffening]",
        ),
        (
            STRUCTURE.replace("[drive]", CUBIC + "[drive]"),
            ".npz",
            "cannot be written with [structure.stiffening]",
        ),
        (
            POINT + WAVE + friction_of("tanh") + STRUCTURE,
            ".npz",
            "cannot be written under a load that changes",
        ),
        (
            POINT + WAVE + PLASTIC + STRUCTURE,
            ".npz",
            "cannot be written under a load that changes; remove this feature",
        ),
        (
            POINT
            + '[normal.grooves]\nwavelength = "80 um"\namplitude = "1 um"\n'
            + friction_of("tanh")
            + STRUCTURE,
            ".npz",
            "cannot be written with [normal.grooves]",
        ),
        (RUB, ".csv", "a structure is exported as .mat or .npz"),
        (
            POINT + PLASTIC + '[slide]\nkind = "triangle"\namplitude = "8 um"\nspeed = "1 mm/s"\n',
            ".mat",
            "this scene has none",
        ),
    ],
)
def test_refuses_what_has_no_such_form(tmp_path, text, ending, says):
    (tmp_path / "rig.toml").write_text(text)
    answer = cli("export", tmp_path / "rig.toml", "-o", tmp_path / f"rig{ending}")
    assert answer.code == 2 and says in answer.err and not (tmp_path / f"rig{ending}").exists(), (
        answer.err
    )
