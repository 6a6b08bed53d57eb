"""Extreme patches: tiny loads, thin and stiff coatings, spikes in profiles, and contact at a few
nodes."""

import numpy as np
import pytest
from contact_forms import hertz_half_width, hertz_peak
from scene_texts import PIECE

from patchfem import run
from patchfem.core import Outcome
from patchfem.runs.patch import grids
from patchfem.scene import loads

SIZE, WIDTH, LOAD = 12.7e-3, 12.7e-3, 115.653761996773
MODULUS = 121e9 / (1 - 0.31**2) / 2  # Combined modulus E* [Pa] of two pieces of the material below.
BLOCKS = (
    PIECE
    + """\
load = "26 lbf"
substrate = {young = "121 GPa", poisson = 0.31, density = "4370 kg/m^3"}
"""
)
COATING = (
    '[contact.coating]\nmaterial = {{young = "{} Pa", poisson = {}, density = "9000 kg/m^3"}}\n'
    'thickness = "{} m"\n'
)
COARSE = "contact.element_size=0.2 mm"


def run_and_check(*sets, text=BLOCKS):
    """Return the result of a scene after checks that hold for every scene: finite numbers, no
    tension, balanced forces."""
    scene = loads(text, "hard.toml", sets)
    result = run(scene)
    patch = result.patch
    for name, measure in result.measures.items():
        if measure.value is None:
            assert measure.reason, name
            continue
        assert np.isfinite(measure.value) and measure.error >= 0 and np.isfinite(measure.error), (
            name
        )
    for field in result.fields.values():
        assert np.isfinite(field).all()
    # The gap follows from the forces, and is closed where there is pressure
    pressure = patch.pressure
    force = pressure.sigma_n * patch.pieces.interface.weight
    error = patch.unloaded_gap - pressure.approach + patch.pieces.normal @ force - pressure.gap
    assert np.abs(error).max() <= 1e-9 * np.abs(patch.unloaded_gap - pressure.approach).max()
    assert force.min() >= 0 and pressure.gap.min() >= 0 and not (pressure.gap * force).any()
    if result.outcome is Outcome.DONE and scene.contact.load is not None:
        assert force.sum() == pytest.approx(scene.contact.load, rel=1e-9)
    return result


def measure_value(result, name) -> float:
    """Return the value of a measure."""
    return result.measures[name].value


def error_covers(result, name, reference) -> bool:
    """Return whether the error of a measure covers a reference value."""
    measure = result.measures[name]
    return abs(measure.value - reference) <= measure.error


def assert_errors_cover_hertz(result, load) -> tuple:
    """Assert that the errors under a load [N] on a crown of radius 1 mm cover half-width [m] and peak [Pa]; return both."""
    half, peak = (f(load / WIDTH, 1e-3, MODULUS) for f in (hertz_half_width, hertz_peak))
    for name, reference in (
        ("pressure_peak", peak),
        ("contact_half_width", half),
        ("contact_fraction", 2 * half / SIZE),
    ):
        assert error_covers(result, name, reference), name
    return half, peak


@pytest.fixture
def coarse_meshes(monkeypatch):
    """Limit automatic meshes to 1/36 of the usual cost."""
    predict = grids.predict_condensing_seconds
    monkeypatch.setattr(grids, "predict_condensing_seconds", lambda meshes: 36 * predict(meshes))


@pytest.mark.share(0)
@pytest.mark.parametrize(("load", "error"), [(1e-3, 2e-2), (1e-6, 3e-2)])
def test_exact_sharp_crown_agrees_with_hertz(load, error, coarse_meshes):
    """A crown of radius 1 mm agrees with Hertz theory for contacts of 80 nm and of 2.4 nm."""
    result = run_and_check(
        "contact.crown.radius=1 mm", f"contact.load={load} N", "accuracy.tolerance=1e-2"
    )
    half, peak = assert_errors_cover_hertz(result, load)
    assert measure_value(result, "pressure_peak") == pytest.approx(peak, rel=error)
    assert measure_value(result, "contact_half_width") == pytest.approx(half, rel=2 * error)


@pytest.mark.parametrize("load", [1e-6, 30.0])
def test_always_errors_of_single_node_contact_cover_hertz(load):
    """Elements of 0.2 mm cannot resolve contacts of 0.7 um to 4 um; the errors cover the difference
    from Hertz theory."""
    result = run_and_check("contact.crown.radius=1 mm", f"contact.load={load} N", COARSE)
    assert_errors_cover_hertz(result, load)
    assert result.patch.active.sum() == 1 and measure_value(result, "normal_load") == pytest.approx(
        load, rel=1e-12
    )
    assert any("the tolerance is" in line for line in result.warnings)


def test_soft_thin_coating_agrees_with_winkler_foundation():
    """A thin bonded coating 1000 times softer than the pieces acts as a Winkler foundation of
    stiffness k = (lambda + 2 mu)/t, with both coatings in series.

    Under a crown p = k (a^2 - x^2)/(2 R) and a^3 = 3 P R/(2 k); the contact is 60 times wider than
    the coating is thick.
    """
    young = 121e6
    nu = 0.3
    thick = 50e-6
    radius = 1.0
    foundation_stiffness = young * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / thick / 2
    half = (3 * LOAD / WIDTH * radius / (2 * foundation_stiffness)) ** (1 / 3)
    result = run_and_check(
        "contact.crown.radius=1 m",
        "contact.element_size=0.1 mm",
        text=BLOCKS + COATING.format(young, nu, thick),
    )
    assert half / thick > 20 and half < 0.45 * SIZE
    assert measure_value(result, "pressure_peak") == pytest.approx(
        foundation_stiffness * half**2 / (2 * radius), rel=0.02
    )
    assert measure_value(result, "contact_half_width") == pytest.approx(half, abs=0.1e-3)
    assert error_covers(result, "contact_half_width", half)


def test_stiff_thick_coating_agrees_with_hertz(coarse_meshes):
    """A contact on a coating 1000 times stiffer and 20 half-widths thick agrees with Hertz theory
    for the modulus of the coating."""
    young = 121e12
    nu = 0.2
    thick = 0.5e-3
    radius = 0.1
    modulus = young / (1 - nu**2) / 2
    line = LOAD / WIDTH
    half = hertz_half_width(line, radius, modulus)
    result = run_and_check(
        "contact.crown.radius=0.1 m",
        "accuracy.tolerance=1e-2",
        text=BLOCKS + COATING.format(young, nu, thick),
    )
    assert thick / half > 20
    assert measure_value(result, "pressure_peak") == pytest.approx(
        hertz_peak(line, radius, modulus), rel=0.01
    )
    assert measure_value(result, "contact_half_width") == pytest.approx(half, rel=0.02)
