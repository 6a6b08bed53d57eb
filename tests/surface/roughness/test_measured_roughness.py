"""Measured traces and scans, compared with printed results of the instrument and with other codes.

The tests need PATCHFEM_DATA. One of the codes takes Rq about the mean of the roughness profile, not
about its mean line.
"""

import os

import pytest

from patchfem.surface import make_report, read_surface

pytestmark = pytest.mark.skipif(
    "PATCHFEM_DATA" not in os.environ, reason="PATCHFEM_DATA names no folder of scans"
)
UM = 1e-6
TRACES = ("dektak-1.csv", "mitutoyo-2.csv.gz")


@pytest.fixture(scope="module")
def measured_traces(data_folder) -> dict:
    """Return both measured traces by file name."""
    return {name: read_surface(data_folder / name) for name in TRACES}


def test_exact_report_agrees_with_printed_results(measured_traces, reference_values):
    """Between the cursors, Ra, Rq and skewness agree with the print of the instrument to the last digit."""
    report = make_report(measured_traces["dektak-1.csv"], window=(468 * UM, 733 * UM))
    printed = reference_values["dektak-1.csv"]["instrument_printed_results"]
    assert report.sampling.shape == (1697,)
    assert round(report["Pa"].value / UM, 5) == printed["Ra"]
    assert round(report["Pq"].value / UM, 5) == printed["Rq"]
    assert round(report["Psk"].value, 2) == printed["Skew"]


@pytest.mark.parametrize("name", TRACES)
def test_exact_primary_profile_agrees_with_three_codes(measured_traces, reference_values, name):
    """Parameters of the primary profile agree with three other codes within 1e-6."""
    report = make_report(measured_traces[name])
    expected = reference_values[name]
    assert report.treatment.cutoff is None and report.surface.roughness is None
    for key, unit in (("Pa", UM), ("Pq", UM), ("Pt", UM), ("Psk", 1), ("Pku", 1)):
        assert report[key].value == pytest.approx(expected[key] * unit, rel=1e-6, abs=0)
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
def test_roughness_profile_agrees_with_other_code(measured_traces, reference_values, name, cutoff):
    """Parameters of the roughness profile agree with another code within 0.1 %, and Rq within 0.5 %."""
    expected = reference_values[name][f"own_gauss_lc{cutoff}"]
    report = make_report(measured_traces[name], cutoff * UM)
    z = report.surface.roughness.z
    trimmed = report.surface.roughness.x[0] - measured_traces[name].x[0]
    assert z.size // round(cutoff * UM / report.sampling.step) == expected["sections"]
    assert trimmed == pytest.approx(expected["trimmed_each_end_um"] * UM, rel=1e-6)
    assert report["Ra"].value == pytest.approx(expected["Ra"] * UM, rel=1e-3)
    assert z.std() == pytest.approx(expected["Rq"] * UM, rel=1e-4)
    assert report["Rq"].value == pytest.approx(expected["Rq"] * UM, rel=5e-3)
    assert report["Rz"].value == pytest.approx(expected["Rz_mean_of_sections"] * UM, rel=1e-4)


@pytest.mark.parametrize("name", ["nanovea-test1.txt.gz", "nanovea-test2.txt.gz"])
def test_exact_areal_parameters_agree_with_three_codes(data_folder, reference_values, name):
    """Areal parameters agree with three other codes within 1e-6, and have no intervals."""
    report = make_report(read_surface(data_folder / name, ("mm", "um")))
    expected = reference_values[name]
    for key, unit in (("Sa", UM), ("Sq", UM), ("Sz", UM), ("Ssk", 1), ("Sku", 1)):
        assert report[key].value == pytest.approx(expected[key] * unit, rel=1e-6)
        assert report[key].low is None and report[key].high is None
