"""Sobol indices of the keys of a sweep, compared with functions of known indices."""

import numpy as np
import pytest
from scipy.stats import qmc
from sweep_tables import make_random_table, make_table

from patchfem.campaigns.sweeps.ranking import compute_quantiles, rank_keys

# Closed forms for a = 7, b = 0.1 (Ishigami and Homma 1990).
WHOLE = 0.1 * np.pi**4 / 5 + 0.01 * np.pi**8 / 18 + 0.5 + 49 / 8
FIRST = np.array([0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2, 49 / 8, 0.0]) / WHOLE
TOTAL = FIRST + np.array([1, 0, 1]) * 8 * 0.01 * np.pi**8 / 225 / WHOLE


def evaluate_ishigami(x):
    """Return the Ishigami function (n,) of points (n, 3) in the unit cube."""
    x = 2 * np.pi * x - np.pi
    return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def draw_points(count, keys, seed):
    """Return `count` scrambled Sobol points in the unit cube, (count, keys)."""
    return qmc.Sobol(keys, rng=np.random.default_rng(seed)).random(count)


def compute_indices(x, values, errors=0.0):
    """Return the Sobol indices of a measure of random cases, or None if they cannot be determined."""
    table = make_random_table(x, {"loop_area": values}, errors=errors)
    return rank_keys(table).get("loop_area")


def collect_indices(indices):
    """Return first-order and total indices and the ends of their intervals, sorted by key."""
    return {
        name: np.array([getattr(one, name) for one in sorted(indices)])
        for name in ("first", "total", "low", "high")
    }


@pytest.mark.parametrize("count", [128, 1024])
def test_exact_intervals_cover_sobol_indices_of_ishigami(count):
    """The intervals cover the total indices of the Ishigami function.

    The estimates agree with the closed forms within 0.03.
    """
    indices = collect_indices(
        compute_indices(
            draw_points(count, 3, count), evaluate_ishigami(draw_points(count, 3, count))
        )
    )
    assert np.all((indices["low"] <= TOTAL) & (TOTAL <= indices["high"]))
    assert np.abs(indices["total"] - TOTAL).max() < 0.03
    assert np.abs(indices["first"] - FIRST).max() < 0.03
    assert np.all(indices["high"] - indices["low"] < {128: 1, 1024: 0.2}[count])


def test_exact_indices_of_grid_agree_with_its_variances():
    """The indices of a full grid agree with the variances of its cases within 1e-12.

    For y = 2 a + b + a b with a and b of mean 0 the parts are 4 V(a), V(b) and V(a) V(b).
    """
    keys = {"k0": [-1.0, 0.0, 1.0], "k1": [-3.0, 1.0, 1.0, 1.0]}
    a, b = np.meshgrid(*keys.values(), indexing="ij")
    values = 2 * a + b + a * b
    parts = np.array([4 * 2 / 3, 3.0, 2.0])
    indices = collect_indices(rank_keys(make_table(keys, {"loop_area": values}))["loop_area"])
    np.testing.assert_allclose(indices["first"], parts[:2] / parts.sum(), rtol=1e-12)
    np.testing.assert_allclose(indices["total"], (parts[:2] + 2) / parts.sum(), rtol=1e-12)
    values[0, 3] = np.nan
    assert rank_keys(make_table(keys, {"loop_area": values})) == {}


def test_always_undetermined_indices_are_omitted():
    """Indices that the cases do not determine are omitted."""
    x = draw_points(128, 3, 1)
    rng = np.random.default_rng(1)
    assert compute_indices(x, rng.random(128)) is None  # a measure without dependence on the keys
    assert (
        compute_indices(x, np.full(128, 3.0)) is None
        and compute_indices(x[:20], evaluate_ishigami(x[:20])) is None
    )
    assert compute_indices(x, x[:, 0], errors=1.0) is None  # variation below the numerical error
    assert compute_indices(x, x[:, 0] + x[:, 1], errors=0.2)  # a variation of 0.41
    assert compute_indices(x[:, :1], x[:, 0]) is None  # a single key
    # The points with a value are no uniform sample.
    assert compute_indices(x, np.where(x[:, 0] < 0.3, np.nan, x[:, 1])) is None
    indices = compute_indices(x, 3 * x[:, 0] + x[:, 1])
    assert [one.key for one in indices] == ["k0", "k1", "k2"] and indices[0].total == pytest.approx(
        0.9, abs=0.01
    )


def test_exact_quantiles_of_uniform_cases():
    """The quantiles of a measure that is uniform in [0, 1] are 0.05, 0.5 and 0.95 within the spacing of 1024 cases.

    If more than a tenth of the cases has not settled, they are not known.
    """
    x = draw_points(1024, 2, 3)
    outcome = np.full(1024, "steady", object)
    table = make_random_table(x, {"loop_area": x[:, 0]}, outcome=outcome)
    found = [one.value for one in compute_quantiles(table)["loop_area"]]
    np.testing.assert_allclose(found, [0.05, 0.5, 0.95], atol=2 / 1024)
    outcome[:200] = "transient"
    assert compute_quantiles(table) == {}


def test_always_interval_of_quantiles_contains_the_true_ones():
    """Of 200 samples of 60 exponential values, 95 % have each quantile inside; 30 values do not bound 5 % from below."""
    rng = np.random.default_rng(61)
    true = -np.log(1 - np.array([0.05, 0.5, 0.95]))
    held = []
    for _ in range(200):
        x = rng.random((60, 1))
        table = make_random_table(x, {"loop_area": -np.log(1 - x[:, 0])})
        held.append(
            [
                not (one.low > value or one.high < value)
                for one, value in zip(compute_quantiles(table)["loop_area"], true, strict=True)
            ]
        )
    assert np.mean(held, axis=0).min() >= 0.95
    few = make_random_table(x[:30], {"loop_area": x[:30, 0]})
    low, median, high = compute_quantiles(few)["loop_area"]
    assert np.isnan(low.low) and np.isnan(high.high)
    assert low.value < low.high < median.low < median.value < median.high < high.value
