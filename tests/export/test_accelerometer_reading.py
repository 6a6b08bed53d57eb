"""Reading of an accelerometer on the page of a run, and the rules of its keys."""

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


def load_scene(tmp_path, *settings):
    """Return the scene of an oscillator with a measured row and the given settings."""
    header = "frequency [Hz],input [g],acceleration [g],displacement [mil]\n"
    (tmp_path / "rows.csv").write_text(f"{header}143,1,10,5\n", "utf-8")
    (tmp_path / "scene.toml").write_text(LINEAR, "utf-8")
    return load(tmp_path / "scene.toml", settings)


def test_exact_rms_reading_of_sine(tmp_path):
    """The rms reading of a sine is its peak over sqrt(2), only in the row of the measured data."""
    peak_run, rms_run = (
        run(load_scene(tmp_path, *sets)) for sets in ((), ("measured.reading=rms",))
    )
    assert (
        rms_run.measures["absolute_acceleration_peak"].value
        == peak_run.measures["absolute_acceleration_peak"].value
    )
    data = collect_run_data(rms_run).measured
    assert data.reading_factor == pytest.approx(np.sqrt(0.5), rel=1e-5)
    assert collect_run_data(peak_run).measured.reading_factor == 1
    peak = peak_run.measures["absolute_acceleration_peak"].value / 9.80665
    assert f"{1.5 * np.sqrt(0.5) * peak:.3g} g" in run_page(rms_run)
    assert f"{1.5 * peak:.3g} g" in run_page(peak_run)


def test_exact_displacement_gauge_has_own_factor(tmp_path):
    """The displacement in the measured row is multiplied by its own factor, as the page states."""
    result = run(load_scene(tmp_path, "measured.displacement_gain=0.8"))
    displacement = result.measures["relative_displacement_amplitude"].value / 25.4e-6
    assert f"<td>{0.8 * displacement:.3g} mil</td>" in run_page(result).replace(" class=n", "")
    assert "(computed displacement multiplied by the reading factor 0.8)" in run_page(result)


@pytest.mark.parametrize(
    "settings, message",
    [
        (("measured.reading=lowpass",), "measured.reading_cutoff: missing"),
        (("measured.reading=mean",), "one of peak, fundamental, rms, lowpass"),
    ],
)
def test_refuses_unknown_reading_or_missing_cutoff(tmp_path, settings, message):
    """An unknown reading, or a low-pass reading without a cutoff, is refused with its key."""
    with pytest.raises(SceneError) as caught:
        load_scene(tmp_path, *settings)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "settings, message",
    [
        (("measured.reading_cutoff=600 Hz",), "has no meaning for reading 'peak'"),
        (("measured.reading=rms", "drive.waveform=step"), "has a meaning only under a sine drive"),
    ],
)
def test_always_ineffective_reading_key_has_remark(tmp_path, settings, message):
    """A key of the reading that has no effect leads to a remark."""
    assert any(message in remark for remark in load_scene(tmp_path, *settings).remarks)
