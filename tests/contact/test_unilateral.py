"""The unilateral solve: balance, symmetry, scaling, hundreds of random gaps, and a quadratic program beside it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import COATED, COATING, LENGTH, LOAD, TILTS, TITANIUM, WIDTH, bare_pair, coated_pair, pair_of, rough
from scipy.optimize import brentq, nnls

from patchfem.contact.active_set import Ask, Operator
from patchfem.contact.gaps import crown, tilt
from patchfem.contact.gradients import descend, gradients
from patchfem.contact.unilateral import SOLVED, press, press_by, solve_forces
from patchfem.core import Compliance, Interface, Outcome, PatchfemError
from patchfem.mesh.tensor import graded_grid


def forces(pair, state):
    return state.sigma_n * pair.interface.weight


def flaw(pair, gap, force, delta, theta=0.0):
    """Worst violation of f >= 0, w >= 0, f.w = 0, relative to the depth of the gap and the indentation."""
    x = pair.interface.x
    bent = pair.normal @ force
    opening = gap + theta * x - delta + bent
    depth = np.ptp(gap) + bent.max()
    return max(-opening.min() / depth, -force.min() / force.sum(), force @ np.abs(opening) / (force.sum() * depth))


GAPS = {
    "flat": lambda x: np.zeros(x.size),
    "slight tilt": lambda x: tilt(x, 1e-5),
    "tilt": lambda x: tilt(x, 1e-4),
    "steep tilt": lambda x: tilt(x, -1e-3),
    "crown": lambda x: crown(x, 1.0),
    "hollow": lambda x: -crown(x, 40.0),
    "step": lambda x: np.where(x >= 2e-3, 1e-6, 0.0),
    "rough": lambda x: rough(np.random.default_rng(5), x, 3e-7),
}
each_gap = pytest.mark.parametrize("shape", GAPS.values(), ids=GAPS.keys())


@each_gap
@pytest.mark.parametrize("offset", [None, 0.0, 1.7e-3, -6.2e-3])
def test_exact_force_and_moment_balance(shape, offset):
    pair = coated_pair(100)
    x = pair.interface.x
    gap = shape(x)
    state = press(pair, gap, LOAD, None if offset is None else LOAD * offset)
    force = forces(pair, state)
    assert force.sum() == pytest.approx(LOAD, rel=1e-10)
    assert state.load == pytest.approx(LOAD, rel=1e-10)
    assert state.moment == pytest.approx(force @ x, abs=1e-12 * LOAD * LENGTH)
    if offset is not None:
        assert abs(force @ x - LOAD * offset) <= 1e-10 * LOAD * LENGTH
    theta = 0.0 if offset is None else state.rotation
    assert flaw(pair, gap, force, state.approach, theta) <= 1e-10
    opening = gap + theta * x - state.approach + pair.normal @ force
    assert np.abs(state.gap - opening).max() <= 1e-10 * (np.ptp(gap) + np.abs(pair.normal @ force).max())
    assert state.gap.min() >= 0 and state.sigma_n.min() >= 0
    assert np.all(state.gap[state.sigma_n > 0] == 0)
    assert not state.sigma_n.flags.writeable


@each_gap
@pytest.mark.parametrize("offset", [0.0, 1.7e-3, -6.2e-3])
def test_exact_rotation_held_where_the_moment_put_it_gives_the_same_pressure(shape, offset):
    pair = coated_pair(100)
    gap = shape(pair.interface.x)
    free = press(pair, gap, LOAD, LOAD * offset)
    held = press(pair, gap + tilt(pair.interface.x, free.rotation), LOAD, rotation=free.rotation)
    assert np.abs(held.sigma_n - free.sigma_n).max() <= 1e-9 * free.sigma_n.max()
    assert held.approach == pytest.approx(free.approach, rel=1e-9)
    assert held.moment == pytest.approx(free.moment, abs=1e-10 * LOAD * LENGTH)
    assert held.rotation == free.rotation


@pytest.mark.parametrize("offset", [0.0, 1e-3, 3e-3])
def test_always_a_load_line_to_the_right_opens_the_left_side(offset):
    """Rotation > 0 opens the gap at +x, so a load right of the middle rotates by less than zero."""
    pair = coated_pair(100)
    state = press(pair, np.zeros(101), LOAD, LOAD * offset)
    assert np.sign(np.round(state.rotation, 16)) == -np.sign(offset)
    held = press(pair, tilt(pair.interface.x, 1e-5), LOAD)
    assert held.moment < 0


@each_gap
@pytest.mark.parametrize("offset", [None, 2e-3])
def test_exact_mirror_of_gap_and_moment_mirrors_the_pressure(shape, offset):
    pair = coated_pair(100)
    gap = shape(pair.interface.x)
    moment = None if offset is None else LOAD * offset
    here = press(pair, gap, LOAD, moment)
    there = press(pair, gap[::-1].copy(), LOAD, None if moment is None else -moment)
    assert np.abs(there.sigma_n[::-1] - here.sigma_n).max() <= 1e-8 * here.sigma_n.max()
    assert there.rotation == pytest.approx(-here.rotation, rel=1e-8, abs=1e-15)
    assert there.approach == pytest.approx(here.approach, rel=1e-8)


def test_exact_twice_the_modulus_halves_the_approach_of_flat_pieces():
    soft, stiff = bare_pair(100), bare_pair(100, 2 * TITANIUM[0])
    gap = np.zeros(101)
    one, two = press(soft, gap, LOAD), press(stiff, gap, LOAD)
    assert two.approach == pytest.approx(one.approach / 2, rel=1e-10)
    assert np.abs(two.sigma_n - one.sigma_n).max() <= 1e-10 * one.sigma_n.max()


@each_gap
def test_exact_twice_the_modulus_and_the_load_keep_the_motion(shape):
    gap = shape(bare_pair(100).interface.x)
    one = press(bare_pair(100), gap, LOAD, LOAD * 1e-3)
    two = press(bare_pair(100, 2 * TITANIUM[0]), gap, 2 * LOAD, 2 * LOAD * 1e-3)
    assert two.approach == pytest.approx(one.approach, rel=1e-9)
    assert two.rotation == pytest.approx(one.rotation, rel=1e-9, abs=1e-18)
    assert np.abs(two.sigma_n - 2 * one.sigma_n).max() <= 1e-9 * two.sigma_n.max()


@each_gap
def test_exact_twice_the_load_on_twice_the_gap_doubles_the_pressure(shape):
    pair = coated_pair(100)
    gap = shape(pair.interface.x)
    for moment in (None, LOAD * 2e-3):
        one = press(pair, gap, LOAD, moment)
        two = press(pair, 2 * gap, 2 * LOAD, None if moment is None else 2 * moment)
        assert np.abs(two.sigma_n - 2 * one.sigma_n).max() <= 1e-10 * two.sigma_n.max()
        assert two.approach == pytest.approx(2 * one.approach, rel=1e-10)


def test_exact_a_gap_raised_by_a_constant_only_shifts_the_approach():
    pair = coated_pair(100)
    gap = crown(pair.interface.x, 1.0)
    low, high = press(pair, gap, LOAD), press(pair, gap + 1e-6, LOAD)
    assert high.approach - low.approach == pytest.approx(1e-6, rel=1e-9)
    assert np.abs(high.sigma_n - low.sigma_n).max() <= 1e-9 * low.sigma_n.max()


def random_cases(count):
    """Smooth, jagged and spiked gaps of 1 nm to 100 um with loads and load lines of every kind."""
    rng = np.random.default_rng(2026)
    pair = pair_of(graded_grid(LENGTH, 6.35e-3, LENGTH / 40, COATING), COATED)
    x = pair.interface.x
    for k in range(count):
        size = 10 ** rng.uniform(-9, -4)
        gap = (rough(rng, x, size), size * rng.normal(size=x.size), size * rng.standard_cauchy(x.size))[k % 3]
        yield pair, gap, 10 ** rng.uniform(0, 4), rng.uniform(-0.499, 0.499) * LENGTH


def level(x, load, offset):
    """Forces >= 0 that fall off evenly on each side of the load line and balance it."""
    left, right = x <= offset, x > offset
    a, b = x[left].mean(), x[right].mean()
    return load * np.where(left, (b - offset) / left.sum(), (offset - a) / right.sum()) / (b - a)


@pytest.mark.slow
def test_always_300_random_gaps_converge_and_the_fallbacks_agree():
    for k, (pair, gap, load, offset) in enumerate(random_cases(300)):
        x = pair.interface.x
        for moment in (None, load * offset):
            state = press(pair, gap, load, moment)
            assert state.outcome is Outcome.DONE
            assert max(state.residuals.values()) <= SOLVED
            theta = 0.0 if moment is None else state.rotation
            force = forces(pair, state)
            assert flaw(pair, gap, force, state.approach, theta) <= SOLVED
            if k % 4:
                continue
            ask = Ask(x, gap, load, moment)
            other, _ = descend(Operator(pair.normal), ask, level(x, load, offset if moment is not None else 0.0))
            assert np.abs(other.force - force).max() <= 1e-8 * load
            depth = np.ptp(gap) + (pair.normal @ force).max()
            assert other.closing == pytest.approx(state.approach, abs=1e-8 * depth)
            near, count = gradients(Operator(pair.normal), ask)
            assert np.abs(near - force).max() <= 1e-6 * load and count < 1000


def test_always_the_start_of_the_active_set_does_not_change_the_answer():
    rng = np.random.default_rng(8)
    for pair, gap, load, offset in random_cases(30):
        x = pair.interface.x
        for target in (np.array([load]), np.array([load, load * offset])):
            cold, _, _ = solve_forces(pair.normal, x, gap, target)
            for _ in range(3):
                warm, _, _ = solve_forces(pair.normal, x, gap, target, rng.random(x.size) < rng.random())
                assert np.abs(warm - cold).max() <= 1e-8 * load


def quadratic_program(pair, gap, load):
    """min f.C f/2 + f.g with f >= 0 and sum f = N as a nonnegative least-squares problem: on the simplex the linear
    term joins the square, and the row of ones only sets the length of the answer."""
    root = np.linalg.cholesky(pair.normal).T
    bent = np.linalg.solve(root.T, gap - gap.min())
    square = root + np.outer(bent, np.ones(gap.size)) / load
    size = np.linalg.norm(square, 2)
    answer, _ = nnls(np.vstack([square / size, np.ones(gap.size)]), np.concatenate([np.zeros(gap.size), [1.0]]),
                     maxiter=50 * gap.size)
    return answer * load / answer.sum()


def test_exact_pressure_is_the_answer_of_a_quadratic_program():
    for pair, gap, load, _ in random_cases(30):
        state = press(pair, gap, load)
        assert np.abs(quadratic_program(pair, gap, load) - forces(pair, state)).max() <= 1e-7 * load


def test_exact_moment_control_is_the_answer_of_a_quadratic_program():
    for pair, gap, load, offset in random_cases(6):
        x = pair.interface.x
        state = press(pair, gap, load, load * offset / 2)

        def centre(theta, pair=pair, gap=gap, load=load, offset=offset, x=x):
            return quadratic_program(pair, gap + theta * x, load) @ x / load - offset / 2

        span = 1e-3 * (np.ptp(gap) + np.ptp(pair.normal @ forces(pair, state))) / LENGTH
        theta = brentq(centre, state.rotation - span, state.rotation + span, xtol=1e-18, rtol=1e-12)
        other = quadratic_program(pair, gap + theta * x, load)
        assert np.abs(other - forces(pair, state)).max() <= 1e-6 * load


@given(size=st.integers(2, 12), seed=st.integers(0, 2**32 - 1))
def test_always_any_positive_definite_compliance_is_solved(size, seed):
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(size, size)) + 2 * np.eye(size)
    x = np.sort(rng.uniform(-1, 1, size)) + np.linspace(-0.1, 0.1, size)
    pair = Compliance(Interface(x, rng.uniform(0.5, 1, size), 1.0), factor @ factor.T, factor @ factor.T)
    state = press(pair, rng.normal(size=size), 1.0)
    assert max(state.residuals.values()) <= SOLVED


@pytest.mark.parametrize("offset", [0.5, -0.5, 0.7])
def test_refuses_a_load_line_outside_the_patch(offset):
    with pytest.raises(PatchfemError, match=r"contact\.load_line: .* tips over"):
        press(coated_pair(100), np.zeros(101), LOAD, LOAD * offset * LENGTH)


def test_exact_a_load_line_just_inside_is_solved():
    state = press(coated_pair(100), np.zeros(101), LOAD, LOAD * 0.4999 * LENGTH)
    assert state.moment == pytest.approx(LOAD * 0.4999 * LENGTH, rel=1e-10)
    assert max(state.residuals.values()) <= SOLVED


@pytest.mark.parametrize("moment", [None, 0.0])
def test_exact_zero_load_touches_and_carries_nothing(moment):
    pair = coated_pair(100)
    gap = crown(pair.interface.x, 1.0) + 3e-6
    state = press(pair, gap, 0.0, moment)
    assert state.outcome is Outcome.NO_CONTACT
    assert not state.sigma_n.any() and (state.load, state.moment) == (0, 0)
    assert state.approach == 3e-6
    assert state.gap.min() == 0 and np.abs(state.gap - (gap - 3e-6)).max() <= 1e-20


def test_exact_one_node_under_the_load_line_takes_the_middle_of_the_rotations_that_open_the_others():
    pair = coated_pair(100)
    x = pair.interface.x
    state = press(pair, 1e-3 * np.abs(x - x[30]) + 5e-3 * x, 1e-6, 1e-6 * x[30])  # V about a slope of 5e-3
    assert np.flatnonzero(state.sigma_n).tolist() == [30]
    assert state.rotation == pytest.approx(-5e-3, rel=1e-6)


def test_exact_an_approach_is_counted_from_a_gap_that_lies_below_zero():
    pair = coated_pair(100)
    gap = crown(pair.interface.x, 1.0)
    above, below = press_by(pair, gap, 2e-6), press_by(pair, gap - 8e-6, 2e-6 - 8e-6)
    assert below.load == pytest.approx(above.load, rel=1e-9)
    assert below.sigma_n == pytest.approx(above.sigma_n, rel=1e-6, abs=1e-9 * above.sigma_n.max())


# contact fraction, dT/d(slide) [N/m], greatest pressure [Pa] and approach [m] of the coated pair at 200 cells, from
# both pieces together as one sparse saddle-point problem with its own element matrix (no condensation)
TWO_BODIES = {
    0.0: (1.00000, 4.04955667e8, 8.793741e5, 6.24762054e-8),
    1e-5: (0.93750, 4.04942844e8, 1.8289766e6, 6.24471316e-8),
    1e-4: (0.22250, 2.30395570e8, 7.9044006e6, -2.35528915e-7),
    1e-3: (0.02750, 1.22044346e8, 5.5868743e7, -5.43549795e-6),
}


@pytest.mark.parametrize("angle", TILTS)
def test_exact_coated_pair_agrees_with_two_whole_bodies(angle):
    pair = coated_pair(200)
    x, weight = pair.interface.x, pair.interface.weight
    state = press(pair, tilt(x, angle), LOAD)
    fraction, stiffness, peak, approach = TWO_BODIES[angle]
    active = state.sigma_n > 0
    assert weight[active].sum() / (LENGTH * WIDTH) == pytest.approx(fraction, rel=1e-12)
    tangent = np.linalg.solve(pair.tangential[np.ix_(active, active)], np.ones(active.sum())).sum()
    assert tangent == pytest.approx(stiffness, rel=1e-8)
    assert state.sigma_n.max() == pytest.approx(peak, rel=1e-6)
    assert state.approach == pytest.approx(approach, rel=1e-8)
