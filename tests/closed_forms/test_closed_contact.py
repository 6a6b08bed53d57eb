"""Closed forms of the punch with rounded edges, compared with quadrature on the half-plane."""

from itertools import pairwise

import contact_forms as exact
import numpy as np
import pytest
from scipy.integrate import quad

from patchfem.closed_forms import rounded_corner_contact, rounded_punch_half_width

MODULUS = 6.74e10


def _integrate(lo, hi, integrand, kinks=()):
    """Return the integral over lo..hi of a function that may have inverse square-root singularities at its ends.

    The interval is split at the `kinks`.
    """
    middle = (lo + hi) / 2
    half = (hi - lo) / 2
    size = abs(integrand(middle + 0.3 * half)) * half
    points = sorted(
        {-np.pi / 2, np.pi / 2, *(np.arcsin((k - middle) / half) for k in kinks if lo < k < hi)}
    )
    return sum(
        quad(
            lambda t: integrand(middle + half * np.sin(t)) * half * np.cos(t),
            a,
            b,
            limit=400,
            epsabs=1e-13 * size,
            epsrel=1e-10,
        )[0]
        for a, b in pairwise(points)
    )


def surface_slope(pressure, lo, hi, x, kinks=()):
    """Return d(inward displacement)/dx of two half-planes, 2/(pi E*) PV int p(s)/(s - x) ds, at any x."""
    local_pressure = pressure(x) if lo < x < hi else 0.0
    remainder = _integrate(
        lo, hi, lambda s: (pressure(s) - local_pressure) / (s - x) if s != x else 0.0, (*kinks, x)
    )
    return (
        2
        / (np.pi * MODULUS)
        * (remainder + (local_pressure * np.log((hi - x) / (x - lo)) if local_pressure else 0.0))
    )


# ---- the punch with rounded edges

FLAT_HALF_WIDTH, EDGE_RADIUS = 1e-3, 0.05
LOADS = [2.0, 3e3, 3e7]


@pytest.mark.parametrize("load", LOADS)
def test_exact_rounded_punch_pressure_balances_load(load):
    """The pressure of a punch with rounded edges integrates to the load."""
    half = rounded_punch_half_width(load, FLAT_HALF_WIDTH, EDGE_RADIUS, MODULUS)
    total = _integrate(
        -half,
        half,
        lambda x: exact.rounded_punch_pressure(x, load, FLAT_HALF_WIDTH, EDGE_RADIUS, MODULUS),
        (-FLAT_HALF_WIDTH, FLAT_HALF_WIDTH),
    )
    assert half > FLAT_HALF_WIDTH and total == pytest.approx(load, rel=1e-8)


@pytest.mark.share(0, 3, 6, 9)
@pytest.mark.parametrize("load", LOADS[1:])
@pytest.mark.parametrize("fraction", [-0.9, 0.0, 0.2, 0.6, 0.97])
def test_exact_rounded_punch_surface_slope_equals_shape(load, fraction):
    """The slope of the surface under a punch with rounded edges equals the slope of the punch."""
    half = rounded_punch_half_width(load, FLAT_HALF_WIDTH, EDGE_RADIUS, MODULUS)
    x = fraction * half
    computed = surface_slope(
        lambda s: float(
            exact.rounded_punch_pressure(s, load, FLAT_HALF_WIDTH, EDGE_RADIUS, MODULUS)
        ),
        -half,
        half,
        x,
        (-FLAT_HALF_WIDTH, FLAT_HALF_WIDTH),
    )
    expected = -np.sign(x) * max(abs(x) - FLAT_HALF_WIDTH, 0) / EDGE_RADIUS
    assert computed == pytest.approx(expected, abs=1e-6 * half / EDGE_RADIUS)


@pytest.mark.parametrize("load, radius", [(1e4, 2e-4), (1e3, 1e-5)])
def test_order_rounded_corner_is_limit_of_rounded_punch(load, radius):
    """Contact length and peak pressure of a rounded corner agree with a rounded punch of small radius within 1e-4."""
    flat = 4e-3
    modulus = 1e11
    reach, peak = rounded_corner_contact(load / np.pi / np.sqrt(2 * flat), radius, modulus)
    x = flat + np.linspace(-2, 1, 3001) * reach
    assert rounded_punch_half_width(load, flat, radius, modulus) - flat == pytest.approx(
        reach, rel=1e-4
    )
    assert exact.rounded_punch_pressure(x, load, flat, radius, modulus).max() == pytest.approx(
        peak, rel=1e-4
    )


# ---- refusals


def test_refuses_punch_without_flat_part():
    """Sizes that are not positive, and a flat part that is too short to affect the pressure, raise ValueError."""
    for flat, message in ((0.0, "flat must be positive"), (1e-12, "use the solution of Hertz")):
        with pytest.raises(ValueError, match=message):
            rounded_punch_half_width(1.0, flat, 1.0, 1.0)
