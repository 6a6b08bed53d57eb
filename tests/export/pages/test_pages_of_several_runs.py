"""Comparison of several runs on one page, with differences that exceed both errors marked."""

import re

import numpy as np
import pytest
from page_data import read_charts, read_page_data

import patchfem as pf
from patchfem.core import Measure, PatchfemError
from patchfem.export import write_json
from patchfem.export.netcdf import run_contents, write_netcdf
from patchfem.export.pages.several_runs import page_html, read_run
from patchfem.export.summary import make_summary

SCENE = """[normal]
load = "{load} N"
[drive]
frequency = "100 Hz"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
"""
LEVELS = """[normal]
load = "100 N"
[friction]
law = "coulomb"
static = 0.3
[structure]
moving_mass = "10 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.01
slide = 1
[drive]
kind = "{kind}"
waveform = "levels"
levels = ["{first} {unit}", "{last} {unit}"]
frequency = "143 Hz"
cycles = 10
"""


def write_run_folder(folder, load: float, amplitude: float, error: float):
    """Write a results folder of a sine of 100 Hz with 30 cycles of 50 samples, and return it."""
    folder.mkdir()
    measures = {
        "relative_displacement_amplitude": Measure(amplitude, "m", error, 0.0),
        "normal_load": Measure(load, "N", 0.0, 0.0),
    }
    write_json(
        make_summary("0", "", "rig", "steady", measures, [], [], ((), ()), {"total": 1.0}),
        folder / "summary.json",
    )
    (folder / "scene.resolved.toml").write_text(SCENE.format(load=load))
    time = np.linspace(0.0, 0.3, 1501)
    displacement = amplitude * np.sin(2 * np.pi * 100 * time)
    write_netcdf(
        run_contents(
            {
                "time": time,
                "relative_displacement": displacement,
                "friction_force": -load * np.sign(displacement),
            },
            None,
            {},
            None,
            None,
        ),
        folder / "result.nc",
    )
    return folder


def test_exact_page_compares_two_runs(tmp_path):
    """The page of two runs shows the keys and measures that differ, and the last two cycles of the displacement."""
    runs = [
        read_run(write_run_folder(tmp_path / "light", 10.0, 2e-6, 1e-9)),
        read_run(write_run_folder(tmp_path / "<b>heavy", 20.0, 1e-6, 1e-9)),
    ]
    text = page_html(runs)
    assert "<b>heavy" not in text and "&lt;b&gt;heavy" in text
    rows = re.search(r'<section id="scenes">.*?<tbody>(.*?)</tbody>', text, re.S)[1]
    assert re.findall(r"<tr><td>(.*?)</td>", rows) == ["normal.load"]
    assert "<b class=v>1.0000 ± 0.0010 um</b> <span class=v>(-50.00%)</span>" in text
    history = read_charts(text)["Displacement", "displacement"]
    assert history["x"]["unit"] == "ms" and history["y"]["unit"] == "um"
    assert [mark["name"] for mark in history["marks"]] == ["light", "<b>heavy"]
    for mark, size in zip(history["marks"], (2.0, 1.0)):
        assert mark["x"][0] == pytest.approx(-20.0, abs=1e-6) and mark["x"][-1] == 0.0
        np.testing.assert_allclose(
            mark["y"], size * np.sin(2 * np.pi * 0.1 * np.array(mark["x"])), atol=1e-8
        )


def test_always_change_within_errors_is_not_marked(tmp_path):
    """A difference of two runs within both errors is not marked."""
    text = page_html(
        [
            read_run(write_run_folder(tmp_path / "a", 10.0, 2e-6, 3e-8)),
            read_run(write_run_folder(tmp_path / "b", 10.0, 2.05e-6, 3e-8)),
        ]
    )
    assert "There is no difference: the resolved scenes" in text
    assert "<b>2." not in text
    assert "(+2" not in text


@pytest.mark.share(0, 3, 6)
@pytest.mark.parametrize(
    "value, first, error, change",
    [
        (2.1e-6, 1e-12, 2e-12, "&ndash;"),
        (2.1e-6, 0.0, 0.0, "&ndash;"),
        (2.1e-6, 1e-12, 1e-13, "&times; 2100000"),
        (-3e-6, 1e-7, 0.0, "&times; -30"),
        (15.3e-6, 1e-7, 0.0, "&times; 150"),
        (1.5e-6, 1e-6, 0.0, "+50.00%"),
        (-1.5e-6, -1e-6, 0.0, "-50.00%"),
    ],
)
def test_exact_change_is_percentage_or_factor(tmp_path, value, first, error, change):
    """A change is given in per cent, or as a factor from 10 upwards.

    It is left out if the first value is 0 within its error.
    """
    text = page_html(
        [
            read_run(write_run_folder(tmp_path / "a", 10.0, first, error)),
            read_run(write_run_folder(tmp_path / "b", 10.0, value, 1e-10)),
        ]
    )
    assert f"</b> <span class=v>({change})</span>" in text


def test_always_levels_of_different_units_have_separate_charts(tmp_path):
    """Levels in m/s^2 and in N have separate charts, because an axis has one unit.

    A base acceleration of 5 m/s^2 acts on 10 kg as a force of 50 N.
    """
    drives = (("base", 5, 10, "m/s^2"), ("force", 50, 100, "N"), ("force", 40, 80, "N"))
    runs = []
    for number, (kind, first, last, unit) in enumerate(drives):
        title = "'" * (100 + number)
        scene = f'title = "{title}"\n' + LEVELS.format(kind=kind, first=first, last=last, unit=unit)
        pf.run(scene).save(tmp_path / f"run{number}")
        runs.append(read_run(tmp_path / f"run{number}"))
    html = page_html(runs)
    charts = read_page_data(html)["charts"]
    assert len({chart["anchor"] for chart in charts}) == len(charts)
    onset = re.search(r"<tr>(?:(?!</tr>).)*onset level.*?</tr>", html, re.S)[0]
    assert onset.count(" N</span>") == 2 and "%" not in onset and "&times;" not in onset
    assert "5.0 m/s^2, 10.0 m/s^2<" in html
    # a long text is shortened before its characters become HTML entities
    assert "&#x27;" * 76 + " …" in html
    levels = [chart for chart in charts if chart["title"] == "Levels"]
    assert [chart["x"]["unit"] for chart in levels] == ["g", "N"]
    accelerations, forces = levels
    assert [chart["name"] for chart in accelerations["marks"]] == ["run0"]
    assert [chart["name"] for chart in forces["marks"]] == ["run1", "run2"]
    assert accelerations["marks"][0]["x"] == pytest.approx([5 / 9.80665, 10 / 9.80665])
    assert forces["marks"][0]["x"] == [50, 100] and forces["marks"][1]["x"] == [40, 80]
    np.testing.assert_allclose(accelerations["marks"][0]["y"], forces["marks"][0]["y"], rtol=1e-6)


def test_refuses_folder_without_readable_results(tmp_path):
    """A folder whose summary, scene or result.nc is missing or unreadable is refused by the name of the file."""
    with pytest.raises(PatchfemError, match=r"not a results folder: it has no summary\.json"):
        read_run(tmp_path)
    (tmp_path / "summary.json").write_text("{")
    with pytest.raises(PatchfemError, match="cannot be read"):
        read_run(tmp_path)
    folder = write_run_folder(tmp_path / "good", 1.0, 1e-6, 0.0)
    (folder / "scene.resolved.toml").write_text("drive = 3")
    with pytest.raises(PatchfemError, match=r"scene\.resolved\.toml: drive is not a table"):
        read_run(folder)
    (folder / "scene.resolved.toml").write_text(SCENE.format(load=1.0))
    (folder / "result.nc").write_bytes(b"nothing")
    with pytest.raises(PatchfemError, match=r"result\.nc: cannot be read as netCDF"):
        read_run(folder)


@pytest.mark.parametrize(
    "text, reason",
    [
        ("[" * 100_000, "recursion limit exceeded"),
        ("[]", "should be an object"),
        ("{}", "kind: Field required"),
        (
            '{"kind": "rig", "outcome": "steady", "seconds": {"total": 1}, "measures": {"loop_area": 3}}',
            r"measures\.loop_area",
        ),
        (
            '{"kind": "rig", "outcome": "steady", "seconds": {"total": 1}, "measures": {"loop_area": {"value": "1.0", '
            '"unit": "J", "error": null, "floor": 0}}}',
            r"measures\.loop_area\.value: Input should be a valid number",
        ),
        ("3", "should be an object"),
    ],
)
def test_refuses_summary_of_wrong_structure(tmp_path, text, reason):
    """A summary.json of a wrong structure is refused with the faulty field.

    Earlier `report` ended with an internal fault.
    """
    (tmp_path / "summary.json").write_text(text)
    with pytest.raises(
        PatchfemError, match=f"cannot be read: summary.json is not a summary of a run: .*{reason}"
    ):
        read_run(tmp_path)
