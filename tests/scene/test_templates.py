"""Templates of scenes: the numbers in their comments (`commands/test_clean_screens.py` runs them)."""

import numpy as np
import pytest
from scipy.linalg import eigh

import patchfem as pf
from patchfem.scene import loads, read_template

BLADE = (np.array([[1e6, -1e6], [-1e6, 6e6]]), np.diag([0.15, 0.25]))  # stiffness, mass
FLATS = 7e7  # N/m


@pytest.mark.slow
def test_exact_damper_template_frequencies():
    """Free and stuck frequency and wedge load in the damper template agree with an eigenvalue solution and statics.

    The resonance with held platforms is that of `runs/test_curve_peaks.py`.
    """
    text = read_template("damper")
    free, held = (
        np.sqrt(eigh(BLADE[0] + np.diag([0, k]), BLADE[1])[0][0]) / (2 * np.pi)
        for k in (0.0, FLATS)
    )
    flats = 2 * 3e-3 * 0.3 * (10000 * np.pi / 30) ** 2 / (2 * np.sin(np.pi / 3))
    assert f"has {free:.0f} Hz with free platforms and {held:.0f} Hz with ones that stick" in text
    assert round(flats, -1) == 1140 and round(flats / 4) == 285
    scene = text[: text.index("\n[sweep]")] + text[text.index("\n[accuracy]") :]
    peak = pf.run(loads(scene), **{"structure.interface[1].load": "1 N"}).measures["peak_frequency"]
    assert abs(peak.value - free) < peak.error + 0.2


def test_exact_shroud_template_numbers():
    """Slides and stuck frequency in the shroud template agree with 0.3 sin(pi n/24) and the stiffness of the bonds."""
    text = read_template("shroud")
    for n, slide in ((2, "0.0776"), (4, "0.15"), (8, "0.2598")):
        assert f"{0.3 * np.sin(np.pi * n / 24):.4f}".rstrip("0") == slide.ljust(6, "0").rstrip("0")
        assert slide in text
    stiff = 0.3 * (2 * np.pi * 250) ** 2 + 0.2598**2 * 0.3 * 300 / 20e-6
    assert f"up to {np.sqrt(stiff / 0.3) / (2 * np.pi):.0f} Hz with held ones" in text
