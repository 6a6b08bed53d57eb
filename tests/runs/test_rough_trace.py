"""Pressure of a rough trace whose short waves only the points of the profile resolve."""

import numpy as np
import pytest
from scene_runs import find_sentences
from scene_texts import COULOMB, SLIDE

import patchfem as pf
from patchfem.scene import loads

LENGTH = 1.0  # mm
WAVELENGTHS = (5, 10, 20, 50, 100, 200)  # um
SCENE = """\
[contact]
length = "1 mm"
width = "10 mm"
height = "2 mm"
load = "7 N"
substrate = "Ti-6Al-4V"
[contact.profile]
file = "trace.csv"
heights = "surface"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a trace, a sum of sines of 5 to 200 um and noise."""
    folder = tmp_path_factory.mktemp("rough")
    random = np.random.default_rng(1)
    x = np.arange(0, 1000 * LENGTH + 0.25, 0.5)
    z = random.normal(0, 0.005, x.size)
    for wavelength in WAVELENGTHS:
        z += 0.002 * wavelength**0.8 * np.sin(2 * np.pi * x / wavelength + random.uniform(0, 6.28))
    np.savetxt(
        folder / "trace.csv", np.c_[x, z], delimiter=",", header="x [um],z [um]", comments=""
    )
    return folder


@pytest.fixture(scope="module")
def result(folder):
    """Return the run of a patch under the trace."""
    return pf.run(loads(SCENE, folder / "scene.toml"))


def test_exact_peak_pressure_of_rough_trace_is_that_of_its_pressure_field(result):
    """The peak pressure is that of the parabola at the largest pressure of the points, and its error is smaller than it.

    The largest pressure of the mesh, which smooths the trace, is 141 MPa.
    """
    peak = result.measures["pressure_peak"]
    assert 1 <= peak.value / result.fields["normal_stress"].max() < 1.01
    assert 141e6 < peak.value - peak.error / 2 < peak.value


def test_loaded_fraction_is_mean_over_peak_pressure(result):
    """The loaded fraction times the peak pressure is the mean pressure."""
    peak, fraction = (result.measures[name] for name in ("pressure_peak", "loaded_fraction"))
    mean = 7 / (10e-3 * 1e-3 * LENGTH)
    assert peak.value * fraction.value == pytest.approx(mean, rel=1e-9)
    assert fraction.error / fraction.value >= peak.error / peak.value
    surface = result.patch.points.surface
    moment = surface.x @ (surface.sigma_n * surface.weight)
    assert result.measures["moment"].value == pytest.approx(moment, abs=0.01 * 7 * 0.5e-3)
    data = result.to_xarray()
    assert float((data.weight * data.normal_stress[-1]).sum()) == pytest.approx(7, rel=1e-10)
    assert float(np.ptp(data.x.values)) == pytest.approx(1e-3, rel=1e-3)


def test_exact_note_says_what_is_given_on_the_points(result, folder):
    """Of a patch, pressure and gap are given on the points; of a motion, fields are those of the mesh."""
    motion = pf.run(loads(SCENE + COULOMB + SLIDE, folder / "scene.toml"))
    for notes, clause in (
        (
            result.notes,
            "pressure and gap of the interface are given on these points, but the stress",
        ),
        (motion.notes, "fields and motion are computed on the mesh of"),
    ):
        (note,) = find_sentences(notes, "each static measure is computed on the mesh and on points")
        assert clause in note
