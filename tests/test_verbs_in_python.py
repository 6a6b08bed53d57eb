"""The commands of the command line as Python functions, and scenes given as dicts."""

import numpy as np
import pytest
from command_line import run_cli
from scene_texts import BENCH, make_shaken_block

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


def test_exact_result_table_lists_measures():
    """`Result.table` lists all measures with their values."""
    result = pf.run(BLOCK)
    found = result.table()
    rows = found if isinstance(found, list) else found.reset_index().to_dict("records")
    assert [one["measure"] for one in rows] == list(result.measures)
    assert rows[0]["value"] == result.measures[rows[0]["measure"]].value


def test_exact_fit_recovers_friction_of_computed_loop(tmp_path):
    """A fit to a computed loop recovers the friction coefficient within 1e-6, with options given in any form."""
    bench = pf.new("bench")
    run = pf.run(bench)
    loop = np.column_stack([run.response.time, run.response.slide * 1e6, run.response.force])
    path = tmp_path / "loop.csv"
    path.write_text(
        "time [s],displacement [um],force [N]\n"
        + "".join(",".join(map(repr, row)) + "\n" for row in loop.tolist()),
        "utf-8",
    )
    static = pf.load(bench).friction.static
    free = {"friction.static": (static / 2, 2 * static)}
    options = pf.FitOptions(offset=["force"])
    fit = pf.fit(bench, path, options, free=free, out=tmp_path / "fit")
    assert fit["values"]["friction.static"]["value"] == pytest.approx(static, rel=1e-6)
    assert (tmp_path / "fit" / "fit.json").is_file() and set(fit["offsets"]) == {"force"}
    for arguments, keywords in (
        ((), {"to": path, "offset": "force"}),
        ((path,), {"offset": ["force"]}),
        ((path, pf.FitOptions(hold="cycle=1")), {"offset": ("force",), "hold": ()}),
    ):
        again = pf.fit(bench, *arguments, free=free, **keywords)
        assert again | {"seconds": 0} == fit | {"seconds": 0}
    with pytest.raises(pf.SceneError, match=r"friction\.statc"):
        pf.fit(bench, path, free={"friction.statc": (0.1, 0.2)})
    with pytest.raises(pf.PatchfemError, match="FitOptions are needed"):
        pf.fit(bench, path, {"hold": ()}, free=free)


def test_exact_functions_are_not_hidden_by_subpackages(tmp_path):
    """`pf.mesh` and `pf.export` stay functions after the subpackages of the same names are imported."""
    for _ in range(2):
        assert pf.mesh(PIECES, tmp_path / "pieces.vtu").is_file()
        import patchfem.export.folder
        import patchfem.mesh.files  # noqa: F401
    with pytest.raises(pf.PatchfemError, match="only a scene with"):
        pf.mesh(TEXT, tmp_path / "none.vtu")
    pf.run(BLOCK).save(tmp_path / "block")
    assert (
        pf.export(tmp_path / "block", tmp_path / "histories.csv")
        .read_text("utf-8")
        .startswith("time")
    )


@pytest.fixture(scope="module")
def results_folder(tmp_path_factory):
    """Return a folder with the results of a rig (`block`) and of pressed pieces with fields (`pieces`)."""
    folder = tmp_path_factory.mktemp("saved")
    pf.run(BLOCK).save(folder / "block")
    pf.run(PIECES).save(folder / "pieces")
    return folder


def test_exact_report_shows_several_results(results_folder, tmp_path):
    """A report of two results folders shows both side by side, and a report of one equals that of a list of one."""
    one = results_folder / "block"
    page = pf.report([one, results_folder / "pieces"], tmp_path / "both.html")
    assert page == tmp_path / "both.html"
    assert all(f">{name}<" in page.read_text("utf-8") for name in ("block", "pieces"))
    alone = pf.report(one, tmp_path / "one.html").read_text("utf-8")
    assert alone == pf.report([str(one)], out=tmp_path / "other.html").read_text("utf-8")
    assert ">pieces<" not in alone
    with pytest.raises(pf.PatchfemError, match="at least one results folder"):
        pf.report([])


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
    "amplitudes, said",
    [
        ([1e-6, np.nan, 1e-3], "amplitudes: 'nan m'"),
        ("1 um..x", "amplitudes: "),
        ([0.0, 1e-6], "above 0"),
        ([], "amplitudes"),
        (object(), "cannot be a value of a scene"),
        ("1 um..9 um", "number of values"),
    ],
)
def test_refuses_invalid_amplitudes(amplitudes, said):
    """Amplitudes that are not positive lengths are refused."""
    with pytest.raises(pf.PatchfemError, match=said):
        pf.backbone(PLASTIC_BLOCK, amplitudes=amplitudes, method="quasi-static")


@pytest.mark.parametrize(
    "free, said",
    [
        ({"friction.static": 0.3}, r"\(low, high\) .* not 0\.3"),
        ({"friction.static": (0.1, 0.2, 0.5)}, r"\(low, high\)"),
        ({"friction.static": None}, r"\(low, high\) .* not None"),
        (["friction.static=0.1..0.5"], "must be a dict"),
        ({}, "at least one"),
        ({"friction.static": "0.5..0.1"}, "must lie below"),
    ],
)
def test_refuses_free_keys_without_range(tmp_path, free, said):
    """A free key of a fit without a lower and an upper limit is refused."""
    with pytest.raises(pf.PatchfemError, match=said):
        pf.fit(BLOCK, to=write_rows(tmp_path), free=free)


@pytest.mark.parametrize(
    "scene, given, said",
    [
        (
            BLOCK,
            {"offset": ["force"], "warm_up": True},
            "offset applies only to fits to a loop under a prescribed slide; warm_up applies only",
        ),
        (pf.new("bench"), {"starts": 3}, "starts applies only to fits to rows of a rig"),
        (
            pf.new("bench"),
            {"leave_out": "frequency"},
            "leave_out applies only to fits to rows of a rig",
        ),
        (pf.new("wear"), {"hold": "frequency=1 Hz"}, "hold applies only to fits to a loop"),
        (BLOCK, {"starts": 0}, "at least one"),
        (BLOCK, {"seed": -1}, ">= 0"),
        (BLOCK, {"unstable": "maybe"}, "bound, out, read"),
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
    (tmp_path / "other" / "notes.txt").write_text("mine", "utf-8")
    (tmp_path / "scene.toml").write_text(scene, "utf-8")
    answer = run_cli(words[0], "scene.toml", *words[1:], "-o", "other")
    assert answer.code == 2
    assert "notes.txt" in answer.err
    assert (tmp_path / "other" / "notes.txt").is_file()


def test_exact_profile_accepts_cutoff_in_any_form(tmp_path):
    """`pf.profile` accepts a cutoff as a number or a text, and refuses an invalid one."""
    path = tmp_path / "trace.csv"
    path.write_text("x [um],z [um]\n" + "".join(f"{k},{k % 7}\n" for k in range(2000)), "utf-8")
    roughness = [
        pf.profile(path, **options)["profiles"][0]["measures"]["Ra"]
        for options in (
            {"cutoff": "0.25 mm"},
            {"cutoff": np.float64(2.5e-4)},
            {"cutoff": 0.25e-3, "window": "0 um,1999 um"},
        )
    ]
    assert roughness[1:] == roughness[:1] * 2
    for wrong in (0.0, float("nan"), "0.25", object()):
        with pytest.raises(pf.PatchfemError, match="profile: cutoff"):
            pf.profile(path, cutoff=wrong)


@pytest.mark.parametrize(
    "given, said",
    [
        (
            {"slide.amplitude": 2.0},
            r"slide\.amplitude: 2 without a unit means 2 m, which is longer than the patch \(0\.04",
        ),
        (
            {"contact": {"crown": {"radius": 3.0}}, "contact.length": 12.7},
            r"contact\.length: 12\.7 .* any joint",
        ),
    ],
)
def test_refuses_implausible_length_without_unit(given, said):
    """A number without a unit that would be an implausible length in metres is refused, and accepted with its unit."""
    scene = pf.load(pf.new("joint"))
    other = {key: f"{value!r} m" for key, value in given.items() if key != "contact"}
    for load in (lambda sets: scene.with_(**sets), lambda sets: pf.load(pf.new("joint"), **sets)):
        with pytest.raises(pf.SceneError, match=said):
            load({key: value for key, value in given.items() if key != "contact"})
        assert load(other).kind == "bench"  # a length with its unit is accepted
    assert scene.with_(**{"contact.crown.radius": 3.0}).contact.crown.radius == 3.0


def test_exact_with_equals_load_with_settings():
    """`Scene.with_` gives the same scene as `pf.load` with the same settings and leaves the original unchanged."""
    scene = pf.load(BLOCK)
    sets = {"normal.load": 90.0, "structure.mode.axial.damping": 0.01}
    assert scene.with_(**sets).resolved() == pf.load(BLOCK, **sets).resolved() != scene.resolved()
    again = scene.with_(**sets).with_(title="b")
    assert (again.title, again.normal.load, scene.normal.load) == ("b", 90.0, 100.0)
    with pytest.raises(pf.SceneError, match=r"drive\.file: there is no file"):
        scene.with_(**{"drive.waveform": "file", "drive.file": "none.csv"})


def test_exact_import_equals_command_line(tmp_path):
    """`pf.import_` writes the same bytes as the command line, and refuses unsuitable settings."""
    path = tmp_path / "run.csv"
    path.write_text("time [ms],force [lbf]\n0,1\n1,2\n2,-1\n", "utf-8")
    found = pf.import_(path, tmp_path / "python.csv", zero=True)
    run_cli("import", path, "-o", tmp_path / "shell.csv", "--zero")
    assert (tmp_path / "python.csv").read_bytes() == (
        tmp_path / "shell.csv"
    ).read_bytes() and found["rows"] == 3
    for given, said in (
        ({"segmet": "2 s"}, "segmet: unknown setting"),
        ({"map": 3}, "map: a text"),
        ({"segment": 2.0}, "segment: a text"),
        ({"begin": "1 s"}, "can be used only for modes"),
    ):
        with pytest.raises(pf.PatchfemError, match=said):
            pf.import_(path, tmp_path / "other.csv", **given)


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


@pytest.mark.parametrize("text", [BENCH, TEXT], ids=["bench", "rig"])
@pytest.mark.parametrize("keys", [{}, {"accuracy.method": "march", "accuracy.steps_per_cycle": 60}])
def test_exact_rigid_loop_has_vertical_jumps(text, keys):
    """In the plot of the loop of a rigid contact under a constant load, the force jumps at a fixed slide."""
    line = pf.run(text, **keys).plot.loop().lines[0]
    slide, force = np.diff(line.get_xydata().T)
    jumps = np.abs(force) > 1e-9
    assert jumps.sum() >= 2 and not slide[jumps].any()


def test_exact_backbone_and_stress_plots_show_values():
    """The plot of a backbone has its frequencies on the axis, and the plot of stresses shows positive values."""
    found = pf.backbone(PLASTIC_BLOCK, amplitudes="0.1 um..10 um:5", method="quasi-static")
    axes = pf.plot.backbone(found)
    frequency = found["quasi_static_frequency"].values
    assert (
        1e3 * axes.lines[0].get_ydata() == pytest.approx(frequency) and "kHz" in axes.get_ylabel()
    )
    assert len(axes.figure.axes) == 3 and pf.plot.backbone(found, axes) is axes
    # The recommended curve is the first one, in its band.
    found = pf.backbone(PLASTIC_BLOCK, amplitudes="0.1 um..10 um:5")
    for axes, name in zip(pf.plot.backbone(found).figure.axes, ("frequency", "damping")):
        scale = 1e3 if name == "frequency" else 1.0
        assert scale * axes.lines[0].get_ydata() == pytest.approx(found[f"balance_{name}"].values)
        assert axes.lines[0].get_label() == f"balance {name}" and axes.collections
    shown = pf.run(PIECES).plot.stress()
    assert shown.collections[0].get_array().max() > 0 and "m" in shown.get_xlabel()
    with pytest.raises(pf.PatchfemError, match="no \\[contact\\]"):
        pf.run(BLOCK).plot.stress()
