"""The reading of the accelerometer on the page of a run, and the rules of its keys."""

import numpy as np
import pytest

from patchfem import SceneError, run
from patchfem.export.page_data import collect_run_data
from patchfem.export.report import run_page
from patchfem.scene import load

LINEAR = """
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "140 Hz"
damping = 0.05
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "1 g"
cycles = 200
[measured]
file = "rows.csv"
acceleration_gain = 1.5
"""


def scene_of(tmp_path, *sets):
    head = "frequency [Hz],input [g],acceleration [g],displacement [mil]\n"
    (tmp_path / "rows.csv").write_text(f"{head}143,1,10,5\n", "utf-8")
    (tmp_path / "scene.toml").write_text(LINEAR, "utf-8")
    return load(tmp_path / "scene.toml", sets)


def test_exact_a_sine_reads_as_its_effective_value(tmp_path):
    """A sine's rms is its peak over the root of two, beside the measured row and nowhere else."""
    plain, read = (run(scene_of(tmp_path, *sets)) for sets in ((), ("measured.reading=rms",)))
    assert (
        read.measures["absolute_acceleration_peak"].value
        == plain.measures["absolute_acceleration_peak"].value
    )
    data = collect_run_data(read).measured
    assert data.share == pytest.approx(np.sqrt(0.5), rel=1e-5)
    assert collect_run_data(plain).measured.share == 1
    peak = plain.measures["absolute_acceleration_peak"].value / 9.80665
    assert f"{1.5 * np.sqrt(0.5) * peak:.3g} g" in run_page(read, {})
    assert f"{1.5 * peak:.3g} g" in run_page(plain, {})


def test_exact_the_gauge_has_a_factor_of_its_own(tmp_path):
    found = run(scene_of(tmp_path, "measured.displacement_gain=0.8"))
    seen = found.measures["relative_displacement_amplitude"].value / 25.4e-6
    assert f"<td>{0.8 * seen:.3g} mil</td>" in run_page(found, {}).replace(" class=n", "")
    assert "(computed displacement multiplied by the reading factor 0.8)" in run_page(found, {})


def test_a_reading_is_an_effect_beside_its_rows(tmp_path):
    named = scene_of(tmp_path, "measured.reading=fundamental").effect_names()
    assert named[-2:] == ["measured", "measured.reading=fundamental"]
    assert scene_of(tmp_path).effect_names()[-1] == "measured"


@pytest.mark.parametrize(
    "sets, said",
    [
        (("measured.reading=lowpass",), "measured.reading_cutoff: missing"),
        (("measured.reading=mean",), "one of peak, fundamental, rms, lowpass"),
    ],
)
def test_refuses_a_reading_that_is_none_or_lacks_its_cutoff(tmp_path, sets, said):
    with pytest.raises(SceneError) as caught:
        scene_of(tmp_path, *sets)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "sets, said",
    [
        (("measured.reading_cutoff=600 Hz",), "has no meaning for reading 'peak'"),
        (("measured.reading=rms", "drive.waveform=step"), "has a meaning only under a sine drive"),
    ],
)
def test_a_reading_without_meaning_is_remarked(tmp_path, sets, said):
    assert any(said in remark for remark in scene_of(tmp_path, *sets).remarks)
