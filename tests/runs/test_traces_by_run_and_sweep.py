"""A rough measured profile gives the same results by run and by sweep, in the measures and in the
fields."""

import numpy as np
import pytest
from command_line import read_json, run_cli

import patchfem as pf

LENGTH, SAMPLES = 1e-3, 201
SCENE = """\
[contact]
length = "1 mm"
width = "4 mm"
height = "1 mm"
load = "20 N"
substrate = "steel"
[contact.tilt]
angle = "50 urad"
[contact.profile]
file = "trace.csv"
[accuracy]
tolerance = 1e-1
"""


@pytest.fixture(scope="module")
def rough_scene(tmp_path_factory):
    """Return a scene with a profile of waves and noise of 50 nm, which no affordable mesh resolves."""
    folder = tmp_path_factory.mktemp("rough")
    x = np.linspace(-LENGTH / 2, LENGTH / 2, SAMPLES)
    noise = np.random.default_rng(5).standard_normal(SAMPLES)
    z = 0.2e-6 * np.sin(2 * np.pi * x / 0.7e-3) + 50e-9 * noise
    rows = "\n".join(f"{a * 1e3:.5f},{b * 1e6:.6f}" for a, b in zip(x, z))
    (folder / "trace.csv").write_text(f"x [mm],z [um]\n{rows}\n")
    (folder / "scene.toml").write_text(SCENE)
    return folder / "scene.toml"


@pytest.mark.long
def test_exact_sweep_of_rough_profile_agrees_with_run(rough_scene):
    """The measures and errors of a sweep agree with those of the run. On a mesh shared by all cases
    the peak was less than half of that of the run."""
    sweep = pf.sweep(rough_scene, {"contact.load": ["20 N", "30 N"]})
    for name, measure in pf.run(rough_scene).measures.items():
        assert float(sweep[name][0]) == pytest.approx(measure.value, rel=1e-9, abs=measure.floor), (
            name
        )
        assert float(sweep[f"{name}_error"][0]) == pytest.approx(
            measure.error, rel=1e-6, abs=measure.floor
        ), name


def test_always_unresolved_contact_is_not_converged(tmp_path):
    """A contact much narrower than its elements has the outcome not_converged, in a run and in a
    sweep."""
    text = (
        SCENE.split("[contact.tilt]")[0]
        .replace("20 N", "1 N")
        .replace('length = "1 mm"', 'length = "2 mm"')
        + """\
element_size = "0.2 mm"
[contact.crown]
radius = "2 mm"
"""
    )
    (tmp_path / "scene.toml").write_text(text)
    answer = run_cli("run", tmp_path / "scene.toml", "-o", tmp_path / "out", "--no-page")
    summary = read_json(tmp_path / "out/summary.json")
    assert (answer.code, summary["outcome"]) == (3, "not_converged")
    assert "are as large as the values; use the other measures" in answer.out
    assert any("at least its value" in text for text in summary["warnings"])
