"""Bars of static measures under random traces, nothing pinned, against cells alone."""

from __future__ import annotations

import pytest
from random_traces import compare_trace

SEEDS = range(3000, 3060)


@pytest.mark.share(3)
@pytest.mark.parametrize("seed", SEEDS)
def test_bars_of_a_random_trace_hold_cells_alone(seed, tmp_path):
    """All intervals of a trace overlap those of the cells."""
    rows = compare_trace(seed, tmp_path)["rows"]
    assert rows and not [row for row in rows if not row.holds]
