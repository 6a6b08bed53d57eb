"""Answer and page of a sweep: sentences, quantities and charts agree with sweep.csv."""

import shutil

import h5py
import numpy as np
import pytest
import xarray as xr
from command_line import read_json, read_page, run_cli, run_successfully
from page_data import find_wrong_numbers, read_figures, read_measures, read_tiles
from scene_texts import COULOMB, PATCH, POINT, SHORT, STRUCTURE
from sweep_tables import read_rows

import patchfem as pf
from patchfem.export import store
from patchfem.export.charts.sweeps import make_measure_panel, make_relative
from patchfem.export.rows import CHARTS

KINDS = {
    "one key": ("rig", ("--over", "friction.static=0.3,0.35,0.6,0.1")),
    "two keys": (
        "rig",
        ("--over", "friction.static=0.1..0.6:4", "--over", "drive.acceleration=1 g..5 g:3"),
    ),
    "random": (
        "rig",
        (
            "--over",
            "friction.static=0.1..0.5",
            "--over",
            "normal.load=50 N..200 N",
            "--sobol",
            "64",
        ),
    ),
    "frequency": ("rig", ("--over", "drive.frequency=120 Hz..170 Hz:11")),
    "patch": ("patch", ("--over", "contact.tilt.angle=1e-6 rad..1e-3 rad:7")),
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Return the folder of a sweep of each kind."""
    root = tmp_path_factory.mktemp("sweeps")
    (root / "rig.toml").write_text(POINT + COULOMB + SHORT, encoding="utf-8")
    patch = PATCH + "[accuracy]\ntolerance = 1e-2\n"
    (root / "patch.toml").write_text(patch, encoding="utf-8")
    found = {}
    for kind, (scene, words) in KINDS.items():
        found[kind] = root / kind.replace(" ", "_")
        run_successfully("sweep", root / f"{scene}.toml", *words, "-o", found[kind])
    return found


def read_menu(path) -> dict[str, list]:
    """Return the traces of each choice of the menu of measures on a page."""
    (figure,) = [
        figure
        for figure in read_figures(path.read_text("utf-8"))
        if "updatemenus" in figure["layout"]
        and figure["data"][0].get("mode", "").endswith("markers")
    ]
    choices = {}
    for button in figure["layout"]["updatemenus"][0]["buttons"]:
        shown = zip(figure["data"], button["args"][0]["visible"], strict=True)
        choices[button["label"]] = [trace for trace, is_shown in shown if is_shown]
    return choices


@pytest.mark.parametrize("kind", KINDS)
def test_exact_verdict_is_short(folders, kind):
    """The headline has at most 30 words for each main measure, the verdict at most four sentences, as in sweep.json."""
    answer = store.read_answer(folders[kind])
    for clause in answer.verdict[0].split("; "):
        assert len(clause.split()) <= 30
    assert 2 <= len(answer.verdict) <= 4
    assert answer.details["sentences"] == list(answer.verdict)
    assert answer.details["answer"] == answer.verdict[0]


def read_shown_number(row: dict[str, str], name: str) -> float:
    """Return the number of a measure that a chart shows for a row of sweep.csv; NaN without one."""
    steady, error = (row.get(f"{name}_steady{part}", "") for part in ("", "_error"))
    is_settled = row["outcome"] in ("steady", "stuck", "done", "no_contact")
    if not is_settled and steady and error and float(error) <= 0.5 * abs(float(steady)):
        return float(steady)
    return float(row[name] or "nan")


@pytest.mark.parametrize("kind", KINDS)
def test_exact_page_shows_numbers_of_table(folders, kind):
    """The values that the menu of the page draws are those of sweep.csv for every measure, in single precision.

    Where a case did not settle, they are those of the steady estimate if its error is at most half of it.
    """
    rows = read_rows(folders[kind])
    answer = store.read_answer(folders[kind])
    n_checked = 0
    for label, traces in read_menu(folders[kind] / "report.html").items():
        name = label.replace(" ", "_")
        drawn = np.concatenate([np.asarray(trace["y"], float) for trace in traces])
        cells = np.array([float(row[name] or "nan") for row in rows])
        values = answer.data[name].values.ravel()
        np.testing.assert_array_equal(np.sort(values), np.sort(cells))
        shown = [read_shown_number(row, name) for row in rows]
        scale = np.nanmax(np.abs(drawn)) / (np.nanmax(np.abs(shown)) or 1.0) or 1.0
        expected = np.sort((np.array(shown) * scale).astype(np.float32))
        round_off = 1e-12 * np.nanmax(np.abs(drawn))
        np.testing.assert_allclose(np.sort(drawn), expected, rtol=3e-7, atol=round_off)
        n_checked += 1
    assert n_checked == sum(
        np.isfinite(answer.data[name].values).any()
        for name in answer.data
        if f"{name}_error" in answer.data
    )


@pytest.mark.parametrize("kind", KINDS)
def test_exact_tiles_and_measures_of_page_equal_summary(folders, kind):
    """Every number among the tiles and measures of the page is that of summary.json."""
    page = read_page(folders[kind])
    quantities = read_json(folders[kind] / "summary.json")["measures"]
    tiles = {label.replace(" ", "_"): text for label, text in read_tiles(page).items()}
    texts = read_measures(page)
    assert tiles and texts
    assert find_wrong_numbers(tiles, quantities, 5e-3) == []
    assert find_wrong_numbers(texts, quantities, 5e-3) == []


def test_exact_numbers_of_verdict_agree_with_closed_form(folders):
    """The headline of a patch has its values, and the limit of the tilt is in sentence, table and quantities."""
    answer = store.read_answer(folders["patch"])
    limits = {row["measure"]: row for row in answer.details["limits"]}
    row = limits["contact_fraction"]
    assert row["low"] < row["value"] < row["high"] and row["unit"] == "rad"
    assert answer.quantities["limit_contact_fraction"].value == row["value"]
    assert (
        f"{row['value'] * 1e6:.3g} urad before contact fraction changes by 5 %" in answer.verdict[1]
    )
    text = read_page(folders["patch"])
    assert "How far the key may go" in text and "contact fraction" in text
    values = answer.data["pressure_peak"].values
    assert f"{values[-1] / 1e6:.4g} MPa" in answer.verdict[0]


def test_exact_page_of_two_sweeps_shows_measures_of_each(folders, tmp_path):
    """A measure is drawn for the sweeps that have values of it; one that sweeps a key of this name once ended in a fault."""
    shutil.copytree(folders["random"], tmp_path / "random")
    path = tmp_path / "random/sweep.nc"
    with h5py.File(path, "r+") as file:
        file["loop_area"][...] = np.nan
    page = tmp_path / "both.html"
    run_successfully("report", tmp_path / "random", folders["one key"], "-o", page)

    drawn = {name: [trace["name"] for trace in traces] for name, traces in read_menu(page).items()}
    assert drawn["relative displacement amplitude"] == ["random", "one_key"]
    assert drawn["normal load"] == drawn["loop area"] == ["one_key"]
    with (
        xr.open_dataset(path) as data,
        pytest.raises(pf.PatchfemError, match="no measure 'loop_area'"),
    ):
        pf.plot.sweep(data, "loop_area")


def test_refuses_sweep_without_arrays(folders, tmp_path):
    """A folder of a sweep whose sweep.nc is missing is refused; its page once ended in an internal fault."""
    folder = shutil.copytree(folders["one key"], tmp_path / "sweep")
    (folder / "sweep.nc").unlink()
    answer = run_cli("report", folder)
    assert answer.code == 2 and "a file of this folder is damaged" in answer.err
    assert "sweep.nc" in answer.err and len(answer.err.splitlines()) == 1


def test_exact_sweep_of_one_case_has_no_plural(folders, tmp_path):
    """A sweep of a single case says that this case settled; once the sentence began with "All 1 cases"."""
    scene = folders["one key"].parent / "rig.toml"
    out = tmp_path / "out"
    run_successfully("sweep", scene, "--over", "friction.static=0.35", "-o", out)
    assert store.read_answer(out).verdict == (
        "Only one case has a result, so that no change is known.",
        "The only case settled and meets the tolerance.",
    )


def test_exact_plot_of_a_selected_value_is_its_line(folders):
    """The plot of a sweep of two keys at a value of one key has the values there; it once ended in a fault."""
    with xr.open_dataset(folders["two keys"] / "sweep.nc") as data:
        line = data.isel(drive_acceleration=1)
        drawn = pf.plot.sweep(line, "loop_area").get_lines()[0]
        expected = (
            line.friction_static.values,
            line.loop_area.values / line.loop_area.values.max(),
        )
        np.testing.assert_allclose(drawn.get_xdata(), expected[0])
        np.testing.assert_allclose(drawn.get_ydata() / drawn.get_ydata().max(), expected[1])
        with pytest.raises(pf.PatchfemError, match="a single case"):
            pf.plot.sweep(line.isel(friction_static=0), "loop_area")


def test_exact_charts_show_steady_estimates_and_no_ratio_to_round_off(tmp_path):
    """Cases that did not settle show their steady estimate, and a measure that is 0 in the first case has no ratio to it.

    Its round-off, such as 1e-25 m of a contact that sticks, once gave ratios of 1e22.
    """
    scene = POINT + COULOMB + STRUCTURE
    data = pf.sweep(scene, {"drive.acceleration": "3 g..8 g:2"}, out=tmp_path / "sweep")
    answer = store.read_answer(tmp_path / "sweep")
    chart = next(one for one in CHARTS["sweep"] if one.style == "relative")
    drawn = make_relative({"": answer}, chart)
    assert "relative displacement amplitude" not in [curve.name for curve in drawn.curves]
    assert all(np.nanmax(curve.y) < 1e3 for curve in drawn.curves)

    panel = make_measure_panel({"": answer}, "relative_displacement_amplitude")
    (curve,) = panel.curves
    values, steady = (
        data[f"relative_displacement_amplitude{part}"].values for part in ("", "_steady")
    )
    is_settled = np.isin(data["outcome"].values, ("steady", "stuck"))
    assert 0 < np.count_nonzero(is_settled) < is_settled.size
    expected = np.where(is_settled, values, steady) * panel.y.scale
    np.testing.assert_allclose(curve.y, expected, rtol=1e-12, atol=1e-9)
    assert (curve.symbols == np.where(is_settled, "circle", "x")).all()
