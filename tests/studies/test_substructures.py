"""Structures of a finite-element program: the other side of the study is right, and reduced ones stay near it."""

import numpy as np
import pytest
from scipy.sparse.linalg import splu
from study_module import study


@pytest.fixture(scope="module")
def large():
    return study("substructures/large.py")


def test_exact_receptances_of_all_unknowns(large):
    """Those by a Krylov space are those of the factored dynamic stiffness, at the first and the last harmonic, to the
    round-off of the solutions that the space is made of: half of it gives the same."""
    make, pairs, pushed, watched, _, coarse = large.STRUCTURES["lap joint"]
    model = make(coarse)
    rows, _ = large.rows_of(model, pairs, pushed, watched)
    whole = large.Whole(model, rows)
    for omega in 2 * np.pi * whole.frequencies[0] * np.array([0.9, 0.9 * large.TOP]):
        own = model.stiffness + 1j * omega * model.damping - omega**2 * model.mass
        wanted = splu(own.tocsc()).solve(whole.loads + 0j)[rows]
        found, rest = whole.at(omega)
        assert np.abs(found - wanted).max() < 1e-8 * np.abs(wanted).max() and rest < 1e-8


def test_exact_loop_of_an_element(large):
    """4 F (A - F/k) for an element of k that slips at F along a sine of A."""
    stiffness, limit, amplitude, count = 2e6, 3.0, 1e-5, 20000
    slide = amplitude * np.cos(2 * np.pi * np.arange(count) / count)[None, None]
    force = large.friction(slide, np.array([stiffness]), np.array([limit]))
    work = ((force + np.roll(force, -1)) / 2 * (np.roll(slide, -1) - slide)).sum()
    assert work == pytest.approx(4 * limit * (amplitude - limit / stiffness), rel=1e-6)


def held(rows) -> bool:
    return len(rows) > 1 and all(
        abs(true - value) <= bar + own for _, _, true, own, value, bar in rows
    )


def test_always_the_bars_of_a_coarse_joint_hold_all_of_it(large):
    effort = large.Effort(harmonics=21, samples=1024)
    assert held(large.compare("lap joint", 11, True, 1, ("free-interface",), effort))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lap joint", "three blades"])
def test_always_the_bars_of_a_large_structure_hold_all_of_it(large, name):
    assert held(large.compare(name, 11, False, 1, ("free-interface",)))
