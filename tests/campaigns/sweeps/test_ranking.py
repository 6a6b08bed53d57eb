"""Shares of keys in the variance of a measure, against functions whose shares are known."""

import numpy as np
import pytest
from scipy.stats import qmc

from patchfem.campaigns import compute_sobol_indices

# Ishigami and Homma 1990, a = 7, b = 0.1: closed forms
WHOLE = 0.1 * np.pi**4 / 5 + 0.01 * np.pi**8 / 18 + 0.5 + 49 / 8
FIRST = np.array([0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2, 49 / 8, 0.0]) / WHOLE
TOTAL = FIRST + np.array([1, 0, 1]) * 8 * 0.01 * np.pi**8 / 225 / WHOLE


def ishigami(x):
    x = 2 * np.pi * x - np.pi
    return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def stuck(x):
    """Nothing below a limit, as an interface that holds."""
    return np.where(x[:, 0] + 0.3 * x[:, 1] > 0.6, x[:, 0] + x[:, 2], 0.0)


def drawn(count, keys, seed):
    return qmc.Sobol(keys, rng=np.random.default_rng(seed)).random(count)


def ranks(x, values, errors=0.0, shape=None):
    keys = [(f"k{k}", column) for k, column in enumerate(x.T)]
    return compute_sobol_indices(
        keys, {"loop_area": (values, np.broadcast_to(errors, values.shape))}, shape
    ).get("loop_area")


def of(found):
    return {
        name: np.array([getattr(one, name) for one in sorted(found)])
        for name in ("first", "total", "low", "high")
    }


@pytest.mark.parametrize("count", [128, 256, 1024])
def test_exact_the_shares_of_ishigami_lie_in_their_intervals(count):
    found = of(ranks(drawn(count, 3, count), ishigami(drawn(count, 3, count))))
    assert np.all((found["low"] <= TOTAL) & (TOTAL <= found["high"]))
    assert np.abs(found["total"] - TOTAL).max() < 0.03
    assert np.abs(found["first"] - FIRST).max() < 0.03
    assert np.all(found["high"] - found["low"] < {128: 1, 256: 0.6, 1024: 0.2}[count])


@pytest.mark.parametrize("seed", range(4))
def test_always_a_jump_is_within_the_interval(seed):
    rng = np.random.default_rng(9)
    a, b = rng.random((2, 200_000, 3))
    truth = []
    for k in range(3):
        c = a.copy()
        c[:, k] = b[:, k]
        truth.append(np.mean((stuck(a) - stuck(c)) ** 2) / 2 / stuck(a).var())
    x = np.random.default_rng(seed).random((200, 3))
    found = of(ranks(x, stuck(x)))
    assert np.all((found["low"] <= truth) & (truth <= found["high"]))


def test_exact_a_grid_has_the_shares_of_its_own_cases():
    """y = 2 a + b + a b with a, b of mean 0: parts 4 V(a), V(b), V(a) V(b)."""
    a, b = np.meshgrid([-1.0, 0.0, 1.0], [-3.0, 1.0, 1.0, 1.0], indexing="ij")
    x = np.stack([a.ravel(), b.ravel()], axis=1)
    values = (2 * a + b + a * b).ravel()
    parts = np.array([4 * 2 / 3, 3.0, 2.0])
    found = of(ranks(x, values, shape=(3, 4)))
    np.testing.assert_allclose(found["first"], parts[:2] / parts.sum(), rtol=1e-12)
    np.testing.assert_allclose(found["total"], (parts[:2] + 2) / parts.sum(), rtol=1e-12)
    values[3] = np.nan
    assert ranks(x, values, shape=(3, 4)) is None  # a grid with holes


def test_always_what_the_cases_do_not_tell_is_not_ranked():
    x = drawn(128, 3, 1)
    rng = np.random.default_rng(1)
    assert ranks(x, rng.random(128)) is None  # nothing but noise
    assert ranks(x, np.full(128, 3.0)) is None and ranks(x[:20], ishigami(x[:20])) is None
    assert ranks(x, x[:, 0], errors=1.0) is None  # below its numerical error
    assert ranks(x[:, :1], x[:, 0]) is None  # one key alone
    # who has a value is no fair draw
    assert ranks(x, np.where(x[:, 0] < 0.3, np.nan, x[:, 1])) is None
    found = ranks(x, 3 * x[:, 0] + x[:, 1])
    assert [one.key for one in found] == ["k0", "k1", "k2"] and found[0].total == pytest.approx(
        0.9, abs=0.01
    )
