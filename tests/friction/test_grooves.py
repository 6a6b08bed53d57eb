"""Grooves that the load climbs: height, slope, limits and work by quadrature and by statics."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from patchfem.friction import Grooves


@pytest.mark.parametrize("mu", [0.0, 1e-4, 0.05, 0.4, 1.2])
@pytest.mark.parametrize("steep", [0.01, 0.8])
def test_exact_friction_work_by_quadrature(mu, steep):
    """Both branches of the closed form, over many waves and over a hundredth of one."""
    rng = np.random.default_rng(1)
    g = Grooves(80e-6, steep * 80e-6 / (2 * np.pi), rng.uniform(0, 6))
    for q0, q1 in (*rng.uniform(-3e-4, 3e-4, (3, 2)), (1e-5, 1.1e-5), (1e-5, 1e-5)):
        way = np.sign(q1 - q0)
        edges = np.linspace(q0, q1, 30)
        true = sum(
            way
            * quad(
                lambda q, way=way: mu * (1 + g.slope(q) ** 2) / (1 - way * mu * g.slope(q)),
                a,
                b,
                epsabs=0,
                epsrel=1e-12,
            )[0]
            for a, b in pairwise(edges)
        )
        assert g.friction_loss(q0, q1, mu) == pytest.approx(true, rel=1e-9, abs=1e-22)
        assert g.height_difference(q0, q1) == pytest.approx(g.height(q1) - g.height(q0), abs=1e-18)


@pytest.mark.parametrize("way", [-1, 1])
def test_exact_ratio_by_the_statics_of_the_flank(way):
    """Normal force R and friction mu R on a flank of angle a carry V upwards and F along x: the angle of friction."""
    g = Grooves(80e-6, 7.5e-6, 0.7)
    q = np.linspace(-1e-4, 1e-4, 9)
    mu = 0.35
    angle = np.arctan(g.slope(q))
    push = np.sin(angle) + way * mu * np.cos(angle)
    carried = np.cos(angle) - way * mu * np.sin(angle)
    np.testing.assert_allclose(g.force_ratio(q, way, mu), push / carried, rtol=1e-13)
    np.testing.assert_allclose(
        g.force_ratio(q, way, mu), np.tan(angle + way * np.arctan(mu)), rtol=1e-12
    )


def test_exact_slope_stiffness_and_capacity():
    g = Grooves(80e-6, 7.5e-6)
    load = 115.65
    mu = 0.4
    d = 1e-10
    q = np.linspace(0, 80e-6, 2001)
    np.testing.assert_allclose(g.slope(q), (g.height(q + d) - g.height(q - d)) / (2 * d), atol=1e-5)
    assert g.stiffness(load) == pytest.approx(load * (g.slope(d) - g.slope(-d)) / (2 * d), rel=1e-9)
    assert g.max_force(load, mu) == pytest.approx(load * g.force_ratio(q, 1, mu).max(), rel=1e-6)
    assert Grooves(80e-6, 7.5e-6).max_force(load, 2.0) == np.inf
    for one in (g, Grooves(80e-6, 1e-6)):  # the flanks of the second are less steep than the worst
        t = one.slope(q)
        assert one.min_mass_ratio(mu) == pytest.approx(
            (t * (t - mu) / (1 + mu * t)).min(), rel=1e-5
        )


@pytest.mark.parametrize("share", [0.5, 0.2])
def test_exact_what_is_worn_off_is_what_the_flanks_lose(share):
    """Per area: the volume between the cosines of both pieces and their valleys, before and after a mean depth."""
    q = np.linspace(0, 80e-6, 1000, endpoint=False)
    depth = 3e-6
    g = Grooves(80e-6, 7.5e-6)
    pieces = [
        g.after_wear(depth, share) if larger else g.after_wear(depth * part / (1 - part), share)
        for larger, part in ((True, max(share, 1 - share)), (False, min(share, 1 - share)))
    ]
    left = sum(float(one.height(q).mean()) for one in pieces)
    assert 2 * g.height(q).mean() - left == pytest.approx(depth, rel=1e-12)
    assert g.after_wear(depth, share).amplitude == min(one.amplitude for one in pieces)
    assert g.after_wear(7.6e-6 / max(share, 1 - share), share) is None
