"""What a run under a random drive shows first: root mean squares with the interval of records, spectra, H1."""

import re

import numpy as np
import pytest
from command_line import cli

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
def found():
    return pf.run(SCENE)


def test_exact_the_first_row_is_the_rms_with_the_interval_of_records(found, tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(SCENE, "utf-8")
    lines = cli("run", path, "-o", tmp_path / "out").out.splitlines()
    first = lines[lines.index("motion") + 1]
    value, scatter = (1e6 * found.measures[name].value for name in (RMS, f"{RMS}_scatter"))
    told = re.fullmatch(
        rf"  {RMS} +([\d.]+)(?: ± [\d.]+)? um \((?:± is the numerical error; )?95 % "
        r"interval ([\d.]+) to ([\d.]+) um for other records\)",
        first,
    )
    assert [float(one) for one in told.groups()] == pytest.approx(
        [value, value - scatter, value + scatter], rel=5e-3
    )
    assert not any("_scatter" in line for line in lines)
    head = next(line for line in lines if line.startswith("The displacement of the output is"))
    assert (
        head.index(" rms ")
        < head.index("H1 peaks at")
        < head.index("damping ratio")
        < head.index("half the peak-to-p")
    )
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "The peak of H1 is marked by a ring. It is the peak of a mode at" in page
    assert f"measure-{RMS}_scatter" not in page
    rows = re.findall(r"id='measure-(\w+)'", page)
    assert rows[:4] == [RMS, "absolute_acceleration_rms", "response_frequency", "response_damping"]


def test_exact_the_spectra_of_an_oscillator(found):
    """Under white noise of density G the displacement has G |H|^2, with H = 1/(w0^2 - w^2 + 2 i zeta w0 w).

    Each of 126 lines scatters by 18 %, their median by less.
    """
    made = find_picture("spectra", page_data.collect_run_data(found)).charts(
        found.extra["spectra"], 100.0
    )
    assert [one["title"].split()[0] for one in made] == ["Displacement", "Acceleration", "H1:"]
    (density,), (_, base), (_, gain, peak) = (one["marks"] for one in made)
    assert all(20 <= one["x"].min() and one["x"].max() <= 400 for one in (density, base, gain))

    def ideal(f):
        return 1 / np.abs((2 * np.pi) ** 2 * (100**2 - f**2 + 4j * f))

    far = np.abs(gain["x"] - 100) > 15  # the window of the segments widens the peak itself
    assert gain["y"][far] * 1e-6 == pytest.approx(9.80665 * ideal(gain["x"][far]), rel=0.1)
    assert np.median(base["y"]) == pytest.approx(0.01, rel=0.1)
    far = np.abs(density["x"] - 100) > 15
    ratio = density["y"][far] * 1e-12 / (0.01 * 9.80665**2 * ideal(density["x"][far]) ** 2)
    assert np.median(ratio) == pytest.approx(1, rel=0.1) and np.all((ratio > 0.4) & (ratio < 1.8))
    assert peak["x"] == [100.0] and peak["y"][0] == pytest.approx(gain["y"].max(), rel=0.2)


def test_always_h1_is_faint_where_it_is_not_coherent(found):
    spectra = found.extra["spectra"]
    _, clear = charts.spectra_charts(
        spectra._replace(coherence=np.where(spectra.frequency < 200, spectra.coherence, 0.1)), None
    )[2]["marks"]
    assert clear["x"].max() < 200
