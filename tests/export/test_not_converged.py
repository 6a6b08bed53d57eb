"""Runs that do not converge: the results of the pressed patch are stored and marked, or no folder is written."""

import pytest
from command_line import read_json, read_page, run_cli
from scene_texts import MODE, PLASTIC, POINT, SMALL_PATCH

import patchfem as pf

# At resonance, neither damping nor friction limits an undamped mode that slips, so that a curve from there has no start.
UNBOUNDED = {
    "structure.mode.axial.damping": 0,
    "accuracy.method": "harmonic",
    "friction.law": "nonlocal",
    "friction.bond_length": "1 mm",
}
SETTINGS = [f"--set={key}={value}" for key, value in UNBOUNDED.items()]
SWEEP = """[drive]
kind = "base"
waveform = "sweep"
acceleration = "30 g"
from = "143 Hz"
to = "160 Hz"
rate = "80 Hz/s"
"""


def test_exact_pressed_patch_is_stored_as_not_converged(tmp_path):
    """A rig that does not converge stores the results of its pressed patch, marked as not converged.

    The exit code is 3, and the exception in Python carries the same results.
    """
    scene = tmp_path / "rig.toml"
    folder = tmp_path / "out"
    scene.write_text(SMALL_PATCH + PLASTIC + MODE + SWEEP)
    answer = run_cli("run", scene, "-o", folder, *SETTINGS)
    assert (
        answer.code == 3 and "grows for ever" in answer.err and f"results: {folder}" in answer.out
    )
    summary = read_json(folder / "summary.json")
    assert summary["outcome"] == "not_converged" and summary["kind"] == "rig"
    assert (
        "grows for ever" in summary["warnings"][0] and str(tmp_path) not in summary["warnings"][0]
    )
    assert any("those of the pressed patch at rest" in entry for entry in summary["warnings"])
    pressed = pf.run(SMALL_PATCH)
    assert summary["measures"].keys() == pressed.measures.keys()
    for name, entry in summary["measures"].items():
        assert entry["value"] == pytest.approx(pressed.measures[name].value, rel=1e-12, abs=1e-18)
    assert {"fields.vtkhdf", "result.nc", "report.html"} <= {
        entry.name for entry in folder.iterdir()
    }
    assert "not_converged" in read_page(folder)
    with pytest.raises(
        pf.NotConverged, match="grows for ever"
    ) as raised:  # Python raises NotConverged with the same partial results
        pf.run(scene, **UNBOUNDED)
    assert raised.value.partial_result.outcome == "not_converged"


def test_exact_unconverged_rig_without_patch_has_no_folder(tmp_path):
    """A rig without a patch that does not converge prints one line, which states that there is no results folder."""
    scene = tmp_path / "rig.toml"
    folder = tmp_path / "out"
    scene.write_text(POINT + PLASTIC + MODE + SWEEP)
    answer = run_cli("run", scene, "-o", folder, *SETTINGS)
    assert answer.code == 3 and answer.out == "" and len(answer.err.strip().splitlines()) == 1
    assert "grows for ever" in answer.err and "so there is no results folder" in answer.err
    assert not folder.exists() and not (tmp_path / "out.partial").exists()
