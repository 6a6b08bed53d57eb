"""Difficult cases for the unilateral solver: degenerate contacts, extreme scales, cycling sets and random gaps."""

from __future__ import annotations

from functools import cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import LENGTH, LOAD, WIDTH, draw_gap, make_coated_pair
from pressed import press, press_to_approach

from patchfem.contact import Holders, unilateral
from patchfem.contact.gaps import crown, tilt
from patchfem.contact.unilateral import make_problem
from patchfem.core import Compliance, Interface, NotConverged, Outcome, PatchfemError

RESIDUAL_TOL = 1e-12  # largest relative residual of a pressed patch, as `press_patch` states it


def make_pair(x, c) -> Compliance:
    """Return a compliance with the given matrix on given nodes."""
    return Compliance(Interface(x, np.full(x.size, WIDTH * LENGTH / x.size), WIDTH), c, c)


def nodal_forces(pair, state):
    """Return the nodal forces (m,) [N] of a state."""
    return state.sigma_n * pair.interface.weight


def solve_by_enumeration(c, x, gap, load=None, moment=None, spring=0.0):
    """Return (forces, delta, theta) of the subset of nodes that satisfies contact best, by trying every subset."""
    m = x.size
    n_motions = 0 if load is None else 1 if moment is None else 2
    rigid = np.stack([np.ones(m), x], axis=1)[:, :n_motions]
    best = (np.inf, None)
    for size in range(max(n_motions if spring == 0 else 1, 0), m + 1):
        for subset in map(list, combinations(range(m), size)):
            system = np.block(
                [
                    [c[np.ix_(subset, subset)], -rigid[subset]],
                    [rigid[subset].T, np.diag([0.0, spring][:n_motions])],
                ]
            )
            unknowns = np.linalg.lstsq(
                system, np.concatenate([-gap[subset], [load, moment][:n_motions]]), rcond=1e-15
            )[0]
            force = np.zeros(m)
            force[subset] = unknowns[:size]
            opening = gap + c @ force - rigid @ unknowns[size:]
            scale = (
                np.abs(gap) + np.abs(rigid * unknowns[size:]).sum(axis=1) + np.abs(c @ force).max()
            )
            violation = max(
                -force.min() / max(np.abs(force).sum(), 1e-300),
                (-opening / scale).max(),
                np.abs(opening / scale)[subset].max(initial=0.0),
            )
            best = min(
                best, (violation, tuple(force), *unknowns[size:]), key=lambda entry: entry[0]
            )
    return np.array(best[1]), *best[2:]


# ---- enumeration of contact sets


@given(
    n_nodes=st.integers(2, 7),
    seed=st.integers(0, 2**32 - 1),
    control=st.sampled_from(["load", "line", "spring", "by"]),
)
def test_exact_solution_equals_enumeration_of_contact_sets(n_nodes, seed, control):
    """Forces and approach equal those of the only subset of nodes that satisfies the contact conditions."""
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(n_nodes, n_nodes)) + np.eye(n_nodes)
    c = factor @ factor.T + 0.05 * np.eye(n_nodes)
    x = np.cumsum(rng.uniform(0.1, 1, n_nodes))
    x = x - (x[0] + x[-1]) / 2
    gap = 100 * rng.normal(size=n_nodes)
    pair = make_pair(x, c)
    load_line = rng.uniform(-0.49, 0.49) * np.ptp(x)
    spring = 10.0 ** rng.uniform(-3, 3)
    if control == "by":
        state = press_to_approach(pair, gap, gap.min() + 100)
        (expected,) = solve_by_enumeration(c, x, gap - gap.min() - 100)
    else:
        moment = None if control == "load" else 100 * load_line
        state = press(pair, gap, 100.0, moment, spring=spring if control == "spring" else 0.0)
        expected, *motion = solve_by_enumeration(
            c, x, gap, 100.0, moment, spring if control == "spring" else 0.0
        )
        assert state.approach == pytest.approx(motion[0], rel=1e-9, abs=1e-8)
    assert np.abs(nodal_forces(pair, state) - expected).max() <= 1e-9 * expected.sum()


# ---- single contact node


@pytest.mark.parametrize("node", [1, 37, 50, 88])
def test_exact_single_contact_node_carries_load(node):
    """A single node in contact carries the load, although its rotation is not unique."""
    pair = make_coated_pair(100)
    x = pair.interface.x
    c = pair.normal
    gap = 1e-2 * np.abs(x - x[node])
    for moment in (None, LOAD * x[node]):
        state = press(pair, gap, LOAD, moment)
        force = nodal_forces(pair, state)
        assert force[node] == pytest.approx(LOAD, rel=1e-15) and np.count_nonzero(force) == 1
        assert (
            state.approach == pytest.approx(c[node, node] * LOAD, rel=1e-12) and state.rotation == 0
        )
    tilted_state = press(pair, gap + tilt(x - x[node], 3e-2), LOAD, LOAD * x[node])
    assert np.count_nonzero(tilted_state.sigma_n) == 1 and -0.04 < tilted_state.rotation < -0.02
    offset_state = press(pair, gap, LOAD, LOAD * (x[node] + 1e-9 * LENGTH))
    assert np.count_nonzero(offset_state.sigma_n) == 2 and offset_state.moment == pytest.approx(
        LOAD * (x[node] + 1e-9 * LENGTH)
    )


# ---- extreme loads


@pytest.mark.parametrize("load", [1e201, 1.7e308, np.inf, np.nan, -1.0])
def test_refuses_invalid_load(load):
    """A negative, infinite, undefined or excessive load is refused, and a load line that tips the piece over."""
    with pytest.raises(PatchfemError, match=r"contact\.load: "):
        press(make_coated_pair(100), np.zeros(101), load)
    with pytest.raises(PatchfemError, match=r"contact\.load_line: .* tips over"):
        press(make_coated_pair(100), np.zeros(101), 1.0, 0.51 * LENGTH)


@pytest.mark.parametrize("moment", [None, LOAD * 1e-5])
def test_refuses_indefinite_compliance(moment):
    """A compliance that is not positive definite is refused, without advice on load or holder."""
    c = -make_coated_pair(100).normal
    with pytest.raises(
        NotConverged, match=r"not positive definite.*contact\.element_size"
    ) as caught:
        press(make_pair(make_coated_pair(100).interface.x, c), np.zeros(101), LOAD, moment)
    # a different load would not help
    assert "raise the load" not in str(caught.value) and "holder" not in str(caught.value)


# ---- limit of tipping


@pytest.mark.parametrize("fraction", [0.499, 0.499999999])
@pytest.mark.parametrize("side", [1, -1])
def test_exact_load_line_near_tipping_limit(fraction, side):
    """A load line just inside the end of the piece gives balanced, non-negative forces."""
    pair = make_coated_pair(100)
    x = pair.interface.x
    load_line = side * fraction * LENGTH
    for gap in (np.zeros(101), crown(x, 1.0), 1e-6 * np.random.default_rng(1).normal(size=101)):
        state = press(pair, gap, LOAD, LOAD * load_line)
        force = nodal_forces(pair, state)
        assert (
            abs(force.sum() - LOAD) <= 1e-12 * LOAD
            and abs(force @ x - LOAD * load_line) <= 1e-12 * LOAD * LENGTH
        )
        assert force.min() >= 0
        if np.count_nonzero(force) == 2:
            a, b = np.flatnonzero(force)
            assert force[b] == pytest.approx(LOAD * (load_line - x[a]) / (x[b] - x[a]), rel=1e-6)
    if fraction > 0.4999:
        end_force = nodal_forces(pair, press(pair, np.zeros(101), LOAD, LOAD * load_line))[
            -1 if side > 0 else 0
        ]
        assert end_force == pytest.approx(LOAD, rel=200 * (0.5 - fraction))


# ---- conjugate gradients

# compliance whose contact sets cycle from both starting sets
CYCLE = 1e-9 * np.array([[144.0, -60, 108], [-60, 54, -69], [108, -69, 101]])


def test_exact_cycling_sets_are_solved_by_gradients():
    """A problem whose contact sets cycle is solved from the set of the gradients and agrees with enumeration."""
    gap = np.array([2e-9, -8e-9, 8e-9])
    x = np.array([-1e-3, 0, 1e-3])
    problem = make_problem(x, gap, Holders(np.nan))
    for start in (gap < 0, np.ones(3)):
        near = unilateral.ContactSolution(1.0 * start, np.zeros(0))
        assert unilateral.solve_on_table(CYCLE, problem, near) is None
    state = press_to_approach(make_pair(x, CYCLE), gap + 8e-9, 8e-9)
    (expected,) = solve_by_enumeration(CYCLE, x, gap)
    assert nodal_forces(make_pair(x, CYCLE), state) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("moment, spring", [(None, 0.0), (1.5e-3, 0.0), (1.5e-3, 300.0)])
def test_exact_gradients_agree_with_enumeration(moment, spring):
    """Conjugate gradients find the forces to 1e-5 of the load with a prescribed, a free and a restrained rotation."""
    x = np.linspace(-1e-3, 1e-3, 7)
    c = 1e-9 * (np.exp(-np.abs(x[:, None] - x) / 1e-3) + 0.2 * np.eye(7))
    gap = 1e-9 * np.array([3.0, 0.4, 2.1, 0.0, 3.5, 1.2, 2.8])
    problem = make_problem(
        x, gap, Holders(5.0, moment=np.nan if moment is None else moment, spring=spring)
    )
    force, _ = unilateral.solve_by_gradients(c, problem)
    expected = solve_by_enumeration(c, x, gap, 5.0, moment, spring)[0]
    assert force == pytest.approx(expected, abs=5e-5)
    assert 2 < np.count_nonzero(expected) < 7


# ---- random gaps on random compliances


@cache
def _fine_pair() -> Compliance:
    """Return the coated pair with 400 elements."""
    return make_coated_pair(400)


def random_operator(rng, size):
    """Return nodes and compliance: nodes of the coated pair, or a random matrix of condition up to 1e6."""
    kind = rng.integers(4)
    if kind < 2:
        first = rng.integers(0, 402 - size)
        index = (
            np.sort(rng.choice(401, size, replace=False))
            if kind
            else np.arange(first, first + size)
        )
        x = _fine_pair().interface.x[index]
        c = _fine_pair().normal[np.ix_(index, index)]
    else:
        x = np.sort(rng.uniform(-0.5, 0.5, size)) + np.linspace(-1e-3, 1e-3, size)
        x = x * LENGTH / np.ptp(x)
        rotation = np.linalg.qr(rng.normal(size=(size, size)))[0]
        c = 1e-9 * (rotation * 10.0 ** -rng.uniform(0, rng.uniform(0, 6), size)) @ rotation.T
        c = (c + c.T) / 2
    return x - (x[0] + x[-1]) / 2, c


def random_gap(rng, x):
    """Return white noise, waves, spikes, steps or mixed scales of 1e-12 to 1e-2 m."""
    scale = 10.0 ** rng.uniform(-12, -2)
    m = x.size
    return (
        lambda: scale * rng.normal(size=m),
        lambda: draw_gap(rng, x, scale),
        lambda: scale * rng.normal(size=m) * (rng.random(m) < 0.1),
        lambda: scale * np.cumsum(rng.random(m) < 0.1) * rng.choice([-1, 1]),
        lambda: sum(10.0 ** rng.uniform(-12, -2) * rng.normal(size=m) for _ in range(3)),
    )[rng.integers(5)]()


class Loads(NamedTuple):
    """Load [N], moment [N m] and spring [N m/rad] of a random problem; None where none is prescribed."""

    load: float | None = None
    moment: float | None = None
    spring: float = 0.0


def random_state(seed, control):
    """Return (pair, gap, loads, state) of a random problem, with contact from almost one node to almost all."""
    rng = np.random.default_rng([seed, control])
    x, c = random_operator(rng, rng.integers(5, 202))
    pair = make_pair(x, c)
    gap = random_gap(rng, x)
    depth = np.ptp(gap) * 10.0 ** rng.uniform(-3, 3) if np.ptp(gap) > 0 else 1e-6
    load = depth / c.max()
    load_line = rng.uniform(-0.499, 0.499) * np.ptp(x)
    if control == 2:
        return pair, gap, Loads(), press_to_approach(pair, gap, gap.min() + depth)
    loads = Loads(load)
    if control == 1:
        loads = Loads(load, load * load_line)
    if control == 3:
        loads = Loads(load, 2 * load * load_line, 10.0 ** rng.uniform(-3, 10))
    state = press(pair, gap, loads.load, loads.moment, spring=loads.spring)
    return pair, gap, loads, state


@pytest.mark.parametrize(
    "control", range(4), ids=["load", "load and moment", "approach", "load and spring"]
)
def test_always_random_problems_satisfy_contact_conditions(control):
    """Random gaps on random compliances satisfy the contact conditions under every control."""
    for seed in range(25):
        pair, gap, loads, state = random_state(seed, control)
        x = pair.interface.x
        force = nodal_forces(pair, state)
        where = control, seed
        assert state.outcome is Outcome.DONE, where
        terms = np.abs(gap) + np.abs(state.rotation * x) + abs(state.approach)
        terms += np.abs(pair.normal) @ force + abs(gap.min())
        opening = gap + state.rotation * x - state.approach + pair.normal @ force
        opening /= terms
        assert force.min() >= 0 and opening.min() >= -RESIDUAL_TOL, where
        assert force @ np.abs(opening) <= RESIDUAL_TOL * force.sum(), where

        # Balance of what is prescribed
        if loads.load is not None:
            assert abs(force.sum() - loads.load) <= RESIDUAL_TOL * loads.load, where
        if loads.moment is not None:
            by_spring = loads.spring * state.rotation
            scale = loads.load * np.ptp(x) + abs(by_spring)
            assert abs(force @ x - loads.moment - by_spring) <= RESIDUAL_TOL * scale, where
