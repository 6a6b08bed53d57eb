"""Contact sets: the same forces as the solver, the energy of a convex potential, plain and compiled."""

from functools import cache

import numpy as np
import pytest
from contact_sets_reference import ContactSets
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import LOAD, coated_pair, rough

from patchfem.compiled import load
from patchfem.contact.unilateral import press, solve_forces
from patchfem.core import PatchfemError

PRESS = load("contact.press_kernels")


@cache
def crowned(cells: int = 40, radius: float = 50.0) -> tuple:
    """(sets, pressure, openings without forces) of a crowned pair under the load of the rig."""
    pieces = coated_pair(cells)
    x = pieces.interface.x
    state = press(pieces, x**2 / (2 * radius), LOAD, 0.1 * LOAD * x[-1])
    force = state.sigma_n * pieces.interface.weight
    opening = x**2 / (2 * radius) + state.rotation * x - state.approach
    return ContactSets(pieces.normal, x, opening, force > 0), state, opening


def compiled_sets(sets, room: float = 64e6) -> tuple:
    """(kept, slot of the reference set)."""
    arrays = sets.arrays(room)
    kept = PRESS.SetArrays(**arrays)
    return kept, PRESS.begin(kept, sets.name(arrays))


def tangent(touching) -> np.ndarray:
    """Change (2, 2) of load [N] and moment [N m] per approach [m] and rotation [rad] as long as the set stays."""
    _, _, _, dd, dt, tt = touching.energy
    return np.array([[dd, dt], [-dt, -tt]])


def share_of(touching, d: float, t: float, dd: float, dt: float) -> float:
    """Share [1] of an increment (dd, dt) from (d, t) on after which the set changes."""
    here, rate = touching.values(d, t), dd * touching.rows[1] + dt * touching.rows[2]
    falls = rate < 0
    return float((np.maximum(here[falls], 0.0) / -rate[falls]).min(initial=np.inf))


def resultant(sets, d: float, t: float, start=None) -> tuple:
    """Load [N], moment [N m] and energy [J] of the preloaded contact at a motion beyond the reference."""
    q = sets.at(d, t, start).energy
    by_d, by_t = q[3] * d + q[4] * t, q[4] * d + q[5] * t
    return sets.load + q[1] + by_d, sets.moment - q[2] - by_t, q[0] + d * (q[1] + by_d / 2) + t * (q[2] + by_t / 2)


def path(sets, state, count: int, size: float = 1.5):
    """Motions (d, t) that lift off, come back and tilt to both sides."""
    k = np.arange(count)
    d = size * state.approach * np.sin(0.7 * k) - 0.2 * state.approach
    return np.stack([d, size * state.approach / sets.x[-1] * np.sin(1.3 * k + 0.4)], axis=1)


def test_exact_forces_are_those_of_the_solver():
    """Compiled, plain and `unilateral.solve_forces` at motions that change the set, lift off and return."""
    sets, state, opening = crowned()
    kept, slot = compiled_sets(sets)
    force, apart = np.zeros(sets.x.size), 0
    for d, t in path(sets, state, 60):
        slot = PRESS.locate(kept, slot, d, t)
        load, moment, energy = PRESS.press_state(kept, slot, d, t, force)
        gap = opening - d + t * sets.x
        want = np.zeros(force.size) if gap.min() >= 0 else solve_forces(sets.c, sets.x, gap, np.zeros(0))[0]
        assert np.abs(force - want).max() <= 1e-12 * LOAD
        plain = sets.at(d, t)
        assert np.abs(plain.forces(d, t) - want).max() <= 1e-12 * LOAD and sets.flaw(plain, d, t) <= 1e-12
        stored = force @ sets.c @ force / 2 - sets.energy - d * sets.load + t * sets.moment
        size = sets.energy + abs(d) * sets.load
        assert (load, moment) == pytest.approx((force.sum(), force @ sets.x), abs=1e-12 * LOAD)
        assert energy == pytest.approx(stored, abs=1e-12 * size)
        assert (load, moment, energy) == pytest.approx(resultant(sets, d, t), abs=1e-12 * LOAD)
        apart += not force.any()
    assert apart >= 5 and len(sets.kept) > 10


def test_exact_the_energy_returns_what_the_forces_took():
    """E(end) - E(start) is the work of (N - N0, M - M0) over a closed path, by Gauss points between the set changes."""
    sets, state, _ = crowned()
    corner = path(sets, state, 4)
    nodes, weights = np.polynomial.legendre.leggauss(3)
    for a, b in zip(corner, np.roll(corner, -1, axis=0)):
        work, touching, at, cuts = 0.0, sets.at(*a), 0.0, 0
        while at < 1:
            here = a + at * (b - a)
            end = min(1.0, at + share_of(touching, *here, *(b - a)))
            for s, w in zip(nodes, weights):
                p = a + (at + (end - at) * (1 + s) / 2) * (b - a)
                load, moment, _ = resultant(sets, *p, touching)
                work += w / 2 * (end - at) * ((load - sets.load) * (b - a)[0] - (moment - sets.moment) * (b - a)[1])
            at, cuts = end, cuts + 1
            just = a + min(1.0, at + 1e-9) * (b - a)
            touching = sets.at(*just, touching)
        rise = resultant(sets, *b)[2] - resultant(sets, *a)[2]
        assert work == pytest.approx(rise, abs=1e-9 * sets.energy) and cuts > 3


def test_exact_tangent_holds_to_the_border_of_its_set():
    """Inside the share the tangent gives N and M to round-off, beyond it the set is another one."""
    sets, state, _ = crowned()
    touching = sets.reference
    for way in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.3, -1.0)):
        step = np.array([way[0] * state.approach, way[1] * state.approach / sets.x[-1]])
        share = share_of(touching, 0.0, 0.0, *step)
        inside, beyond = 0.999 * share * step, 1.01 * share * step
        load, moment, _ = resultant(sets, *inside)
        change = tangent(touching) @ inside
        assert (load, moment) == pytest.approx((sets.load + change[0], sets.moment + change[1]), abs=1e-12 * LOAD)
        assert sets.at(*inside) is touching and sets.at(*beyond) is not touching
    both = tangent(touching)
    assert both[0, 1] == pytest.approx(-both[1, 0], rel=1e-10)
    assert both[0, 0] > 0 > both[1, 1]


def test_exact_lift_off_leaves_nothing():
    sets, state, _ = crowned()
    kept, slot = compiled_sets(sets)
    force = np.ones(sets.x.size)
    far = -3 * state.approach
    there = PRESS.locate(kept, slot, far, 0.0)
    load, moment, energy = PRESS.press_state(kept, there, far, 0.0, force)
    assert load == pytest.approx(0, abs=1e-13) and moment == pytest.approx(0, abs=1e-15) and not force.any()
    assert energy == pytest.approx(-sets.energy - far * sets.load, rel=1e-14)
    assert PRESS.locate(kept, there, 0.0, 0.0) == slot


def test_exact_one_node_is_a_spring():
    sets = ContactSets([[1e-9]], [0.0], [-1e-7], [True])
    assert sets.load == pytest.approx(100) and tangent(sets.reference)[0, 0] == pytest.approx(1e9)
    kept, slot = compiled_sets(sets)
    force = np.zeros(1)
    for d, want in ((5e-8, 150.0), (-1e-7, 0.0), (-2e-7, 0.0)):
        slot = PRESS.locate(kept, slot, d, 0.0)
        assert PRESS.press_state(kept, slot, d, 0.0, force)[0] == pytest.approx(want, abs=1e-12)


def test_exact_a_full_room_drops_the_oldest():
    """Room for 16 sets gives the forces that room for all gives, and stays within its slots."""
    sets, state, _ = crowned()
    (small, a), (large, b) = compiled_sets(sets, 0.0), compiled_sets(sets)
    one, two = np.zeros(sets.x.size), np.zeros(sets.x.size)
    for d, t in path(sets, state, 80):
        a, b = PRESS.locate(small, a, d, t), PRESS.locate(large, b, d, t)
        PRESS.press_state(small, a, d, t, one)
        PRESS.press_state(large, b, d, t, two)
        assert np.abs(one - two).max() <= 1e-12 * LOAD
    assert small.names.size == small.meta[0] == 16 and small.meta[2] > large.meta[2] > 16


def test_exact_many_pivots_do_not_wear_the_tableau():
    """After 3000 pivots to and fro the forces are those of a fresh factor."""
    sets, state, _ = crowned()
    kept, slot = compiled_sets(sets, 0.0)
    force = np.zeros(sets.x.size)
    for d, t in path(sets, state, 400):
        slot = PRESS.locate(kept, slot, d, t)
    assert kept.meta[3] > 3000
    PRESS.press_state(kept, slot, d, t, force)
    assert np.abs(force - sets.at(d, t).forces(d, t)).max() <= 1e-12 * LOAD


@pytest.mark.slow
@given(st.integers(0, 10**6), st.integers(2, 9))
def test_always_any_definite_operator_is_solved(seed, m):
    """Random definite matrices, far from those of elastic bodies: block steps may cycle, the search still ends."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(m, m))
    c = root @ root.T + 0.05 * np.eye(m)
    x = np.sort(rng.uniform(-1, 1, m))
    opening = rng.normal(size=m) - 2.0
    on = solve_forces(c, x, opening, np.zeros(0))[0] > 0
    sets = ContactSets(c, x, opening, on)
    kept, slot = compiled_sets(sets)
    force = np.zeros(m)
    for d, t in rng.normal(size=(8, 2)) * 2:
        slot = PRESS.locate(kept, slot, d, t)
        assert slot >= 0
        PRESS.press_state(kept, slot, d, t, force)
        gap = opening - d + t * x + c @ force
        size = np.abs(opening).max() + abs(d) + abs(t) + np.abs(c).max() * force.sum()
        assert gap.min() >= -1e-11 * size and np.abs(gap * (force > 0)).max() <= 1e-11 * size
        assert np.abs(force - sets.at(d, t).forces(d, t)).max() <= 1e-9 * max(force.max(), 1.0)


@settings(settings.get_profile("costly"))
@given(st.integers(0, 10**6))
def test_always_rough_surfaces(seed):
    """A rough gap, any motion: complementary to 1e-12 by the definition."""
    rng = np.random.default_rng(seed)
    pieces = coated_pair(40)
    x = pieces.interface.x
    gap = rough(rng, x, 2e-7)
    state = press(pieces, gap, LOAD, 0.0)
    force = state.sigma_n * pieces.interface.weight
    sets = ContactSets(pieces.normal, x, gap + state.rotation * x - state.approach, force > 0)
    kept, slot = compiled_sets(sets)
    deep = np.abs(sets.opening).max()
    for d, t in rng.normal(size=(6, 2)) * [deep, deep / x[-1]]:
        slot = PRESS.locate(kept, slot, d, t)
        load, moment, _ = PRESS.press_state(kept, slot, d, t, force)
        touching = sets.contact_set(kept.on[slot].copy())
        assert sets.flaw(touching, d, t) <= 1e-12
        assert (load, moment) == pytest.approx(resultant(sets, d, t)[:2], abs=1e-11 * (LOAD + load))


def test_refuses_a_start_without_load():
    with pytest.raises(PatchfemError, match=r"raise contact\.load"):
        ContactSets([[1e-9]], [0.0], [1e-7], [False])
