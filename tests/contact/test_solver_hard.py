"""Hard questions to the unilateral solver: degenerate contacts, extreme sizes, cycling sets, many random gaps."""

from __future__ import annotations

from functools import cache
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import LENGTH, LOAD, WIDTH, coated_pair, rough

from patchfem.contact import (
    RESIDUAL_TOL,
    StripCompliance,
    patch_problem,
    press,
    press_to_approach,
    unilateral,
)
from patchfem.contact.active_set import ContactProblem, solve_primal, solve_primal_dual
from patchfem.contact.conjugate_gradients import project_forces
from patchfem.contact.gaps import crown, tilt
from patchfem.contact.unilateral import explain_singular_set, solve
from patchfem.core import Compliance, Interface, NotConverged, Outcome, PatchfemError


def pair_on(x, c) -> Compliance:
    return Compliance(Interface(x, np.full(x.size, WIDTH * LENGTH / x.size), WIDTH), c, c)


def forces(pair, state):
    return state.sigma_n * pair.interface.weight


def by_enumeration(c, x, gap, load=None, moment=None, spring=0.0):
    """(forces, delta, theta): every subset of the nodes is tried, as a saddle-point system of LU."""
    m = x.size
    r = 0 if load is None else 1 if moment is None else 2
    rigid = np.stack([np.ones(m), x], axis=1)[:, :r]
    best = (np.inf, None)
    for size in range(max(r if spring == 0 else 1, 0), m + 1):
        for part in map(list, combinations(range(m), size)):
            system = np.block(
                [[c[np.ix_(part, part)], -rigid[part]], [rigid[part].T, np.diag([0.0, spring][:r])]]
            )
            answer = np.linalg.lstsq(
                system, np.concatenate([-gap[part], [load, moment][:r]]), rcond=1e-15
            )[0]
            force = np.zeros(m)
            force[part] = answer[:size]
            opening = gap + c @ force - rigid @ answer[size:]
            depth = (
                np.abs(gap) + np.abs(rigid * answer[size:]).sum(axis=1) + np.abs(c @ force).max()
            )
            bad = max(
                -force.min() / max(np.abs(force).sum(), 1e-300),
                (-opening / depth).max(),
                np.abs(opening / depth)[part].max(initial=0.0),
            )
            best = min(best, (bad, tuple(force), *answer[size:]), key=lambda entry: entry[0])
    return np.array(best[1]), *best[2:]


# ---- few nodes, against all subsets


@given(
    size=st.integers(2, 7),
    seed=st.integers(0, 2**32 - 1),
    control=st.sampled_from(["load", "line", "spring", "by"]),
)
def test_exact_the_only_subset_of_nodes_that_obeys_contact(size, seed, control):
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(size, size)) + np.eye(size)
    c = factor @ factor.T + 0.05 * np.eye(size)
    x = np.cumsum(rng.uniform(0.1, 1, size))
    x = x - (x[0] + x[-1]) / 2
    gap = 100 * rng.normal(size=size)
    pair = pair_on(x, c)
    line = rng.uniform(-0.49, 0.49) * np.ptp(x)
    spring = 10.0 ** rng.uniform(-3, 3)
    if control == "by":
        state = press_to_approach(pair, gap, gap.min() + 100)
        (wanted,) = by_enumeration(c, x, gap - gap.min() - 100)
    else:
        moment = None if control == "load" else 100 * line
        state = press(pair, gap, 100.0, moment, spring=spring if control == "spring" else 0.0)
        wanted, *motion = by_enumeration(
            c, x, gap, 100.0, moment, spring if control == "spring" else 0.0
        )
        assert state.approach == pytest.approx(motion[0], rel=1e-9, abs=1e-8)
    assert np.abs(forces(pair, state) - wanted).max() <= 1e-9 * wanted.sum()


# ---- one node touching


@pytest.mark.parametrize("node", [1, 37, 50, 88])
def test_exact_one_node_below_the_line_carries_all(node):
    """The rotation is not unique then; any that opens the others is an answer, and none is preferred to some."""
    pair = coated_pair(100)
    x = pair.interface.x
    c = pair.normal
    gap = 1e-2 * np.abs(x - x[node])
    for moment in (None, LOAD * x[node]):
        state = press(pair, gap, LOAD, moment)
        force = forces(pair, state)
        assert force[node] == pytest.approx(LOAD, rel=1e-15) and np.count_nonzero(force) == 1
        assert (
            state.approach == pytest.approx(c[node, node] * LOAD, rel=1e-12) and state.rotation == 0
        )
    leaning = press(pair, gap + tilt(x - x[node], 3e-2), LOAD, LOAD * x[node])
    assert np.count_nonzero(leaning.sigma_n) == 1 and -0.04 < leaning.rotation < -0.02
    beside = press(pair, gap, LOAD, LOAD * (x[node] + 1e-9 * LENGTH))
    assert np.count_nonzero(beside.sigma_n) == 2 and beside.moment == pytest.approx(
        LOAD * (x[node] + 1e-9 * LENGTH)
    )


# ---- sizes


@pytest.mark.parametrize("share", [1e-9, 1e-30, 1e-100, 1e-190])
@pytest.mark.parametrize("moment", [None, 0.0])
def test_exact_a_vanishing_load(share, moment):
    """Flat pieces are linear; of a crown only the crest touches, and closes by its own compliance."""
    pair = coated_pair(100)
    whole, part = (press(pair, np.zeros(101), f * LOAD, moment) for f in (1.0, share))
    assert np.abs(part.sigma_n / share - whole.sigma_n).max() <= 1e-12 * whole.sigma_n.max()
    crest = press(pair, crown(pair.interface.x, 1.0), share * LOAD, moment)
    assert np.count_nonzero(crest.sigma_n) == 1
    assert crest.approach == pytest.approx(share * LOAD * pair.normal[50, 50], rel=1e-12)


@pytest.mark.parametrize("load", [1e-300, 5e-324, 1e-201])
def test_refuses_a_load_without_digits(load):
    with pytest.raises(PatchfemError, match=r"contact\.load: .* too small .* give 0"):
        press(coated_pair(100), np.zeros(101), load)


@pytest.mark.parametrize("load", [1e201, 1.7e308, np.inf, np.nan, -1.0])
def test_refuses_a_load_that_is_no_load(load):
    with pytest.raises(PatchfemError, match=r"contact\.load: "):
        press(coated_pair(100), np.zeros(101), load)


def test_refuses_an_overlap_without_digits():
    with pytest.raises(PatchfemError, match=r"contact\.approach: .* too small"):
        press_to_approach(coated_pair(100), np.zeros(101), 1e-300)


@pytest.mark.parametrize("moment", [None, LOAD * 1e-5])
def test_refuses_an_indefinite_compliance(moment):
    c = -coated_pair(100).normal
    with pytest.raises(
        NotConverged, match=r"not positive definite.*contact\.element_size"
    ) as caught:
        press(pair_on(coated_pair(100).interface.x, c), np.zeros(101), LOAD, moment)
    # no load mends it
    assert "raise the load" not in str(caught.value) and "holder" not in str(caught.value)


def test_refuses_a_free_rotation_that_nothing_determines_with_the_keys_that_hold_it():
    pair = coated_pair(100)

    def message(**control):
        problem = patch_problem(pair.interface.x, np.zeros(101), LOAD, **control)
        return explain_singular_set(pair.normal, problem)

    assert "name contact.holder.rotational_stiffness" in message(moment=0.0)
    assert "raise contact.holder.rotational_stiffness" in message(moment=0.0, spring=1.0)
    assert "holder" not in message()


@pytest.mark.parametrize("control", ["load", "line", "spring"])
def test_exact_spikes_of_a_metre_are_as_if_their_nodes_were_not_there(control):
    pair = coated_pair(100)
    x = pair.interface.x
    rng = np.random.default_rng(4)
    gap = rough(rng, x, 3e-7)
    spikes = np.zeros(101, bool)
    spikes[rng.choice(np.arange(1, 100), 30, replace=False)] = True
    moment, spring = {
        "load": (None, 0.0),
        "line": (LOAD * 2e-3, 0.0),
        "spring": (LOAD * 2e-3, 1e4),
    }[control]
    state = press(pair, gap + spikes, LOAD, moment, spring=spring)
    kept = np.flatnonzero(~spikes)
    alone = pair_on(x[kept], pair.normal[np.ix_(kept, kept)])
    other = press(alone, gap[kept], LOAD, moment, spring=spring)
    assert np.abs(forces(pair, state)[kept] - forces(alone, other)).max() <= 1e-9 * LOAD
    assert state.approach == pytest.approx(other.approach, rel=1e-9)
    assert max(state.residuals.values()) <= RESIDUAL_TOL and not state.sigma_n[spikes].any()


@pytest.mark.parametrize("offset", [1e3, -1e3, 1e6])
@pytest.mark.parametrize("moment", [None, LOAD * 2e-3])
def test_exact_a_gap_a_kilometre_away(offset, moment):
    """The forces are those of the gap as it was rounded there; the approach is the sum."""
    pair = coated_pair(100)
    far = offset + crown(pair.interface.x, 1.0)
    near = far - offset  # exact: they are within a factor of two
    one = press(pair, far, LOAD, moment)
    two = press(pair, near, LOAD, moment)
    assert np.abs(one.sigma_n - two.sigma_n).max() <= 1e-12 * two.sigma_n.max()
    assert one.approach == pytest.approx(offset + two.approach, rel=1e-15)
    assert max(one.residuals.values()) <= RESIDUAL_TOL
    by = press_to_approach(pair, far, offset + 1e-6)
    same = press_to_approach(pair, near, (offset + 1e-6) - offset)
    assert np.abs(by.sigma_n - same.sigma_n).max() <= 1e-12 * same.sigma_n.max()


# ---- the edge of tipping


@pytest.mark.parametrize("share", [0.499, 0.4999, 0.499999, 0.499999999])
@pytest.mark.parametrize("side", [1, -1])
def test_exact_a_load_line_at_the_edge_of_tipping(share, side):
    pair = coated_pair(100)
    x = pair.interface.x
    line = side * share * LENGTH
    for gap in (np.zeros(101), crown(x, 1.0), 1e-6 * np.random.default_rng(1).normal(size=101)):
        state = press(pair, gap, LOAD, LOAD * line)
        force = forces(pair, state)
        assert (
            abs(force.sum() - LOAD) <= 1e-12 * LOAD
            and abs(force @ x - LOAD * line) <= 1e-12 * LOAD * LENGTH
        )
        assert max(state.residuals.values()) <= RESIDUAL_TOL and force.min() >= 0
        if np.count_nonzero(force) == 2:
            a, b = np.flatnonzero(force)
            assert force[b] == pytest.approx(LOAD * (line - x[a]) / (x[b] - x[a]), rel=1e-6)
    if share > 0.4999:
        last = forces(pair, press(pair, np.zeros(101), LOAD, LOAD * line))[-1 if side > 0 else 0]
        assert last == pytest.approx(LOAD, rel=200 * (0.5 - share))


@pytest.mark.parametrize("share", [0.5, np.nextafter(0.5, 0), 0.5000001, 0.7, 1e3, -0.5, -0.6])
def test_refuses_a_load_line_at_or_beyond_the_end(share):
    with pytest.raises(PatchfemError, match=r"contact\.load_line: .* tips over"):
        press(coated_pair(100), np.zeros(101), LOAD, LOAD * share * LENGTH)


@pytest.mark.parametrize(
    "change",
    [{"moment": np.nan}, {"moment": 0.0, "spring": -1.0}, {"moment": 0.0, "spring": np.nan}],
)
def test_refuses_a_moment_or_spring_without_meaning(change):
    with pytest.raises(PatchfemError, match=r"contact\.load_line"):
        press(coated_pair(100), np.zeros(101), LOAD, **change)


def test_exact_a_spring_holds_a_load_line_beyond_the_end():
    """All force on the last node, the spring takes the rest of the moment."""
    pair = coated_pair(100)
    x = pair.interface.x
    state = press(pair, 1e-2 * (x[-1] - x), LOAD, LOAD * LENGTH, spring=1e4)
    assert forces(pair, state)[-1] == pytest.approx(LOAD, rel=1e-13)
    assert state.rotation == pytest.approx((LOAD * x[-1] - LOAD * LENGTH) / 1e4, rel=1e-12)


# ---- ties


@pytest.mark.parametrize("moment", [None, 0.0])
def test_exact_equal_heights_share_as_their_compliance_says(moment):
    """A flat top of 21 equal nodes between deep valleys: the forces of the block alone."""
    pair = coated_pair(100)
    gap = np.full(101, 1e-3)
    top = slice(40, 61)
    gap[top] = 0.0
    share = np.linalg.solve(pair.normal[top, top], np.ones(21))
    state = press(pair, gap, LOAD, moment)
    assert np.abs(forces(pair, state)[top] - LOAD * share / share.sum()).max() <= 1e-12 * LOAD
    assert state.approach == pytest.approx(LOAD / share.sum(), rel=1e-12)


# ---- what stands behind the active set

# from all and from the overlap
CYCLE = 1e-9 * np.array([[144.0, -60, 108], [-60, 54, -69], [108, -69, 101]])


def test_exact_sets_that_come_back_are_left_to_the_gradients():
    gap = np.array([2e-9, -8e-9, 8e-9])
    x = np.array([-1e-3, 0, 1e-3])
    ask = patch_problem(x, gap)
    for start in (gap < 0, np.ones(3, bool)):
        assert solve_primal_dual(StripCompliance(CYCLE), ask, start)[0] is None
    state = press_to_approach(pair_on(x, CYCLE), gap + 8e-9, 8e-9)
    (wanted,) = by_enumeration(CYCLE, x, gap)
    assert forces(pair_on(x, CYCLE), state) == pytest.approx(wanted, rel=1e-12)


def test_exact_the_primal_method_solves_strips_whose_sets_come_back():
    """Under a prescribed approach each strip has a solution of its own, which enumeration finds."""
    x = np.array([-1e-3, 0, 1e-3])
    gaps = 1e-9 * np.array([[2.0, -8.0, 8.0], [-3.0, 1.0, -2.0], [2.0, -8.0, 7.0]])
    compliance = StripCompliance(CYCLE)
    no_loads = np.empty(0)
    problem = ContactProblem(gaps.ravel(), np.empty((9, 0)), target=no_loads, springs=no_loads)
    for start in (gaps < 0, np.ones(9, bool)):
        assert solve_primal_dual(compliance, problem, start.ravel())[0] is None
    wanted = [by_enumeration(CYCLE, x, gap)[0] for gap in gaps]
    solution, _ = solve_primal(compliance, problem, np.zeros(9))
    assert solution.force.reshape(3, 3) == pytest.approx(np.array(wanted), rel=1e-12)
    assert solve(compliance, problem).force == pytest.approx(solution.force, rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_exact_the_primal_method_presses_strips_that_turn_about_both_axes(seed):
    pair = coated_pair(40)
    n_strips = 3
    x = np.tile(pair.interface.x, n_strips)
    y = np.repeat([-3e-3, 0.0, 3e-3], pair.interface.x.size)
    rng = np.random.default_rng(seed)
    gap = np.concatenate([rough(rng, pair.interface.x, 1e-7) for _ in range(n_strips)])
    motions = np.stack([np.ones(x.size), x, y], axis=1)
    problem = ContactProblem(gap, motions, np.array([LOAD, 0.0, 0.0]), springs=np.zeros(3))
    solution, _ = solve_primal(
        StripCompliance(pair.normal), problem, np.full(x.size, LOAD / x.size)
    )
    displacement = solution.force.reshape(n_strips, -1) @ pair.normal
    opening = gap - motions @ solution.motion + displacement.ravel()
    in_contact = solution.force > 0
    assert n_strips < np.count_nonzero(in_contact) < x.size and solution.force.min() == 0
    assert motions.T @ solution.force == pytest.approx([LOAD, 0, 0], abs=1e-12 * LOAD)
    assert np.abs(opening[in_contact]).max() <= 1e-12 * displacement.max()
    assert opening[~in_contact].min() >= 0
    wanted = solve(StripCompliance(pair.normal), problem)
    assert np.abs(wanted.force - solution.force).max() <= 1e-10 * LOAD


CONTROLS = {
    "load": (LOAD, None, 0.0),
    "line": (LOAD, 2e-3 * LOAD, 0.0),
    "spring": (LOAD, 2e-3 * LOAD, 1e4),
    "soft spring": (LOAD, 2e-3 * LOAD, 1.0),
    "by": (None, None, 0.0),
}


@pytest.mark.parametrize("control", CONTROLS.values(), ids=CONTROLS.keys())
def test_exact_answers_do_not_change_where_every_set_comes_back(control, monkeypatch):
    pair = coated_pair(100)
    gap = rough(np.random.default_rng(3), pair.interface.x, 1e-6)
    ask = patch_problem(pair.interface.x, gap - (0.0 if control[0] else gap.min() + 1e-7), *control)
    wanted = solve(StripCompliance(pair.normal), ask)
    monkeypatch.setattr(unilateral, "solve_primal_dual", lambda *_: (None, 1))
    found = solve(StripCompliance(pair.normal), ask)
    assert np.abs(found.force - wanted.force).max() <= 1e-10 * wanted.force.sum()
    assert found.closing == pytest.approx(wanted.closing, rel=1e-10, abs=1e-20)


def test_refuses_to_return_what_did_not_converge(monkeypatch):
    pair = coated_pair(100)
    wrong = solve(
        StripCompliance(pair.normal), patch_problem(pair.interface.x, np.zeros(101), LOAD)
    )
    for bad in (
        wrong._replace(motion=wrong.motion * (1 + 1e-9)),
        wrong._replace(force=wrong.force * (1 + 1e-9)),
    ):
        monkeypatch.setattr(unilateral, "solve", lambda *_, bad=bad: bad)
        with pytest.raises(NotConverged, match="exceeds 1e-12"):
            press(pair, np.zeros(101), LOAD)


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(2, 60))
def test_exact_nearest_forces_are_a_projection(seed, size):
    """f - y = rigid q on f > 0 and y + rigid q <= 0 elsewhere: the conditions of the nearest point."""
    rng = np.random.default_rng(seed)
    rigid = np.stack([np.ones(size), np.linspace(-1, 1, size)], axis=1)
    y = rng.normal(size=size) * 10.0 ** rng.uniform(-3, 3)
    sums = np.array([1.0, rng.uniform(-0.99, 0.99)])
    f = project_forces(y, rigid, sums)
    assert np.abs(rigid.T @ f - sums).max() <= 1e-12 and f.min() >= 0
    if np.count_nonzero(f) > 1:
        q = np.linalg.lstsq(rigid[f > 0], (f - y)[f > 0], rcond=None)[0]
        size = np.abs(y).max() + np.abs(rigid @ q).max()
        assert np.abs(f - np.maximum(y + rigid @ q, 0)).max() <= 1e-9 * size


# ---- random gaps on random operators, every control


@cache
def _real() -> Compliance:
    return coated_pair(400)


def random_operator(rng, size):
    """(x, C): nodes of the coated pair, picked or in a row, or a random matrix of condition up to 1e6."""
    kind = rng.integers(4)
    if kind < 2:
        first = rng.integers(0, 402 - size)
        index = (
            np.sort(rng.choice(401, size, replace=False))
            if kind
            else np.arange(first, first + size)
        )
        x = _real().interface.x[index]
        c = _real().normal[np.ix_(index, index)]
    else:
        x = np.sort(rng.uniform(-0.5, 0.5, size)) + np.linspace(-1e-3, 1e-3, size)
        x = x * LENGTH / np.ptp(x)
        turn = np.linalg.qr(rng.normal(size=(size, size)))[0]
        c = 1e-9 * (turn * 10.0 ** -rng.uniform(0, rng.uniform(0, 6), size)) @ turn.T
        c = (c + c.T) / 2
    return x - (x[0] + x[-1]) / 2, c


def random_gap(rng, x):
    """White noise, waves, spikes, steps or mixed scales of 1e-12 to 1e-2 m."""
    size = 10.0 ** rng.uniform(-12, -2)
    m = x.size
    return (
        lambda: size * rng.normal(size=m),
        lambda: rough(rng, x, size),
        lambda: size * rng.normal(size=m) * (rng.random(m) < 0.1),
        lambda: size * np.cumsum(rng.random(m) < 0.1) * rng.choice([-1, 1]),
        lambda: sum(10.0 ** rng.uniform(-12, -2) * rng.normal(size=m) for _ in range(3)),
    )[rng.integers(5)]()


def random_state(seed, control):
    """(pair, gap, state) of a random question; loads from almost one node to almost all."""
    rng = np.random.default_rng([seed, control])
    x, c = random_operator(rng, rng.integers(5, 202))
    pair = pair_on(x, c)
    gap = random_gap(rng, x)
    depth = np.ptp(gap) * 10.0 ** rng.uniform(-3, 3) if np.ptp(gap) > 0 else 1e-6
    load = depth / c.max()
    line = rng.uniform(-0.499, 0.499) * np.ptp(x)
    if control == 0:
        return pair, gap, press(pair, gap, load)
    if control == 1:
        return pair, gap, press(pair, gap, load, load * line)
    if control == 2:
        return pair, gap, press_to_approach(pair, gap, gap.min() + depth)
    return pair, gap, press(pair, gap, load, 2 * load * line, spring=10.0 ** rng.uniform(-3, 10))


def campaign(control, seeds):
    for seed in seeds:
        pair, gap, state = random_state(seed, control)
        x = pair.interface.x
        force = forces(pair, state)
        base = gap.min()
        assert state.outcome is Outcome.DONE and max(state.residuals.values()) <= RESIDUAL_TOL, (
            control,
            seed,
        )
        bent = pair.normal @ force
        terms = (
            np.abs(gap)
            + np.abs(state.rotation * x)
            + abs(state.approach)
            + np.abs(pair.normal) @ force
            + abs(base)
        )
        opening = (gap + state.rotation * x - state.approach + bent) / terms
        assert force.min() >= 0 and opening.min() >= -RESIDUAL_TOL, (control, seed)
        assert force @ np.abs(opening) <= RESIDUAL_TOL * force.sum(), (control, seed)


CONTROL_NAMES = ["load", "load and moment", "approach", "load and spring"]


@pytest.mark.parametrize("count", [60, pytest.param(3000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("control", range(4), ids=CONTROL_NAMES)
def test_always_random_gaps_on_random_operators(control, count):
    campaign(control, range(count))
