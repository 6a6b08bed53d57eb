"""Curves of steady motions over a sweep with default settings: peaks narrower than any spacing of even points."""

import numpy as np
import pytest

import patchfem as pf

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


def amplitude(f):
    """Sum over both modes of output base a/(omega_r^2 - omega^2 + 2 i zeta omega_r omega)."""
    w = 2 * np.pi * np.atleast_1d(f)[:, None]
    own = 2 * np.pi * np.array([143.0, 73.0])
    return np.abs(
        LEVEL * np.sum(np.array([0.9, 0.005]) / (own**2 - w**2 + 2j * ZETA * own * w), axis=1)
    )


def test_exact_a_linear_curve_is_the_sum_of_its_modes():
    """At every point, and between them within a percent; the peak is output base a/(2 zeta omega^2)."""
    found = pf.run(RIG)
    curve = found.extra["curve"]
    np.testing.assert_allclose(curve["amplitude"], amplitude(curve["frequency"]), rtol=1e-12)
    np.testing.assert_allclose(
        curve["multiplier"], np.exp(-ZETA * 2 * np.pi * 73 / curve["frequency"]), rtol=1e-9
    )
    fine = np.linspace(60, 210, 200001)
    assert (
        np.abs(np.interp(fine, curve["frequency"], curve["amplitude"]) / amplitude(fine) - 1).max()
        < 0.01
    )
    top = found.measures["relative_displacement_amplitude"].value
    assert top == pytest.approx(0.9 * LEVEL / (2 * ZETA * (2 * np.pi * 143) ** 2), rel=1e-4)
    peak = found.measures["peak_frequency"]
    assert abs(peak.value - 143 * np.sqrt(1 - 2 * ZETA**2)) < peak.error < 0.2


def test_always_an_undamped_mode_has_a_hole_in_its_curve():
    curve = pf.run(
        RIG.replace("0.003", "0"), **{"drive.from": "142 Hz", "drive.to": "144 Hz"}
    ).extra["curve"]
    at = curve["frequency"] == 143.0
    assert np.isnan(curve["amplitude"][at]).all() and curve["regime"][at] == "unbounded"
    assert np.isfinite(curve["amplitude"][~at]).all()


@pytest.mark.parametrize(
    "low, high, key, said",
    [
        (
            100,
            140,
            "drive.to = 140 Hz, the upper",
            "above this frequency: axial has its resonance at 143 Hz; raise drive.to",
        ),
        (
            140,
            100,
            "drive.from = 140 Hz, the upper",
            "above this frequency: axial has its resonance at 143 Hz; raise drive.from",
        ),
        (
            75,
            90,
            "drive.to = 90 Hz, the upper",
            "above this frequency: axial has its resonance at 143 Hz; raise drive.to",
        ),
        (
            300,
            320,
            "drive.from = 300 Hz, the lower",
            "below this frequency: axial has its resonance at 143 Hz; lower drive.from",
        ),
        (120, 160, "", ""),
    ],
)
def test_exact_a_largest_response_at_an_end_of_the_sweep_is_no_peak(low, high, key, said):
    """One mode's flank has no peak; the mode whose flank it is lies on the named side."""
    found = pf.run(RIG, **{"drive.from": f"{low} Hz", "drive.to": f"{high} Hz"})
    warned = [one for one in found.warnings if "the largest response lies at" in one]
    assert len(warned) == bool(said)
    assert all(key in one and said in one for one in warned)
