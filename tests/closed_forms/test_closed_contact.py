"""Closed forms of contact compared with quadrature on the half-plane, transfer matrices in many digits, and strips."""

from itertools import pairwise

import contact_forms as exact
import mpmath
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from patchfem.closed_forms import rounded_corner_contact, rounded_punch_half_width

MODULUS = 6.74e10
TITANIUM, CARBIDE, THICKNESS = (121e9, 0.32), (250e9, 0.24), 152.4e-6


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


# ---- waves

WAVELENGTH, AMPLITUDE = 80e-6, 1.5e-6
FULL_CONTACT_PRESSURE = np.pi * MODULUS * AMPLITUDE / WAVELENGTH


def westergaard(x, fraction):
    """Return the pressure of a wavy surface under a fraction of the full-contact pressure (Westergaard 1939)."""
    angle = np.pi * x / WAVELENGTH
    if fraction >= 1:
        return FULL_CONTACT_PRESSURE * (fraction + np.cos(2 * angle))
    root = np.sqrt(np.maximum(fraction - np.sin(angle) ** 2, 0))
    return 2 * FULL_CONTACT_PRESSURE * np.abs(np.cos(angle)) * root


@pytest.mark.parametrize("fraction", [1e-5, 0.05, 0.5, 0.99, 1.0, 1.2])
def test_exact_wavy_surface_mean_pressure(fraction):
    """The mean pressure of the wavy surface agrees with the integral of its pressure."""
    parameters = fraction * FULL_CONTACT_PRESSURE, WAVELENGTH, AMPLITUDE, MODULUS
    half_width = exact.westergaard_half_width(*parameters)
    assert exact.westergaard_full_pressure(WAVELENGTH, AMPLITUDE, MODULUS) == pytest.approx(
        FULL_CONTACT_PRESSURE, rel=1e-15
    )
    assert _integrate(-half_width, half_width, lambda x: westergaard(x, fraction)) == pytest.approx(
        fraction * FULL_CONTACT_PRESSURE * WAVELENGTH, rel=1e-8
    )


@pytest.mark.parametrize("fraction", [0.05, 0.5, 0.99, 1.2])
@pytest.mark.parametrize("position", [0.1, -0.5, 0.93])
def test_exact_wavy_surface_pressure_flattens_wave(fraction, position):
    """The slope of the surface under the periodic pressure equals that of the wave inside the contact."""
    half_width = exact.westergaard_half_width(
        fraction * FULL_CONTACT_PRESSURE, WAVELENGTH, AMPLITUDE, MODULUS
    )
    x = position * half_width
    local_pressure = westergaard(x, fraction)

    def cot(s):
        return 1 / np.tan(np.pi * (s - x) / WAVELENGTH)

    def pair(y):  # both sides are added, so that the odd parts of the kernel cancel
        return sum(
            w * (westergaard(x + w * y, fraction) - local_pressure) * cot(x + y) for w in (1, -1)
        )

    near = half_width - abs(x)
    far = x - np.sign(x) * near
    remainder = _integrate(0.0, near, pair) + _integrate(
        min(-np.sign(x) * half_width, far),
        max(-np.sign(x) * half_width, far),
        lambda s: (westergaard(s, fraction) - local_pressure) * cot(s),
    )
    edge = (
        local_pressure
        * WAVELENGTH
        / np.pi
        * np.log(
            np.sin(np.pi * (half_width - x) / WAVELENGTH)
            / np.sin(np.pi * (half_width + x) / WAVELENGTH)
        )
    )
    computed = 2 / (WAVELENGTH * MODULUS) * (remainder + edge)
    assert computed == pytest.approx(
        -2 * np.pi * AMPLITUDE / WAVELENGTH * np.sin(2 * np.pi * x / WAVELENGTH), rel=1e-6
    )


# ---- the layered half plane


def transfer_compliance(k, coating, substrate, thickness):
    """Return the compliance C(k) of a layer on a half-plane by a transfer matrix in 50 digits."""

    def state_matrix(young, poisson):
        young = mpmath.mpf(young)
        poisson = mpmath.mpf(poisson)
        mu = young / (2 * (1 + poisson))
        lam = 2 * mu * poisson / (1 - 2 * poisson)
        stiff = lam + 2 * mu
        return mpmath.matrix(
            [
                [0, k, 0, 1 / mu],
                [-lam * k / stiff, 0, 1 / stiff, 0],
                [0, 0, 0, -k],
                [k**2 * (stiff - lam**2 / stiff), 0, k * lam / stiff, 0],
            ]
        )

    with mpmath.workdps(50):
        k = mpmath.mpf(k)
        substrate_matrix = state_matrix(*substrate)
        projector = (
            substrate_matrix - k * mpmath.eye(4)
        ) ** 2  # its columns span the states that decay with depth
        decaying = mpmath.matrix(4, 2)
        for row in range(4):
            decaying[row, 0] = projector[row, 0]
            decaying[row, 1] = projector[row, 1]
        surface_states = mpmath.expm(-state_matrix(*coating) * mpmath.mpf(thickness)) * decaying
        coefficients = mpmath.lu_solve(
            mpmath.matrix(
                [
                    [surface_states[2, 0], surface_states[2, 1]],
                    [surface_states[3, 0], surface_states[3, 1]],
                ]
            ),
            mpmath.matrix([-1, 0]),
        )
        return float(
            surface_states[1, 0] * coefficients[0] + surface_states[1, 1] * coefficients[1]
        )


@pytest.mark.parametrize("wavelength", [20e-6, 0.5e-3, 12.7e-3, 1.0])
@pytest.mark.parametrize(
    "pair",
    [
        (CARBIDE, TITANIUM),
        (TITANIUM, CARBIDE),
        ((600e9, 0.22), (120e9, 0.32)),
        ((1e9, 0.45), (200e9, 0.0)),
    ],
)
def test_exact_layered_compliance_agrees_with_transfer_matrix(wavelength, pair):
    """The compliance of a layered half-plane agrees with the transfer matrix within 1e-12."""
    k = 2 * np.pi / wavelength
    expected = transfer_compliance(k, *pair, THICKNESS)
    assert exact.layered_compliance(k, *pair, THICKNESS) == pytest.approx(expected, rel=1e-12)


# ---- tilted pads

PAD_PARAMETERS = {"load": 116.0, "length": 10e-3, "width": 10e-3, "stiffness": 1e13}
DECAY_LENGTH = 2.5e-6


@pytest.mark.parametrize("tilt", [1e-6, 2e-5, 2.32e-5, 1e-4, -3e-4, 3e-3])
def test_exact_wedge_on_springs_agrees_with_quadrature(tilt):
    """Contact fraction, centre and pressures of a tilted pad agree with springs pressed until they carry the load."""
    length = PAD_PARAMETERS["length"]
    width = PAD_PARAMETERS["width"]
    kn = PAD_PARAMETERS["stiffness"]
    zero = [0.0]

    def total(sink, arm=0.0):
        zero[0] = sink / tilt
        return _integrate(
            -length / 2, length / 2, lambda x: kn * width * max(sink - tilt * x, 0) * x**arm, zero
        )

    sink = brentq(
        lambda d: total(d) - PAD_PARAMETERS["load"], -abs(tilt) * length / 2, 1e-3, xtol=1e-18
    )
    fraction, centre, min_pressure, max_pressure = exact.wedge_on_linear_foundation(
        tilt, **PAD_PARAMETERS
    )
    edge = np.clip(sink / abs(tilt), -length / 2, length / 2)
    assert fraction == pytest.approx((edge + length / 2) / length, rel=1e-8)
    assert centre == pytest.approx(total(sink, 1) / PAD_PARAMETERS["load"], rel=1e-8)
    assert max_pressure == pytest.approx(kn * (sink + abs(tilt) * length / 2), rel=1e-8)
    assert min_pressure == pytest.approx(kn * max(sink - abs(tilt) * length / 2, 0), rel=1e-8)


@pytest.mark.parametrize("tilt", [0.0, 1e-9, 1.2e-5, 1.26e-5, 1e-4, -1e-3, 3e-3, 3e-2])
def test_exact_wedge_on_asperities_agrees_with_quadrature(tilt):
    """Contact fraction and centre of a tilted pad on exponential asperities agree with quadrature."""
    length = PAD_PARAMETERS["length"]
    edge = -np.sign(tilt) * length / 2
    points = edge - np.sign(edge or 1) * np.geomspace(1e-5, 1, 40) * length

    def total(weight):
        return _integrate(
            -length / 2,
            length / 2,
            lambda x: np.exp(-tilt * (x - edge) / DECAY_LENGTH) * weight(x),
            points,
        )

    fraction, centre = exact.wedge_on_asperities(tilt, length, DECAY_LENGTH)
    assert fraction == pytest.approx(total(lambda x: 1) / length, rel=1e-9)
    from_edge = total(lambda x: x - edge) / total(lambda x: 1)
    assert centre - edge == pytest.approx(from_edge, rel=1e-9, abs=1e-11 * length)


# ---- refusals


@pytest.mark.parametrize(
    "call",
    [
        lambda: rounded_punch_half_width(1.0, 0.0, 1.0, 1.0),
        lambda: exact.rounded_punch_pressure(0.0, 1.0, 1e-12, 1.0, 1.0),
        lambda: exact.westergaard_full_pressure(-1.0, 1.0, 1.0),
        lambda: exact.layered_compliance(0.0, TITANIUM, TITANIUM, 1.0),
        lambda: exact.layered_compliance(1.0, TITANIUM, TITANIUM, -1.0),
        lambda: exact.wedge_opening_tilt(1.0, 1.0, 0.0, 1.0),
        lambda: exact.wedge_on_linear_foundation(1.0, 1.0, -1.0, -1.0, 1.0),
        lambda: exact.wedge_on_linear_foundation(1.0, 1.0, 1.0, 0.0, 1.0),
        lambda: exact.wedge_on_asperities(1.0, 1.0, 0.0),
    ],
)
def test_refuses_invalid_contact_arguments(call):
    """Arguments outside the domain of a contact formula raise ValueError."""
    with pytest.raises(ValueError):
        call()
