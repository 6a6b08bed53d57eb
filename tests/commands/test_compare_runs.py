"""`patchfem compare` of two results folders: wear between them, in the measures of compared traces, and error messages."""

import numpy as np
import pytest
import xarray
from command_line import read_json, read_page, run_cli, run_successfully
from page_data import read_charts
from scene_texts import COULOMB, POINT
from test_compare_verb import NAMES

import patchfem as pf
from patchfem.wear.between_runs import find_plane_below

TILTED = """
[contact]
length = "12.7 mm"
width = "10 mm"
height = "6.35 mm"
load = "100 N"
element_size = "0.4 mm"
substrate = "Ti-8Al-1Mo-1V"
[contact.tilt]
angle = "0.1 mrad"
"""
SINE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
WEAR = '[wear]\ncoefficient = "1e-14 m^2/N"\njumps = 8\ncycles = '
PER_CYCLE = (
    1e-14 * 100.0 * 40e-6
)  # worn volume per cycle [m^3]: coefficient, load and sliding distance
MANY = 4e6
SCENES = {
    "pressed": TILTED,
    "half": TILTED + COULOMB + SINE + WEAR + "1e5\n",
    "worn": TILTED + COULOMB + SINE + WEAR + f"{MANY:g}\n",
    "stuck": TILTED
    + COULOMB.replace('"coulomb"', '"elastic-plastic"\nbond_length = "1 um"')
    + SINE.replace("10 um", "1 nm")
    + WEAR
    + "1e5\n",
    "point": POINT + COULOMB + SINE + WEAR + "1e5\n",
    "other": TILTED.replace("0.1 mrad", "0.2 mrad"),
}


@pytest.fixture(scope="module")
def result_folders(tmp_path_factory):
    """Return the folder with the results of SCENES by name."""
    place = tmp_path_factory.mktemp("runs")
    for name, text in SCENES.items():
        pf.run(pf.load(text)).save(place / name)
    return place


@pytest.mark.parametrize("before", ["pressed", "half"])
def test_exact_wear_measures_agree_with_archard(result_folders, before):
    """Worn volume, mean depth and area agree with Archard's law within 1e-11.

    The measures of the track are consistent with each other.
    """
    found = pf.compare(result_folders / before, result_folders / "worn")
    volume = PER_CYCLE * (MANY - (1e5 if before == "half" else 0.0))
    for name, truth in (
        ("worn_volume", volume),
        ("worn_depth_mean", volume / 12.7e-3 / 10e-3),
        ("worn_area", volume / 10e-3),
    ):
        quantity = found[name]
        assert quantity["value"] == pytest.approx(truth, rel=1e-11, abs=0)
        assert quantity["low"] <= truth <= quantity["high"]
    names = {name for name in NAMES if "ratio" not in name}
    assert names | {"hidden_wear", "worn_share", "track", "registration", "removed"} <= set(found)
    track = found["track"]
    deepest = found["worn_depth_max"]["value"]
    width = track["to"]["value"] - track["from"]["value"]
    assert track["depth_mean"]["value"] == pytest.approx(
        track["area_gross"]["value"] / width, rel=1e-12
    )
    assert track["depth_mean"]["value"] < track["depth_floor"]["value"] < deepest
    # the share of the nodes that are worn, known to an element at each end
    assert found["worn_share"]["value"] == pytest.approx(width / 12.7e-3, abs=0.4e-3 / 12.7e-3)
    for end in (
        track["from"],
        track["to"],
    ):  # known to half an element of 0.4 mm
        assert 0.099e-3 < end["high"] - end["value"] <= 0.2e-3
        assert end["value"] - end["low"] == pytest.approx(end["high"] - end["value"], rel=1e-9)
    depth_error = found["worn_depth_max"]["high"] - deepest
    for name in ("area_net", "area_gross"):
        assert track[name]["high"] - track[name]["value"] == pytest.approx(
            depth_error * width, rel=1e-9, abs=0
        )
    measures = [found["runs"][when]["measures"] for when in ("before", "after")]
    assert measures[0]["pressure_peak"]["value"] > 2 * measures[1]["pressure_peak"]["value"]
    assert ("loop_area" in measures[0]) == (before != "pressed")


def test_exact_hidden_line_is_highest_line_below_depth():
    """The hidden line lies below the depth and has the largest mean of all such lines.

    The largest mean is found by a search over a grid of lines.
    """
    x = np.linspace(-1, 2, 41)
    rng = np.random.default_rng(3)
    for k in range(12):
        depth = rng.uniform(0, 1, x.size) + rng.uniform(-0.2, 2) * (x + 1)
        depth = np.maximum(depth, 0.0) * (x < 1.5 if k % 4 == 0 else 1)
        ends = find_plane_below(x, None, depth)
        line = np.interp(x, x[[0, -1]], ends)
        assert min(ends) >= 0 and (line <= depth + 1e-12).all()
        low, high = np.meshgrid(*[np.linspace(0, one, 100) for one in (depth[0], depth[-1])])
        fraction = (x - x[0]) / (x[-1] - x[0])
        is_below = ((low[..., None] * (1 - fraction) + high[..., None] * fraction) <= depth).all(
            axis=-1
        )
        best = float(((low + high) / 2)[is_below].max())
        assert best <= sum(ends) / 2 + 1e-12
        assert sum(ends) / 2 - best < 0.04 * max(depth[0], depth[-1]) + 1e-12
    assert find_plane_below(x, None, 3.0 + x) == pytest.approx((2.0, 5.0), rel=1e-12)
    assert find_plane_below(x, None, np.maximum(x, 0.0)) == (0.0, 0.0)


def test_exact_compare_command_agrees_with_python(result_folders, tmp_path):
    """The command prints and stores the results of `pf.compare`, and writes a report with the verdict."""
    found = run_successfully(
        "compare",
        result_folders / "half",
        result_folders / "worn",
        "--json",
        "-o",
        tmp_path / "out",
    ).content
    assert (
        found
        == pf.compare(result_folders / "half", result_folders / "worn")
        == read_json(tmp_path / "out/compare.json")
    )
    page = read_page(tmp_path / "out")
    assert found["verdict"] in page and "Friction loops" in page and "pressure peak" in page
    answer = run_cli(
        "compare", result_folders / "half", result_folders / "worn", "-o", tmp_path / "out"
    )
    assert found["verdict"] in answer.out and "worn_volume" in answer.out
    table = np.loadtxt(tmp_path / "out/depth.csv", delimiter=",", skiprows=1)
    assert table[:, 3].max() == found["worn_depth_max"]["value"]
    assert table[:, 2] - table[:, 1] == pytest.approx(table[:, 3], abs=1e-18)


def test_exact_charts_show_last_state_and_loop_of_each_run(result_folders, tmp_path):
    """The chart of the pressure shows the last frame of each run; the loops have the friction limit, 30 N, and the slide."""
    names = ("half", "worn")
    run_successfully("compare", *(result_folders / name for name in names), "-o", tmp_path / "out")
    charts = read_charts(read_page(tmp_path / "out"))
    for name, curve in zip(names, charts["Pressure on the interface"]["data"], strict=True):
        with xarray.open_dataset(result_folders / name / "result.nc") as data:
            pressure = data["normal_stress"].values[-1]
        np.testing.assert_allclose(curve["y"], pressure * 1e-6, rtol=1e-6)
    for loop in charts["Friction loops"]["data"]:
        assert np.ptp(loop["y"]) == pytest.approx(60.0) and np.ptp(loop["x"]) == pytest.approx(20.0)


def test_exact_patch_that_sticks_wears_nothing(result_folders, tmp_path):
    """A run without slip has no wear: the verdict says so, and no wear coefficient is fitted to it."""
    found = pf.compare(result_folders / "pressed", result_folders / "stuck")
    assert found["verdict"].startswith("Nothing wore off between the two runs.")
    worn = pf.compare(result_folders / "pressed", result_folders / "worn")
    assert worn["verdict"].startswith("Worn depth ")
    x = np.arange(1271) * 10.0
    z = np.random.default_rng(20300115).normal(size=x.size)
    traces = tmp_path / "a.csv", tmp_path / "b.csv"
    for path, depth in zip(traces, (0.0, 6.0), strict=True):
        heights = z - depth * (np.abs(x - 6350.0) < 3000.0)
        rows = "".join(f"{a},{b:.4f}\n" for a, b in zip(x, heights))
        path.write_text("x [um],z [um]\n" + rows)
    answer = run_cli("compare", *traces, "--predicted", result_folders / "stuck")
    assert answer.code == 2 and "stuck: nothing wore off in this run" in answer.err


@pytest.mark.parametrize(
    "names, told",
    [
        (("worn", "half"), "half; give the less worn run as the first folder"),
        (
            ("half", "pressed"),
            "pressed: this run has no [wear], so nothing wore off; give the run with "
            "[wear] as the second folder",
        ),
        (("other", "worn"), "worn: these are two different patches: contact.tilt differ"),
        (("pressed", "point"), "point: a run without [contact] has no surfaces to compare"),
        (("pressed", "nowhere"), "nowhere: no such results folder"),
        (("empty", "worn"), "empty: this is not a results folder"),
        (("file.csv", "worn"), "file.csv: a file, while"),
    ],
)
def test_refuses_invalid_result_folders(result_folders, tmp_path, names, told):
    """A missing folder, a folder without wear and a damaged folder are refused by name."""
    (result_folders / "empty").mkdir(exist_ok=True)
    (result_folders / "file.csv").write_text("x [um],z [um]\n0,0\n1,1\n")
    answer = run_cli("compare", *(result_folders / name for name in names), "-o", tmp_path / "out")
    assert answer.code == (4 if "nowhere" in names else 2)
    assert told in answer.err
    assert "Traceback" not in answer.err
    assert not (tmp_path / "out").exists()
