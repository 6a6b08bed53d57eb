"""The layer of asperities: limit of a thin layer, quadrature over peaks, inverse and stiffness of its law, refusal."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from pieces import LENGTH, LOAD, WIDTH, make_coated_pair
from pressed import press
from scipy.integrate import quad
from scipy.stats import norm
from skins import press_strips, stretch_law

from patchfem.contact import (
    ExponentialAsperities,
    HertzAsperities,
)
from patchfem.contact.asperity_laws import peak_integral
from patchfem.core import PatchfemError

AREA = LENGTH * WIDTH
MEAN_PRESSURE = LOAD / AREA
HERTZ_LAYER = HertzAsperities(radius=10e-6, density=1e10, deviation=1e-6, modulus=1.3e11)


# ---- limit of bare contact


@pytest.mark.parametrize("layer", [ExponentialAsperities(1e-6, MEAN_PRESSURE), HERTZ_LAYER])
def test_order_one_thin_layers_converge_to_bare_contact(layer):
    """The pressure with a thin layer converges to that of bare contact with the thickness, up to a logarithm."""
    pair = make_coated_pair(100)
    node = pair.normal, pair.interface.x, pair.interface.weight, np.zeros(1)
    gap = 1e-4 * pair.interface.x
    bare = press(pair, gap, LOAD).sigma_n
    errors = []
    for t in (1e-3, 1e-4, 1e-5, 1e-6):
        thin = press_strips(*node, gap, load=LOAD, asperities=stretch_law(layer, t))
        errors.append(np.abs(thin.pressure[0] - bare).max() / bare.max())
    assert errors[3] < 2e-3 and all(6 < a / b < 14 for a, b in pairwise(errors[1:]))


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


# ---- refusals


def test_refuses_excessive_pressure_of_layer():
    """An approach that gives a pressure beyond the range of numbers is refused."""
    x = make_coated_pair(40).interface.x
    layer = ExponentialAsperities(1e-9, 1e6)
    with pytest.raises(PatchfemError, match="rough layer is too large to compute"):
        press_strips(
            np.zeros((x.size, x.size)),
            x,
            1 + 0 * x,
            np.zeros(1),
            0 * x,
            approach=1e-3,
            asperities=layer,
        )
