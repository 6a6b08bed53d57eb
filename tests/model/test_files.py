"""The command `check` reads every file named by a scene and reports each fault at its line of the
scene."""

import io

import meshio
import numpy as np
import pytest
from command_line import run_cli, run_successfully
from scene_texts import BENCH, COATED, COULOMB, POINT, STRUCTURE, find_line

from patchfem import SceneError, load, run
from patchfem.mesh import make_graded_grid, write_mesh
from patchfem.scene import loads

PROFILE = COATED + '[contact.profile]\nfile = "{}"\n'
SLIDE = POINT + COULOMB + '[slide]\nkind = "file"\nfile = "{}"\n'
DRIVE = (
    STRUCTURE[: STRUCTURE.index("[drive]")]
    + '[drive]\nkind = "base"\nwaveform = "file"\nfile = "{}"\n'
)
ARRAYS = '[structure]\nfile = "{}"\n[drive]\nkind = "base"\nfrequency = "5 Hz"\nacceleration = "1 g"\ncycles = 3\n'
MEASURED = BENCH + '[measured]\nfile = "{}"\n'


def check_scene_with_file(folder, text: str, name: str, content, *options) -> tuple:
    """Return the exit code and the lines on stderr of `check` for a scene that names a file. With
    `content` None the file does not exist."""
    (folder / "scene.toml").write_text(text.format(name))
    if content is not None:
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    answer = run_cli("check", folder / "scene.toml", *options)
    return answer.code, answer.err.splitlines()


def mesh_text(name="{}") -> str:
    """Return the text of a coated patch whose mesh is read from a file."""
    head, table, remainder = COATED.replace('element_size = "0.5 mm"\n', "").partition(
        "[contact.coating]"
    )
    return f'{head}mesh = "{name}"\n{table}{remainder}'


def make_matrices(**changes) -> bytes:
    """Return a .npz file with the matrices of two masses and changed arrays."""
    content = io.BytesIO()
    matrices = {"M": np.eye(2), "K": [[3e5, -1e5], [-1e5, 1e5]], "slide": [1.0, 0.5]}
    np.savez(content, **(matrices | changes))
    return content.getvalue()


RANDOM_HEIGHTS = np.random.default_rng(20300114).normal(size=4001)
ROUGH_TRACE = "x [um],z [um]\n" + "".join(f"{k},{z:.4f}\n" for k, z in enumerate(RANDOM_HEIGHTS))
FAULTS = {
    "asperities, cut-off below the steps of the trace": (
        COATED + '[contact.asperities]\nlaw = "hertz"\ncutoff = "3 um"\nfrom = "{}"\n', "t.csv", ROUGH_TRACE,
        "contact.asperities.from", "a cut-off of 3 um is shorter than 4 steps of 1 um",
    ),
    "profile": (PROFILE, "a.csv", "0,1\n1,2\n", "contact.profile.file", "a.csv:1: the unit of x is not given"),
    "profile, short": (PROFILE, "a.csv", "x [mm],z [um]\n0,1\n2,2\n4,1\n", "contact.profile.file",
                       "the profile is 4 mm long, but the patch is 12.7 mm"),
    "profile, areal": (PROFILE, "a.csv", "x [um],y [um],z [um]\n0,0,1\n9,0,2\n0,9,3\n9,9,4\n", "contact.profile.file",
                       "an areal scan of 2 x 2 heights, but a single trace is needed"),
    "slide": (SLIDE, "p.csv", "time [s],displacement [um]\n0,0\n1,x\n", "slide.file",
              "p.csv:3: displacement: 'x' is not a finite number"),
    "drive": (DRIVE, "d.csv", "time [s],acceleration [g]\n0,0\n0,1\n", "drive.file",
              "d.csv:3: time 0 s is not later than"),
    "structure": (ARRAYS, "a.npz", b"PK\x03\x04 no archive", "structure.file", "a.npz cannot be read"),
    "structure, no stiffness": (ARRAYS, "a.npz", make_matrices(K=[]), "structure.file",
                                "a.npz: K must be square with at least one row, not of shape (1, 0)"),
    "structure, no slide": (POINT + COULOMB + ARRAYS, "a.npz", make_matrices(slide=[0.0, 0.0]), "structure.file",
                            "a.npz: `slide` of an interface is 0 in every mode"),
    "measured": (MEASURED, "m.csv", "frequency [Hz],output [g]\n1,1\n", "measured.file",
                 "not 'frequency [Hz],output [g]' (no column input)"),
    "mesh": (mesh_text(), "a.msh", "$MeshFormat\nnonsense\n", "contact.mesh", "a.msh: not a readable .msh file"),
    "mesh, lying": (mesh_text(), "a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n9999999\n1 0 0 0\n$EndNodes\n",
                    "contact.mesh", "a.msh: Nodes announces 9999999 entries"),
    "mesh, .inp": (mesh_text(), "a.inp", "*NODE\n1,0,0\n", "contact.mesh", "a.inp: no cells or nodes are tagged "
                                                                           "lower_far"),
    "mesh, .vtu": (mesh_text(), "a.vtu", "<?xml version='1.0'?>", "contact.mesh", "a.vtu: not a readable .vtu file"),
}  # fmt: skip


@pytest.mark.parametrize("text, name, content, key, message", FAULTS.values(), ids=FAULTS)
def test_refuses_faulty_file_at_its_scene_line(tmp_path, text, name, content, key, message):
    """`check` and `run` report a faulty file with the same single line, which names the line of the
    scene."""
    code, lines = check_scene_with_file(tmp_path, text, name, content)
    assert code == 2 and len(lines) == 1, lines
    number = find_line(text, f"{key.rpartition('.')[2]} = ")
    assert (
        lines[0].startswith(f"{tmp_path / 'scene.toml'}:{number}: {key}: ") and message in lines[0]
    )
    answer = run_cli("run", tmp_path / "scene.toml", "-o", tmp_path / "out")
    assert answer.code == 2 and answer.err.splitlines() == lines


def write_meshes(folder) -> None:
    """Write meshes of the pieces of COATED: one in m, one in mm."""
    write_mesh(make_graded_grid(12.7e-3, 6.35e-3, 1e-3, 152.4e-6), folder / "m.vtu")
    mesh = meshio.read(folder / "m.vtu")
    mesh.points *= 1e3
    mesh.write(folder / "mm.vtu")


MESH_FAULTS = [
    ("mm.vtu", (), 'contact.mesh: length 12.7 mm in the scene, but 12.7 m in the lower piece of the mesh: set '
                   'contact.mesh_unit = "mm"'),
    ("m.vtu", ("contact.mesh_unit=mm",), 'contact.mesh: length 12.7 mm in the scene, but 12.7 um in the lower piece of '
                                         'the mesh: set contact.mesh_unit = "m"'),
    ("mm.vtu", ("contact.mesh_unit=mm", "contact.height=6 mm"),
     "contact.height: 6 mm in the scene, but 6.35 mm in the lower piece of the mesh"),
    ("m.vtu", ("contact.mesh_unit=furlong",), "contact.mesh_unit: unknown value 'furlong'; use one of m, km, cm, mm"),
]  # fmt: skip


@pytest.mark.parametrize("name, sets, message", MESH_FAULTS)
def test_refuses_mesh_of_wrong_size_unit_or_order(tmp_path, name, sets, message):
    """`check` and `run` report a mesh of another size, or in another unit with the same line."""
    write_meshes(tmp_path)
    (tmp_path / "scene.toml").write_text(mesh_text(name), "utf-8")
    options = [f"--set={text}" for text in sets]
    answers = [
        run_cli(*command, *options)
        for command in (
            ("check", tmp_path / "scene.toml"),
            ("run", tmp_path / "scene.toml", "-o", tmp_path / "out"),
        )
    ]
    assert [answer.code for answer in answers] == [2, 2]
    assert message in answers[0].err.replace(f"{tmp_path}/", "")
    assert message in answers[1].err.replace(f"{tmp_path}/", "")
    assert [answer.err.count("\n") for answer in answers] == [1, 1]


def test_exact_mesh_in_millimetres_gives_results_of_mesh_in_metres(tmp_path):
    """A mesh in mm with `mesh_unit` gives the results of the same mesh in m; without a mesh the key is refused."""
    write_meshes(tmp_path)
    (tmp_path / "scene.toml").write_text(mesh_text("m.vtu"), "utf-8")
    scenes = [
        load(tmp_path / "scene.toml", **sets)
        for sets in ({}, {"contact.mesh": "mm.vtu", "contact.mesh_unit": "mm"})
    ]
    run_successfully(
        "check", tmp_path / "scene.toml", "--set", "contact.mesh=mm.vtu", "--set", "contact.mesh_unit=mm"
    )  # fmt: skip
    metres, millimetres = (run(scene).measures for scene in scenes)
    for name, measure in metres.items():
        assert millimetres[name].value == pytest.approx(measure.value, rel=1e-9), name
    with pytest.raises(
        SceneError, match=r"contact\.mesh_unit: is the unit of the file of contact\.mesh"
    ):
        loads(COATED, sets=["contact.mesh_unit=mm"])


def test_exact_check_and_run_report_same_profile_notes(tmp_path):
    """`check` and `run` print the same notes about a profile that is shifted and levelled.

    Neither proposes to split its smooth wave of 7 mm.
    """
    x = np.linspace(0, 13e-3, 131)
    rows = "".join(f"{1e3 * a},{1e6 * (1e-4 * a + 2e-7 * np.cos(900 * a))}\n" for a in x)
    code, lines = check_scene_with_file(tmp_path, PROFILE, "p.csv", f"x [mm],z [um]\n{rows}")
    assert (
        code == 0
        and "adds -6.5 mm to x" in lines[0]
        and "from the heights; to include a tilt" in lines[1]
    ), lines
    answer = run_cli(
        "run", tmp_path / "scene.toml", "-o", tmp_path / "out", "--no-page", "--json"
    ).content
    texts = [text for text in (*answer["notes"], *answer["warnings"]) if "p.csv" in text]
    assert lines == [f"note: {text}" for text in texts]
    assert run_cli("check", tmp_path / "scene.toml", "--json").content["notes"] == texts


def test_check_reads_spectrum_of_random_drive(tmp_path):
    """`check` names the fault of a spectrum file of a random drive. It ended with an internal fault for every such file."""
    text = DRIVE.replace('"file"', '"random"', 1) + 'duration = "2 s"\n'
    content = "frequency [Hz],density [g^2/Hz]\n10,0.01\n500,0.01\n"
    code, lines = check_scene_with_file(tmp_path, text, "spectrum.csv", content)
    assert code == 2 and "no column level" in lines[0]
