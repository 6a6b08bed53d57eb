"""Strips side by side: one patch without roll, one dense problem, wedges in closed form, mirrors and hard cases."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import LENGTH, LOAD, WIDTH, coated_pair, rough
from skins import press_strips, solve, tangent

from patchfem.closed_forms.contact import (
    wedge_on_asperities,
    wedge_on_linear_foundation,
    wedge_opening_tilt,
)
from patchfem.contact import (
    ExponentialAsperities,
    HertzAsperities,
    LinearAsperities,
    StripCompliance,
    press,
    press_to_approach,
    split_into_strips,
    strip_offsets,
    strips_stiffness,
    tangential_stiffness,
)
from patchfem.contact.strips import STRIP_RESIDUAL_TOL
from patchfem.contact.unilateral import solve_forces
from patchfem.core import Compliance, Interface, NotConverged, Outcome, PatchfemError

AREA = LENGTH * WIDTH
MEAN = LOAD / AREA
SKINS = {
    "bare": None,
    "linear": LinearAsperities(1e13),
    "exponential": ExponentialAsperities(0.5e-6),
    "hertz": HertzAsperities(radius=10e-6, density=1e10, deviation=1e-6, modulus=1.3e11),
}
each_skin = pytest.mark.parametrize("skin", SKINS.values(), ids=SKINS.keys())
CONTROLS = {
    "held": {},
    "moment": {"moment": 2e-3 * LOAD},
    "spring": {"moment": -1e-3 * LOAD, "spring": 3e3},
}
each_control = pytest.mark.parametrize("control", CONTROLS.values(), ids=CONTROLS.keys())


def real(count, cells=60):
    """(normal, x, weight, offsets) of strips of the coated pair."""
    pair = coated_pair(cells)
    c, _, weight = split_into_strips(pair, count)
    return c, pair.interface.x, weight, strip_offsets(WIDTH, count)


def rigid(count, cells=1, length=LENGTH, width=WIDTH):
    """The same of rigid bodies, nodes in the middle of equal cells: exact for wedges."""
    x = (np.arange(cells) + 0.5) * (length / cells) - length / 2
    weight = np.full(cells, length * width / cells / count)
    return np.zeros((cells, cells)), x, weight, strip_offsets(width, count)


def softer(skin, c, weight):
    """A linear skin in series with the bodies."""
    return c if skin is None else c + np.diag(1 / (skin.k * weight))


def whole(skin, cells, gap, moment=None, spring=0.0, load=LOAD):
    """(nodal forces, delta, theta) of the undivided patch."""
    pair = coated_pair(cells)
    x = pair.interface.x
    weight = pair.interface.weight
    if skin is None or isinstance(skin, LinearAsperities):
        pair = Compliance(pair.interface, softer(skin, pair.normal, weight), pair.tangential)
        state = press(pair, gap, load, moment, spring=spring)
        return state.sigma_n * weight, state.approach, state.rotation
    state = solve(skin, pair.normal, x, weight, gap, load, moment)
    return state.force, state.delta, state.theta


def random_gaps(rng, x, count, size):
    """One smooth random gap per strip (count, m) [m]."""
    return np.array([rough(rng, x, size) for _ in range(count)])


# ------------------------------------------------------------------------------------------------- against one patch
@each_skin
@each_control
@pytest.mark.parametrize("angle", [0.0, 1e-4])
def test_exact_strips_without_roll_are_one_patch(skin, control, angle):
    c, x, weight, y = real(8)
    state = press_strips(c, x, weight, y, angle * x, load=LOAD, asperities=skin, **control)
    # an undivided one knows no spring
    if isinstance(skin, ExponentialAsperities | HertzAsperities) and "spring" in control:
        control = {"moment": control["moment"] + control["spring"] * state.theta}
    force, delta, theta = whole(skin, 60, angle * x, **control)
    assert np.abs(8 * state.force - force).max() <= 1e-12 * LOAD
    assert state.delta == pytest.approx(delta, rel=1e-12, abs=1e-19)
    assert state.theta == pytest.approx(theta, rel=1e-11, abs=1e-17)
    assert abs(state.roll_moment) <= 1e-13 * LOAD * WIDTH
    assert state.fraction == pytest.approx(weight[force > 0].sum() * 8 / AREA, rel=1e-12)


# ------------------------------------------------------------------------------- against one dense problem of all nodes
def dense_cases(number):
    rng = np.random.default_rng(20)
    for k in range(number):
        count = int(rng.integers(2, 6))
        c, x, weight, y = real(count, 30)
        gap = random_gaps(rng, x, count, 10 ** rng.uniform(-8, -6))
        roll = 10 ** rng.uniform(-6, -3) * rng.choice([-1, 1])
        load = LOAD * 10 ** rng.uniform(-1, 1)
        moment = None if k % 3 == 0 else load * LENGTH / 2 * rng.uniform(-0.8, 0.8)
        yield (
            c,
            x,
            weight,
            y,
            gap,
            roll,
            load,
            moment,
            0.0 if k % 3 < 2 else 10 ** rng.uniform(1, 5),
        )


@pytest.mark.parametrize("own", [False, True], ids=["alike", "diagonals of their own"])
@pytest.mark.parametrize(
    "skin",
    [
        None,
        LinearAsperities(1e12),
        LinearAsperities(1e15),
        ExponentialAsperities(2e-7),
        SKINS["hertz"],
    ],
    ids=["bare", "soft", "stiff", "exponential", "hertz"],
)
def test_exact_answer_is_that_of_one_block_diagonal_operator(skin, own):
    """All strips as one patch; two of the strips with a diagonal of their own share a factorisation."""
    is_linear = skin is None or isinstance(skin, LinearAsperities)
    for number, (c, x, weight, y, gap, roll, load, moment, spring) in enumerate(dense_cases(9)):
        if not is_linear:
            spring = 0.0
        added = np.random.default_rng(number).uniform(0, 2, gap.shape) * c.max() * own
        added[-1] = added[0]
        state = press_strips(
            StripCompliance(c, added) if own else c,
            x,
            weight,
            y,
            gap,
            roll,
            load,
            moment,
            spring=spring,
            asperities=skin,
        )
        places = np.tile(x, y.size)
        opened = (gap + roll * y[:, None]).ravel()
        if not is_linear:
            whole = solve(
                skin,
                np.kron(np.eye(y.size), c) + np.diag(added.ravel()),
                places,
                np.tile(weight, y.size),
                opened,
                load,
                moment,
            )
            assert np.abs(state.force.ravel() - whole.force).max() <= 1e-10 * load
            assert np.abs(state.gap.ravel() - whole.separation).max() <= 1e-9 * np.ptp(
                whole.separation
            )
            continue
        target = np.array([load] if moment is None else [load, moment])
        force, motion, _ = solve_forces(
            np.kron(np.eye(y.size), softer(skin, c, weight)) + np.diag(added.ravel()),
            places,
            opened,
            target,
            spring=spring,
        )
        assert np.abs(state.force.ravel() - force).max() <= 1e-10 * load
        assert state.delta == pytest.approx(motion[0], rel=1e-10)
        assert state.theta == pytest.approx(
            -motion[1] if moment is not None else 0.0, rel=1e-8, abs=1e-16
        )


# ------------------------------------------------------------------------------------------------ wedges in closed form
@pytest.mark.parametrize("count", [2, 3, 8, 64])
def test_exact_rigid_pad_in_full_contact_has_the_centre_of_the_wedge_less_one_over_count_squared(
    count,
):
    c, x, weight, y = rigid(count)
    roll = 0.7 * wedge_opening_tilt(LOAD, WIDTH, LENGTH, 1e13)
    state = press_strips(
        c, x, weight, y, np.zeros(1), roll, load=LOAD, asperities=LinearAsperities(1e13)
    )
    _, centre, _, _ = wedge_on_linear_foundation(roll, LOAD, WIDTH, LENGTH, 1e13)
    assert state.centre_y == pytest.approx(centre * (1 - 1 / count**2), rel=1e-12) and centre < 0


def test_order_two_rigid_pad_of_any_opening():
    """The edge lies a third into a strip at every count: one strip more than a multiple of three, f = 1/3."""
    roll = 9 * wedge_opening_tilt(LOAD, WIDTH, LENGTH, 1e13)
    off = []
    for count in (4, 16, 64, 256):
        state = press_strips(
            *rigid(count), np.zeros(1), roll, load=LOAD, asperities=LinearAsperities(1e13)
        )
        off.append(
            abs(state.centre_y / wedge_on_linear_foundation(roll, LOAD, WIDTH, LENGTH, 1e13)[1] - 1)
        )
    assert off[-1] < 2e-5
    assert all(np.log(a / b) / np.log(4) == pytest.approx(2, abs=0.1) for a, b in pairwise(off[1:]))


@pytest.mark.parametrize("ratio", [0.1, 2.0, 30.0])
def test_exact_rolled_pad_on_the_exponential_skin(ratio):
    """Centre L(1/2 - 1/B + 1/(exp(B) - 1)), B = roll L/u0; the sum over the middles of the strips is geometric."""
    count = 200
    u0 = 2.5e-6
    roll = ratio * u0 / WIDTH
    state = press_strips(
        *rigid(count), np.zeros(1), roll, load=LOAD, asperities=ExponentialAsperities(u0)
    )
    half = ratio / count / 2
    finite = -WIDTH * (0.5 - 1 / np.tanh(half) / 2 / count + 1 / np.expm1(ratio))
    assert state.centre_y == pytest.approx(finite, rel=1e-9)
    assert state.centre_y == pytest.approx(
        wedge_on_asperities(roll, WIDTH, u0)[1], abs=1.01 * WIDTH * ratio / 12 / count**2
    )


@pytest.mark.parametrize(("roll", "yaw"), [(1e-5, 33.3), (1e-4, 157.5), (1e-3, 208.4)])
def test_figure_yaw_moment_of_a_rolled_pad_on_a_linear_skin(roll, yaw):
    """10 x 10 mm, 116 N, 1e13 Pa/m, mu 0.4 [N mm]: the closed forms, and 4000 strips."""
    centre = wedge_on_linear_foundation(roll, 116.0, 0.01, 0.01, 1e13)[1]
    assert -0.4 * 116 * centre * 1e3 == pytest.approx(yaw, abs=0.05)
    c, x, weight, y = rigid(4000, length=0.01, width=0.01)
    state = press_strips(
        c, x, weight, y, np.zeros(1), roll, load=116.0, asperities=LinearAsperities(1e13)
    )
    assert -state.yaw_moment(0.4) * 1e3 == pytest.approx(yaw, abs=0.05)
    assert state.yaw_moment(0.4) == pytest.approx(0.4 * state.load * state.centre_y, rel=1e-14)


# ------------------------------------------------------------------------------------------------------------- mirrors
# ------------------------------------------------------------------------------------------- the definitions themselves
def law_of(skin, weight, opening, load, count):
    """Nodal force that the skin gives at a separation."""
    if isinstance(skin, ExponentialAsperities) and skin.reference is None:
        skin = ExponentialAsperities(skin.u0, load / (weight.sum() * count))
    return weight * skin.pressure(opening)


def check(state, skin, c, x, weight, gap, roll, load, moment=None, spring=0.0, free=None):
    """Every definition with its own arithmetic."""
    free = state.theta if free is None else free
    force = state.force
    y = state.offsets
    assert max(state.residuals.values()) <= STRIP_RESIDUAL_TOL
    assert force.sum() == pytest.approx(load, rel=1e-9)
    if moment is not None:
        assert abs((force * x).sum() - moment - spring * free) <= 1e-9 * (
            load * LENGTH + abs(spring * free)
        )
    bent = np.array([c @ row for row in force])
    opening = gap + roll * y[:, None] + free * x - state.delta + bent
    depth = np.ptp(gap) + bent.max() + abs(free) * LENGTH
    if skin is None:
        assert opening.min() >= -1e-9 * depth and force.min() >= 0
        assert (force * np.abs(opening)).sum() <= 1e-9 * load * depth
        assert np.abs(state.gap - opening).max() <= 1e-9 * depth
    elif isinstance(skin, LinearAsperities):
        rest = force / (skin.k * weight)
        assert np.all(np.abs(opening + rest)[force > 0] <= 1e-9 * (depth + rest.max()))
        assert opening[force == 0].min(initial=0.0) >= -1e-9 * depth
    else:
        assert (
            np.abs(force - law_of(skin, weight, opening, load, y.size)).max() <= 1e-8 * force.max()
        )
    assert state.load == pytest.approx(force.sum(), rel=1e-14)
    assert state.moment == pytest.approx((force * x).sum(), rel=1e-9, abs=1e-12 * load * LENGTH)
    assert state.centre_y * load == pytest.approx(
        (force.T * y).sum(), rel=1e-9, abs=1e-12 * load * LENGTH
    )
    assert not state.force.flags.writeable and not state.pressure.flags.writeable


@given(
    count=st.integers(1, 8),
    size=st.floats(-9, -5),
    roll=st.floats(-7, -2),
    load=st.floats(-3, 2),
    where=st.one_of(st.none(), st.floats(-0.97, 0.97)),
    spring=st.one_of(st.just(0.0), st.floats(1.0, 1e6)),
    skin=st.sampled_from([*SKINS.values(), LinearAsperities(1e16), ExponentialAsperities(2e-8)]),
    seed=st.integers(0, 2**32 - 1),
)
def test_always_any_gap_in_every_strip_is_solved(
    count, size, roll, load, where, spring, skin, seed
):
    rng = np.random.default_rng(seed)
    c, x, weight, y = real(count, 24)
    gap = random_gaps(rng, x, count, 10**size) + rng.choice([0, 1]) * 10**size * rng.normal(
        size=(count, x.size)
    )
    roll = 10**roll * rng.choice([-1, 0, 1])
    load = LOAD * 10**load
    moment = None if where is None else where * load * LENGTH / 2
    state = press_strips(
        c,
        x,
        weight,
        y,
        gap,
        roll,
        load,
        moment,
        spring=spring if where is not None else 0.0,
        asperities=skin,
    )
    check(state, skin, c, x, weight, gap, roll, load, moment, spring)


# ---------------------------------------------------------------------------------------------------------- hard cases
@pytest.mark.parametrize("skin", [None, LinearAsperities(1e13)])
def test_exact_a_great_roll_presses_the_edge_strip_alone(skin):
    c, x, weight, y = real(8)
    state = press_strips(c, x, weight, y, 1e-5 * x, 2e-2, load=LOAD, asperities=skin)
    alone = press(
        Compliance(Interface(x, weight, WIDTH / 8), softer(skin, c, weight), c), 1e-5 * x, LOAD
    )
    assert not state.force[1:].any()
    assert np.abs(state.pressure[0] - alone.sigma_n).max() <= 1e-10 * alone.sigma_n.max()
    assert state.centre_y == pytest.approx(y[0], rel=1e-12)
    assert state.fraction == pytest.approx(weight[alone.sigma_n > 0].sum() / AREA, rel=1e-12)


@each_skin
def test_exact_zero_load_touches_and_carries_nothing(skin):
    c, x, weight, y = real(4)
    state = press_strips(
        c, x, weight, y, 1e-5 * x + 3e-6, 1e-4, load=0.0, moment=0.0, asperities=skin
    )
    assert state.outcome is Outcome.NO_CONTACT and not state.force.any()
    assert (state.load, state.moment, state.roll_moment, state.centre_y, state.fraction) == (
        0,
        0,
        0,
        0,
        0,
    )
    assert state.delta == pytest.approx(3e-6 - 1e-5 * LENGTH / 2 - 1e-4 * WIDTH * 3 / 8, rel=1e-12)
    assert strips_stiffness(c, weight, state) == 0.0


def test_exact_approach_presses_every_strip_for_itself():
    c, x, weight, y = real(6)
    state = press_strips(c, x, weight, y, 2e-5 * x, 1e-4, approach=1e-7)
    pair = Compliance(Interface(x, weight, WIDTH / 6), c, c)
    for strip, place in enumerate(y):
        alone = press_to_approach(pair, 2e-5 * x + 1e-4 * place, 1e-7)
        assert np.abs(state.pressure[strip] - alone.sigma_n).max() <= 1e-12 * (
            alone.sigma_n.max() + 1
        )
        assert np.abs(state.gap[strip] - alone.gap).max() <= 1e-18
    apart = press_strips(c, x, weight, y, np.zeros(x.size), 1e-4, approach=-1e-4 * WIDTH)
    assert apart.outcome is Outcome.NO_CONTACT and apart.gap.min() > 0


@each_skin
def test_exact_approach_of_a_load_gives_the_load_back(skin):
    c, x, weight, y = real(6)
    if isinstance(skin, ExponentialAsperities):
        skin = ExponentialAsperities(skin.u0, MEAN)
    loaded = press_strips(c, x, weight, y, 2e-5 * x, 1e-4, load=LOAD, asperities=skin)
    by = press_strips(c, x, weight, y, 2e-5 * x, 1e-4, approach=loaded.delta, asperities=skin)
    assert by.load == pytest.approx(LOAD, rel=1e-9)
    assert np.abs(by.force - loaded.force).max() <= 1e-9 * LOAD


@each_skin
@pytest.mark.parametrize("roll", [0.0, 1e-5, 1e-4, 1e-3])
def test_always_few_steps_on_the_test_piece(skin, roll):
    c, x, weight, y = real(8, 200)
    state = press_strips(c, x, weight, y, 1e-4 * x, roll, load=LOAD, asperities=skin)
    assert state.iterations <= 12


# ---------------------------------------------------------------------------------------------------------- stiffnesses
@each_skin
def test_order_two_tangent_is_the_difference_of_loads(skin):
    c, x, weight, y = real(5, 30)
    if isinstance(skin, ExponentialAsperities):
        skin = ExponentialAsperities(skin.u0, MEAN)
    state = press_strips(c, x, weight, y, 2e-5 * x, 3e-5, load=LOAD, asperities=skin)
    step = 1e-5 * LOAD / strips_stiffness(c, weight, state)
    more, less = (
        press_strips(
            c, x, weight, y, 2e-5 * x, 3e-5, approach=state.delta + h, asperities=skin
        ).load
        for h in (step, -step)
    )
    assert (more - less) / (2 * step) == pytest.approx(strips_stiffness(c, weight, state), rel=1e-6)


def test_exact_stiffnesses_without_roll_are_those_of_one_patch():
    pair = coated_pair(60)
    c, tangential, weight = split_into_strips(pair, 8)
    y = strip_offsets(WIDTH, 8)
    gap = 1e-4 * pair.interface.x
    bare = press_strips(c, pair.interface.x, weight, y, gap, load=LOAD)
    active = bare.force[0] > 0
    assert strips_stiffness(c, weight, bare) == pytest.approx(
        tangential_stiffness(pair.normal, active), rel=1e-12
    )
    assert strips_stiffness(tangential, weight, bare) == pytest.approx(
        tangential_stiffness(pair.tangential, active), rel=1e-12
    )
    skin = SKINS["hertz"]
    rough_one = press_strips(c, pair.interface.x, weight, y, gap, load=LOAD, asperities=skin)
    one = tangent(pair.tangential, pair.interface.weight, 0.8 * rough_one.stiffness[0])
    assert strips_stiffness(tangential, weight, rough_one, 0.8) == pytest.approx(one, rel=1e-12)
    stiff = strips_stiffness(tangential, weight, rough_one, np.inf)
    assert stiff == pytest.approx(
        tangential_stiffness(pair.tangential, np.ones(61, bool)), rel=1e-12
    )


# ------------------------------------------------------------------------------------------------------------- refusals
def test_refuses_what_has_no_answer():
    c, x, weight, y = real(4, 30)
    flat = np.zeros(x.size)
    for wrong in (
        {},
        {"load": 1.0, "approach": 1e-6},
        {"approach": 1e-6, "moment": 0.0},
        {"load": -1.0},
        {"load": np.nan},
        {"load": 1.0, "roll": np.inf},
        {"approach": 1e-6, "asperities": ExponentialAsperities(1e-6)},
    ):
        with pytest.raises(PatchfemError, match="contact"):
            press_strips(c, x, weight, y, flat, **wrong)
    with pytest.raises(PatchfemError, match=r"contact\.load_line: .* tips over"):
        press_strips(c, x, weight, y, flat, load=1.0, moment=0.51 * LENGTH)
    held = press_strips(c, x, weight, y, flat, load=1.0, moment=0.51 * LENGTH, spring=1e3)
    assert held.moment == pytest.approx(0.51 * LENGTH + 1e3 * held.theta, rel=1e-9)
    with pytest.raises(PatchfemError, match=r"contact\.strips\.count"):
        strip_offsets(WIDTH, 0)


def test_refuses_a_rotation_that_the_contact_set_leaves_open():
    c, x, weight, y = real(4, 30)
    with pytest.raises(NotConverged, match="do not determine the rotation"):
        press_strips(c, x, weight, y, np.where(x == 0, 0.0, 1.0), load=LOAD, moment=0.0)
    state = press_strips(
        c, x, weight, y, np.where(x == 0, 0.0, 1.0), load=LOAD, moment=0.0, spring=1e3
    )
    assert (state.force > 0).sum() == 4 and abs(state.theta) <= 1e-15


# ----------------------------------------------------------------------------------------------------- the roll is free
@each_skin
@each_control
def test_exact_a_free_roll_under_the_moment_of_a_held_one_is_that_roll(skin, control):
    c, x, weight, y = real(6, 30)
    for seed, roll in ((3, 2e-5), (4, -1e-4)):
        gap = random_gaps(np.random.default_rng(seed), x, 6, 1e-6)
        held = press_strips(c, x, weight, y, gap, roll, LOAD, asperities=skin, **control)
        free = press_strips(
            c,
            x,
            weight,
            y,
            gap,
            0.0,
            LOAD,
            asperities=skin,
            roll_moment=held.roll_moment,
            **control,
        )
        assert (
            free.roll == pytest.approx(roll, rel=1e-8)
            and max(free.residuals.values()) <= STRIP_RESIDUAL_TOL
        )
        assert np.abs(free.force - held.force).max() <= 1e-9 * LOAD
        other = press_strips(
            c,
            x,
            weight,
            y,
            gap,
            0.5 * roll,
            LOAD,
            asperities=skin,
            roll_moment=held.roll_moment,
            **control,
        )
        assert other.roll == pytest.approx(roll, rel=1e-8)


def test_exact_a_free_roll_closes_a_lateral_wedge():
    """Rigid pieces on a linear skin: the wedge closes, and a load line at e adds the pressure N e y / sum A y^2."""
    c, x, weight, y = rigid(9, 5)
    wedge = 3e-5 * y[:, None] + np.zeros(x.size)
    skin = LinearAsperities(1e13)
    arm = 0.4e-3
    shut = press_strips(c, x, weight, y, wedge, load=LOAD, asperities=skin, roll_moment=0.0)
    assert shut.roll == pytest.approx(-3e-5, rel=1e-12) and shut.pressure == pytest.approx(
        MEAN, rel=1e-10
    )
    spread = 5 * weight[0] * (y**2).sum()
    leant = press_strips(c, x, weight, y, wedge, load=LOAD, asperities=skin, roll_moment=arm * LOAD)
    assert leant.pressure[:, 0] == pytest.approx(MEAN + LOAD * arm * y / spread, rel=1e-10)
    assert leant.roll == pytest.approx(-3e-5 - LOAD * arm / (spread * 1e13), rel=1e-10)


@pytest.mark.parametrize("arm", [0.25, 0.35, 0.45])
def test_order_2_a_far_load_line_leaves_a_triangle_of_pressure(arm):
    """Beyond the kernel WIDTH/6 a rigid piece on a linear skin touches over 3 (WIDTH/2 - arm)."""
    arm, wanted = arm * WIDTH, 3 * (0.5 - arm) * WIDTH
    errors = []
    for count in (40, 80, 160):
        state = press_strips(
            *rigid(count),
            np.zeros(1),
            load=LOAD,
            asperities=LinearAsperities(1e13),
            roll_moment=arm * LOAD,
        )
        slope = 2 * LOAD / (1e13 * LENGTH * wanted**2)  # of the triangle: N = k L roll b^2 / 2
        errors.append(abs(-state.roll / slope - 1))
    assert errors[-1] <= 2e-3 and errors[-1] <= errors[0] / 8


def test_exact_strips_that_roll_are_nodes_that_turn():
    """Rigid pieces: n strips of one node under a free roll are one strip of n nodes under a free rotation."""
    c, x, weight, y = rigid(1, 24)
    for skin in (SKINS["linear"], SKINS["exponential"], SKINS["hertz"]):
        turned = press_strips(
            c, x, weight, y, 1e-4 * x**2, load=LOAD, moment=1e-3 * LOAD, asperities=skin
        )
        rolled = press_strips(
            np.zeros((1, 1)),
            np.zeros(1),
            weight[:1],
            x,
            1e-4 * x[:, None] ** 2,
            load=LOAD,
            asperities=skin,
            roll_moment=1e-3 * LOAD,
        )
        assert rolled.roll == pytest.approx(turned.theta, rel=1e-10)
        assert rolled.force[:, 0] == pytest.approx(turned.force[0], rel=1e-9, abs=1e-12 * LOAD)


def test_refuses_a_free_roll_that_nothing_determines():
    c, x, weight, y = real(4, 20)
    with pytest.raises(PatchfemError, match=r"contact\.strips\.roll"):
        press_strips(c, x, weight, y, 0 * x, approach=1e-7, roll_moment=0.0)
    with pytest.raises(PatchfemError, match=r"contact\.strips\.offset"):
        press_strips(c, x, weight, y, 0 * x, load=LOAD, roll_moment=y[-1] * LOAD)
    ridge = np.where(np.arange(4) == 1, 0.0, 1.0)[:, None] + 0 * x
    with pytest.raises(NotConverged, match="roll"):
        press_strips(c, x, weight, y, ridge, load=LOAD, roll_moment=y[1] * LOAD)
