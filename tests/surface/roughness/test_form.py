"""Forms of traces and scans: polynomials, circles and cylinders of known truth are taken off, and their radius told."""

import re

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.surface import Profile, parse_form
from patchfem.surface.areal import Areal, level
from patchfem.surface.roughness.form import subtract_form

UM, MM = 1e-6, 1e-3


def trace(z, step=UM) -> Profile:
    return Profile(np.arange(z.size) * step, z, "trace")


def circle(x, radius, at, lift) -> np.ndarray:
    return lift + np.sqrt(radius**2 - (x - at) ** 2)


@pytest.mark.parametrize("form", [2, 3, 7])
def test_exact_a_polynomial_is_taken_off_and_nothing_else(form):
    rng = np.random.default_rng(form)
    x = np.linspace(-1, 1, 500)
    bent = np.polynomial.polynomial.polyval(x, rng.normal(size=form + 1)) * 1e-5
    z = rng.normal(size=500) * UM
    z[40:60] = np.nan
    alone, name = subtract_form(trace(z), form)
    again = subtract_form(trace(z + bent), form)[0]
    assert name == f"polynomial of degree {form}" and np.nanmax(np.abs(again.z - alone.z)) < 1e-17
    there = ~np.isnan(z)
    dense = np.polynomial.legendre.legvander(x[there], form)
    assert alone.z[there] == pytest.approx(
        z[there] - dense @ np.linalg.lstsq(dense, z[there])[0], abs=1e-18
    )


@pytest.mark.parametrize("degree", [1, 2, 4])
def test_exact_the_polynomial_of_a_scan_of_a_dense_least_squares_solve(degree):
    rng = np.random.default_rng(degree)
    z = np.where(rng.random((40, 55)) < 0.3, np.nan, rng.normal(size=(40, 55)))
    scan = Areal(np.arange(55) * 2.0, np.arange(40) * 3.0, z, "scan")
    rows, columns = np.nonzero(~np.isnan(z))
    base = np.column_stack(
        [
            (columns / 55) ** i * (rows / 40) ** j
            for i in range(degree + 1)
            for j in range(degree + 1 - i)
        ]
    )
    rest = z[rows, columns] - base @ np.linalg.lstsq(base, z[rows, columns])[0]
    assert level(scan, degree).z[rows, columns] == pytest.approx(rest, abs=1e-10)
    assert np.array_equal(np.isnan(level(scan, degree).z), np.isnan(z))


@pytest.mark.parametrize("sign", [1, -1])
def test_exact_a_circle_under_a_trace(sign):
    """A ball of 5 mm seen over 4 mm, off its middle: 0.1 nm is left, and the radius is told to 1e-6."""
    x = np.arange(4001) * UM
    flat, name = subtract_form(trace(sign * circle(x, 5 * MM, 1.6 * MM, -4 * MM)), "cylinder")
    assert np.abs(flat.z).max() < 1e-10
    assert name == f"circle of radius 5 mm (90 % confidence), a {'crest' if sign > 0 else 'trough'}"


@pytest.mark.parametrize("degrees, tilt", [(0.0, 0.0), (25.0, 0.01), (140.0, 0.05)])
def test_exact_a_cylinder_under_a_scan(degrees, tilt):
    """Radius 8 mm, its axis turned and tilted: heights by the distance of a line, roughness of 0.1 um on top."""
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
def test_always_the_error_of_a_radius_holds(count):
    """90 of 100 made circles hold theirs, less three deviations of the count and 5 of 60 for a jackknife of ten."""
    x = np.arange(1500) * UM
    held = 0
    for seed in range(count):
        noise = (
            np.convolve(
                np.random.default_rng(seed).normal(size=x.size + 60), np.ones(61) / 61, "valid"
            )
            * UM
        )
        name = subtract_form(trace(circle(x, 20 * MM, 0.7 * MM, 0) + noise), "cylinder")[1]
        value, error = re.search(r"radius ([\d.]+) ± ([\d.]+) mm", name).groups()
        held += abs(float(value) - 20) <= float(error)
    assert held >= 0.9 * count - 3 * np.sqrt(0.09 * count) - count / 20


def test_exact_a_flat_trace_tells_a_least_radius():
    z = np.random.default_rng(0).normal(size=2000) * UM
    assert re.fullmatch(
        r"circle, of a radius above [\d.]+ m+ \(90 % conf.*\)",
        subtract_form(trace(z), "cylinder")[1],
    )


@pytest.mark.parametrize("text", ["0", "10", "-1", "ball", "2.5", ""])
def test_refuses_a_form(text):
    with pytest.raises(PatchfemError, match="use a degree from 1"):
        parse_form(text)


def test_refuses_too_few_heights():
    with pytest.raises(PatchfemError, match="do not determine a polynomial of degree 5"):
        subtract_form(trace(np.where(np.arange(40) < 6, 1.0, np.nan)), 5)
    with pytest.raises(PatchfemError, match="a cylinder needs at least ten"):
        subtract_form(trace(np.where(np.arange(40) < 6, 1.0, np.nan)), "cylinder")
    line = np.full((20, 20), np.nan)
    line[4] = 1.0
    with pytest.raises(PatchfemError, match="do not determine a polynomial of degree 2"):
        subtract_form(Areal(np.arange(20.0), np.arange(20.0), line, "scan"), 2)
