"""Order in which coupled points yield: elements from one factorisation against a new solution after
each yield."""

import numpy as np
import pytest
from yielding_points import solve_after_each_yield

from patchfem.core import PatchfemError
from patchfem.partial_slip import make_jenkins_set, shear_modes


def half_plane_compliance(count: int):
    """Return the compliance of irregularly spaced points on a line, which falls with the logarithm
    of the distance."""
    x = np.cumsum(1 + 0.3 * np.sin(1.7 * np.arange(count)))
    distance = np.abs(x[:, None] - x)
    return np.log((x[-1] + 2 - x[0]) / np.where(distance > 0, distance, 0.3))


# Without sorting passes, the order follows from removing points one by one
@pytest.mark.parametrize("max_passes", [shear_modes.MAX_SORTING_PASSES, 0])
@pytest.mark.parametrize("count", [1, 7, 60])
def test_exact_yield_order_agrees_with_repeated_solution(count, max_passes, monkeypatch):
    """Yield slides, forces and stiffnesses agree within 1e-11 with a system that is solved again
    after every yield."""
    monkeypatch.setattr(shear_modes, "MAX_SORTING_PASSES", max_passes)
    rng = np.random.default_rng(count)
    limit = rng.uniform(0.5, 2, count)
    c = half_plane_compliance(count)
    group = make_jenkins_set(c, limit, 0.05)
    yield_slides, rates = solve_after_each_yield(c + np.diag(0.05 / limit), limit)
    assert group.yield_displacement == pytest.approx(yield_slides, rel=1e-11)
    force_matrix = -np.diff(rates, axis=0, append=np.zeros((1, count))).T
    np.testing.assert_allclose(
        group.force_matrix, force_matrix, rtol=0, atol=1e-11 * np.abs(rates).max()
    )
    np.testing.assert_allclose(
        group.stiffness, force_matrix.sum(axis=0), rtol=0, atol=1e-11 * rates.sum(axis=1).max()
    )


def test_refuses_indefinite_compliance():
    """A compliance matrix that is not positive definite is refused."""
    with pytest.raises(PatchfemError, match="not positive definite"):
        make_jenkins_set(np.array([[1.0, 2.0], [2.0, 1.0]]), np.ones(2))
