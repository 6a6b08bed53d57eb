"""Page of a run under random vibration: spectra and the response H1."""

import numpy as np
import pytest

import patchfem as pf
from patchfem.export import page_data
from patchfem.export.report import find_picture

SCENE = """\
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
slide = 1.0
frequency = "100 Hz"
damping = 0.02
[drive]
kind = "base"
waveform = "random"
spectrum = "0.01 g^2/Hz"
from = "20 Hz"
to = "400 Hz"
duration = "6 s"
"""


@pytest.fixture(scope="module")
def random_run():
    """Return the result of a linear oscillator under random vibration."""
    return pf.run(SCENE)


def test_exact_spectra_agree_with_transfer_function(random_run):
    """Under white noise of density G the displacement spectrum agrees with G |H|^2 within 5 %.

    Here H = 1/(w0^2 - w^2 + 2 i zeta w0 w). Each of 126 lines scatters by 18 %, and their median by
    less.
    """
    spectra_charts = find_picture("spectra", page_data.collect_run_data(random_run)).charts(
        random_run.extra["spectra"], 100.0
    )
    assert [chart["title"].split()[0] for chart in spectra_charts] == [
        "Displacement",
        "Acceleration",
        "H1:",
    ]
    assert all(chart[axis]["log"] for chart in spectra_charts for axis in "xy")
    (density,), (_, base), (_, gain, peak) = (chart["marks"] for chart in spectra_charts)
    assert all(
        20 <= chart["x"].min() and chart["x"].max() <= 400 for chart in (density, base, gain)
    )

    def transfer_function(f):
        """Return the magnitude of the transfer function from base acceleration to displacement."""
        return 1 / np.abs((2 * np.pi) ** 2 * (100**2 - f**2 + 4j * f))

    # the window of the segments widens the peak, which is therefore left out
    off_peak = np.abs(gain["x"] - 100) > 15
    assert gain["y"][off_peak] * 1e-6 == pytest.approx(
        9.80665 * transfer_function(gain["x"][off_peak]), rel=0.06
    )
    assert np.median(base["y"]) == pytest.approx(0.01, rel=0.05)
    off_peak = np.abs(density["x"] - 100) > 15
    ratio = (
        density["y"][off_peak]
        * 1e-12
        / (0.01 * 9.80665**2 * transfer_function(density["x"][off_peak]) ** 2)
    )
    assert np.median(ratio) == pytest.approx(1, rel=0.05) and np.all((ratio > 0.45) & (ratio < 1.6))
    assert peak["x"] == [100.0] and peak["y"][0] == pytest.approx(gain["y"].max(), rel=1e-9)
