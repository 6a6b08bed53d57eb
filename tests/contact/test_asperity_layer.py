"""The layer of asperities: limits, closed forms of rigid pads, integral over peaks, random patches, and a refusal."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from contact_forms import wedge_on_asperities, wedge_on_linear_foundation, wedge_opening_tilt
from hypothesis import given
from hypothesis import strategies as st
from pieces import LENGTH, LOAD, WIDTH, draw_gap, make_coated_pair
from pressed import press
from scipy.integrate import quad
from scipy.stats import norm
from skins import press_layer, stretch_law

from patchfem.contact import ExponentialAsperities, HertzAsperities
from patchfem.contact.asperity_laws import peak_integral
from patchfem.core import PatchfemError

AREA = LENGTH * WIDTH
MEAN_PRESSURE = LOAD / AREA
HERTZ_LAYER = HertzAsperities(radius=10e-6, density=1e10, deviation=1e-6, modulus=1.3e11)
LAYERS = {
    "bare": None,
    "linear": 1e13,
    "exponential": ExponentialAsperities(0.5e-6, MEAN_PRESSURE),
    "hertz": HERTZ_LAYER,
}


# ---- limit of bare contact


@pytest.mark.parametrize("layer", [ExponentialAsperities(1e-6, MEAN_PRESSURE), HERTZ_LAYER])
def test_order_one_thin_layers_converge_to_bare_contact(layer):
    """The pressure with a thin layer converges to that of bare contact with the thickness, up to a logarithm."""
    pair = make_coated_pair(100)
    node = pair.normal, pair.interface.x, pair.interface.weight
    gap = 1e-4 * pair.interface.x
    bare = press(pair, gap, LOAD).sigma_n
    errors = []
    for t in (1e-3, 1e-4, 1e-5, 1e-6):
        thin = press_layer(*node, gap, stretch_law(layer, t), load=LOAD)
        errors.append(np.abs(thin.force / node[2] - bare).max() / bare.max())
    assert errors[3] < 2e-3 and all(6 < a / b < 14 for a, b in pairwise(errors[1:]))


# ---- rigid pads in closed form


def press_rigid_pad(n_nodes, tilt, layer):
    """Return the centre of pressure [m] of a rigid pad on a layer, with nodes in the middle of equal cells."""
    x = (np.arange(n_nodes) + 0.5) * (LENGTH / n_nodes) - LENGTH / 2
    weight = np.full(n_nodes, AREA / n_nodes)
    rigid = np.zeros((n_nodes, n_nodes))
    state = press_layer(rigid, x, weight, tilt * x, layer, load=LOAD)
    return state.force @ x / state.force.sum()


def test_order_two_centre_of_partly_open_rigid_pad():
    """The centre of pressure of a partly open rigid pad converges to the closed form with order two.

    The contact edge is at a third of a cell for every number of cells.
    """
    tilt = 9 * wedge_opening_tilt(LOAD, LENGTH, WIDTH, 1e13)
    centre = wedge_on_linear_foundation(tilt, LOAD, LENGTH, WIDTH, 1e13)[1]
    layer = 1e13
    errors = [abs(press_rigid_pad(n, tilt, layer) / centre - 1) for n in (4, 16, 64, 256)]
    assert errors[-1] < 2e-5
    assert all(
        np.log(a / b) / np.log(4) == pytest.approx(2, abs=0.1) for a, b in pairwise(errors[1:])
    )


@pytest.mark.parametrize("ratio", [0.01, 0.1, 30.0])
def test_exact_tilted_pad_on_exponential_layer(ratio):
    """The centre of a tilted pad on an exponential layer is L(1/2 - 1/B + 1/(exp(B) - 1)), with B = tilt L/u0.

    For finitely many nodes the sum over their positions is geometric.
    """
    n_nodes = 200
    u0 = 2.5e-6
    tilt = ratio * u0 / LENGTH
    centre = press_rigid_pad(n_nodes, tilt, ExponentialAsperities(u0, MEAN_PRESSURE))
    half_step = ratio / n_nodes / 2
    expected = -LENGTH * (0.5 - 1 / np.tanh(half_step) / 2 / n_nodes + 1 / np.expm1(ratio))
    assert centre == pytest.approx(expected, rel=1e-9)
    assert centre == pytest.approx(
        wedge_on_asperities(tilt, LENGTH, u0)[1], abs=1.01 * LENGTH * ratio / 12 / n_nodes**2
    )


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


# ---- random patches


def find_violation(layer, state, opening, weight):
    """Return the largest wrong opening [m] under a bare or linear contact, or wrong force [N] over the slope of the law."""
    force = state.force
    if layer is None or isinstance(layer, float):
        compression = 0.0 if layer is None else force / (layer * weight)
        below = opening + compression
        return max(np.abs(below[force > 0]).max(), -below.min(initial=0.0))
    slope = (weight * layer.stiffness(opening)).max()
    return np.abs(force - weight * layer.pressure(opening)).max() / slope


@given(
    log_amplitude=st.floats(-9, -5),
    load=st.floats(-3, 2),
    load_line=st.one_of(st.none(), st.floats(-0.97, 0.97)),
    spring=st.one_of(st.just(0.0), st.floats(1.0, 1e6)),
    layer=st.sampled_from([*LAYERS.values(), 1e16, ExponentialAsperities(2e-8, MEAN_PRESSURE)]),
    softening=st.sampled_from([0.0, 2.0]),
    seed=st.integers(0, 2**32 - 1),
)
def test_always_random_patches_satisfy_contact_conditions(
    log_amplitude, load, load_line, spring, layer, softening, seed
):
    """Random gaps, loads, holders and layers give states that satisfy the contact conditions from their definitions."""
    rng = np.random.default_rng(seed)
    pair = make_coated_pair(24)
    x, weight = pair.interface.x, pair.interface.weight
    c = pair.normal + np.diag(rng.uniform(0, 1, x.size) * pair.normal.max() * softening)
    gap = draw_gap(rng, x, 10**log_amplitude)
    gap = gap + rng.choice([0, 1]) * 10**log_amplitude * rng.normal(size=x.size)
    load = LOAD * 10**load
    moment = np.nan if load_line is None else load_line * load * LENGTH / 2
    spring = 0.0 if load_line is None else spring
    state = press_layer(c, x, weight, gap, layer, load=load, moment=moment, spring=spring)

    force = state.force
    assert force.min() >= 0 and force.sum() == pytest.approx(load, rel=1e-9)
    if load_line is not None:
        spring_moment = spring * state.turn
        error = abs(force @ x - moment - spring_moment)
        assert error <= 1e-9 * (load * LENGTH + abs(spring_moment))
    displacement = c @ force
    opening = gap + state.turn * x - state.approach + displacement
    scale = np.ptp(gap) + displacement.max() + abs(state.turn) * LENGTH
    if layer is not None:
        scale += np.abs(opening).max()
    assert find_violation(layer, state, opening, weight) <= 1e-9 * scale


@pytest.mark.parametrize("layer", LAYERS.values(), ids=LAYERS.keys())
@pytest.mark.parametrize("spring", [0.0, 3e3])
def test_exact_free_tilt_reproduces_prescribed_tilt(layer, spring):
    """A free tilt under the moment of a prescribed tilt reproduces that tilt and its forces."""
    pair = make_coated_pair(30)
    x = pair.interface.x
    node = pair.normal, x, pair.interface.weight
    for seed, tilt in ((3, 2e-5), (4, -1e-4)):
        gap = draw_gap(np.random.default_rng(seed), x, 1e-6)
        prescribed = press_layer(*node, gap + tilt * x, layer, load=LOAD)
        moment = prescribed.force @ x - spring * tilt
        free = press_layer(*node, gap, layer, load=LOAD, moment=moment, spring=spring)
        assert free.turn == pytest.approx(tilt, rel=1e-8)
        assert np.abs(free.force - prescribed.force).max() <= 1e-9 * LOAD


# ---- refusals


def test_refuses_excessive_pressure_of_layer():
    """An approach that gives a pressure beyond the range of numbers is refused."""
    x = make_coated_pair(40).interface.x
    layer = ExponentialAsperities(1e-9, 1e6)
    with pytest.raises(PatchfemError, match="rough layer is too large to compute"):
        press_layer(np.zeros((x.size, x.size)), x, 1 + 0 * x, 0 * x, layer, approach=1e-3)
