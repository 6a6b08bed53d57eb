"""Strips side by side: contact conditions of random strips, wedges in closed form, and a free roll."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from contact_forms import (
    wedge_on_asperities,
    wedge_on_linear_foundation,
    wedge_opening_tilt,
)
from hypothesis import given
from hypothesis import strategies as st
from pieces import LENGTH, LOAD, WIDTH, draw_gap, make_coated_pair
from skins import press_strips

from patchfem.contact import (
    ExponentialAsperities,
    HertzAsperities,
    LinearAsperities,
    StripCompliance,
    split_into_strips,
)
from patchfem.contact.press import STRIP_RESIDUAL_TOL

LAYERS = {
    "bare": None,
    "linear": LinearAsperities(1e13),
    "exponential": ExponentialAsperities(0.5e-6),
    "hertz": HertzAsperities(radius=10e-6, density=1e10, deviation=1e-6, modulus=1.3e11),
}
each_layer = pytest.mark.parametrize("layer", LAYERS.values(), ids=LAYERS.keys())
CONTROLS = {
    "held": {},
    "moment": {"moment": 2e-3 * LOAD},
    "spring": {"moment": -1e-3 * LOAD, "spring": 3e3},
}
each_control = pytest.mark.parametrize("control", CONTROLS.values(), ids=CONTROLS.keys())


def compute_strip_offsets(n_strips):
    """Return the centres y (count,) [m] of equal strips that divide the width; y is 0 in its middle."""
    return (np.arange(n_strips) + 0.5) * (WIDTH / n_strips) - WIDTH / 2


def pair_strips(n_strips, n_elements=60):
    """Return (normal, x, weight, offsets) of strips of the coated pair."""
    pair = make_coated_pair(n_elements)
    c, _, weight = split_into_strips(pair, n_strips)
    return c, pair.interface.x, weight, compute_strip_offsets(n_strips)


def rigid_strips(n_strips):
    """Return (normal, x, weight, offsets) of strips of rigid bodies, with a single node in the middle."""
    weight = np.full(1, LENGTH * WIDTH / n_strips)
    return np.zeros((1, 1)), np.zeros(1), weight, compute_strip_offsets(n_strips)


def random_gaps(rng, x, n_strips, amplitude):
    """Return one smooth random gap per strip (count, m) [m]."""
    return np.array([draw_gap(rng, x, amplitude) for _ in range(n_strips)])


# ---- wedges in closed form


def test_order_two_centre_of_partly_open_rigid_pad():
    """The centre of pressure of a partly open rigid pad converges to the closed form with order two.

    The contact edge is at a third of a strip for every number of strips.
    """
    roll = 9 * wedge_opening_tilt(LOAD, WIDTH, LENGTH, 1e13)
    errors = []
    for n_strips in (4, 16, 64, 256):
        state = press_strips(
            *rigid_strips(n_strips), np.zeros(1), roll, load=LOAD, asperities=LinearAsperities(1e13)
        )
        errors.append(
            abs(state.centre_y / wedge_on_linear_foundation(roll, LOAD, WIDTH, LENGTH, 1e13)[1] - 1)
        )
    assert errors[-1] < 2e-5
    assert all(
        np.log(a / b) / np.log(4) == pytest.approx(2, abs=0.1) for a, b in pairwise(errors[1:])
    )


@pytest.mark.parametrize("ratio", [0.01, 0.1, 30.0])
def test_exact_rolled_pad_on_exponential_layer(ratio):
    """The centre of a rolled pad on an exponential layer is L(1/2 - 1/B + 1/(exp(B) - 1)), with B = roll L/u0.

    For finitely many strips the sum over their centres is geometric.
    """
    n_strips = 200
    u0 = 2.5e-6
    roll = ratio * u0 / WIDTH
    state = press_strips(
        *rigid_strips(n_strips), np.zeros(1), roll, load=LOAD, asperities=ExponentialAsperities(u0)
    )
    half_step = ratio / n_strips / 2
    expected = -WIDTH * (0.5 - 1 / np.tanh(half_step) / 2 / n_strips + 1 / np.expm1(ratio))
    assert state.centre_y == pytest.approx(expected, rel=1e-9)
    assert state.centre_y == pytest.approx(
        wedge_on_asperities(roll, WIDTH, u0)[1], abs=1.01 * WIDTH * ratio / 12 / n_strips**2
    )


# ---- check from the definitions
def layer_force(layer, weight, opening, load, n_strips):
    """Return the nodal force of a layer at a separation."""
    if isinstance(layer, ExponentialAsperities) and layer.reference is None:
        layer = ExponentialAsperities(layer.u0, load / (weight.sum() * n_strips))
    return weight * layer.pressure(opening)


def check_strips_state(
    state, layer, compliance, x, weight, gap, roll, load, moment=None, spring=0.0
):
    """Check forces, balance and gap of a state from the definitions."""
    rotation = state.position.theta
    force = state.force
    y = state.offsets
    assert max(state.residuals.values()) <= STRIP_RESIDUAL_TOL
    assert force.sum() == pytest.approx(load, rel=1e-9)
    if moment is not None:
        assert abs((force * x).sum() - moment - spring * rotation) <= 1e-9 * (
            load * LENGTH + abs(spring * rotation)
        )
    displacement = force @ compliance.common + compliance.added * force
    opening = gap + roll * y[:, None] + rotation * x - state.position.delta + displacement
    scale = np.ptp(gap) + displacement.max() + abs(rotation) * LENGTH
    if layer is None:
        assert opening.min() >= -1e-9 * scale and force.min() >= 0
        assert (force * np.abs(opening)).sum() <= 1e-9 * load * scale
        assert np.abs(state.gap - opening).max() <= 1e-9 * scale
    elif isinstance(layer, LinearAsperities):
        compression = force / (layer.k * weight)
        assert np.all(
            np.abs(opening + compression)[force > 0] <= 1e-9 * (scale + compression.max())
        )
        assert opening[force == 0].min(initial=0.0) >= -1e-9 * scale
    else:
        assert (
            np.abs(force - layer_force(layer, weight, opening, load, y.size)).max()
            <= 1e-8 * force.max()
        )
    assert state.load == pytest.approx(force.sum(), rel=1e-14)
    assert state.moment == pytest.approx((force * x).sum(), rel=1e-9, abs=1e-12 * load * LENGTH)
    assert state.centre_y * load == pytest.approx(
        (force.T * y).sum(), rel=1e-9, abs=1e-12 * load * LENGTH
    )
    assert not state.force.flags.writeable and not state.pressure.flags.writeable


@given(
    n_strips=st.integers(1, 8),
    log_amplitude=st.floats(-9, -5),
    roll=st.floats(-7, -2),
    load=st.floats(-3, 2),
    load_line=st.one_of(st.none(), st.floats(-0.97, 0.97)),
    spring=st.one_of(st.just(0.0), st.floats(1.0, 1e6)),
    layer=st.sampled_from([*LAYERS.values(), LinearAsperities(1e16), ExponentialAsperities(2e-8)]),
    diagonal=st.sampled_from([0.0, 2.0]),
    seed=st.integers(0, 2**32 - 1),
)
def test_always_random_strips_satisfy_contact_conditions(
    n_strips, log_amplitude, roll, load, load_line, spring, layer, diagonal, seed
):
    """Random gaps, rolls, loads and layers give states that satisfy the contact conditions in every strip.

    Strips have compliances of their own at the nodes; the first and the last one share theirs, and a factorisation.
    """
    rng = np.random.default_rng(seed)
    c, x, weight, y = pair_strips(n_strips, 24)
    diagonals = rng.uniform(0, 1, (n_strips, x.size)) * c.max() * diagonal
    diagonals[-1] = diagonals[0]
    compliance = StripCompliance(c, diagonals)
    gap = random_gaps(rng, x, n_strips, 10**log_amplitude) + rng.choice(
        [0, 1]
    ) * 10**log_amplitude * rng.normal(size=(n_strips, x.size))
    roll = 10**roll * rng.choice([-1, 0, 1])
    load = LOAD * 10**load
    moment = None if load_line is None else load_line * load * LENGTH / 2
    state = press_strips(
        compliance,
        x,
        weight,
        y,
        gap,
        roll,
        load,
        moment,
        spring=spring if load_line is not None else 0.0,
        asperities=layer,
    )
    check_strips_state(state, layer, compliance, x, weight, gap, roll, load, moment, spring)


# ---- free roll
@pytest.mark.share(0, 2, 4, 7, 9)
@each_layer
@each_control
def test_exact_free_roll_reproduces_prescribed_roll(layer, control):
    """A free roll under the moment of a prescribed roll reproduces that roll and its forces."""
    c, x, weight, y = pair_strips(6, 30)
    for seed, roll in ((3, 2e-5), (4, -1e-4)):
        gap = random_gaps(np.random.default_rng(seed), x, 6, 1e-6)
        prescribed = press_strips(c, x, weight, y, gap, roll, LOAD, asperities=layer, **control)
        free = press_strips(
            c,
            x,
            weight,
            y,
            gap,
            0.0,
            LOAD,
            asperities=layer,
            roll_moment=prescribed.roll_moment,
            **control,
        )
        assert (
            free.position.roll == pytest.approx(roll, rel=1e-8)
            and max(free.residuals.values()) <= STRIP_RESIDUAL_TOL
        )
        assert np.abs(free.force - prescribed.force).max() <= 1e-9 * LOAD
