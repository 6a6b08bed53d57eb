"""A run whose motion does not converge: what was pressed before is kept and marked, exit code 3; else the line says
that there is no folder."""

import json

import pytest
from command_line import cli
from scene_texts import DRIVE, MODE, PLASTIC, POINT, SMALL_PATCH

import patchfem as pf

# nothing bounds an undamped mode at its own frequency that friction lets go
UNBOUNDED = (
    "--set",
    "structure.mode.axial.damping=0",
    "--set",
    "drive.acceleration=30 g",
    "--set",
    "accuracy.method=harmonic",
    "--set",
    "accuracy.harmonics=5",
)


def test_exact_the_pressed_patch_is_kept_and_marked(tmp_path):
    scene = tmp_path / "rig.toml"
    out = tmp_path / "out"
    scene.write_text(SMALL_PATCH + PLASTIC + MODE + DRIVE)
    answer = cli("run", scene, "-o", out, *UNBOUNDED)
    assert answer.code == 3 and "undamped mode" in answer.err and f"results: {out}" in answer.out
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert summary["outcome"] == "not_converged" and summary["kind"] == "rig"
    assert "undamped mode" in summary["warnings"][0] and str(tmp_path) not in summary["warnings"][0]
    assert "those of the pressed patch at rest" in summary["warnings"][1]
    alone = pf.run(SMALL_PATCH)
    assert summary["measures"].keys() == alone.measures.keys()
    for name, one in summary["measures"].items():
        assert one["value"] == pytest.approx(alone.measures[name].value, rel=1e-12, abs=1e-18)
    assert {"fields.vtkhdf", "result.nc", "report.html"} <= {one.name for one in out.iterdir()}
    assert "not_converged" in (out / "report.html").read_text("utf-8")
    with pytest.raises(
        pf.NotConverged, match="undamped mode"
    ) as raised:  # Python is told as before
        pf.run(
            scene,
            **{key: value for key, _, value in (one.partition("=") for one in UNBOUNDED[1::2])},
        )
    assert raised.value.partial_result.outcome == "not_converged"


def test_exact_where_nothing_was_computed_before_the_line_says_so(tmp_path):
    scene = tmp_path / "rig.toml"
    out = tmp_path / "out"
    scene.write_text(POINT + PLASTIC + MODE + DRIVE)
    answer = cli("run", scene, "-o", out, *UNBOUNDED)
    assert answer.code == 3 and answer.out == "" and len(answer.err.strip().splitlines()) == 1
    assert "undamped mode" in answer.err and "so there is no results folder" in answer.err
    assert not out.exists() and not (tmp_path / "out.partial").exists()
