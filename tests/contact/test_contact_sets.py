"""The compiled search for contact sets compared with a unilateral solve at every rigid-body motion."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import LOAD, draw_gap, make_coated_pair
from pressed import press, solve_forces

from patchfem.compiled import load
from patchfem.contact import ContactSets, hash_set
from patchfem.contact.set_arrays import N_STORED

PRESS = load("contact.press_kernels")


@cache
def make_crowned_sets(cells: int = 40, radius: float = 50.0) -> tuple:
    """Return the contact sets and the state of a crowned pair under the load of the rig."""
    pieces = make_coated_pair(cells)
    x = pieces.interface.x
    state = press(pieces, x**2 / (2 * radius), LOAD, 0.1 * LOAD * x[-1])
    force = state.sigma_n * pieces.interface.weight
    opening = x**2 / (2 * radius) + state.rotation * x - state.approach
    return ContactSets(pieces.normal, x, opening, force > 0), state


def make_search_arrays(sets, memory_limit: float = 64e6) -> tuple:
    """Return the arrays of the search and the slot of the reference set."""
    arrays = sets.make_arrays(memory_limit)
    return arrays, PRESS.build_first_set(arrays, hash_set(arrays, sets.in_contact))


def solve_at_motion(sets, d: float, t: float) -> np.ndarray:
    """Return the nodal forces (m,) [N] of a unilateral solve at an approach d [m] and a rotation t beyond the reference."""
    gap = sets.opening - d + t * sets.x
    return (
        np.zeros(sets.x.size)
        if gap.min() >= 0
        else solve_forces(sets.c, sets.x, gap, np.zeros(0))[0]
    )


def check_state(sets, totals: tuple, force, d: float, t: float, tolerance: float) -> None:
    """Check force, load, moment and stored energy against a unilateral solve."""
    load_, moment, energy = totals
    expected = solve_at_motion(sets, d, t)
    assert np.abs(force - expected).max() <= tolerance * max(LOAD, expected.max())
    assert (load_, moment) == pytest.approx(
        (expected.sum(), expected @ sets.x), abs=tolerance * (LOAD + expected.sum())
    )
    stored = force @ sets.c @ force / 2 - sets.energy - d * sets.load + t * sets.moment
    assert energy == pytest.approx(
        stored, abs=tolerance * (sets.energy + abs(d) * sets.load + abs(energy))
    )


def motion_path(sets, state, n_points: int, scale: float = 1.5):
    """Return motions (d, t) that separate the pieces, press them again and tilt them to both sides."""
    k = np.arange(n_points)
    d = scale * state.approach * np.sin(0.7 * k) - 0.2 * state.approach
    return np.stack([d, scale * state.approach / sets.x[-1] * np.sin(1.3 * k + 0.4)], axis=1)


@pytest.mark.parametrize("memory_limit", [64e6, 0.0])
def test_exact_set_search_forces_equal_unilateral_solve(memory_limit):
    """Forces along motions with separation and tilt equal those of a unilateral solve, whatever the memory limit."""
    sets, state = make_crowned_sets()
    arrays, slot = make_search_arrays(sets, memory_limit)
    force = np.zeros(sets.x.size)
    n_separated = 0
    for d, t in motion_path(sets, state, 80):
        slot = PRESS.find_set(arrays, slot, d, t)
        check_state(sets, PRESS.press_state(arrays, slot, d, t, force), force, d, t, 1e-12)
        n_separated += not force.any()
    # The motions need more than 16 sets, so that with memory for 16 of them sets are replaced
    n_stored = arrays.counters[N_STORED]
    assert n_separated >= 5
    assert n_stored > 16 if memory_limit else n_stored == arrays.stored.names.size == 16


@settings(settings.get_profile("costly"))
@given(st.integers(0, 10**6))
def test_always_set_search_solves_rough_surfaces(seed):
    """The set search gives the forces of a unilateral solve on random rough surfaces within 1e-11."""
    rng = np.random.default_rng(seed)
    pieces = make_coated_pair(40)
    x = pieces.interface.x
    gap = draw_gap(rng, x, 2e-7)
    state = press(pieces, gap, LOAD, 0.0)
    force = state.sigma_n * pieces.interface.weight
    sets = ContactSets(pieces.normal, x, gap + state.rotation * x - state.approach, force > 0)
    arrays, slot = make_search_arrays(sets)
    max_overlap = np.abs(sets.opening).max()
    for d, t in rng.normal(size=(6, 2)) * [max_overlap, max_overlap / x[-1]]:
        slot = PRESS.find_set(arrays, slot, d, t)
        check_state(sets, PRESS.press_state(arrays, slot, d, t, force), force, d, t, 1e-11)
