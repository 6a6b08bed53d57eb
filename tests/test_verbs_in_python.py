"""The commands of the command line as Python functions, and scenes given as dicts."""

import numpy as np
import pytest
from command_line import run_cli
from friction_loops import write_loop
from scene_texts import make_shaken_block

import patchfem as pf

BLOCK = {
    "title": "a block",
    "normal": {"load": "100 N"},
    "friction": {"law": "coulomb", "static": 0.3},
    "structure": {
        "moving_mass": 0.5,
        "mode": [{"name": "axial", "frequency": 100.0, "damping": 0.002, "slide": 1.0}],
    },
    "drive": {"kind": "base", "frequency": 100.0, "acceleration": "9 g", "cycles": 50},
}
TEXT = 'title = "a block"\n' + make_shaken_block('law = "coulomb"', "9 g", 50)
PLASTIC_BLOCK = make_shaken_block('law = "elastic-plastic"\nbond_length = "1 um"', "9 g", 50)
PIECES = """[contact]
length = "10 mm"
width = "10 mm"
height = "5 mm"
load = "100 N"
element_size = "2.5 mm"
substrate = "Ti-8Al-1Mo-1V"
"""


def test_exact_scene_from_dict_equals_text():
    """A scene given as a dict equals the scene of its text, in its resolved form and in its measures."""
    assert pf.load(BLOCK).resolved() == pf.load(TEXT).resolved()
    from_dict = pf.run(BLOCK, **{"normal.load": "90 N"})
    from_text = pf.run(TEXT, **{"normal.load": "90 N"})
    assert {name: m.value for name, m in from_dict.measures.items()} == {
        name: m.value for name, m in from_text.measures.items()
    }
    assert pf.sweep(BLOCK, {"normal.load": ["90 N", "100 N"]})["outcome"].size == 2


def test_exact_fit_recovers_friction_of_computed_loop(tmp_path):
    """A fit to a computed loop recovers the friction coefficient within 1e-6, with options given in any form."""
    bench = pf.new("bench")
    response = pf.run(bench).response
    cycle = np.where(np.arange(response.time.size) < response.time.size - 5, 1, 2)
    path = write_loop(tmp_path / "loop.csv", response.time, response.slide, response.force, cycle)
    static = pf.load(bench).friction.static
    free = {"friction.static": (static / 2, 2 * static)}
    options = pf.FitOptions(hold=["cycle=2"])
    fit = pf.fit(bench, path, options, free=free, out=tmp_path / "fit")
    assert fit["values"]["friction.static"]["value"] == pytest.approx(static, rel=1e-6)
    assert (tmp_path / "fit/fit.json").is_file() and fit["held"] == 5
    for arguments, keywords in (
        ((), {"to": path, "hold": "cycle=2"}),
        ((path,), {"hold": ["cycle=2"]}),
        ((path, pf.FitOptions(hold="cycle=1")), {"hold": ("cycle=2",)}),
    ):
        again = pf.fit(bench, *arguments, free=free, **keywords)
        assert again | {"seconds": 0} == fit | {"seconds": 0}
    with pytest.raises(pf.SceneError, match=r"friction\.statc"):
        pf.fit(bench, path, free={"friction.statc": (0.1, 0.2)})
    with pytest.raises(pf.PatchfemError, match="FitOptions are needed"):
        pf.fit(bench, path, {"hold": ()}, free=free)


@pytest.fixture(scope="module")
def results_folder(tmp_path_factory):
    """Return a folder with the results of a rig (`block`) and of pressed pieces with fields (`pieces`)."""
    folder = tmp_path_factory.mktemp("saved")
    pf.run(BLOCK).save(folder / "block")
    pf.run(PIECES).save(folder / "pieces")
    return folder


@pytest.mark.parametrize(
    "folder, name, given, words",
    [
        ("pieces", "a.csv", {}, []),
        ("pieces", "a.csv", {"frame": 0}, ["--frame", 0]),
        ("block", "a.csv", {}, []),
        ("block", "a.csv", {"histories": True}, ["--histories"]),
        ("block", "a.csv", {"frame": 0}, ["--frame", 0]),
        ("block", "a.uff", {"frame": 1}, ["--frame", 1]),
        ("pieces", "a.py", {"frame": 1}, ["--frame", 1]),
        ("pieces", "a.vtu", {"histories": True}, ["--histories"]),
        ("block", "a.xyz", {}, []),
    ],
)
def test_exact_export_equals_command_line(results_folder, tmp_path, folder, name, given, words):
    """`pf.export` writes the same bytes as the command line, or raises its error message."""
    answer = run_cli("export", results_folder / folder, "-o", tmp_path / f"shell_{name}", *words)
    if answer.code:
        with pytest.raises(pf.PatchfemError) as error:
            pf.export(results_folder / folder, tmp_path / name, **given)
        assert str(error.value) in answer.err.replace("shell_", "")
        return
    assert (
        pf.export(results_folder / folder, tmp_path / name, **given).read_bytes()
        == (tmp_path / f"shell_{name}").read_bytes()
    )


@pytest.mark.parametrize("amplitudes", [1e-6, "1 um", np.array([1e-6]), ["1 um"]])
def test_exact_backbone_accepts_amplitudes_in_any_form(amplitudes):
    """`pf.backbone` accepts amplitudes as a number, a text, an array or a list."""
    found = pf.backbone(PLASTIC_BLOCK, amplitudes=amplitudes, method="quasi-static")
    assert found["quasi_static_amplitude"].values == pytest.approx([1e-6], rel=1e-12)


@pytest.mark.parametrize(
    "scene, given, said",
    [
        (
            pf.new("wear"),
            {"starts": 3, "leave_out": "cycle"},
            "leave-out applies only to fits to rows of a table, not to a worn depth; leave this option out",
        ),
        (BLOCK, {"starts": 0}, "at least one"),
        (BLOCK, {"hold": "frequency=135 Hz"}, "--hold frequency=135 Hz: none of the rows"),
    ],
)
def test_refuses_unsuitable_fit_options(tmp_path, scene, given, said):
    """Options that do not apply to the kind of fit are refused before any file is read."""
    with pytest.raises(pf.PatchfemError, match=said):
        pf.fit(scene, to=write_rows(tmp_path), free={"friction.static": "0.1..0.5"}, **given)


def write_rows(folder):
    """Write a table of two measured rows and return its path."""
    path = folder / "rows.csv"
    path.write_text(
        "frequency [Hz],input [g],acceleration [g],displacement [mil],flag\n100,5,20,1,\n100,6,22,2,\n",
        "utf-8",
    )
    return path


@pytest.mark.parametrize(
    "scene, words",
    [
        (pf.new("bench"), ("fit", "--to", "none.csv", "--free", "friction.static=0.1..0.5")),
        (TEXT, ("fit", "--to", "none.csv", "--free", "friction.static=0.1..0.5")),
        (
            pf.new("wear"),
            ("fit", "--to", "none.json", "--free", "wear.coefficient=1e-16 m^2/N..1e-12 m^2/N"),
        ),
        (TEXT, ("backbone", "--mode", "none")),
    ],
    ids=["loop", "rows", "wear", "backbone"],
)
def test_refuses_folder_with_foreign_files(tmp_path, monkeypatch, scene, words):
    """An output folder with foreign files is refused before the computation, and the files stay."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "other").mkdir()
    (tmp_path / "other/notes.txt").write_text("mine", "utf-8")
    (tmp_path / "scene.toml").write_text(scene, "utf-8")
    answer = run_cli(words[0], "scene.toml", *words[1:], "-o", "other")
    assert answer.code == 2
    assert "notes.txt" in answer.err
    assert (tmp_path / "other/notes.txt").is_file()


def test_exact_with_equals_load_with_settings():
    """`Scene.with_` gives the same scene as `pf.load` with the same settings and leaves the original unchanged."""
    scene = pf.load(BLOCK)
    sets = {"normal.load": 90.0, "structure.mode.axial.damping": 0.01}
    assert scene.with_(**sets).resolved() == pf.load(BLOCK, **sets).resolved() != scene.resolved()
    again = scene.with_(**sets).with_(title="b")
    assert (again.title, again.normal.load, scene.normal.load) == ("b", 90.0, 100.0)
    with pytest.raises(pf.SceneError, match=r"drive\.file: there is no file"):
        scene.with_(**{"drive.waveform": "file", "drive.file": "none.csv"})


@pytest.mark.parametrize(
    "odd",
    [None, 3, True, object(), [], b"x", np.zeros(2), float("nan"), [None]],
    ids=["none", "number", "truth", "object", "list", "bytes", "array", "nan", "list of none"],
)
def test_refuses_arguments_of_wrong_type(odd):
    """Every public function refuses an argument of a wrong type with a PatchfemError."""
    verbs = [
        pf.load,
        pf.plan,
        pf.sweep,
        pf.backbone,
        pf.cost,
        pf.new,
        pf.profile,
        pf.report,
        pf.view,
        pf.plot.backbone,
        lambda one: pf.sweep(BLOCK, one),
        lambda one: pf.mesh(PIECES, one),
        lambda one: pf.export(one, "a.csv"),
        lambda one: pf.fit(BLOCK, to=one, free={"friction.static": (0.1, 0.2)}),
        lambda one: pf.compare(one, one),
        lambda one: pf.import_(one, "a.csv"),
        lambda one: pf.backbone(BLOCK, mode=[one]),
        lambda one: pf.plot.sweep(one, "loop_area"),
        lambda one: pf.import_("a.csv", one),
        lambda one: pf.compare("a.csv", "b.csv", shift=[one]),
        lambda one: pf.cost(BLOCK, over=[one]),
    ]
    # pf.sweep accepts None: it takes the axes of the table [sweep]
    verbs = verbs[:10] + verbs[11:] if odd is None else verbs
    for verb in verbs:
        with pytest.raises(
            pf.PatchfemError,
            match=r"needed|at least one|unknown kind|must be a dict|settings|not a|give a Dataset",
        ):
            verb(odd)
