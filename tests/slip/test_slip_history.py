"""Partial slip with its history: superposition on the same operator, closed forms, whole bodies, hard cases."""

from __future__ import annotations

from functools import cache

import numpy as np
import partial_slip
import pytest
import slip_sets
import slip_unlike
from hypothesis import given
from hypothesis import strategies as st
from load_path import load_path
from partial_slip import Step, advance, operators_of, start
from pieces import (
    COATED,
    COATING,
    HEIGHT,
    LENGTH,
    LOAD,
    TILTS,
    TITANIUM,
    WIDTH,
    bare,
    coated_pair,
    pair_of,
    refined_middle,
    rough,
)
from slip_paths import elements, histories
from two_bodies import unlike_pair

from patchfem.closed_forms.contact import cattaneo_shear, cattaneo_stick_half_width
from patchfem.contact.gaps import crown, tilt
from patchfem.contact.unilateral import press
from patchfem.core import Compliance, NotConverged, PatchfemError
from patchfem.mesh.tensor import graded_grid
from patchfem.slip.shear_modes import jenkins_set

MU = 0.3


def same(pair):
    """The pair with the normal compliance in shear too: the case of the superposition of Ciavarella and Jaeger."""
    return Compliance(pair.interface, pair.normal, pair.normal)


GAPS = {
    "flat": lambda x: np.zeros(x.size),
    "tilt": lambda x: tilt(x, 1e-4),
    "crown": lambda x: crown(x, 2.0),
    "leaning quartic": lambda x: 1e3 * x**4 + tilt(x, 2e-5),
}
each_gap = pytest.mark.parametrize("shape", GAPS.values(), ids=GAPS.keys())


class Superposition:
    """Shear forces from pressures alone: t = mu [p(N) - p(N - Q/mu)], slide mu [delta(N) - delta(N - Q/mu)]."""

    def __init__(self, pair, gap):
        self.pair, self.gap = pair, gap

    def pressed(self, load):
        state = press(self.pair, self.gap, load)
        return state.sigma_n * self.pair.interface.weight, state.approach

    def virgin(self, load, shear):
        (high, far), (low, near) = self.pressed(load), self.pressed(load - shear / MU)
        return MU * (high - low), MU * (far - near)

    def back(self, load, most, shear):
        t, q = self.virgin(load, most)
        half, by = self.virgin(load, (most - shear) / 2)
        return t - 2 * half, q - 2 * by


def begun(shape, load=LOAD, cells=100):
    pair = coated_pair(cells)
    gap = shape(pair.interface.x)
    ops = operators_of(same(pair))
    return ops, Superposition(pair, gap), advance(start(ops, gap), ops, Step(load=load, shear=0.0), MU)


def agrees(state, wanted, load=LOAD):
    forces, slide = wanted
    size = MU * state.normal_force.max()
    assert np.abs(state.shear_force - forces).max() <= 1e-10 * size
    assert state.slide == pytest.approx(slide, rel=1e-10, abs=1e-20)
    assert max(state.residuals.values()) <= 1e-10


@each_gap
@pytest.mark.parametrize("share", [0.01, 0.3, 0.7, 0.95, 0.9999])
def test_exact_virgin_stroke_is_a_difference_of_pressures(shape, share):
    ops, truth, state = begun(shape)
    state = advance(state, ops, Step(load=LOAD, shear=share * MU * LOAD), MU)
    agrees(state, truth.virgin(LOAD, share * MU * LOAD))


@given(seed=st.integers(0, 2**32 - 1), share=st.floats(1e-3, 0.999), angle=st.floats(-1e-3, 1e-3))
def test_always_convex_gaps_at_any_tilt_obey_the_superposition(seed, share, angle):
    bends = np.random.default_rng(seed).uniform(0, 1, 3) * [0.5, 1e4, 3e8]
    ops, truth, state = begun(lambda x: sum(c * x**(2 * k + 2) for k, c in enumerate(bends)) + tilt(x, angle), cells=40)
    agrees(advance(state, ops, Step(load=LOAD, shear=-share * MU * LOAD), MU),
           tuple(-part for part in truth.virgin(LOAD, share * MU * LOAD)))


@each_gap
def test_exact_unloading_and_reversal_superpose_twice_the_half_stroke(shape):
    """Mindlin: falling from Q* the shear is t(Q*) - 2 t((Q* - Q)/2), and the way back ends where it began."""
    ops, truth, state = begun(shape)
    most = 0.8 * MU * LOAD
    top = advance(state, ops, Step(load=LOAD, shear=most), MU)
    for share in (0.6, 0.0, -0.5, -1.0):
        down = advance(top, ops, Step(load=LOAD, shear=share * most), MU)
        agrees(down, truth.back(LOAD, most, share * most))
        again = advance(down, ops, Step(load=LOAD, shear=most), MU)
        agrees(again, (top.shear_force, top.slide))


@each_gap
def test_exact_load_and_shear_rising_together_below_friction_slip_nowhere(shape):
    """dQ/dN = k < mu: t grows with the pressure, t = k [p(N) - p(N_0)], however the contact grows."""
    ops, truth, _ = begun(shape)
    for low, rate in ((0.5 * LOAD, 0.29), (0.05 * LOAD, 0.1)):
        state = advance(start(ops, truth.gap), ops, Step(load=low, shear=0.0), MU)
        found, = load_path(state, ops, [Step(load=LOAD, shear=rate * (LOAD - low))], MU)
        (high, far), (few, near) = truth.pressed(LOAD), truth.pressed(low)
        agrees(found, (rate * (high - few), rate * (far - near)))
        assert abs(found.dissipated) <= 1e-13 * MU * LOAD * found.slide


@each_gap
def test_exact_steep_oblique_rise_and_fall_of_the_load_forget_their_order(shape):
    """dQ/dN > mu, then N falling at constant Q: as if the last load had stood from the start."""
    ops, truth, _ = begun(shape)
    state = advance(start(ops, truth.gap), ops, Step(load=50.0, shear=0.0), MU)
    high, low = load_path(state, ops, [Step(load=60.0, shear=5.0), Step(load=30.0, shear=5.0)], MU)
    agrees(high, truth.virgin(60.0, 5.0))
    agrees(low, truth.virgin(30.0, 5.0))


def test_order_an_oblique_path_without_cuts_is_one():
    ops, truth, _ = begun(GAPS["leaning quartic"])
    state = advance(start(ops, truth.gap), ops, Step(load=30.0, shear=0.0), MU)
    wanted = 0.2 * (truth.pressed(100.0)[0] - truth.pressed(30.0)[0])
    counts, errors = np.array([8, 16, 32, 64, 128]), []
    for count in counts:
        steps = [Step(load=30 + 70 * k / count, shear=14 * k / count) for k in range(1, count + 1)]
        last = load_path(state, ops, steps, MU, follow=False)[-1]
        errors.append(np.abs(last.shear_force - wanted).sum() / wanted.sum())
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.1)
    assert errors[-1] <= 2.5e-3


# ---- Hertz, Cattaneo, Mindlin

HALF = 0.25e-3  # small against the blocks: a half width of 1 mm costs 5 % of the loss
CELL = HALF / 48
MODULUS = TITANIUM[0] / (2 * (1 - TITANIUM[1] ** 2))
RADIUS = np.pi * HALF**2 * MODULUS / (4 * LOAD)


@cache
def hertz():
    grid = refined_middle(1.5 * HALF, CELL, 12.7e-3, 6e-3, 1.12)
    return grid, pair_of(grid, bare(TITANIUM), width=1.0)


@pytest.mark.parametrize("alike", [True, False])
def test_exact_sheared_crown_sticks_where_cattaneo_and_mindlin_say(alike):
    """Within a cell; the shear compliance of the blocks differs from the normal one only far from contact."""
    grid, pair = hertz()
    ops = operators_of(same(pair) if alike else pair)
    x = grid.x
    state = advance(start(ops, crown(x, RADIUS)), ops, Step(load=LOAD, shear=0.0), MU)
    for share in (0.2, 0.5, 0.8):
        shear = share * MU * LOAD
        found = advance(state, ops, Step(load=LOAD, shear=shear), MU)
        stick = np.abs(x[found.active & (found.slipping == 0)]).max()
        c = cattaneo_stick_half_width(shear, LOAD, RADIUS, MODULUS, MU)
        assert abs(stick - c) <= CELL
        inside = (np.abs(x) < 0.9 * HALF) & (np.abs(np.abs(x) - c) > 2.5 * CELL)
        wanted = cattaneo_shear(x, shear, LOAD, RADIUS, MODULUS, MU)
        off = np.abs(found.shear_force / pair.interface.weight - wanted)[inside]
        assert off.max() <= 4e-3 * wanted.max()


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 1.0])
def test_exact_loss_of_a_cycle_of_the_sheared_crown(share):
    """Mindlin's superposition on the approach of a line contact: W = (mu N)^2/(pi E*) [2 (1 - y^2) + 4 y ln y],
    y = 1 - Q/(mu N), per width; 2/3 (Q/mu N)^3 for small Q. The loss is t.ds summed, the loop area its check."""
    grid, pair = hertz()
    most = share * MU * LOAD
    y = 1 - share
    wanted = (MU * LOAD) ** 2 / (np.pi * MODULUS) * (2 * (1 - y**2) + (4 * y * np.log(y) if y > 1e-12 else 0))
    for ops in (operators_of(same(pair)), operators_of(pair)):
        state = advance(start(ops, crown(grid.x, RADIUS)), ops, Step(load=LOAD, shear=0.0), MU)
        state = advance(state, ops, Step(load=LOAD, shear=most), MU)
        begin = state
        for shear in (-most, most):
            state = advance(state, ops, Step(load=LOAD, shear=shear), MU)
        assert state.dissipated - begin.dissipated == pytest.approx(wanted, rel=5e-3)
        assert state.slide == pytest.approx(begin.slide, rel=1e-10)


def test_exact_loss_is_the_area_of_the_loop():
    """Jenkins loops: the corner-to-corner area of the elements is the loss of the nodes."""
    pair = coated_pair(60)
    ops = operators_of(pair)
    state = advance(start(ops, tilt(pair.interface.x, 3e-5)), ops, Step(load=LOAD, slide=0.0), MU)
    group = jenkins_set(pair.tangential, MU * state.normal_force)
    for size in (0.5, 0.9, 1.5):
        q = size * group.yield_slide[-1]
        here = advance(state, ops, Step(load=LOAD, slide=q), MU)
        back = advance(here, ops, Step(load=LOAD, slide=-q), MU)
        area = 4 * group.stiffness @ (group.yield_slide * np.maximum(q - group.yield_slide, 0))
        assert 2 * (back.dissipated - here.dissipated) == pytest.approx(area, rel=1e-8)


# ---- unlike pieces

@cache
def unlike(cells=60, height=4e-3):
    low, high = graded_grid(LENGTH, HEIGHT, LENGTH / cells, COATING), graded_grid(LENGTH, height, LENGTH / cells)
    return unlike_pair(low, COATED, high, bare((70e9, 0.3)), WIDTH)


@pytest.mark.share(1)
@pytest.mark.parametrize("angle", [0.0, 3e-5, -1e-3])
def test_exact_unlike_pieces_obey_coulomb_in_both_whole_bodies(angle):
    """The forces and holder motions put on both bodies in space axes: gap, stick and slip of the whole faces."""
    ops, whole = unlike()
    assert np.abs(ops.coupling).max() > 0.1 * np.abs(ops.tangential).max()
    mu, state = 0.4, start(ops, tilt(ops.x, angle))
    steps = [Step(load=LOAD / 2, shear=0.0), Step(load=LOAD, shear=0.3 * mu * LOAD), Step(load=LOAD, shear=mu * LOAD),
             Step(load=LOAD, shear=-0.5 * mu * LOAD), Step(load=0.7 * LOAD, moment=0.1, shear=0.1 * mu * LOAD),
             Step(load=LOAD, slide=1e-6)]
    for step in steps:
        last, state = state, advance(state, ops, step, mu)
        opened, slid = whole.relative(state.normal_force, state.shear_force, state.approach, state.rotation,
                                      state.slide)
        size, on = np.abs(slid).max() + abs(state.approach), state.active
        assert np.abs((state.gap + opened)[on]).max() <= 1e-8 * size
        assert (state.gap + opened)[~on].min(initial=0.0) >= -1e-8 * size
        assert np.abs(state.shear_force).max() <= (mu * state.normal_force).max() * (1 + 1e-14)
        moved = slid - last.slip
        assert np.abs(moved[on & (state.slipping == 0)]).max(initial=0.0) <= 1e-8 * size
        assert (state.slipping * moved).min() >= -1e-8 * size
        on_cone = state.slipping != 0
        assert state.shear_force[on_cone] == pytest.approx((state.slipping * mu * state.normal_force)[on_cone])
        assert np.abs(slid - state.slip).max() <= 1e-8 * size


def test_exact_without_friction_unlike_pieces_press_like_a_plain_contact():
    ops, _ = unlike()
    gap = crown(ops.x, 2.0)
    pair = Compliance(coated_pair(60).interface, ops.normal, ops.tangential)
    state = advance(start(ops, gap), ops, Step(load=LOAD, slide=1e-6), 0.0)
    assert not state.shear_force.any()
    assert np.abs(state.normal_force / pair.interface.weight - press(pair, gap, LOAD).sigma_n).max() <= 1e-3


def test_exact_a_coupling_of_nothing_changes_nothing():
    """Newton on both problems together, C_nt of 1e-30 m/N, against the separate solve of alike pieces."""
    pair = coated_pair(60)
    gap = tilt(pair.interface.x, 3e-5)
    plain, tiny = operators_of(pair), operators_of(pair, np.full(pair.normal.shape, 1e-30))
    assert operators_of(pair, np.zeros(pair.normal.shape)).coupling is None
    one, two = start(plain, gap), start(tiny, gap)
    for shear in (0.0, 0.6, 1.0, -0.4, 0.2):
        step = Step(load=LOAD, shear=shear * MU * LOAD)
        one, two = advance(one, plain, step, MU), advance(two, tiny, step, MU)
        assert np.abs(one.shear_force - two.shear_force).max() <= 1e-10 * MU * LOAD
        assert one.slide == pytest.approx(two.slide, rel=1e-9, abs=1e-20)


def test_always_both_ways_to_the_answer_of_unlike_pieces_agree():
    ops, _ = unlike()
    x, mu = ops.x, 0.3
    zero = np.zeros(x.size)
    for share in (0.0, 0.5, 0.9):
        case = tilt(x, 3e-5), np.array([LOAD]), share * mu * LOAD, None, zero, mu, 0.0
        newton = slip_unlike.coupled_forces(ops.inverse("both"), x, lambda _, c=case: c[:4], zero, mu, 0.0,
                                          np.ones(x.size, bool), np.zeros(x.size, np.int8))
        turns = slip_unlike._alternate(ops.inverse("both"), x, *case)
        for one, two in zip(newton[:2], turns[:2], strict=True):
            assert np.abs(one - two).max() <= 1e-11 * LOAD


def test_refuses_friction_so_strong_that_several_answers_exist():
    """mu 3 between a soft and a very stiff piece: the system of the sets found has lost its positive determinant."""
    low, high = graded_grid(LENGTH, HEIGHT, LENGTH / 40, COATING), graded_grid(LENGTH, 4e-3, LENGTH / 40)
    ops, _ = unlike_pair(low, COATED, high, bare((1e12, 0.2)), WIDTH)
    state = advance(start(ops, np.zeros(41)), ops, Step(load=LOAD, shear=0.0), 3.0)
    with pytest.raises(NotConverged, match=r"more than one state of stick and slip.*friction\.static"):
        advance(state, ops, Step(load=LOAD, shear=3 * LOAD), 3.0)


# ---- the rig's pieces: parallel elements, cost, hard cases

@pytest.mark.parametrize("angle", TILTS)
def test_exact_parallel_elements_repeat_the_nodes(angle):
    pair = coated_pair(100)
    ops = operators_of(pair)
    first = advance(start(ops, tilt(pair.interface.x, angle)), ops, Step(load=LOAD, slide=0.0), MU)
    group = jenkins_set(pair.tangential, MU * first.normal_force)
    for path in histories(3, group.yield_slide[-1]):
        state, found = first, []
        for q in path:
            state = advance(state, ops, Step(load=LOAD, slide=q), MU)
            found.append(state.shear)
        assert np.abs(np.array(found) - elements(group, path)).max() <= 1e-10 * MU * LOAD


@pytest.mark.parametrize("angle", TILTS)
@pytest.mark.slow
def test_exact_parallel_elements_repeat_401_nodes(angle):
    """20 histories of 40 reversals; the corner nodes with a negative row sum cost 4e-8 of mu N."""
    pair = coated_pair(400)
    ops = operators_of(pair)
    first = advance(start(ops, tilt(pair.interface.x, angle)), ops, Step(load=LOAD, slide=0.0), MU)
    group = jenkins_set(pair.tangential, MU * first.normal_force)
    for path in histories(20, group.yield_slide[-1]):
        state, found = first, []
        for q in path:
            state = advance(state, ops, Step(load=LOAD, slide=q), MU)
            found.append(state.shear)
        assert np.abs(np.array(found) - elements(group, path)).max() <= \
            (5e-8 if group.reluctant else 1e-12) * MU * LOAD


@pytest.mark.share(0)
@pytest.mark.parametrize("control", ["shear", "slide"])
def test_exact_a_thousand_increments_are_one(control):
    pair = coated_pair(60)
    ops = operators_of(pair)
    state = advance(start(ops, tilt(pair.interface.x, 1e-5)), ops, Step(load=LOAD, shear=0.0), MU)
    reach = 0.9 * MU * LOAD if control == "shear" else 2e-8
    once = advance(state, ops, Step(load=LOAD, **{control: reach}), MU)
    for value in reach * np.arange(1, 1001) / 1000:
        state = advance(state, ops, Step(load=LOAD, **{control: value}), MU)
    assert np.abs(state.shear_force - once.shear_force).max() <= 1e-9 * once.shear_force.max()
    assert state.slide == pytest.approx(once.slide, rel=1e-9)
    assert state.dissipated == pytest.approx(once.dissipated, rel=1e-9)


def test_exact_one_node_is_a_spring_and_a_slider():
    pair = coated_pair(40)
    ops = operators_of(pair)
    gap = np.full(41, 1e-3)
    gap[7] = 0.0
    stiff, limit = 1 / pair.tangential[7, 7], MU * 2.0
    state = advance(start(ops, gap), ops, Step(load=2.0, slide=0.0), MU)
    at, force = 0.0, 0.0
    for q in np.array([0.5, 2.0, 1.2, -3.0, -2.5]) * limit / stiff:
        force = np.clip(force + stiff * (q - at), -limit, limit)
        at, state = q, advance(state, ops, Step(load=2.0, slide=q), MU)
        assert state.shear == pytest.approx(force, rel=1e-12)
    assert np.flatnonzero(state.active).tolist() == [7]


def test_exact_pieces_that_part_forget():
    """N to zero and back: the shear that was locked in is gone; nodes that only left for a while forget as well."""
    pair = coated_pair(60)
    ops = operators_of(pair)
    state = advance(start(ops, tilt(pair.interface.x, 1e-5)), ops, Step(load=LOAD, shear=0.0), MU)
    state = advance(state, ops, Step(load=LOAD, slide=3e-8), MU)
    assert state.shear > 0.1 * MU * LOAD
    apart = advance(state, ops, Step(load=0.0, slide=3e-8), MU)
    assert apart.shear == 0 and apart.load == 0 and not apart.active.any()
    back = advance(apart, ops, Step(load=LOAD, slide=3e-8), MU)
    assert np.abs(back.shear_force).max() <= 1e-12 * MU * LOAD
    less = load_path(state, ops, [Step(load=0.02 * LOAD, slide=3e-8), Step(load=LOAD, slide=3e-8)], MU)
    gone = state.active & ~less[0].active
    assert gone.any() and np.abs(less[1].shear_force).sum() < np.abs(state.shear_force).sum()


def test_exact_friction_of_nothing_and_without_end():
    pair = coated_pair(60)
    ops = operators_of(pair)
    gap = tilt(pair.interface.x, 1e-5)
    state = advance(start(ops, gap), ops, Step(load=LOAD, slide=0.0), MU)
    free = advance(state, ops, Step(load=LOAD, slide=1e-6), 0.0)
    assert not free.shear_force.any() and free.slip == pytest.approx(np.full(61, 1e-6))
    assert advance(state, ops, Step(load=LOAD, shear=0.0), 0.0).slide == state.slide
    stuck = advance(state, ops, Step(load=LOAD, slide=1e-6), 1e6)
    on = state.active
    wanted = np.linalg.solve(pair.tangential[np.ix_(on, on)], np.full(on.sum(), 1e-6))
    assert stuck.shear_force[on] == pytest.approx(wanted, rel=1e-10, abs=1e-11 * wanted.max())
    assert not stuck.slipping.any() and stuck.dissipated == 0


@pytest.mark.parametrize("way", [1, -1])
def test_exact_shear_at_the_friction_limit_and_refusal_beyond(way):
    pair = coated_pair(60)
    ops = operators_of(pair)
    state = advance(start(ops, tilt(pair.interface.x, 1e-5)), ops, Step(load=LOAD, shear=0.0), MU)
    full = advance(state, ops, Step(load=LOAD, shear=way * MU * LOAD), MU)
    assert full.shear_force == pytest.approx(way * MU * full.normal_force)
    group = jenkins_set(pair.tangential, MU * state.normal_force)
    assert abs(full.slide) == pytest.approx(group.yield_slide[-1], rel=1e-9)
    for more in (1e-9, 1.0):
        with pytest.raises(PatchfemError, match="gross slip"):
            advance(state, ops, Step(load=LOAD, shear=way * MU * LOAD * (1 + more)), MU)
    far = advance(full, ops, Step(load=LOAD, slide=way * 1.0), MU)
    assert far.shear == pytest.approx(way * MU * LOAD, rel=1e-12)
    assert far.dissipated - full.dissipated == pytest.approx(MU * LOAD * (1.0 - abs(full.slide)), rel=1e-9)


def test_always_the_slow_method_finds_the_same():
    """The safeguarded program, one node at a time, against the active set, rough gaps, force and slide control."""
    rng = np.random.default_rng(11)
    for _ in range(12):
        pair = coated_pair(40)
        ops = operators_of(pair)
        state = advance(start(ops, rough(rng, pair.interface.x, 10 ** rng.uniform(-8, -6))), ops,
                        Step(load=LOAD, slide=0.0), MU)
        state = advance(state, ops, Step(load=LOAD, shear=rng.uniform(-1, 1) * MU * LOAD), MU)
        index = np.flatnonzero(state.active)
        limit = MU * state.normal_force[index]
        block = pair.tangential[np.ix_(index, index)]
        for control in ({"total": rng.uniform(-1, 1) * limit.sum()}, {"slide": rng.normal() * 1e-7}):
            given_ = {"total": None, "slide": None, **control}
            quick = slip_sets.bounded_shear(ops.inverse("tangential"), index, state.slip[index], limit,
                                            np.zeros(index.size, np.int8), **given_)
            slow = slip_sets._one_by_one(block, state.slip[index], limit, given_["total"], given_["slide"])
            assert np.abs(quick[0] - slow[0]).max() <= 1e-11 * limit.sum()
            assert quick[1] == pytest.approx(slow[1], rel=1e-10, abs=1e-18)


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(2, 9), by_force=st.booleans())
def test_always_any_positive_definite_compliance_is_solved(seed, size, by_force):
    """Slip zones may shrink within a stroke here; both methods are judged by the conditions themselves."""
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(size, size)) + 0.5 * np.eye(size)
    c, made, limit = factor @ factor.T, rng.normal(size=size), rng.uniform(0.1, 1, size)
    total = rng.uniform(-0.99, 0.99) * limit.sum() if by_force else None
    slide = None if by_force else 3 * rng.normal()
    kept = slip_sets.Kept(c)
    quick = slip_sets.bounded_shear(kept, np.arange(size), made, limit, np.zeros(size, np.int8), total, slide)
    for force, q, *_ in (quick, slip_sets._one_by_one(c, made, limit, total, slide)):
        moved, small = q - made - c @ force, 1e-9 * (np.abs(c @ limit).max() + np.ptp(made) + abs(q))
        assert np.all(np.abs(force) <= limit * (1 + 1e-12) + 1e-13)
        assert np.abs(moved[np.abs(force) < limit * (1 - 1e-9)]).max(initial=0.0) <= small
        assert (np.sign(force) * moved).min() >= -small
        assert (force.sum() == pytest.approx(total, abs=1e-9)) if by_force else q == slide


@pytest.mark.parametrize("step", [
    Step(load=LOAD), Step(shear=0.0), Step(load=LOAD, approach=0.0, shear=0.0), Step(load=LOAD, shear=0.0, slide=0.0),
    Step(load=-1.0, shear=0.0), Step(load=np.nan, shear=0.0), Step(load=LOAD, slide=np.inf),
    Step(approach=0.0, moment=1.0, slide=0.0), Step(load=LOAD, moment=LOAD * LENGTH, slide=0.0),
    Step(load=LOAD, shear=0.0, gap=np.zeros(3))])
def test_refuses_a_step_without_a_meaning(step):
    ops = operators_of(coated_pair(40))
    with pytest.raises(PatchfemError, match="contact"):
        advance(start(ops, np.zeros(41)), ops, step, MU)


def test_always_a_wrong_answer_is_seen_by_its_residuals():
    """The check is its own: a force moved from node to node, or a slip left out, is refused."""
    pair = coated_pair(40)
    ops = operators_of(pair)
    state = advance(start(ops, tilt(pair.interface.x, 1e-5)), ops, Step(load=LOAD, shear=0.0), MU)
    step = Step(load=LOAD, shear=0.5 * MU * LOAD)
    good = advance(state, ops, step, MU)

    def worst(shear, slide):
        found = partial_slip.slip_residuals(ops, state.slip, good.gap, good.normal_force, shear, good.approach, 0.0,
                                            slide, step, MU)
        return max(found.values())

    assert worst(good.shear_force, good.slide) <= 1e-12
    moved = good.shear_force.copy()
    moved[[3, 30]] += [1e-6 * LOAD, -1e-6 * LOAD]
    assert worst(moved, good.slide) > 1e-7
    assert worst(good.shear_force, good.slide * (1 + 1e-6)) > 1e-8
    assert worst(0.5 * MU * good.normal_force, good.slide) > 1e-3
