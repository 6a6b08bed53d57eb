"""Profiles on automatic meshes: they are averaged over lengths that follow the tolerance."""

from __future__ import annotations

import contact_forms
import numpy as np
import pytest
from scene_texts import COATED

import patchfem as pf
from patchfem import build
from patchfem.closed_forms import rounded_punch_half_width
from patchfem.runs.patch import profile_points as trace
from patchfem.runs.patch.limits import extrapolate_to_zero_cell_length
from patchfem.scene import loads


def load_profile(tmp_path, x, z, text, *settings):
    """Return a scene with a profile x, z [m]."""
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(x.tolist(), z.tolist()))
    (tmp_path / "trace.csv").write_text(f"x [m],z [m]\n{rows}\n", "utf-8")
    scene = text + '[contact.profile]\nfile = "trace.csv"\n'
    return loads(scene, tmp_path / "scene.toml", sets=settings)


def test_exact_rounded_punch_as_profile_agrees_with_closed_form(tmp_path, tolerance=1e-3):
    """Peak pressure and half-width agree with the closed form within the errors plus 2e-3, because
    the flat is not small against the pieces. Averages over 1/200 of the length were wrong by 12 %
    with an error of 0.1 %."""
    flat = 0.5e-3
    radius = 20e-3
    load = 5e4
    x = np.linspace(-8e-3, 8e-3, 8001)
    z = np.maximum(np.abs(x) - flat, 0) ** 2 / (2 * radius)
    text = (
        '[contact]\nlength = "16 mm"\nwidth = "1 m"\nheight = "8 mm"\nload = "50 kN"\n'
        'substrate = {young = "120 GPa", poisson = 0.32, density = "4370 kg/m^3"}\n'
    )
    result = pf.run(load_profile(tmp_path, x, z, text))
    modulus = contact_forms.combined_modulus(120e9, 0.32)
    half = rounded_punch_half_width(load, flat, radius, modulus)
    peak = contact_forms.rounded_punch_pressure(
        np.linspace(flat, half, 4001), load, flat, radius, modulus
    ).max()
    for name, reference, rel_tol in (
        ("pressure_peak", peak, 2e-3),
        ("contact_half_width", half, 4e-4),
    ):
        measure = result.measures[name]
        assert abs(measure.value - reference) <= measure.error + rel_tol * reference, name
        assert measure.error <= tolerance * reference or result.warnings


def test_always_error_of_peak_contains_the_rise_at_a_corner(tmp_path):
    """The error of the peak covers its change on a mesh four times finer, on which the pressure at a corner that the
    profile just reaches has become the largest one."""
    s = np.linspace(-1, 1, 501)
    z = -0.48e-6 * np.cos(np.pi * s + 2.42) - 0.25e-6 * np.cos(2 * np.pi * s + 3.52)
    text = (
        '[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\n'
        'load = "1100 N"\nsubstrate = "steel"\n'
    )
    coarse, fine = (
        pf.run(load_profile(tmp_path, 6.35e-3 * s, z, text, f"contact.element_size={size} mm"))
        for size in (0.2, 0.05)
    )
    one, other = (result.measures["pressure_peak"] for result in (coarse, fine))
    assert abs(one.value - other.value) <= one.error + other.error
    places = [abs(each.patch.x[each.patch.pressure.sigma_n.argmax()]) for each in (coarse, fine)]
    assert places[0] < 6.3e-3 and places[1] == pytest.approx(6.35e-3)


# Contact length [m], approach [m], peak [Pa] and stiffness [N/m] of elements of order 5
# (support/patch_of_order_four.py of version 1.10 agrees).
CROWN_REFERENCE = (2 * 3.7177189e-4, 2.8687086e-7, 1.46972585e7, 3.66814797e10 * 12.7e-3)


def test_exact_profile_on_points_agrees_with_independent_program(tmp_path):
    """A crown of 1 m, read from a file of 1001 samples and solved on points, agrees with an
    independent program within the errors."""
    x = np.linspace(-6.35e-3, 6.35e-3, 1001)
    text = COATED.replace('element_size = "0.5 mm"\n', "")
    patch_model = build(load_profile(tmp_path, x, x**2 / 2, text)).patch
    assert trace.can_use_points(patch_model)
    measures = trace.solve_on_points(patch_model, lambda measures: True).measures
    names = ("contact_half_width", "approach", "pressure_peak", "normal_stiffness")
    for name, reference in zip(names, (CROWN_REFERENCE[0] / 2, *CROWN_REFERENCE[1:]), strict=True):
        value, error = measures[name].value, measures[name].error
        assert abs(value - reference) <= error + 5e-6 * reference, name
        assert error <= 1e-3 * reference, name


def test_refuses_profile_without_heights(tmp_path):
    """A profile without heights is refused with its file name and what a trace needs."""
    x = np.linspace(0, 12.7e-3, 50)
    with pytest.raises(
        pf.PatchfemError, match=r"trace\.csv: 0 heights; a trace needs at least two"
    ):
        pf.run(load_profile(tmp_path, x, np.full(50, np.nan), COATED))


def test_exact_surface_trace_agrees_with_inverted_gap(tmp_path):
    """Peaks of a trace are material: a trace z gives the result of the gap -z to the last bit."""
    x = np.linspace(-6.35e-3, 6.35e-3, 2001)
    z = 1e-6 * np.cos(500 * np.pi * x) - x**2 / 6
    surface, gap, other_gap = (
        pf.run(
            load_profile(tmp_path, x, sign * z, COATED),
            **{"contact.profile.heights": kind, "contact.profile.on": "lower"},
        )
        .measures["approach"]
        .value
        for sign, kind in ((1, "surface"), (-1, "gap"), (1, "gap"))
    )
    assert surface == gap and other_gap > 1.1 * gap


def test_exact_series_of_measured_profile_has_error_of_its_remainder():
    """The tangential stiffness [N/um] of a rough trace on four meshes is extrapolated to 1339.48; finer meshes show 1339.10.

    The errors of a series whose gap is the same on all meshes do not change.
    """
    values = [1359.1453, 1346.1032, 1341.7500, 1340.2592]
    limit = extrapolate_to_zero_cell_length(values, has_same_gap=False)
    assert abs(limit.extrapolated - 1339.10) <= limit.extrapolated_error <= 0.8
    same = extrapolate_to_zero_cell_length(values)
    assert same.extrapolated_error == pytest.approx(0.194, abs=0.001)
