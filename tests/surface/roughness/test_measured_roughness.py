"""Measured traces and scans, compared with printed results of the instrument and with other codes.

The tests need PATCHFEM_DATA. One of the codes takes Rq about the mean of the roughness profile, not
about its mean line.
"""

import json
import os
from pathlib import Path

import pytest

from patchfem.surface import Heights, make_report, read_surface

pytestmark = pytest.mark.skipif(
    "PATCHFEM_DATA" not in os.environ, reason="PATCHFEM_DATA names no folder of scans"
)
UM = 1e-6
TRACES = ("dektak-1.csv", "mitutoyo-2.csv.gz")


@pytest.fixture(scope="module")
def data_folder() -> Path:
    """Return the folder of measured data."""
    return Path(os.environ["PATCHFEM_DATA"])


@pytest.fixture(scope="module")
def reference_values(data_folder) -> dict:
    """Return the reference values of the measured data."""
    return json.loads((data_folder / "truth.json").read_text())


@pytest.fixture(scope="module")
def measured_traces(data_folder) -> dict:
    """Return both measured traces by file name."""
    return {name: read_surface(data_folder / name) for name in TRACES}


def test_exact_report_agrees_with_printed_results(measured_traces, reference_values):
    """Between the cursors, Ra, Rq, skewness, Rz(DIN) and deviation agree with the print to the last digit.

    The step height agrees within one unit of the last digit.
    """
    report = make_report(measured_traces["dektak-1.csv"], window=(468 * UM, 733 * UM))
    printed = reference_values["dektak-1.csv"]["instrument_printed_results"]
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
    expected = reference_values["dektak-1.csv"]["own_window_samples_2995_4692"]
    for name, key in (
        ("Pa", "Ra"),
        ("Pq", "Rq"),
        ("RzDin", "RzDin_5_sections"),
        ("MaxDev", "MaxDev"),
        ("ASH", "ASH_last_minus_first"),
    ):
        assert report[name].value / UM == pytest.approx(expected[key], rel=1e-6)


@pytest.mark.parametrize("name", TRACES)
def test_exact_primary_profile_agrees_with_three_codes(measured_traces, reference_values, name):
    """Parameters of the primary profile agree with three other codes within 1e-6."""
    report = make_report(measured_traces[name])
    expected = reference_values[name]
    assert report.treatment.cutoff is None and report.surface.roughness is None
    for key, unit in (("Pa", UM), ("Pq", UM), ("Pt", UM), ("Psk", 1), ("Pku", 1)):
        assert report[key].value == pytest.approx(expected[key] * unit, rel=1e-6)
    assert report["Pdq"].value == pytest.approx(expected["Pdq_2pt"], rel=1e-6)
    assert not any(parameter.name.startswith("R") for parameter in report.values)


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
def test_exact_roughness_profile_agrees_with_other_code(
    measured_traces, reference_values, name, cutoff
):
    """Parameters of the roughness profile agree with another code within 0.1 %, and Rq within 0.5 %."""
    expected = reference_values[name][f"own_gauss_lc{cutoff}"]
    report = make_report(measured_traces[name], cutoff * UM)
    heights = Heights(report.surface.roughness.z, report.sampling.step, cutoff * UM)
    trimmed = report.surface.roughness.x[0] - measured_traces[name].x[0]
    assert len(heights.sections) == expected["sections"]
    assert trimmed == pytest.approx(expected["trimmed_each_end_um"] * UM, rel=1e-6)
    assert report["Ra"].value == pytest.approx(expected["Ra"] * UM, rel=1e-3)
    assert heights.z.std() == pytest.approx(expected["Rq"] * UM, rel=1e-4)
    assert report["Rq"].value == pytest.approx(expected["Rq"] * UM, rel=5e-3)
    assert report["Rz"].value == pytest.approx(expected["Rz_mean_of_sections"] * UM, rel=1e-4)


@pytest.mark.parametrize("name", TRACES)
def test_exact_core_agrees_with_other_code(measured_traces, reference_values, name):
    """The core parameters agree within 5 % with another code, which evaluates a histogram."""
    found = make_report(measured_traces[name])
    expected = reference_values[name]["surfalize"]
    for key in ("k", "pk", "vk"):
        assert found["P" + key].value == pytest.approx(expected["R" + key] * UM, rel=0.05)


@pytest.mark.parametrize("name", ["nanovea-test1.txt.gz", "nanovea-test2.txt.gz"])
def test_exact_areal_parameters_agree_with_three_codes(data_folder, reference_values, name):
    """Areal parameters agree with three other codes within 1e-6, and have no intervals on plateaus with pits."""
    report = make_report(read_surface(data_folder / name, ("mm", "um")))
    expected = reference_values[name]
    for key, unit in (("Sa", UM), ("Sq", UM), ("Sz", UM), ("Ssk", 1), ("Sku", 1)):
        assert report[key].value == pytest.approx(expected[key] * unit, rel=1e-6)
        # the surface has plateaus with pits
        assert report[key].low is None and "heights are not Gaussian" in report[key].reason
