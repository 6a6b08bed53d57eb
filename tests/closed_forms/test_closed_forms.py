"""The shipped exact answers against quadrature, many-digit arithmetic and integration that know nothing of them."""

import mpmath
import numpy as np
import pytest
from friction_forms import (
    growth_factor,
    jenkins_loop,
    reversal_force,
    steady_bond_length,
    stretch_loop,
    virgin_force,
    weight_across,
    weight_along,
)
from scipy.integrate import quad
from scipy.special import gamma
from vibration_forms import (
    bounded_input,
    decay,
    decay_rest,
    sliding_amplitude,
    two_stop_amplitude,
    two_stop_relation,
)

from patchfem.closed_forms import contact as exact

HERTZ = {"line_load": 1e5, "radius": 1.0, "modulus": 6.74e10}


# ---- line contact


def test_exact_hertz_pressure_carries_the_load():
    half = exact.hertz_half_width(**HERTZ)
    total, _ = quad(
        lambda t: half * np.cos(t) * exact.hertz_pressure(half * np.sin(t), **HERTZ),
        -np.pi / 2,
        np.pi / 2,
    )
    assert total == pytest.approx(HERTZ["line_load"], rel=1e-12)


@pytest.mark.parametrize("share", [-0.7, -0.2, 0.1, 0.5, 0.9])
def test_exact_hertz_pressure_flattens_the_crown(share):
    """Slope of two half planes under p: 2/(pi E*) PV int p(s)/(x - s) ds must equal the slope x/R of the gap."""
    half = exact.hertz_half_width(**HERTZ)
    x = share * half
    principal, _ = quad(
        lambda s: exact.hertz_pressure(s, **HERTZ), -half, half, weight="cauchy", wvar=x
    )
    assert -2 / (np.pi * HERTZ["modulus"]) * principal == pytest.approx(
        x / HERTZ["radius"], rel=1e-6
    )


def test_exact_hertz_peak_and_outside():
    half = exact.hertz_half_width(**HERTZ)
    p = exact.hertz_pressure(np.array([0.0, half, 1.01 * half]), **HERTZ)
    assert (
        p[0] == pytest.approx(exact.hertz_peak(**HERTZ), rel=1e-15)
        and p[1] < 1e-6 * p[0]
        and p[2] == 0
    )


def test_exact_combined_modulus_is_two_compliances_in_series():
    e = exact.combined_modulus(121e9, 0.32, 250e9, 0.24)
    assert 1 / e == pytest.approx((1 - 0.32**2) / 121e9 + (1 - 0.24**2) / 250e9, rel=1e-15)
    assert exact.combined_modulus(121e9, 0.32) == pytest.approx(
        121e9 / (2 * (1 - 0.32**2)), rel=1e-15
    )


# ---- bonds


def test_exact_steady_friction_of_2_18_and_2_11():
    """mu = 0.6 (eps/eps_0) at 0.5, 5 and 50 mm/s: 0.58, 0.43333, 0.420144."""
    args = {"length": 2e-6, "ratio": 0.7, "rest_growth": 10.0, "slip_growth": 0.2e-6}
    for v, mu in ((5e-4, 0.58), (5e-3, 13 / 30), (5e-2, 0.420144)):
        share = steady_bond_length(v, **args) / 2e-6
        assert 0.6 * share == pytest.approx(mu, abs=1e-6)
        # int phi_1(R/eps) dR/eps_0
        bonds, _ = quad(lambda x, c=share: x / c * np.exp(-x / c), 0, 80 * share)
        assert share == pytest.approx(bonds, rel=1e-9)


@pytest.mark.parametrize("order", [-0.9, -0.5, 0.0, 0.4, 1.0, 2.0, 7.5])
def test_figure_13_weight_along_the_path(order):
    """2.14 by many-digit arithmetic; unit area; where p > 0 the largest value stands at R = p eps."""
    for x in (1e-12, 0.03, 1.0, 2.5, 40.0):
        with mpmath.workdps(30):
            want = mpmath.mpf(x) ** order * mpmath.exp(-mpmath.mpf(x)) / mpmath.gamma(order + 1)
        assert weight_along(x, order) == pytest.approx(float(want), rel=1e-13)
    power = 1 / (order + 1)  # x = t^power takes the infinity at x = 0 away
    area = quad(lambda t: weight_along(t**power, order) * power * t ** (power - 1), 0, 1)[0]
    area += quad(lambda x: weight_along(x, order), 1, np.inf)[0]
    assert area == pytest.approx(1, abs=1e-10)
    if order > 0:
        top = weight_along(order, order)
        assert top > weight_along(
            order * np.array([0.999, 1.001]), order
        ).max() and top == pytest.approx(
            order**order * np.exp(-order) / gamma(order + 1), rel=1e-13
        )
    assert weight_along(0.0, order) == (np.inf if order < 0 else 1.0 if order == 0 else 0.0)


def test_figure_14_weight_across_the_path():
    """2.15 by many-digit arithmetic; unit area over eta/rho; 68.27 % of it within one rho."""
    for y in (0.0, -0.3, 1.0, 4.0, 20.0):
        with mpmath.workdps(30):
            want = mpmath.exp(-(mpmath.mpf(y) ** 2) / 2) / mpmath.sqrt(2 * mpmath.pi)
        assert weight_across(y) == pytest.approx(float(want), rel=1e-13)
    assert quad(weight_across, -np.inf, np.inf)[0] == pytest.approx(1, abs=1e-12)
    assert quad(weight_across, -1, 1)[0] == pytest.approx(
        float(mpmath.erf(1 / mpmath.sqrt(2))), abs=1e-14
    )
    assert weight_across(0) == pytest.approx(0.39894228, abs=1e-8)


def test_refuses_weights_that_do_not_exist():
    for bad in ((0.5, -1.0), (-0.1, 1.0)):
        with pytest.raises(ValueError):
            weight_along(*bad)
    for bad in ((-0.1, 1.0), (0.5, -1.0)):
        with pytest.raises(ValueError):
            growth_factor(*bad)


@pytest.mark.share(0, 5, 10, 15, 20, 27)
@pytest.mark.parametrize("share", [1e-6, 0.01, 0.1, 0.5, 1.0, 5.0, 10.0])
@pytest.mark.parametrize("order", [-0.5, 0.0, 1.0, 2.0])
def test_exact_growth_factor_by_many_digit_quadrature(share, order):
    def phi(s):
        y = s / -mpmath.expm1(-s / share)
        return y**order * mpmath.exp(-y)

    cuts = sorted(
        {0, share / 4, *(share * 4**k for k in range(6)), 1, 4, 12, order + 40, order + 120}
    )
    want = float(mpmath.quad(phi, cuts) / mpmath.gamma(order + 1))
    assert growth_factor(share, order) == pytest.approx(want, rel=1e-11)


# ---- Coulomb vibration


@pytest.mark.parametrize(
    "start, friction, omega, time, place",
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
def test_exact_rest_of_3_11_with_the_count_rounded_up(start, friction, omega, time, place):
    assert decay_rest(start, friction, omega) == pytest.approx((time, place), abs=1e-12)
    assert decay(np.array([time, time + 50]), start, friction, omega) == pytest.approx(
        [place, place], abs=1e-12
    )


def test_exact_bounded_input_is_four_over_pi():
    assert bounded_input(4.0) == pytest.approx(5.09295817894, rel=1e-11)


@pytest.mark.parametrize(
    "friction, want, within",
    [
        (0.95, 0.006603, 1e-6),
        (0.9, 0.032368, 1e-6),
        (0.85, 0.096925, 1e-6),
        (0.828, 0.152702, 1e-6),
        (0.8, 0.299431041748427515, 1e-12),
        (0.79, 0.435537658848, 1e-11),
        (0.786, 0.599134, 1e-6),
        (np.pi / 4 + 1e-6, 0.76259, 1e-5),
    ],
)
def test_exact_two_stop_amplitude(friction, want, within):
    assert two_stop_amplitude(friction) == pytest.approx(want, abs=within)


@pytest.mark.parametrize("miss", [1e-8, 1e-6, 0.99e-4, 1.01e-4, 1e-3])
def test_exact_two_stop_amplitude_near_onset_in_60_digits(miss):
    with mpmath.workdps(60):

        def ends(s):
            t = mpmath.atan2(s * mpmath.sin(s), mpmath.sin(s) - s * mpmath.cos(s))
            d = (
                mpmath.sin(t) * (1 + mpmath.cos(s))
                + mpmath.cos(t) * mpmath.sin(s) / 2
                - s / 2 * mpmath.cos(t + s)
            ) / 2
            return d, d - mpmath.sin(t)

        friction = mpmath.mpf(1 - miss)
        s = mpmath.findroot(lambda s: ends(s)[0] - friction, mpmath.sqrt(18 * miss))
        want = float(ends(s)[1])
    assert two_stop_amplitude(1 - miss) == pytest.approx(want, rel=2e-7)


def test_exact_two_stop_limits():
    assert two_stop_amplitude(1.0) == 0 and two_stop_amplitude(0.785) == np.inf
    assert two_stop_amplitude(np.pi / 4) == pytest.approx(np.pi / 4, abs=1e-12)
    friction, top = two_stop_relation(np.pi - 1e-6)
    assert friction == pytest.approx(np.pi / 4, abs=1e-9) and top == pytest.approx(
        np.pi / 4, abs=1e-5
    )


# ---- refusals


@pytest.mark.parametrize(
    "call",
    [
        lambda: exact.hertz_half_width(-1.0, 1.0, 1.0),
        lambda: exact.combined_modulus(0.0, 0.3),
        lambda: steady_bond_length(1.0, 1.0, 1.0, -1.0, 1.0),
        lambda: virgin_force(-1.0, 1.0),
        lambda: virgin_force(1.0, 1.0, -1.0),
        lambda: reversal_force(1.0, 1.0, reading="printed"),
        lambda: reversal_force(-1.0, 1.0),
        lambda: reversal_force(1.0, 1.0, -0.5),
        lambda: reversal_force(1.0, 1.0, -1.5, "report"),
        lambda: stretch_loop(0.0, 1.0),
        lambda: jenkins_loop(-1.0, 1.0),
        lambda: decay(1.0, 1.0, 0.0, 1.0),
        lambda: decay([-1.0], 1.0, 1.0, 1.0),
        lambda: sliding_amplitude(1.0, 0.5),
        lambda: sliding_amplitude(1.0, 0.9, 0.003),
        lambda: sliding_amplitude(0.9, -0.1, 0.003),
        lambda: two_stop_relation(np.pi),
    ],
)
def test_refuses_arguments_without_a_meaning(call):
    with pytest.raises(ValueError):
        call()
