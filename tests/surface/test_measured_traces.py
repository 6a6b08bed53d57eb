"""Measured traces: the numbers of three independent codes, from reading to levelling. Needs PATCHFEM_DATA."""

from __future__ import annotations

import gzip
import json
import os
from pathlib import Path

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.surface.files.text import read_trace
from patchfem.surface.fine import spectrum, too_fine
from patchfem.surface.nodes import on_nodes, placed
from patchfem.surface.profile import Profile, cleaned, level, spikes

pytestmark = pytest.mark.skipif("PATCHFEM_DATA" not in os.environ, reason="PATCHFEM_DATA names no folder of scans")


@pytest.fixture
def data() -> Path:
    return Path(os.environ["PATCHFEM_DATA"])


@pytest.fixture
def truth(data) -> dict:
    return json.loads((data / "truth.json").read_text())


def mitutoyo(data, tmp_path) -> Profile:
    rows = gzip.decompress((data / "mitutoyo-2.csv.gz").read_bytes()).partition(b"\n")[2]
    path = tmp_path / "mitutoyo.csv.gz"
    path.write_bytes(gzip.compress(b"x [um],z [um]\n" + rows))
    return read_trace(path)


def dektak(data, tmp_path) -> Profile:
    rows = (data / "dektak-1.csv").read_bytes().partition(b"Raw Micrometer,")[2]
    path = tmp_path / "dektak.csv"
    path.write_bytes(b"x [um],z [um],\n" + rows)
    return read_trace(path)


@pytest.mark.parametrize("read, name", [(mitutoyo, "mitutoyo-2.csv.gz"), (dektak, "dektak-1.csv")])
def test_exact_height_parameters_of_three_codes(data, truth, tmp_path, read, name):
    known = truth[name]
    flat = level(read(data, tmp_path))
    z = flat.z * 1e6
    slope = np.diff(z) / np.diff(flat.x * 1e6)
    assert flat.x.size == known["n"] and np.median(np.diff(flat.x)) == pytest.approx(known["dx_um"] * 1e-6, rel=1e-6)
    assert [np.ptp(z), np.abs(z).mean(), np.sqrt((z**2).mean()), np.sqrt((slope**2).mean())] == pytest.approx(
        [known["Pt"], known["Pa"], known["Pq"], known["Pdq_2pt"]], rel=1e-6)


def test_exact_rounded_x_of_the_stylus_is_evened(data, tmp_path):
    profile = dektak(data, tmp_path)
    assert profile.notes[0].endswith("x is printed to 100 nm; taken as evenly spaced at 156.2 nm")
    assert profile.length == pytest.approx(9599 * 0.15625e-6, rel=1e-6)


def test_exact_measured_traces_hold_few_spikes(data, tmp_path):
    assert not spikes(mitutoyo(data, tmp_path)).any() and not spikes(dektak(data, tmp_path)).any()
    for name in ("nanovea-test1.txt.gz", "nanovea-test2.txt.gz"):
        z = np.loadtxt(data / name, delimiter=",")[:, 2].reshape(101, 101) * 1e-6
        found = sum(int(spikes(Profile(np.arange(101) * 5e-6, row, name)).sum()) for row in z)
        assert found <= 10  # of 10201, where 379 heights lie beyond 8 deviations of the whole scan: pits, not spikes


def test_exact_spectrum_of_a_rough_trace_by_its_filtered_height(data, truth, tmp_path):
    """Rq behind a Gaussian filter from another code: the spectrum with each wave less the 2^-(cut/wave)^2 let by."""
    profile = mitutoyo(data, tmp_path)
    known = truth["mitutoyo-2.csv.gz"]
    waves, power = spectrum(profile)
    assert np.sqrt(power.sum()) == pytest.approx(known["Pq"] * 1e-6, rel=1e-4)
    for cut, name, near in ((80e-6, "own_gauss_lc80", 0.01), (250e-6, "own_gauss_lc250", 0.01),
                            (800e-6, "own_gauss_lc800", 0.05)):
        rough = np.sqrt((power * (1 - 2.0 ** -((cut / waves) ** 2)) ** 2).sum())
        assert rough == pytest.approx(known[name]["Rq"] * 1e-6, rel=near)
    assert "% of its height below 2 elements (200 um): add [contact.asperities] or set element_size = \"20 um\"" in str(
        too_fine(profile, 100e-6))


def test_exact_a_measured_trace_on_the_nodes_of_a_patch(data, tmp_path):
    """Coarse nodes see the means: their variance is what the waves keep after a box of one element."""
    nodes = np.linspace(-4.9e-3, 4.9e-3, 197)
    trace = level(cleaned(placed(mitutoyo(data, tmp_path), nodes), 1e-4))
    assert "the trace is centred, x moved by -4.997 mm" in trace.notes[0]
    gap = on_nodes(trace, nodes)
    fine = np.interp(np.linspace(nodes[0], nodes[-1], 196 * 50 + 1), trace.x, trace.z)
    box = np.convolve(fine, np.r_[0.5, np.ones(49), 0.5] / 50, "valid")[25::50]
    assert gap[1:-1] == pytest.approx(box[:195], abs=2e-8)


@pytest.mark.parametrize("name", ["xy-1.txt", "dektak-1.csv", "mitutoyo-2.csv.gz", "nanovea-test1.txt.gz", "sdf-1.sdf",
                                  "brb_surface_data.mat", "truth.json"])
def test_refuses_files_without_a_header_of_two_columns(data, name):
    with pytest.raises(PatchfemError, match=r"write the header as `x \[um\],z \[um\]`"):
        read_trace(data / name)


def test_exact_a_digitised_uneven_trace_in_blanks(data, tmp_path):
    path = tmp_path / "xy.txt"
    path.write_text("x [um] z [um]\n" + (data / "xy-1.txt").read_text())
    profile, known = read_trace(path), np.loadtxt(data / "xy-1.txt") * 1e-6
    assert profile.x == pytest.approx(known[:, 0], rel=1e-14) and profile.z == pytest.approx(known[:, 1], rel=1e-14)
    assert profile.notes == ()
