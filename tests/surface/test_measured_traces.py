"""Measured traces, compared with three independent codes from reading to levelling; needs PATCHFEM_DATA."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from patchfem.surface import Profile, describe_lost_waves, read_surface
from patchfem.surface.areal import level
from patchfem.surface.spectrum import wave_spectrum

pytestmark = pytest.mark.skipif(
    "PATCHFEM_DATA" not in os.environ, reason="PATCHFEM_DATA names no folder of scans"
)


@pytest.fixture
def data_folder() -> Path:
    """Return the folder of measured data."""
    return Path(os.environ["PATCHFEM_DATA"])


@pytest.fixture
def reference_values(data_folder) -> dict:
    """Return the reference values of the measured data."""
    return json.loads((data_folder / "truth.json").read_text())


def read_mitutoyo_trace(data) -> Profile:
    """Return the measured trace of a Mitutoyo instrument."""
    return read_surface(data / "mitutoyo-2.csv.gz")


@pytest.mark.parametrize("name", ["nanovea-test1.txt.gz", "nanovea-test2.txt.gz"])
def test_exact_plane_agrees_with_three_codes(data_folder, reference_values, name):
    """The slopes of the plane of a scan agree with three other codes within 1e-6."""
    expected = reference_values[name]
    scan = read_surface(data_folder / name, ("mm", "um"))
    assert scan.z.shape == tuple(expected["shape"])
    assert np.diff(scan.x) == pytest.approx(np.full(100, 5e-6), rel=1e-9)
    plane = scan.z - level(scan).z
    slopes = [(plane[0, -1] - plane[0, 0]) / 5e-4, (plane[-1, 0] - plane[0, 0]) / 5e-4]
    assert slopes == pytest.approx(expected["plane_slope_per_um"], rel=1e-6)


def test_exact_gap_map_of_bolted_beam(data_folder, reference_values):
    """The gap map of a bolted beam has the grid, extent and flatness of the reference.

    Each height is the one that SciPy reads.
    """
    expected = reference_values["brb_surface_data.mat"]
    scan = read_surface(data_folder / "brb_surface_data.mat", ("m", "m"))
    assert scan.z.shape == tuple(reversed(expected["grid"]))
    assert np.isfinite(scan.z).sum() == expected["finite"]
    assert [scan.x[-1] - scan.x[0], scan.y[-1] - scan.y[0]] == pytest.approx(
        [expected["extent_mm"][0] * 1e-3, expected["extent_mm"][1] * 1e-3], rel=1e-6
    )
    assert np.nanmax(scan.z) - np.nanmin(scan.z) == pytest.approx(
        expected["gap_PV_um"] * 1e-6, rel=1e-6
    )
    flat = level(scan)
    assert np.nanmax(flat.z) - np.nanmin(flat.z) == pytest.approx(
        expected["flatness_PV_um"] * 1e-6, rel=1e-6
    )
    points = loadmat(data_folder / "brb_surface_data.mat")["mesoscale_xygap"]
    column = np.searchsorted(scan.x, points[:, 0] - 1e-9)
    row = np.searchsorted(scan.y, points[:, 1] - 1e-9)
    assert np.array_equal(scan.z[row, column], points[:, 2], equal_nan=True)


def test_exact_spectrum_agrees_with_filtered_rms(data_folder, reference_values):
    """Rq after a Gaussian filter, from the spectrum, agrees with another code within 1 to 5 %.

    Each wave is reduced by the part 2^-(cut/wave)^2 that the filter passes.
    """
    profile = read_mitutoyo_trace(data_folder)
    expected = reference_values["mitutoyo-2.csv.gz"]
    waves, power = wave_spectrum(profile)
    assert np.sqrt(power.sum()) == pytest.approx(expected["Pq"] * 1e-6, rel=1e-4)
    for cut, name, tolerance in (
        (80e-6, "own_gauss_lc80", 0.01),
        (250e-6, "own_gauss_lc250", 0.01),
        (800e-6, "own_gauss_lc800", 0.05),
    ):
        rough = np.sqrt((power * (1 - 2.0 ** -((cut / waves) ** 2)) ** 2).sum())
        assert rough == pytest.approx(expected[name]["Rq"] * 1e-6, rel=tolerance)
    assert (
        "% of its rms height in waves shorter than 2 elements (200 um), which the mesh cannot resolve: add "
        '[contact.asperities], or set element_size = "20.3 um"'
    ) in str(describe_lost_waves(profile, 100e-6))
