"""The Python interface: the same numbers as the command line, settings of any type, printed and drawn results."""

from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import run_cli
from scene_texts import BENCH, COULOMB, LINEAR, POINT, SHORT, SMALL_PATCH, STRUCTURE

import patchfem as pf
from patchfem import api
from patchfem.export.charts import panel as chart_panel
from patchfem.export.runs import make_quantities
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
def results() -> dict:
    """Return one result of each kind of scene."""
    return {name: pf.run(text) for name, text in KINDS.items()}


# ---- importing


def test_exact_public_names_exist():
    """All names in `__all__` exist, and a misspelt name raises AttributeError."""
    assert pf.__all__ == api.__all__
    assert set(pf.__all__) <= set(dir(pf))
    assert all(hasattr(pf, name) for name in dir(pf))
    assert (Path(pf.__file__).parent / "py.typed").is_file()
    with pytest.raises(AttributeError, match="no attribute 'sweeep'"):
        pf.sweeep  # noqa: B018


# ---- the same numbers as the command line


def as_json(measures) -> dict:
    """Return measures as summary.json stores them."""
    return {name: one.as_json() for name, one in make_quantities(measures).items()}


@pytest.mark.share(1, 2, 4)
@pytest.mark.parametrize("name", KINDS)
def test_exact_results_equal_command_line(name, results, tmp_path):
    """Measures, outcome, warnings and histories of `pf.run` equal those of the command line."""
    (tmp_path / "a.toml").write_text(KINDS[name], "utf-8")
    printed = run_cli("run", tmp_path / "a.toml", "-o", tmp_path / "out", "-q", "--json").content
    result = results[name]
    assert printed["measures"] == as_json(result.measures)
    assert printed["outcome"] == result.outcome == str(result.outcome)
    assert printed["warnings"] == result.warnings
    dataset = result.to_xarray()
    saved = xr.load_dataset(tmp_path / "out/result.nc")
    xr.testing.assert_identical(dataset, saved)


@pytest.mark.parametrize("of", [pf.load, pf.build, pf.plan], ids=["Scene", "Model", "Plan"])
def test_exact_run_accepts_scene_model_or_plan(of, results):
    """`pf.run` gives the same measures for a Scene, a Model and a Plan of the same text."""
    measures = pf.run(of(RIG)).measures
    assert as_json(measures) == as_json(results["rig"].measures)


# ---- loading and setting


def test_exact_load_distinguishes_text_from_path(tmp_path):
    """`pf.load` reads a scene from a text or from a file, and names the source in its error messages."""
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
def test_exact_python_value_sets_same_as_text(key, written, value, tmp_path):
    """A Python or NumPy value sets the same scene as the text of `--set`."""
    (tmp_path / "a.toml").write_text(SMALL_PATCH, "utf-8")
    from patchfem.scene import load

    by_text = load(tmp_path / "a.toml", [f"{key}={written}"])
    assert pf.load(tmp_path / "a.toml", **{key: value}).tables() == by_text.tables()
    assert pf.load(pf.load(SMALL_PATCH), **{key: value}).tables() == by_text.tables()


@pytest.mark.parametrize(
    "key, value, said",
    [
        ("contact.tilt.angel", 1e-3, "contact.tilt.angel: unknown key; did you mean 'angle'?"),
        ("contakt", 1.0, "contakt: unknown key; did you mean 'contact'?"),
        ("contact.load", -1.0, "must be >= 0"),
        ("contact.load", float("nan"), "not a finite"),
        ("contact.load", float("-inf"), "not a finite"),
        ("contact.load", True, "not a quantity"),
        ("contact.load", "5", "bare number"),
        ("contact.pairs", 2.5, "a whole number is needed"),
        ("contact.load", None, "None cannot be a value of a scene"),
        ("contact.load", {1, 2}, "cannot be a value of a scene"),
        ("contact.load", [1.0, 2.0], "not"),
    ],
)
def test_refuses_invalid_keys_and_values(key, value, said):
    """An unknown key or an invalid value is refused with exactly one mistake that names the key."""
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
def test_refuses_without_command_line_terms(ask, said):
    """Error messages of Python calls name neither options of the command line nor lines of a text."""
    with pytest.raises(pf.PatchfemError) as caught:
        ask()
    assert str(caught.value).startswith(said)
    assert "--set" not in str(caught.value) and "<text>" not in str(caught.value)


# ---- looking at it


def test_exact_result_is_a_table_on_screen_and_in_a_notebook(results):
    """The printed measures, the table and the HTML text of a notebook have the measures with their values and units."""
    result = results["bench"]
    measures = result.measures
    table = result.table()
    html = result._repr_html_()
    printed = repr(measures)

    assert list(table.index) == list(measures)
    for name in ("loop_area", "friction_ratio_peak"):
        measure = measures[name]
        assert tuple(table.loc[name]) == (measure.value, measure.error, measure.unit)
    lines = dict(line.split(maxsplit=1) for line in printed.splitlines())
    assert list(lines) == list(measures)
    for name, text in lines.items():
        assert f"<td>{name}</td><td style='text-align:right'>{text}</td>" in html


def test_exact_stress_is_drawn_for_pieces_only(results):
    """The picture of the stress in the pieces needs [contact], as does a grid for ParaView."""
    picture = results["patch"].plot.stress()
    assert picture.figure.axes and picture.collections
    with pytest.raises(pf.PatchfemError, match=r"plot\.stress: .*no \[contact\]"):
        results["bench"].plot.stress()
    with pytest.raises(pf.PatchfemError, match=r"no \[contact\]"):
        results["bench"].to_pyvista()


def test_exact_measures_are_read_only_mapping(results):
    """Measures form a read-only mapping with attribute access, and a misspelt name gets a suggestion."""
    measures = results["bench"].measures
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
def test_always_measures_have_description_and_unit(name, results):
    """Every measure of a result has a unit and a description that begins with a lower-case letter."""
    for key, measure in results[name].measures.items():
        assert (
            measure.text == describe_measure(key)
            and measure.text[0].islower()
            and measure.unit
            and repr(measure).startswith(str(measure))
        ), key


PICTURES = {
    "pressure": {"patch"},
    "loop": {"bench", "rig"},
    "history": {"bench", "rig", "linear", "two interfaces"},
    "levels": set(),
    "curve": set(),
}


@pytest.mark.parametrize("name", ["patch", "bench", "rig", "linear"])
@pytest.mark.parametrize("picture", PICTURES)
def test_exact_plots_draw_on_given_axes(picture, name, results):
    """Each plot returns Matplotlib axes, or draws on given axes without removing their lines.

    A plot that the run has no data for is refused.
    """
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    draw = getattr(results[name].plot, picture)
    if name in PICTURES[picture]:
        new = draw()
        assert isinstance(new, Axes)
        assert new is new.figure.axes[0]
        assert new._repr_svg_().startswith("<svg")
        _, axes = Figure().subplots(1, 2)
        axes.plot([0, 1], [0, 1], label="measured")
        assert draw(ax=axes) is axes
        assert len(axes.figure.axes) == 2
        assert axes.lines[0].get_label() == "measured"
        assert len(axes.lines) == len(new.lines) + 1 and not hasattr(axes, "_repr_svg_")
        for line, expected in zip(axes.lines[1:], new.lines, strict=True):
            np.testing.assert_array_equal(line.get_xydata(), expected.get_xydata())
        assert (axes.get_xlabel(), axes.get_ylabel()) == (new.get_xlabel(), new.get_ylabel())
    else:
        with pytest.raises(pf.PatchfemError, match=rf"plot\.{picture}: nothing to draw: \w+"):
            draw()


def test_always_every_chart_of_page_is_drawn_by_title(results, tmp_path):
    """Each chart of the page of a run is drawn by its title, from the result and from its folder."""
    result = results["rig"]
    titles = result.plot.charts
    assert {"Energy", "Friction loop"} < set(titles)
    folder = result.save(tmp_path / "out")
    page = (folder / "report.html").read_text("utf-8")
    for title in titles:
        axes = result.plot.chart(title)
        assert axes.get_title() == title and title in page
        assert pf.plot.folder(folder, title).get_ylabel() == axes.get_ylabel()
    for draw in (result.plot.chart, lambda title: pf.plot.folder(folder, title)):
        with pytest.raises(pf.PatchfemError, match="Energy"):
            draw("none of these")


def test_response_curves_of_several_levels_share_axes():
    """Each level has a colour and an entry in the legend; the axis is logarithmic, in the unit of the largest one."""
    scene = {
        "structure": {
            "moving_mass": "0.3 kg",
            "mode": [{"name": "blade", "frequency": "200 Hz", "damping": 1e-3, "slide": 1.0}],
        },
        "friction": {"law": "elastic-plastic", "static": 0.35, "stiffness": "8 N/um"},
        "normal": {"load": "8.83 N"},
        "drive": {
            "kind": "force",
            "waveform": "sweep",
            "from": "195 Hz",
            "to": "205 Hz",
            "rate": "1 Hz/s",
        },
        "accuracy": {"method": "harmonic", "tolerance": 1e-2},
    }
    results = [pf.run(scene, **{"drive.force": f"{force} N"}) for force in (1, 2, 4)]
    axes = results[0].plot.curve()
    assert axes.get_ylabel() == "amplitude [nm]"
    small = axes.lines[0].get_ydata().max()
    results[1].plot.curve(ax=axes)
    assert axes.get_yscale() == "linear"
    results[2].plot.curve(ax=axes)
    assert (axes.get_ylabel(), axes.get_yscale()) == ("amplitude [um]", "log")
    assert axes.lines[0].get_ydata().max() == pytest.approx(small * 1e-3)
    assert len({line.get_color() for line in axes.lines}) == 3
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert names == ["drive 1 N", "drive 2 N", "drive 4 N"]


def test_always_curve_on_axes_has_their_units():
    """A chart that is drawn on axes with values in a larger unit is drawn in this unit, with its own label kept."""
    panel = chart_panel.Panel(
        "", "line", chart_panel.Axis("f [kHz]", 1e-3), chart_panel.Axis("a [um]", 1e6), []
    )
    curve = chart_panel.Curve("first", np.array([1.0, 2.0]), np.array([597.0, 1.0]))
    drawn = chart_panel.use_units(replace(panel, curves=[curve]), "f [Hz]", "amplitude [mm]")
    np.testing.assert_allclose(drawn.curves[0].x, [1000.0, 2000.0])
    np.testing.assert_allclose(drawn.curves[0].y, [0.597, 0.001])
    assert (drawn.x.label, drawn.y.label) == ("f [Hz]", "a [mm]")
    other = chart_panel.use_units(replace(panel, curves=[curve]), "time [s]", "")
    assert other.curves[0].y[0] == 597.0 and other.y.label == "a [um]"
