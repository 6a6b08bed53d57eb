"""Closed forms compared with quadrature, arithmetic in many digits, and independent integration."""

import contact_forms as exact
import mpmath
import numpy as np
import pytest
from friction_forms import (
    reversal_force,
    weight_along,
)
from scipy.integrate import quad
from scipy.special import gamma
from vibration_forms import (
    decay,
    decay_rest,
    sliding_amplitude,
)

HERTZ_PARAMETERS = {"line_load": 1e5, "radius": 1.0, "modulus": 6.74e10}


# ---- line contact


def hertz_pressure(x):
    """Return the pressure of Hertz at places within the contact, from its half width and peak."""
    place = x / exact.hertz_half_width(**HERTZ_PARAMETERS)
    return exact.hertz_peak(**HERTZ_PARAMETERS) * np.sqrt(1 - place**2)


def test_exact_hertz_pressure_integrates_to_load():
    """Hertz's pressure integrates to the line load."""
    half = exact.hertz_half_width(**HERTZ_PARAMETERS)
    total, _ = quad(
        lambda t: half * np.cos(t) * hertz_pressure(half * np.sin(t)),
        -np.pi / 2,
        np.pi / 2,
    )
    assert total == pytest.approx(HERTZ_PARAMETERS["line_load"], rel=1e-12)


@pytest.mark.parametrize("fraction", [-0.7, -0.2, 0.1, 0.5, 0.9])
def test_exact_hertz_surface_slope_equals_crown_slope(fraction):
    """The surface slope of two half-planes under Hertz's pressure equals the slope x/R of the gap."""
    half = exact.hertz_half_width(**HERTZ_PARAMETERS)
    x = fraction * half
    principal, _ = quad(hertz_pressure, -half, half, weight="cauchy", wvar=x)
    assert -2 / (np.pi * HERTZ_PARAMETERS["modulus"]) * principal == pytest.approx(
        x / HERTZ_PARAMETERS["radius"], rel=1e-6
    )


def test_exact_combined_modulus_adds_compliances():
    """The inverse of the combined modulus is the sum of the compliances of both materials."""
    e = exact.combined_modulus(121e9, 0.32, 250e9, 0.24)
    assert 1 / e == pytest.approx((1 - 0.32**2) / 121e9 + (1 - 0.24**2) / 250e9, rel=1e-15)
    assert exact.combined_modulus(121e9, 0.32) == pytest.approx(
        121e9 / (2 * (1 - 0.32**2)), rel=1e-15
    )
    rigid = exact.combined_modulus(121e9, 0.32, np.inf, 0.0)
    assert rigid == pytest.approx(121e9 / (1 - 0.32**2), rel=1e-15)


# ---- bonds


@pytest.mark.parametrize("order", [-0.9, -0.5, 0.0, 0.4, 1.0, 2.0, 7.5])
def test_figure_13_weight_along_path(order):
    """The weight along the path (equation 2.14) agrees with many-digit arithmetic, has unit area, and peaks at R = p eps."""
    for x in (1e-12, 0.03, 1.0, 2.5, 40.0):
        with mpmath.workdps(30):
            expected = mpmath.mpf(x) ** order * mpmath.exp(-mpmath.mpf(x)) / mpmath.gamma(order + 1)
        assert weight_along(x, order) == pytest.approx(float(expected), rel=1e-13)
    power = 1 / (order + 1)  # the substitution x = t^power removes the singularity at x = 0
    area = quad(lambda t: weight_along(t**power, order) * power * t ** (power - 1), 0, 1)[0]
    area += quad(lambda x: weight_along(x, order), 1, np.inf)[0]
    assert area == pytest.approx(1, abs=1e-10)
    if order > 0:
        peak = weight_along(order, order)
        assert peak > weight_along(
            order * np.array([0.999, 1.001]), order
        ).max() and peak == pytest.approx(
            order**order * np.exp(-order) / gamma(order + 1), rel=1e-13
        )
    assert weight_along(0.0, order) == (np.inf if order < 0 else 1.0 if order == 0 else 0.0)


# ---- Coulomb vibration


@pytest.mark.parametrize(
    "start, friction, omega, time, position",
    [
        (11.5, 1, 1, 6 * np.pi, -0.5),
        (11, 1, 1, 5 * np.pi, -1),
        (11 + 1e-9, 1, 1, 6 * np.pi, -0.999999999),
        (1, 0.125, 1, 4 * np.pi, 0),
        (1, 0.13, 1, 4 * np.pi, -0.04),
        (1, 1 / 15, 2, 3.5 * np.pi, -1 / 15),
        (1, 1, 1, 0, 1),
    ],
)
def test_exact_decay_rest_time_and_position(start, friction, omega, time, position):
    """Time and position at which a Coulomb oscillator comes to rest agree with equation 3.11.

    The number of half cycles is rounded up.
    """
    assert decay_rest(start, friction, omega) == pytest.approx((time, position), abs=1e-12)
    assert decay(np.array([time, time + 50]), start, friction, omega) == pytest.approx(
        [position, position], abs=1e-12
    )


# ---- refusals


@pytest.mark.parametrize(
    "call",
    [
        lambda: exact.hertz_half_width(-1.0, 1.0, 1.0),
        lambda: exact.combined_modulus(0.0, 0.3),
        lambda: reversal_force(1.0, 1.0, -0.5),
        lambda: decay([-1.0], 1.0, 1.0, 1.0),
        lambda: sliding_amplitude(1.0, 0.9, 0.003),
    ],
)
def test_refuses_invalid_arguments(call):
    """Arguments outside the domain of a closed form raise ValueError."""
    with pytest.raises(ValueError):
        call()
