"""Figures of the charts: keys that plotly.js knows, bands that contain their curves, films and menus."""

import gzip
import re
from importlib.resources import files

import numpy as np
import pytest

from patchfem.export.charts.panel import Axis, Curve, Panel
from patchfem.export.charts.plotly import make_plotly_figure

X = np.linspace(0.0, 3.0, 7)
HEIGHT = np.array([1.0, 4.0, 2.0, 3.0, 5.0, 2.0, 1.0])
# Values of these keys are words of the user, colours or data.
FREE_KEYS = (
    *("x", "y", "z", "name", "text", "title", "color", "fillcolor", "label", "ticktext", "args"),
    *("prefix", "array", "arrayminus", "tickvals", "colorscale", "symbol"),
)


def make_curve(name="a", **options) -> Curve:
    """Return a curve with an error of .5."""
    return Curve(name, X, HEIGHT, HEIGHT - 0.5, HEIGHT + 0.5, **options)


def make_map(name: str, values, **options) -> Curve:
    """Return a map of 2 rows."""
    return Curve(name, X, np.array([values, values]), rows=np.array([0.0, 1.0]), **options)


def make_panel(style: str, curves: list, **options) -> Panel:
    """Return a panel of curves."""
    return Panel("a title", style, Axis("x [mm]"), Axis("y [um]"), curves, "a caption", **options)


FILM = make_panel("film", [make_map(f"{k} ms", HEIGHT + k) for k in range(3)])
MENU = make_panel(
    "menu",
    [],
    choices=[
        make_panel("line", [make_curve()], marks=[1.0]),
        make_panel("points", [make_curve("b"), make_curve("c")]),
    ],
)
PANELS = {
    "line": make_panel("line", [make_curve()], marks=[2.0]),
    "points": make_panel("points", [make_curve()]),
    "dots": make_panel("dots", [make_curve()]),
    "area": make_panel("area", [make_curve()]),
    "overlay": make_panel("overlay", [make_curve(name) for name in "abc"]),
    "map": make_panel("map", [make_map("a", HEIGHT - 3)]),
    "states": make_panel("map", [make_map("a", HEIGHT % 2, meanings=("open", "stick"))]),
    "film": FILM,
    "menu": MENU,
}


def list_words(part, key: str = "") -> set[str]:
    """Return all keys of a figure, and the texts that plotly.js interprets."""
    if isinstance(part, dict):
        inner = [list_words(value, name) for name, value in part.items()]
        return {word for name in part for word in name.split(".")}.union(*inner)
    if isinstance(part, list | tuple) and key != "colorscale":
        return set().union(*(list_words(value, key) for value in part))
    return {part} if isinstance(part, str) and part and key not in FREE_KEYS else set()


@pytest.fixture(scope="module")
def known_words() -> set[str]:
    """Return the words of the plotly.js that the pages contain."""
    packed = files("patchfem.export") / "plotly" / "plotly-cartesian.min.js.gz"
    return set(re.findall(r"\w+", gzip.decompress(packed.read_bytes()).decode()))


@pytest.mark.parametrize("name", PANELS)
def test_always_words_of_figures_are_known_to_plotly(known_words, name):
    """Every key and every option of a figure is a word of the plotly.js that the pages contain."""
    words = list_words(make_plotly_figure(PANELS[name]))
    assert len(words) > 10
    assert {word for word in words if not set(re.findall(r"\w+", word)) <= known_words} == set()


@pytest.mark.parametrize("style", ["line", "area", "overlay"])
def test_exact_band_is_a_faint_ring_around_its_curve(style):
    """The band of a curve runs along its upper end and back along the lower one, and is fainter than the curve."""
    curve = make_curve()
    band, line = make_plotly_figure(make_panel(style, [curve]))["data"]
    assert band["x"].tolist() == [*X, *X[::-1]]
    assert band["y"].tolist() == [*curve.high, *curve.low[::-1]]
    assert 0 < band["opacity"] < 0.5 and band["fillcolor"] == line["line"]["color"]
    assert line["y"].tolist() == HEIGHT.tolist() and line["mode"] == "lines"


@pytest.mark.parametrize("style", ["points", "dots"])
def test_exact_bars_of_points_are_their_errors(style):
    """Points have bars from the lower to the upper end of their error."""
    (trace,) = make_plotly_figure(make_panel(style, [make_curve()]))["data"]
    assert (
        trace["error_y"]["array"].tolist() == trace["error_y"]["arrayminus"].tolist() == [0.5] * 7
    )


def test_exact_film_has_a_frame_per_step_of_its_slider():
    """Each step of the slider shows the frame of its time, and the slider names the time as t."""
    figure = make_plotly_figure(FILM)
    (slider,) = figure["layout"]["sliders"]
    names = [curve.name for curve in FILM.curves]
    assert len(figure["data"]) == 1
    assert [frame["name"] for frame in figure["frames"]] == names
    assert [frame["data"][0]["z"][0, 0] for frame in figure["frames"]] == [1.0, 2.0, 3.0]
    assert [step["args"][0] for step in slider["steps"]] == [[name] for name in names]
    assert slider["currentvalue"]["prefix"] + slider["steps"][1]["label"] == "t = 1 ms"


def test_exact_menu_shows_the_curves_axes_and_marks_of_one_panel():
    """Each button of a menu shows all curves of its panel, hides the others, and sets axes and marks."""
    figure = make_plotly_figure(MENU)
    (menu,) = figure["layout"]["updatemenus"]
    shown = np.array([button["args"][0]["visible"] for button in menu["buttons"]])
    assert shown.shape == (2, len(figure["data"]))
    assert (shown.sum(axis=0) == 1).all()
    assert [trace["visible"] for trace in figure["data"]] == shown[0].tolist()
    for button, panel in zip(menu["buttons"], MENU.choices, strict=True):
        changes = button["args"][1]
        assert len(changes["shapes"]) == len(panel.marks)
        assert changes["xaxis.title.text"] == panel.x.label
        assert changes["yaxis.title.text"] == panel.y.label


def test_exact_colours_of_a_map_are_symmetric_only_if_its_values_change_their_sign():
    """The scale of values of both signs has 0 in its middle, and that of other values begins at 0."""
    for shift, ends in ((-3.0, (-2.0, 2.0)), (0.0, (0.0, 5.0))):
        (trace,) = make_plotly_figure(make_panel("map", [make_map("a", HEIGHT + shift)]))["data"]
        assert (trace["zmin"], trace["zmax"]) == ends


@pytest.mark.parametrize(
    "values, labels",
    [
        ([20.0, 200.0], {"tickvals": ["20", "50", "100", "200"]}),
        ([0.3, 0.9], {"tickvals": ["0.3", "0.5", "0.7"]}),
        ([1e-3, 1e2], {"dtick": 1}),
        ([1e-9, 1e3], {}),
        ([1.0, 1.5], {}),
    ],
)
def test_exact_labels_of_a_logarithmic_axis_are_whole_numbers(values, labels):
    """Up to 2.5 decades have labels such as 20 and 50, more the powers of ten; those of a map are of its rows."""
    rows = np.array(values)
    curves = {
        "line": Curve("", X, np.resize(rows, X.size)),
        "map": Curve("", X, np.ones((2, X.size)), rows=rows),
    }
    for style, curve in curves.items():
        panel = Panel("a", style, Axis("x"), Axis("y", is_log=True), [curve], "a caption")
        axis = make_plotly_figure(panel)["layout"]["yaxis"]
        assert axis.get("dtick") == labels.get("dtick")
        shown = []
        for text, place in zip(axis.get("ticktext", []), axis.get("tickvals", []), strict=True):
            assert float(text) == pytest.approx(place, rel=1e-12)
            if rows[0] * (1 - 1e-9) <= place <= rows[1] * (1 + 1e-9):
                shown.append(text)
        assert shown == labels.get("tickvals", [])
