"""The package from Python: the command line's own numbers, sets of any kind, a result one can look at."""

import json
from dataclasses import FrozenInstanceError
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr
from command_line import MODULES, cli, loaded
from scene_texts import BENCH, COULOMB, LINEAR, POINT, SHORT, SMALL_PATCH, STRUCTURE

import patchfem as pf
from patchfem import api
from patchfem.core import Measure
from patchfem.export import measure_object
from patchfem.export.pages.sentences import format_with_error
from patchfem.response import TABLE
from patchfem.runs import describe_measure

RIG = POINT + COULOMB + SHORT
TWO = """\
[structure]
masses = ["1 kg", "1 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1e6 N/m"
[[structure.spring]]
between = [1, 2]
stiffness = "1e6 N/m"
[[structure.interface]]
between = [1, 0]
law = "coulomb"
static = 0.3
load = "20 N"
[[structure.interface]]
between = [2, 0]
law = "coulomb"
static = 0.3
load = "20 N"
[drive]
kind = "base"
frequency = "100 Hz"
acceleration = "10 g"
cycles = 20
"""
KINDS = {
    "patch": SMALL_PATCH,
    "bench": BENCH,
    "rig": RIG,
    "linear": LINEAR + "[accuracy]\nsteps_per_cycle = 100\n",
    "two interfaces": TWO,
}


@pytest.fixture(scope="module")
def runs() -> dict:
    """One result of each kind."""
    return {name: pf.run(text) for name, text in KINDS.items()}


# ---- importing


def test_exact_importing_imports_nothing_of_weight():
    modules = loaded(f"import patchfem as pf; dir(pf), pf.__version__\n{MODULES}")
    assert not {"numpy", "pydantic", "scipy", "xarray", "matplotlib"} & modules
    assert {name for name in modules if name.startswith("patchfem")} == {
        "patchfem",
        "patchfem.lazy_imports",
    }


def test_exact_the_names_are_all_there():
    assert pf.__all__ == api.__all__
    assert set(pf.__all__) <= set(dir(pf))
    assert all(hasattr(pf, name) for name in dir(pf))
    assert (Path(pf.__file__).parent / "py.typed").is_file()
    with pytest.raises(AttributeError, match="no attribute 'sweeep'"):
        pf.sweeep  # noqa: B018


# ---- the same numbers as the command line


@pytest.mark.share(1, 2, 4)
@pytest.mark.parametrize("name", KINDS)
def test_exact_the_numbers_are_those_of_the_command_line(name, runs, tmp_path):
    (tmp_path / "a.toml").write_text(KINDS[name], "utf-8")
    answer = cli("run", tmp_path / "a.toml", "-o", tmp_path / "out", "-q", "--json")
    said = json.loads(answer.out)
    result = runs[name]
    assert said["measures"] == {key: measure_object(one) for key, one in result.measures.items()}
    assert said["outcome"] == result.outcome == str(result.outcome)
    assert said["warnings"] == result.warnings
    here = result.to_xarray()
    there = xr.load_dataset(tmp_path / "out" / "result.nc")
    xr.testing.assert_identical(here, there)


def test_exact_saving_writes_the_folder_of_the_command_line(runs, tmp_path):
    (tmp_path / "a.toml").write_text(BENCH, "utf-8")
    cli("run", tmp_path / "a.toml", "-o", tmp_path / "there", "-q")
    assert runs["bench"].save(tmp_path / "here") == tmp_path / "here"
    names = {
        place: sorted(path.name for path in (tmp_path / place).iterdir())
        for place in ("here", "there")
    }
    assert names["here"] == names["there"]
    here, there = (json.loads((tmp_path / place / "summary.json").read_text()) for place in names)
    assert here | {"seconds": 0, "effects": 0} == there | {"seconds": 0, "effects": 0}
    runs["bench"].save(str(tmp_path / "here"))  # an older one is replaced
    (tmp_path / "here" / "notes.txt").write_text("mine")
    with pytest.raises(pf.PatchfemError, match=r"notes\.txt"):
        runs["bench"].save(tmp_path / "here")


@pytest.mark.parametrize("of", [pf.load, pf.build, pf.plan], ids=["Scene", "Model", "Plan"])
def test_exact_every_stage_can_be_handed_on(of, runs):
    measures = pf.run(of(RIG)).measures
    assert {name: measure_object(one) for name, one in measures.items()} == {
        name: measure_object(one) for name, one in runs["rig"].measures.items()
    }


# ---- loading and setting


def test_exact_a_text_and_a_file_are_told_apart(tmp_path):
    path = tmp_path / "a[1].toml"
    path.write_text(POINT + COULOMB + STRUCTURE, "utf-8")
    assert pf.load(path).tables() == pf.load(POINT + COULOMB + STRUCTURE).tables()
    assert pf.load(path).path == path
    assert pf.load("[normal]\nload = '1 N'\n" + BENCH[len(POINT) :]).path.name == "<text>"
    with pytest.raises(pf.SceneError, match=r"none\.toml: cannot be read"):
        pf.load("none.toml")
    with pytest.raises(pf.SceneError, match=r"<text>:\d+: slide.file: there is no file path\.csv"):
        pf.load(POINT + COULOMB + '[slide]\nkind = "file"\nfile = "path.csv"\n')


@pytest.mark.parametrize(
    "key, written, value",
    [
        ("contact.tilt.angle", "0.3 mrad", 3e-4),
        ("contact.tilt.angle", "1e-7 rad", np.float64(1e-7)),
        ("contact.load", "7 N", 7),
        ("contact.load", "7 N", np.int64(7)),
        ("contact.load", "0.1 N", np.array(0.1)),
        ("contact.pairs", "3", 3),
        ("contact.pairs", "3", np.int32(3)),
        ("contact.pairs", "3", "3"),
        ("contact.plane", "stress", "stress"),
        ("title", 'a "title" # of 5', 'a "title" # of 5'),
        ("contact.substrate", "steel", "steel"),
        (
            "contact.substrate",
            '{young = "1e11 Pa", poisson = 0.3, density = "8e3 kg/m^3"}',
            {"young": 1e11, "poisson": 0.3, "density": 8000},
        ),
        ("contact.crown", '{radius = "2 m", on = "lower"}', {"radius": 2, "on": "lower"}),
        ("contact.shear", "{}", {}),
        ("accuracy.tolerance", "0.01", 0.01),
        ("accuracy.tolerance", "0.5", np.float64(0.5)),
    ],
)
def test_exact_a_value_sets_what_its_text_sets(key, written, value, tmp_path):
    (tmp_path / "a.toml").write_text(SMALL_PATCH, "utf-8")
    from patchfem.scene import load

    by_text = load(tmp_path / "a.toml", [f"{key}={written}"])
    assert pf.load(tmp_path / "a.toml", **{key: value}).tables() == by_text.tables()
    assert pf.load(pf.load(SMALL_PATCH), **{key: value}).tables() == by_text.tables()


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-300, 12345.678901234567, 5e22])
def test_exact_a_number_arrives_to_the_last_bit(value):
    assert pf.load(BENCH, **{"normal.load": value}).normal.load == value


def test_exact_lists_and_modes_by_name():
    levels = (
        POINT
        + COULOMB
        + STRUCTURE.replace('acceleration = "5 g"\n', 'waveform = "levels"\nlevels = ["1 g"]\n')
    )
    asked = pf.load(
        levels, **{"drive.levels": np.linspace(1, 3, 3), "structure.mode.axial.frequency": 150.0}
    )
    assert asked.drive.levels == (1.0, 2.0, 3.0) and asked.structure.mode[0].frequency == 150.0
    assert pf.load(levels, **{"drive.levels": ["1 g", 2.0]}).drive.levels == (9.80665, 2.0)
    again = pf.load(asked, **{"structure.mode.0.frequency": "1 kHz", "drive.levels.1": "1 m/s^2"})
    assert again.structure.mode[0].frequency == 1000.0 and again.drive.levels == (1.0, 1.0, 3.0)


@pytest.mark.parametrize(
    "key, value, said",
    [
        ("contact.tilt.angel", 1e-3, "contact.tilt.angel: unknown key; did you mean 'angle'?"),
        ("contact.tillt.angle", 1e-3, "contact.tillt: unknown table; did you mean 'tilt'?"),
        ("contakt", 1.0, "contakt: unknown key; did you mean 'contact'?"),
        ("contact.load", -1.0, "must be >= 0"),
        ("contact.load", float("nan"), "not a finite"),
        ("contact.load", float("-inf"), "not a finite"),
        ("contact.load", True, "true is not a quantity"),
        ("contact.load", "5", "bare number"),
        ("contact.pairs", 2.5, "a whole number is needed"),
        ("contact.load", None, "None cannot be a value of a scene"),
        ("contact.load", {1, 2}, "cannot be a value of a scene"),
        ("contact.load", [1.0, 2.0], "not"),
    ],
)
def test_refuses_what_no_scene_can_hold(key, value, said):
    with pytest.raises(pf.SceneError) as caught:
        pf.run(SMALL_PATCH, **{key: value})
    assert caught.value.mistakes[0].startswith(key.rpartition(".")[0] or key)
    assert said in str(caught.value) and len(caught.value.mistakes) == 1


BARE = {
    "normal": {"load": 115.0},
    "friction": {"law": "coulomb", "static": 0.3},
    "slide": {"kind": "sine", "amplitude": 1e-6, "frequency": 1.0},
}


@pytest.mark.parametrize(
    "ask, said",
    [
        (lambda: pf.run(BARE | {"normal": {"load": -1.0}}), "normal.load: "),
        (
            lambda: pf.run(BARE | {"slide": {"kind": "sine", "amplitude": 5, "frequency": 1.0}}),
            "slide.amplitude: ",
        ),
        (lambda: pf.run(BARE, **{"friction.foo": 1}), "friction.foo: "),
        (
            lambda: pf.sweep(BARE, {"friction.static": []}),
            "friction.static: the sweep has no value for this key",
        ),
        (
            lambda: pf.run([BARE]),
            "a scene: a path, a text, a dict of tables or a Scene is needed, not ",
        ),
    ],
)
def test_refuses_in_the_words_of_python(ask, said):
    """No option of the command line, and no line of a text that nobody wrote."""
    with pytest.raises(pf.PatchfemError) as caught:
        ask()
    assert str(caught.value).startswith(said)
    assert "--set" not in str(caught.value) and "<text>" not in str(caught.value)


def test_refuses_sets_of_what_is_made():
    for made in (pf.build(BENCH), pf.plan(BENCH)):
        with pytest.raises(pf.PatchfemError, match=r"normal\.load cannot be set in a "):
            pf.run(made, **{"normal.load": 3.0})


def test_refuses_a_bad_scene_with_all_its_mistakes():
    with pytest.raises(pf.SceneError) as caught:
        pf.load(BENCH.replace("26 lbf", "26 lb").replace("static", "sttic"))
    assert len(caught.value.mistakes) == 3


@pytest.mark.parametrize(
    "name",
    [
        name
        for name in pf.__all__
        if isinstance(getattr(pf, name), type) and issubclass(getattr(pf, name), Exception)
    ],
)
def test_always_one_except_catches_every_failure(name):
    """`except pf.PatchfemError` around any call of the package."""
    assert issubclass(getattr(pf, name), pf.PatchfemError)
    with pytest.raises(pf.PatchfemError, match="wavform"):
        pf.run(BENCH.replace("[slide]", "[slide]\nwavform = 1"))


# ---- looking at it


def test_exact_measures_are_a_mapping_that_cannot_be_written(runs):
    measures = runs["bench"].measures
    assert list(measures) == measures._ipython_key_completions_()
    assert len(measures) == len(list(measures)) > 8
    assert measures["loop_area"] is measures.loop_area is measures.get(
        "loop_area"
    ) and "loop_area" in dir(measures)
    assert "loop_aera" not in measures and measures.get("loop_aera") is None
    with pytest.raises(KeyError, match="did you mean 'loop_area'"):
        measures["loop_aera"]
    with pytest.raises(AttributeError, match="did you mean 'loop_area'"):
        measures.loop_aera  # noqa: B018
    with pytest.raises(TypeError):
        measures["loop_area"] = 1.0
    with pytest.raises(FrozenInstanceError):
        measures["loop_area"].value = 1.0


@pytest.mark.parametrize("name", KINDS)
def test_always_every_measure_says_what_it_is(name, runs):
    for key, one in runs[name].measures.items():
        assert (
            one.text == describe_measure(key)
            and one.text[0].islower()
            and one.unit
            and repr(one).startswith(str(one))
        ), key


def test_exact_a_number_behind_a_name_counts_interfaces_or_strips(runs):
    assert runs["two interfaces"].measures["slip_amplitude_2"].text.endswith("; of interface 2")
    assert describe_measure("loop_area_13", "strip") == TABLE["loop_area"].text + "; of strip 13"
    assert describe_measure("relative_displacement_amplitude_steady").startswith(
        "steady amplitude under a periodic drive"
    )


def test_exact_a_table_is_aligned_and_rounded_by_the_error(runs):
    lines = repr(runs["patch"].measures).splitlines()[1:]
    assert len(lines) == len(runs["patch"].measures) and all(len(line) < 80 for line in lines)
    for line, (name, one) in zip(lines, runs["patch"].measures.items(), strict=True):
        first, text = line.split(None, 1)
        assert first == name and text == format_with_error(name, measure_object(one))
    assert repr(api.Measures({})) == ""
    assert repr(api.Measures({"a": Measure(2.0, "m")})) == "motion\n  a  2 m (error unknown)"


def test_exact_a_measure_shows_value_and_error():
    assert str(Measure(1.48083e-5, "m", 4.4e-8)) == "14.808 ± 0.044 um"
    assert str(Measure(0.25, "1", 0.12)) == "0.25 ± 0.12" and str(Measure(None, "N")) == "- N"
    assert repr(Measure(3.0, "N", None, 0.0, "a force")) == "3 N (a force)"


@pytest.mark.parametrize("name", KINDS)
def test_always_what_one_prints_is_short(name, runs):
    scene = pf.load(KINDS[name])
    for one in (
        scene,
        pf.build(scene),
        runs[name].plan,
        runs[name],
        pf.load(scene, **{"accuracy.tolerance": 2e-3}),
    ):
        shown = repr(one)
        assert shown.startswith(type(one).__name__) and "<text>" in shown and "array" not in shown
        assert len(shown.splitlines()) <= 8 and max(map(len, shown.splitlines())) < 260, shown
    assert "accuracy.tolerance=0.002" in shown


def test_exact_a_result_has_what_the_contract_names(runs):
    result = runs["rig"]
    assert isinstance(result, pf.Result)
    assert isinstance(result.outcome, pf.Outcome)
    assert result.notes == []
    assert result.outcome.sentence in repr(result) and isinstance(result.warnings, list)
    assert {"to_xarray", "save", "plot", "measures", "outcome", "warnings", "notes"} <= set(
        dir(result)
    )


PICTURES = {
    "pressure": {"patch"},
    "loop": {"bench", "rig"},
    "history": {"bench", "rig", "linear", "two interfaces"},
    "levels": set(),
}


@pytest.mark.parametrize("name", ["patch", "bench", "rig", "linear"])
@pytest.mark.parametrize("picture", PICTURES)
def test_exact_a_picture_is_axes_or_the_run_lacks_it(picture, name, runs):
    """Drawn on axes of one's own it is the first panel of the new figure, and what stood there stays."""
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    draw = getattr(runs[name].plot, picture)
    if name in PICTURES[picture]:
        new = draw()
        assert isinstance(new, Axes)
        assert new is new.figure.axes[0]
        assert new._repr_svg_().startswith("<svg")
        _, mine = Figure().subplots(1, 2)
        mine.plot([0, 1], [0, 1], label="measured")
        assert draw(ax=mine) is mine
        assert len(mine.figure.axes) == 2
        assert mine.lines[0].get_label() == "measured"
        assert len(mine.lines) == len(new.lines) + 1 and not hasattr(mine, "_repr_svg_")
        for here, there in zip(mine.lines[1:], new.lines, strict=True):
            np.testing.assert_array_equal(here.get_xydata(), there.get_xydata())
        assert (mine.get_xlabel(), mine.get_ylabel()) == (new.get_xlabel(), new.get_ylabel())
    else:
        with pytest.raises(pf.PatchfemError, match=rf"plot\.{picture}: nothing to draw: \w+"):
            draw()


def test_exact_levels_are_drawn():
    text = RIG.replace('acceleration = "5 g"\n', 'waveform = "levels"\nlevels = ["3 g", "6 g"]\n')
    from matplotlib.figure import Figure

    result = pf.run(text)
    mine = Figure().subplots()
    assert result.plot.levels().get_title() == "Level by level"
    assert result.plot.levels(ax=mine) is mine and len(mine.figure.axes) == 1 and mine.get_ylabel()


@pytest.mark.slow
def test_exact_pictures_need_no_window():
    code = f"import patchfem as pf; pf.run({BENCH!r}).plot.loop()\n{MODULES}"
    assert "matplotlib.pyplot" not in loaded(code)


def test_exact_what_takes_long_is_said_on_stderr_or_to_the_caller(capfd, monkeypatch):
    def slow(what, say, progress):
        say("compiling")
        return found

    found = pf.run(BENCH)
    monkeypatch.setattr(api, "run_plan", slow)
    pf.run(BENCH)
    heard = []
    pf.run(BENCH, say=heard.append)
    assert capfd.readouterr() == ("", "compiling\n") and heard == ["compiling"]


def test_exact_a_notebook_shows_the_answer_and_what_it_holds_as_text(runs):
    """Every measure with its number and error as on the first screen; markup in a title is text."""
    result = runs["rig"]
    shown = result._repr_html_()
    parsed = ElementTree.fromstring(
        shown.replace("colspan=2", "colspan='2'").replace("<br>", "<br/>")
    )
    cells = [[cell.text for cell in row] for row in parsed.iter("tr")]
    found = dict(row for row in cells if len(row) == 2)
    assert set(found) == set(result.measures)
    for name, one in result.measures.items():
        assert one.value is None or found[name].split(", ")[0] == format_with_error(
            name, {"value": one.value, "unit": one.unit, "error": one.error}
        )
    assert result.outcome.sentence in shown
    marked = pf.run('title = "<script>x</script>"\n' + BENCH)._repr_html_()
    assert "<script>" not in marked and "&lt;script&gt;" in marked
