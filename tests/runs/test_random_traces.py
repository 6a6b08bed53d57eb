"""Errors of static measures under random profiles with default settings, against solutions on
elements alone."""

from __future__ import annotations

import pytest
from random_traces import compare_trace

SEEDS = range(3000, 3060)


@pytest.mark.share(3)
@pytest.mark.parametrize("seed", SEEDS)
def test_always_errors_of_random_profile_cover_element_solution(seed, tmp_path):
    """The error intervals of all measures of a random profile overlap those of the solution on
    elements."""
    rows = compare_trace(seed, tmp_path)["rows"]
    assert rows and not [row for row in rows if not row.holds]
