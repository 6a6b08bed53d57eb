"""A bonded spring added to the modes gives the same structure as a spring included from the start."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from modal_bases import make_modal_basis

from patchfem.core import PatchfemError
from patchfem.structure import compute_receptance, masses
from patchfem.structure.bonded import add_spring, remove_springs

ONE_MODE = make_modal_basis(3.0, 0.01, [0.8], mass=2.0)


@given(st.integers(0, 10**6))
def test_always_added_spring_equals_included_spring(seed):
    """A spring and damper added to the modes give the frequencies and responses of a structure that includes them."""
    rng = np.random.default_rng(seed)
    m = rng.uniform(0.5, 2, 3)
    k = rng.uniform(1, 9, 3)
    c = rng.uniform(0, 0.3, 2)
    springs = [((1, 0), k[0]), ((1, 2), k[1]), ((2, 3), k[2])]
    dampers = [((1, 0), c[0]), ((2, 3), c[1])]
    added = add_spring(masses.build_basis(m, springs, dampers, [(3, 1)], 2), 4.0, 0.2)
    included = masses.build_basis(
        m, [*springs, ((3, 1), 4.0)], [*dampers, ((3, 1), 0.2)], [(3, 1)], 2
    )
    np.testing.assert_allclose(added.omega, included.omega, rtol=1e-12)
    omega = np.array([0.3, 1.1, 2.7])
    for name in ("slide", "output"):
        computed = compute_receptance(added, omega, getattr(added, name), added.base)
        np.testing.assert_allclose(
            computed,
            compute_receptance(included, omega, getattr(included, name), included.base),
            rtol=1e-9,
        )
    z = rng.normal(size=3)
    np.testing.assert_allclose(
        added.interfaces @ z, np.array([[-1.0, 0, 1]]) @ added.shapes @ z, rtol=1e-9, atol=1e-12
    )


def test_refuses_removing_spring_stiffer_than_modes():
    """Removing a spring or damper larger than that of the modes is refused."""
    with pytest.raises(PatchfemError, match=r"is 111\.1 % of the stiffness"):
        remove_springs(ONE_MODE, [9 * 2 / 0.64 / 0.9])
    with pytest.raises(PatchfemError, match=r"bonded\.damping is larger than the damping"):
        remove_springs(ONE_MODE, [5.0], 1.0)
