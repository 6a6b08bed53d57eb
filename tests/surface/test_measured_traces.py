"""Measured traces: the numbers of three independent codes, from reading to levelling. Needs PATCHFEM_DATA."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from patchfem.core import PatchfemError
from patchfem.surface import (
    Profile,
    average_at_nodes,
    clean,
    describe_lost_waves,
    level,
    level_plane,
    place_over_patch,
    read_surface,
)
from patchfem.surface.fine import wave_spectrum
from patchfem.surface.profile import find_spikes

pytestmark = pytest.mark.skipif(
    "PATCHFEM_DATA" not in os.environ, reason="PATCHFEM_DATA names no folder of scans"
)


@pytest.fixture
def data() -> Path:
    return Path(os.environ["PATCHFEM_DATA"])


@pytest.fixture
def truth(data) -> dict:
    return json.loads((data / "truth.json").read_text())


def mitutoyo(data) -> Profile:
    return read_surface(data / "mitutoyo-2.csv.gz")


def dektak(data) -> Profile:
    return read_surface(data / "dektak-1.csv")


def test_exact_the_step_of_the_stylus_is_length_over_points(data):
    """The export prints x to 0.1 um; 1500 um over 9600 points is 0.15625 um."""
    profile = dektak(data)
    assert np.diff(profile.x) == pytest.approx(np.full(9599, 1500e-6 / 9600), rel=1e-9)
    assert profile.x[0] == 0 and profile.x[-1] == pytest.approx(9599 * 0.15625e-6, rel=1e-14)
    assert profile.notes[0].endswith(
        "x is rounded to 100 nm in the file; the step 1.5 mm/9600 = 156.2 nm of the header is used"
    )


@pytest.mark.parametrize("name", ["nanovea-test1.txt.gz", "nanovea-test2.txt.gz"])
def test_exact_the_plane_of_three_codes(data, truth, name):
    known = truth[name]
    scan = read_surface(data / name, ("mm", "um"))
    assert scan.z.shape == tuple(known["shape"])
    assert np.diff(scan.x) == pytest.approx(np.full(100, 5e-6), rel=1e-9)
    off = scan.z - level_plane(scan).z
    slopes = [(off[0, -1] - off[0, 0]) / 5e-4, (off[-1, 0] - off[0, 0]) / 5e-4]
    assert slopes == pytest.approx(known["plane_slope_per_um"], rel=1e-6)


def test_exact_the_measured_interface_of_a_bolted_beam(data, truth):
    """A gap map in metres: 246 x 54 places, each at the height that SciPy reads there."""
    known = truth["brb_surface_data.mat"]
    scan = read_surface(data / "brb_surface_data.mat", ("m", "m"))
    assert scan.z.shape == tuple(reversed(known["grid"]))
    assert np.isfinite(scan.z).sum() == known["finite"]
    assert [scan.x[-1] - scan.x[0], scan.y[-1] - scan.y[0]] == pytest.approx(
        [known["extent_mm"][0] * 1e-3, known["extent_mm"][1] * 1e-3], rel=1e-6
    )
    assert np.nanmax(scan.z) - np.nanmin(scan.z) == pytest.approx(
        known["gap_PV_um"] * 1e-6, rel=1e-6
    )
    flat = level_plane(scan)
    assert np.nanmax(flat.z) - np.nanmin(flat.z) == pytest.approx(
        known["flatness_PV_um"] * 1e-6, rel=1e-6
    )
    points = loadmat(data / "brb_surface_data.mat")["mesoscale_xygap"]
    column = np.searchsorted(scan.x, points[:, 0] - 1e-9)
    row = np.searchsorted(scan.y, points[:, 1] - 1e-9)
    assert np.array_equal(scan.z[row, column], points[:, 2], equal_nan=True)


def test_exact_measured_traces_hold_few_spikes(data):
    assert not find_spikes(mitutoyo(data)).any() and not find_spikes(dektak(data)).any()
    for name in ("nanovea-test1.txt.gz", "nanovea-test2.txt.gz"):
        z = np.loadtxt(data / name, delimiter=",")[:, 2].reshape(101, 101) * 1e-6
        found = sum(int(find_spikes(Profile(np.arange(101) * 5e-6, row, name)).sum()) for row in z)
        # of 10201, where 379 heights lie beyond 8 deviations of the whole scan: pits, not spikes
        assert found <= 10


def test_exact_spectrum_of_a_rough_trace_by_its_filtered_height(data, truth):
    """Rq behind a Gaussian filter from another code: the spectrum with each wave less the 2^-(cut/wave)^2 let by."""
    profile = mitutoyo(data)
    known = truth["mitutoyo-2.csv.gz"]
    waves, power = wave_spectrum(profile)
    assert np.sqrt(power.sum()) == pytest.approx(known["Pq"] * 1e-6, rel=1e-4)
    for cut, name, near in (
        (80e-6, "own_gauss_lc80", 0.01),
        (250e-6, "own_gauss_lc250", 0.01),
        (800e-6, "own_gauss_lc800", 0.05),
    ):
        rough = np.sqrt((power * (1 - 2.0 ** -((cut / waves) ** 2)) ** 2).sum())
        assert rough == pytest.approx(known[name]["Rq"] * 1e-6, rel=near)
    assert (
        "% of its rms height in waves shorter than 2 elements (200 um), which the mesh cannot resolve: add "
        '[contact.asperities], or set element_size = "20 um"'
    ) in str(describe_lost_waves(profile, 100e-6))


def test_exact_a_measured_trace_on_the_nodes_of_a_patch(data):
    """Coarse nodes see the means: their variance is what the waves keep after a box of one element."""
    nodes = np.linspace(-4.9e-3, 4.9e-3, 197)
    trace = level(clean(place_over_patch(mitutoyo(data), nodes), 1e-4))
    assert "the trace is centred on the patch, which adds -4.997 mm to x" in trace.notes[0]
    gap = average_at_nodes(trace, nodes)
    fine = np.interp(np.linspace(nodes[0], nodes[-1], 196 * 50 + 1), trace.x, trace.z)
    box = np.convolve(fine, np.r_[0.5, np.ones(49), 0.5] / 50, "valid")[25::50]
    assert gap[1:-1] == pytest.approx(box[:195], abs=2e-8)


@pytest.mark.parametrize(
    "name",
    [
        "xy-1.txt",
        "nanovea-test1.txt.gz",
        "brb_surface_data.mat",
        "truth.json",
        "friction-damper-1hz.csv",
    ],
)
def test_refuses_files_that_name_no_units_or_are_no_surface(data, name):
    with pytest.raises(PatchfemError, match=r"header (as )?`x \[um\],z \[um\]`"):
        read_surface(data / name)


def test_exact_a_digitised_uneven_trace_without_a_header(data):
    profile = read_surface(data / "xy-1.txt", ("um", "um"))
    known = np.loadtxt(data / "xy-1.txt") * 1e-6
    assert profile.x == pytest.approx(known[:, 0], rel=1e-14) and profile.z == pytest.approx(
        known[:, 1], rel=1e-14
    )
    assert profile.notes == ()
