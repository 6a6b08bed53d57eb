"""The effective number of correlated rows: closed form of a first-order process, and coverage of intervals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.identify import Problem
from patchfem.identify.intervals import estimate_effective_rows


def autoregressive_noise(n_samples, correlation, seed):
    """Return first-order autoregressive noise of unit variance."""
    rng = np.random.default_rng(seed)
    noise = np.empty(n_samples)
    noise[0] = rng.normal()
    for k in range(1, n_samples):
        noise[k] = (
            correlation * noise[k - 1] + np.sqrt(1 - correlation * correlation) * rng.normal()
        )
    return noise


@pytest.mark.share(1)
@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.8])
def test_effective_rows_of_first_order_process(correlation):
    """The median effective number of rows agrees with n (1 - a)/(1 + a) within three standard errors."""
    effective_rows = np.array(
        [
            estimate_effective_rows(autoregressive_noise(2000, correlation, seed))
            for seed in range(200)
        ]
    )
    tolerance = 3 * np.sqrt(np.pi / 2) * effective_rows.std() / np.sqrt(effective_rows.size)
    assert tolerance < 0.05 * effective_rows.mean()
    assert np.median(effective_rows) == pytest.approx(
        2000 * (1 - correlation) / (1 + correlation), abs=tolerance
    )


def test_repeated_cycles_count_as_single_cycle():
    """Four identical cycles have the effective rows of one cycle, and four independent cycles have 800/8."""
    ratios = []
    independent_rows = []
    for seed in range(400):
        rng = np.random.default_rng(seed)
        cycles = [np.convolve(rng.normal(size=207), np.ones(8), "valid") for _ in range(4)]
        ratios.append(
            estimate_effective_rows(np.tile(cycles[0], 4)) / estimate_effective_rows(cycles[0])
        )
        independent_rows.append(estimate_effective_rows(np.concatenate(cycles)))
    assert np.median(ratios) == pytest.approx(1, abs=0.01)
    # three standard errors of the median
    assert np.median(independent_rows) == pytest.approx(800 / 8, rel=0.03)


def coverage_of_line_fit(interval_kind, seeds, correlation):
    """Return the fraction of 95 % intervals of a straight-line fit that cover the true values."""
    x = np.linspace(-1, 1, 200)
    is_covered = []
    for seed in seeds:
        y = 0.35 + 0.2 * x + 0.05 * autoregressive_noise(200, correlation, seed)
        fit = Problem(
            lambda v, y=y: v[0] + v[1] * x - y, [0.0, -1.0], [1.0, 1.0], start=[0.5, 0.0]
        ).solve(max_descents=1, interval_kind=interval_kind)
        is_covered.append(
            (fit.intervals.ends[:, 0] <= [0.35, 0.2]) & ([0.35, 0.2] <= fit.intervals.ends[:, 1])
        )
    return np.mean(is_covered)


def test_intervals_cover_values_with_correlated_noise():
    """Intervals that allow for correlation cover the true values; with rows taken as independent they cover far fewer."""
    assert coverage_of_line_fit("series", range(40), 0.8) >= 0.88
    assert coverage_of_line_fit("rows", range(40), 0.8) <= 0.6
    assert coverage_of_line_fit("series", range(40), 0.0) >= 0.9


@pytest.mark.parametrize("residual", [np.zeros(40), np.full(40, 3e-7)], ids=["zero", "constant"])
def test_exact_residual_without_scatter_counts_every_row(residual):
    """A residual that is constant, such as that of an exact fit, has no correlation between rows."""
    assert estimate_effective_rows(residual) == 40


@given(st.integers(0, 999), st.floats(-1e6, 1e6), st.sampled_from([1e-9, -3.0, 1e7]))
def test_exact_effective_rows_depend_on_neither_unit_nor_direction(seed, offset, factor):
    """The number is that of a residual in another unit, with another mean, or read from its end."""
    noise = np.random.default_rng(seed).normal(size=203)
    residual = np.convolve(noise, np.ones(4), "valid")
    rows = estimate_effective_rows(residual)
    assert 1 <= rows < 120
    for same in (factor * residual, residual[::-1], residual + 1e-9 * offset):
        assert estimate_effective_rows(same) == pytest.approx(rows, rel=1e-6)
