"""`patchfem profile`: definitions, JSON, report, several files, split traces, and error messages."""

from pathlib import Path

import contact_forms as closed_forms
import numpy as np
import pytest
from command_line import run_cli

import patchfem as pf

UM = 1e-6


@pytest.fixture
def trace_file(tmp_path) -> Path:
    """Return the path of a trace of 4 mm: a sine of 5 um and 80 um wavelength with noise."""
    x = np.arange(4001.0)
    z = 5 * np.sin(2 * np.pi * x / 80) + np.random.default_rng(0).normal(0, 0.05, x.size)
    path = tmp_path / "before.csv"
    path.write_text("x [um],z [um]\n" + "".join(f"{a:g},{b:.17g}\n" for a, b in zip(x, z)))
    return path


@pytest.fixture
def scan_file(tmp_path) -> Path:
    """Return the path of an areal scan of 12 x 16 random heights."""
    rows = np.random.default_rng(1).normal(0, 1, (12, 16))
    path = tmp_path / "scan.csv"
    path.write_text(
        "x [um],y [um],z [nm]\n"
        + "".join(
            f"{i},{k},{rows[k, i]!r}\n".replace("np.float64(", "").replace(")", "")
            for k in range(12)
            for i in range(16)
        )
    )
    return path


def test_profile_json_is_in_si_units(trace_file, scan_file):
    """The JSON gives parameters in SI units; Sq of a scan agrees with the rms about a least-squares plane within 1e-9."""
    answer = run_cli("profile", trace_file, scan_file, "--json").content
    first, second = answer["profiles"]
    assert (
        first["file"] == str(trace_file)
        and first["kind"] == "profile"
        and second["kind"] == "areal"
    )
    assert first["measures"]["Pq"]["value"] == pytest.approx(5 * UM / np.sqrt(2), rel=0.01)
    assert {"value", "low", "high", "unit"} <= set(first["measures"]["Pq"])
    assert first["measures"]["Pq"]["unit"] == "m"
    assert first["cutoff"] is None and first["length"] == pytest.approx(4e-3)
    rows = np.random.default_rng(1).normal(0, 1, (12, 16))  # the heights of `scan_file`
    across, down = np.meshgrid(np.arange(16.0), np.arange(12.0))
    plane = np.column_stack([np.ones(rows.size), across.ravel(), down.ravel()])
    residual = rows.ravel() - plane @ np.linalg.lstsq(plane, rows.ravel(), rcond=None)[0]
    assert second["measures"]["Sq"]["value"] == pytest.approx(
        1e-9 * np.sqrt((residual**2).mean()), rel=1e-9
    )
    assert second["shape"] == [12, 16]
    window = run_cli("profile", trace_file, "--window", "1 mm,1.8 mm", "--json").content[
        "profiles"
    ][0]
    assert window["window"] == [1e-3, 1.8e-3] and window["shape"] == [801]


SPLIT_SCENE = """\
# two waves
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "2 kN"
substrate = "steel"
element_size = "63.5 um"  # even
[contact.shear]
[contact.profile] # measured
file = "waves.csv"
heights = "surface"
[friction]
law = "coulomb"
static = 0.3
[slide]
kind = "triangle"
amplitude = "1 um"
speed = "1 mm/s"
cycles = 1
"""
LONG, SHORT = 1.27e-3, 12.7e-3 / 130  # m; the mesh resolves contact on the first only
HIGH, LOW = 0.5e-6, 0.1e-6  # m, their amplitudes


@pytest.fixture
def split_scene(tmp_path, monkeypatch) -> Path:
    """A scene with a trace of two waves, in the working folder."""
    x = np.linspace(0, 12.7e-3, 6501)
    z = HIGH * np.cos(2 * np.pi * x / LONG) + LOW * np.cos(2 * np.pi * x / SHORT)
    rows = "".join(f"{a!r},{b!r}\n" for a, b in zip(x.tolist(), z.tolist()))
    (tmp_path / "waves.csv").write_text(f"x [m],z [m]\n{rows}", "utf-8")
    (tmp_path / "scene.toml").write_text(SPLIT_SCENE, "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "scene.toml"


def test_a_trace_of_two_waves_is_split_between_them(split_scene):
    """Truth: 0.45 times the rms height beyond the Gaussian filter; the pressure that closes a sine of this slope."""
    words = ("profile", "waves.csv", "--split", split_scene, "--cutoff", "250 um", "--json")
    split = run_cli(*words).content["split"]
    waves = np.array([LONG, SHORT])
    heights = np.array([HIGH, LOW]) * (1 - 2 ** -((250e-6 / waves) ** 2))
    assert split["cutoff"] == pytest.approx(250e-6)
    rms = np.hypot(*heights) / np.sqrt(2)
    assert split["decay_length"] == pytest.approx(0.45 * rms, rel=0.01)
    steel = pf.load(split_scene).contact.substrate
    modulus = closed_forms.combined_modulus(steel.young, steel.poisson)
    closing = closed_forms.westergaard_full_pressure(1.0, np.hypot(*(heights / waves)), modulus)
    assert split["closing_pressure"] == pytest.approx(closing, rel=0.02)
    assert split["pressure"] == pytest.approx(2e3 / 12.7e-3**2)


def test_help_states_the_probability_of_the_intervals():
    """The help says that the intervals are 90 % intervals and those of compare 95 % intervals."""
    text = " ".join(run_cli("profile", "--help").out.split())
    assert "with 90 % intervals" in text and "those of compare are 95 % intervals" in text


@pytest.mark.parametrize("radius", [20e3, 50e3])
def test_wear_of_traces_over_a_cylinder_is_measured_without_the_circle(tmp_path, radius):
    """As the guide says, a cylinder widens the interval of the area or hides the wear, and --form circle mends it."""
    random = np.random.default_rng(0)
    x = np.arange(3900.0)  # [um], as the radius
    rough = 0.05 * np.convolve(random.normal(size=4100), np.hanning(15), "same")
    wear = 1.2 * np.clip(1 - ((x + 37 - 2000) / 400) ** 2, 0, None)  # 640 um^2
    files = []
    flat = []
    for name, start, worn in (("before", 0, 0.0), ("after", 37, wear)):
        circle = np.sqrt(radius**2 - (x + start - 2000) ** 2) - radius
        noise = random.normal(0, 0.005, x.size)
        rows = np.column_stack([x, circle + rough[start : start + x.size] - worn + noise])
        files.append(tmp_path / f"{name}.csv")
        np.savetxt(files[-1], rows, "%.6f", ",", header="x [um],z [um]", comments="")
        assert not run_cli("profile", files[-1], "--form", "circle", "-o", tmp_path / name).code
        flat.append(tmp_path / name / "primary.csv")

    widths = []
    for pair in (files, flat):
        area = pf.compare(*pair)["worn_area"]
        widths.append(np.inf if area["value"] is None else area["high"] - area["low"])
    assert area["low"] < 640e-12 < area["high"] and area["value"] == pytest.approx(
        640e-12, rel=0.01
    )
    assert widths[1] < 0.7 * widths[0]
