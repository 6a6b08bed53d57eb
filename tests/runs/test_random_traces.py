"""Errors of static measures under random profiles with default settings, against solutions on elements alone."""

from __future__ import annotations

import pytest
from random_traces import compare_trace


@pytest.mark.slow
@pytest.mark.parametrize("first_seed", [3000, 3020, 3040])
def test_always_errors_of_random_profiles_cover_95_percent(first_seed, tmp_path):
    """The error intervals of at least 95 % of the measures of 20 random profiles overlap those of the element solutions."""
    rows = [
        row
        for seed in range(first_seed, first_seed + 20)
        for row in compare_trace(seed, tmp_path)["rows"]
    ]
    assert len(rows) > 100 and sum(row.holds for row in rows) >= 0.95 * len(rows)
