"""Charts, tables and files of response curves and drive levels agree with the computed values."""

import re

import numpy as np
import pytest
import xarray as xr
from command_line import run_cli
from matplotlib.figure import Figure
from page_data import read_charts
from scene_texts import COULOMB, MODE, POINT

from patchfem.export import netcdf
from patchfem.export.drawing import charts, pictures

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
def run_results(tmp_path_factory):
    """Return a function from a scene to its results folder and dataset; each scene runs once."""
    base = tmp_path_factory.mktemp("curves")
    results = {}

    def run_scene(text):
        """Return the results folder and the dataset of a scene."""
        if text not in results:
            path = base / f"scene{len(results)}.toml"
            path.write_text(text, "utf-8")
            answer = run_cli("run", path, "-o", base / path.stem, "-q")
            assert answer.code == 0, answer.err
            with xr.open_dataset(base / path.stem / "result.nc") as data:
                results[text] = base / path.stem, data.load()
        return results[text]

    return run_scene


def test_exact_chart_of_folded_curve():
    """The chart of a folded curve names its stable and unstable parts and its folds; drawing is reproducible."""
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
    caption = charts.curve_caption(FOLDED)
    assert "9 points" in caption
    assert "stable, unstable" in caption
    assert "2 folds" in caption
    assert "drive frequency" in caption


def test_exact_chart_of_unbounded_level_curve():
    """The chart of a curve over the drive level states that the motion is not bounded at its end."""
    curve = {
        "frequency": np.full(4, 10.0),
        "level": 9.80665 * np.arange(1.0, 5),
        "amplitude": np.array([1e-6, 2e-6, 3e-6, np.nan]),
        "regime": np.array(["stuck", "2 stops", "sliding", "unbounded"]),
        "multiplier": np.zeros(4),
    }
    assert charts.curve_axis(curve)[0] == pytest.approx([1, 2, 3, 4]) and charts.curve_axis(curve)[
        1:
    ] == ("drive level", "g")
    assert "no bounded motion" in charts.curve_caption(
        curve
    ) and ">unbounded<" in pictures.draw_charts(charts.curve_charts(curve))


def test_exact_curve_is_stored_in_netcdf():
    """A curve is stored in netCDF with its regimes, folds and units."""
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
def test_exact_folded_curve_peak_agrees_with_backbone(run_results):
    """At the peak of a stiffening oscillator the curve agrees with the backbone omega^2 + 3/4 (k3/m) x^2 within 0.5 %.

    The page has the same folds, and the measures are those of the largest motion.
    """
    folder, data = run_results(STIFFENED + SWEEP.format(140, 180, 2))
    page = (folder / "report.html").read_text()
    marks = read_charts(page)["Steady motion at the output", "half the peak-to-peak motion"][
        "marks"
    ]
    assert [mark["x"] for mark in marks if mark["name"] == "fold"] == pytest.approx(
        data.curve_fold.values
    )
    assert {mark["dash"] for mark in marks if mark["name"] == "unstable"} == {
        "dashed"
    } and data.curve_fold.size == 2
    peak = float(data.curve_amplitude.max())
    assert np.abs(data.relative_displacement).max() == pytest.approx(peak, rel=2e-3)
    # the backbone is omega^2 + 3/4 (k3/m) x^2 at the largest motion
    peak_frequency = float(data.curve_frequency[int(np.argmax(data.curve_amplitude.values))])
    assert peak_frequency == pytest.approx(
        np.sqrt(143**2 + 0.75 * 1e11 / 0.884 * peak**2 / (2 * np.pi) ** 2), rel=5e-3
    )
    names = np.array(data.curve_regime.attrs["flag_meanings"].split())[data.curve_regime.values]
    first, last = np.sort(data.curve_fold.values)
    unstable = names == "unstable"
    assert unstable.any() and np.all(
        (data.curve_frequency.values[unstable] > first - 0.5)
        & (data.curve_frequency.values[unstable] < last + 0.5)
    )
    assert np.all(data.curve_multiplier.values[unstable] > 1)
    assert np.all(data.curve_multiplier.values[~unstable] <= 1 + 1e-6)


@pytest.mark.slow
def test_exact_page_lists_levels_in_order(run_results):
    """The page lists the drive levels in the order of the test, stuck below 4 g.

    An arrow connects each two successive levels that move.
    """
    folder, data = run_results(LEVELS)
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
    marks = read_charts(page)["Level by level", "half the peak-to-peak motion"]["marks"]
    arrows = [(mark["name"], *mark["x"]) for mark in marks if mark["kind"] == "arrow"]
    assert arrows == [("raised", 5, 6), ("lowered", 6, 5), ("lowered", 5, 4)]
    assert data.level_drive.values == pytest.approx(9.80665 * np.array([3, 5, 6, 5, 4, 3]))


def test_exact_levels_over_three_decades_are_logarithmic():
    """Levels with amplitudes of 2 nm and 40 um have a logarithmic axis; a level without motion is not drawn."""
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
    (chart,) = charts.levels_chart(rows)
    dots = [mark for mark in chart["marks"] if mark["kind"] == "dots"]
    arrows = [mark["y"] for mark in chart["marks"] if mark["kind"] == "arrow"]
    assert chart["y"]["log"] and [list(mark["x"]) for mark in dots] == [[2.0, 3.0, 2.0]]
    assert np.ravel(arrows) == pytest.approx([2e-3, 40.0, 40.0, 1e-2]) and dots[0][
        "floor"
    ] == pytest.approx(2e-4)
    few_rows = [
        row for row in rows if row["values"]["relative_displacement_amplitude"] in (0.0, 4e-5)
    ]
    assert not charts.levels_chart(few_rows)[0]["y"]["log"]
    for chosen, scale in ((rows, "log"), (few_rows, "linear")):
        axes = Figure().subplots()
        pictures.draw_charts(charts.levels_chart(chosen), axes_to_use=axes)
        assert axes.get_yscale() == scale
