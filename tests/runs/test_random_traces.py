"""Bars of static measures under random traces, nothing pinned, against cells alone."""

from __future__ import annotations

import pytest
from random_traces import drawn, right, scored, sharp

SEEDS = range(3000, 3060)


@pytest.mark.share(3)
@pytest.mark.parametrize("seed", SEEDS)
def test_bars_of_a_random_trace_hold_cells_alone(seed):
    """All bars of a trace meet those of the cells."""
    found = scored(seed)
    wrong = [name for name, row in found["measures"].items() if not right(row)]
    assert not wrong, {name: found["measures"][name] for name in wrong}


def test_exact_the_score_knows_right_and_sharp():
    """(value, error, value beside, error beside, floor): apart by more than both bars; five times what is off."""
    assert right((1.0, 0.1, 1.2, 0.11, 0.0)) and not right((1.0, 0.1, 1.2, 0.09, 0.0))
    assert sharp((1.0, 0.1, 1.05, 0.01, 0.0)) and sharp((1.0, 0.1, 1.0, 0.03, 0.0)) is None
    assert sharp((1.0, 0.3, 1.05, 0.001, 0.0)) is False
    assert [drawn(seed)[0] for seed in range(2)] == ["corner", "roofs"]
