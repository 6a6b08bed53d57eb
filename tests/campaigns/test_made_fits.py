"""Fits to made data with 3 % noise: 90 to 99 % of the 95 % intervals hold the true values."""

import numpy as np
import pytest
from made_fits import compare_fit


@pytest.mark.parametrize(
    "first, count",
    [
        (102, 4),
        pytest.param(104, 20, marks=pytest.mark.slow),
        pytest.param(103, 10, marks=pytest.mark.slow),
    ],
    ids=["loops", "decays", "curves"],
)
def test_always_intervals_hold_with_noise(first, count, tmp_path):
    """At least 85 % of the intervals hold, fewer than 90 % by chance of few fits, and they are not far too wide."""
    rows = []
    for seed in range(first, first + 3 * count, 3):
        rows += compare_fit(seed, tmp_path)["rows"]
    assert len(rows) >= count
    assert np.mean([row.holds for row in rows]) >= 0.85
    distances = [row.true_error / row.error for row in rows]
    assert np.median(distances) > 0.15  # 0.34 for normal errors
