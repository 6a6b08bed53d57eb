"""Measured traces and scans: the instrument's own printed results, and the numbers of other codes. Needs PATCHFEM_DATA.

The other code takes Rq about the mean of the roughness profile, not about its mean line.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from patchfem.surface import Heights, level, make_report, read_surface
from patchfem.surface.roughness.filter import filter_trace
from patchfem.surface.roughness.parameters import fit_core
from patchfem.surface.roughness.spectrum import estimate_spectrum

pytestmark = pytest.mark.skipif(
    "PATCHFEM_DATA" not in os.environ, reason="PATCHFEM_DATA names no folder of scans"
)
UM = 1e-6
TRACES = ("dektak-1.csv", "mitutoyo-2.csv.gz")


@pytest.fixture(scope="module")
def data() -> Path:
    return Path(os.environ["PATCHFEM_DATA"])


@pytest.fixture(scope="module")
def truth(data) -> dict:
    return json.loads((data / "truth.json").read_text())


@pytest.fixture(scope="module")
def traces(data) -> dict:
    """Both traces as they are read."""
    return {name: read_surface(data / name) for name in TRACES}


def test_exact_the_instruments_own_results_between_its_cursors(traces, truth):
    """Ra, Rq, skewness, Rz(DIN) and deviation to the last printed digit, the step height to one of it."""
    report = make_report(traces["dektak-1.csv"], window=(468 * UM, 733 * UM))
    printed = truth["dektak-1.csv"]["instrument_printed_results"]
    assert report.sampling.shape == (1697,)
    for name, key, digits in (
        ("Pa", "Ra", 5),
        ("Pq", "Rq", 5),
        ("RzDin", "RzDin", 5),
        ("MaxDev", "WMaxDev", 5),
    ):
        assert round(report[name].value / UM, digits) == printed[key]
    assert round(report["Psk"].value, 2) == printed["Skew"]
    assert report["ASH"].value / UM == pytest.approx(printed["ASH"], abs=1.5e-5)
    own = truth["dektak-1.csv"]["own_window_samples_2995_4692"]
    for name, key in (
        ("Pa", "Ra"),
        ("Pq", "Rq"),
        ("RzDin", "RzDin_5_sections"),
        ("MaxDev", "MaxDev"),
        ("ASH", "ASH_last_minus_first"),
    ):
        assert report[name].value / UM == pytest.approx(own[key], rel=1e-6)


@pytest.mark.parametrize("name", TRACES)
def test_exact_the_primary_profile_of_three_codes(traces, truth, name):
    report = make_report(traces[name])
    known = truth[name]
    assert report.treatment.cutoff is None and report.surface.roughness is None
    for key, unit in (("Pa", UM), ("Pq", UM), ("Pt", UM), ("Psk", 1), ("Pku", 1)):
        assert report[key].value == pytest.approx(known[key] * unit, rel=1e-6)
    assert report["Pdq"].value == pytest.approx(known["Pdq_2pt"], rel=1e-6)
    assert not any(one.name.startswith("R") for one in report.values)


@pytest.mark.parametrize(
    "name, cutoff",
    [
        ("dektak-1.csv", 80),
        ("dektak-1.csv", 250),
        ("mitutoyo-2.csv.gz", 80),
        ("mitutoyo-2.csv.gz", 250),
        ("mitutoyo-2.csv.gz", 800),
    ],
)
def test_exact_the_roughness_profile_of_another_code(traces, truth, name, cutoff):
    known = truth[name][f"own_gauss_lc{cutoff}"]
    report = make_report(traces[name], cutoff * UM)
    heights = Heights(report.surface.roughness.z, report.sampling.step, cutoff * UM)
    trimmed = report.surface.roughness.x[0] - traces[name].x[0]
    assert len(heights.sections) == known["sections"]
    assert trimmed == pytest.approx(known["trimmed_each_end_um"] * UM, rel=1e-6)
    assert report["Ra"].value == pytest.approx(known["Ra"] * UM, rel=1e-3)
    assert heights.z.std() == pytest.approx(known["Rq"] * UM, rel=1e-4)
    assert report["Rq"].value == pytest.approx(known["Rq"] * UM, rel=5e-3)
    assert report["Rz"].value == pytest.approx(known["Rz_mean_of_sections"] * UM, rel=1e-4)


@pytest.mark.parametrize("name", TRACES)
def test_exact_the_core_of_another_code(traces, truth, name):
    """To 5 %: the other code reads a curve of classes."""
    found = make_report(traces[name])
    known = truth[name]["surfalize"]
    for key in ("k", "pk", "vk"):
        assert found["P" + key].value == pytest.approx(known["R" + key] * UM, rel=0.05)


@pytest.mark.parametrize("name", ["nanovea-test1.txt.gz", "nanovea-test2.txt.gz"])
def test_exact_areal_parameters_of_three_codes(data, truth, name):
    report = make_report(read_surface(data / name, ("mm", "um")))
    known = truth[name]
    for key, unit in (("Sa", UM), ("Sq", UM), ("Sz", UM), ("Ssk", 1), ("Sku", 1)):
        assert report[key].value == pytest.approx(known[key] * unit, rel=1e-6)
        # plateaus with pits
        assert report[key].low is None and "heights are not Gaussian" in report[key].reason


def test_exact_a_digitised_uneven_trace(data):
    trace = read_surface(data / "xy-1.txt", ("um", "um"))
    report = make_report(trace)
    assert "the trace is resampled at every" in report.notes[0]
    dense = np.linspace(trace.x[0], trace.x[-1], 100_001)
    flat = np.interp(dense, trace.x, trace.z)
    flat -= np.polyval(np.polyfit(dense, flat, 1), dense)
    assert report["Pq"].value == pytest.approx(np.sqrt((flat**2).mean()), rel=0.01)


def test_exact_the_core_of_the_report_is_that_of_the_roughness(traces):
    trace = traces["mitutoyo-2.csv.gz"]
    report = make_report(trace, 800 * UM)
    roughness = filter_trace(trace, 800 * UM)[1]
    assert report.heights.core == pytest.approx(fit_core(Heights(roughness.z, 1.0)))
    assert report["Rk"].value == report.heights.core.height
    spectrum = estimate_spectrum(level(trace).z, trace.length / (trace.x.size - 1))
    assert report.surface.spectrum.dominant_wavelength == spectrum.dominant_wavelength
