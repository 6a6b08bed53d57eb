"""`patchfem backbone`: printed answer, files and error messages."""

import csv
import json

import numpy as np
import pytest
import xarray as xr
from scene_texts import IWAN, make_shaken_block

from patchfem import formatting
from patchfem.__main__ import main
from patchfem.campaigns import Backbone, Curve
from patchfem.campaigns.backbone.records import LossExponents, ModeFrequencies
from patchfem.export import backbone_charts
from patchfem.export.backbone import page_html

COLUMNS = [
    "method",
    "amplitude [m]",
    "frequency [Hz]",
    "frequency_error [Hz]",
    "damping",
    "damping_error",
]


@pytest.fixture
def scene_folder(tmp_path, monkeypatch):
    """Return the working folder with the scene of a joint."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "joint.toml").write_text(make_shaken_block(IWAN), "utf-8")
    return tmp_path


def run_command(*words) -> int:
    """Run the command line and return its exit code."""
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code or 0


def test_exact_backbone_files_agree_with_answer(scene_folder, capsys):
    """JSON, CSV, netCDF and report of a backbone contain the same frequencies and damping ratios."""
    assert (
        run_command(
            "backbone",
            "joint.toml",
            "--amplitudes",
            "10 um..1 mm:3",
            "--method",
            "quasi-static",
            "--json",
        )
        == 0
    )
    answer = json.loads(capsys.readouterr().out)
    assert set(answer) >= {
        "mode",
        "free_frequency",
        "stuck_frequency",
        "curves",
        "exponent",
        "flutter_amplitude",
    }
    curve = answer["curves"]["quasi-static"]
    assert set(curve) == {"amplitude", "frequency", "frequency_error", "damping", "damping_error"}
    assert curve["amplitude"] == pytest.approx([1e-5, 1e-4, 1e-3], rel=1e-9)
    folder = scene_folder / "out" / "joint-backbone"
    head, *rows = csv.reader((folder / "backbone.csv").read_text("utf-8").splitlines())
    assert head == COLUMNS and [float(row[2]) for row in rows] == curve["frequency"]
    with xr.open_dataset(folder / "backbone.nc") as data:
        assert data["quasi_static_damping"].values.tolist() == curve["damping"]
        assert data.attrs["stuck_frequency"] == answer["stuck_frequency"]
    assert json.loads((folder / "backbone.json").read_text("utf-8")) == answer
    page = (folder / "report.html").read_text("utf-8")
    assert "Frequency and damping against amplitude" in page
    ends = [
        f"{formatting.format_value(one['frequency'][k], one['frequency_error'][k], unit='Hz')}, damping ratio "
        f"{formatting.format_value(one['damping'][k], one['damping_error'][k])}"
        for one in [curve]
        for k in (0, -1)
    ]
    assert f"<div class=verdict><b>Mode axial at 10 um: {ends[0]}; at 1 mm: {ends[1]}.</b>" in page
    assert (folder / "backbone.svg").read_text("utf-8").startswith("<svg")


def test_always_screen_names_unknown_results(scene_folder, capsys):
    """The screen gives the natural frequency in a sentence, and the reason why the quasi-static curve is unknown."""
    rigid = (
        make_shaken_block(IWAN)
        .replace('"iwan"', '"coulomb"')
        .replace("chi = -0.5\nbeta = 0.5\n", "")
    )
    (scene_folder / "joint.toml").write_text(rigid.replace('stiffness = "20 kN/m"\n', ""), "utf-8")
    assert (
        run_command("backbone", "joint.toml", "--amplitudes", "2 mm,5 mm", "--no-page", "-q") == 0
    )
    shown = capsys.readouterr().out
    assert "\nThe natural frequency of mode axial is 100 Hz without the contact.\n" in shown
    assert "quasi-static: not known: " in shown
    assert not (scene_folder / "out" / "joint-backbone" / "report.html").exists()


def test_always_largest_damping_names_computed_amplitudes(scene_folder, capsys):
    """The largest damping ratio is printed with the number of computed amplitudes, and omitted for a single one."""
    for amplitudes, expected in (
        ("10 um..1 mm:3", "Among these 3 amplitudes the damping ratio is largest at "),
        ("10 um", ""),
    ):
        assert (
            run_command(
                "backbone",
                "joint.toml",
                "--amplitudes",
                amplitudes,
                "--method",
                "quasi-static",
                "--no-page",
                "-q",
                "-o",
                f"out{len(expected)}",
            )
            == 0
        )
        shown = capsys.readouterr().out
        assert expected in shown and ("largest" in shown) == bool(expected)


def test_exact_uncertain_frequency_is_omitted_from_chart():
    """A frequency of 3.6 +- 9.8 kHz appears in the table and not in the chart, whose axis it would stretch."""
    a = np.array([1e-6, 2e-6, 3e-6])
    unknown = np.full(3, np.nan)
    curve = Curve(
        a,
        np.array([100.0, 90.0, 3.6e3]),
        np.array([1.0, 1.0, 9.8e3]),
        np.array([1e-4, 2e-3, 0.28]),
        np.array([2e-4, 1e-4, 0.34]),
        unknown,
    )
    backbone = Backbone(
        "first", ModeFrequencies(50.0, 100.0), {"decay": curve}, {}, LossExponents(), None, ()
    )
    frequency, damping = backbone_charts(backbone.curves)
    assert [list(each["x"]) for each in frequency["marks"]] == [[1.0, 2.0]] * 2
    assert [list(each["x"]) for each in damping["marks"]] == [[1.0, 2.0, 3.0]] * 2
    # the bar of 1e-4 +- 2e-4 ends at a tenth of the smallest value on the logarithmic axis
    assert damping["y"]["log"] and damping["marks"][1]["floor"] == pytest.approx(1e-5)
    assert "9.8 kHz" in page_html(backbone, "") and "left out of the picture" in page_html(
        backbone, ""
    )
    page_without_frequency = page_html(backbone._replace(curves={"decay": curve.at(slice(2))}), "")
    assert "left out of the picture" not in page_without_frequency
