"""Points that yield one after the other: elements from one factor beside those of a solve after each yield."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.slip import jenkins_set, shear_modes


def yielded(c, limit):
    """(slides (t,) [m] at which points behind the compliance c (n, n) yield at `limit` (n,) [N], rates (t, n) [N/m] of
    the points before each)."""
    stick = np.ones(limit.size, bool)
    carried = np.zeros(limit.size)
    slide = 0.0
    at = []
    rates = []
    while stick.any():
        rate = np.zeros(limit.size)
        rate[stick] = np.linalg.solve(c[np.ix_(stick, stick)], np.ones(stick.sum()))
        wait = np.where(
            stick & (rate > 0), (limit - carried) / np.where(rate > 0, rate, 1.0), np.inf
        )
        first = max(wait.min(), 0.0)
        slide = slide + first
        carried = carried + rate * first
        at.append(slide)
        rates.append(rate)
        stick &= wait > first * (1 + 1e-9)
    return np.array(at), np.array(rates)


def half_plane(count: int):
    """Compliance of neighbours on a line that feel each other by the logarithm of their distance: no two are alike."""
    x = np.cumsum(1 + 0.3 * np.sin(1.7 * np.arange(count)))
    apart = np.abs(x[:, None] - x)
    return np.log((x[-1] + 2 - x[0]) / np.where(apart > 0, apart, 0.3))


# the order of no yields alone is put right by exchanges, or by points that are taken out one by one
@pytest.mark.parametrize(
    ("tries", "swaps"),
    [
        (shear_modes.MAX_SORTING_PASSES, shear_modes.MAX_EXCHANGES),
        (0, shear_modes.MAX_EXCHANGES),
        (0, -1),
    ],
)
@pytest.mark.parametrize("count", [1, 2, 7, 60])
@pytest.mark.parametrize("local", [0.0, 0.05])
def test_exact_the_order_is_that_of_a_system_solved_anew_after_every_yield(
    count, local, tries, swaps, monkeypatch
):
    monkeypatch.setattr(shear_modes, "MAX_SORTING_PASSES", tries)
    monkeypatch.setattr(shear_modes, "MAX_EXCHANGES", swaps)
    r = np.random.default_rng(count)
    limit = r.uniform(0.5, 2, count)
    c = half_plane(count)
    group = jenkins_set(c, limit, local)
    at, rates = yielded(c + np.diag(local / limit), limit)
    assert group.yield_displacement == pytest.approx(at, rel=1e-11)
    share = -np.diff(rates, axis=0, append=np.zeros((1, count))).T
    np.testing.assert_allclose(group.force_matrix, share, rtol=0, atol=1e-11 * np.abs(rates).max())
    np.testing.assert_allclose(
        group.stiffness, share.sum(axis=0), rtol=0, atol=1e-11 * rates.sum(axis=1).max()
    )
    assert group.n_reluctant == np.sum(rates[0] <= 0)


@pytest.mark.parametrize("count", [8, 400])
def test_exact_mirrored_points_yield_at_once(count):
    """Points of even pressure on an even line: half as many yields of two points each."""
    apart = np.abs(np.subtract.outer(np.arange(float(count)), np.arange(float(count))))
    c = np.log(3 * count / np.where(apart > 0, apart, 0.3))
    group = jenkins_set(c, np.ones(count))
    assert (
        group.yield_displacement.size == count // 2
        and np.count_nonzero(group.force_matrix[:, 0]) == count
    )
    np.testing.assert_allclose(
        group.force_matrix[: count // 2],
        group.force_matrix[: count // 2 - 1 : -1],
        rtol=0,
        atol=1e-12 * group.force_matrix.max(),
    )
    np.testing.assert_allclose(
        group.force_matrix @ group.yield_displacement, np.ones(count), rtol=1e-12
    )


def test_refuses_a_compliance_that_is_not_positive_definite():
    with pytest.raises(PatchfemError, match="not positive definite"):
        jenkins_set(np.array([[1.0, 2.0], [2.0, 1.0]]), np.ones(2))
