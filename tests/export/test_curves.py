"""Pictures and tables of curves and levels: what they say, that their lines are what was computed, and the file."""

import re

import numpy as np
import pytest
import xarray as xr
from command_line import cli
from matplotlib.figure import Figure
from matplotlib.text import Annotation
from page_data import charts_of
from scene_texts import COULOMB, MODE, POINT

from patchfem.core import Outcome
from patchfem.export import netcdf, report
from patchfem.export.drawing import charts, pictures
from patchfem.export.page_data import RunData, SceneText, Verdict

FOLDED = {
    "frequency": np.array([10.0, 11, 12, 13, 12.5, 12, 11.5, 12.5, 14]),
    "level": np.full(9, 5.0),
    "amplitude": 1e-5 * np.array([1.0, 2, 4, 7, 6, 5, 3, 2, 1]),
    "regime": np.array(["stable"] * 4 + ["unstable"] * 3 + ["stable"] * 2),
    "multiplier": np.linspace(0.2, 1.5, 9),
    "folds": np.array([13.0, 11.5]),
}
SWEEP = """\
[drive]
kind = "base"
waveform = "sweep"
from = "{0} Hz"
to = "{1} Hz"
rate = "10 Hz/s"
acceleration = "{2} g"
[accuracy]
method = "harmonic"
tolerance = 1e-2
"""
SLIPPING = POINT + COULOMB + MODE
STIFFENED = (
    POINT
    + '[friction]\nlaw = "elastic-plastic"\nstatic = 0.05\nbond_length = "20 um"\n'
    + MODE
    + '[structure.stiffening]\ncubic = "1e11 N/m^3"\n'
)
LEVELS = (
    SLIPPING
    + """\
[drive]
kind = "base"
waveform = "levels"
frequency = "143 Hz"
levels = ["3 g", "5 g", "6 g", "5 g", "4 g", "3 g"]
cycles = 100
"""
)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """scene text -> (folder of its results, dataset), each once."""
    base = tmp_path_factory.mktemp("curves")
    kept = {}

    def of(text):
        if text not in kept:
            path = base / f"scene{len(kept)}.toml"
            path.write_text(text, "utf-8")
            answer = cli("run", path, "-o", base / path.stem, "-q")
            assert answer.code == 0, answer.err
            with xr.open_dataset(base / path.stem / "result.nc") as data:
                kept[text] = base / path.stem, data.load()
        return kept[text]

    return of


def test_exact_spans_of_a_curve():
    assert charts.regime_stretches(FOLDED) == [
        ("stable", 0, 4),
        ("unstable", 4, 7),
        ("stable", 7, 9),
    ]


def test_exact_a_picture_of_a_folded_curve():
    text = pictures.draw_charts(charts.curve_charts(FOLDED))
    for word in (
        "stable",
        "unstable",
        "fold",
        "drive frequency [Hz]",
        "half the peak-to-peak motion [um]",
    ):
        assert f">{word}<" in text, word
    assert "stroke-dasharray" in text and pictures.draw_charts(charts.curve_charts(FOLDED)) == text
    said = charts.curve_caption(FOLDED)
    assert "9 points" in said
    assert "stable, unstable" in said
    assert "2 folds" in said
    assert "drive frequency" in said


def test_exact_a_curve_over_the_level_with_no_bounded_motion_at_its_end():
    found = {
        "frequency": np.full(4, 10.0),
        "level": 9.80665 * np.arange(1.0, 5),
        "amplitude": np.array([1e-6, 2e-6, 3e-6, np.nan]),
        "regime": np.array(["stuck", "2 stops", "sliding", "unbounded"]),
        "multiplier": np.zeros(4),
    }
    assert charts.curve_axis(found)[0] == pytest.approx([1, 2, 3, 4]) and charts.curve_axis(found)[
        1:
    ] == ("drive level", "g")
    assert "no bounded motion" in charts.curve_caption(
        found
    ) and ">unbounded<" in pictures.draw_charts(charts.curve_charts(found))


def test_exact_the_regime_in_words():
    assert charts.regime_sentence(None) == ""
    assert "decays" in charts.regime_sentence({"regime": "2 stops", "multiplier": 0.2})
    assert "grows or persists" in charts.regime_sentence({"regime": "unstable", "multiplier": 1.2})
    assert (
        charts.regime_sentence({"regime": "stuck", "multiplier": 0.0})
        == " Regime: stuck; largest Floquet multiplier 0."
    )


def test_exact_a_curve_in_the_file():
    data = netcdf.add_curve(netcdf.Contents(), FOLDED).to_xarray()
    names = data.curve_regime.attrs["flag_meanings"].split()
    assert [names[k] for k in data.curve_regime.values] == FOLDED["regime"].tolist()
    for name in ("frequency", "level", "amplitude", "multiplier"):
        assert data[f"curve_{name}"].values.tolist() == FOLDED[name].tolist()
        assert data[f"curve_{name}"].dims == ("curve_point",)
        assert data[f"curve_{name}"].attrs["units"]
    assert data.curve_fold.values.tolist() == [13.0, 11.5]
    assert data.curve_fold.attrs["units"] == "Hz"


@pytest.mark.slow
def test_exact_a_folded_curve_and_the_motion_at_its_top(written):
    """Of three motions at one frequency the measures are of the largest, which the curve found."""
    folder, data = written(STIFFENED + SWEEP.format(140, 180, 2))
    page = (folder / "report.html").read_text()
    marks = charts_of(page)["Steady motion at the output", "half the peak-to-peak motion"]["marks"]
    assert [mark["x"] for mark in marks if mark["name"] == "fold"] == pytest.approx(
        data.curve_fold.values
    )
    assert {mark["dash"] for mark in marks if mark["name"] == "unstable"} == {
        "dashed"
    } and data.curve_fold.size == 2
    top = float(data.curve_amplitude.max())
    assert np.abs(data.relative_displacement).max() == pytest.approx(top, rel=2e-3)
    # backbone: omega^2 + 3/4 (k3/m) x^2 where the largest motion is
    at = float(data.curve_frequency[int(np.argmax(data.curve_amplitude.values))])
    assert at == pytest.approx(
        np.sqrt(143**2 + 0.75 * 1e11 / 0.884 * top**2 / (2 * np.pi) ** 2), rel=5e-3
    )
    names = np.array(data.curve_regime.attrs["flag_meanings"].split())[data.curve_regime.values]
    first, last = np.sort(data.curve_fold.values)
    inside = names == "unstable"
    assert inside.any() and np.all(
        (data.curve_frequency.values[inside] > first - 0.5)
        & (data.curve_frequency.values[inside] < last + 0.5)
    )
    assert np.all(data.curve_multiplier.values[inside] > 1)
    assert np.all(data.curve_multiplier.values[~inside] <= 1 + 1e-6)


@pytest.mark.slow
def test_exact_levels_on_the_page(written):
    """A row per level in its order, stuck below 4 g, and an arrow per step between levels that move: the axis is
    logarithmic."""
    folder, data = written(LEVELS)
    page = (folder / "report.html").read_text()
    rows = re.findall(
        r"<tr><td class=n>(\d)</td><td class=n>(\d) g</td>(.*?)<td>(\w+)</td></tr>", page
    )
    assert [(int(n), int(g), word) for n, g, _, word in rows] == [
        (1, 3, "stuck"),
        (2, 5, "slips"),
        (3, 6, "slips"),
        (4, 5, "slips"),
        (5, 4, "slips"),
        (6, 3, "stuck"),
    ]
    marks = charts_of(page)["Level by level", "half the peak-to-peak motion"]["marks"]
    arrows = [(mark["name"], *mark["x"]) for mark in marks if mark["kind"] == "arrow"]
    assert arrows == [("raised", 5, 6), ("lowered", 6, 5), ("lowered", 5, 4)]
    assert data.level_drive.values == pytest.approx(9.80665 * np.array([3, 5, 6, 5, 4, 3]))


def test_exact_the_arrows_of_the_levels_point_along_the_test():
    rows = [
        {"drive": d, "stuck": d < 2, "values": {"relative_displacement_amplitude": a}, "errors": {}}
        for d, a in ((1.0, 0.0), (2.0, 1e-6), (3.0, 4e-6), (2.0, 2e-6))
    ]
    axes = Figure().subplots()
    pictures.draw_charts(charts.levels_chart(rows), axes_to_use=axes)
    arrows = [text for text in axes.texts if isinstance(text, Annotation) and text.arrow_patch]
    upwards = [(arrow.xyann[0] < arrow.xy[0], arrow.xyann[1] < arrow.xy[1]) for arrow in arrows]
    assert upwards == [(True, True), (True, True), (False, False)]


def test_exact_a_page_without_curve_or_levels_has_neither():
    summary = {
        "patchfem": "0",
        "title": "",
        "kind": "patch",
        "outcome": "done",
        "measures": {},
        "effects": [],
        "not_in_scene": [],
        "warnings": [],
        "notes": [],
        "seconds": {},
    }
    data = RunData(SceneText("a", "", ""), Verdict(summary, Outcome.DONE.sentence), {})
    assert "Floquet" not in report.page_html(data) and "<h2>Levels" not in report.page_html(data)
    summary["seconds"] = {"total": 0.434, "files": 0.1}
    text = report.page_html(data)
    assert "computed in 0.43 s" in text
    assert "Wall-clock seconds: total 0.434 s, files 0.100 s" in text


def test_exact_levels_over_more_than_three_decades_are_drawn_over_their_logarithm():
    """Microslip of 2 nm beside 40 um of slip, and a level that does not move at all: the first two are drawn."""
    rows = [
        {
            "drive": d,
            "stuck": d < 2,
            "unit": "N",
            "values": {"relative_displacement_amplitude": a},
            "errors": {"relative_displacement_amplitude": 3e-9},
        }
        for d, a in ((1.0, 0.0), (2.0, 2e-9), (3.0, 4e-5), (2.0, 1e-8))
    ]
    (found,) = charts.levels_chart(rows)
    dots = [one for one in found["marks"] if one["kind"] == "dots"]
    arrows = [one["y"] for one in found["marks"] if one["kind"] == "arrow"]
    assert found["y"]["log"] and [list(one["x"]) for one in dots] == [[2.0, 3.0, 2.0]]
    assert np.ravel(arrows) == pytest.approx([2e-3, 40.0, 40.0, 1e-2]) and dots[0][
        "floor"
    ] == pytest.approx(2e-4)
    few = [row for row in rows if row["values"]["relative_displacement_amplitude"] in (0.0, 4e-5)]
    assert not charts.levels_chart(few)[0]["y"]["log"]
    for some, scale in ((rows, "log"), (few, "linear")):
        axes = Figure().subplots()
        pictures.draw_charts(charts.levels_chart(some), axes_to_use=axes)
        assert axes.get_yscale() == scale
