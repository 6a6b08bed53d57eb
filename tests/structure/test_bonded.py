"""A bonded spring worked into the modes is the same structure as one that had the spring from the start."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from modal_bases import basis_of

from patchfem.core import PatchfemError
from patchfem.structure import compute_receptance, masses
from patchfem.structure.bonded import add_spring, remove_springs


def one(omega=3.0, zeta=0.01, slide=0.8, mass=2.0):
    return basis_of(omega, zeta, [slide], mass=mass)


@given(st.integers(0, 10**6))
def test_always_equals_a_spring_that_was_there(seed):
    """Masses with the spring and damper across the interface, and folded in later: same frequencies, same responses."""
    rng = np.random.default_rng(seed)
    m = rng.uniform(0.5, 2, 3)
    k = rng.uniform(1, 9, 3)
    c = rng.uniform(0, 0.3, 2)
    springs = [((1, 0), k[0]), ((1, 2), k[1]), ((2, 3), k[2])]
    dampers = [((1, 0), c[0]), ((2, 3), c[1])]
    late = add_spring(masses.build_basis(m, springs, dampers, [(3, 1)], 2), 4.0, 0.2)
    soon = masses.build_basis(m, [*springs, ((3, 1), 4.0)], [*dampers, ((3, 1), 0.2)], [(3, 1)], 2)
    np.testing.assert_allclose(late.omega, soon.omega, rtol=1e-12)
    omega = np.array([0.3, 1.1, 2.7])
    for row in ("slide", "output"):
        ours = compute_receptance(late, omega, getattr(late, row), late.base)
        np.testing.assert_allclose(
            ours, compute_receptance(soon, omega, getattr(soon, row), soon.base), rtol=1e-9
        )
    z = rng.normal(size=3)
    np.testing.assert_allclose(
        late.interfaces @ z, np.array([[-1.0, 0, 1]]) @ late.shapes @ z, rtol=1e-9, atol=1e-12
    )


def test_exact_no_spring_changes_nothing():
    base = masses.build_basis([1.0, 2.0], [((1, 0), 3.0), ((2, 1), 1.0)], [], [(2, 0)], 1)
    found = add_spring(base, 0.0)
    np.testing.assert_allclose(found.omega, base.omega, rtol=1e-15)
    np.testing.assert_allclose(np.abs(found.slide), np.abs(base.slide), rtol=1e-15)
    assert found.damping is None


@given(st.integers(0, 10**6))
def test_always_what_a_joint_adds_comes_off_again(seed):
    """Springs along up to two interfaces and a damper worked into up to four modes, then taken off: the same basis."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    faces = int(rng.integers(1, 3))
    rows = rng.uniform(-1, 1, (faces, n))
    k = rng.uniform(0.1, 5, faces)
    c = rng.uniform(0, 0.3)
    omega = np.sort(rng.uniform(1, 4, n))
    base = basis_of(
        omega, rng.uniform(0, 0.1, n), rows, rng.uniform(-1, 1, n), rng.uniform(-1, 1, n), mass=2.0
    )
    held = add_spring(base, k[0], c)
    for row, one in zip(held.interfaces[1:], k[1:]):
        held = replace(add_spring(replace(held, faces=row[None]), one), faces=None)
        held = replace(held, faces=rows @ held.shapes, slide=rows[0] @ held.shapes)
    found = remove_springs(held, k, c)
    np.testing.assert_allclose(found.omega, omega, rtol=1e-10)
    at = np.array([0.3, 1.1, 2.7])
    np.testing.assert_allclose(
        compute_receptance(found, at, found.interfaces, found.base),
        compute_receptance(base, at, rows, base.base),
        rtol=1e-8,
    )


def test_exact_a_rigid_mode_that_a_joint_held_is_rigid_again():
    held = add_spring(one(omega=0.0, zeta=0.0), 5.0)
    found = remove_springs(held, [5.0])
    assert found.omega[0] == 0.0 and remove_springs(one(), [5.0]).shapes is None


def test_refuses_a_joint_stiffer_than_the_modes():
    with pytest.raises(PatchfemError, match=r"is 111\.1 % of the stiffness"):
        remove_springs(one(), [9 * 2 / 0.64 / 0.9])
    with pytest.raises(PatchfemError, match=r"bonded\.damping is larger than the damping"):
        remove_springs(one(), [5.0], 1.0)
