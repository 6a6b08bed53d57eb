"""`patchfem backbone`: printed answer, files and error messages."""

import csv
import json

import pytest
import xarray as xr
from scene_texts import IWAN, make_shaken_block

from patchfem import formatting
from patchfem.__main__ import main

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
    values = ("frequency", "damping", "force")
    columns = {"amplitude", "force_frequency", *values, *(f"{name}_error" for name in values)}
    assert set(curve) == columns
    assert curve["amplitude"] == pytest.approx([1e-5, 1e-4, 1e-3], rel=1e-9)
    folder = scene_folder / "out" / "joint-backbone"
    head, *rows = csv.reader((folder / "backbone.csv").read_text("utf-8").splitlines())
    assert head[: len(COLUMNS)] == COLUMNS and [float(row[2]) for row in rows] == curve["frequency"]
    with xr.open_dataset(folder / "backbone.nc") as data:
        assert data["quasi_static_damping"].values.tolist() == curve["damping"]
        assert data.attrs["stuck_frequency"] == answer["stuck_frequency"]
    assert json.loads((folder / "backbone.json").read_text("utf-8")) == answer
    headline = json.loads((folder / "summary.json").read_text("utf-8"))["verdict"][0]
    page = (folder / "report.html").read_text("utf-8")
    assert headline in page
    for name, unit in (("frequency", "Hz"), ("damping", "")):
        for k in (0, -1):
            error = curve[f"{name}_error"][k]
            assert formatting.format_value(curve[name][k], error, unit=unit) in headline
