"""Answer of the roughness of measured surfaces, against closed forms of a sine and against the parameters themselves."""

import csv

import numpy as np
import pytest
from command_line import read_json
from scipy.stats import t

from patchfem.export import page, quantities, store
from patchfem.export.netcdf import to_dataset
from patchfem.export.surfaces import roughness
from patchfem.surface.areal import Areal
from patchfem.surface.profile import Profile
from patchfem.surface.roughness.report import make_report

WAVELENGTH = 80e-6
AMPLITUDE = 1e-6
STEP = 0.5e-6


def make_sine(amplitude: float = AMPLITUDE, name: str = "sine.csv") -> Profile:
    """Return a trace of fifty waves."""
    x = np.arange(round(50 * WAVELENGTH / STEP)) * STEP
    return Profile(x, amplitude * np.sin(2 * np.pi * x / WAVELENGTH), name)


@pytest.fixture(scope="module")
def sine_folder(tmp_path_factory):
    """Return the answer on a sine with a cut-off, and the folder with its files and page."""
    answer = roughness.make_roughness_answer([make_report(make_sine(), cutoff=8e-4)])
    folder = tmp_path_factory.mktemp("sine")
    store.write_answer(answer, folder)
    page.write_report(folder)
    return answer, folder


def test_parameters_of_a_sine(sine_folder):
    """Ra = 2A/pi, Rq = A/sqrt(2), Rz = 2A, RSm = wavelength: in profile.json, in the headline and in profile.csv."""
    answer, folder = sine_folder
    (entry,) = read_json(folder / "profile.json")["profiles"]
    truths = {"Ra": 2 / np.pi * AMPLITUDE, "Rq": AMPLITUDE / np.sqrt(2), "Rz": 2 * AMPLITUDE}
    head, row = csv.reader((folder / "profile.csv").read_text("utf-8").splitlines())
    for name, truth in truths.items():
        # the Gaussian filter passes 1 - exp(-pi (alpha wavelength / cut-off)^2 ...) of a wave a tenth of the cut-off long
        assert entry["measures"][name]["value"] == pytest.approx(truth, rel=0.01)
        text = quantities.format_quantity(name, answer.quantities[name])
        assert f"{name} {text}" in answer.verdict[0]
        assert float(row[head.index(f"{name} [m]")]) == entry["measures"][name]["value"]
    assert entry["measures"]["RSm"]["value"] == pytest.approx(WAVELENGTH, rel=1e-3)
    assert (entry["cutoff"], entry["kind"], entry["shape"]) == (8e-4, "profile", [8000])
    assert entry["asperities"]["rms_slope"] == pytest.approx(
        np.sqrt(2) * np.pi * AMPLITUDE / WAVELENGTH, rel=0.01
    )
    assert row[head.index("file")] == "sine.csv"


def test_profiles_are_curves(sine_folder):
    """primary.csv is the sum of waviness and roughness, and is read again as a trace with the same Pq."""
    answer, folder = sine_folder
    data = to_dataset(answer)
    inside = np.isin(np.round(data.x.values / STEP), np.round(data.x_rough.values / STEP))
    assert (data.waviness + data.roughness).values == pytest.approx(
        data.primary.values[inside], abs=1e-15
    )
    again = roughness.answer_files([folder / "primary.csv"])
    assert again.quantities["Pq"].value == pytest.approx(answer.quantities["Pq"].value, rel=1e-9)
    peak = float(data.wavelength[int(np.argmax(data.density.values))])
    assert peak == pytest.approx(WAVELENGTH, rel=0.1)


def test_exact_mean_of_files_uses_student_t():
    """The means over three traces are those of their values, with the interval of Student's t of the logarithm."""
    sizes = (1.0, 1.1, 1.3)
    traces = [make_sine(size * AMPLITUDE, f"{size}.csv") for size in sizes]
    answer = roughness.make_roughness_answer([make_report(trace) for trace in traces])
    values = np.array([entry["measures"]["Pa"]["value"] for entry in answer.details["profiles"]])
    (means,) = answer.details["means"]
    mean = means["measures"]["Pa"]
    half = t.ppf(0.975, 2) * values.std(ddof=1) / np.sqrt(3)
    assert mean["value"] == pytest.approx(values.mean(), rel=1e-12)
    factor = np.exp(half / values.mean())
    assert mean["high"] == pytest.approx(values.mean() * factor, rel=1e-9)
    assert mean["low"] == pytest.approx(values.mean() / factor, rel=1e-9)
    assert mean["scatter"] == pytest.approx(values.std(ddof=1), rel=1e-12)
    assert answer.verdict[0].startswith("Mean of 3 traces: Pa ")
    assert answer.quantities["Pa"].value == mean["value"]
    assert answer.data["abbott"].values.shape[0] == 3 and not answer.remarks.warnings


def test_scan_has_areal_parameters_and_a_map():
    """A scan of four waves along x has Sq = A/sqrt(2), its map and no profile."""
    x = np.arange(160) * 2e-6
    z = np.tile(AMPLITUDE * np.cos(2 * np.pi * x / WAVELENGTH), (90, 1))
    answer = roughness.make_roughness_answer([make_report(Areal(x, x[:90], z, "scan.csv"))])
    assert answer.quantities["Sq"].value == pytest.approx(AMPLITUDE / np.sqrt(2), rel=1e-3)
    assert answer.verdict[0].startswith("Sa ") and "no L-filter" in answer.verdict[1]
    assert answer.data["height_map"].values.shape == (90, 160) and "primary" not in answer.data
    for name in answer.quantities:
        assert quantities.describe_quantity(name, "profile")
