"""Measured traces, compared with three independent codes from reading to levelling; needs PATCHFEM_DATA."""

from __future__ import annotations

import os

import numpy as np
import pytest
from scipy.io import loadmat

from patchfem.surface import read_surface
from patchfem.surface.areal import level

pytestmark = pytest.mark.skipif(
    "PATCHFEM_DATA" not in os.environ, reason="PATCHFEM_DATA names no folder of scans"
)


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
