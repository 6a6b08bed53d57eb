"""The layer of asperities: limits, quadrature, scaling, stiffness and random gaps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from pieces import LENGTH, LOAD, WIDTH, draw_gap, make_coated_pair
from pressed import press
from scipy.integrate import quad
from scipy.stats import norm
from skins import press_layer, stretch_law

from patchfem.contact import (
    ExponentialAsperities,
    HertzAsperities,
    LinearAsperities,
)
from patchfem.contact.asperity_laws import peak_integral
from patchfem.core import PatchfemError

AREA = LENGTH * WIDTH
MEAN_PRESSURE = LOAD / AREA
HERTZ_LAYER = HertzAsperities(radius=10e-6, density=1e10, deviation=1e-6, modulus=1.3e11)
LAYERS = {
    "linear": LinearAsperities(1e13),
    "exponential": ExponentialAsperities(0.5e-6, 1e6),
    "hertz": HERTZ_LAYER,
}
each_layer = pytest.mark.parametrize("layer", LAYERS.values(), ids=LAYERS.keys())


def pair_arrays(n_elements=100):
    """Return the normal compliance, the nodes and the nodal areas of the coated pair."""
    pair = make_coated_pair(n_elements)
    return pair.normal, pair.interface.x, pair.interface.weight


# ---- limit of bare contact
GAPS = {
    "flat": lambda x: 0 * x,
    "tilt": lambda x: 1e-4 * x,
    "rough": lambda x: draw_gap(np.random.default_rng(5), x, 3e-7),
}


@pytest.mark.parametrize("layer", [ExponentialAsperities(1e-6, MEAN_PRESSURE), HERTZ_LAYER])
def test_order_one_thin_layers_converge_to_bare_contact(layer):
    """The pressure with a thin layer converges to that of bare contact with the thickness, up to a logarithm."""
    compliance, x, weight = pair_arrays()
    gap = GAPS["tilt"](x)
    bare = press(make_coated_pair(100), gap, LOAD).sigma_n
    errors = [
        np.abs(
            press_layer(stretch_law(layer, t), compliance, x, weight, gap, LOAD).pressure - bare
        ).max()
        / bare.max()
        for t in (1e-3, 1e-4, 1e-5, 1e-6)
    ]
    assert errors[3] < 2e-3 and all(6 < a / b < 14 for a, b in pairwise(errors[1:]))


@each_layer
@pytest.mark.parametrize("offset", [-6.2e-3])
def test_exact_layer_controls_give_same_forces(layer, offset):
    """Prescribing the rotation and the approach that moment control returned gives the same forces."""
    compliance, x, weight = pair_arrays()
    gap = 2e-5 * x + draw_gap(np.random.default_rng(3), x, 1e-7)
    free = press_layer(layer, compliance, x, weight, gap, LOAD, LOAD * offset)
    prescribed_rotation = press_layer(
        layer, compliance, x, weight, gap + free.theta * x, LOAD, rotation=free.theta
    )
    prescribed_approach = press_layer(
        layer, compliance, x, weight, gap + free.theta * x, approach=free.delta, rotation=free.theta
    )
    for other in (prescribed_rotation, prescribed_approach):
        assert np.abs(other.force - free.force).max() <= 1e-9 * free.force.max()
        assert other.delta == pytest.approx(free.delta, rel=1e-9) and other.theta == free.theta
    assert prescribed_approach.load == pytest.approx(LOAD, rel=1e-9)


# ---- integral over Gaussian peaks
@pytest.mark.parametrize("h", [-200.0, -8.001, -7.999, 0.0, 3.0, 30.0])
def test_exact_peak_integral_agrees_with_quadrature(h):
    """The logarithm and the decay of the integral over Gaussian peaks agree with adaptive quadrature."""
    log_integral, decay = peak_integral(np.array([h]))

    def integrate_peaks(power):  # in units of phi(h) for positive h, because the tail underflows
        if h > 0:
            return quad(
                lambda t: t**power * np.exp(-h * t - t * t / 2), 0, np.inf, epsabs=0, epsrel=1e-12
            )[0]
        points = [max(-h - 9, 0), -h, -h + 9]
        inner = [
            quad(lambda t: t**power * norm.pdf(t + h), a, b, epsabs=0, epsrel=1e-12, limit=200)[0]
            for a, b in zip(points, [*points[1:], -h + 40], strict=False)
            if b > a
        ]
        return sum(inner)

    shift = -h * h / 2 - 0.5 * np.log(2 * np.pi) if h > 0 else 0.0
    assert log_integral[0] == pytest.approx(
        np.log(integrate_peaks(1.5)) + shift, abs=1e-10, rel=1e-12
    )
    assert decay[0] == pytest.approx(1.5 * integrate_peaks(0.5) / integrate_peaks(1.5), rel=1e-9)


@pytest.mark.parametrize("layer", [ExponentialAsperities(1e-7, 1e6), HERTZ_LAYER])
def test_exact_separation_inverts_pressure(layer):
    """The separation is the inverse of the pressure over 76 decades, and the stiffness is its derivative."""
    pressures = 10.0 ** np.arange(-60, 16)
    assert np.abs(layer.pressure(layer.separation(pressures)) / pressures - 1).max() <= 1e-10
    separations = np.linspace(-5, 5, 21) * 1e-6
    step = 1e-12
    slope = -(layer.pressure(separations + step) - layer.pressure(separations - step)) / (2 * step)
    assert np.abs(slope / layer.stiffness(separations) - 1).max() <= 1e-5


# ---- convergence for random input
@each_layer
@pytest.mark.parametrize("spring", [1e4])
def test_exact_holder_spring_equals_applied_moment(layer, spring):
    """A rotation against a spring equals the free rotation under the moment that the spring exerts."""
    compliance, x, weight = pair_arrays(60)
    gap = 1e-4 * x
    moment = 2e-3 * LOAD
    with_spring = press_layer(
        layer, compliance, x, weight, gap, LOAD, moment, rotation=1e-4, spring=spring
    )
    rotation = with_spring.theta - 1e-4
    free = press_layer(layer, compliance, x, weight, gap, LOAD, moment + spring * rotation)
    assert abs(rotation) > 1e-9 and free.theta == pytest.approx(rotation, rel=1e-7)
    assert np.abs(with_spring.force - free.force).max() <= 1e-9 * LOAD
    assert with_spring.moment == pytest.approx(
        moment + spring * rotation, rel=1e-8, abs=1e-9 * LOAD * LENGTH
    )


# ---- refusals


def test_refuses_excessive_pressure_of_layer():
    """An approach that gives a pressure beyond the range of numbers is refused."""
    c, x, weight = pair_arrays(40)
    with pytest.raises(PatchfemError, match="rough layer is too large to compute"):
        press_layer(ExponentialAsperities(1e-9, 1e6), 0 * c, x, weight, 0 * x, approach=1e-3)
