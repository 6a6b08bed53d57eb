"""Grooves that the load climbs: height, slope, limits and work, by quadrature and by statics."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from patchfem.friction import Grooves


@pytest.mark.parametrize("mu", [0.0, 1e-4, 0.05, 0.4, 1.2])
@pytest.mark.parametrize("max_slope", [0.01, 0.8])
def test_exact_groove_friction_work_agrees_with_quadrature(mu, max_slope):
    """The friction work over many waves and over a hundredth of a wave agrees with quadrature."""
    rng = np.random.default_rng(1)
    grooves = Grooves(80e-6, max_slope * 80e-6 / (2 * np.pi), rng.uniform(0, 6))
    for q0, q1 in (*rng.uniform(-3e-4, 3e-4, (3, 2)), (1e-5, 1.1e-5), (1e-5, 1e-5)):
        direction = np.sign(q1 - q0)
        edges = np.linspace(q0, q1, 30)
        expected = sum(
            direction
            * quad(
                lambda q, way=direction: (
                    mu * (1 + grooves.slope(q) ** 2) / (1 - way * mu * grooves.slope(q))
                ),
                a,
                b,
                epsabs=0,
                epsrel=1e-12,
            )[0]
            for a, b in pairwise(edges)
        )
        assert grooves.friction_loss(q0, q1, mu) == pytest.approx(expected, rel=1e-9, abs=1e-22)
        assert grooves.height_difference(q0, q1) == pytest.approx(
            grooves.height(q1) - grooves.height(q0), abs=1e-18
        )


@pytest.mark.parametrize("direction", [-1, 1])
def test_exact_force_ratio_agrees_with_flank_statics(direction):
    """The ratio of horizontal to vertical force on a flank agrees with statics, tan(angle + friction angle)."""
    grooves = Grooves(80e-6, 7.5e-6, 0.7)
    q = np.linspace(-1e-4, 1e-4, 9)
    mu = 0.35
    angle = np.arctan(grooves.slope(q))
    horizontal = np.sin(angle) + direction * mu * np.cos(angle)
    vertical = np.cos(angle) - direction * mu * np.sin(angle)
    np.testing.assert_allclose(
        grooves.force_ratio(q, direction, mu), horizontal / vertical, rtol=1e-13
    )
    np.testing.assert_allclose(
        grooves.force_ratio(q, direction, mu), np.tan(angle + direction * np.arctan(mu)), rtol=1e-12
    )


def test_exact_groove_slope_stiffness_and_max_force():
    """Slope and stiffness agree with differences of the height, and the maximum force with the maximum over a wave."""
    grooves = Grooves(80e-6, 7.5e-6)
    load = 115.65
    mu = 0.4
    d = 1e-10
    q = np.linspace(0, 80e-6, 2001)
    np.testing.assert_allclose(
        grooves.slope(q), (grooves.height(q + d) - grooves.height(q - d)) / (2 * d), atol=1e-5
    )
    assert grooves.stiffness(load) == pytest.approx(
        load * (grooves.slope(d) - grooves.slope(-d)) / (2 * d), rel=1e-9
    )
    assert grooves.max_force(load, mu) == pytest.approx(
        load * grooves.force_ratio(q, 1, mu).max(), rel=1e-6
    )
    assert Grooves(80e-6, 7.5e-6).max_force(load, 2.0) == np.inf
    for case in (
        grooves,
        Grooves(80e-6, 1e-6),
    ):  # the flanks of the second groove are less steep than the slope of the minimum
        slope = case.slope(q)
        assert case.min_mass_ratio(mu) == pytest.approx(
            (slope * (slope - mu) / (1 + mu * slope)).min(), rel=1e-5
        )


@pytest.mark.parametrize("fraction", [0.5, 0.2])
def test_exact_worn_volume_equals_mean_depth(fraction):
    """The volume that both pieces lose per area equals the mean wear depth."""
    q = np.linspace(0, 80e-6, 1000, endpoint=False)
    depth = 3e-6
    grooves = Grooves(80e-6, 7.5e-6)
    pieces = [
        grooves.after_wear(depth, fraction)
        if larger
        else grooves.after_wear(depth * smaller_part / (1 - smaller_part), fraction)
        for larger, smaller_part in (
            (True, max(fraction, 1 - fraction)),
            (False, min(fraction, 1 - fraction)),
        )
    ]
    remaining = sum(float(piece.height(q).mean()) for piece in pieces)
    assert 2 * grooves.height(q).mean() - remaining == pytest.approx(depth, rel=1e-12)
    assert grooves.after_wear(depth, fraction).amplitude == min(piece.amplitude for piece in pieces)
    assert grooves.after_wear(7.6e-6 / max(fraction, 1 - fraction), fraction) is None
