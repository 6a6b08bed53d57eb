"""The compiled search for contact sets against a unilateral solve at every motion."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import LOAD, coated_pair, rough

from patchfem.compiled import load
from patchfem.contact import N_BUILT, ContactSets, name_set, press
from patchfem.contact.set_arrays import N_PIVOTS, N_STORED
from patchfem.contact.unilateral import solve_forces
from patchfem.core import PatchfemError

PRESS = load("contact.press_kernels")


@cache
def crowned(cells: int = 40, radius: float = 50.0) -> tuple:
    """(sets, pressure) of a crowned pair under the load of the rig."""
    pieces = coated_pair(cells)
    x = pieces.interface.x
    state = press(pieces, x**2 / (2 * radius), LOAD, 0.1 * LOAD * x[-1])
    force = state.sigma_n * pieces.interface.weight
    opening = x**2 / (2 * radius) + state.rotation * x - state.approach
    return ContactSets(pieces.normal, x, opening, force > 0), state


def compiled_sets(sets, room: float = 64e6) -> tuple:
    """(arrays of the search, slot of the reference set)."""
    kept = sets.make_arrays(room)
    return kept, PRESS.build_first_set(kept, name_set(kept, sets.reference.in_contact))


def solved_at(sets, d: float, t: float) -> np.ndarray:
    """Nodal forces (m,) [N] of a unilateral solve at an approach d [m] and a rotation t beyond the reference."""
    gap = sets.opening - d + t * sets.x
    return (
        np.zeros(sets.x.size)
        if gap.min() >= 0
        else solve_forces(sets.c, sets.x, gap, np.zeros(0))[0]
    )


def check_state(sets, found: tuple, force, d: float, t: float, within: float) -> None:
    """Require the forces of a unilateral solve, their load and moment, and the energy from its definition."""
    load_, moment, energy = found
    wanted = solved_at(sets, d, t)
    assert np.abs(force - wanted).max() <= within * max(LOAD, wanted.max())
    assert (load_, moment) == pytest.approx(
        (wanted.sum(), wanted @ sets.x), abs=within * (LOAD + wanted.sum())
    )
    stored = force @ sets.c @ force / 2 - sets.energy - d * sets.load + t * sets.moment
    assert energy == pytest.approx(
        stored, abs=within * (sets.energy + abs(d) * sets.load + abs(energy))
    )


def path(sets, state, count: int, size: float = 1.5):
    """Motions (d, t) that lift off, come back and tilt to both sides."""
    k = np.arange(count)
    d = size * state.approach * np.sin(0.7 * k) - 0.2 * state.approach
    return np.stack([d, size * state.approach / sets.x[-1] * np.sin(1.3 * k + 0.4)], axis=1)


@pytest.mark.parametrize("room", [64e6, 0.0])
def test_exact_forces_are_those_of_the_solver(room):
    """Along motions that change the set, lift off and return; room for 16 sets, or for all of them."""
    sets, state = crowned()
    kept, slot = compiled_sets(sets, room)
    force = np.zeros(sets.x.size)
    apart = 0
    for d, t in path(sets, state, 80):
        slot = PRESS.find_set(kept, slot, d, t)
        check_state(sets, PRESS.press_state(kept, slot, d, t, force), force, d, t, 1e-12)
        apart += not force.any()
    assert apart >= 5 and kept.counters[N_BUILT] > 16
    assert room or kept.stored.names.size == kept.counters[N_STORED] == 16


def test_exact_many_pivots_do_not_wear_the_tableau():
    """After 3000 pivots to and fro the forces are those of a fresh solve."""
    sets, state = crowned()
    kept, slot = compiled_sets(sets, 0.0)
    force = np.zeros(sets.x.size)
    for d, t in path(sets, state, 400):
        slot = PRESS.find_set(kept, slot, d, t)
    assert kept.counters[N_PIVOTS] > 3000
    check_state(sets, PRESS.press_state(kept, slot, d, t, force), force, d, t, 1e-12)


@settings(settings.get_profile("costly"))
@given(st.integers(0, 10**6))
def test_always_rough_surfaces_are_solved(seed):
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
        slot = PRESS.find_set(kept, slot, d, t)
        check_state(sets, PRESS.press_state(kept, slot, d, t, force), force, d, t, 1e-11)


def test_refuses_a_start_without_load():
    with pytest.raises(PatchfemError, match=r"raise contact\.load"):
        ContactSets([[1e-9]], [0.0], [1e-7], [False])
