"""Bars of static measures under random traces, nothing pinned, against cells alone."""

from __future__ import annotations

import pytest
from random_traces import right, scored

SEEDS = range(3000, 3060)


@pytest.mark.share(3)
@pytest.mark.parametrize("seed", SEEDS)
def test_bars_of_a_random_trace_hold_cells_alone(seed):
    """All bars of a trace meet those of the cells."""
    found = scored(seed)
    wrong = [name for name, row in found["measures"].items() if not right(row)]
    assert not wrong, {name: found["measures"][name] for name in wrong}
