"""Points that yield one after the other: the compiled order beside its NumPy twin, which solves anew after each."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.slip.shear_modes import jenkins_set


def yielded(c, limit):
    """(slides (t,) [m] at which points behind the compliance c (n, n) yield at `limit` (n,) [N], rates (t, n) [N/m] of
    the points before each)."""
    stick, carried, slide, at, rates = np.ones(limit.size, bool), np.zeros(limit.size), 0.0, [], []
    while stick.any():
        rate = np.zeros(limit.size)
        rate[stick] = np.linalg.solve(c[np.ix_(stick, stick)], np.ones(stick.sum()))
        wait = np.where(stick & (rate > 0), (limit - carried) / np.where(rate > 0, rate, 1.0), np.inf)
        first = max(wait.min(), 0.0)
        slide, carried = slide + first, carried + rate * first
        at.append(slide)
        rates.append(rate)
        stick &= wait > first * (1 + 1e-9)
    return np.array(at), np.array(rates)


def half_plane(count: int):
    """Compliance of neighbours on a line that feel each other by the logarithm of their distance: no two are alike."""
    x = np.cumsum(1 + 0.3 * np.sin(1.7 * np.arange(count)))
    apart = np.abs(x[:, None] - x)
    return np.log((x[-1] + 2 - x[0]) / np.where(apart > 0, apart, 0.3))


@pytest.mark.parametrize("count", [1, 2, 7, 60])
@pytest.mark.parametrize("local", [0.0, 0.05])
def test_exact_the_order_is_that_of_an_inverse_made_anew_after_every_yield(count, local):
    r = np.random.default_rng(count)
    limit, c = r.uniform(0.5, 2, count), half_plane(count)
    group = jenkins_set(c, limit, local)
    at, rates = yielded(c + np.diag(local / limit), limit)
    assert group.yield_slide == pytest.approx(at, rel=1e-11)
    share = -np.diff(rates, axis=0, append=np.zeros((1, count))).T
    np.testing.assert_allclose(group.share, share, rtol=0, atol=1e-11 * np.abs(rates).max())
    np.testing.assert_allclose(group.stiffness, share.sum(axis=0), rtol=0, atol=1e-11 * rates.sum(axis=1).max())


def test_exact_mirrored_points_yield_at_once():
    """Eight points of even pressure on an even line: four yields of two points each."""
    apart = np.abs(np.subtract.outer(np.arange(8.0), np.arange(8.0)))
    c = np.log(20 / np.where(apart > 0, apart, 0.3))
    group = jenkins_set(c, np.ones(8))
    assert group.yield_slide.size == 4 and (np.count_nonzero(group.share[:, 0]) == 8)
    np.testing.assert_allclose(group.share[:4], group.share[:3:-1], rtol=0, atol=1e-14 * group.share.max())
    np.testing.assert_allclose(group.share @ group.yield_slide, np.ones(8), rtol=1e-12)


def test_refuses_a_compliance_that_is_not_positive_definite():
    with pytest.raises(PatchfemError, match="not positive definite"):
        jenkins_set(np.array([[1.0, 2.0], [2.0, 1.0]]), np.ones(2))
