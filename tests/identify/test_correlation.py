"""Rows that correlate count as fewer: against the closed form of a first-order process, and as intervals that hold."""

import numpy as np
import pytest

from patchfem.identify import Problem
from patchfem.identify.correlation import estimate_effective_rows


def process(count, tie, seed):
    """First-order autoregressive noise of unit variance."""
    rng = np.random.default_rng(seed)
    out = np.empty(count)
    out[0] = rng.normal()
    for k in range(1, count):
        out[k] = tie * out[k - 1] + np.sqrt(1 - tie * tie) * rng.normal()
    return out


@pytest.mark.share(1)
@pytest.mark.parametrize("tie", [0.0, 0.5, 0.8])
def test_rows_of_a_first_order_process(tie):
    """n (1 - a)/(1 + a) for n large; the median of 200 series lies within three of its own standard errors of that."""
    found = np.array([estimate_effective_rows(process(2000, tie, seed)) for seed in range(200)])
    within = 3 * np.sqrt(np.pi / 2) * found.std() / np.sqrt(found.size)
    assert within < 0.05 * found.mean()
    assert np.median(found) == pytest.approx(2000 * (1 - tie) / (1 + tie), abs=within)


def test_cycles_that_repeat_count_once():
    """A residual that is the same in each of four cycles tells as much as in one of them, four others as 800/8 rows."""
    alike = []
    other = []
    for seed in range(400):
        rng = np.random.default_rng(seed)
        cycles = [np.convolve(rng.normal(size=207), np.ones(8), "valid") for _ in range(4)]
        alike.append(
            estimate_effective_rows(np.tile(cycles[0], 4)) / estimate_effective_rows(cycles[0])
        )
        other.append(estimate_effective_rows(np.concatenate(cycles)))
    assert np.median(alike) == pytest.approx(1, abs=0.01)
    # three standard errors of the median
    assert np.median(other) == pytest.approx(800 / 8, rel=0.03)


def covered(bars, seeds, tie):
    """Share of 95 % intervals of a straight line's two numbers that hold them."""
    x = np.linspace(-1, 1, 200)
    inside = []
    for seed in seeds:
        y = 0.35 + 0.2 * x + 0.05 * process(200, tie, seed)
        found = Problem(
            lambda v, y=y: v[0] + v[1] * x - y, [0.0, -1.0], [1.0, 1.0], start=[0.5, 0.0]
        ).solve(max_descents=1, interval_kind=bars)
        inside.append(
            (found.intervals.ends[:, 0] <= [0.35, 0.2])
            & ([0.35, 0.2] <= found.intervals.ends[:, 1])
        )
    return np.mean(inside)


def test_intervals_hold_where_neighbours_correlate():
    """95 % intervals from 80 series: with rows taken as independent they hold far less often."""
    assert covered("series", range(80), 0.8) >= 0.88
    assert covered("rows", range(80), 0.8) <= 0.6
    assert covered("series", range(40), 0.0) >= 0.9
