"""Frequency response curves over a sweep with default settings, with peaks narrower than a uniform
spacing of points."""

import numpy as np
import pytest

import patchfem as pf
from patchfem.runs.rig.steady import shooting

RIG = """
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
base = 0.9
output = 1.0
[[structure.mode]]
name = "rocking"
frequency = "73 Hz"
damping = 0.003
slide = 0.05
base = 0.1
output = 0.05
[drive]
kind = "base"
waveform = "sweep"
from = "60 Hz"
to = "210 Hz"
rate = "1 Hz/s"
acceleration = "0.1 g"
[accuracy]
method = "harmonic"
"""
ZETA, LEVEL = 0.003, 0.980665


def modal_sum(f):
    """Return the displacement: the sum over both modes of output base a/(omega_r^2 - omega^2 + 2 i zeta omega_r omega)."""
    w = 2 * np.pi * np.atleast_1d(f)[:, None]
    omega = 2 * np.pi * np.array([143.0, 73.0])
    modes = np.array([0.9, 0.005]) / (omega**2 - w**2 + 2j * ZETA * omega * w)
    return -LEVEL * np.sum(modes, axis=1)


def test_exact_linear_curve_agrees_with_modal_sum():
    """The curve without friction agrees with the modal sum at every point, and within 1 % between
    the points. The peak is output base a/(2 zeta omega^2)."""
    result = pf.run(RIG)
    curve = result.motion.steady.curve
    displacement = modal_sum(curve["frequency"])
    np.testing.assert_allclose(curve["amplitude"], np.abs(displacement), rtol=1e-12)
    acceleration = LEVEL - (2 * np.pi * curve["frequency"]) ** 2 * displacement
    for name in ("acceleration_peak", "acceleration_fundamental"):
        np.testing.assert_allclose(curve[name], np.abs(acceleration), rtol=1e-8)
    assert np.all(curve["acceleration_distortion"] <= curve["acceleration_distortion_error"])
    np.testing.assert_allclose(
        curve["multiplier"], np.exp(-ZETA * 2 * np.pi * 73 / curve["frequency"]), rtol=1e-9
    )
    frequencies = np.linspace(60, 210, 200001)
    between = np.interp(frequencies, curve["frequency"], curve["amplitude"])
    assert np.abs(between / np.abs(modal_sum(frequencies)) - 1).max() < 0.01
    peak_amplitude = result.measures["relative_displacement_amplitude"].value
    assert peak_amplitude == pytest.approx(
        0.9 * LEVEL / (2 * ZETA * (2 * np.pi * 143) ** 2), rel=1e-4
    )
    width = result.measures["peak_width"]
    assert abs(width.value - 2 * ZETA * 143) < width.error < 1e-4 * width.value
    peak = result.measures["peak_frequency"]
    assert abs(peak.value - 143 * np.sqrt(1 - 2 * ZETA**2)) < peak.error < 0.2


@pytest.mark.parametrize("max_points", [15, 2000])
def test_curve_that_ends_early_has_a_note(max_points, monkeypatch):
    """A curve that does not reach the end of the sweep says where it ends, why, and which keys to change.

    Once the largest motion of such a part was stated without a word.
    """
    path = shooting.FREQUENCY_PATH._replace(max_points=max_points)
    monkeypatch.setattr(shooting, "FREQUENCY_PATH", path)
    begin = "60 Hz" if max_points == 15 else "195 Hz"
    scene = RIG + '[structure.stiffening]\ncubic = "1e6 N/m^3"\n'
    result = pf.run(scene, **{"drive.from": begin})
    notes = [text for text in result.warnings if "and not the end of the sweep" in text]
    reached = result.motion.steady.curve["frequency"].max()
    if max_points > 15:
        assert not notes and reached == pytest.approx(210)
        return
    (note,) = notes
    assert reached < 200
    assert f"reaches {reached:.4g} Hz and not the end of the sweep at 210 Hz" in note
    assert note.endswith(
        ": it has too many points; the largest motion is that of this part, so change drive.from or drive.to"
    )


def test_always_undamped_resonance_is_missing_in_curve():
    """The point at the frequency of an undamped mode has no amplitude and is marked as unbounded; the others are finite."""
    curve = pf.run(
        RIG.replace("0.003", "0"), **{"drive.from": "142 Hz", "drive.to": "144 Hz"}
    ).motion.steady.curve
    at_resonance = curve["frequency"] == 143.0
    assert np.isnan(curve["amplitude"][at_resonance]).all() and at_resonance.any()
    assert (curve["regime"][at_resonance] == "unbounded").all()
    assert np.isfinite(curve["amplitude"][~at_resonance]).all()
