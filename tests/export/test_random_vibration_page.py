"""Page of a run under random vibration: root mean squares with their intervals, spectra and the response H1."""

import re

import numpy as np
import pytest
from command_line import run_cli

import patchfem as pf
from patchfem.export import page_data
from patchfem.export.drawing import charts
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
RMS = "relative_displacement_rms"


@pytest.fixture(scope="module")
def random_run():
    """Return the result of a linear oscillator under random vibration."""
    return pf.run(SCENE)


def test_exact_rms_comes_first_with_interval(random_run, tmp_path):
    """The first measure is the rms displacement with its 95 % interval over other records of the noise.

    The same measures come first on the page.
    """
    path = tmp_path / "rig.toml"
    path.write_text(SCENE, "utf-8")
    lines = run_cli("run", path, "-o", tmp_path / "out").out.splitlines()
    first_row = lines[lines.index("motion") + 1]
    value, scatter = (1e6 * random_run.measures[name].value for name in (RMS, f"{RMS}_scatter"))
    match = re.fullmatch(
        rf"  {RMS} +([\d.]+)(?: ± [\d.]+)? um \((?:± is the numerical error; )?95 % "
        r"interval ([\d.]+) to ([\d.]+) um for other records\)",
        first_row,
    )
    assert [float(number) for number in match.groups()] == pytest.approx(
        [value, value - scatter, value + scatter], rel=5e-3
    )
    assert not any("_scatter" in line for line in lines)
    headline = next(line for line in lines if line.startswith("The displacement of the output is"))
    assert (
        headline.index(" rms ")
        < headline.index("H1 peaks at")
        < headline.index("damping ratio")
        < headline.index("half the peak-to-p")
    )
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "The peak of H1 is marked by a ring. It is the peak of a mode at" in page
    assert f"measure-{RMS}_scatter" not in page
    rows = re.findall(r"id='measure-(\w+)'", page)
    assert rows[:4] == [RMS, "absolute_acceleration_rms", "response_frequency", "response_damping"]


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


def test_always_incoherent_h1_is_faint(random_run):
    """H1 is drawn faint at frequencies with low coherence."""
    spectra = random_run.extra["spectra"]
    _, coherent = charts.spectra_charts(
        spectra._replace(coherence=np.where(spectra.frequency < 200, spectra.coherence, 0.1)), None
    )[2]["marks"]
    assert coherent["x"].max() < 200
