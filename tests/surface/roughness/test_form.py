"""Removal of form from traces and scans: polynomials, circles and cylinders of known size, and their radius."""

import re

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.surface import Profile, parse_form_option
from patchfem.surface.areal import Areal, level
from patchfem.surface.roughness.form import subtract_form

UM, MM = 1e-6, 1e-3


def make_trace(z, step=UM) -> Profile:
    """Return a trace of heights with a given step."""
    return Profile(np.arange(z.size) * step, z, "trace")


def circle_heights(x, radius, centre, offset) -> np.ndarray:
    """Return the heights of a circle."""
    return offset + np.sqrt(radius**2 - (x - centre) ** 2)


@pytest.mark.parametrize("form", [2, 7])
def test_exact_polynomial_form_is_removed(form):
    """A polynomial form is removed exactly, and the remaining heights agree with a dense least-squares fit."""
    rng = np.random.default_rng(form)
    x = np.linspace(-1, 1, 500)
    polynomial = np.polynomial.polynomial.polyval(x, rng.normal(size=form + 1)) * 1e-5
    z = rng.normal(size=500) * UM
    z[40:60] = np.nan
    expected, name = subtract_form(make_trace(z), form)
    flattened = subtract_form(make_trace(z + polynomial), form)[0]
    assert (
        name == f"polynomial of degree {form}"
        and np.nanmax(np.abs(flattened.z - expected.z)) < 1e-17
    )
    present = ~np.isnan(z)
    dense = np.polynomial.legendre.legvander(x[present], form)
    assert expected.z[present] == pytest.approx(
        z[present] - dense @ np.linalg.lstsq(dense, z[present])[0], abs=1e-18
    )


@pytest.mark.parametrize("degree", [1, 4])
def test_exact_scan_polynomial_agrees_with_least_squares(degree):
    """The polynomial that is removed from a scan with holes agrees with a dense least-squares fit."""
    rng = np.random.default_rng(degree)
    z = np.where(rng.random((40, 55)) < 0.3, np.nan, rng.normal(size=(40, 55)))
    scan = Areal(np.arange(55) * 2.0, np.arange(40) * 3.0, z, "scan")
    rows, columns = np.nonzero(~np.isnan(z))
    basis = np.column_stack(
        [
            (columns / 55) ** i * (rows / 40) ** j
            for i in range(degree + 1)
            for j in range(degree + 1 - i)
        ]
    )
    residual = z[rows, columns] - basis @ np.linalg.lstsq(basis, z[rows, columns])[0]
    assert level(scan, degree).z[rows, columns] == pytest.approx(residual, abs=1e-10)
    assert np.array_equal(np.isnan(level(scan, degree).z), np.isnan(z))


@pytest.mark.parametrize("sign", [1, -1])
def test_exact_circle_is_removed_from_trace(sign):
    """A circle of 5 mm radius in a trace of 4 mm is removed with a remainder below 0.1 nm, and its radius is stated."""
    x = np.arange(4001) * UM
    flat, name = subtract_form(
        make_trace(sign * circle_heights(x, 5 * MM, 1.6 * MM, -4 * MM)), "cylinder"
    )
    assert np.abs(flat.z).max() < 1e-10
    assert name == f"circle of radius 5 mm (90 % confidence), a {'crest' if sign > 0 else 'trough'}"


@pytest.mark.parametrize("degrees, tilt", [(0.0, 0.0), (25.0, 0.01), (140.0, 0.05)])
def test_exact_cylinder_is_removed_from_scan(degrees, tilt):
    """A tilted cylinder of 8 mm radius under a roughness of 0.1 um is removed within 5 nm.

    Its radius agrees within three times its error, and its axis within 0.1 degrees.
    """
    rng = np.random.default_rng(1)
    y, x = np.meshgrid(np.arange(150) * 10 * UM, np.arange(200) * 10 * UM, indexing="ij")
    c = np.cos(np.radians(degrees))
    s = np.sin(np.radians(degrees))
    u = c * x + s * y
    v = -s * x + c * y
    v = v - v.mean() + 0.1 * MM
    z = u * tilt - np.sqrt(1 + tilt**2) * (8 * MM - np.sqrt((8 * MM) ** 2 - v**2))
    rough = rng.normal(size=z.shape) * 0.1 * UM
    z = z + rough
    z[rng.random(z.shape) < 0.05] = np.nan
    flat, name = subtract_form(Areal(x[0], y[:, 0], z, "scan"), "cylinder")
    assert np.sqrt(np.nanmean((flat.z - rough) ** 2)) < 0.005 * UM
    radius, error, axis = re.fullmatch(
        r"cylinder of radius ([\d.]+) ± ([\d.]+) mm \(90 % confidence\), a crest whose "
        r"axis lies ([\d.]+) deg from x",
        name,
    ).groups()
    assert abs(float(radius) - 8) < 3 * float(error) < 0.03
    assert abs((float(axis) - degrees + 90) % 180 - 90) < 0.1


@pytest.mark.parametrize("count", [15, pytest.param(60, marks=pytest.mark.slow)])
def test_always_error_of_radius_covers_truth(count):
    """The error of the radius covers the truth for 90 % of made circles.

    The bound allows three standard deviations of the count and the bias of a jackknife of ten.
    """
    x = np.arange(1500) * UM
    n_covered = 0
    for seed in range(count):
        noise = (
            np.convolve(
                np.random.default_rng(seed).normal(size=x.size + 60), np.ones(61) / 61, "valid"
            )
            * UM
        )
        name = subtract_form(
            make_trace(circle_heights(x, 20 * MM, 0.7 * MM, 0) + noise), "cylinder"
        )[1]
        value, error = re.search(r"radius ([\d.]+) ± ([\d.]+) mm", name).groups()
        n_covered += abs(float(value) - 20) <= float(error)
    assert n_covered >= 0.9 * count - 3 * np.sqrt(0.09 * count) - count / 20


def test_exact_flat_trace_gives_lower_bound_of_radius():
    """A flat trace gives a lower bound of the radius."""
    z = np.random.default_rng(0).normal(size=2000) * UM
    assert re.fullmatch(
        r"circle, of a radius above [\d.]+ m+ \(90 % conf.*\)",
        subtract_form(make_trace(z), "cylinder")[1],
    )


@pytest.mark.parametrize("text", ["0", "10", "-1", "ball", "2.5", ""])
def test_refuses_unknown_form(text):
    """An unknown form or degree is refused."""
    with pytest.raises(PatchfemError, match="use a degree from 1"):
        parse_form_option(text)


def test_refuses_too_few_heights_for_form():
    """A trace or scan with too few heights for its form is refused."""
    with pytest.raises(PatchfemError, match="do not determine a polynomial of degree 5"):
        subtract_form(make_trace(np.where(np.arange(40) < 6, 1.0, np.nan)), 5)
    with pytest.raises(PatchfemError, match="a cylinder needs at least ten"):
        subtract_form(make_trace(np.where(np.arange(40) < 6, 1.0, np.nan)), "cylinder")
    line = np.full((20, 20), np.nan)
    line[4] = 1.0
    with pytest.raises(PatchfemError, match="do not determine a polynomial of degree 2"):
        subtract_form(Areal(np.arange(20.0), np.arange(20.0), line, "scan"), 2)
